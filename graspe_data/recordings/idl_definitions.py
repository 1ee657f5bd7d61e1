"""Message definitions in IDL, as rosidl and DDS write them, parsed in one pass over the tokens.

The grammar is OMG IDL 4.2's as far as messages use it: modules, structs, constants, typedefs,
enums, annotations. Nesting is limited, numbers have 64 bits: the work is in proportion to the text.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from operator import add, and_, lshift, mul, or_, rshift, sub, xor
from typing import TypeVar

from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import FieldDesc, Typesdict

from graspe_data.recordings.idl_tokens import IdlTokens

T = TypeVar("T")

MAXIMUM_DEPTH = 16
MAXIMUM_VALUE = (1 << 64) - 1
MAXIMUM_SHIFT = 63
ADDITION = 4
"""Where expressions begin within angle brackets, which end them: without shifts."""

BASE_TYPES = {
    "boolean": "bool",
    "octet": "byte",
    "char": "char",
    "wchar": "wchar",
    "float": "float32",
    "double": "float64",
    "long double": "float128",
    "short": "int16",
    "long": "int32",
    "long long": "int64",
    "unsigned short": "uint16",
    "unsigned long": "uint32",
    "unsigned long long": "uint64",
    **{f"{sign}int{bits}": f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)},
}
LONGER = ("unsigned", "long", "short", "double")
LONGEST = len("unsigned long long")
OPERATORS: tuple[dict[str, Callable[[int, int], int]], ...] = (
    {"|": or_},
    {"^": xor},
    {"&": and_},
    {"<<": lshift, ">>": rshift},
    {"+": add, "-": sub},
    {"*": mul, "/": lambda one, two: one // two, "%": lambda one, two: one % two},
)


def parse_idl(text: str) -> Typesdict:
    """Parse the structs of a definition, in the form in which `rosbags` keeps types.

    Raises:
        ValueError: The text is no IDL, nests too deeply, or holds what no message has.
    """
    return _Parser(text).specification()


class _Parser:
    def __init__(self, text: str) -> None:
        self._text = IdlTokens(text)
        self._types: Typesdict = {}
        self._aliases: dict[str, FieldDesc] = {}
        self._constants: dict[str, int] = {}

    def specification(self) -> Typesdict:
        self._definitions((), "")
        if not self._types:
            raise ValueError("no struct is defined")
        return self._types

    def _definitions(self, scope: tuple[str, ...], end: str) -> None:
        if len(scope) > MAXIMUM_DEPTH:
            raise ValueError("modules are nested too deeply")
        while self._text.upcoming != end:
            self._text.annotations()
            kind = self._text.next()
            if kind == "module":
                inner = (*scope, self._text.name())
                self._text.expect("{")
                self._definitions(inner, "}")
                self._text.expect("}")
            elif kind == "struct":
                self._struct(scope)
            elif kind == "const":
                self._constant(scope)
            elif kind == "typedef":
                self._declare(self._type(scope), scope, self._aliases, scope)
            elif kind == "enum":
                self._enum(scope)
            else:
                raise ValueError(f"{kind[:40]!r} is not read here")
            self._text.expect(";")

    def _struct(self, scope: tuple[str, ...]) -> None:
        name = "/".join((*scope, self._text.name()))
        if self._text.upcoming == ";":
            return
        self._text.expect("{")
        fields: dict[str, FieldDesc] = {}
        while self._text.upcoming != "}":
            self._text.annotations()
            self._declare(self._type(scope), scope, fields, ())
            self._text.expect(";")
        self._text.expect("}")
        self._types[name] = ([], list(fields.items()))

    def _declare(
        self,
        kind: FieldDesc,
        scope: tuple[str, ...],
        into: dict[str, FieldDesc],
        prefix: tuple[str, ...],
    ) -> None:
        """One or more declarators, each with an array bound perhaps."""
        while True:
            self._text.annotations()
            name, described = "/".join((*prefix, self._text.name())), kind
            if self._text.accept("["):
                described = self._many(Nodetype.ARRAY, kind, self._value(scope))
                self._text.expect("]")
            if name in into:
                raise ValueError(f"{name[:40]!r} is declared twice")
            into[name] = described
            if not self._text.accept(","):
                return

    def _many(self, kind: Nodetype, inner: FieldDesc, count: int) -> FieldDesc:
        if inner[0] in (Nodetype.ARRAY, Nodetype.SEQUENCE) or count < 0:
            raise ValueError("arrays of arrays are not read")
        return (kind, (inner, count))  # type: ignore[return-value, unused-ignore]

    def _type(self, scope: tuple[str, ...]) -> FieldDesc:
        word = self._text.next()
        if word == "sequence":
            self._text.expect("<")
            inner = self._type(scope)
            count = self._value(scope, ADDITION) if self._text.accept(",") else 0
            self._text.expect(">")
            return self._many(Nodetype.SEQUENCE, inner, count)
        if word in ("string", "wstring"):
            bound = 0
            if self._text.accept("<"):
                bound = self._value(scope, ADDITION)
                self._text.expect(">")
            return (Nodetype.BASE, (word, bound))  # type: ignore[return-value, unused-ignore]
        if word in LONGER:
            while self._text.upcoming in LONGER and len(word) < LONGEST:
                word = f"{word} {self._text.next()}"
        if word in BASE_TYPES:
            return (Nodetype.BASE, (BASE_TYPES[word], 0))  # type: ignore[return-value, unused-ignore]
        return self._named(word, scope)

    def _named(self, word: str, scope: tuple[str, ...]) -> FieldDesc:
        if not re.match(r"[A-Za-z_:]", word):
            raise ValueError(f"{word[:40]!r} is no type")
        alias = self._look_up(word, scope, self._aliases)
        if alias is not None:
            return alias
        known = next((name for name in _candidates(word, scope) if name in self._types), None)
        name = word.removeprefix("::").replace("::", "/")
        if known is None:
            known = name if "/" in name else "/".join((*scope, name))
        return (Nodetype.NAME, known)

    def _enum(self, scope: tuple[str, ...]) -> None:
        """Values count from 0; on the wire an enum is a uint32."""
        self._aliases["/".join((*scope, self._text.name()))] = (Nodetype.BASE, ("uint32", 0))
        self._text.expect("{")
        value = 0
        while self._text.upcoming != "}":
            self._text.annotations()
            name = "/".join((*scope, self._text.name()))
            value = self._value(scope) if self._text.accept("=") else value
            self._constants[name] = value
            value += 1
            if not self._text.accept(","):
                break
        self._text.expect("}")

    def _constant(self, scope: tuple[str, ...]) -> None:
        kind = self._type(scope)
        name = "/".join((*scope, self._text.name()))
        self._text.expect("=")
        if kind[0] == Nodetype.BASE and "int" in str(kind[1][0]):
            self._constants[name] = self._value(scope)
        else:
            while self._text.upcoming not in (";", ""):
                self._text.next()

    def _value(self, scope: tuple[str, ...], level: int = 0, depth: int = 0) -> int:
        """A constant expression of whole numbers, by precedence."""
        if level == len(OPERATORS):
            return self._operand(scope, depth)
        value = self._value(scope, level + 1, depth)
        while self._text.upcoming in OPERATORS[level]:
            sign = self._text.next()
            other = self._value(scope, level + 1, depth)
            if sign in ("<<", ">>") and not 0 <= other <= MAXIMUM_SHIFT:
                raise ValueError(f"a shift by {other}")
            if sign in ("/", "%") and other == 0:
                raise ValueError("a division by zero")
            value = OPERATORS[level][sign](value, other)
            if abs(value) > MAXIMUM_VALUE:
                raise ValueError("a constant of more than 64 bits")
        return value

    def _operand(self, scope: tuple[str, ...], depth: int) -> int:
        if depth > MAXIMUM_DEPTH:
            raise ValueError("a constant is nested too deeply")
        word = self._text.next()
        if word == "(":
            value = self._value(scope, 0, depth + 1)
            self._text.expect(")")
            return value
        if word in ("-", "+", "~"):
            value = self._operand(scope, depth + 1)
            return {"-": -value, "+": value, "~": ~value}[word]
        if word[:1].isdigit():
            return int(word[:20], 8 if re.fullmatch(r"0[0-7]+", word) else 0)
        known = self._look_up(word, scope, self._constants)
        if known is None:
            raise ValueError(f"{word[:40]!r} is no whole number")
        return known

    def _look_up(self, word: str, scope: tuple[str, ...], among: Mapping[str, T]) -> T | None:
        return next((among[name] for name in _candidates(word, scope) if name in among), None)


def _candidates(word: str, scope: tuple[str, ...]) -> list[str]:
    """The full names that a name may mean, the innermost scope first."""
    name = word.removeprefix("::").replace("::", "/")
    if word.startswith("::"):
        return [name]
    return ["/".join((*scope[:depth], name)) for depth in range(len(scope), -1, -1)]
