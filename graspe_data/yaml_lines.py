"""A YAML document with the line of every value, so that faults can be told by their place."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from graspe_data.manifest import NOT_YAML, StrictLoader, read_text

Key = tuple[str | int, ...]


@dataclass(frozen=True, order=True)
class LinedFault:
    """Something wrong in a text file: the line, from 1, 0 for the whole file; and what it is."""

    line: int
    text: str


@dataclass(frozen=True)
class LinedYaml:
    """A document, its lines, and what no document may have.

    Attributes:
        content: What the document says; of a key that is given twice the last value. None where
            it is no YAML.
        lines: The line of each value, from 1, by its keys and places from the outermost on.
        faults: That it is no YAML, or each key that is given twice.
    """

    content: Any
    lines: Mapping[Key, int] = field(default_factory=dict)
    faults: tuple[LinedFault, ...] = ()

    def line(self, key: Sequence[str | int]) -> int:
        """The line of a value, or of what it is missing in; 0 where there is none."""
        known = (tuple(key[:length]) for length in range(len(key), -1, -1))
        return next((self.lines[part] for part in known if part in self.lines), 0)


def read_lined_yaml(path: Path) -> LinedYaml:
    """Read one YAML document as ``read_yaml`` does, and where in the file everything stands.

    Raises:
        ManifestError: The file is missing, too large, or not UTF-8.
    """
    text = read_text(path)
    try:
        node = StrictLoader(text).get_single_node()
        if node is None:
            return LinedYaml(None)
        content = yaml.SafeLoader("").construct_document(node)
        lines: dict[Key, int] = {}
        twice = tuple(_walk(node, (), lines))
    except NOT_YAML as error:
        return LinedYaml(None, faults=(_not_yaml(error),))
    return LinedYaml(content, lines, twice)


def _not_yaml(error: Exception) -> LinedFault:
    mark = getattr(error, "problem_mark", None)
    problem = getattr(error, "problem", None) or str(error) or type(error).__name__
    return LinedFault(0 if mark is None else mark.line + 1, f"not valid YAML: {problem}.")


def _walk(node: yaml.Node, key: Key, lines: dict[Key, int]) -> Iterator[LinedFault]:
    """Note the line of a node and of all in it; yield each key that is given twice."""
    lines[key] = node.start_mark.line + 1
    if isinstance(node, yaml.SequenceNode):
        for place, item in enumerate(node.value):
            yield from _walk(item, (*key, place), lines)
    if not isinstance(node, yaml.MappingNode):
        return
    seen: dict[tuple[str, str], int] = {}
    for name, value in node.value:
        line, identity = name.start_mark.line + 1, (name.tag, str(name.value))
        if identity in seen:
            where = f"the first time in line {seen[identity]}"
            yield LinedFault(line, f"the key {name.value!r} is given twice, {where}.")
        seen.setdefault(identity, line)
        yield from _walk(value, (*key, str(name.value)), lines)
        lines[(*key, str(name.value))] = line
