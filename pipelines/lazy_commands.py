"""A group of commands each of which is imported when it is asked for."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any, NamedTuple

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command


class LazyCommand(NamedTuple):
    """Where a command is: the module, and in it a function, or ``app`` for a group of commands."""

    module: str
    name: str
    help: str
    """The first sentence of its help; a test holds it against the command's own."""


class LazyGroup(TyperGroup):
    """Lists its commands without importing them; ``lazy`` is set by a subclass."""

    lazy: Mapping[str, LazyCommand] = {}

    def __init__(self, **given: Any) -> None:
        """Know each command by its name and sentence."""
        super().__init__(**given)
        self.commands = {
            name: TyperCommand(name, help=entry.help) for name, entry in self.lazy.items()
        }

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command itself where it is to run, else what is known of it."""
        if ctx.meta.get(_RUNS) and cmd_name in self.lazy:
            return loaded(cmd_name, self.lazy[cmd_name])
        return super().get_command(ctx, cmd_name)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Find the command that is to run."""
        ctx.meta[_RUNS] = True
        try:
            return super().resolve_command(ctx, args)
        finally:
            ctx.meta[_RUNS] = False


_RUNS = "graspe.runs"


def loaded(name: str, entry: LazyCommand) -> Any:
    """Import a command and make it ready to run."""
    found = getattr(import_module(entry.module), entry.name)
    app = found if isinstance(found, typer.Typer) else typer.Typer()
    if app is not found:
        app.command(name)(found)
    app._add_completion = False  # noqa: SLF001 - the root has it
    command = get_command(app)
    command.name = name
    return command
