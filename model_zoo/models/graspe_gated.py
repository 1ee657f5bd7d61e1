"""Beyond the paper: GrASPE whose sensors fade with their reliability, and a control of it.

Equations (6) and (7) weaken the edges of an unreliable sensor, and nothing else. Its nodes keep
what they hold (the graph has self loops) and reach the dense layers undiluted, so that a picture
that shows nothing is read as a good one is. Here what a sensor says is scaled twice by a learnt
function of its reliability: its features before the graph, and its nodes before they are read.

Shapes as in ``graspe``: B rows, N = 120 nodes, T = 10 steps.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from model_zoo.bounds import Share
from model_zoo.contract import Observation
from model_zoo.models.graspe import FeatureCounts, Graspe, GraspeSettings

NOTHING_SAID = 0.5
"""A feature that tells nothing: the middle of the sigmoid behind it."""
PIECES = 8
"""Of equal length, in which the gate is linear."""


class ReliabilityGate(nn.Module):
    """A reliability (B,) within 0..1 to the share of a sensor that counts, (B,).

    The function is linear in pieces, never falls, and is 1 at full reliability: a sum of ramps
    whose heights are a softmax. What it is at 0 is learnt as well; it begins as (1 + 8 r) / 9.
    """

    def __init__(self) -> None:
        """Begin with ramps of equal height."""
        super().__init__()
        self.heights = nn.Parameter(torch.zeros(PIECES + 1))

    def forward(self, reliability: Tensor) -> Tensor:
        """The share that counts."""
        heights = torch.softmax(self.heights, 0)
        begins = torch.arange(PIECES, device=reliability.device)
        ramps = (reliability[:, None] * PIECES - begins).clamp(0, 1)
        return heights[0] + ramps @ heights[1:]


class GateSettings(GraspeSettings):
    """The numbers of GrASPE, and those of its gates.

    Attributes:
        sensor_dropout: Share of the trajectories in training for which one sensor, picture or cloud
            by a toss, says nothing, so that either learns to do alone.
    """

    sensor_dropout: Share = 0.2


class NodeGates(nn.Module):
    """What counts of picture and cloud, (B,) each, to what counts of each node, (B, N)."""

    sensor: Tensor

    def __init__(self, counts: FeatureCounts) -> None:
        """Note of each node whether it is the picture's, the cloud's, or another's."""
        super().__init__()
        sensor = torch.tensor((0, 1, 2, 2)).repeat_interleave(torch.tensor(counts))
        self.register_buffer("sensor", sensor, persistent=False)

    def forward(self, picture: Tensor, cloud: Tensor) -> Tensor:
        """The gates; trajectory and velocities always count wholly."""
        return torch.stack((picture, cloud, torch.ones_like(cloud)), dim=1)[:, self.sensor]


def faded(vector: Tensor, gate: Tensor) -> Tensor:
    """Features (B, N) drawn towards the one that tells nothing, as far as their gate is closed."""
    return NOTHING_SAID + gate * (vector - NOTHING_SAID)


def kept_sensors(rows: int, share: float, device: torch.device) -> tuple[Tensor, Tensor]:
    """For each row 1 or 0 for picture and cloud, (rows,): a share of them loses one of both."""
    chance = torch.rand(rows, device=device)
    no_picture, no_cloud = chance < share / 2, (chance >= share / 2) & (chance < share)
    return (~no_picture).float(), (~no_cloud).float()


class GraspeGated(Graspe):
    """GrASPE with a gate for each sensor."""

    name = "graspe_gated"
    settings_type = GateSettings

    def __init__(self, settings: GateSettings) -> None:
        """Make the model with random weights."""
        super().__init__(settings)
        self.sensor_dropout = settings.sensor_dropout
        self.picture_gate, self.cloud_gate = ReliabilityGate(), ReliabilityGate()
        self.node_gates = NodeGates(self.counts)

    def fuse(self, vector: Tensor, candidates: Observation) -> Tensor:
        """Log-odds of success (K, T) by A-GNN on what the gates let pass."""
        r_img, r_point = candidates["r_img"], candidates["r_point"]
        picture, cloud = self.picture_gate(r_img), self.cloud_gate(r_point)
        if self.training:
            # A sensor that is dropped is one of which nothing is known: its edges fade too.
            keep_picture, keep_cloud = kept_sensors(len(vector), self.sensor_dropout, vector.device)
            r_img, r_point = r_img * keep_picture, r_point * keep_cloud
            picture, cloud = picture * keep_picture, cloud * keep_cloud
        gate = self.node_gates(picture, cloud)
        nodes = self.graph.propagate(faded(vector, gate), r_img, r_point)
        return self.graph.read_out(nodes, gate)


class GraspePlainReliability(Graspe):
    """A control: r_ij = 1 in the graph, and both reliabilities as two inputs of the dense layers.

    What a gate gains beyond this, it gains by how it uses the reliabilities, not by seeing them.
    """

    name = "graspe_plain_reliability"

    def __init__(self, settings: GraspeSettings) -> None:
        """Make the model with random weights."""
        super().__init__(settings)
        self.reliabilities = nn.Linear(2, settings.graph.hidden, bias=False)

    def fuse(self, vector: Tensor, candidates: Observation) -> Tensor:
        """Log-odds of success (K, T): two more columns of the first dense layer."""
        r_img, r_point = candidates["r_img"], candidates["r_point"]
        sound = vector.new_ones(1)
        nodes = self.graph.propagate(vector, sound, sound)
        first, activation, last = self.graph.head
        hidden = first(self.graph.norm(nodes.flatten(1)))
        hidden = hidden + self.reliabilities(torch.stack((r_img, r_point), dim=1))
        return last(activation(hidden))  # type: ignore[no-any-return]
