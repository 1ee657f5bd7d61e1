"""What two sources of a recording say of the same thing, and what follows from it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Literal, NamedTuple

Course = Literal["agrees", "mended", "noted", "refused"]
"""``agrees``: both say the same. ``mended``: they differ with a known explanation, and the rows are
right. ``noted``: worth a look; the rows are as the manifest says. ``refused``: no rows."""


@dataclass(frozen=True)
class Finding:
    """One agreement or disagreement.

    ``kind`` names it in the docs' table; ``where`` is the topic, edge or frame; ``text`` is a
    sentence with both numbers and what is done; ``numbers`` are these numbers by name.
    """

    kind: str
    course: Course
    where: str
    text: str
    numbers: Mapping[str, float] = field(default_factory=dict)


class Kind(NamedTuple):
    """A kind of finding for the docs: what is held against what, and what is done."""

    course: Course
    sources: str
    done: str


KINDS: Final[Mapping[str, Kind]] = {
    "motion_agrees": Kind(
        "agrees", "twist and poses of the odometry", "velocities are the twist's, as given"
    ),
    "twist_in_fixed_frame": Kind(
        "mended",
        "a twist in the odometry frame, as Spot's drivers give it, and the poses",
        "the twist is turned into the body's frame",
    ),
    "twist_never_filled": Kind(
        "mended",
        "a twist of zeros and poses that move, as lidar odometry writes them",
        "velocities are differentiated from the poses",
    ),
    "yaw_rate_never_filled": Kind(
        "mended",
        "a yaw rate of zero and a heading that turns",
        "velocities are differentiated from the poses",
    ),
    "poses_never_filled": Kind(
        "mended",
        "poses of zeros and a twist that moves",
        "poses are integrated from the twist",
    ),
    "twist_stops": Kind(
        "mended",
        "a twist that agrees with the poses, and stands still at times while they move",
        "velocities are differentiated from the poses",
    ),
    "no_twist": Kind(
        "mended", "poses alone (PoseStamped, tf)", "velocities are differentiated from the poses"
    ),
    "no_poses": Kind(
        "mended", "a twist alone (TwistStamped)", "poses are integrated from the twist"
    ),
    "odometry_by_lidar": Kind(
        "mended",
        "a recording without odometry, under `odometry: lidar`",
        "poses are made from the clouds by KISS-ICP, velocities fitted to them",
    ),
    "pose_jumps": Kind(
        "mended",
        "successive poses further apart than twice the limits allow",
        "a gap there: nothing is interpolated, differentiated or judged across it",
    ),
    "pose_spikes": Kind(
        "mended",
        "up to three poses that lie elsewhere than those before and after",
        "these samples are left out; refused where they are many, as of two publishers",
    ),
    "poses_scatter": Kind(
        "noted",
        "successive poses that lie to and fro by more than two centimetres",
        "velocities are means over a tenth of a second",
    ),
    "odometry_frame_not_level": Kind(
        "mended",
        "an odometry frame in which the robot's z axis does not point up, as a camera's",
        "poses are turned so that z points up",
    ),
    "beyond_limits": Kind(
        "mended",
        "few velocities beyond twice the robot's limits",
        "these samples are left out",
    ),
    "cloud_in_other_frame": Kind(
        "mended",
        "clouds in the odometry frame, or another that moves against the base",
        "clouds are carried back by the pose at their stamp; rows without such a pose are lost",
    ),
    "mounting_changed": Kind(
        "mended",
        "a static transform that is sent anew with another place",
        "each row has the mounting that was the latest then",
    ),
    "odometry_carried_to_base": Kind(
        "mended",
        "odometry of another frame of the body than the base",
        "poses and velocities are carried over to the base, lever arm included",
    ),
    "stamps_begin_again": Kind(
        "mended",
        "stamps that go back or leap: a restart, a looped playback, a clock that was set",
        "the recording is cut into stretches; nothing is paired or interpolated across",
    ),
    "offset_measured": Kind(
        "mended",
        "the sensor's clock and the camera's, under `offset_s: measured`",
        "the difference where each comes soonest is added to the sensor's stamps",
    ),
    "commands_agree": Kind("agrees", "commands and odometry", "nothing"),
    "commands_differ": Kind(
        "noted", "commands and odometry, three times apart or more", "the odometry counts"
    ),
    "motion_differs_at_times": Kind(
        "noted",
        "twist and poses that agree on the whole, and differ by half in some seconds",
        "the twist counts",
    ),
    "commands_opposite": Kind(
        "noted",
        "commands, and an odometry that drives or turns the other way",
        "the odometry counts",
    ),
    "drives_backwards": Kind(
        "noted",
        "an odometry that leads backwards for the most, and limits without a way back",
        "the odometry counts",
    ),
    "little_motion": Kind(
        "noted", "twist and poses of a robot that hardly moves", "the twist is taken as the body's"
    ),
    "velocity_forced": Kind(
        "noted", "`odometry_velocity` of the manifest and the evidence", "the manifest counts"
    ),
    "lidar_packets": Kind(
        "noted",
        "packets of a Hesai lidar and its angle table, of which there is none",
        "the nominal angles of the model count",
    ),
    "edge_unusable": Kind(
        "noted", "a transform with a quaternion of zeros or with NaN", "it alone is skipped"
    ),
    "edge_published_twice": Kind(
        "noted", "two topics that publish one edge", "the one nearer to the robot's namespace"
    ),
    "two_parents": Kind(
        "noted",
        "a frame with two parents",
        "of fixed ones the one published last counts, as in tf2; of moving ones the shorter path",
    ),
    "sensor_late": Kind(
        "noted",
        "how long after their stamps messages and pictures come, more than .25 s apart",
        "stamps count as they are",
    ),
    "edge_on_other_clock": Kind(
        "noted", "stamps of tf and of the camera", "the edge is left out in that stretch"
    ),
    "mounting_differs": Kind("noted", "a mounting of the manifest and tf's", "the manifest counts"),
    "odometry_of_other_frame": Kind(
        "noted",
        "odometry of a frame that nothing connects to the base",
        "it is taken to be the base",
    ),
    "camera_size": Kind(
        "refused",
        "the size of the pictures and that of their CameraInfo",
        "how to scale it is told",
    ),
    "camera_frame": Kind(
        "noted", "the frame of the pictures and that of their CameraInfo", "the pictures' counts"
    ),
    "camera_name": Kind(
        "noted", "the names of an image topic and its CameraInfo", "the manifest counts"
    ),
    "optical_frame": Kind(
        "refused",
        "a camera's frame with z up, as a body's, where an optical one has y down",
        "the optical frame is proposed",
    ),
    "stretch_without_rows": Kind(
        "noted", "a stretch that lacks a sensor or whose clocks are unrelated", "it makes no rows"
    ),
    "motion_contradicts": Kind(
        "refused", "twist and poses that no frame explains", "the manifest can force"
    ),
    "moves_sideways": Kind(
        "refused",
        "the way of a robot and where its x axis points",
        "where most of the way lies across; the manifest can force",
    ),
    "heading_never_filled": Kind(
        "refused",
        "a way on curves and a heading that never changes, without a twist",
        "the manifest can force",
    ),
    "two_publishers": Kind(
        "refused", "poses that jump to and fro: two publishers of one edge or topic", ""
    ),
    "limits_too_low": Kind(
        "refused", "velocities beyond twice the limits throughout", "correct `limits`"
    ),
    "never_filled": Kind("refused", "commands that drive and an odometry that never changes", ""),
    "clocks_differ": Kind("refused", "stamps of a sensor and of the camera", "the offset is told"),
    "camera_moves": Kind(
        "refused", "a camera's frame that moves against the base", "give `camera.frame`"
    ),
    "no_mounting": Kind("refused", "a sensor's frame and the base, which nothing connects", ""),
}
