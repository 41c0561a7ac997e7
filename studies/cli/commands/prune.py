"""`organbench prune`: stored files that nothing needs any more."""

from pathlib import Path
from typing import Annotated

import typer

from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.catalog import STUDIES
from studies.cli.terminal import Results, say
from studies.store.ledger import Ledger
from studies.sweep.find_study import find_studies
from studies.sweep.prune import MEANING, Prunable, Rule, prunable, remove

SHOWN = 8
"""Files named per rule; `--list` names the rest."""


def prune(
    studies: Annotated[list[str] | None, typer.Argument(metavar="STUDY", help="the studies to examine")] = None,
    every: Annotated[bool, typer.Option("--all", help="examine all studies")] = False,
    rules: Annotated[str, typer.Option("--rule", help=f"rules to apply, separated by commas: {', '.join(Rule)}")] = "",
    older: Annotated[float, typer.Option("--older-than", metavar="DAYS", min=0.0, help="keep younger files")] = 0.0,
    references: Annotated[bool, typer.Option(help="also examine their references (hours of computing)")] = False,
    results: Results = Path("results"),
    listed: Annotated[bool, typer.Option("--list", help="name every file")] = False,
    yes: Annotated[bool, typer.Option("--yes", help="remove the files; without it they are only listed")] = False,
) -> None:
    """List and remove stored files that nothing needs. Nothing is removed without --rule and --yes."""
    if bool(studies) == every:
        raise StudyError("name the studies whose files are examined, or give --all")
    if yes and not rules:
        raise StudyError("--yes removes nothing without --rule: name the rules to apply")
    rules_by_name = {str(rule): rule for rule in Rule}
    chosen = [lookup(word.strip(), rules_by_name, "rule") for word in rules.split(",")] if rules else list(Rule)
    chosen_studies = list(STUDIES) if every else find_studies(studies or [])
    removable = prunable(Ledger(results), chosen_studies, chosen, older, references)
    for rule in chosen:
        show([one for one in removable if one.rule == rule], rule, listed)
    if not removable:
        say("nothing to remove")
    elif yes:
        gone = remove(removable)
        say(f"removed {len(gone)} files, {size(gone)}" + _left(removable, gone))
    else:
        say(f"dry run: {size(removable)} could be removed. Repeat with --rule RULE --yes to delete")


def show(files: list[Prunable], rule: Rule, listed: bool) -> None:
    """The files of a rule, with what it means."""
    if not files:
        return
    say(f"{rule}, {MEANING[rule]}: {len(files)} files, {size(files)}")
    shown = files if listed or len(files) <= SHOWN + 1 else files[:SHOWN]
    for one in shown:
        say(f"  {one.path}")
    if len(shown) < len(files):
        say(f"  and {len(files) - len(shown)} more (--list names them)")


def size(files: list[Prunable]) -> str:
    """Of all together, in MB."""
    return f"{sum(one.size for one in files) / 1e6:.1f} MB"


def _left(files: list[Prunable], gone: list[Prunable]) -> str:
    left = len(files) - len(gone)
    return f"; {left} were rewritten in the meantime and stay" if left else ""
