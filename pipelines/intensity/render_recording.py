"""A recording's intensity maps as pictures and a video."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from graspe_data.atomic_file import write_atomically
from graspe_data.errors import RecordingError, StageError
from graspe_data.geometry import Transform
from graspe_data.progress import Progress
from graspe_data.recordings.decoding import decode_image
from graspe_data.recordings.recording import Recording, open_recording
from graspe_data.robot import Intrinsics
from graspe_data.synchronisation.synchronised import SynchronisedRecording, synchronise
from pipelines.dataset_settings import DatasetRecipe
from pipelines.intensity.classes_in_picture import draw_classes_in_picture
from pipelines.intensity.draw_frame import draw_frame
from pipelines.intensity.mapped_clouds import (
    CloudMapper,
    MappedCloud,
    MapRequest,
    UnmappedCloud,
)
from pipelines.intensity.video import VideoFile

NS_PER_S = 1e9
VIDEO = "maps.mp4"


@dataclass(frozen=True)
class Rendering:
    """What was made of a recording. ``lost``: clouds without a map, by reason."""

    pictures: tuple[Path, ...]
    video: Path | None
    lost: dict[str, int]
    median_ms: float
    """From a decoded cloud to its planning map."""


class RecordingRenderer:
    """Draws the maps of one open recording."""

    def __init__(
        self,
        recording: Recording,
        synchronised: SynchronisedRecording,
        recipe: DatasetRecipe,
        request: MapRequest,
    ) -> None:
        """Prepare the maps, and the camera where its calibration is known."""
        self.maps = CloudMapper(recording, synchronised, recipe, request)
        self._recording, self._recipe, self._request = recording, recipe, request
        self._synchronised = synchronised

    def frame(self, mapped: MappedCloud) -> NDArray[np.uint8]:
        """The picture of one cloud's maps, uint8 (H, W, 3), RGB."""
        start_ns = int(self._synchronised.points_ns.min())
        since_s = (mapped.stamp_ns - start_ns) / NS_PER_S
        name = "".join(c if " " <= c <= "~" else "?" for c in self._recording.path.name)
        heading = f"{name}   |   {since_s:.1f} s"
        robot, settings = self._recipe.robot, self._recipe.dataset.intensity_map
        picture = self._picture(mapped)
        return draw_frame(mapped, picture, settings, self._request, robot.footprint, heading)

    def _picture(self, mapped: MappedCloud) -> NDArray[np.uint8] | None:
        raw, robot = mapped.picture, self._recipe.robot
        if raw is None or not self._request.camera:
            return None
        kind = self._recording.topics[raw.topic].message_type
        try:
            picture = decode_image(self._recording.decode(raw), kind, raw.topic)
        except RecordingError:
            return None
        camera = self._camera(picture.frame, mapped.stamp_ns)
        if camera is None or picture.rgb.shape[:2] != (camera[0].height, camera[0].width):
            return picture.rgb
        settings = self._recipe.dataset.intensity_map
        return draw_classes_in_picture(picture.rgb, mapped, camera, settings, robot.base_height)

    def _camera(self, frame: str, stamp_ns: int) -> tuple[Intrinsics, Transform] | None:
        """The calibration; None where it is not known, or the pictures are distorted."""
        camera, tracks = self._recipe.robot.camera, self._synchronised.tracks
        declared = camera.intrinsics if isinstance(camera.intrinsics, Intrinsics) else None
        found = tracks.calibration.intrinsics if tracks.calibration else None
        intrinsics = declared or found
        if intrinsics is None or any(intrinsics.distortion):
            return None
        mountings = self._synchronised.placement.camera_mountings(frame)
        return intrinsics, [where for since, where in mountings if since <= stamp_ns][-1]


def render_recording(
    source: Path, recipe: DatasetRecipe, request: MapRequest, out: Path, progress: Progress
) -> Rendering:
    """Write a picture a cloud, and all of them as a video where one can be written.

    Args:
        source: The recording.
        recipe: With the settings of the layers, and the robot.
        request: What is asked for.
        out: The folder; made where it is missing, files of the same names are replaced.
        progress: Is told of every cloud.

    Raises:
        RecordingError: The recording cannot be opened or synchronised.
        StageError: None of its clouds gives a map; the text has the first reason.
    """
    out.mkdir(parents=True, exist_ok=True)
    recipe = recipe.for_recording(source.name)
    with open_recording(source) as recording:
        synchronised = synchronise(
            recording, recipe.robot, recipe.dataset.clocks, recipe.dataset.synchronisation
        )
        renderer = RecordingRenderer(recording, synchronised, recipe, request)
        rate_hz = _rate_hz(synchronised.points_ns) / request.every
        progress.start("clouds", len(renderer.maps))
        with VideoFile(out / VIDEO, rate_hz) as video:
            pictures, times, lost = _write_frames(renderer, out, video, progress)
    if not pictures:
        reason = next(iter(lost), "it has no clouds")
        raise StageError(f"{source}: no cloud gives a map: {reason}")
    return Rendering(tuple(pictures), video.path, dict(lost), 1000 * float(np.median(times)))


def _write_frames(
    renderer: RecordingRenderer, out: Path, video: VideoFile, progress: Progress
) -> tuple[list[Path], list[float], Counter[str]]:
    """Write every cloud's picture; give their paths, seconds a map, and reasons of those lost."""
    pictures, times, losses = list[Path](), list[float](), Counter[str]()
    for number, found in enumerate(renderer.maps):
        if isinstance(found, UnmappedCloud):
            losses[found.reason] += 1
            progress.advance(f"no map: {found.reason}")
            continue
        path, frame = out / f"map-{number:05d}.png", renderer.frame(found)
        write_atomically(path, [_png(frame)])
        video.add(frame)
        pictures.append(path)
        times.append(found.wall_s)
        progress.advance(str(path))
    return pictures, times, losses


def _rate_hz(stamps_ns: NDArray[np.int64]) -> float:
    """The clouds' rate by their median interval; 10 where there is none."""
    steps = np.diff(np.sort(stamps_ns).astype(np.float64))
    steps = steps[steps > 0]
    return NS_PER_S / float(np.median(steps)) if steps.size else 10.0


def _png(picture: NDArray[np.uint8]) -> bytes:
    return bytes(cv2.imencode(".png", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))[1])
