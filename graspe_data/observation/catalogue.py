"""The catalogue of columns: what a row of the dataset holds, each column told once.

Whatever pads, mirrors, checks, exports or documents a column reads it from here. To add one, add an
entry, and write its values in the stage that it names.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

from graspe_data.columns import Codec, Column

Frame = Literal["", "base", "odometry", "camera"]
StageName = Literal["extract", "reliability", "trajectory", "candidates", "label", "shard"]
Mirror = Literal["same", "flip_pixels", "flip_order", "negate_second"]
"""Under a mirror that swaps left and right: nothing changes; pixels of each row, or the last axis,
change their order; the second component changes its sign."""


@dataclass(frozen=True)
class Entry:
    """One column of the catalogue.

    Attributes:
        name: As in ``dataset.json``.
        dtype: NumPy's name.
        shape: Of a row, by sizes and their names; a column whose sizes the manifest does not set is
            not made.
        unit: SI; "1" for a share or a count, empty where it has none.
        frame: Of its coordinates; the robot's manifest names it.
        meaning: What it is, for people.
        stage: That makes it.
        codec: How shards store a row.
        padded: Behind ``point_count`` it holds NaN, which means nothing.
        empty: What stands where nothing was measured.
        share: All its numbers are in 0..1.
        mirror: What becomes of it when left and right change places.
        optional: Made in any case, and stored where the manifest asks for it.
        live: A planner derives it on the robot, so a model may read it.
    """

    name: str
    dtype: str
    shape: tuple[str | int, ...]
    unit: str
    frame: Frame
    meaning: str
    stage: StageName
    codec: Codec = "raw"
    padded: bool = False
    empty: Literal["", "nan", "inf"] = ""
    share: bool = False
    mirror: Mirror = "same"
    optional: bool = False
    live: bool = False

    def declared(self, sizes: Mapping[str, int], frames: Mapping[str, str]) -> Column:
        """The column with its sizes and frames, as ``dataset.json`` declares it."""
        return Column(
            name=self.name,
            dtype=self.dtype,
            shape=tuple(size if isinstance(size, int) else sizes[size] for size in self.shape),
            unit=self.unit,
            frame=frames.get(self.frame, ""),
            meaning=self.meaning,
            stage=self.stage,
            codec=self.codec,
        )

    def is_set(self, sizes: Mapping[str, int]) -> bool:
        """Whether all its sizes are given."""
        return all(isinstance(size, int) or size in sizes for size in self.shape)


def _share(name: str, meaning: str, *, live: bool = False) -> Entry:
    return Entry(name, "float32", (), "1", "", meaning, "reliability", share=True, live=live)


_PICTURE: Final = ("height", "width")
CATALOGUE: Final = (
    Entry(
        "image",
        "uint8",
        (*_PICTURE, 3),
        "grey value",
        "camera",
        "RGB, undistorted and resized",
        "extract",
        mirror="flip_pixels",
        live=True,
    ),
    Entry(
        "points",
        "float32",
        ("points", 3),
        "m",
        "base",
        "front half, sampled; NaN past point_count",
        "extract",
        padded=True,
        empty="nan",
        mirror="negate_second",
        live=True,
    ),
    Entry(
        "intensity",
        "float32",
        ("points",),
        "1",
        "",
        "of the sensor's maximum; NaN past point_count or if none",
        "extract",
        padded=True,
        empty="nan",
    ),
    Entry(
        "point_count",
        "int32",
        (),
        "1",
        "",
        "returns among the points; the rest is padding",
        "extract",
        live=True,
    ),
    Entry(
        "smoothness",
        "float32",
        ("points",),
        "1",
        "",
        "c of equation (3) at full resolution; NaN past point_count",
        "extract",
        padded=True,
        empty="nan",
        optional=True,
    ),
    Entry(
        "laser_scan",
        "float32",
        ("rays",),
        "m",
        "base",
        "least horizontal range, right to left; inf if none",
        "extract",
        empty="inf",
        mirror="flip_order",
        live=True,
    ),
    Entry(
        "velocity_history",
        "float32",
        ("history", 2),
        "m/s, rad/s",
        "base",
        "oldest first, last at the anchor",
        "extract",
        mirror="negate_second",
        live=True,
    ),
    Entry("stamp_ns", "int64", (), "ns", "", "the anchor: stamp of the picture", "extract"),
    Entry("points_age_ns", "int64", (), "ns", "", "anchor minus stamp of the cloud", "extract"),
    Entry(
        "odometry_age_ns",
        "int64",
        (),
        "ns",
        "",
        "anchor minus the latest odometry at or before it",
        "extract",
    ),
    Entry("image_valid", "bool", (), "", "", "the picture was decoded", "extract"),
    Entry("points_valid", "bool", (), "", "", "a cloud lay within the tolerance", "extract"),
    Entry("odometry_valid", "bool", (), "", "", "history and anchor lie in no gap", "extract"),
    Entry(
        "pose",
        "float64",
        (6,),
        "m, rad",
        "odometry",
        "x, y, z, roll, pitch, yaw at the anchor, interpolated",
        "extract",
    ),
    Entry(
        "intensity_map",
        "uint8",
        ("layers", "cells_ahead", "cells_across"),
        "1/255 of the sensor's maximum",
        "base",
        "layers from low to high, row 0 ahead, column 0 left; rounded up, 0 if no return",
        "extract",
        mirror="flip_order",
    ),
    _share("r_bright", "equation (1): root mean square grey value"),
    _share("r_corners", "saturated number of FAST corners"),
    _share("r_img", "equation (2): image reliability", live=True),
    _share("r_edge", "equation (4): share of edge points"),
    _share("r_planar", "equation (4): share of planar points"),
    _share("r_point", "equation (5): point cloud reliability", live=True),
    Entry(
        "trajectory_image",
        "uint8",
        _PICTURE,
        "",
        "camera",
        "ground covered by the constant-velocity arc, 1 inside",
        "trajectory",
        codec="packed_bits",
        mirror="flip_pixels",
        live=True,
    ),
    Entry(
        "candidate_velocity",
        "float32",
        ("candidates", 2),
        "m/s, rad/s",
        "base",
        "v and omega, held",
        "candidates",
        mirror="negate_second",
    ),
    Entry(
        "candidate_image",
        "uint8",
        ("candidates", *_PICTURE),
        "",
        "camera",
        "ground covered by the candidate, 1 inside",
        "candidates",
        codec="packed_bits",
        mirror="flip_order",
    ),
    Entry(
        "candidate_success",
        "uint8",
        ("candidates", "horizon"),
        "",
        "",
        "1 success in the simulated world, 0 from the first failing step on",
        "candidates",
    ),
    Entry(
        "candidate_mask",
        "bool",
        ("candidates",),
        "",
        "",
        "the world was asked about this candidate",
        "candidates",
    ),
    Entry(
        "success",
        "uint8",
        ("horizon",),
        "",
        "",
        "1 success, 0 from the first failing step on",
        "label",
    ),
    Entry(
        "success_mask", "bool", ("horizon",), "", "", "the recording can judge this step", "label"
    ),
    Entry(
        "label_source",
        "uint8",
        ("horizon",),
        "",
        "",
        "0 unjudged, 1 rule, 2 unreviewed proposal, 3 person",
        "label",
    ),
    Entry(
        "state",
        "uint8",
        (),
        "",
        "",
        "at the anchor: 0 failing, 1 standing, 2 backing, 3 driving",
        "label",
    ),
    Entry("recording", "int32", (), "", "", "index into the recordings of dataset.json", "shard"),
)
"""In the order in which shards hold them."""

BY_NAME: Final[Mapping[str, Entry]] = {entry.name: entry for entry in CATALOGUE}

RELIABILITIES: Final = tuple(entry.name for entry in CATALOGUE if entry.share)
"""Columns of numbers in 0..1."""
PER_POINT: Final = tuple(entry.name for entry in CATALOGUE if entry.padded)
"""Columns with a number, or several, for each point of the row's cloud."""


def columns_of(
    sizes: Mapping[str, int], frames: Mapping[str, str], stage: StageName | None = None
) -> list[Column]:
    """The columns of a stage, or of all, whose sizes are set; in the catalogue's order."""
    return [
        entry.declared(sizes, frames)
        for entry in CATALOGUE
        if entry.is_set(sizes) and stage in (None, entry.stage)
    ]
