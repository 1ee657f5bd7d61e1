"""Which topics belong to one robot, where a recording holds several."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import Final

from graspe_data.inspection.roles import Role

_TELLING: Final[tuple[Role, ...]] = ("image", "points", "odometry")
_ALIKE: Final = 2

Space = tuple[str, ...]


def same_robot(one: str, other: str, spaces: Collection[Space]) -> bool:
    """Whether two topics may be of one robot: they lie in no two of these namespaces."""
    homes = [{space for space in spaces if _below(name, space)} for name in (one, other)]
    return homes[0] == homes[1] or not all(homes)


def own_topics(candidates: Mapping[Role, Collection[str]]) -> dict[Role, set[str]]:
    """The candidates of one robot, for each role; all of them where there is one robot.

    Two namespaces are two robots where each holds a camera, a lidar and odometry, or where two of
    these have the same names below both. The robot with the most roles is taken, then the first by
    name. A role that it lacks is filled from outside the others' namespaces, else from anywhere.
    """
    whole = {role: set(names) for role, names in candidates.items()}
    spaces = robot_namespaces(candidates)
    if len(spaces) < _ALIKE:
        return whole
    chosen = min(spaces, key=lambda space: (-len(_roles(candidates, space)), space))
    rivals = [space for space in spaces if space != chosen]
    found = {}
    for role, names in whole.items():
        own = {name for name in names if _below(name, chosen)}
        outside = {name for name in names if not any(_below(name, rival) for rival in rivals)}
        found[role] = own or outside or names
    return found


def robot_namespaces(candidates: Mapping[Role, Collection[str]]) -> list[Space]:
    """The namespaces of a recording's robots, sorted; fewer than two where it holds one."""
    spaces = sorted({space for role in _TELLING for space in _spaces(candidates.get(role, ()))})
    complete = [space for space in spaces if len(_roles(candidates, space)) == len(_TELLING)]
    found = {space for space in complete if not any(_inside(other, space) for other in complete)}
    for space in spaces:
        twins = [other for other in spaces if _apart(space, other)]
        if any(len(_alike(candidates, space, other)) >= _ALIKE for other in twins):
            found.add(space)
    deepest = {space for space in found if not any(_inside(space, other) for other in found)}
    return sorted(deepest)


def _parts(name: str) -> Space:
    return tuple(part for part in name.split("/") if part)


def _spaces(names: Collection[str]) -> Iterator[Space]:
    for name in names:
        parts = _parts(name)
        yield from (parts[:depth] for depth in range(1, len(parts)))


def _below(name: str, space: Space) -> bool:
    return _parts(name)[: len(space)] == space


def _inside(inner: Space, outer: Space) -> bool:
    return inner != outer and inner[: len(outer)] == outer


def _apart(one: Space, other: Space) -> bool:
    return one != other and len(one) == len(other)


def _roles(candidates: Mapping[Role, Collection[str]], space: Space) -> set[Role]:
    return {
        role for role in _TELLING if any(_below(name, space) for name in candidates.get(role, ()))
    }


def _alike(candidates: Mapping[Role, Collection[str]], one: Space, other: Space) -> set[Role]:
    """The roles that have a topic of the same name below both namespaces."""

    def names(role: Role, space: Space) -> set[Space]:
        below = (name for name in candidates.get(role, ()) if _below(name, space))
        return {_parts(name)[len(space) :] for name in below}

    return {role for role in _TELLING if names(role, one) & names(role, other)}
