"""What the file of an evaluation may hold, and where it goes."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from graspe_data.errors import ZooError
from model_zoo.augmentation import CONDITIONS
from model_zoo.checkpoints import load_checkpoint
from model_zoo.evaluation import evaluate, read_evaluation
from model_zoo.evaluation.evaluation import check_writable, evaluation_name
from tests.model_zoo.checkpoints.tiny_model import write_tiny_dataset

Content = dict[str, Any]


@pytest.fixture
def content(write_tiny: Callable[..., Path], tmp_path: Path) -> Content:
    data = write_tiny_dataset(tmp_path / "data", ("hill", "hill", "hill"))
    made = evaluate(load_checkpoint(write_tiny()), data, conditions=("clean",), resamples=9)
    found: Content = json.loads(made.model_dump_json())
    return found


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda c: c["scores"]["au_roc"].update(value=5.0), r"au_roc\.value: .*less than or equal"),
        (lambda c: c["scores"]["brier"].update(value=-0.1), r"brier\.value: .*greater than"),
        (lambda c: c["scores"]["au_roc"].update(low=0.9, high=0.1), "low 0.9 is above high 0.1"),
        (lambda c: c["scores"]["au_roc"].update(low=None), "expected both or none"),
        (lambda c: c["scores"].pop("au_roc"), "expected au_roc among them"),
        (
            lambda c: c["parts"]["all_rows"]["resamples"].pop(),
            "all_rows of 'all' under 'clean': found 8, expected 9 or none",
        ),
        (lambda c: c["parts"].pop("all_rows"), "parts: expected all_rows among them"),
        (lambda c: c["roc"]["true_positive"].pop(), "at least 201 items"),
        (lambda c: c["calibration"]["judged"].pop(), "expected as many in each"),
        (lambda c: c.update(judged=1), "judged steps, the cell 1"),
        (lambda c: c.update(success_share=2), r"success_share: .*less than or equal"),
        (lambda c: c.update(scenario="hill"), "one for every scenario, and for 'all'"),
    ],
)
def test_a_contradiction_is_named_with_its_file(
    content: Content, damage: Callable[[Content], object], said: str, tmp_path: Path
) -> None:
    damage(content["cells"][0])
    path = tmp_path / "evaluation.json"
    path.write_text(json.dumps(content))
    with pytest.raises(ZooError, match=said) as refusal:
        read_evaluation(path)
    assert str(path) in str(refusal.value)


def test_an_evaluation_without_scores_is_refused(content: Content, tmp_path: Path) -> None:
    path = tmp_path / "evaluation.json"
    path.write_text(json.dumps(content | {"cells": []}))
    with pytest.raises(ZooError, match="cells: found 0, expected one for every scenario"):
        read_evaluation(path)


def test_a_count_beyond_any_memory_is_refused(content: Content, tmp_path: Path) -> None:
    path = tmp_path / "evaluation.json"
    content["latency"]["weight_bytes"] = 10**400
    path.write_text(json.dumps(content))
    with pytest.raises(ZooError, match=r"latency\.weight_bytes"):
        read_evaluation(path)


def test_a_pipe_is_refused_and_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "evaluation.json")
    with pytest.raises(ZooError, match="no regular file"):
        read_evaluation(tmp_path / "evaluation.json")


@pytest.mark.parametrize(
    ("split", "conditions", "every", "name"),
    [
        ("test", CONDITIONS, 1, "evaluation.json"),
        ("test", ("clean",), 1, "evaluation-clean.json"),
        ("test", CONDITIONS, 4, "evaluation-every_4.json"),
        ("validation", ("clean",), 4, "evaluation-validation-clean-every_4.json"),
        ("a/b", CONDITIONS, 1, "evaluation-a_b.json"),
    ],
)
def test_what_is_not_all_is_in_the_name(
    split: str, conditions: tuple[str, ...], every: int, name: str
) -> None:
    assert evaluation_name(split, conditions, every) == name


def test_a_place_that_takes_a_file_is_left_as_it_was(tmp_path: Path) -> None:
    file = tmp_path / "evaluation.json"
    check_writable(file)
    assert not any(tmp_path.iterdir())
    file.write_text("mine")
    check_writable(file)
    assert file.read_text() == "mine"


def test_a_place_that_takes_no_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ZooError, match="is a folder; expected the path of a file"):
        check_writable(tmp_path)
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(ZooError, match="is no regular file"):
        check_writable(tmp_path / "pipe")
    with pytest.raises(ZooError, match="cannot be written: No such file or directory"):
        check_writable(tmp_path / "nowhere" / "evaluation.json")
