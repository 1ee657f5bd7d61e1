"""``graspe export``: a checkpoint as a bundle. Torch is loaded where it is needed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from graspe_data.bundle_contract import PARITY_FILE, Thresholds
from pipelines.commands.zoo import needing_torch
from pipelines.progress import ConsoleProgress


def export(
    checkpoint: Annotated[Path, typer.Argument(help="The folder of a checkpoint.")],
    out: Annotated[Path, typer.Option(help="The bundle's folder; a bundle there is replaced.")],
    dataset: Annotated[
        Path | None,
        typer.Option(help="The dataset it was trained on: the bundle is tried on real rows of it."),
    ] = None,
    acceptance: Annotated[
        float,
        typer.Option(
            min=0, max=1, help="e_th: a planner drives an arc when min(E) is this or more."
        ),
    ] = Thresholds().acceptance,
    reliability: Annotated[
        float,
        typer.Option(min=0, max=1, help="r_th: at this r_point or less it does not ask the scan."),
    ] = Thresholds().reliability,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Export a model for planners: ONNX graphs, contract, recorded inputs and outputs.

    Nothing is written unless onnxruntime gives what torch gives.
    """
    with needing_torch():
        from model_zoo.export import export_bundle  # noqa: PLC0415
    with ConsoleProgress(Console(stderr=True)) as progress:
        thresholds = Thresholds(acceptance=acceptance, reliability=reliability)
        bundle = export_bundle(checkpoint, out, dataset, progress, thresholds)
    parity = json.loads((bundle / PARITY_FILE).read_text(encoding="utf-8"))
    if as_json:
        typer.echo(json.dumps({"bundle": str(bundle), "parity": parity}, indent=2))
        return
    typer.echo(
        f"{bundle}: onnxruntime and torch agree to {parity['largest_difference']:.1e} "
        f"(allowed {parity['tolerance']:g}) in {len(parity['cases'])} cases"
    )
