"""Candidates are drawn, joined and ranked."""

from __future__ import annotations

import math
from itertools import permutations
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch import Tensor, nn

from graspe_data.columns import Column
from graspe_data.errors import ZooError
from model_zoo.contract import (
    CANDIDATE_COLUMNS,
    Features,
    Observation,
    SuccessModel,
    masked_cross_entropy,
)
from model_zoo.models.paad import Paad
from model_zoo.registry import create_model
from model_zoo.training.candidates import (
    candidate_columns,
    check_candidates,
    draw_candidates,
    join_candidates,
    ranking_loss,
)
from model_zoo.training.preparation import Preparation
from tests.model_zoo.training.tiny import (
    HORIZON,
    RECIPE,
    ROWS,
    Arrays,
    columns,
    make_rows,
    train_tiny,
    write_dataset,
)

KNOWN, SIZE = 6, (4, 8)
ASKING = RECIPE.model_copy(update={"candidates": 2})


class Drawing(SuccessModel):
    """Reads a number of the scene and one of the trajectory; it notes how many it was taught."""

    columns: ClassVar[tuple[str, ...]] = ("r_img", "trajectory_image")
    candidate_columns: ClassVar[tuple[str, ...]] = ("trajectory_image",)

    def __init__(self) -> None:
        super().__init__()
        self.horizon, self.taught = HORIZON, set[int]()
        self.net = nn.Linear(2, HORIZON)

    def encode(self, scene: Observation) -> Features:
        return {"r": scene["r_img"]}

    def score(self, features: Features, candidates: Observation) -> Tensor:
        if self.training:
            self.taught.add(len(candidates["trajectory_image"]))
        covered = candidates["trajectory_image"].float().mean(dim=(1, 2))
        return torch.as_tensor(self.net(torch.stack([features["r"], covered], dim=1)))


def make_batch(rows: int = 3) -> dict[str, Tensor]:
    draw = np.random.default_rng(1)
    images = draw.integers(0, 2, (rows, KNOWN + 1, *SIZE)).astype(np.uint8)
    success = draw.integers(0, 2, (rows, KNOWN + 1, HORIZON)).astype(np.uint8)
    arrays = {
        "trajectory_image": images[:, 0],
        "candidate_image": images[:, 1:],
        "success": success[:, 0],
        "candidate_success": success[:, 1:],
        "success_mask": np.ones((rows, HORIZON), np.bool_),
        "candidate_mask": np.ones((rows, KNOWN), np.bool_),
    }
    return {name: torch.from_numpy(np.ascontiguousarray(array)) for name, array in arrays.items()}


def test_candidates_are_drawn_without_repetition_anew_for_each_step() -> None:
    batch = make_batch()
    batch["candidate_success"][:] = torch.arange(KNOWN)[None, :, None]

    def drawn(seed: int, step: int) -> list[list[int]]:
        found: list[list[int]] = draw_candidates(batch, 4, seed, step)["candidate_success"][
            ..., 0
        ].tolist()
        return found

    assert all(len(set(row)) == 4 for row in drawn(0, 0))
    assert drawn(0, 0) == drawn(0, 0)
    assert drawn(0, 0) != drawn(0, 1)
    assert drawn(0, 0) != drawn(1, 0)
    assert {place for step in range(20) for row in drawn(0, step) for place in row} == set(range(6))


def test_images_and_outcomes_of_a_candidate_stay_together() -> None:
    batch = make_batch()
    kept = draw_candidates(batch, 4, 0, 5)
    for row in range(3):
        for image, success in zip(
            kept["candidate_image"][row], kept["candidate_success"][row], strict=True
        ):
            same = [torch.equal(image, other) for other in batch["candidate_image"][row]]
            assert torch.equal(success, batch["candidate_success"][row, same.index(True)])


def test_more_than_the_rows_have_is_an_error() -> None:
    with pytest.raises(ZooError, match="candidates is 7, the dataset's rows have 6"):
        draw_candidates(make_batch(), 7, 0, 0)


def test_the_driven_trajectory_comes_first_and_counts_as_much_as_the_others_together() -> None:
    batch = make_batch()
    batch["candidate_mask"][1, 2] = False
    images, success, mask, share = join_candidates(batch)
    number = KNOWN + 1
    assert torch.equal(images[::number], batch["trajectory_image"])
    assert torch.equal(images[number + 3], batch["candidate_image"][1, 2])
    assert torch.equal(success[number + 3], batch["candidate_success"][1, 2].float())
    assert (~mask).any(dim=1).nonzero().flatten().tolist() == [number + 3]
    by_row = share.view(3, number)
    torch.testing.assert_close(by_row[:, 0], by_row[:, 1:].sum(dim=1))
    assert share.mean() == pytest.approx(1)


def test_a_mirrored_row_mirrors_its_candidates() -> None:
    batch = make_batch() | {"mirrored": torch.tensor([False, True, False])}
    prepared = Preparation(None, 0, KNOWN)(batch, 0)
    same = draw_candidates(make_batch(), KNOWN, 0, 0)["candidate_image"]
    assert torch.equal(prepared["candidate_image"][0], same[0])
    assert torch.equal(prepared["candidate_image"][1], same[1].flip(-1))


@pytest.mark.parametrize("name", ["graspe", "graspe_no_agnn", "paad", "nmfnet_trajectory"])
def test_many_trajectories_in_a_scene_are_scored_as_rows_of_their_own(name: str) -> None:
    torch.manual_seed(0)
    model = create_model(name, "small").eval()
    draw = np.random.default_rng(0)
    scenes = {
        "image": draw.integers(0, 255, (2, 240, 320, 3), np.uint8),
        "points": draw.normal(size=(2, 4096, 3)).astype(np.float32),
        "point_count": np.array([4096, 3000], np.int32),
        "laser_scan": draw.uniform(1, 9, (2, 720)).astype(np.float32),
        "velocity_history": draw.normal(size=(2, 50, 2)).astype(np.float32),
        "r_img": np.array([0.2, 0.9], np.float32),
        "r_point": np.array([0.8, 0.3], np.float32),
    }
    held = {key: torch.from_numpy(scenes[key]) for key in model.columns if key in scenes}
    images = torch.from_numpy((draw.random((6, 240, 320)) < 0.1).astype(np.uint8))
    with torch.inference_mode():
        together = model.logits(held | {"trajectory_image": images})
        for row in range(6):
            scene = {key: value[row // 3 : row // 3 + 1] for key, value in held.items()}
            alone = model.logits(scene | {"trajectory_image": images[row : row + 1]})
            torch.testing.assert_close(together[row : row + 1], alone, atol=2e-5, rtol=1e-4)
    assert together.std(dim=0).max() > 0


def with_candidates(folder: Path) -> Path:
    """The tiny dataset with drawings that fail where they cover much."""
    draw = np.random.default_rng(5)
    shapes: dict[str, tuple[str, tuple[int, ...]]] = {
        "trajectory_image": ("uint8", SIZE),
        "candidate_image": ("uint8", (KNOWN, *SIZE)),
        "candidate_success": ("uint8", (KNOWN, HORIZON)),
        "candidate_mask": ("bool", (KNOWN,)),
    }
    more = tuple(
        Column(name=name, dtype=dtype, shape=shape, unit="", frame="", meaning="", stage="test")
        for name, (dtype, shape) in shapes.items()
    )
    splits: dict[str, Arrays] = {}
    for place, (split, rows) in enumerate(ROWS.items()):
        covered = draw.random((rows, KNOWN))
        images = draw.random((rows, KNOWN, *SIZE)) < covered[..., None, None]
        outcome = np.repeat((covered < 0.5)[..., None], HORIZON, axis=2)
        splits[split] = make_rows(rows, place, place) | {
            "trajectory_image": images[:, 0].astype(np.uint8),
            "candidate_image": images.astype(np.uint8),
            "candidate_success": outcome.astype(np.uint8),
            "candidate_mask": np.ones((rows, KNOWN), np.bool_),
        }
    return write_dataset(folder, splits, (*columns(), *more))


def test_a_training_teaches_each_row_with_its_candidates(tmp_path: Path) -> None:
    data = with_candidates(tmp_path / "dataset")
    torch.manual_seed(0)
    recipe = ASKING.model_copy(update={"epochs": 40, "learning_rate": 0.1})
    model = Drawing()
    train_tiny(data, tmp_path / "run", recipe, model)
    assert model.taught == {4 * 3}
    assert model.net.weight[:, 1].mean() < -0.3


def test_a_recipe_may_teach_which_of_two_trajectories_gets_through(tmp_path: Path) -> None:
    data = with_candidates(tmp_path / "dataset")
    weights = []
    for ranking in (0.0, 5.0):
        torch.manual_seed(0)
        updated = {"epochs": 10, "learning_rate": 0.02, "ranking": ranking}
        model = Drawing()
        folder = tmp_path / f"run-{ranking:g}"
        train_tiny(data, folder, ASKING.model_copy(update=updated), model)
        weights.append(float(model.net.weight.detach()[:, 1].mean()))
    assert weights[1] < weights[0] - 0.05


def test_the_ranking_counts_as_a_cross_entropy_of_the_same_size_does() -> None:
    torch.manual_seed(0)
    paad = create_model("paad", "small", alpha=2.0)
    rows = {
        "image": torch.zeros(2, 240, 320, 3, dtype=torch.uint8),
        "laser_scan": torch.ones(2, 720),
        "trajectory_image": torch.zeros(2, 240, 320, dtype=torch.uint8),
    }
    success, mask = torch.ones(2, paad.horizon), torch.ones(2, paad.horizon, dtype=torch.bool)
    loss = paad.loss(rows, success, mask, torch.ones(2))
    assert loss.entropy_scale == 2.0 * paad.horizon
    mean = masked_cross_entropy(loss.logits, success, mask, torch.ones(2))
    assert isinstance(paad, Paad)
    part = paad.alpha * loss.parts["cross_entropy"]
    torch.testing.assert_close(part, loss.entropy_scale * mean)


def test_a_model_without_a_trajectory_takes_none_and_no_columns_are_read() -> None:
    nmfnet = create_model("nmfnet", "small")
    assert candidate_columns(nmfnet, 3, (), "data") == ()
    assert candidate_columns(Drawing(), 0, (), "data") == ()
    assert candidate_columns(Drawing(), 3, CANDIDATE_COLUMNS, "data") == CANDIDATE_COLUMNS


def test_candidates_that_do_not_fit_are_refused_before_training(tmp_path: Path) -> None:
    data = with_candidates(tmp_path / "dataset")
    with pytest.raises(
        ZooError, match=f"candidates is {KNOWN + 1}, the dataset's rows have {KNOWN}"
    ):
        check_candidates(data, "train", KNOWN + 1, HORIZON)
    with pytest.raises(ZooError, match=r"candidate_success has rows of .*, expected"):
        check_candidates(data, "train", KNOWN, HORIZON + 1)


def test_a_dataset_that_does_not_know_is_refused_before_training(tmp_path: Path) -> None:
    images = {
        split: make_rows(rows, 0, 0) | {"trajectory_image": np.zeros((rows, *SIZE), np.uint8)}
        for split, rows in ROWS.items()
    }
    drawn = Column(
        name="trajectory_image",
        dtype="uint8",
        shape=SIZE,
        unit="",
        frame="",
        meaning="",
        stage="test",
    )
    data = write_dataset(tmp_path / "dataset", images, (*columns(), drawn))
    with pytest.raises(ZooError, match=r"no column candidate_image.*`candidates: 0`"):
        train_tiny(data, tmp_path / "run", ASKING, Drawing())


def drawn(seed: int, scenes: int, number: int, steps: int) -> tuple[Tensor, Tensor, Tensor]:
    draw = torch.Generator().manual_seed(seed)
    shape = (scenes * number, steps)
    success = torch.randint(0, 2, shape, generator=draw).float()
    mask = torch.rand(shape, generator=draw) < 0.7
    return torch.randn(shape, generator=draw) * 3, success, mask


def by_pairs(logits: Tensor, success: Tensor, mask: Tensor, scenes: int) -> float:
    number, found = len(logits) // scenes, []
    for scene in range(scenes):
        rows = range(scene * number, (scene + 1) * number)
        for good, bad in permutations(rows, 2):
            for step in range(logits.shape[1]):
                judged = mask[good, step] and mask[bad, step]
                if judged and success[good, step] == 1 and success[bad, step] == 0:
                    apart = float(logits[good, step] - logits[bad, step])
                    found.append(math.log1p(math.exp(-apart)))
    return sum(found) / len(found) if found else 0.0


@given(st.integers(0, 10**6), st.integers(1, 4), st.integers(1, 5), st.integers(1, 4))
def test_it_is_the_mean_over_pairs_of_which_one_fails(
    seed: int, scenes: int, number: int, steps: int
) -> None:
    logits, success, mask = drawn(seed, scenes, number, steps)
    found = float(ranking_loss(logits, success, mask, scenes))
    assert found == pytest.approx(by_pairs(logits, success, mask, scenes), rel=1e-5, abs=1e-6)


def test_how_hard_a_scene_is_does_not_matter() -> None:
    logits, success, mask = drawn(1, 3, 4, 5)
    harder = logits + torch.tensor([0.0, 7.0, -4.0]).repeat_interleave(4)[:, None]
    torch.testing.assert_close(
        ranking_loss(harder, success, mask, 3), ranking_loss(logits, success, mask, 3)
    )


def test_without_a_pair_it_is_zero_and_has_a_gradient() -> None:
    logits = torch.zeros(6, 2, requires_grad=True)
    loss = ranking_loss(logits, torch.ones(6, 2), torch.ones(6, 2, dtype=torch.bool), 2)
    loss.backward()  # type: ignore[no-untyped-call]
    assert loss.item() == 0
    assert logits.grad is not None
    assert not logits.grad.any()
