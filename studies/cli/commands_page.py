"""docs/commands.md: every command with its options. `python -m studies.cli.commands_page` writes it."""

import textwrap
from collections import Counter
from pathlib import Path
from typing import Any

from studies.base.atomic import write_whole
from studies.cli.loading import COMMANDS, loaded
from studies.cli.terminal import PROGRAM

PAGE = Path(__file__).parents[2] / "docs/commands.md"
WIDTH, SEVERAL = 120, 3
"""Columns of the page, and commands that share an option before it is listed once."""
HEAD = f"""# Commands

`organbench COMMAND --help` prints the same. `python -m studies.cli.commands_page` writes this page. A FILE.py may stand
for a study or a scene. {PROGRAM} ([SECURITY.md](../SECURITY.md))."""


def commands_page() -> str:
    """The page as Markdown."""
    commands = {name: loaded(name) for name in COMMANDS}
    described = {name: [_described(one) for one in command.params] for name, command in commands.items()}
    counts = Counter(line for lines in described.values() for line in lines)
    shared = [line for line, count in counts.items() if count >= SEVERAL]
    parts, panel = [HEAD], ""
    for name, command in commands.items():
        if COMMANDS[name].panel != panel:
            panel = COMMANDS[name].panel
            parts.append(f"## {panel}")
        usage = " ".join(["organbench", name, *map(_usage, filter(_is_argument, command.params))])
        also = [line.split(": ")[0].removeprefix("- ") for line in described[name] if line in shared]
        more = f" Also {', '.join(also)}." if also else ""
        parts.append(_wrapped(f"**`{usage}`** {command.help}{more}"))
        parts.append("\n".join(_wrapped(line) for line in described[name] if line not in shared))
    parts += ["## Arguments and options of several commands", "\n".join(map(_wrapped, shared))]
    return "\n\n".join(filter(None, parts)) + "\n"


def _described(param: Any) -> str:
    """An argument or option as an item of a list."""
    opposite = [] if param.default is False else param.secondary_opts
    names = [_word(param)] if _is_argument(param) else [*param.opts, *opposite]
    meaning = param.help.replace(f" ({PROGRAM})", "").replace("\\[", "[")
    if param.default not in (None, "") and not isinstance(param.default, bool) and "--results" not in param.opts:
        meaning += f" (default {param.default})"
    return f"- {', '.join(f'`{name}`' for name in names)}: {meaning}"


def _is_argument(param: Any) -> bool:
    return param.param_type_name == "argument"


def _word(param: Any) -> str:
    """An argument, in capitals."""
    return param.metavar or param.name.upper()


def _usage(param: Any) -> str:
    """An argument as it stands in the usage of its command."""
    word = _word(param) + ("..." if param.nargs == -1 else "")
    return word if param.required else f"[{word}]"


def _wrapped(text: str) -> str:
    """A paragraph or an item of a list in lines of at most WIDTH columns."""
    indent = "  " if text.startswith("- ") else ""
    words = " ".join(text.split())
    return textwrap.fill(words, WIDTH, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)


if __name__ == "__main__":
    write_whole(PAGE, commands_page().encode())
