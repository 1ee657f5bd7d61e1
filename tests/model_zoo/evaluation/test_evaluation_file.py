from __future__ import annotations

import os
from pathlib import Path

import pytest

from graspe_data.errors import ZooError
from model_zoo.augmentation import CONDITIONS
from model_zoo.evaluation.evaluation_file import check_writable, evaluation_name


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
