from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from graspe_data.errors import ZooError
from graspe_data.manifest import shipped_manifests
from model_zoo import presets
from model_zoo.presets import merged, presets_of


def test_an_ablations_file_says_only_what_differs() -> None:
    folder = shipped_manifests() / "models"
    manifests = {path.stem: yaml.safe_load(path.read_text()) for path in folder.glob("*.yaml")}
    assert manifests["graspe_no_reliability"] == {"extends": "graspe"}
    assert manifests["graspe_plain_reliability"] == {"extends": "graspe"}
    assert manifests["nmfnet_trajectory"] == {"extends": "nmfnet"}
    assert {key for p in manifests["graspe_no_agnn"]["presets"].values() for key in p} == {
        "convolutions"
    }


def test_what_is_extended_is_the_parents_but_for_what_it_is_without() -> None:
    parent, child = presets_of("graspe")["small"], presets_of("graspe_no_agnn")["small"]
    assert child.keys() == parent.keys() - {"graph"} | {"convolutions"}
    assert child["encoders"] == parent["encoders"]


def test_a_mapping_is_merged_key_by_key_and_the_first_stays_as_it_was() -> None:
    numbers = {"a": {"b": 1, "c": 2}, "d": [1]}
    assert merged(numbers, {"a": {"b": 3}, "d": [2]}) == {"a": {"b": 3, "c": 2}, "d": [2]}
    assert numbers == {"a": {"b": 1, "c": 2}, "d": [1]}


@pytest.mark.parametrize("parent", ["paad", "no_model"])
def test_a_circle_and_an_unknown_parent_are_refused(
    parent: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "paad.yaml").write_text(f"extends: {parent}")
    monkeypatch.setattr(presets, "_manifest", lambda name: tmp_path / f"{name}.yaml")
    with pytest.raises(ZooError, match=f"paad.yaml: extends '{parent}', expected another model"):
        presets_of("paad")
