"""One HTML page about a dataset: balance, losses, distributions, sample rows, configuration."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from graspe_data.atomic_file import write_atomically
from graspe_data.documents import canonical_json
from graspe_data.shards.dataset import Dataset
from graspe_data.shards.dataset_index import DatasetIndex, read_index
from pipelines.report.balance import Balance, SplitBalance, split_balance
from pipelines.report.histograms import (
    histogram_svg,
    histograms,
    measured_quantities,
    split_colours,
)
from pipelines.report.intensity_picture import draw_intensity_map
from pipelines.report.notices import notices
from pipelines.report.row_picture import draw_row
from pipelines.report.row_scene import SCENE_COLUMNS, RowScene, row_scene
from pipelines.report.samples import choose_samples

NOTICEABLE = 0.05
SPLITS = ("train", "validation", "test")


def write_report(folder: Path, page: Path) -> None:
    """Write the report of a dataset: one HTML file that needs nothing else.

    Args:
        folder: The dataset's folder.
        page: The file to write.

    Raises:
        ShardError: No valid dataset there, a shard is damaged, or the page cannot be written.
        ManifestError: The dataset's configuration does not validate.
    """
    index = read_index(folder)
    environment = Environment(
        loader=PackageLoader("pipelines", "report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"thousands": "{:,}".format, "percent": _percent}
    text = environment.get_template("page.html.jinja").render(_content(folder, index))
    write_atomically(page, [text.encode("utf-8")])


def _content(folder: Path, index: DatasetIndex) -> dict[str, Any]:
    """What the template shows."""
    splits = sorted(index.splits, key=lambda s: (SPLITS.index(s) if s in SPLITS else 99, s))
    filled = [split for split in splits if index.rows(split)]
    balances = {split: split_balance(folder, index, split) for split in splits}
    colours, quantities = split_colours(splits), measured_quantities(index.columns)
    return {
        "index": index,
        "folder": folder.resolve().name,
        "balances": balances,
        "total": _sum([balance.whole for balance in balances.values()]),
        "recordings": _recordings(index, balances),
        "time_is_known": any("time_zero_ns" in entry.details for entry in index.recordings),
        "notices": notices(folder, index, balances),
        "colours": {split: colours[split] for split in filled},
        "charts": [histogram_svg(h, colours) for h in histograms(folder, filled, quantities)],
        "samples": _samples(folder, index, filled),
        "configuration": canonical_json(dict(index.configuration)),
    }


def _percent(part: int, whole: int) -> str:
    if not whole:
        return "-"
    share = 100 * part / whole
    return f"{share:.0f} %" if share in (0, 100) else f"{min(max(share, 0.1), 99.9):.1f} %"


def _sum(balances: Sequence[Balance]) -> Balance:
    nothing = Balance(0, 0, 0, 0, 0, 0)
    columns = zip(*(vars(balance).values() for balance in (nothing, *balances)), strict=True)
    return Balance(*(sum(column) for column in columns))


def _recordings(index: DatasetIndex, balances: Mapping[str, SplitBalance]) -> list[dict[str, Any]]:
    """Each recording with its balance and what ``dataset.json`` tells of it."""
    return [
        {
            "entry": entry,
            "balance": _sum(
                [
                    split.recordings[number]
                    for split in balances.values()
                    if number in split.recordings
                ]
            ),
            "refused": entry.details.get("refused"),
            "damage": entry.details.get("damage") or [],
            "offsets": _nonzero(entry.details.get("offsets_ns")),
            "events": _nonzero(entry.details.get("events")),
            "not_judged": entry.details.get("not_judged") or {},
            "annotated": entry.details.get("annotated"),
            "findings": entry.findings,
        }
        for number, entry in enumerate(index.recordings)
    ]


def _nonzero(counts: Any) -> dict[str, Any]:
    return {key: n for key, n in counts.items() if n} if isinstance(counts, dict) else {}


def _samples(folder: Path, index: DatasetIndex, splits: Sequence[str]) -> list[dict[str, Any]]:
    names = {column.name for column in index.columns}
    columns = [*SCENE_COLUMNS, *({"intensity_map"} & names)]
    datasets = {split: Dataset(folder, split, columns) for split in splits}
    return [
        {
            "title": group.title,
            "rows": [
                _sample(index, datasets[choice.split], choice.split, choice.row)
                for choice in group.rows
            ],
        }
        for group in choose_samples(folder, splits)
    ]


def _sample(index: DatasetIndex, dataset: Dataset, split: str, row: int) -> dict[str, str]:
    scene = row_scene(index, dataset.row(row))
    picture = draw_row(scene, f"{split} row {row}")
    return {
        "source": _embedded(picture),
        "intensity": _intensity(scene),
        "caption": _caption(scene, split, row),
    }


def _intensity(scene: RowScene) -> str:
    """The picture of the row's intensity map; empty where the dataset has none."""
    if "intensity_map" not in scene.row:
        return ""
    settings, robot = scene.recipe.dataset.intensity_map, scene.recipe.robot
    return _embedded(draw_intensity_map(scene.row["intensity_map"], settings, robot.footprint))


def _embedded(png: bytes) -> str:
    return f"data:image/png;base64,{base64.b64encode(png).decode('ascii')}"


def _caption(scene: RowScene, split: str, row: int) -> str:
    since = "" if scene.time_s is None else f", t = {scene.time_s:.1f} s"
    caption = f"{scene.recording}, {split} row {row}{since}, stamp {int(scene.row['stamp_ns'])} ns."
    if abs(scene.pixel_aspect - 1) > NOTICEABLE:
        how = "squeezed" if scene.pixel_aspect < 1 else "stretched"
        width = f"{100 * scene.pixel_aspect:.0f} % of its width"
        caption += f" As stored, the picture is {how} to {width}."
    return caption
