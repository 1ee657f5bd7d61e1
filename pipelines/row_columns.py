"""The columns of a row: what each is, with the sizes and frames that the manifests set."""

from __future__ import annotations

from graspe_data.columns import Codec, Column
from graspe_data.observation.intensity_map import LayerSettings
from pipelines.dataset_settings import CandidateSettings, DatasetManifest, DatasetRecipe

# Name, dtype, unit, frame, meaning.
EXTRACTED = (
    ("image", "uint8", "grey value", "camera", "RGB, undistorted and resized"),
    ("points", "float32", "m", "base", "front half, sampled; NaN past point_count"),
    ("intensity", "float32", "1", "", "of the sensor's maximum; NaN past point_count or if none"),
    ("point_count", "int32", "1", "", "returns among the points; the rest is padding"),
    (
        "smoothness",
        "float32",
        "1",
        "",
        "c of equation (3) at full resolution; NaN past point_count",
    ),
    (
        "laser_scan",
        "float32",
        "m",
        "base_link",
        "least horizontal range, right to left; inf if none",
    ),
    ("velocity_history", "float32", "m/s, rad/s", "base", "oldest first, last at the anchor"),
    ("stamp_ns", "int64", "ns", "", "the anchor: stamp of the picture"),
    ("points_age_ns", "int64", "ns", "", "anchor minus stamp of the cloud"),
    ("odometry_age_ns", "int64", "ns", "", "anchor minus the latest odometry at or before it"),
    ("image_valid", "bool", "", "", "the picture was decoded"),
    ("points_valid", "bool", "", "", "a cloud lay within the tolerance"),
    ("odometry_valid", "bool", "", "", "history and anchor lie in no gap"),
    (
        "pose",
        "float64",
        "m, rad",
        "odometry",
        "x, y, z, roll, pitch, yaw at the anchor, interpolated",
    ),
)
RELIABILITIES = (
    ("r_bright", "equation (1): root mean square grey value"),
    ("r_corners", "saturated number of FAST corners"),
    ("r_img", "equation (2): image reliability"),
    ("r_edge", "equation (4): share of edge points"),
    ("r_planar", "equation (4): share of planar points"),
    ("r_point", "equation (5): point cloud reliability"),
)
LABELS = (
    ("success", "uint8", "1 success, 0 from the first failing step on"),
    ("success_mask", "bool", "the recording can judge this step"),
    ("label_source", "uint8", "0 unjudged, 1 rule, 2 unreviewed proposal, 3 person"),
)


def extract_columns(recipe: DatasetRecipe) -> list[Column]:
    """The columns of the extract stage, in the robot's own frames."""
    manifest, robot = recipe.dataset, recipe.robot
    frames = {"base": robot.base_frame, "odometry": robot.odometry_frame, "camera": "camera"}
    count = manifest.points.sample.count
    shapes: dict[str, tuple[int, ...]] = {
        "image": (manifest.image.height, manifest.image.width, 3),
        "points": (count, 3),
        "intensity": (count,),
        "smoothness": (count,),
        "laser_scan": (manifest.points.laser_scan.rays,),
        "velocity_history": (manifest.window.history_steps, 2),
        "pose": (6,),
    }
    columns = [
        Column(
            name=name,
            dtype=dtype,
            shape=shapes.get(name, ()),
            unit=unit,
            frame=frames.get(frame, ""),
            meaning=meaning,
            stage="extract",
        )
        for name, dtype, unit, frame, meaning in EXTRACTED
    ]
    layers = manifest.intensity_layers
    return columns if layers is None else [*columns, intensity_column(layers, robot.base_frame)]


def intensity_column(layers: LayerSettings, base_frame: str) -> Column:
    """The optional column of intensity maps, made by the extract stage where it is asked for."""
    return Column(
        name="intensity_map",
        dtype="uint8",
        shape=layers.shape,
        unit="1/255 of the sensor's maximum",
        frame=base_frame,
        meaning="layers from low to high, row 0 ahead, column 0 left; rounded up, 0 if no return",
        stage="extract",
    )


def reliability_columns() -> list[Column]:
    """The columns of the reliability stage."""
    stage = "reliability"
    return [
        Column(name=name, dtype="float32", shape=(), unit="1", frame="", meaning=text, stage=stage)
        for name, text in RELIABILITIES
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


def candidate_columns(manifest: DatasetManifest, settings: CandidateSettings) -> list[Column]:
    """The optional columns of the candidates stage."""
    count, image = settings.count, manifest.image
    said: tuple[tuple[str, str, tuple[int, ...], str, str, str, Codec], ...] = (
        ("velocity", "float32", (2,), "m/s, rad/s", "base_link", "v and omega, held", "raw"),
        (
            "image",
            "uint8",
            (image.height, image.width),
            "",
            "camera",
            "ground covered by the candidate, 1 inside",
            "packed_bits",
        ),
        (
            "success",
            "uint8",
            (manifest.horizon.steps,),
            "",
            "",
            "1 success in the simulated world, 0 from the first failing step on",
            "raw",
        ),
        ("mask", "bool", (), "", "", "the world was asked about this candidate", "raw"),
    )
    return [
        Column(
            name=f"candidate_{name}",
            dtype=dtype,
            shape=(count, *shape),
            unit=unit,
            frame=frame,
            meaning=meaning,
            stage="candidates",
            codec=codec,
        )
        for name, dtype, shape, unit, frame, meaning, codec in said
    ]


def label_columns(manifest: DatasetManifest) -> list[Column]:
    """The columns of the label stage."""
    shape = (manifest.horizon.steps,)
    return [
        Column(name=name, dtype=dtype, shape=shape, unit="", frame="", meaning=text, stage="label")
        for name, dtype, text in LABELS
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


def row_columns(recipe: DatasetRecipe) -> list[Column]:
    """Every column that a shard holds."""
    manifest = recipe.dataset
    columns = [
        *extract_columns(recipe),
        *reliability_columns(),
        *trajectory_columns(manifest),
        *(candidate_columns(manifest, asked) if (asked := manifest.candidates) else ()),
        *label_columns(manifest),
        provenance_column(),
    ]
    dropped = {"smoothness"} - set(manifest.storage.optional_columns)
    kept = [column for column in columns if column.name not in dropped]
    codec = manifest.image_codec
    return [c.model_copy(update={"codec": codec}) if c.name == "image" else c for c in kept]
