"""Randomness that is a pure function of the seed and the step."""

from __future__ import annotations

import hashlib


def step_seed(seed: int, step: int, rank: int = 0) -> int:
    """A seed for torch's generators, set before every step.

    What a step draws, dropout for one, so does not depend on the steps before it: a run that goes
    on from a saved state needs no generator's state, and draws what the whole run would have.

    Args:
        seed: The recipe's.
        step: Steps done before it; -1 for the weights of the model.
        rank: This process; ranks draw differently.

    Returns:
        63 bits.
    """
    text = f"graspe training step 1\0{seed}\0{step}\0{rank}"
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "little") >> 1
