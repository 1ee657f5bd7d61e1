from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

HISTORY = [
    {"epoch": 0, "au_roc": 0.61234, "means": {"loss": 0.7}},
    {"epoch": 1, "au_roc": None, "means": {"loss": 0.5}},
]
RECIPE = {"patience": None, "augmentation": {"blur": {"length": [3.0, 25.0]}}}


def test_the_card_is_for_people(write_tiny: Callable[..., Path]) -> None:
    folder = write_tiny(metrics={"au_roc": None, "history": HISTORY}, recipe=RECIPE)
    card = (folder / "card.md").read_text()
    for phrase in (
        "| epoch | au_roc | means.loss |",
        "| 0 | 0.6123 | 0.7 |",
        "| 1 | none | 0.5 |",
        "- patience: none",
        "- augmentation.blur.length: 3, 25",
        "probability = checkpoint.predict(rows.batch(range(8)))",
    ):
        assert phrase in card
    assert "None" not in card.replace("None: probabilities", "")
    assert "{" not in card
