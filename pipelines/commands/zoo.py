"""``graspe zoo``: list, train, evaluate and compare models. Torch is loaded where it is needed."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer
from rich.console import Console
from rich.table import Table

from graspe_data.errors import StageError
from pipelines.commands.overrides import read_overrides
from pipelines.progress import ConsoleProgress

if TYPE_CHECKING:
    from model_zoo.evaluation.zoo_index import ZooIndex
    from model_zoo.training.machine import Machine
    from pipelines.training_progress import ConsoleTrainingProgress

app = typer.Typer(no_args_is_help=True, help="List, train, evaluate and compare models.")

Data = Annotated[Path, typer.Option("--data", help="The dataset's folder.")]
Preset = Annotated[str, typer.Option(help="`paper` has the sizes printed.")]
RecipeName = Annotated[str, typer.Option("--recipe", help="A recipe: a path or a shipped name.")]
Split = Annotated[str, typer.Option(help="Rows to evaluate.")]
Device = Annotated[Literal["auto", "cpu", "cuda"], typer.Option(help="What to compute on.")]
Readers = Annotated[int, typer.Option("--workers", min=0, help="Processes that read ahead.")]
Clean = Annotated[bool, typer.Option(help="Only with clean sensors: five times faster.")]
Conditions = Annotated[
    list[str] | None,
    typer.Option(
        "--condition",
        help="A condition of the sensors, the first of which tables show where they show one; "
        "repeat for several, or `all`. Default: clean and the four of the docs.",
    ),
]
Every = Annotated[int, typer.Option(min=1, help="Of a recording's rows, evaluate each so many.")]
Threads = Annotated[int | None, typer.Option(min=1, help="Threads of torch; else its own choice.")]


@app.command("list")
def list_command(
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """List the models: presets, parameters, AU-ROC in the shipped comparison, columns."""
    with needing_torch():
        from model_zoo.evaluation.parts import TITLES  # noqa: PLC0415
        from model_zoo.evaluation.zoo_index import shipped_index  # noqa: PLC0415
        from model_zoo.registry import list_models  # noqa: PLC0415
    index = shipped_index()
    models = {name: _listed(index, name, presets) for name, presets in list_models().items()}
    if as_json:
        typer.echo(json.dumps({name: asdict(model) for name, model in models.items()}, indent=2))
        return
    table = Table("model", "parameters", f"AU-ROC, {TITLES[index.rows]}", "columns")
    for name, model in models.items():
        counts = "\n".join(f"{preset}: {count:,}" for preset, count in model.parameters.items())
        scores = "\n".join(f"{score:.3f}" if score else "-" for score in model.au_roc.values())
        table.add_row(name, counts, scores, ", ".join(model.columns))
    Console().print(table)


@dataclass(frozen=True)
class ListedModel:
    """A model of the zoo: weights and AU-ROC by preset, and the columns that it reads."""

    parameters: dict[str, int]
    au_roc: dict[str, float | None]
    columns: list[str]


def _listed(index: ZooIndex, name: str, presets: Sequence[str]) -> ListedModel:
    from model_zoo.registry import create_model  # noqa: PLC0415

    models = {preset: create_model(name, preset) for preset in presets}
    sizes = {preset: sum(p.numel() for p in m.parameters()) for preset, m in models.items()}
    return ListedModel(
        sizes, _scores(index, name, sizes), list(next(iter(models.values())).columns)
    )


@app.command("train")
def train_command(
    model: Annotated[str, typer.Argument(help="One of `graspe zoo list`.")],
    data: Data,
    out: Annotated[Path, typer.Option(help="The run's folder; run again, it goes on.")],
    preset: Preset = "small",
    recipe: RecipeName = "small",
    changes: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="A setting that differs from the preset's, such as graph.decay=5; repeat.",
        ),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, max=2**63 - 1, help="Instead of the recipe's.")
    ] = None,
    epochs: Annotated[
        int | None, typer.Option(min=1, max=10**9, help="Instead of the recipe's.")
    ] = None,
    searched: Annotated[
        int | None,
        typer.Option(
            min=1, help="Trainings whose validation scores chose the settings; for the tables."
        ),
    ] = None,
    begin: Annotated[
        Path | None,
        typer.Option(
            "--from", metavar="RUN", help="A finished run: go on to more epochs, as a new run."
        ),
    ] = None,
    device: Device = "auto",
    workers: Readers = 1,
    threads: Threads = None,
) -> None:
    """Train a model; interrupted, the same command goes on to the same weights."""
    with needing_torch():
        from model_zoo.training.recipe import load_recipe  # noqa: PLC0415
        from model_zoo.training.train import train  # noqa: PLC0415
    budget = load_recipe(recipe)
    changed = {"seed": seed, "epochs": epochs, "searched": searched}
    budget = budget.model_copy(update={key: n for key, n in changed.items() if n is not None})
    machine, overrides = _machine(device, workers, threads), read_overrides(changes or [])
    with _training() as progress:
        checkpoint = train(model, preset, data, budget, out, progress, machine, begin, **overrides)
    typer.echo(f"{checkpoint}\nNext: graspe zoo evaluate {checkpoint} --data {data}")


@app.command("evaluate")
def evaluate_command(
    checkpoint: Annotated[Path, typer.Argument(help="The folder of a checkpoint.")],
    data: Data,
    out: Annotated[
        Path | None,
        typer.Option(help="The file; default: beside it, its name telling what is left out."),
    ] = None,
    split: Split = "test",
    clean: Clean = False,
    condition: Conditions = None,
    every: Every = 1,
    references: Annotated[
        Path | None,
        typer.Option(
            help="A dataset whose training rows teach the blind references, if --data has none."
        ),
    ] = None,
    device: Device = "auto",
    threads: Threads = None,
) -> None:
    """Score a checkpoint on rows not failing yet, beside references that have no camera or cloud.

    Prints each AU-ROC and the lead over the best blind reference; the file has them by scenario, by
    condition of the sensors, by state at the anchor and by time to failure.
    """
    with needing_torch():
        import torch  # noqa: PLC0415

        from model_zoo.augmentation import chosen_conditions  # noqa: PLC0415
        from model_zoo.checkpoints import load_checkpoint  # noqa: PLC0415
        from model_zoo.evaluation.evaluate import evaluate  # noqa: PLC0415
        from model_zoo.evaluation.evaluation import (  # noqa: PLC0415
            check_writable,
            evaluation_name,
        )
        from model_zoo.evaluation.summary import render_summary  # noqa: PLC0415
    conditions = chosen_conditions(["clean"] if clean else condition)
    file = out or checkpoint.parent / evaluation_name(split, conditions, every)
    check_writable(file)
    if threads is not None:
        torch.set_num_threads(threads)
    with ConsoleProgress(Console(stderr=True)) as progress:
        loaded = load_checkpoint(checkpoint)
        evaluation = evaluate(
            loaded,
            data,
            split,
            conditions,
            device=device,
            every=every,
            progress=progress,
            references=references,
        )
    evaluation.write(file)
    typer.echo(f"{render_summary(evaluation)}\n\n{file}")


@app.command("compare")
def compare_command(
    evaluations: Annotated[list[Path], typer.Argument(help="Files of `graspe zoo evaluate`.")],
    out: Annotated[Path, typer.Option(help="Folder of table, CSV and plots.")] = Path("comparison"),
) -> None:
    """Put evaluations side by side, blind references first, as a table, a CSV and plots.

    Differences are to the first evaluation, and to the best blind reference.
    """
    with needing_torch():
        from model_zoo.evaluation.compare import compare  # noqa: PLC0415
        from model_zoo.evaluation.evaluation import read_evaluation  # noqa: PLC0415
    typer.echo(compare([read_evaluation(path) for path in evaluations], out))


@app.command("examine")
def examine_command(
    evaluations: Annotated[list[Path], typer.Argument(help="Files of `graspe zoo evaluate`.")],
    examination: Annotated[
        str, typer.Option(help="What is asked, and what counts: a path or a shipped name.")
    ] = "study",
    out: Annotated[Path, typer.Option(help="Folder of examination.md.")] = Path("examination"),
) -> None:
    """Hold evaluations against questions and margins that were written down before."""
    with needing_torch():
        from model_zoo.evaluation.evaluation import read_evaluation  # noqa: PLC0415
        from model_zoo.evaluation.examination import load_examination  # noqa: PLC0415
        from model_zoo.evaluation.examination_markdown import write_examination  # noqa: PLC0415
    asked = load_examination(examination)
    file, answers = write_examination([read_evaluation(path) for path in evaluations], asked, out)
    counted = Counter(answer.verdict for answer in answers)
    verdicts = ", ".join(f"{count} {verdict}" for verdict, count in sorted(counted.items()))
    typer.echo(f"{file}: {verdicts}")


@app.command("run")
def run_command(
    data: Data,
    out: Annotated[Path, typer.Option(help="Folder of all runs and of the comparison.")],
    models: Annotated[
        list[str] | None, typer.Option("--model", help="Repeat for several; default: all.")
    ] = None,
    preset: Preset = "small",
    recipe: RecipeName = "small",
    seeds: Annotated[int, typer.Option(min=1, help="Trainings of each model.")] = 1,
    split: Split = "test",
    clean: Clean = False,
    condition: Conditions = None,
    every: Every = 1,
    device: Device = "auto",
    workers: Readers = 1,
    threads: Threads = None,
) -> None:
    """Train, evaluate and compare all models under one budget; what is finished stays."""
    with needing_torch():
        from model_zoo.augmentation import chosen_conditions  # noqa: PLC0415
        from model_zoo.registry import list_models  # noqa: PLC0415
        from model_zoo.training.recipe import load_recipe  # noqa: PLC0415
        from pipelines.zoo import Zoo, plan_runs, run_zoo  # noqa: PLC0415
    zoo = Zoo(
        data,
        load_recipe(recipe),
        out,
        split,
        chosen_conditions(["clean"] if clean else condition),
        every,
        _machine(device, workers, threads),
    )
    runs = plan_runs(models or list(list_models()), preset, seeds)
    typer.echo(run_zoo(zoo, runs, ConsoleZooProgress()))


class ConsoleZooProgress:
    """Tells of trainings and evaluations on standard error."""

    def training(self) -> AbstractContextManager[ConsoleTrainingProgress]:
        """A bar of steps."""
        return _training()

    def evaluation(self) -> AbstractContextManager[ConsoleProgress]:
        """A bar of batches."""
        return ConsoleProgress(Console(stderr=True))


def _training() -> ConsoleTrainingProgress:
    from pipelines.training_progress import ConsoleTrainingProgress  # noqa: PLC0415

    return ConsoleTrainingProgress(Console(stderr=True))


def _machine(device: Literal["auto", "cpu", "cuda"], workers: int, threads: int | None) -> Machine:
    from model_zoo.training.machine import Machine  # noqa: PLC0415

    return Machine(device=device, workers=workers, threads=threads)


def _scores(index: ZooIndex, name: str, presets: Iterable[str]) -> dict[str, float | None]:
    """AU-ROC of each preset in the index, None where it has none."""
    return {preset: index.mean_au_roc(name, preset) for preset in presets}


@contextmanager
def needing_torch() -> Iterator[None]:
    """Around imports: where the zoo's packages are missing, say what to install.

    Raises:
        StageError: One of them is not installed.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        raise StageError(
            f"The zoo needs {error.name}, which is not installed: pip install 'graspe[zoo]'."
        ) from error
