"""The commands: their groups and lines for `--help`, and the loading of the one that is called."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from importlib import import_module
from typing import Annotated, Any, NamedTuple

import typer
from typer.core import TyperCommand, TyperGroup

from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.cli import outline


class Entry(NamedTuple):
    """What the list of commands shows of one."""

    panel: str
    """Its group in `--help`."""
    line: str
    names: str = ""
    """What its arguments name, of NAMES; a shell completes file names where nothing is listed, or nothing fits."""


RUN, LOOK, TOOLS, MESHES = "Run studies", "Look at results", "Recommend and test", "Make meshes"
SHARE, MAINTAIN = "Share and compare with other programs", "Maintain"
COMMANDS = {
    "demo": Entry(RUN, "Squeeze a ball with three bodies, next to the reference."),
    "run": Entry(RUN, "Run what is missing or stale, then draw the charts.", "studies"),
    "status": Entry(RUN, "Count what is ok, failed, stale or missing, and say why.", "studies"),
    "replay": Entry(RUN, "Run one stored case again and compare the results."),
    "worker": Entry(RUN, "Run tasks for `organbench run --on` until stopped."),
    "list": Entry(LOOK, "List studies, scenes, organs, methods and metrics.", "kinds"),
    "show": Entry(LOOK, "Show a results file: status, numbers, fields with units."),
    "table": Entry(LOOK, "Print one row per case with the metrics of a study.", "studies"),
    "plot": Entry(LOOK, "Draw the charts and the table of a study.", "studies"),
    "report": Entry(LOOK, "Draw all charts and tables and write report.html.", "studies"),
    "compare": Entry(LOOK, "Compare two results folders number by number."),
    "view": Entry(LOOK, "Write cases and their reference to a file for ParaView.", "scenes"),
    "advise": Entry(TOOLS, "Recommend the cheapest accurate body for a scene.", "scenes"),
    "calibrate": Entry(TOOLS, "Fit a few numbers of a body to the reference.", "organs"),
    "safe-dt": Entry(TOOLS, "Predict the largest stable time step and verify it.", "scenes"),
    "profile": Entry(TOOLS, "Measure the stages of a time step in microseconds.", "scenes"),
    "verify": Entry(TOOLS, "Check the reference against known solutions."),
    "fuzz": Entry(TOOLS, "Try to break every method with random trials."),
    "mesh": Entry(MESHES, "Mesh a synthetic organ or a surface in a file.", "organs"),
    "mesh-check": Entry(MESHES, "List the faults of a mesh and how to repair each."),
    "place": Entry(MESHES, "Place hold and probe on a scan and write a study."),
    "export": Entry(SHARE, "Write a scene for another program.", "scenes"),
    "judge": Entry(SHARE, "Judge the results of another program like our own.", "scenes"),
    "archive": Entry(SHARE, "Pack records, tables, charts and code into a zip file.", "studies"),
    "publish": Entry(SHARE, "Copy tables and charts to results/published.", "studies"),
    "restamp": Entry(MAINTAIN, "Keep results after a change of code that moves no number.", "studies"),
    "doctor": Entry(MAINTAIN, "Check this installation, its caches and its results."),
    "prune": Entry(MAINTAIN, "List and remove stored files that nothing needs.", "studies"),
}
"""Name -> Entry, group by group. The module studies.cli.commands.NAME holds the function NAME, with _ for -."""
RENAMED = {"check": "mesh-check", "stress": "fuzz", "cost": "profile"}
"""Commands of the version before, and their names now."""


def scenes() -> list[str]:
    """Names of the scenes."""
    from studies.scene.library import CUT, SCENES

    return [scene.name for scene in (*SCENES, *CUT)]


def organs() -> list[str]:
    """Names of the organs."""
    from studies.geometry.organs import SHAPES

    return list(SHAPES)


NAMES: dict[str, Callable[[], list[str]]] = {
    "kinds": lambda: ["studies", "scenes", "organs", "methods", "metrics"],
    "studies": lambda: [name for name, _ in outline.studies()],
    "scenes": scenes,
    "organs": organs,
}


class Commands(TyperGroup):
    """The group of all commands; `--help` and a shell that completes a line load none of them."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Names, in order."""
        return list(COMMANDS)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command as the list of commands shows it; it cannot be called."""
        entry = COMMANDS.get(cmd_name)
        return entry and TyperCommand(cmd_name, help=entry.line, rich_help_panel=entry.panel)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command that the words call, loaded. Raises StudyError with the new or the nearest name."""
        name, *rest = args
        if ctx.resilient_parsing:  # a shell completes a line: a wrong name there is no error
            return name, unloaded(name) if name in COMMANDS else None, rest
        if name in RENAMED:
            raise StudyError(f"the command '{name}' is now '{RENAMED[name]}': run `organbench {RENAMED[name]}`")
        lookup(name, COMMANDS, "command")
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


def unloaded(name: str) -> Any:
    """A command as a shell completes it: names come at once, and only its options load it."""

    class Unloaded(TyperCommand):
        def shell_complete(self, ctx: Any, incomplete: str) -> list[Any]:
            return loaded(name).shell_complete(ctx, incomplete)

    def names(ctx: typer.Context, incomplete: str) -> list[str]:
        given = list(ctx.params.get("words") or ())
        if given and given[-1].startswith("-"):
            params = loaded(name).params
            if any(given[-1] in option.opts and not option.is_flag for option in params):
                return []  # its value is no name
        offered = NAMES[COMMANDS[name].names]() if COMMANDS[name].names else []
        return [word for word in offered if word.startswith(incomplete) and word not in given]

    def command(words: Annotated[list[str] | None, typer.Argument(autocompletion=names)] = None) -> None: ...

    alone = typer.Typer(add_completion=False)
    alone.command(name, cls=Unloaded, context_settings={"ignore_unknown_options": True})(command)
    return typer.main.get_command(alone)
