"""From a checkpoint to a bundle."""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from graspe_data.bundle_contract import (
    BUNDLE,
    CARD_FILE,
    CONTRACT_FILE,
    ENCODE_GRAPH,
    PARITY_FILE,
    RECORDED_FILE,
    SCORE_GRAPH,
    Assumptions,
    Thresholds,
    Tolerance,
)
from graspe_data.documents import canonical_json
from graspe_data.errors import ZooError
from graspe_data.manifest import Settings
from graspe_data.progress import Progress, Silent
from graspe_data.sealed_folder import SEAL_FILE
from graspe_data.shards.dataset_index import read_index
from graspe_data.whole_folder import replaced_folder
from model_zoo.augmentation.reliability import taught_with
from model_zoo.checkpoints import Checkpoint, load_checkpoint
from model_zoo.checkpoints.assumptions import read_assumptions
from model_zoo.export.card import render_card
from model_zoo.export.contract import bundle_contract, planner_inputs, temperature
from model_zoo.export.dependence import check_dependence
from model_zoo.export.graphs import export_graphs
from model_zoo.export.parity import check_parity
from model_zoo.export.scenes import adverse_scenes, candidate_images, drawn_scenes, real_scenes


def write_bundle(folder: Path, files: Mapping[str, bytes]) -> Path:
    """Write the files and their seal under a temporary name, then rename the folder.

    A bundle that stood there is replaced.

    Raises:
        ZooError: Something else lies there, or it cannot be written.
    """
    check_place(folder)
    try:
        with replaced_folder(folder) as place:
            replace(BUNDLE, refusal=ZooError).write(place, files)
    except OSError as error:
        raise ZooError(f"{folder}: cannot be written: {error.strerror}.") from error
    return folder


def check_place(folder: Path) -> None:
    """Refuse a place that holds something other than a bundle.

    Raises:
        ZooError: It names what lies there.
    """
    if not folder.exists():
        return
    if not folder.is_dir():
        raise ZooError(f"{folder}: is a file. Give another folder to --out.")
    others = sorted({path.name for path in folder.iterdir()} - BUNDLE.files - {SEAL_FILE})
    if others:
        raise ZooError(
            f"{folder}: holds other files ({', '.join(others[:3])}), so it is no place for a "
            "bundle. Give a new folder to --out."
        )


def export_bundle(
    checkpoint: Path,
    out: Path,
    dataset: Path | None = None,
    progress: Progress | None = None,
    thresholds: Thresholds | None = None,
) -> Path:
    """Export a checkpoint as a bundle; nothing is written unless onnxruntime agrees with torch.

    Args:
        checkpoint: The folder of a checkpoint.
        out: The bundle's folder; a bundle that lies there is replaced.
        dataset: The dataset it was trained on. With it, real rows are tried; without, drawn ones.
            A checkpoint that does not know how its dataset was made needs it.
        progress: Is told of every case that is tried.
        thresholds: Of the planner; None has the defaults.

    Returns:
        The bundle's folder.

    Raises:
        ZooError: The checkpoint is damaged, the dataset is another, the model cannot be exported,
            parity fails, its output does not depend on its inputs, or ``out`` cannot be written.
        ShardError: The dataset is none, or damaged.
    """
    check_place(out)
    loaded = load_checkpoint(checkpoint)
    _check_reliability(loaded)
    assumptions = _assumptions(loaded, dataset)
    inputs = planner_inputs(loaded, assumptions.observation)
    bases = real_scenes(dataset, tuple(inputs)) if dataset else drawn_scenes([*inputs.values()])
    graphs = export_graphs(loaded.model, temperature(loaded), bases[0].observation())
    contract = bundle_contract(
        loaded, assumptions, graphs.features, Tolerance(), thresholds or Thresholds()
    )
    scenes = [*bases, *adverse_scenes(bases[0])]
    candidates = candidate_images(contract)
    check_dependence(loaded, contract, scenes, candidates)
    parity = check_parity(loaded, graphs, contract, scenes, candidates, progress or Silent())
    files = {
        ENCODE_GRAPH: graphs.encode,
        SCORE_GRAPH: graphs.score,
        CONTRACT_FILE: _json(contract),
        RECORDED_FILE: _npz(parity.recorded),
        PARITY_FILE: _json(parity.report),
        CARD_FILE: render_card(contract, parity.report).encode(),
    }
    return write_bundle(out, files)


def _assumptions(checkpoint: Checkpoint, dataset: Path | None) -> Assumptions:
    where, config = checkpoint.folder, checkpoint.config
    found = config.assumptions
    if dataset is not None:
        index = read_index(dataset)
        if index.dataset_digest != config.dataset_digest:
            raise ZooError(
                f"{where}: trained on the dataset {config.dataset_digest}, {dataset} is "
                f"{index.dataset_digest}. Give the dataset that it was trained on."
            )
        found = found or read_assumptions(index)
    if found is None:
        raise ZooError(
            f"{where}: does not tell how the rows of its dataset were made. Give that dataset "
            "with --dataset; it must be one that `graspe dataset build` made."
        )
    return found


def _json(content: Settings) -> bytes:
    return (canonical_json(content.model_dump(mode="json")) + "\n").encode()


def _npz(arrays: Mapping[str, NDArray[np.generic]]) -> bytes:
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **arrays)
    return buffer.getvalue()


def _check_reliability(checkpoint: Checkpoint) -> None:
    if (given := taught_with(checkpoint.recipe)) != "measured":
        raise ZooError(
            f"{checkpoint.folder}: was taught with {given} reliabilities, which no robot can give. "
            "It is a control: export a model that was taught with measured ones."
        )
