"""Studies of very many cases whose records are made up: what they cost to look after, without running them.

`python -m studies.bench.many_cases [COUNT]` measures it: 100,000 in about half an hour, in 7 GB of
temporary files.
"""

import os
import shutil
import subprocess
import sys
import time
from dataclasses import replace
from itertools import islice, product
from pathlib import Path
from tempfile import TemporaryDirectory

from massspring.sources import OWN
from studies.bench.line import BenchLine
from studies.catalog.study import Study
from studies.runs.case import BodyRecipe, Case
from studies.runs.current import run_fingerprint
from studies.runs.run import measure
from studies.scenes.ball_squeeze import BALL_SQUEEZE
from studies.store.opening import BLOCK, sealed
from studies.store.paths import SUFFIX, file_stem, key_digest, study_folder
from studies.store.record import Record, write_record

NAME, COUNT = "many", 100_000
PROJECT = Path(__file__).parents[2]
FRAMES = 5
FRACTIONS = [k / 10_000 for k in range(1001, 10_000) if k % 10]
"""Of the stability limit; all of one length as text."""
NODES = range(1000, 10_000)
SCENE = replace(BALL_SQUEEZE, reference=None)


def many_study(count: int) -> Study:
    """A study of so many cases, which differ by nodes and time step. At most 73 million."""
    settings = islice(product(NODES, FRACTIONS), count)
    bodies = {nodes: BodyRecipe(nodes=nodes) for nodes in NODES}
    cases = tuple(Case(SCENE, bodies[nodes], dt_fraction=fraction) for nodes, fraction in settings)
    return Study(NAME, "What do many cases cost?", cases, (), ("volume_worst", "volume_end", "min_j", "penetration"))


def make_up(root: Path, study: Study, like: Record) -> int:
    """Stores a record for every case of `study`, a copy of `like` but for its case; the bytes of each."""
    first = study.cases[0]
    path = study_folder(root, study.name) / "template"
    write_record(path, replace(like, key=first.key, name=first.name, fingerprint=run_fingerprint()))
    image = path.read_bytes()
    path.unlink()
    before = _texts(first)
    for case in study.cases:
        own, copy = _texts(case), image
        for old, new in zip(before, own, strict=True):
            assert len(old) == len(new) and copy.count(old) == 1  # else it would be no HDF5 file any more
            copy = copy.replace(old, new)
        name = file_stem(case.name, key_digest(case.key)) + SUFFIX
        path.with_name(name).write_bytes(sealed(b"\0" * BLOCK + copy[BLOCK:]))
    return len(image)


def _texts(case: Case) -> tuple[bytes, ...]:
    """What is a case's own in the file of its record."""
    return case.key.encode(), case.name.encode()


def many_lines(count: int = COUNT) -> list[BenchLine]:
    """Wall times of commands on a study of `count` stored cases, each in a process of its own."""
    with TemporaryDirectory(prefix="many-") as folder:
        root, code = Path(folder) / "results", Path(folder) / "code"
        study = Path(folder) / f"{NAME}.py"
        study.write_text(f"from studies.bench.many_cases import many_study\n\nSTUDY = many_study({count})\n")
        size = make_up(root, many_study(count), measure(Case(SCENE, BodyRecipe(nodes=150), frames=FRAMES)))
        status, table = ("status", study, "--results", root), ("table", study, "--results", root)
        note = f"{count:,} made-up records of {size / 1e3:.0f} kB"
        lines = [
            BenchLine("index of many cases, made", wall_seconds(PROJECT, *status), "s", 120.0, note=note),
            BenchLine("status of many cases", wall_seconds(PROJECT, *status), "s", 3.0, note=note),
            BenchLine("table of many cases, first", wall_seconds(PROJECT, *table), "s", None, note=note),
            BenchLine("table of many cases", wall_seconds(PROJECT, *table), "s", 10.0, note=note),
        ]
        edited_copy(code)
        return [*lines, BenchLine("status after an edit", wall_seconds(code, *status), "s", 5.0, note=note)]


def wall_seconds(code: Path, *words: object) -> float:
    """Of a command by the sources in the folder `code`."""
    line = [sys.executable, "-m", "studies", *map(str, words)]
    begun = time.perf_counter()
    subprocess.run(line, cwd=code, env=os.environ | {"PYTHONPATH": str(code)}, check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - begun


def edited_copy(target: Path) -> None:
    """The sources of the three packages, one of them edited so that every run is stale."""
    for package in OWN:
        shutil.copytree(PROJECT / package, target / package, ignore=shutil.ignore_patterns("__pycache__"))
    edited = target / "studies" / "runs" / "prepare.py"
    edited.write_text(edited.read_text(encoding="utf-8") + "\nEDITED = True\n", encoding="utf-8")


def main() -> None:
    """Prints the lines."""
    for line in many_lines(int(sys.argv[1]) if len(sys.argv) > 1 else COUNT):
        print(f"{line.what}: {line.measured:.1f} {line.unit}, target {line.promise or 'none'}; {line.note}")


if __name__ == "__main__":
    main()
