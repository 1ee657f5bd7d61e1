"""Which split a group of recordings goes to."""

from __future__ import annotations

import hashlib

from pipelines.dataset_settings import Split, SplitSettings

DIGEST_RANGE = 2.0**64


def split_of(
    recording: str, recording_digest: str, settings: SplitSettings, seed: int
) -> tuple[str, Split]:
    """The group of a recording and the split of that group.

    A recording in no declared group is its own, named by its digest. A group without a declared
    split draws one from its name and the seed: the draw does not depend on which other recordings
    there are, nor on what they are called, so adding or renaming one moves none.
    """
    group = settings.group_of(recording)
    name = group.name if group else recording_digest[:12]
    if group is not None and group.split is not None:
        return name, group.split
    digest = hashlib.sha256(f"{seed}/{name}".encode()).digest()
    draw = int.from_bytes(digest[:8], "big") / DIGEST_RANGE
    if draw < settings.train:
        return name, "train"
    return name, "validation" if draw < settings.train + settings.validation else "test"
