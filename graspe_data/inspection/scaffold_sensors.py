"""The lines of a starting manifest about the camera and the lidar."""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil
from typing import Final

from graspe_data.geometry import Transform, plain_frame, roll_pitch_yaw
from graspe_data.inspection.evidence import Evidence
from graspe_data.inspection.manifest_lines import ManifestLine
from graspe_data.inspection.roles import Role
from graspe_data.inspection.scaffold_motion import fixed_transform
from graspe_data.inspection.survey import TopicSurvey
from graspe_data.inspection.topic_content import CalibrationContent, CloudContent, PictureContent
from graspe_data.robot import Intrinsics

Lines = Iterator[ManifestLine]

_PACKET_MODELS: Final = {16: "VLP-16", 32: "VLP-32C"}
_MOST_RINGS: Final = 256


def camera_lines(evidence: Evidence, *, resolve: bool) -> Lines:
    """Calibration and mounting of the camera."""
    yield ManifestLine(0, "camera")
    yield from _intrinsics(evidence, resolve=resolve)
    yield from _mounting(evidence, "image", "of the optical frame, z forward", resolve=resolve)
    optical = None if evidence.robot is None else evidence.robot.camera.frame
    if optical is not None:
        note = "guess: the pictures' own frame is no optical frame"
        yield ManifestLine(1, "frame", optical, note)
    image = evidence.topic("image")
    if image is not None:
        rectified = "rect" in image.info.name.replace("unrect", "").lower()
        ground = "the topic's name" if rectified else "nothing in the topic's name says so"
        yield ManifestLine(1, "rectified", rectified, f"guess: {ground}")


def lidar_lines(evidence: Evidence, *, resolve: bool) -> Lines:
    """Model, scale and mounting of the lidar."""
    topic = evidence.topic("points")
    yield ManifestLine(0, "lidar")
    content = None if topic is None else topic.content
    if topic is None or not isinstance(content, CloudContent):
        yield ManifestLine(1, "model", "generic", "missing: VLP-16, VLP-32C or generic")
    else:
        yield from _lidar_facts(topic, content)
    yield from _mounting(evidence, "points", "of the lidar's frame, x forward", resolve=resolve)
    yield ManifestLine(1, "minimum_range", 0.0, "missing: metres to the robot's own body")


def _intrinsics(evidence: Evidence, *, resolve: bool) -> Lines:
    info = evidence.topic("camera_info")
    if info is not None and isinstance(info.content, CalibrationContent):
        c = info.content.intrinsics
        found = f"{c.width}x{c.height}, fx {c.fx:.1f}, distortion {c.distortion_model}"
        note = f"from {info.info.name}: {found}"
        if resolve:
            yield from _numbers(c, note)
        else:
            yield ManifestLine(1, "intrinsics", "camera_info", note)
        return
    image = evidence.topic("image")
    picture = image.content if image is not None else None
    if image is None or not isinstance(picture, PictureContent):
        yield ManifestLine(1, "intrinsics", "camera_info", "missing: neither topic is there")
        return
    yield ManifestLine(1, "intrinsics", None, "missing: no calibration; calibrate the camera")
    yield ManifestLine(2, "width", picture.width, f"from {image.info.name}")
    yield ManifestLine(2, "height", picture.height, f"from {image.info.name}")
    for key in ("fx", "fy"):
        yield ManifestLine(2, key, picture.width / 2, "missing: here as for a view of 90 degrees")
    yield ManifestLine(2, "cx", (picture.width - 1) / 2, "guess: the middle")
    yield ManifestLine(2, "cy", (picture.height - 1) / 2, "guess: the middle")


def _numbers(intrinsics: Intrinsics, note: str) -> Lines:
    yield ManifestLine(1, "intrinsics", None, note)
    for key in ("width", "height", "fx", "fy", "cx", "cy", "distortion_model"):
        yield ManifestLine(2, key, getattr(intrinsics, key), note)
    if intrinsics.distortion:
        yield ManifestLine(2, "distortion", intrinsics.distortion, note)


def _mounting(evidence: Evidence, role: Role, hint: str, *, resolve: bool) -> Lines:
    topic, base = evidence.topic(role), evidence.base_frame
    chosen = None if evidence.robot is None else evidence.robot.camera.frame
    frame = "" if topic is None else plain_frame(topic.frame)
    frame = chosen if role == "image" and chosen else frame
    placed = None if topic is None else fixed_transform(evidence, base, frame)
    if placed is not None and not (role == "points" and frame == base):
        yield from _found_mounting(placed, frame, base, resolve=resolve)
        return
    carried = role == "points" and evidence.transforms.connects(base, frame)
    why = (
        f"clouds come in {frame!r}, which is not the lidar's own frame"
        if carried
        else f"no fixed transform from {base} to {frame or 'the sensor'}"
    )
    yield ManifestLine(1, "mounting", None, f"missing: {why}; measure it")
    yield ManifestLine(2, "translation", (0.0, 0.0, 0.0), "missing: metres")
    optical = (-1.5707963, 0.0, -1.5707963) if role == "image" else (0.0, 0.0, 0.0)
    yield ManifestLine(2, "rotation_rpy", optical, f"guess: looking forward; rad {hint}")


def _found_mounting(placed: Transform, frame: str, base: str, *, resolve: bool) -> Lines:
    x, y, z = placed.translation.tolist()
    note = f"from tf_static: {frame} in {base} at {x:.3f}, {y:.3f}, {z:.3f} m"
    if not resolve:
        yield ManifestLine(1, "mounting", "tf", note)
        return
    angles = tuple(round(float(angle), 7) for angle in roll_pitch_yaw(placed.rotation))
    yield ManifestLine(1, "mounting", None, note)
    yield ManifestLine(2, "translation", (round(x, 6), round(y, 6), round(z, 6)), note)
    yield ManifestLine(2, "rotation_rpy", angles, f"{note}; rad")


def _lidar_facts(topic: TopicSurvey, content: CloudContent) -> Lines:
    name, rings = topic.info.name, content.rings
    packets = topic.info.message_type.endswith("VelodyneScan")
    velodyne = packets or "velodyne" in f"{name} {topic.frame}".lower()
    model = _PACKET_MODELS.get(rings or 0, "generic") if velodyne else "generic"
    guess = f"guess: {rings} rings" if rings else "guess: no ring field tells it"
    yield ManifestLine(1, "model", model, f"from the packets of {name}" if packets else guess)
    if rings is not None and rings <= _MOST_RINGS:
        yield ManifestLine(1, "rings", rings, f"guess: the highest ring seen on {name}")
    else:
        yield ManifestLine(1, "rings", "null", "missing: null recovers them from the points")
    yield from _intensity(content)


def _intensity(content: CloudContent) -> Lines:
    """The scale of intensity: 1 or 255 where that holds all that was seen, else what was seen."""
    brightest = content.intensity_maximum
    if content.reflectivity_maximum is not None:
        note = "guess: calibrated by the sensor; the field intensity counts what the receiver saw"
        yield ManifestLine(1, "intensity_field", "reflectivity", note)
        brightest = content.reflectivity_maximum
    if brightest is None:
        yield ManifestLine(1, "intensity_maximum", 255.0, "missing: the cloud has no intensity")
        return
    note = f"guess: the largest of a sample is {brightest:.4g}"
    scale = next((s for s in (1.0, 255.0) if brightest <= s), None)
    if scale is None:
        scale = float(ceil(brightest))
        note += "; the sensor's manual says what a mirror gives"
    yield ManifestLine(1, "intensity_maximum", scale, note)
