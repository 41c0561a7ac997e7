"""The commands: their groups and lines for `--help`, and the loading of the one that is called."""

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from importlib import import_module
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from studies.base.errors import StudyError
from studies.base.lookup import lookup

GROUPS = {
    "Run studies": {
        "demo": "Squeeze a ball with three bodies, next to the reference.",
        "run": "Run what is missing or stale, then draw the charts.",
        "replay": "Run one stored case again and compare the results.",
        "worker": "Run tasks for `organbench run --on` until stopped.",
    },
    "Look at results": {
        "list": "List studies, scenes, organs, methods and metrics.",
        "show": "Show what is ok, failed, stale or missing, and why.",
        "table": "Print one row per case with the metrics of a study.",
        "report": "Draw charts and tables from what is stored.",
        "compare": "Compare two results folders number by number.",
        "view": "Write cases and their reference to a file for ParaView.",
    },
    "Recommend and test": {
        "advise": "Recommend the cheapest accurate body for a scene.",
        "safe-dt": "Predict the largest stable time step and verify it.",
        "profile": "Measure the stages of a time step in microseconds.",
        "fuzz": "Try to break every method with random trials.",
    },
    "Make meshes": {
        "mesh": "Mesh a synthetic organ or a surface in a file.",
        "place": "Place hold and probe on a scan and write a study.",
    },
    "Share, compare with other programs, maintain": {
        "export": "Write a scene for another program.",
        "judge": "Judge the results of another program like our own.",
        "archive": "Pack records, tables, charts and code into a zip file.",
        "doctor": "Check this installation, its caches and its results.",
    },
}
"""Group -> command -> its line. The module studies.cli.commands.NAME holds the function NAME, with _ for -."""
LINES = {name: line for lines in GROUPS.values() for name, line in lines.items()}
FORMER = {
    "calibrate": "is gone: quadratic bodies need no fit (`organbench advise` names one)",
    "check": "is now `organbench mesh --check FILE`",
    "cost": "is now `organbench profile`",
    "mesh-check": "is now `organbench mesh --check FILE`",
    "plot": "is now `organbench report STUDY`",
    "prune": "is gone: delete the folder of a study, and `organbench run` computes it again",
    "publish": "is gone: `python -m studies.lab.publish` in a clone does it",
    "restamp": "is gone: `organbench run` computes what another code has made",
    "status": "is now `organbench show STUDY`",
    "stress": "is now `organbench fuzz`",
    "verify": "is now `python -m studies.lab.verify`, in a clone of the repository",
}
"""Commands of earlier versions, and what stands in their place."""


class Commands(TyperGroup):
    """The group of all commands. Only the one that is called is imported: all of them together take seconds."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Names, in order."""
        return list(LINES)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command as the list of commands shows it; it cannot be called."""
        group = next((group for group, lines in GROUPS.items() if cmd_name in lines), None)
        return group and TyperCommand(cmd_name, help=LINES[cmd_name], rich_help_panel=group)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command that the words call, loaded. Raises StudyError with what replaced it, or the nearest name."""
        name, *rest = args
        if ctx.resilient_parsing and name not in LINES:  # a shell completes a line: a wrong name there is no error
            return name, None, rest
        if name in FORMER:
            raise StudyError(f"the command '{name}' {FORMER[name]}")
        lookup(name, LINES, "command")
        return name, loaded(name), rest

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """The options before a command. Raises StudyError; without words it prints the help."""
        with usage_as_sentence() if args else nullcontext():
            return super().parse_args(ctx, args)

    def invoke(self, ctx: Any) -> Any:
        """Reads the words of the command and runs it. Raises StudyError for words that do not fit it."""
        with usage_as_sentence():
            return super().invoke(ctx)


UsageError: Any = typer.BadParameter.__mro__[1]
"""What typer raises for words that do not fit: click's class, or the copy of it in newer versions of typer."""


@contextmanager
def usage_as_sentence() -> Iterator[None]:
    """Inside, a UsageError is a StudyError, whose sentence names the option or argument."""
    try:
        yield
    except UsageError as error:
        words = " ".join(error.format_message().split()).rstrip(".")
        command = f"{error.ctx.info_name} " if error.ctx is not None and error.ctx.parent is not None else ""
        sentence = f"{words[:1].lower()}{words[1:]}; `organbench {command}--help` lists the options"
        raise StudyError(sentence) from error


def loaded(name: str) -> Any:
    """The command itself."""
    word = name.replace("-", "_")
    alone = typer.Typer(add_completion=False)
    alone.command(name)(getattr(import_module(f"studies.cli.commands.{word}"), word))
    return typer.main.get_command(alone)
