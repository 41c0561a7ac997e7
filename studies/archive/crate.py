"""RO-Crate metadata of an archive (https://www.researchobject.org/ro-crate/specification/1.1): what each file is."""

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from studies.archive.citation import ABSTRACT, AUTHORS, LICENSE
from studies.catalog.study import Study, command_line
from studies.store.archived import CRATE
from studies.store.paths import study_folder

CONTEXT = "https://w3id.org/ro/crate/1.1"
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
    "CITATION.cff": "How to cite organbench and the paper that it measures",
    "README.md": "How to look at the archive and to draw its charts again",
    "constraints.txt": "Versions of all packages that the results were made with",
    "kept_volume.csv": "How well each run kept its volumes",
    "machine.json": "Processor, system and versions of the machine that measured",
    "report.html": "The results on one page, without a network",
}
Entity = dict[str, Any]


def write_crate(folder: Path, studies: Sequence[Study], version: str, day: str) -> None:
    """Describes all files below a folder; day: of the archive, YYYY-MM-DD."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    plain = [path for path in files if path.relative_to(folder).parts[0] != CODE]
    entities = [_file(folder, path) for path in plain]
    parts = [*entities, _code(version)]
    graph = [_descriptor(), _root(studies, day, parts), *parts, _software(version), _authors(), _licence()]
    graph += [_action(folder, study, entities) for study in studies]
    text = json.dumps({"@context": f"{CONTEXT}/context", "@graph": graph}, indent=1, ensure_ascii=False)
    (folder / CRATE).write_text(text + "\n", encoding="utf-8")


def digest(path: Path) -> str:
    """SHA-256 of a file, in hex."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _descriptor() -> Entity:
    return {
        "@id": CRATE,
        "@type": "CreativeWork",
        "conformsTo": {"@id": CONTEXT},
        "about": {"@id": "./"},
    }


def _root(studies: Sequence[Study], day: str, parts: Sequence[Entity]) -> Entity:
    names = ", ".join(study.name for study in studies)
    return {
        "@id": "./",
        "@type": "Dataset",
        "name": f"organbench results: {names}",
        "description": " ".join([ABSTRACT, *(study.question for study in studies)]),
        "datePublished": day,
        "license": {"@id": f"https://spdx.org/licenses/{LICENSE}"},
        "author": {"@id": "#authors"},
        "hasPart": [{"@id": part["@id"]} for part in parts],
        "mentions": [{"@id": _action_id(study)} for study in studies],
    }


def _file(folder: Path, path: Path) -> Entity:
    name = path.relative_to(folder).as_posix()
    return {
        "@id": name,
        "@type": "File",
        "name": WORDS.get(name, path.stem),
        "encodingFormat": FORMATS.get(path.suffix, "application/octet-stream"),
        "contentSize": str(path.stat().st_size),
        "sha256": digest(path),
    }


def _code(version: str) -> Entity:
    return {
        "@id": f"{CODE}/",
        "@type": "Dataset",
        "name": f"Sources of organbench {version}",
        "description": "The three packages that made the results: PYTHONPATH=code python -m studies",
    }


def _software(version: str) -> Entity:
    return {"@id": "#organbench", "@type": "SoftwareApplication", "name": "organbench", "softwareVersion": version}


def _authors() -> Entity:
    return {"@id": "#authors", "@type": "Organization", "name": AUTHORS}


def _licence() -> Entity:
    return {
        "@id": f"https://spdx.org/licenses/{LICENSE}",
        "@type": "CreativeWork",
        "name": "BSD 3-Clause Licence",
        "identifier": LICENSE,
    }


def _action_id(study: Study) -> str:
    return f"#run-{study.name}"


def _action(folder: Path, study: Study, files: Sequence[Entity]) -> Entity:
    """Which files a study's run gave."""
    home = study_folder(folder, study.name).relative_to(folder).as_posix() + "/"
    return {
        "@id": _action_id(study),
        "@type": "CreateAction",
        "name": command_line("run", [study], elsewhere=True),
        "description": study.question,
        "instrument": {"@id": "#organbench"},
        "result": [{"@id": file["@id"]} for file in files if file["@id"].startswith(home)],
    }
