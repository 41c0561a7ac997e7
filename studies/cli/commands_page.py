"""docs/commands.md: every command with its options. `python -m studies.cli.commands_page` writes it."""

import textwrap
from collections import Counter
from pathlib import Path
from typing import Any

import typer

from studies.base.atomic import write_whole
from studies.cli.app import app
from studies.cli.terminal import PROGRAM

PAGE = Path(__file__).parents[2] / "docs/commands.md"
WIDTH, SEVERAL = 120, 3
"""Columns of the page, and commands that share an option before it is listed once."""
HEAD = f"""# Commands

`organbench COMMAND --help` prints the same. `python -m studies.cli.commands_page` writes this page. A FILE.py may stand
for a study or a scene. {PROGRAM} ([SECURITY.md](../SECURITY.md))."""


def commands_page() -> str:
    """The page as Markdown."""
    commands = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    items = {name: [_item(param) for param in command.params] for name, command in commands.items()}
    counts = Counter(item for command in items.values() for item in command)
    shared = [item for item, count in counts.items() if count >= SEVERAL]
    parts = [HEAD]
    for name, command in commands.items():
        if f"## {command.rich_help_panel}" not in parts:
            parts.append(f"## {command.rich_help_panel}")
        usage = " ".join(["organbench", name, *filter(None, map(_usage, command.params))])
        also = [item.split(": ")[0].removeprefix("- ") for item in items[name] if item in shared]
        more = f" Also {', '.join(also)}." if also else ""
        parts.append(_wrapped(f"**`{usage}`** {command.help}{more}"))
        parts.append("\n".join(_wrapped(item) for item in items[name] if item not in shared))
    parts += ["## Arguments and options of several commands", "\n".join(map(_wrapped, shared))]
    return "\n\n".join(filter(None, parts)) + "\n"


def _item(param: Any) -> str:
    """An argument or option as an item of a list."""
    if param.param_type_name == "argument":
        names = [param.metavar or param.name.upper()]
    else:
        names = [*param.opts, *([] if param.default is False else param.secondary_opts)]
    meaning = param.help.replace(f" ({PROGRAM})", "").replace("\\[", "[")
    if param.default not in (None, "") and not isinstance(param.default, bool) and "--results" not in param.opts:
        meaning += f" (default {param.default})"
    return f"- {', '.join(f'`{name}`' for name in names)}: {meaning}"


def _usage(param: Any) -> str:
    """An argument as it stands in the usage of its command; nothing for an option."""
    if param.param_type_name != "argument":
        return ""
    word = (param.metavar or param.name.upper()) + ("..." if param.nargs == -1 else "")
    return word if param.required else f"[{word}]"


def _wrapped(text: str) -> str:
    indent = "  " if text.startswith("- ") else ""
    words = " ".join(text.split())
    return textwrap.fill(words, WIDTH, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)


if __name__ == "__main__":
    write_whole(PAGE, commands_page().encode())
