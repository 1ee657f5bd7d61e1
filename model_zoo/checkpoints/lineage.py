"""What a checkpoint's weights were made with, beside its model, its recipe and its dataset."""

from __future__ import annotations

from typing import Annotated, Final

from pydantic import Field

from graspe_data.documents import Sha256
from graspe_data.errors import ZooError
from graspe_data.manifest import Settings
from graspe_data.shards.dataset_index import DatasetIndex, RecordingEntry

TAUGHT, CHOSE = "train", "validation"
_OF_THE_ROBOT: Final = frozenset(
    {"rings", "intensity_maximum", "minimum_range", "maximum_range", "base_height"}
)


class Lineage(Settings):
    """The recordings behind a checkpoint, and how many processes shared a step.

    A recording has up to two digests, of its bytes and of its content; both count.

    Attributes:
        ranks: Processes, each with the recipe's batch size.
        taught: Digests of the recordings that taught the weights.
        chose: Digests of those by which the epoch was chosen and the temperature fitted.
    """

    ranks: Annotated[int, Field(ge=1)] = 1
    taught: tuple[Sha256, ...] = ()
    chose: tuple[Sha256, ...] = ()

    @classmethod
    def of(cls, index: DatasetIndex, ranks: int) -> Lineage:
        """The lineage of a training on a dataset."""
        splits = {
            split: tuple(
                sorted(
                    digest
                    for entry in index.recordings
                    if entry.split == split
                    for digest in _digests(entry)
                )
            )
            for split in (TAUGHT, CHOSE)
        }
        return cls(ranks=ranks, taught=splits[TAUGHT], chose=splits[CHOSE])

    def check_unseen(
        self, index: DatasetIndex, split: str, where: str, *, own: bool = False
    ) -> None:
        """Refuse to examine a model on recordings that made it.

        Rows of the splits ``train`` and ``validation`` may be looked at under their own names. With
        ``own``, the dataset is the one that taught the model: blocks of time of a recording that
        are in its test split are then known to be apart from those that taught.

        Raises:
            ZooError: A recording of another split taught the weights, or chose them.
        """
        if split in (TAUGHT, CHOSE):
            return
        known = {TAUGHT: {*self.taught}, CHOSE: {*self.chose}}
        examined = [
            entry
            for entry in index.recordings
            if entry.split == split and not (own and entry.blocks_ns)
        ]
        for role, digests in known.items():
            seen = [entry.name for entry in examined if digests & _digests(entry)]
            if seen:
                raise ZooError(
                    f"{where}: {len(seen)} of the {len(examined)} recordings of the split "
                    f"{split!r} were in the {role} split of the checkpoint's own dataset, first "
                    f"{seen[0]}. A score on them is no score on unseen data: evaluate on the "
                    f"dataset that the checkpoint was trained on, or train it anew on this one."
                )


def _digests(entry: RecordingEntry) -> set[str]:
    content = entry.details.get("content")
    return {digest for digest in (entry.digest, content) if isinstance(digest, str) and digest}


def check_observed_alike(trained: object, found: object, where: str) -> None:
    """Refuse rows that were made by other settings than those that taught the model.

    What describes the robot may differ: a model may be tried on another one.

    Args:
        trained: ``ObservationSettings`` of the checkpoint, as JSON has it.
        found: That of the dataset.
        where: The dataset, for the error's text.

    Raises:
        ZooError: Names the first setting that differs, with both values.
    """
    for key, one, other in _differences(trained, found):
        if key.rpartition(".")[2] not in _OF_THE_ROBOT:
            raise ZooError(
                f"{where}: its rows were made with {key} {other}, the checkpoint's with {one}. "
                f"Build the dataset with the settings that it was trained with, or train anew."
            )


def _differences(one: object, other: object, key: str = "") -> list[tuple[str, object, object]]:
    if not (isinstance(one, dict) and isinstance(other, dict)):
        return [(key, one, other)] if one != other else []
    names = sorted({*one, *other})
    inner = (
        _differences(one.get(name), other.get(name), f"{key}.{name}".lstrip(".")) for name in names
    )
    return [found for part in inner for found in part]
