"""`python -m studies.lab.publish [NAME...]`: tables and charts of results/ become those of results/published.

Without a name all that is there is copied. Studies are brought up to date first; what is current costs seconds.
"""

import json
import shlex
import subprocess
import sys
from argparse import ArgumentParser
from collections.abc import Iterable, Sequence
from pathlib import Path

from studies import STUDIES, StudyError
from studies.lab.refusal import refusal

PUBLISHED = Path("results/published")
"""The only part of results/ that git keeps."""
POPULATION = "population"
EXTRAS = {
    POPULATION: "organbench run studies/lab/population/study.py",
    "league": "make study-league",
    "verify": "python -m studies.lab.verify",
    "figures": "organbench report --figures",
    "silicone": "python -m studies.lab.silicone",
    "breaking": "organbench fuzz --cases 10000",
    "reference": "organbench report",
    "summary.md": "organbench report",
    "machine.json": "organbench report",
}
"""What belongs to no study of the catalogue -> the command that makes it below results/."""
SUFFIXES = (".csv", ".html", ".md", ".png", ".json")
ELSEWHERE = {"league/league.html": "league.html"}
"""Published file -> where it lies below results/, if that is another place: it links to report.html there."""


def main(arguments: Sequence[str] | None = None) -> None:
    parser = ArgumentParser(prog="python -m studies.lab.publish", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="a study, or a file or folder of results/published")
    parser.add_argument("--results", type=Path, default=Path("results"))
    parser.add_argument("--home", type=Path, default=Path(), help="folder that holds results/published")
    given = parser.parse_args(arguments)
    for path in publish(given.results, given.names, given.home / PUBLISHED):
        print(path)


def publish(results: Path, names: Sequence[str], target: Path) -> list[Path]:
    """Draws and copies `names`, or all that is there; the copies. What they no longer have goes.

    Raises StudyError for a name that nothing makes, and for results that are not there.
    """
    catalogue = [study.name for study in STUDIES]
    for name in names:
        if name not in (*catalogue, *EXTRAS):
            raise StudyError(f"nothing makes '{name}'; give a study, or one of {', '.join(EXTRAS)}")
    known = [name for name in (*catalogue, *EXTRAS) if files_of(results, name)]
    chosen = names or known
    studies = [name for name in chosen if name in catalogue]
    if studies:
        _organbench("run", *studies, "--results", str(results))
    _organbench("report", "--results", str(results))
    copies = []
    for name in chosen:
        files = files_of(results, name)
        if not files:
            raise StudyError(f"there is no {results / name}; run `{EXTRAS.get(name, f'organbench run {name}')}` first")
        copies += _copied(files, target, results)
        if (target / name).is_dir():
            copies += _note_machine(results, target, name)
            _remove(set(_files(target / name)) - set(copies))
    return copies


def files_of(results: Path, name: str) -> dict[str, Path]:
    """What is published of a name: place below results/published -> file below `results`."""
    files = {file.relative_to(results).as_posix(): file for file in _files(results / name)}
    more = {place: results / file for place, file in ELSEWHERE.items() if place.split("/")[0] == name and files}
    return files | {place: file for place, file in more.items() if file.is_file()}


def _files(place: Path) -> list[Path]:
    """A file, or the tables and charts below a folder; none where there is nothing."""
    files = [place] if place.is_file() else sorted(place.rglob("*"))
    return [file for file in files if file.is_file() and file.suffix in SUFFIXES]


def _copied(files: dict[str, Path], target: Path, results: Path) -> list[Path]:
    for place, file in files.items():
        (target / place).parent.mkdir(parents=True, exist_ok=True)
        (target / place).write_bytes(file.read_bytes())
    return [target / place for place in files]


def _note_machine(results: Path, target: Path, name: str) -> list[Path]:
    """machine.json beside results that another machine measured than the rest: frame times are compared by it."""
    here, there = (
        json.loads(path.read_bytes()).get("id") if path.is_file() else None
        for path in (results / "machine.json", target / "machine.json")
    )
    if here is None or here == there:
        return []
    return _copied({f"{name}/machine.json": results / "machine.json"}, target, results)


def _remove(files: Iterable[Path]) -> None:
    for file in files:
        file.unlink()


def _organbench(*words: str) -> None:
    """Raises StudyError where the command fails: what it says stands above."""
    if subprocess.run([sys.executable, "-m", "studies", *words]).returncode:
        raise StudyError(f"`{shlex.join(['organbench', *words])}` failed, so nothing was published")


if __name__ == "__main__":
    with refusal("publish"):
        main()
