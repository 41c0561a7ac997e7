"""The commands in their groups, and what the program says to words that are none."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from typing import Any

import typer
from typer.core import TyperGroup

from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.cli.commands.advise import advise
from studies.cli.commands.archive import archive
from studies.cli.commands.compare import compare
from studies.cli.commands.demo import demo
from studies.cli.commands.doctor import doctor
from studies.cli.commands.export import export
from studies.cli.commands.fuzz import fuzz
from studies.cli.commands.judge import judge
from studies.cli.commands.list import list as list_names
from studies.cli.commands.mesh import mesh, mesh_check
from studies.cli.commands.place import place
from studies.cli.commands.profile import profile
from studies.cli.commands.replay import replay
from studies.cli.commands.report import report
from studies.cli.commands.run import run
from studies.cli.commands.safe_dt import safe_dt
from studies.cli.commands.show import show
from studies.cli.commands.table import table
from studies.cli.commands.view import view
from studies.cli.commands.worker import worker

GROUPS: dict[str, tuple[Callable[..., None], ...]] = {
    "Run studies": (demo, run, replay, worker),
    "Look at results": (list_names, show, table, report, compare, view),
    "Recommend and test": (advise, safe_dt, profile, fuzz),
    "Make meshes": (mesh, place),
    "Share, compare with other programs, maintain": (export, judge, archive, doctor),
}
FORMER = {
    "calibrate": "is gone: quadratic bodies need no fit (`organbench advise` names one)",
    "prune": "is gone: delete the folder of a study, and `organbench run` computes it again",
    "publish": "is gone: `python -m studies.lab.publish` in a clone does it",
    "restamp": "is gone: `organbench run` computes what another code has made",
    "verify": "is now `python -m studies.lab.verify`, in a clone of the repository",
}
"""Commands of earlier versions, and what stands in their place."""
RENAMED: dict[str, Callable[..., None]] = {
    "check": mesh_check,
    "cost": profile,
    "mesh-check": mesh_check,
    "plot": report,
    "status": show,
    "stress": fuzz,
}
"""Former names that scripts may have; the help does not list them."""


class Commands(TyperGroup):
    """The group of all commands: words that do not fit are a StudyError."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command that the words call. Raises StudyError with what replaced it, or the nearest name."""
        if not ctx.resilient_parsing:  # else a shell completes a line: a wrong name there is no error
            if args[0] in FORMER:
                raise StudyError(f"the command '{args[0]}' {FORMER[args[0]]}")
            lookup(args[0], self.commands, "command")
        return super().resolve_command(ctx, args)

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


def add_commands(app: typer.Typer) -> None:
    """Adds all commands; the list of them shows of each the first sentence of its docstring."""
    for group, functions in GROUPS.items():
        for function in functions:
            line = (function.__doc__ or "").split("\n\n")[0].split(". ")[0].rstrip(".") + "."
            app.command(function.__name__.replace("_", "-"), short_help=line, rich_help_panel=group)(function)
    for name, function in RENAMED.items():
        app.command(name, hidden=True)(function)
