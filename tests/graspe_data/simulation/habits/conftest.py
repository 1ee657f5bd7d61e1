"""A short plain drive as a stream of messages."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest

from graspe_data.simulation.habits.recorded import Recorded
from graspe_data.simulation.message_stream import MessageStream
from graspe_data.simulation.motion.drivers import Leg
from tests.conftest import GardenDrive

ODOMETRY, POINTS, IMAGE = "/spot/odometry", "/velodyne_points", "/camera/color/image_raw/compressed"


@pytest.fixture(scope="session")
def plain(garden_drive: GardenDrive) -> list[Recorded]:
    """1.2 s: forward on an arc, then backwards."""
    simulated = garden_drive((Leg(0.8, 0.6, 0.5), Leg(0.4, -0.4, -0.3)))
    return [
        Recorded(message.topic, message.content, message.stamp_ns + message.delay_ns)
        for message in MessageStream(simulated)
    ]


def on(stream: Iterable[Recorded], topic: str) -> list[Any]:
    """The messages of a topic."""
    return [message.content for message in stream if message.topic == topic]
