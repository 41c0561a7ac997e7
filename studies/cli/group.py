"""A group of commands that loads the module of the command that is called, and of no other."""

from functools import partial
from importlib import import_module
from typing import Any, NamedTuple

import typer
from typer.core import TyperCommand, TyperGroup

from studies.base.lookup import lookup
from studies.cli.completing import unloaded


class Entry(NamedTuple):
    """A command: the module and the function it is, and its line in the list of commands."""

    module: str
    function: str
    help: str


def lazy_group(entries: dict[str, Entry]) -> type[TyperGroup]:
    """A class of groups with these commands: name -> Entry."""

    class LazyGroup(TyperGroup):
        """As Click's documentation describes lazy loading: the list of commands is made of their lines alone."""

        def list_commands(self, ctx: Any) -> list[str]:
            """Names, in order."""
            return list(entries)

        def get_command(self, ctx: Any, cmd_name: str) -> Any:
            """The command as the list of commands shows it; it cannot be called."""
            entry = entries.get(cmd_name)
            return None if entry is None else TyperCommand(cmd_name, help=entry.help)

        def resolve_command(self, ctx: Any, args: list[str]) -> Any:
            """The command that the words call, with its module loaded. Raises StudyError with the nearest match."""
            name, *rest = args
            if ctx.resilient_parsing:  # a shell completes a line: a wrong name there is no error
                entry = entries.get(name)
                return name, None if entry is None else unloaded(name, partial(loaded, name, entry)), rest
            return name, loaded(name, lookup(name, entries, "command")), rest

    return LazyGroup


def loaded(name: str, entry: Entry) -> Any:
    """The command itself."""
    alone = typer.Typer(add_completion=False)
    alone.command(name)(getattr(import_module(entry.module), entry.function))
    return typer.main.get_command(alone)
