"""The card of a bundle: what it is and what it takes, for people."""

from __future__ import annotations

from collections.abc import Iterable

from graspe_data.bundle_contract import BundleContract, GraphTensor
from model_zoo.export.parity import ParityReport

_CARD = """\
# {model} ({preset}), a bundle for planners

`encode.onnx` takes one observation to features, once; `score.onnx` takes these and {candidates}
to the probability of success at each of {horizon} steps of {step_s:g} s, 1 = success, calibrated.
numpy and onnxruntime run it.

Dataset `{dataset}`, checkpoint `{checkpoint}`.

| graph | tensor | dtype | shape | unit | frame | meaning |
| --- | --- | --- | --- | --- | --- | --- |
{tensors}

## Whom it is for

The robot `{robot}`: base_link {height:g} m above the ground, footprint {length:g} x {width:g} m.
`contract.json` has the calibration, the mounting and the settings of the observation; a planner
refuses another robot. Not known of it: {unknown}.

A candidate is taken when the least of its probabilities is {acceptance:g} or more; equation (8)
drops the collision-free set where r_point is {reliability:g} or less.

## Parity

onnxruntime against torch on {cases} cases ({kinds}): largest difference of a probability
{difference:.1e}, allowed {tolerance:g}. `parity.json` has all cases, `recorded.npz` their inputs
and outputs.

## Use and limits

Made to rank and to reject candidate trajectories of this robot where the training data come from;
elsewhere its probabilities mean little. It is no safety system: a planner must stop for obstacles
without it.

    from planners.bundle import load_bundle
    bundle = load_bundle(path)
"""


def render_card(contract: BundleContract, report: ParityReport) -> str:
    """The card as Markdown."""
    robot, decision = contract.robot, contract.decision
    kinds = sorted({case.kind for case in report.cases})
    return _CARD.format(
        model=contract.model,
        preset=contract.preset,
        candidates="K candidates" if contract.uses_candidates else "no candidate",
        horizon=contract.horizon,
        step_s=contract.step_s,
        dataset=contract.dataset_digest,
        checkpoint=contract.checkpoint_digest,
        tensors="\n".join(_rows(contract)),
        robot=robot.name,
        height=robot.base_height,
        length=robot.footprint.length,
        width=robot.footprint.width,
        unknown="; ".join(f"{k}, as {why}" for k, why in robot.unknown.items()) or "nothing",
        acceptance=decision.acceptance,
        reliability=decision.reliability,
        cases=len(report.cases),
        kinds=", ".join(kinds),
        difference=report.largest_difference,
        tolerance=report.tolerance,
    )


def _rows(contract: BundleContract) -> Iterable[str]:
    for graph, tensors in (
        ("into encode", contract.encode_inputs),
        ("between", contract.features),
        ("into score", contract.score_inputs),
        ("out of score", (contract.output,)),
    ):
        yield from (_row(graph, tensor) for tensor in tensors)


def _row(graph: str, tensor: GraphTensor) -> str:
    shape = ", ".join(map(str, tensor.shape))
    cells = (graph, tensor.name, tensor.dtype, f"({shape})", tensor.unit, tensor.frame)
    return f"| {' | '.join((*cells, tensor.meaning))} |"
