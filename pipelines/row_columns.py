"""The columns of a row, as design decides them, with the sizes that a manifest sets."""

from __future__ import annotations

from graspe_data.columns import Column
from pipelines.dataset_settings import DatasetManifest

STAMP = "ns"


def extract_columns(manifest: DatasetManifest) -> list[Column]:
    """The columns of the extract stage."""
    count = manifest.points.sample.count
    size = (manifest.image.height, manifest.image.width)

    def column(
        name: str, dtype: str, shape: tuple[int, ...], unit: str, frame: str, meaning: str
    ) -> Column:
        return Column(
            name=name,
            dtype=dtype,
            shape=shape,
            unit=unit,
            frame=frame,
            meaning=meaning,
            stage="extract",
        )

    return [
        column(
            "image", "uint8", (*size, 3), "grey value", "camera", "RGB, undistorted and resized"
        ),
        column(
            "points",
            "float32",
            (count, 3),
            "m",
            "base_link",
            "front half of the cloud, sampled without replacement; NaN past point_count",
        ),
        column(
            "intensity",
            "float32",
            (count,),
            "1",
            "",
            "of the sensor's maximum; NaN past point_count or where the sensor gives none",
        ),
        column(
            "point_count", "int32", (), "1", "", "returns among the points; the rest is padding"
        ),
        column(
            "smoothness",
            "float32",
            (count,),
            "1",
            "",
            "c of equation (3) at full resolution; NaN past point_count",
        ),
        column(
            "laser_scan",
            "float32",
            (manifest.points.laser_scan.rays,),
            "m",
            "base_link",
            "least horizontal range a ray, right to left, from the full cloud; inf where empty",
        ),
        column(
            "velocity_history",
            "float32",
            (manifest.window.history_steps, 2),
            "m/s, rad/s",
            "base_link",
            "linear velocity and yaw rate, oldest first, the last at the anchor",
        ),
        column("stamp_ns", "int64", (), STAMP, "", "the anchor: stamp of the picture"),
        column("points_age_ns", "int64", (), STAMP, "", "anchor minus stamp of the cloud"),
        column(
            "odometry_age_ns",
            "int64",
            (),
            STAMP,
            "",
            "anchor minus the latest odometry at or before it",
        ),
        column("image_valid", "bool", (), "", "", "the picture was decoded"),
        column("points_valid", "bool", (), "", "", "a cloud lay within the tolerance"),
        column("odometry_valid", "bool", (), "", "", "history and anchor lie in no gap"),
        column(
            "pose",
            "float64",
            (6,),
            "m, rad",
            "odom",
            "x, y, z, roll, pitch, yaw at the anchor, interpolated",
        ),
    ]


def reliability_columns() -> list[Column]:
    """The columns of the reliability stage."""
    meanings = {
        "r_bright": "equation (1): root mean square grey value",
        "r_corners": "saturated number of FAST corners",
        "r_img": "equation (2): image reliability",
        "r_edge": "equation (4): share of edge points",
        "r_planar": "equation (4): share of planar points",
        "r_point": "equation (5): point cloud reliability",
    }
    return [
        Column(
            name=name,
            dtype="float32",
            shape=(),
            unit="1",
            frame="",
            meaning=meaning,
            stage="reliability",
        )
        for name, meaning in meanings.items()
    ]


def trajectory_columns(manifest: DatasetManifest) -> list[Column]:
    """The columns of the trajectory stage."""
    return [
        Column(
            name="trajectory_image",
            dtype="uint8",
            shape=(manifest.image.height, manifest.image.width),
            unit="",
            frame="camera",
            meaning="ground covered by the constant-velocity arc, 1 inside",
            stage="trajectory",
            codec="packed_bits",
        )
    ]


def label_columns(manifest: DatasetManifest) -> list[Column]:
    """The columns of the label stage."""
    steps = (manifest.horizon.steps,)
    meanings = {
        "success": ("uint8", "1 success, 0 from the first failing step on"),
        "success_mask": ("bool", "the recording can judge this step"),
        "label_source": ("uint8", "0 unjudged, 1 rule, 2 unreviewed proposal, 3 person"),
    }
    return [
        Column(
            name=name, dtype=dtype, shape=steps, unit="", frame="", meaning=meaning, stage="label"
        )
        for name, (dtype, meaning) in meanings.items()
    ]


def provenance_column() -> Column:
    """The index of a row's recording, added when rows are sharded."""
    return Column(
        name="recording",
        dtype="int32",
        shape=(),
        unit="",
        frame="",
        meaning="index into the recordings of dataset.json",
        stage="shard",
    )


def row_columns(manifest: DatasetManifest) -> list[Column]:
    """Every column that a shard holds."""
    columns = [
        *extract_columns(manifest),
        *reliability_columns(),
        *trajectory_columns(manifest),
        *label_columns(manifest),
        provenance_column(),
    ]
    dropped = {"smoothness"} - set(manifest.storage.optional_columns)
    kept = [column for column in columns if column.name not in dropped]
    codec = manifest.image_codec
    return [c.model_copy(update={"codec": codec}) if c.name == "image" else c for c in kept]
