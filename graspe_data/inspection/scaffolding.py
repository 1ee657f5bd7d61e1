"""A first robot manifest from a recording: what was found with its source, what was guessed."""

from __future__ import annotations

import re
from collections.abc import Iterator
from math import ceil, floor
from pathlib import Path
from typing import Final

from graspe_data.errors import RecordingError
from graspe_data.geometry import plain_frame
from graspe_data.inspection.base_height import base_height
from graspe_data.inspection.manifest_lines import ManifestLine, manifest_text
from graspe_data.inspection.roles import Role
from graspe_data.inspection.row_verdict import chosen_track, mounting
from graspe_data.inspection.survey import Survey, TopicSurvey, survey_recording
from graspe_data.inspection.topic_choice import TopicChoice, guessed_topics
from graspe_data.inspection.topic_content import (
    CalibrationContent,
    CloudContent,
    MotionContent,
    PictureContent,
    Range,
)
from graspe_data.recordings.recording import open_recording
from graspe_data.robot import Clock
from graspe_data.synchronisation.clocks import SECOND, ClockSettings, camera_timeline, timeline

Lines = Iterator[ManifestLine]

PLACEHOLDER: Final = "/fill_in/"
LARGEST_UNDECLARED_SKEW_S: Final = 1.0
_INTENSITY_SCALES: Final = (1.0, 255.0, 65535.0)
_PACKET_MODELS: Final = {16: "VLP-16", 32: "VLP-32C"}


def scaffold_robot(path: Path) -> str:
    """Write a starting robot manifest, YAML, that loads as it stands.

    A value is followed by where it was found; by ``guess:`` and its ground; or by ``missing:`` and
    what to fill in.

    Raises:
        RecordingError: The recording cannot be read, or has no messages.
    """
    with open_recording(path) as recording:
        survey = survey_recording(recording)
    if not any(topic.count for topic in survey.topics.values()):
        raise RecordingError(f"{path}: no messages, so nothing to start a robot manifest from.")
    return manifest_text(path.name, list(_Scaffold(survey, path).lines()))


class _Scaffold:
    """The lines of the manifest, part by part."""

    def __init__(self, survey: Survey, path: Path) -> None:
        self.survey, self.path = survey, path
        self.choice: TopicChoice = guessed_topics(survey)

    def lines(self) -> Lines:
        name = re.sub(r"[^a-z0-9]+", "_", self.path.name.split(".")[0].lower()).strip("_")
        yield ManifestLine(0, "name", name or "robot", "guess: the recording's name")
        yield from self._topics()
        yield from self._frames()
        yield from self._camera()
        yield from self._lidar()
        yield from self._clocks()
        yield from self._limits()
        note = "missing: measure the robot; the width is also that of the drawn trajectory"
        yield ManifestLine(0, "footprint", None, note)
        yield ManifestLine(1, "length", 1.0, "missing: metres")
        yield ManifestLine(1, "width", 0.6, "missing: metres")

    def _chosen(self, role: Role) -> TopicSurvey | None:
        return self.survey.topics.get(self.choice.topics.get(role, ""))

    def _topics(self) -> Lines:
        yield ManifestLine(0, "topics")
        needed: tuple[Role, ...] = ("image", "points", "odometry")
        optional: tuple[Role, ...] = ("camera_info", "command", "imu")
        for role in needed:
            yield self._topic(role) or ManifestLine(
                1, role, PLACEHOLDER + role, "missing: no topic of the recording could serve"
            )
        for role in optional:
            line = self._topic(role)
            if line is not None:
                yield line

    def _topic(self, role: Role) -> ManifestLine | None:
        topic = self._chosen(role)
        if topic is None:
            return None
        name, others = topic.info.name, set(self.survey.serving(role)) - {topic.info.name}
        found = f"{topic.count} {topic.info.message_type}"
        note = f"guess: {found}; or {', '.join(sorted(others))}" if others else f"found: {found}"
        return ManifestLine(1, role, name, note)

    def _frames(self) -> Lines:
        odometry = self._chosen("odometry")
        source = "missing: no odometry; " if odometry is None else f"from {odometry.info.name}"
        content = None if odometry is None else odometry.content
        unnamed = isinstance(content, MotionContent) and not content.child_frame
        guess = "guess: the usual name"
        base_note = guess if unnamed or odometry is None else source
        yield ManifestLine(0, "base_frame", self.choice.base_frame, base_note)
        odometry_note = source if odometry is not None else guess
        yield ManifestLine(0, "odometry_frame", self.choice.odometry_frame, odometry_note)
        height, note = base_height(self.survey, self.choice)
        yield ManifestLine(0, "base_height", height, note)

    def _camera(self) -> Lines:
        yield ManifestLine(0, "camera")
        yield from self._intrinsics()
        yield from self._mounting("image", "of the optical frame, z forward")
        image = self._chosen("image")
        if image is not None:
            rectified = "rect" in image.info.name.replace("unrect", "").lower()
            ground = "the topic's name" if rectified else "nothing in the topic's name says so"
            yield ManifestLine(1, "rectified", rectified, f"guess: {ground}")

    def _intrinsics(self) -> Lines:
        info = self._chosen("camera_info")
        if info is not None and isinstance(info.content, CalibrationContent):
            c = info.content.intrinsics
            found = f"{c.width}x{c.height}, fx {c.fx:.1f}, distortion {c.distortion_model}"
            yield ManifestLine(1, "intrinsics", "camera_info", f"from {info.info.name}: {found}")
            return
        image = self._chosen("image")
        picture = image.content if image is not None else None
        if image is None or not isinstance(picture, PictureContent):
            yield ManifestLine(1, "intrinsics", "camera_info", "missing: neither topic is there")
            return
        yield ManifestLine(1, "intrinsics", None, "missing: no calibration; calibrate the camera")
        yield ManifestLine(2, "width", picture.width, f"from {image.info.name}")
        yield ManifestLine(2, "height", picture.height, f"from {image.info.name}")
        for key in ("fx", "fy"):
            note = "missing: here as for a view of 90 degrees"
            yield ManifestLine(2, key, picture.width / 2, note)
        yield ManifestLine(2, "cx", (picture.width - 1) / 2, "guess: the middle")
        yield ManifestLine(2, "cy", (picture.height - 1) / 2, "guess: the middle")

    def _mounting(self, role: Role, hint: str) -> Lines:
        topic = self._chosen(role)
        base = self.choice.base_frame
        frame = "" if topic is None else plain_frame(topic.frame)
        placed = None if topic is None else mounting(self.survey, base, frame)
        if placed is not None:
            x, y, z = placed.translation.tolist()
            note = f"from tf_static: {frame} in {base} at {x:.3f}, {y:.3f}, {z:.3f} m"
            yield ManifestLine(1, "mounting", "tf", note)
            return
        note = f"missing: no tf_static from {base} to {frame or 'the sensor'}; measure it"
        yield ManifestLine(1, "mounting", None, note)
        yield ManifestLine(2, "translation", (0.0, 0.0, 0.0), "missing: metres")
        optical = (-1.5707963, 0.0, -1.5707963) if role == "image" else (0.0, 0.0, 0.0)
        yield ManifestLine(2, "rotation_rpy", optical, f"guess: looking forward; rad {hint}")

    def _lidar(self) -> Lines:
        topic = self._chosen("points")
        yield ManifestLine(0, "lidar")
        content = None if topic is None else topic.content
        if topic is None or not isinstance(content, CloudContent):
            yield ManifestLine(1, "model", "generic", "missing: VLP-16, VLP-32C or generic")
        else:
            yield from self._lidar_facts(topic, content)
        yield from self._mounting("points", "of the lidar's frame, x forward")
        yield ManifestLine(1, "minimum_range", 0.0, "missing: metres to the robot's own body")

    def _lidar_facts(self, topic: TopicSurvey, content: CloudContent) -> Lines:
        name, rings = topic.info.name, content.rings
        packets = topic.info.message_type.endswith("VelodyneScan")
        velodyne = packets or "velodyne" in f"{name} {topic.frame}".lower()
        model = _PACKET_MODELS.get(rings or 0, "generic") if velodyne else "generic"
        guess = f"guess: {rings} rings" if rings else "guess: no ring field tells it"
        yield ManifestLine(1, "model", model, f"from the packets of {name}" if packets else guess)
        if rings is not None and rings <= 256:  # noqa: PLR2004
            yield ManifestLine(1, "rings", rings, f"guess: the highest ring seen on {name}")
        else:
            yield ManifestLine(1, "rings", "null", "missing: null recovers them from the points")
        brightest = content.intensity_maximum
        if brightest is None:
            yield ManifestLine(1, "intensity_maximum", 255.0, "missing: the cloud has no intensity")
            return
        scale = next((s for s in _INTENSITY_SCALES if brightest <= s), float(ceil(brightest)))
        note = f"guess: the largest of a sample is {brightest:.4g}"
        yield ManifestLine(1, "intensity_maximum", scale, note)

    def _clocks(self) -> Lines:
        if self._chosen("image") is None:
            return
        found = [line for role in ("points", "odometry") for line in self._clock(role)]
        if found:
            yield ManifestLine(0, "clocks")
            yield from found

    def _clock(self, role: Role) -> Lines:
        """An offset where the skew against the camera is constant and large."""
        if self._chosen(role) is None:
            return
        camera = chosen_track(self.survey, self.choice, "image")
        track = chosen_track(self.survey, self.choice, role)
        measured, limits = Clock(offset_s="measured"), ClockSettings()
        try:
            camera_time = camera_timeline(camera, Clock())
            offset = timeline(track, measured, camera, camera_time, limits).offset_ns / SECOND
        except RecordingError as error:
            yield ManifestLine(1, role, "{}", f"missing: {error}")
            return
        if abs(offset) > LARGEST_UNDECLARED_SKEW_S:
            yield ManifestLine(1, role)
            note = "guess: the constant difference to the camera's skew, if they ran together"
            yield ManifestLine(2, "offset_s", round(offset, 3), note)

    def _limits(self) -> Lines:
        topic = self._chosen("odometry")
        content = None if topic is None else topic.content
        motion = content if isinstance(content, MotionContent) else None
        yield ManifestLine(0, "limits")
        linear = None if motion is None else motion.linear_velocity
        yaw = None if motion is None else motion.yaw_rate
        yield _limit("linear_velocity", linear, (0.0, 1.0), "m/s")
        yield _limit("yaw_rate", yaw, (-1.0, 1.0), "rad/s")


def _limit(key: str, observed: Range | None, usual: Range, unit: str) -> ManifestLine:
    """The observed range, rounded outwards to a tenth and around zero."""
    if observed is None or not any(observed):
        return ManifestLine(1, key, usual, f"missing: {unit}, no motion was observed")
    low, high = min(observed[0], 0.0), max(observed[1], 0.0)
    outwards = (floor(low * 10 + 1e-9) / 10 + 0.0, ceil(high * 10 - 1e-9) / 10 + 0.0)
    note = f"guess: {unit}, observed {observed[0]:.2f} to {observed[1]:.2f}"
    return ManifestLine(1, key, outwards, note)
