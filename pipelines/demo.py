"""The demo: simulated drives, recorded in all three containers, and a dataset of them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from graspe_data.progress import Progress
from graspe_data.recordings.writing import Compression, Container
from graspe_data.simulation.scenario import load_scenario
from pipelines.build import BuildResult, build_dataset
from pipelines.dataset_settings import load_recipe
from pipelines.executors import Workers
from pipelines.simulate import Simulation, simulate

DURATION_S = 60.0
DATASET = "field"


@dataclass(frozen=True)
class DemoRecording:
    """One recording of the demo; its scenario and seed decide its split."""

    scenario: str
    seed: int
    container: Container
    compression: Compression = "none"

    def simulation(self) -> Simulation:
        """What to record."""
        scenario, robot = load_scenario(self.scenario)
        shorter = scenario.model_copy(update={"duration_s": DURATION_S})
        return Simulation(shorter, robot, self.seed, self.container, self.compression)


TRAINING = (
    DemoRecording("meadow", 1, "bag", "lz4"),
    DemoRecording("woodland", 1, "mcap", "zstd"),
    DemoRecording("yard", 1, "db3"),
    DemoRecording("thicket", 1, "mcap"),
)
VALIDATION = (DemoRecording("mixed", 900, "bag"),)
TEST = (DemoRecording("graspe_1_plants", 1, "db3"), DemoRecording("graspe_4_low_light", 1, "mcap"))


def run_demo(out: Path, workers: Workers, progress: Progress) -> BuildResult:
    """Record drives below a folder, where those of today's scenarios stay, and build ``dataset``.

    Raises:
        ManifestError: A shipped scenario or dataset does not validate.
        StageError: A worker process died.
    """
    simulations = [recording.simulation() for recording in (*TRAINING, *VALIDATION, *TEST)]
    done = simulate(simulations, out / "recordings", workers, progress, replace=True)
    recordings = [simulated.path for simulated in done]
    return build_dataset(load_recipe(DATASET), recordings, out / "dataset", workers, progress)
