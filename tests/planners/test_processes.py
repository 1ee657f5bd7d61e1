"""A planner in another process than the one that made it answers, or says at once why not."""

from __future__ import annotations

import copy
import gc
import multiprocessing
import os
import pickle
import threading
import time
import weakref
from collections.abc import Callable
from typing import Any

import pytest

from graspe_data.calibration import Calibration
from graspe_data.errors import PlannerError
from planners.bundle import Bundle
from planners.deadline import Deadline
from planners.scorer import Scorer
from planners.situation import Command
from tests.planners.conftest import NOW, Robots
from tests.planners.every_planner import (
    BY_MODEL,
    PLANNERS,
    SECOND,
    guarded,
    seen_anew,
    sound,
    stops,
)

pytestmark = pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
LONG_S = 60.0
"""What a busy machine may take; a child that hangs takes it whole."""


def in_child(ask: Callable[[], Any]) -> Any:
    """What a forked process answers, or fails if it does not."""
    context = multiprocessing.get_context("fork")
    mine, its = context.Pipe(duplex=False)

    def answer() -> None:
        try:
            its.send(ask())
        except Exception as error:  # noqa: BLE001 - the parent looks at it
            its.send(error)

    child = context.Process(target=answer)
    child.start()
    try:
        assert mine.poll(LONG_S), "the forked process does not answer"
        return mine.recv()
    finally:
        child.kill()
        child.join()


@pytest.mark.parametrize("asked_before", [False, True])
@pytest.mark.parametrize("name", list(PLANNERS))
def test_a_planner_that_was_made_before_a_fork(
    name: str, asked_before: bool, robots: Robots
) -> None:
    planner = guarded(name, robots)
    if asked_before:
        assert planner.command(sound()).reason == ""
    found = in_child(lambda: planner.command(seen_anew(sound(NOW + SECOND), 1)))
    assert isinstance(found, Command)
    if name in BY_MODEL:
        assert stops(found)
        assert "call load_bundle in the process that asks it" in found.reason
    else:
        assert found.reason == ""
    assert planner.command(seen_anew(sound(NOW + 2 * SECOND), 2)).reason == ""


def test_a_bundle_raises_at_once_in_a_forked_process(
    bundle: Bundle, calibration: Calibration
) -> None:
    scorer = Scorer(bundle, calibration)
    scorer.scene(sound())
    for ask in (lambda: scorer.scene(sound(NOW + SECOND)), lambda: bundle.encode({})):
        assert isinstance(in_child(ask), PlannerError)


def test_a_planner_made_in_the_child_answers(robots: Robots) -> None:
    def ask() -> Command:
        return guarded("dwa_fox", robots).command(sound())

    assert in_child(ask).reason == ""


@pytest.mark.parametrize("send", [pickle.dumps, copy.deepcopy])
def test_a_bundle_cannot_be_sent(send: Callable[[Any], Any], bundle: Bundle) -> None:
    with pytest.raises(PlannerError, match="call load_bundle in the process that asks it"):
        send(bundle)


def test_a_question_that_hung_in_the_parent_does_not_hang_the_child() -> None:
    deadline, release = Deadline[int](0.1), threading.Event()
    with pytest.raises(PlannerError, match=r"no answer within 0\.1 s"):
        deadline.ask(lambda: int(release.wait(LONG_S)))
    with pytest.raises(PlannerError, match="no answer yet"):
        deadline.ask(os.getpid)
    assert in_child(lambda: deadline.ask(lambda: 7)) == 7
    release.set()
    time.sleep(0.2)
    assert deadline.ask(os.getpid) == os.getpid()


class _Mark:
    """What a thread keeps of its own; it goes with the thread."""

    def __init__(self) -> None:
        self.thread = threading.get_native_id()


def test_a_thread_that_answered_does_not_end() -> None:
    # OpenCV ends a thread under a lock, and a process that is forked then waits for it for ever.
    kept, ended = threading.local(), threading.Event()

    def ask() -> int:
        kept.mark = mark = _Mark()
        weakref.finalize(mark, ended.set)
        return mark.thread

    first = Deadline[int](LONG_S).ask(ask)
    assert not ended.wait(0.2)
    assert Deadline[int](LONG_S).ask(threading.get_native_id) == first
    assert in_child(lambda: Deadline[int](LONG_S).ask(threading.get_native_id)) != first


def test_an_idle_thread_keeps_no_planner_alive(robots: Robots) -> None:
    planner = guarded("dwa_fox", robots)
    assert planner.command(sound()).reason == ""
    gone = weakref.ref(planner)
    del planner
    gc.collect()
    assert gone() is None


@pytest.mark.parametrize("error", [ValueError("four"), PlannerError("five")])
def test_what_is_raised_is_raised(error: Exception) -> None:
    def raises() -> int:
        raise error

    with pytest.raises(type(error), match=str(error)):
        Deadline[int](LONG_S).ask(raises)


def test_a_planner_that_exits_is_no_exit() -> None:
    def leaves() -> int:
        raise SystemExit(3)

    with pytest.raises(PlannerError, match=r"no answer: SystemExit\(3\)"):
        Deadline[int](LONG_S).ask(leaves)
