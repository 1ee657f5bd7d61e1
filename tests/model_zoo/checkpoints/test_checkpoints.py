from __future__ import annotations

import hashlib
import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import safetensors.torch
import torch

from graspe_data.errors import ZooError
from model_zoo.checkpoints import TemperatureScaling, Uncalibrated, load_checkpoint
from model_zoo.checkpoints.config import CHECKPOINT
from tests.model_zoo.checkpoints.tiny_model import COLUMNS, INPUTS, TinyModel

Write = Callable[..., Path]
OBSERVATION = {
    "velocity_history": torch.linspace(-1, 1, 16).reshape(2, 4, 2),
    "r_img": torch.tensor([0.2, 0.9]),
}


def reseal(folder: Path, **changed: bytes) -> None:
    """Change files and seal them as the writer does, as somebody with bad intent would."""
    names = set(json.loads((folder / "manifest.json").read_text())["files"])
    files = {name: (folder / name).read_bytes() for name in names}
    CHECKPOINT.write(folder, files | {name.replace("__", "."): b for name, b in changed.items()})


def edit(folder: Path, **changed: Any) -> None:
    config = json.loads((folder / "config.json").read_text()) | changed
    reseal(folder, config__json=json.dumps(config).encode())


def test_a_checkpoint_gives_the_model_back(write_tiny: Write) -> None:
    torch.manual_seed(3)
    model = TinyModel()
    checkpoint = load_checkpoint(write_tiny(model=model))
    assert not checkpoint.model.training
    for name, tensor in model.state_dict().items():
        assert torch.equal(checkpoint.model.state_dict()[name], tensor)
    assert checkpoint.recipe == {"epochs": 2, "seed": 0, "optimiser": {"rate": 5e-4}}
    assert checkpoint.metrics == {"au_roc": 0.75, "epoch": 1, "steps": 7}
    assert checkpoint.config.parameters == 30
    assert [column.name for column in checkpoint.config.columns] == list(TinyModel.columns)


def test_predictions_are_calibrated_and_read_only_the_models_columns(write_tiny: Write) -> None:
    checkpoint = load_checkpoint(write_tiny())
    raw = checkpoint.model.logits(OBSERVATION)
    predicted = checkpoint.predict(OBSERVATION | {"image": torch.zeros(2)})
    assert torch.allclose(predicted, torch.sigmoid(raw / 2.0))
    assert not predicted.requires_grad
    plain = load_checkpoint(write_tiny("plain", calibration=None))
    assert torch.equal(plain.predict(OBSERVATION), torch.sigmoid(raw).detach())


def test_why_it_is_not_calibrated_is_kept_and_told(write_tiny: Write) -> None:
    why = Uncalibrated(reason="1 validation rows have a failing step")
    folder = write_tiny(calibration=why)
    checkpoint = load_checkpoint(folder)
    assert (checkpoint.calibration, checkpoint.uncalibrated) == (None, why)
    assert "1 validation rows have a failing step." in (folder / "card.md").read_text()


def test_log_odds_tell_apart_what_probabilities_do_not(write_tiny: Write) -> None:
    cold = TemperatureScaling(temperature=0.05, judged=7, loss_before=0.9, loss_after=0.6)
    model = TinyModel()
    with torch.no_grad():
        model.linear.weight.mul_(20)
    checkpoint = load_checkpoint(write_tiny(model=model, calibration=cold))
    raw, found = checkpoint.model.logits(OBSERVATION), checkpoint.log_odds(OBSERVATION)
    assert torch.allclose(found, raw.double() / 0.05)
    assert len(set(found.flatten().tolist())) == found.numel()
    assert len(set(checkpoint.predict(OBSERVATION).flatten().tolist())) < found.numel()


def test_the_same_arguments_give_the_same_bytes(write_tiny: Write) -> None:
    first, second = write_tiny("first"), write_tiny("second")
    for file in first.iterdir():
        assert file.read_bytes() == (second / file.name).read_bytes()
    assert load_checkpoint(first).digest == load_checkpoint(second).digest
    assert load_checkpoint(write_tiny("third", seed=1)).digest != load_checkpoint(first).digest


def test_every_file_is_sealed_and_the_card_tells(write_tiny: Write) -> None:
    folder = write_tiny()
    seal = json.loads((folder / "manifest.json").read_text())["files"]
    assert {path.name for path in folder.iterdir()} == {*seal, "manifest.json"}
    for name, entry in seal.items():
        content = (folder / name).read_bytes()
        assert entry == {
            "bytes": len(content),
            "sha256": hashlib.sha256(content).hexdigest(),
        }
    card = (folder / "card.md").read_text()
    for phrase in (
        "# tiny (small)",
        "30 parameters",
        "velocity_history",
        "2.000",
        "optimiser.rate",
    ):
        assert phrase in card


def test_a_checkpoint_is_replaced_and_what_lies_beside_it_stays(write_tiny: Write) -> None:
    folder = write_tiny()
    (folder / "log.txt").write_text("mine")
    old = load_checkpoint(folder).digest
    assert load_checkpoint(write_tiny(seed=5)).digest != old
    assert (folder / "log.txt").read_text() == "mine"


@pytest.mark.parametrize("name", ["model.safetensors", "config.json", "card.md", "recipe.yaml"])
def test_a_changed_file_is_named(write_tiny: Write, name: str) -> None:
    folder = write_tiny()
    content = bytearray((folder / name).read_bytes())
    content[-1] ^= 1
    (folder / name).write_bytes(content)
    with pytest.raises(ZooError, match=rf"{name}: was changed or damaged"):
        load_checkpoint(folder)
    (folder / name).write_bytes(content[:-1])
    with pytest.raises(ZooError, match=rf"{name}: has {len(content) - 1} bytes"):
        load_checkpoint(folder)
    (folder / name).unlink()
    with pytest.raises(ZooError, match=rf"{name}: missing, so"):
        load_checkpoint(folder)


def test_an_unfinished_checkpoint_is_refused(write_tiny: Write, tmp_path: Path) -> None:
    folder = write_tiny()
    (folder / "manifest.json").unlink()
    with pytest.raises(ZooError, match="no finished checkpoint"):
        load_checkpoint(folder)
    with pytest.raises(ZooError, match="no finished checkpoint"):
        load_checkpoint(tmp_path / "nowhere")


@pytest.mark.parametrize(
    ("changed", "text"),
    [
        ({"format": "graspe-checkpoint-9"}, r"config\.json: not a valid .*\n.*format"),
        ({"model": "grasp"}, r"config\.json: no model 'grasp'.*Did you mean 'graspe'"),
        ({"model": "graspe", "numbers": {"nodes": 3}}, r"config\.json: (?s:.*)nodes: unknown key"),
        ({"model": "graspe", "numbers": {}}, "weights that the file lacks: .*in all"),
        ({"numbers": {"horizon": 4}}, r"weight: expected F32 \(4, 9\), found F32 \(3, 9\)"),
        ({"numbers": {"width": 4}}, "config.json: .*unexpected keyword argument 'width'"),
        (
            {"numbers": {"horizon": 1 << 40}},
            r"config\.json: a number is 1099511627776, expected at",
        ),
        ({"parameters": 5}, r"the model has 30 parameters, config\.json says 5"),
        ({"horizon": 9}, "predicts 3 steps .*says 9"),
        ({"columns": []}, "predicts 3 steps from velocity_history, r_img; the checkpoint says 3"),
        ({"extra": 1}, "extra: unknown key"),
    ],
)
def test_a_checkpoint_of_something_else_is_refused(
    write_tiny: Write, changed: dict[str, Any], text: str
) -> None:
    folder = write_tiny()
    edit(folder, **changed)
    with pytest.raises(ZooError, match=text):
        load_checkpoint(folder)


def test_no_memory_is_taken_for_weights_that_the_file_lacks(write_tiny: Write) -> None:
    folder = write_tiny()
    edit(folder, numbers={"horizon": 1 << 20})
    with pytest.raises(ZooError, match=r"linear\.weight: expected F32 \(1048576, 9\)"):
        load_checkpoint(folder)


def test_a_preset_that_is_not_known_here_is_not_needed(write_tiny: Write) -> None:
    assert load_checkpoint(write_tiny(preset="mine")).config.preset == "mine"


@pytest.mark.parametrize("name", ["card.md", "manifest.json"])
def test_a_pipe_is_refused_without_waiting_for_its_writer(write_tiny: Write, name: str) -> None:
    folder = write_tiny()
    (folder / name).unlink()
    os.mkfifo(folder / name)
    with pytest.raises(ZooError, match=rf"{name}: expected a regular file"):
        load_checkpoint(folder)


def test_weights_of_another_layout_are_named(write_tiny: Write) -> None:
    folder = write_tiny()
    weights = safetensors.torch.load_file(folder / "model.safetensors")
    extra = weights | {"more": torch.zeros(1)}
    halves = weights | {"linear.bias": weights["linear.bias"].half()}
    for changed, text in (
        (safetensors.torch.save(extra), "weights that the model lacks: more"),
        (safetensors.torch.save(halves), r"linear\.bias: expected F32 \(3,\), found F16 \(3,\)"),
        (b"\xff" * 64, "not a file of weights"),
        (b"", "not a file of weights"),
    ):
        reseal(folder, model__safetensors=changed)
        with pytest.raises(ZooError, match=text):
            load_checkpoint(folder)


def test_a_seal_of_other_files_is_refused(write_tiny: Write) -> None:
    folder = write_tiny()
    reseal(folder, evil__pkl=b"cos\nsystem")
    with pytest.raises(ZooError, match=r"other files than a checkpoint has: evil\.pkl"):
        load_checkpoint(folder)
    for content in (b"[]", b"{", b'{"format": "graspe-checkpoint-2", "files": {}}', b"[" * 9999):
        (folder / "manifest.json").write_bytes(content)
        with pytest.raises(ZooError, match=r"manifest\.json"):
            load_checkpoint(folder)


def test_what_cannot_be_written_is_refused(write_tiny: Write, tmp_path: Path) -> None:
    diverged = TinyModel()
    with torch.no_grad():
        diverged.linear.bias[1] = torch.nan
    with pytest.raises(ZooError, match=r"linear\.bias: a weight is not finite"):
        write_tiny(model=diverged)
    with pytest.raises(ZooError, match="the model reads r_img, which is not declared"):
        write_tiny(columns=COLUMNS[:1])
    with pytest.raises(ZooError, match="JSON"):
        write_tiny(metrics={"au_roc": float("nan")})
    with pytest.raises(ZooError, match="dataset_digest"):
        write_tiny(dataset_digest="none")
    (tmp_path / "file").write_text("")
    with pytest.raises(ZooError, match="cannot be made or written"):
        write_tiny("file")


def test_data_of_another_shape_is_refused(write_tiny: Write) -> None:
    config = load_checkpoint(write_tiny()).config
    config.check_columns(COLUMNS, "data")
    with pytest.raises(ZooError, match="data: no column 'r_img', which tiny reads"):
        config.check_columns(COLUMNS[:1], "data")
    long = INPUTS[0].model_copy(update={"shape": (50, 2)})
    with pytest.raises(ZooError, match=r"expects float32 \(4, 2\), found float32 \(50, 2\)"):
        config.check_columns((long, INPUTS[1]), "data")


def test_a_checkpoint_of_links_is_loaded_from_a_hubs_cache_or_where_the_user_says(
    write_tiny: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain = write_tiny()
    digest = load_checkpoint(plain).digest
    repository = tmp_path / "models--group--tiny"
    snapshot, elsewhere = repository / "snapshots" / "0a1b", tmp_path / "elsewhere"
    for folder in (repository / "blobs", snapshot, elsewhere):
        folder.mkdir(parents=True)
    for file in sorted(plain.iterdir()):
        shutil.copy(file, repository / "blobs" / file.name)
        (snapshot / file.name).symlink_to(f"../../blobs/{file.name}")
        (elsewhere / file.name).symlink_to(repository / "blobs" / file.name)
    assert load_checkpoint(snapshot).digest == digest
    with pytest.raises(ZooError, match=r"a link to .* GRASPE_LINKS="):
        load_checkpoint(elsewhere)
    monkeypatch.setenv("GRASPE_LINKS", str(repository / "blobs"))
    assert load_checkpoint(elsewhere).digest == digest
    (repository / "blobs" / "metrics.json").write_text("{}")
    with pytest.raises(ZooError, match=r"metrics\.json: has 2 bytes"):
        load_checkpoint(elsewhere)
