"""A camera in a world."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.geometry import Transform
from graspe_data.robot import Intrinsics
from graspe_data.sensor_failures import Droplets, Glare, add_glare, through_droplets
from graspe_data.simulation.camera.develop import develop
from graspe_data.simulation.camera.exposure import meter
from graspe_data.simulation.camera.lens_cover import LensCover, cover_lens, covered_share
from graspe_data.simulation.camera.light import Light
from graspe_data.simulation.camera.motion_blur import OpticalFlow, blur_along
from graspe_data.simulation.camera.settings import CameraSettings
from graspe_data.simulation.camera.view import View
from graspe_data.simulation.ray_scene import RayScene
from graspe_data.simulation.world.world import World

BODY_FROM_OPTICAL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])

Rows = NDArray[np.float32]


class Camera:
    """A camera in a world."""

    def __init__(
        self, world: World, scene: RayScene, light: Light, settings: CameraSettings
    ) -> None:
        """Prepare the pixels' rays; ``scene`` holds the world's surfaces."""
        self._settings = settings
        self._view = View(world, scene, light)
        self._flow = OpticalFlow(self.intrinsics)
        self._rays = _pixel_rays(self.intrinsics)

    @property
    def intrinsics(self) -> Intrinsics:
        """The calibration, without distortion."""
        width, height = self._settings.width, self._settings.height
        focal = width / 2 / float(np.tan(self._settings.field_of_view / 2))
        return Intrinsics(
            width=width,
            height=height,
            fx=focal,
            fy=focal,
            cx=(width - 1) / 2,
            cy=(height - 1) / 2,
        )

    @property
    def base_from_camera(self) -> Transform:
        """Carries points of the optical frame into base_link."""
        return self._settings.mounting.transform @ Transform(BODY_FROM_OPTICAL, np.zeros(3))

    def picture(
        self,
        base_pose: Transform,
        base_twist: tuple[Floats, Floats],
        generator: np.random.Generator,
        cover: LensCover | Glare | Droplets | None = None,
    ) -> NDArray[np.uint8]:
        """Take a picture: uint8 (height, width, 3), RGB.

        Args:
            base_pose: base_link in the world at the middle of the exposure.
            base_twist: Linear (3,) in m/s and angular (3,) in rad/s velocity, in base_link.
            generator: Draws shake and noise.
            cover: What is on the lens, or shines into it.
        """
        settings = self._settings
        shake = generator.normal(0.0, settings.vibration, 3)
        radiance, closeness = self._look(base_pose)
        exposure = meter(self._behind(cover, radiance), settings)
        linear, angular = self._own_twist(*base_twist)
        flow = self._flow.of(closeness, linear, angular + shake)
        blurred = blur_along(radiance, flow * np.float32(exposure.time_s))
        return develop(self._behind(cover, blurred), exposure, settings, generator)

    def _look(self, base_pose: Transform) -> tuple[Rows, Rows]:
        """Radiance (H, W, 3) through the lens, and 1 / Z (H, W) in 1/m."""
        settings, pose = self._settings, base_pose @ self.base_from_camera
        directions = np.einsum("nk,jk->nj", self._rays, pose.rotation.astype(np.float32))
        origin = pose.translation.astype(np.float32)
        seen = self._view.look(origin, directions, settings.near, 1.0 / self.intrinsics.fx)
        picture = seen.radiance.reshape(settings.height, settings.width, 3)
        closeness = 1.0 / (seen.distance * self._rays[:, 2])
        return self._soften(picture), closeness.reshape(settings.height, settings.width)

    def _soften(self, picture: Rows) -> Rows:
        if self._settings.softness == 0:
            return picture
        return np.asarray(cv2.GaussianBlur(picture, (0, 0), self._settings.softness), np.float32)

    def _behind(self, cover: LensCover | Glare | Droplets | None, radiance: Rows) -> Rows:
        if isinstance(cover, Glare):
            return add_glare(radiance, cover)
        if isinstance(cover, Droplets):
            return through_droplets(radiance, cover)
        if cover is None or cover.share == 0:
            return radiance
        height, width = radiance.shape[:2]
        return cover_lens(radiance, cover, covered_share(cover, height, width))

    def _own_twist(self, linear: Floats, angular: Floats) -> tuple[Floats, Floats]:
        """The camera's velocities in its optical frame."""
        mounted = self.base_from_camera
        moving = linear + np.cross(angular, mounted.translation)
        return mounted.rotation.T @ moving, mounted.rotation.T @ angular


def _pixel_rays(intrinsics: Intrinsics) -> Rows:
    """Unit directions (H W, 3) in the optical frame, row by row."""
    u, v = np.meshgrid(np.arange(intrinsics.width), np.arange(intrinsics.height))
    x, y = (u - intrinsics.cx) / intrinsics.fx, (v - intrinsics.cy) / intrinsics.fy
    rays = np.stack([x.ravel(), y.ravel(), np.ones(x.size)], axis=1)
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    return np.asarray(rays, np.float32)
