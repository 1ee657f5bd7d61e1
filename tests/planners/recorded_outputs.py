"""Whether a bundle gives here what it gave where it was exported."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from graspe_data.bundle_contract import RECORDED_FILE
from planners.bundle import Bundle

CANDIDATES = "trajectory_image"


def recorded_deviation(bundle: Bundle) -> float:
    """The largest difference of any probability from the recorded one.

    ``recorded.npz`` has the candidates as ``trajectory_image``, the inputs of each scene as
    ``<scene>/<input>`` and the outputs of its first K candidates as ``<scene>/<output>_<K>``.
    """
    recorded = dict(np.load(bundle.path / RECORDED_FILE, allow_pickle=False))
    pattern = re.compile(rf"[^/]+/{bundle.contract.output.name}_[1-9][0-9]*")
    outputs = [name for name in recorded if pattern.fullmatch(name)]
    assert outputs
    return max(_deviation(bundle, recorded, name) for name in outputs)


def _deviation(bundle: Bundle, recorded: dict[str, NDArray[np.generic]], name: str) -> float:
    scene, _, output = name.partition("/")
    count = int(output.rpartition("_")[2])
    inputs = {
        key.removeprefix(f"{scene}/"): value
        for key, value in recorded.items()
        if key.startswith(f"{scene}/")
    }
    if CANDIDATES in recorded:
        inputs[CANDIDATES] = recorded[CANDIDATES][:count]
    found = bundle.score(bundle.encode(inputs), inputs)
    return float(np.abs(found - np.asarray(recorded[name], np.float32)).max())
