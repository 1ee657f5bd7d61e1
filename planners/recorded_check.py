"""Whether a bundle gives here what it gave where it was exported."""

from __future__ import annotations

import re
import zipfile

import numpy as np
from numpy.typing import NDArray

from graspe_data.bundle_contract import RECORDED_FILE
from graspe_data.errors import PlannerError
from planners.bundle import Bundle

CANDIDATES = "trajectory_image"

LARGEST = 256 << 20
"""Bytes that the recorded arrays may take together."""

Recorded = dict[str, NDArray[np.generic]]


def recorded_deviation(bundle: Bundle) -> float:
    """Run all recorded inputs and compare with the recorded outputs.

    ``recorded.npz`` has the candidates as ``trajectory_image``, the inputs of each scene as
    ``<scene>/<input>`` and the outputs of its first K candidates as ``<scene>/<output>_<K>``.

    Returns:
        The largest absolute difference of any probability.

    Raises:
        PlannerError: Nothing is recorded, or it differs by more than the contract's tolerance.
    """
    recorded, output = _read(bundle), bundle.contract.output.name
    pattern = re.compile(rf"[^/]+/{output}_[1-9][0-9]{{0,5}}")
    wanted = [name for name in recorded if pattern.fullmatch(name)]
    if not wanted:
        raise PlannerError(f"{bundle.path / RECORDED_FILE}: no {output} is recorded.")
    worst = float(np.max([_deviation(bundle, recorded, name) for name in wanted]))
    if not worst <= bundle.contract.parity.absolute:
        raise PlannerError(
            f"{bundle.path / RECORDED_FILE}: {output} differs by {worst:.2g} here, expected at "
            f"most {bundle.contract.parity.absolute:g}. Another onnxruntime made it: export again."
        )
    return worst


def _read(bundle: Bundle) -> Recorded:
    path = bundle.path / RECORDED_FILE
    try:
        with zipfile.ZipFile(path) as archive:
            size = sum(member.file_size for member in archive.infolist())
        recorded = {} if size > LARGEST else dict(np.load(path, allow_pickle=False))
    except Exception as error:  # damaged archives fail in zipfile, zlib and NumPy in many ways
        raise PlannerError(f"{path}: cannot be read: {error}.") from error
    if size > LARGEST:
        raise PlannerError(f"{path}: holds {size} bytes, expected at most {LARGEST}.")
    return recorded


def _deviation(bundle: Bundle, recorded: Recorded, name: str) -> float:
    """The largest difference of one recorded output."""
    scene, _, expected = name.partition("/")
    count = int(expected.rpartition("_")[2])
    inputs = {
        key.removeprefix(f"{scene}/"): value
        for key, value in recorded.items()
        if key.startswith(f"{scene}/")
    }
    if CANDIDATES in recorded:
        inputs[CANDIDATES] = recorded[CANDIDATES][:count]
    found = bundle.score(bundle.encode(inputs), inputs)
    was = np.asarray(recorded[name], np.float32)
    if was.shape != found.shape:
        raise PlannerError(
            f"{bundle.path / RECORDED_FILE}: {name} is {was.shape}, the graphs give {found.shape}."
        )
    return float(np.abs(found - was).max())
