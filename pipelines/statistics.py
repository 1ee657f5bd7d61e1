"""Numbers about an episode for its entry in ``dataset.json``."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydantic import JsonValue

from graspe_data.observation.catalogue import BY_NAME, RELIABILITIES
from pipelines.episode import whole_column
from pipelines.process_recording import Episode

QUANTILES = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)
AGES = ("points_age_ns", "odometry_age_ns")


def episode_statistics(episode: Episode, rows: NDArray[np.int64]) -> dict[str, JsonValue]:
    """Class balance, and quantiles of ages and reliabilities, of some rows; nothing for no rows."""
    if not rows.size:
        return {}

    def column(name: str) -> NDArray[np.generic]:
        values: NDArray[np.generic] = whole_column(episode.folders[BY_NAME[name].stage], name)
        return values[rows]

    success, mask = column("success"), column("success_mask").astype(bool)
    failing = (mask & (success == 0)).any(axis=1)
    quantiles: dict[str, JsonValue] = {
        name: _quantiles(column(name)) for name in (*RELIABILITIES, *AGES)
    }
    return {
        "rows_failing": int(np.count_nonzero(failing)),
        "rows_without_judgement": int(np.count_nonzero(~mask.any(axis=1))),
        "steps_judged": int(np.count_nonzero(mask)),
        "steps_succeeding": int(np.count_nonzero(mask & (success == 1))),
        "quantiles": quantiles,
    }


def _quantiles(values: NDArray[np.generic]) -> JsonValue:
    return [float(q) for q in np.quantile(values.astype(np.float64), QUANTILES)]
