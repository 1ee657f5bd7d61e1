"""Damage to files as disks, crashes and strangers do it, by a seed."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np

EDGE = 4096
HOSTILE = (0, 1, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 1 << 40, 1 << 62, (1 << 63) - 1, (1 << 64) - 1)
METADATA_SHARE = 0.15

Random = np.random.Generator
Damage = Callable[[bytearray, Random], None]


def damaged_copy(source: Path, target: Path, generator: Random) -> tuple[str, ...]:
    """Copy a recording, file or folder, damage one of its files, and say how."""
    if source.is_file():
        shutil.copyfile(source, target)
        return damage_file(target, generator)
    shutil.copytree(source, target)
    files = sorted(path for path in target.iterdir() if path.name != "metadata.yaml")
    if generator.random() < METADATA_SHARE and (target / "metadata.yaml").exists():
        files = [target / "metadata.yaml"]
    return damage_file(files[int(generator.integers(len(files)))], generator)


def damage_file(path: Path, generator: Random) -> tuple[str, ...]:
    """Damage a file in one to three ways."""
    content = bytearray(path.read_bytes())
    names = [str(name) for name in generator.choice(sorted(DAMAGES), generator.integers(1, 4))]
    for name in names:
        if content:
            DAMAGES[name](content, generator)
    path.write_bytes(content)
    return tuple(names)


def _place(content: bytearray, generator: Random) -> int:
    """Anywhere; half of the time near the start or the end, where the structure is."""
    size = len(content)
    near = int(generator.integers(min(EDGE, size)))
    return (int(generator.integers(size)), near, int(generator.integers(size)), size - 1 - near)[
        int(generator.integers(4))
    ]


def _block(content: bytearray, generator: Random) -> slice:
    start = _place(content, generator)
    return slice(start, start + int(2 ** generator.uniform(0, 14)))


def _flip_bits(content: bytearray, generator: Random) -> None:
    for _ in range(int(generator.integers(1, 9))):
        content[_place(content, generator)] ^= 1 << int(generator.integers(8))


def _cut_off(content: bytearray, generator: Random) -> None:
    del content[_place(content, generator) :]


def _cut_out(content: bytearray, generator: Random) -> None:
    del content[_block(content, generator)]


def _swap_blocks(content: bytearray, generator: Random) -> None:
    size = int(2 ** generator.uniform(2, 14))
    one, two = sorted(_place(content, generator) for _ in range(2))
    first, second = content[one : one + size], content[two : two + size]
    content[two : two + size] = first
    content[one : one + size] = second


def _hostile_length(content: bytearray, generator: Random) -> None:
    width, start = (4, 8)[int(generator.integers(2))], _place(content, generator)
    value = HOSTILE[int(generator.integers(len(HOSTILE)))] & ((1 << 8 * width) - 1)
    content[start : start + width] = value.to_bytes(width, ("little", "big")[value % 7 == 0])


def _zero_block(content: bytearray, generator: Random) -> None:
    block = _block(content, generator)
    content[block] = bytes(len(content[block]))


def _duplicate_block(content: bytearray, generator: Random) -> None:
    block = _block(content, generator)
    content[block.start : block.start] = content[block]


DAMAGES: dict[str, Damage] = {
    "bits flipped": _flip_bits,
    "cut off": _cut_off,
    "block cut out": _cut_out,
    "blocks swapped": _swap_blocks,
    "hostile length": _hostile_length,
    "block zeroed": _zero_block,
    "block doubled": _duplicate_block,
}
