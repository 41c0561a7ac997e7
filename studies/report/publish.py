"""What the repository shows: tables, charts and the summaries on its pages, from results that the present code made."""

from collections.abc import Sequence
from pathlib import Path

from studies.base.atomic import write_whole
from studies.base.errors import StudyError
from studies.catalog import Study
from studies.catalog.population import POPULATION
from studies.catalog.study import command_line
from studies.report.results import FIGURES, charts_and_tables, refresh
from studies.report.sentences import SENTENCES
from studies.report.summary import SUMMARIES
from studies.store.ledger import Ledger
from studies.store.machine import machine_id, machine_of, write_machine
from studies.store.stamps import is_stamped
from studies.sweep.frame_times import timed_jobs
from studies.sweep.standings import standings
from studies.tools.verify.verification import FOLDER as VERIFY

PUBLISHED = Path("results") / "published"
"""Below the folder of README.md; the only part of results/ that git keeps."""
EXTRAS = {
    VERIFY: "organbench verify",
    FIGURES: "organbench report --figures",
    "bench.csv": "make bench",
    "breaking": "make fuzz",
    "breaking_reference": "make fuzz",
    "breaking_cuts": "make fuzz",
    "geometry.csv": "python -m studies.bench.meshes",
}
"""Results that belong to no study, and the command that makes each. What was not made again stays as published."""
APART = (POPULATION, "peers")
"""Studies outside of the catalogue: published when they are asked for, and kept meanwhile."""
SUFFIXES = (".csv", ".md", ".png", ".json")


def publish(root: Path, studies: Sequence[Study], home: Path) -> tuple[list[Path], list[str]]:
    """Copies all tables and charts below `root` to `home`/results/published and the summaries into the pages of `home`.

    The published files, and the names of EXTRAS that were not made below `root` and stay as they are, as do those of
    APART that are none of `studies`. Files that nothing makes any more go. Raises StudyError, before anything
    is written to `home`, unless every piece of every study, and every one of EXTRAS that is there, is of the present
    code.
    """
    ledger = Ledger(root)
    check_studies(ledger, studies)
    absent = [name for name in EXTRAS if not (root / name).exists()]
    check_extras(root, [name for name in EXTRAS if name not in absent])
    written, remarks = charts_and_tables(ledger, studies)
    if remarks:
        raise StudyError(f"not published, something is missing: {remarks[0]}")
    sources = [*written, root / "machine.json"]
    sources += [file for name in EXTRAS for file in _files(root / name)]
    show_summaries(root, studies, home)
    target = home / PUBLISHED
    copies = _copy(sources, root, target)
    kept = {*absent, *APART} - {study.name for study in studies}
    _remove([file for file in _files(target) if file.relative_to(target).parts[0] not in kept], copies)
    show_sentences(studies, home)
    return copies, absent


def publish_some(root: Path, studies: Sequence[Study], home: Path) -> list[Path]:
    """The same for the tables, charts and summaries of some studies; all else stays as published. Where that was
    measured on another machine, the folder of a study gets a machine.json of its own.

    Raises StudyError as `publish` does.
    """
    ledger, sources = Ledger(root), []
    check_studies(ledger, studies)
    for study in studies:
        written, missing = refresh(ledger, study)
        if missing and not study.counts_losses:
            raise StudyError(f"not published, something is missing: {study.name}: {missing[0]}")
        sources += written
    show_summaries(root, studies, home)
    target = home / PUBLISHED
    copies = _copy(sources, root, target)
    if machine_of(target) not in (None, machine_id()):
        for study in studies:
            write_machine(target / study.name / "machine.json")
            copies.append(target / study.name / "machine.json")
    _remove([file for study in studies for file in _files(target / study.name)], copies)
    show_sentences(studies, home)
    return copies


def _copy(sources: Sequence[Path], root: Path, target: Path) -> list[Path]:
    for source in sources:
        write_whole(target / source.relative_to(root), source.read_bytes())
    return [target / source.relative_to(root) for source in sources]


def _remove(files: Sequence[Path], kept: Sequence[Path]) -> None:
    for file in set(files) - set(kept):
        file.unlink()


def show_summaries(root: Path, studies: Sequence[Study], home: Path) -> None:
    """Puts the summaries of studies between their marks in the pages below `home`.

    Raises StudyError, before anything is written, where a page or its marks are missing.
    """
    names = [study.name for study in studies]
    told = [summary for summary in SUMMARIES if summary.study in names]
    pages = dict[Path, str]()
    for summary in told:
        page = home / summary.page
        text = (root / summary.file).read_text(encoding="utf-8")
        pages[page] = between(pages.get(page) or _read(page), summary.marks, text, page)
    for page, text in pages.items():
        write_whole(page, text.encode())


def show_sentences(studies: Sequence[Study], home: Path) -> None:
    """Puts the findings that concern these studies between their marks in the pages below `home`.

    They read the published tables. Raises StudyError where a table, a page or its marks are missing.
    """
    names = {study.name for study in studies}
    for sentences in (each for each in SENTENCES if names & set(each.studies)):
        page = home / sentences.page
        text = between(_read(page), sentences.marks, sentences.written(home / PUBLISHED), page)
        write_whole(page, text.encode())


def check_studies(ledger: Ledger, studies: Sequence[Study], done: str = "published") -> None:
    """Raises StudyError when a piece of a study is missing or stale, a timing of this machine too; done: what is not
    done then."""
    behind = dict[str, list[str]]()
    for study in studies:
        lacking = [f"{one.job.label} is {one.status}" for one in standings(ledger, study) if not one.ended]
        untimed = [job for job in timed_jobs(ledger, study) if ledger.why_untimed(job) is not None]
        lacking += [f"the frame time of {job.label} is missing or stale" for job in untimed]
        if lacking:
            behind[study.name] = lacking
    if behind:
        count, first = sum(map(len, behind.values())), next(iter(behind.values()))[0]
        raise StudyError(
            f"not {done}: {first}" + (f", and {count - 1} more are missing or stale" if count > 1 else "") + "; "
            f"run `{command_line('run', [study for study in studies if study.name in behind])}` first"
        )


def check_extras(root: Path, names: Sequence[str]) -> None:
    """Raises StudyError when one of these EXTRAS was made by other code."""
    stale = [name for name in names if not is_stamped(root, name)]
    if stale:
        raise StudyError(
            f"not published: {root / stale[0]} was made by other code; run `{EXTRAS[stale[0]]}` and publish again, "
            "or remove it to keep what is published"
        )


def _files(place: Path) -> list[Path]:
    """A file, or the tables and charts below a folder, sorted; none where there is nothing."""
    found = [place] if place.is_file() else sorted(place.rglob("*"))
    return [file for file in found if file.is_file() and file.suffix in SUFFIXES]


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
