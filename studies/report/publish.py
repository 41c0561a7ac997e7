"""Publishes tables, charts and the summaries on pages of the repository, from results of the present code."""

from collections.abc import Callable, Sequence, Set
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from massspring.sources import source_fingerprint
from studies.base.atomic import write_whole
from studies.base.errors import StudyError
from studies.catalog import Study
from studies.catalog.population import POPULATION
from studies.catalog.study import command_line
from studies.exchange.entry import entry_files
from studies.exchange.league import FOLDER as LEAGUE
from studies.exchange.peers.contest import OURS, fingerprints
from studies.exchange.peers.contest import PEERS as PROGRAMS
from studies.exchange.peers.main import TABLE as SWEEP_TABLE
from studies.report.league.page import NAME as PAGE
from studies.report.league.page import write_league
from studies.report.published_code import (
    CURRENT,
    FILE,
    STALE,
    Finding,
    chart_code,
    compared,
    note,
    scenes_code,
    studies_code,
    study_code,
    text_code,
)
from studies.report.results import FIGURES, charts_and_tables, refresh
from studies.report.sentences import SENTENCES
from studies.report.summaries import SUMMARIES
from studies.store.ledger import Ledger
from studies.store.machine import machine_id, machine_of, write_machine
from studies.store.record import peek
from studies.store.stamps import is_stamped
from studies.sweep.frame_times import timed_jobs
from studies.sweep.standings import standings

PUBLISHED = Path("results") / "published"
"""Below the folder of README.md; the only part of results/ that git keeps."""
SWEEP = f"{LEAGUE}/{SWEEP_TABLE}"
FUZZ = "studies.tools.fuzz"
ADAPTERS = tuple(sorted({peer.module for peer in (*PROGRAMS, *OURS) if peer.module}))


@dataclass(frozen=True)
class Extra:
    """Results that belong to no study."""

    command: str
    """That makes them."""
    makers: tuple[str, ...]
    """Modules that do."""


EXTRAS = {
    "verify": Extra("python -m studies.lab.verify", ()),
    FIGURES: Extra(
        "organbench report --figures",
        (
            *(f"studies.plots.figures.{name}" for name in ("organs", "organ_springs", "paper_ball", "paper_slide")),
            "studies.runs.paper",
        ),
    ),
    "breaking": Extra(
        "make fuzz",
        (*(f"{FUZZ}.{name}" for name in ("campaign", "outcome", "trial")), "studies.plots.campaigns.breaking"),
    ),
    "breaking_reference": Extra(
        "make fuzz", tuple(f"{FUZZ}.reference.{name}" for name in ("outcome", "table", "trial"))
    ),
    "breaking_cuts": Extra("make fuzz", (f"{FUZZ}.campaign", f"{FUZZ}.cuts")),
    "silicone": Extra("python -m studies.tools.silicone.main", ("studies.tools.silicone.main",)),
    LEAGUE: Extra("make study-league", ("studies.exchange.peers.main", "studies.report.league.page", *ADAPTERS)),
    SWEEP: Extra("python -m studies.exchange.peers.main --sweep", ("studies.exchange.peers.main", *ADAPTERS)),
}
"""Results that belong to no study; those that were not made again stay as published."""
APART = (POPULATION,)
"""Studies outside of the catalogue: published when they are asked for, and kept meanwhile."""
REFERENCES, KEPT = "reference", "kept_volume.csv"
"""Made of all studies of the catalogue."""
SUFFIXES = (".csv", ".html", ".md", ".png", ".json")


def publish(root: Path, studies: Sequence[Study], home: Path) -> tuple[list[Path], list[str]]:
    """Copies all tables and charts below `root` to `home`/results/published and the summaries into the pages of `home`.

    The published files, and the names of EXTRAS that were not made below `root` and stay as they are, as do those of
    APART that are none of `studies`. Files that nothing makes any more go. Raises StudyError, before anything
    is written to `home`, unless every piece of every study, and every one of EXTRAS that is there, is of the present
    code.
    """
    ledger = Ledger(root)
    check_studies(ledger, studies)
    absent = [name for name in EXTRAS if not is_made(root, name)]
    made = [name for name in EXTRAS if name not in absent]
    check_extras(root, made)
    written, remarks = charts_and_tables(ledger, studies)
    if remarks:
        raise StudyError(f"not published, something is missing: {remarks[0]}")
    sources = [*written, root / "machine.json"]
    sources += [file for name in made for file in files_of(root, name)]
    show_summaries(root, studies, home)
    target = home / PUBLISHED
    copies = _copy(sources, root, target)
    kept = {*absent, *APART} - {study.name for study in studies}
    old = [file for file in _files(target) if not kept & _names(file, target)]
    _remove(old, [*copies, target / FILE])  # what is kept stays noted
    copies.append(note(target, {name: code() for name, code in _codes(studies, made).items()}))
    show_sentences({study.name for study in studies} | {*made}, home)
    return copies, absent


def publish_some(root: Path, studies: Sequence[Study], home: Path, extras: Sequence[str] = ()) -> list[Path]:
    """The same for the tables, charts and summaries of some studies, and for some of EXTRAS; all else stays as
    published. Where that was measured on another machine, a folder gets a machine.json of its own.

    Raises StudyError as `publish` does, and for one of `extras` that was not made.
    """
    ledger, sources = Ledger(root), []
    check_studies(ledger, studies)
    for name in extras:
        if not is_made(root, name):
            raise StudyError(f"not published: {root / name} is missing; run `{EXTRAS[name].command}` first")
    check_extras(root, extras)
    for study in studies:
        written, missing = refresh(ledger, study)
        if missing and not study.counts_losses:
            raise StudyError(f"not published, something is missing: {study.name}: {missing[0]}")
        sources += written
    sources += [file for name in extras for file in files_of(root, name)]
    show_summaries(root, studies, home)
    target = home / PUBLISHED
    copies = _copy(sources, root, target)
    names = [study.name for study in studies] + [name for name in extras if (root / name).is_dir()]
    if machine_of(target) not in (None, machine_id()):
        for name in names:
            write_machine(target / name / "machine.json")
            copies.append(target / name / "machine.json")
    kept = set(EXTRAS) - set(extras)
    old = [file for name in names for file in _files(target / name) if not kept & _names(file, target)]
    _remove(old, copies)
    copies.append(note(target, {name: code() for name, code in _codes(studies, extras, whole=False).items()}))
    show_sentences({study.name for study in studies} | {*extras}, home)
    return copies


def is_made(root: Path, name: str) -> bool:
    """Whether there is one of EXTRAS below the results folder `root`."""
    return bool(entry_files(root / LEAGUE)) if name == LEAGUE else (root / name).exists()


def files_of(root: Path, name: str) -> list[Path]:
    """What is published of one of EXTRAS; table, chart and page of the league are written first."""
    if name != LEAGUE:
        return _files(root / name)
    written, unread = write_league(root)
    if unread:
        raise StudyError(f"not published: {unread[0]}")
    return written


def _names(file: Path, target: Path) -> set[str]:
    """The names in EXTRAS, or of studies, by which a published file may go: of its folder, and its own."""
    relative = file.relative_to(target)
    return {relative.parts[0], relative.as_posix()}


def _codes(studies: Sequence[Study], extras: Sequence[str], whole: bool = True) -> dict[str, Callable[[], str]]:
    """Name of what is published -> the hash of the present code for it (studies.report.published_code); whole: also
    that of the tables over all `studies`."""
    codes: dict[str, Callable[[], str]] = {study.name: partial(study_code, study) for study in studies}
    by_name = {study.name: study for study in studies}
    codes |= {f"{study.name}/{one.file}": partial(chart_code, study, one) for study in studies for one in study.charts}
    codes |= {one.file: partial(text_code, by_name[one.study], one.text) for one in SUMMARIES if one.study in by_name}
    codes |= {name: partial(source_fingerprint, *EXTRAS[name].makers) for name in extras}
    if whole:
        codes[REFERENCES] = partial(scenes_code, studies, "studies.report.references")
        codes[KEPT] = partial(studies_code, studies, "studies.report.kept_volume")
    return codes


def check(home: Path, studies: Sequence[Study]) -> list[Finding]:
    """Of all that is published below `home`, whether the present code would make the same, and of the blocks of its
    pages whether they show it. studies: those of the catalogue and those APART.

    Raises StudyError where nothing is published, and for something there that nothing makes.
    """
    target = home / PUBLISHED
    if not target.is_dir():
        raise StudyError(f"there is no {target}; run the command in the folder of the project")
    commands = {study.name: command_line("run", [study]) for study in studies}
    commands |= {f"{study.name}/{one.file}": commands[study.name] for study in studies for one in study.charts}
    commands |= {one.file: commands[one.study] for one in SUMMARIES if one.study in commands}
    commands |= {name: extra.command for name, extra in EXTRAS.items()}
    every = "make publish"
    catalogue = [study for study in studies if study.name not in APART]
    codes = _codes(catalogue, list(EXTRAS)) | _codes([s for s in studies if s.name in APART], (), whole=False)
    makers = {name: (code, f"run `{commands.get(name, every)}`") for name, code in codes.items()}
    odd = [file for file in _files(target) if not _names(file, target) & {*makers, FILE, "machine.json"}]
    if odd:
        raise StudyError(f"{odd[0]} is published, and nothing makes it; remove it, or add what does to EXTRAS")
    return [*compared(target, makers), *_blocks(home)]


def _blocks(home: Path) -> list[Finding]:
    """Whether the pages show the tables and sentences that are published."""
    texts = [(one.page, one.marks, (home / PUBLISHED / one.file)) for one in SUMMARIES]
    blocks = [(page, marks, file.read_text(encoding="utf-8")) for page, marks, file in texts if file.is_file()]
    blocks += [(one.page, one.marks, one.written(home / PUBLISHED)) for one in SENTENCES]
    findings = []
    for page, marks, text in blocks:
        content = _read(home / page)
        same = between(content, marks, text, home / page) == content
        words = "" if same else "it does not show what is published; publish again, and leave the block as it is"
        findings.append(Finding(f"{page}, {marks[0]}", CURRENT if same else STALE, words))
    return findings


def check_entries(root: Path, command: str) -> None:
    """Raises StudyError for an entry below `root` that other code judged."""
    current = fingerprints()
    old = [path for path in entry_files(root) if peek(path).fingerprint not in current]
    if old:
        raise StudyError(
            f"not published: {old[0]} and {len(old) - 1} more entries were judged by other code; run `{command}`, and "
            "judge what others handed in again"
        )


def _copy(sources: Sequence[Path], root: Path, target: Path) -> list[Path]:
    places = [root / LEAGUE / PAGE if source == root / PAGE else source for source in sources]
    copies = [target / place.relative_to(root) for place in places]
    for source, copy in zip(sources, copies, strict=True):
        write_whole(copy, source.read_bytes())
    return copies


def _remove(files: Sequence[Path], kept: Sequence[Path]) -> None:
    for file in set(files) - set(kept):
        file.unlink()


def show_summaries(root: Path, studies: Sequence[Study], home: Path) -> None:
    """Puts the summaries of studies between their marks in the pages below `home`.

    Raises StudyError, before anything is written, where a page or its marks are missing.
    """
    names = [study.name for study in studies]
    summaries = [summary for summary in SUMMARIES if summary.study in names]
    pages = dict[Path, str]()
    for summary in summaries:
        page = home / summary.page
        text = (root / summary.file).read_text(encoding="utf-8")
        pages[page] = between(pages.get(page) or _read(page), summary.marks, text, page)
    for page, text in pages.items():
        write_whole(page, text.encode())


def show_sentences(names: Set[str], home: Path) -> None:
    """Puts the findings that concern these studies and EXTRAS between their marks in the pages below `home`.

    They read the published tables. Raises StudyError where a table, a page or its marks are missing.
    """
    for sentences in (each for each in SENTENCES if names & set(each.studies)):
        page = home / sentences.page
        text = between(_read(page), sentences.marks, sentences.written(home / PUBLISHED), page)
        write_whole(page, text.encode())


def check_studies(ledger: Ledger, studies: Sequence[Study], done: str = "published") -> None:
    """Raises StudyError when a piece of a study is missing or stale, a timing of this machine too; done: what is not
    done then."""
    behind = dict[str, list[str]]()
    for study in studies:
        gaps = [f"{one.job.label} is {one.status}" for one in standings(ledger, study) if not one.ended]
        untimed = [job for job in timed_jobs(ledger, study) if ledger.why_untimed(job) is not None]
        gaps += [f"the frame time of {job.label} is missing or stale" for job in untimed]
        if gaps:
            behind[study.name] = gaps
    if behind:
        count, first = sum(map(len, behind.values())), next(iter(behind.values()))[0]
        raise StudyError(
            f"not {done}: {first}" + (f", and {count - 1} more are missing or stale" if count > 1 else "") + "; "
            f"run `{command_line('run', [study for study in studies if study.name in behind])}` first"
        )


def is_current(root: Path, name: str) -> bool:
    """Whether the present code made one of EXTRAS, other than the league, below `root`."""
    return is_stamped(root, name, EXTRAS[name].makers)


def check_extras(root: Path, names: Sequence[str]) -> None:
    """Raises StudyError when one of these EXTRAS was made by other code."""
    if LEAGUE in names:
        check_entries(root / LEAGUE, EXTRAS[LEAGUE].command)
    stale = [name for name in names if name != LEAGUE and not is_current(root, name)]
    if stale:
        raise StudyError(
            f"not published: {root / stale[0]} was made by other code; run `{EXTRAS[stale[0]].command}` and publish "
            "again, or remove it to keep what is published"
        )


def _files(place: Path) -> list[Path]:
    """A file, or the tables and charts below a folder, sorted; none where there is nothing."""
    files = [place] if place.is_file() else sorted(place.rglob("*"))
    return [file for file in files if file.is_file() and file.suffix in SUFFIXES]


def _read(page: Path) -> str:
    if not page.is_file():
        raise StudyError(f"there is no file {page} to put the table into; run the command where it lies")
    return page.read_text(encoding="utf-8")


def between(text: str, marks: tuple[str, str], table: str, page: Path) -> str:
    """`text` of a page with `table` between its marks. Raises StudyError when a mark is missing."""
    begin, end = marks
    if begin not in text or end not in text:
        raise StudyError(f"{page} has no lines '{begin}' and '{end}' to put the table between")
    head, rest = text.split(begin, 1)
    return f"{head}{begin}\n{table.strip()}\n{end}{rest.split(end, 1)[1]}"
