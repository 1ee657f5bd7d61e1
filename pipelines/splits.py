"""Which split a group of recordings goes to."""

from __future__ import annotations

import hashlib

from pipelines.dataset_settings import Split, SplitSettings

DIGEST_RANGE = 2.0**64


def split_of(recording: str, settings: SplitSettings, seed: int) -> tuple[str, Split]:
    """The group of a recording and the split of that group.

    A group without a declared split draws one from its own name and the seed: the draw does not
    depend on which other recordings there are, so one that is added later moves none.
    """
    group = settings.group_of(recording)
    if group.split is not None:
        return group.name, group.split
    digest = hashlib.sha256(f"{seed}/{group.name}".encode()).digest()
    draw = int.from_bytes(digest[:8], "big") / DIGEST_RANGE
    if draw < settings.train:
        return group.name, "train"
    return group.name, "validation" if draw < settings.train + settings.validation else "test"
