"""RO-Crate metadata of an archive (https://www.researchobject.org/ro-crate/specification/1.1): what each file is."""

import hashlib
import json
from collections.abc import Sequence
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

from rocrate.model import ContextEntity, Entity, File
from rocrate.rocrate import ROCrate

from massspring.sources import ROOT
from studies.base.errors import StudyError
from studies.catalog.study import Study, command_line
from studies.store.paths import study_folder

CRATE_VERSION = "1.1"
CITATION = "CITATION.cff"
DISTRIBUTION = "organbench"
CODE = "code"
"""Folder with the sources; it is described as a whole."""
FORMATS = {
    ".cff": "application/yaml",
    ".csv": "text/csv",
    ".h5": "application/x-hdf5",
    ".html": "text/html",
    ".js": "text/javascript",
    ".json": "application/json",
    ".md": "text/markdown",
    ".png": "image/png",
    ".py": "text/x-python",
    ".txt": "text/plain",
}
WORDS = {
    CITATION: "How to cite organbench and the paper that it measures",
    "README.md": "How to look at the archive and to draw its charts again",
    "constraints.txt": "Versions of all packages that the results were made with",
    "kept_volume.csv": "How well each run kept its volumes",
    "machine.json": "Processor, system and versions of the machine that measured",
    "report.html": "The results on one page, without a network",
}


def write_crate(folder: Path, studies: Sequence[Study], version: str, day: str) -> None:
    """Describes all files below a folder; day: of the archive, YYYY-MM-DD. Raises StudyError without CITATION.cff."""
    about = citation()
    crate = ROCrate(version=CRATE_VERSION)
    authors = _add(crate, "#authors", "Organization", name=about["authors"][0]["name"])
    program = _add(crate, "#organbench", "SoftwareApplication", name=about["title"], softwareVersion=version)
    page = f"https://spdx.org/licenses/{about['license']}"
    licence = _add(crate, page, "CreativeWork", name=about["license"], identifier=about["license"])
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    names = [path.relative_to(folder) for path in files]
    parts = {name: _file(crate, folder, name) for name in names if name.parts[0] != CODE}
    crate.add(*parts.values())
    description = "The three packages that made the results: PYTHONPATH=code python -m studies"
    crate.add_dataset(
        dest_path=CODE, properties={"name": f"Sources of organbench {version}", "description": description}
    )
    for study in studies:
        home = study_folder(folder, study.name).relative_to(folder)
        action = _add(
            crate,
            f"#run-{study.name}",
            "CreateAction",
            name=command_line("run", [study], elsewhere=True),
            description=study.question,
            instrument=program,
            result=[part for name, part in parts.items() if name.is_relative_to(home)],
        )
        crate.root_dataset.append_to("mentions", action)
    crate.name = f"organbench results: {', '.join(study.name for study in studies)}"
    crate.description = " ".join([about["abstract"], *(study.question for study in studies)])
    crate.datePublished, crate.license = day, licence
    crate.root_dataset["author"] = authors
    crate.metadata.write(folder)


def citation() -> dict[str, Any]:
    """What CITATION.cff says. Raises StudyError where it is missing."""
    lines = citation_file().read_text(encoding="utf-8").splitlines()
    # Each line is "name: JSON", which is YAML.
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


def digest(path: Path) -> str:
    """SHA-256 of a file, in hex."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _add(crate: ROCrate, number: str, kind: str, **properties: Any) -> Entity:
    entity = ContextEntity(crate, number, {"@type": kind, **properties})
    crate.add(entity)
    return entity


def _file(crate: ROCrate, folder: Path, name: Path) -> File:
    path = folder / name
    properties = {
        "name": WORDS.get(name.as_posix(), name.stem),
        "encodingFormat": FORMATS.get(name.suffix, "application/octet-stream"),
        "contentSize": str(path.stat().st_size),
        "sha256": digest(path),
    }
    return File(crate, path, name.as_posix(), properties=properties)
