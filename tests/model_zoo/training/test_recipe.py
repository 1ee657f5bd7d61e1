from __future__ import annotations

from pathlib import Path

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from graspe_data.errors import ZooError
from model_zoo.labels import Labels
from model_zoo.training.optimisation import learning_rate, step_seed
from model_zoo.training.recipe import Recipe, load_recipe
from model_zoo.training.rows import RowWeights, balance_rows


@pytest.mark.parametrize("name", ["paper", "small", "smoke", "demo"])
def test_the_shipped_recipes_let_sensors_fail(name: str) -> None:
    assert load_recipe(name).augmentation is not None


@pytest.mark.parametrize("name", ["paper", "paad"])
def test_the_published_training_is_shipped_as_published(name: str) -> None:
    recipe = load_recipe(name)
    assert (recipe.learning_rate, recipe.weight_decay) == (5e-4, 1.5e-4)
    assert (recipe.batch_size, recipe.epochs) == (16, 50)


def test_an_unknown_key_or_name_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "recipe.yaml"
    file.write_text("epoch: 3\n")
    with pytest.raises(ZooError, match=r"epoch: unknown key\. Did you mean 'epochs'"):
        load_recipe(file)
    with pytest.raises(ZooError, match="Did you mean 'small'"):
        load_recipe("smal")


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("epochs: true", "epochs: expected a number or a name, found true"),
        ("weight_decay: 1.0e+300", "weight_decay: .* less than or equal to 1 "),
        ("learning_rate: 1.0e+30", "learning_rate: .* less than or equal to 10 "),
        ("batch_size: 100000000000000000000", "batch_size: .* less than or equal to"),
        ("epochs: 1\nbatch_size: 4\nepochs: 7", "line 3: the key 'epochs' is given twice"),
    ],
)
def test_what_nobody_means_is_refused(tmp_path: Path, text: str, fault: str) -> None:
    file = tmp_path / "recipe.yaml"
    file.write_text(text)
    with pytest.raises(ZooError, match=fault):
        load_recipe(file)


def test_the_rate_rises_then_falls_to_nothing() -> None:
    recipe = Recipe(learning_rate=1.0, schedule="cosine", warm_up_steps=4)
    rates = [learning_rate(recipe, step, 104) for step in range(104)]
    assert rates[:5] == pytest.approx([0.2, 0.4, 0.6, 0.8, 1.0])
    assert rates[54] == pytest.approx(0.5)
    assert rates[4:] == sorted(rates[4:], reverse=True)
    assert 0 < rates[-1] < 1e-3
    assert {learning_rate(Recipe(), step, 9) for step in range(9)} == {5e-4}


@given(seed=st.integers(0, 2**40), step=st.integers(-1, 2**40), rank=st.integers(0, 64))
def test_seeds_are_torchs_and_each_step_has_its_own(seed: int, step: int, rank: int) -> None:
    found = step_seed(seed, step, rank)
    assert 0 <= found < 2**63
    others = {step_seed(seed, step + 1, rank), step_seed(seed + 1, step, rank)}
    assert found not in others | {step_seed(seed, step, rank + 1)}


@given(st.lists(st.booleans(), min_size=1, max_size=40))
def test_both_kinds_of_rows_weigh_half_and_the_mean_is_one(fails: list[bool]) -> None:
    success = ~torch.tensor(fails)[:, None].expand(-1, 2)
    mask = torch.ones_like(success)
    weights = balance_rows(Labels(success.numpy(), mask.numpy()), "rows")
    each = weights.of(success.float(), mask)
    assert each.mean() == pytest.approx(1)
    if len(set(fails)) == 2:
        assert each[torch.tensor(fails)].sum() == pytest.approx(len(fails) / 2)


def test_a_step_that_is_not_judged_makes_no_row_fail() -> None:
    success, mask = torch.zeros(1, 2), torch.tensor([[False, False]])
    assert RowWeights(1.0, 5.0).of(success, mask).tolist() == [1.0]


def test_without_balance_all_weigh_one() -> None:
    labels = Labels(torch.eye(3).bool().numpy(), torch.ones(3, 3).bool().numpy())
    assert balance_rows(labels, "none") == balance_rows(labels, "resample") == RowWeights()


def test_ranking_needs_candidates() -> None:
    with pytest.raises(ValidationError, match="set candidates, or ranking: 0"):
        Recipe(ranking=1.0)
    assert Recipe(ranking=1.0, candidates=2).ranking == 1.0
