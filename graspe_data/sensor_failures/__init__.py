"""What deceives a sensor, each once: for the simulated field and for rows of a dataset."""

from graspe_data.sensor_failures.beams import Dust, MetReturns, NearLeaves, meet_dust, meet_leaves
from graspe_data.sensor_failures.lens import Droplets, Glare, add_glare, through_droplets

__all__ = [
    "Droplets",
    "Dust",
    "Glare",
    "MetReturns",
    "NearLeaves",
    "add_glare",
    "meet_dust",
    "meet_leaves",
    "through_droplets",
]
