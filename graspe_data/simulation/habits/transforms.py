"""What drivers do to tf: edges turned round, repeated, added, and split into hops."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

import numpy as np

from graspe_data.geometry import Transform, roll_pitch_yaw, rotation_from_rpy
from graspe_data.simulation.habits.message_parts import Edge, edges_of, stamp_of, tf_message
from graspe_data.simulation.habits.recorded import Habit, Recorded

TF, TF_STATIC = "/tf", "/tf_static"


def edges_changed(change: Callable[[Edge], list[Edge]]) -> Habit:
    """Each edge on /tf becomes some others with its stamp."""

    def habit(stream: Iterable[Recorded]) -> Iterator[Recorded]:
        for message in stream:
            if message.topic != TF:
                yield message
                continue
            stamp_ns = stamp_of(message.content.transforms[0])
            edges = [new for edge in edges_of(message.content) for new in change(edge)]
            yield replace(message, content=tf_message(stamp_ns, edges))

    return habit


def inverted(parent: str, child: str) -> Habit:
    """An edge told the other way round: the odometry frame as child of the body."""

    def change(edge: Edge) -> list[Edge]:
        return [edge.inverse() if (edge.parent, edge.child) == (parent, child) else edge]

    return edges_changed(change)


def second_odometry(parent: str, child: str, frame: str, offset: Transform) -> Habit:
    """Another odometry frame as a child of the body, beside the one that is its parent.

    Spot's drivers turn round only the edge of the frame that is to be the root, so that of
    ``odom`` and ``vision`` one is the body's parent and the other its child.

    Args:
        parent: The odometry frame that is there.
        child: The body.
        frame: The new odometry frame.
        offset: The pose of ``parent`` in ``frame``.
    """

    def change(edge: Edge) -> list[Edge]:
        if (edge.parent, edge.child) != (parent, child):
            return [edge]
        return [edge, Edge(frame, child, offset @ edge.transform).inverse()]

    return edges_changed(change)


def footprint_hop(parent: str, child: str, footprint: str) -> Habit:
    """Odometry of a level footprint on the ground, and a second moving edge from it to the base."""

    def change(edge: Edge) -> list[Edge]:
        if (edge.parent, edge.child) != (parent, child):
            return [edge]
        x, y, _ = edge.transform.translation.tolist()
        _, _, yaw = roll_pitch_yaw(edge.transform.rotation)
        ground = Transform(rotation_from_rpy(0.0, 0.0, float(yaw)), np.array([x, y, 0.0]))
        above = ground.inverse() @ edge.transform
        return [Edge(parent, footprint, ground), Edge(footprint, child, above)]

    return edges_changed(change)


def fixed_edges_on_tf(*, latched: bool = False) -> Habit:
    """The mountings repeated in every message of /tf, among the moving edges.

    Args:
        latched: Whether they stay on /tf_static too.
    """

    def habit(stream: Iterable[Recorded]) -> Iterator[Recorded]:
        fixed: list[Edge] = []
        for message in stream:
            if message.topic == TF_STATIC:
                fixed += edges_of(message.content)
                if latched:
                    yield message
            elif message.topic == TF:
                stamp_ns = stamp_of(message.content.transforms[0])
                edges = [*edges_of(message.content), *fixed]
                yield replace(message, content=tf_message(stamp_ns, edges))
            else:
                yield message

    return habit


def mounting_in_hops(between: str, share: float = 0.5) -> Habit:
    """Each fixed edge through one frame more, as a URDF has them: the way there, then the rest."""

    def habit(stream: Iterable[Recorded]) -> Iterator[Recorded]:
        for message in stream:
            if message.topic != TF_STATIC:
                yield message
                continue
            edges = edges_of(message.content)
            first = Transform(np.eye(3), share * edges[0].transform.translation)
            hops = [Edge(edges[0].parent, between, first)]
            hops += [Edge(between, e.child, first.inverse() @ e.transform) for e in edges]
            stamp_ns = stamp_of(message.content.transforms[0])
            yield replace(message, content=tf_message(stamp_ns, hops))

    return habit
