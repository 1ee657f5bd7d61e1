"""The house: data flows one way, and a room imports only from rooms below it."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

# From below to above; a module belongs to the longest name that begins its own.
HOUSE = (
    ("graspe_data",),
    ("graspe_data.recordings", "graspe_data.observation"),
    ("graspe_data.synchronisation", "graspe_data.known_outcomes"),
    ("graspe_data.inspection", "graspe_data.shards", "graspe_data.simulation"),
    ("graspe_data.bundle_contract",),
    ("model_zoo",),
    ("model_zoo.augmentation", "model_zoo.checkpoints"),
    ("model_zoo.training", "model_zoo.evaluation", "model_zoo.export"),
    ("planners",),
    ("pipelines",),
)
LEVELS = {room: level for level, rooms in enumerate(HOUSE) for room in rooms}
# What a room may import beside the rooms below it, of those on its own level.
BESIDE = {("graspe_data.shards", "graspe_data.simulation")}
# The planner knows models by their bundles alone.
NEVER = {("planners", "model_zoo"), ("model_zoo", "graspe_data.recordings")}
SOURCES = sorted(
    path
    for top in ("graspe_data", "model_zoo", "planners", "pipelines")
    for path in (ROOT / top).rglob("*.py")
    # The front doors name what lies deeper, and import it only when it is asked for.
    if path != ROOT / top / "__init__.py"
)


def room_of(module: str) -> str | None:
    rooms = [room for room in LEVELS if f"{module}.".startswith(f"{room}.")]
    return max(rooms, key=len, default=None)


def imported(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def faults(path: Path) -> list[str]:
    own = room_of(".".join(path.relative_to(ROOT).with_suffix("").parts))
    assert own is not None
    found = []
    for module in imported(path):
        other = room_of(module)
        if other is None or other == own or (own, other) in BESIDE:
            continue
        never = any(own.startswith(a) and other.startswith(b) for a, b in NEVER)
        if LEVELS[other] >= LEVELS[own] or never:
            found.append(f"{own} imports {module}")
    return found


def test_a_room_imports_only_from_rooms_below_it() -> None:
    assert {str(path.relative_to(ROOT)): found for path in SOURCES if (found := faults(path))} == {}


def test_a_window_to_a_room_above_is_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(globals(), "ROOT", tmp_path)
    module = tmp_path / "graspe_data" / "recordings" / "peek.py"
    module.parent.mkdir(parents=True)
    module.write_text("from graspe_data.observation.smoothness import smoothness\n")
    found = "graspe_data.recordings imports graspe_data.observation.smoothness"
    assert faults(module) == [found, f"{found}.smoothness"]
