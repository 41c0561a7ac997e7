"""Packs studies: records, tables, charts and the code that draws them, in a zip file that says what it holds."""

import hashlib
import json
import mimetypes
import os
import platform
import shutil
import zipfile
from collections.abc import Iterable, Sequence
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, distribution, requires
from importlib.metadata import version as installed_version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from rocrate.model import ContextEntity
from rocrate.rocrate import ROCrate

import studies as package
from massspring.sources import OWN, ROOT
from studies.base.atomic import is_there, part_beside, unwritten
from studies.base.errors import StudyError
from studies.catalog.study import Study, command_line
from studies.exchange.entry import entry_files
from studies.metrics.timing.cases import timing_file
from studies.reference.reference_solves import STUDY as REFERENCES
from studies.reference.reference_solves import reference_solves
from studies.report.results import make_folder, refresh, report
from studies.runs.current import case_path
from studies.runs.user_code import files_of
from studies.store.archived import MANIFEST, check_no_archive
from studies.store.ledger import Ledger
from studies.store.links import link_study
from studies.store.paths import record_files
from studies.sweep.frame_times import timed_jobs
from studies.sweep.standings import standings

SUFFIX = ".zip"
CITATION, DISTRIBUTION = "CITATION.cff", "organbench"
CODE = "code"
"""Folder with the sources; it is described as a whole."""
README = """# Results of organbench {version}: {names}

Nothing in here has to be computed again. Unpack it; the folder is a results folder like any other:

    sha256sum -c {manifest}                    is every file as it was packed?
    organbench archive --check .               the same, by organbench
    organbench report {first} --results .        draws the charts and the table again, from the records
    organbench table {first} --results .       a row per case

Without organbench: Python with the packages of constraints.txt (`pip install -r constraints.txt`), and the sources in
the folder `code`: `PYTHONPATH=code python -m studies report {first} --results .`

`ro-crate-metadata.json` describes each file, `machine.json` the machine, `CITATION.cff` how to cite.
"""


def stored_studies(root: Path, catalogue: Sequence[Study]) -> tuple[list[Study], list[str]]:
    """The studies of which something is stored, and the folders of `root` with records of others: their cases are in a
    file of the user. Raises StudyError where there are none of the first."""
    chosen = [study for study in catalogue if any(is_there(case_path(root, study.name, case)) for case in study.cases)]
    names = {REFERENCES, *(study.name for study in catalogue)}
    folders = sorted(root.iterdir()) if root.is_dir() else []
    others = [folder.name for folder in folders if folder.name not in names and record_files(root, folder.name)]
    if not chosen and others:
        raise StudyError(f"in {root} only studies of files are stored ({', '.join(others)}); name them: FILE.py")
    if not chosen:
        raise StudyError(f"nothing is stored in {root}: `organbench run` makes results, --results names their folder")
    return chosen, others


def pack(
    root: Path, studies: Sequence[Study], target: Path, day: str, extra: Iterable[Path] = ()
) -> tuple[int, list[str]]:
    """Packs studies of `root` into the zip file `target`; tables and charts are drawn from the packed records.

    day: of the archive, YYYY-MM-DD; extra: further files, such as a study's own. The number of files with a checksum,
    and sentences on what report.html had no room for, or cannot show. Raises StudyError when a record or a frame time
    is missing, damaged or stale, and when the file cannot be written.
    """
    if target.suffix != SUFFIX:
        raise StudyError(f"the name of an archive ends in {SUFFIX}, not '{target.name}'; give -o FILE{SUFFIX}")
    check_no_archive(root)
    check_current(Ledger(root), studies)
    make_folder(target.parent)
    own = [file.path for study in studies for case in study.cases for file in files_of(case)]
    try:
        with TemporaryDirectory(dir=target.parent, prefix=f"{target.stem}-") as place:
            stage = Path(place) / "results"  # as commands in report.html name it
            remarks = gather(root, studies, stage)
            for path in (*extra, *own):
                bring(path, stage / path.name)
            describe(stage, studies, day)
            files = files_below(stage)
            write_zip(stage, files, target, day)
    except OSError as problem:  # of what is gathered: the zip itself is there whole or not at all
        raise StudyError(unwritten(target, problem)) from problem
    return len(files) - 1, remarks


def check_current(ledger: Ledger, studies: Sequence[Study]) -> None:
    """Raises StudyError when a piece of a study is missing or stale, a timing of this machine too."""
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
            f"not archived: {first}" + (f", and {count - 1} more are missing or stale" if count > 1 else "") + "; "
            f"run `{command_line('run', [study for study in studies if study.name in behind])}` first"
        )


def gather(root: Path, studies: Sequence[Study], stage: Path) -> list[str]:
    """Records of studies, their references and external entries, and what is drawn from them; what report.html had
    no room for, in sentences. Raises StudyError when a record is missing."""
    stage.mkdir()
    ledger = Ledger(stage)
    for study in studies:
        paths = [case_path(root, study.name, case) for case in study.cases]
        paths += [timing_file(root, study.name, case) for case in study.cases if case.timed]
        paths += [solve.path(root) for scene in study.scenes for solve in reference_solves(scene)]
        for path in [*paths, *entry_files(root)]:
            bring(path, stage / path.relative_to(root))
        ledger.look_again()
        link_study(ledger, study.name)
        missing = refresh(ledger, study)[1]
        if missing:
            raise StudyError(f"not archived, something is missing: {study.name}: {missing[0]}")
    remarks = report(ledger, studies)[1]
    shutil.rmtree(stage / "cache")
    return remarks


def bring(source: Path, target: Path) -> None:
    """A hard link to the file if the disk allows it, else a copy; nothing if the file does not exist."""
    if target.exists() or not is_there(source):
        return
    target.parent.mkdir(parents=True, exist_ok=True)
    try:
        os.link(source, target)
    except OSError:  # another disk, or one without links
        shutil.copyfile(source, target)


def describe(stage: Path, studies: Sequence[Study], day: str) -> None:
    """Adds the code, how to cite and to read, what each file is, and its checksum."""
    for name in OWN:
        shutil.copytree(ROOT / name, stage / CODE / name, ignore=shutil.ignore_patterns("__pycache__"))
    names = [study.name for study in studies]
    first = Path(studies[0].word).name or names[0]
    page = README.format(version=package.__version__, names=", ".join(names), first=first, manifest=MANIFEST)
    (stage / "README.md").write_text(page, encoding="utf-8")
    bring(citation_file(), stage / CITATION)
    (stage / "constraints.txt").write_text(pins(), encoding="utf-8")
    write_crate(stage, studies, day)
    lines = [f"{digest(path)}  {path.relative_to(stage).as_posix()}\n" for path in files_below(stage)]
    (stage / MANIFEST).write_text("".join(lines), encoding="utf-8")


def write_crate(folder: Path, studies: Sequence[Study], day: str) -> None:
    """RO-Crate metadata (https://www.researchobject.org/ro-crate/specification/1.1): what each file below a folder is;
    day: of the archive, YYYY-MM-DD. Raises StudyError without CITATION.cff."""
    about, crate = citation(), ROCrate(version="1.1")
    crate.name = f"organbench results: {', '.join(study.name for study in studies)}"
    crate.description = " ".join([about["abstract"], *(study.question for study in studies)])
    page = {"@type": "CreativeWork", "name": about["license"]}
    crate.license = crate.add(ContextEntity(crate, f"https://spdx.org/licenses/{about['license']}", page))
    authors = {"@type": "Organization", "name": about["authors"][0]["name"]}
    crate.root_dataset["author"] = crate.add(ContextEntity(crate, "#authors", authors))
    crate.datePublished = day
    words = {"name": f"Sources of organbench {package.__version__}", "description": "PYTHONPATH=code python -m studies"}
    crate.add_dataset(dest_path=CODE, properties=words)
    for path in files_below(folder):
        name = path.relative_to(folder)
        if name.parts[0] != CODE:
            form = mimetypes.guess_type(name)[0] or "application/octet-stream"
            size = {"contentSize": str(path.stat().st_size), "sha256": digest(path)}
            crate.add_file(path, name.as_posix(), properties={"name": name.stem, "encodingFormat": form} | size)
    crate.metadata.write(folder)


def files_below(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.is_file())


def digest(path: Path) -> str:
    """SHA-256 of a file, in hex."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def citation() -> dict[str, Any]:
    """What CITATION.cff says: each line is "name: JSON", which is YAML. Raises StudyError where it is missing."""
    lines = citation_file().read_text(encoding="utf-8").splitlines()
    return {name: json.loads(value) for name, _, value in (line.partition(": ") for line in lines)}


def citation_file() -> Path:
    """CITATION.cff of the checkout, of the archive whose code runs, or of the installed package.

    Raises StudyError where it is in none of them.
    """
    places = [ROOT / CITATION, ROOT.parent / CITATION]
    with suppress(PackageNotFoundError):  # the code of an archive
        places += [Path(str(file.locate())) for file in distribution(DISTRIBUTION).files or [] if file.name == CITATION]
    for place in places:
        if place.is_file():
            return place
    raise StudyError(f"{CITATION} is missing: install organbench again")


def write_zip(stage: Path, files: Sequence[Path], target: Path, day: str) -> None:
    """The files as a zip, whole or not at all; equal files on one day are equal bytes."""
    year, month, date = map(int, day.split("-"))
    with part_beside(target) as part, zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in files:
            entry = zipfile.ZipInfo(path.relative_to(stage).as_posix(), (year, month, date, 0, 0, 0))
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            with archive.open(entry, "w", force_zip64=True) as written, open(path, "rb") as read:
                shutil.copyfileobj(read, written, 1 << 20)


def pins() -> str:
    """A line for each package that organbench requires, directly or not, with the version that is installed, as pip's
    `-c` option reads them. Packages of other platforms, or replaced by the user, have none."""
    versions, queue = dict[str, str](), [DISTRIBUTION]
    while queue:
        name = canonicalize_name(queue.pop())
        with suppress(PackageNotFoundError):
            if name not in versions:
                versions[name] = installed_version(name)
                needs = map(Requirement, requires(name) or [])
                queue += [one.name for one in needs if one.marker is None or one.marker.evaluate({"extra": ""})]
    head = f"# organbench {versions.pop(DISTRIBUTION, 'of the folder code')}, Python {platform.python_version()}"
    return "\n".join([head, *(f"{name}=={versions[name]}" for name in sorted(versions)), ""])
