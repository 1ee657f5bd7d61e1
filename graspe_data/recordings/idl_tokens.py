"""The tokens of an IDL text, and a place among them."""

from __future__ import annotations

import re

TOKEN = re.compile(
    r"""(?P<skip>\s+|//[^\n]*|\#[^\n]*)
    |(?P<name>(?:::)?[A-Za-z_]\w*(?:::[A-Za-z_]\w*)*)
    |(?P<number>0[xX][0-9a-fA-F]+|(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?[dDfF]?)
    |(?P<string>L?"(?:[^"\\]|\\.)*"|L?'(?:[^'\\]|\\.)*')
    |(?P<sign><<|>>|[{}()\[\]<>;,:=@+\-*/%|&^~])""",
    re.VERBOSE | re.ASCII | re.DOTALL,
)


class IdlTokens:
    """Tokens to be taken one by one.

    Raises:
        ValueError: The text holds what is no token of IDL.
    """

    def __init__(self, text: str) -> None:
        """Split the text; comments and what the preprocessor reads are left out."""
        self._tokens = _split(text)
        self._at = 0

    @property
    def upcoming(self) -> str:
        """The next token, which stays; empty at the end of the text."""
        return self._tokens[self._at]

    def annotations(self) -> None:
        """Skip them: they say nothing of the layout of plain CDR."""
        while self.accept("@"):
            self.next()
            if self.accept("("):
                depth = 1
                while depth:
                    depth += {"(": 1, ")": -1}.get(self.next(), 0)

    def name(self) -> str:
        """Take an identifier without scope."""
        word = self.next()
        if not re.fullmatch(r"[A-Za-z_]\w*", word, re.ASCII):
            raise ValueError(f"{word[:40]!r} is no name")
        return word

    def next(self) -> str:
        """Take the next token; ValueError at the end."""
        word = self.upcoming
        if not word:
            raise ValueError("the text ends within a definition")
        self._at += 1
        return word

    def accept(self, word: str) -> bool:
        """Take the next token if it is this one; two closing brackets count as one and one."""
        if word == ">" and self.upcoming == ">>":
            self._tokens[self._at] = ">"
            return True
        found = self.upcoming == word
        self._at += found
        return found

    def expect(self, word: str) -> None:
        """Take this token; ValueError where another comes."""
        if not self.accept(word):
            raise ValueError(f"{word!r} is expected before {self.upcoming[:40]!r}")


def _split(text: str) -> list[str]:
    tokens, offset = [], 0
    while offset < len(text):
        if text.startswith("/*", offset):
            end = text.find("*/", offset + 2)
            if end < 0:
                raise ValueError("a comment does not end")
            offset = end + 2
            continue
        match = TOKEN.match(text, offset)
        if match is None:
            raise ValueError(f"no IDL at {text[offset : offset + 20]!r}")
        if match.lastgroup != "skip":
            tokens.append(match.group())
        offset = match.end()
    return [*tokens, ""]
