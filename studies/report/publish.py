"""What the repository shows: tables, charts and README's summary, copied from results that the present code made."""

from collections.abc import Sequence
from pathlib import Path

from studies.base.atomic import write_whole
from studies.base.errors import StudyError
from studies.catalog import Study
from studies.report.results import FIGURES, report
from studies.store.stamps import is_stamped
from studies.sweep.standings import standings
from studies.timing.cases import timing_is_current
from studies.verify.verification import FOLDER as VERIFY

PUBLISHED = Path("results") / "published"
"""Below the folder of README.md; the only part of results/ that git keeps."""
BEGIN, END = "<!-- results: begin -->", "<!-- results: end -->"
"""Between these lines of README.md stands the summary."""
EXTRAS = {
    VERIFY: "organbench verify",
    FIGURES: "organbench report --figures",
    "bench.csv": "make bench",
    "geometry.csv": "python -m studies.bench.meshes",
}
"""Results that belong to no study, and the command that makes each. What was not made again stays as published."""
SUFFIXES = (".csv", ".md", ".png", ".json")


def publish(root: Path, studies: Sequence[Study], home: Path) -> tuple[list[Path], list[str]]:
    """Copies all tables and charts below `root` to `home`/results/published and the summary into `home`/README.md.

    The published files, and the names of EXTRAS that were not made below `root` and stay as they are. Files that
    nothing makes any more go. Raises StudyError, before anything is written to `home`, unless every piece of every
    study, and every one of EXTRAS that is there, is of the present code.
    """
    check_studies(root, studies)
    absent = [name for name in EXTRAS if not (root / name).exists()]
    check_extras(root, [name for name in EXTRAS if name not in absent])
    written, remarks = report(root, studies)
    if remarks:
        raise StudyError(f"not published, something is missing: {remarks[0]}")
    sources = [*written, root / "machine.json"]
    sources += [file for name in EXTRAS for file in _files(root / name)]
    target = home / PUBLISHED
    write_readme(home / "README.md", (root / "summary.md").read_text(encoding="utf-8"))
    copies = {target / source.relative_to(root): source for source in sources}
    for copy, source in copies.items():
        write_whole(copy, source.read_bytes())
    for file in _files(target):
        if file not in copies and file.relative_to(target).parts[0] not in absent:
            file.unlink()
    return list(copies), absent


def check_studies(root: Path, studies: Sequence[Study]) -> None:
    """Raises StudyError when a piece of a study is missing or stale, a timing of this machine too."""
    behind: dict[str, list[str]] = {}
    for study in studies:
        pieces = [s for s in standings(root, study) if s.status in ("missing", "stale")]
        lacking = [f"{piece.task.label} is {piece.status}" for piece in pieces]
        lacking += [
            f"the frame time of {case.name} is missing or stale"
            for case in study.cases
            if case.timed and not timing_is_current(root, study.name, case)
        ]
        if lacking:
            behind[study.name] = lacking
    if behind:
        count, first = sum(map(len, behind.values())), next(iter(behind.values()))[0]
        raise StudyError(
            f"not published: {first}" + (f", and {count - 1} more are missing or stale" if count > 1 else "") + "; "
            f"run `organbench run {' '.join(behind)}` and publish again"
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


def write_readme(readme: Path, summary: str) -> None:
    """Replaces what stands between the marks in README.md. Raises StudyError when the marks are missing."""
    if not readme.is_file():
        raise StudyError(f"there is no file {readme} to put the table into; run the command where it lies")
    text = readme.read_text(encoding="utf-8")
    if BEGIN not in text or END not in text:
        raise StudyError(f"{readme} has no lines '{BEGIN}' and '{END}' to put the table between")
    head, rest = text.split(BEGIN, 1)
    tail = rest.split(END, 1)[1]
    write_whole(readme, f"{head}{BEGIN}\n{summary.strip()}\n{END}{tail}".encode())
