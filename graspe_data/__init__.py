"""What one observation is: recordings, observations, labels and shards, in numpy."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from graspe_data.lazy_names import lazy_names

if TYPE_CHECKING:
    from graspe_data.manifest import load_manifest as load_manifest
    from graspe_data.recordings import open_recording as open_recording
    from graspe_data.robot import Robot as Robot
    from graspe_data.robot import load_robot as load_robot
    from graspe_data.shards import Dataset as Dataset

_NAMES = {
    "Dataset": "graspe_data.shards",
    "Robot": "graspe_data.robot",
    "load_manifest": "graspe_data.manifest",
    "load_robot": "graspe_data.robot",
    "open_recording": "graspe_data.recordings",
}
__all__ = ["Dataset", "Robot", "__version__", "load_manifest", "load_robot", "open_recording"]

_getattr = lazy_names(__name__, _NAMES)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import PackageNotFoundError, version  # noqa: PLC0415

        try:
            return version("graspe")
        except PackageNotFoundError:
            return "0.0.0"
    return _getattr(name)
