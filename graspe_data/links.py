"""Which links are followed: those that stay in their folder, in a cache, or where the user says.

Hubs and version control lay a file once, under its digest, and links to it where it is used; on
clusters folders of links point to a common disk. A link to anywhere else may be a mistake, or a
trap in somebody else's folder, so that it is refused.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from graspe_data.errors import GraspeError

FOLLOWED_VARIABLE = "GRASPE_LINKS"
"""Names folders into which links are followed, as PATH names folders."""
CACHES = (".git/annex/objects", ".dvc/cache")
"""Of git-annex (DataLad) and of DVC, in the folder of a repository."""


def check_link(file: Path, folder: Path, error: type[GraspeError]) -> None:
    """Refuse a file that is not where it seems to be, unless it is where links are followed.

    Links are followed within ``folder``; where that lies in a hub's cache, as
    ``<repository>/snapshots/<commit>``, into the ``blobs`` of the same repository; where it lies in
    a repository of git-annex or DVC, into its cache; and into the folders that the environment's
    ``GRASPE_LINKS`` names. Who reads the file still has to compare its digest.

    Args:
        file: In ``folder``, at any depth. It need not be there.
        folder: May be a link itself.
        error: What to raise.

    Raises:
        GraspeError: Names the link and its target, and says how to have it followed.
    """
    try:
        target, own = file.resolve(), folder.resolve()
    except (OSError, RuntimeError) as fault:
        raise error(f"{file}: a link that leads to itself. Copy the file anew.") from fault
    if target.is_relative_to(own):
        return
    if any(target.is_relative_to(root) for root in _roots(folder, own)):
        return
    raise error(
        f"{file}: a link to {target}, which lies out of {folder} and of any cache. If it is yours, "
        f"name the folder that it leads to: {FOLLOWED_VARIABLE}={target.parent} (several with "
        f"{os.pathsep!r} between them); or copy the files in place of the links (cp -rL)."
    )


def _roots(folder: Path, own: Path) -> Iterator[Path]:
    """Where links from a folder may lead, beside the folder itself."""
    for place in dict.fromkeys((folder.absolute(), own)):
        for above in (place, *place.parents):
            if above.parent.name == "snapshots":
                yield (above.parent.parent / "blobs").resolve()
            yield from ((above / cache).resolve() for cache in CACHES if (above / cache).is_dir())
    named = os.environ.get(FOLLOWED_VARIABLE, "").split(os.pathsep)
    yield from (Path(name).expanduser().resolve() for name in named if name.strip())
