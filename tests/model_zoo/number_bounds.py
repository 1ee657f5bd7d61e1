"""Every number of a group of settings, with its bounds, as its JSON schema has them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel

Place = tuple[str | int, ...]


@dataclass(frozen=True)
class Number:
    """A number among settings.

    Attributes:
        place: Keys from the top; whole numbers are places in tuples.
        whole: Whether it is an integer.
        least: Its lower bound, None without one.
        most: Its upper bound.
        open_below: Whether the lower bound itself is refused.
        open_above: Whether the upper one is.
    """

    place: Place
    whole: bool
    least: float | None
    most: float | None
    open_below: bool
    open_above: bool

    def __str__(self) -> str:
        return ".".join(map(str, self.place))

    def lowest(self) -> float:
        assert self.least is not None
        if not self.open_below:
            return self.least
        return self.least + 1 if self.whole else math.nextafter(self.least, math.inf)

    def highest(self) -> float:
        assert self.most is not None
        if not self.open_above:
            return self.most
        return self.most - 1 if self.whole else math.nextafter(self.most, -math.inf)


def numbers(model: type[BaseModel]) -> list[Number]:
    schema = model.model_json_schema()
    return list(_within(schema, schema.get("$defs", {}), ()))


def _within(schema: Mapping[str, Any], known: Mapping[str, Any], place: Place) -> Iterator[Number]:
    if "$ref" in schema:
        schema = known[schema["$ref"].rsplit("/", 1)[1]]
    for option in (*schema.get("anyOf", ()), *schema.get("allOf", ())):
        yield from _within(option, known, place)
    for name, inner in schema.get("properties", {}).items():
        yield from _within(inner, known, (*place, name))
    for number, inner in enumerate(schema.get("prefixItems", ())):
        yield from _within(inner, known, (*place, number))
    if schema.get("type") in ("integer", "number"):
        least, most = (schema.get(name) for name in ("minimum", "maximum"))
        above, below = (schema.get(f"exclusive{name}") for name in ("Minimum", "Maximum"))
        yield Number(
            place,
            schema["type"] == "integer",
            above if least is None else least,
            below if most is None else most,
            least is None,
            most is None,
        )


def with_number(content: Mapping[str, Any], place: Place, value: object) -> dict[str, Any]:
    """The settings with one number changed; what is switched off by None is switched on for it."""
    copied: Any = _plain(content)
    inner = copied
    for key in place[:-1]:
        if inner[key] is None:
            inner[key] = {}
        inner = inner[key]
    inner[place[-1]] = value
    found: dict[str, Any] = copied
    return found


def _plain(content: Any) -> Any:
    if isinstance(content, Mapping):
        return {key: _plain(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [_plain(value) for value in content]
    return content
