"""Hashes of the code that made published results: recorded at publication, and compared with the present code by
`organbench publish --check`."""

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from massspring.sources import source_fingerprint
from studies.base.atomic import write_whole
from studies.base.errors import StudyError
from studies.catalog.study import Chart, Study
from studies.metrics.table import metric
from studies.reference.published import fingerprint_of
from studies.runs.case import Case
from studies.runs.current import case_fingerprint
from studies.runs.user_code import file_of

FILE = "code.json"
"""In the published folder: name -> hash of the code that made it."""
CURRENT, STALE, UNKNOWN = "current", "stale", "unknown"


@dataclass(frozen=True)
class Finding:
    """Whether the present code would make the same."""

    name: str
    """Of a file or folder below the published one, or of a block of a page."""
    status: str
    words: str = ""
    """What to do."""


def study_code(study: Study) -> str:
    """Hash of what the table of a study is made by and of: its cases, the code that runs, judges and measures them, and
    their references."""
    metrics = [metric(column) for column in study.columns]
    files = [file.sha256 for file in map(file_of, (one.of for one in metrics)) if file is not None]
    return _digest([*_runs(study), *files, source_fingerprint("studies.metrics.table"), *(one.name for one in metrics)])


def chart_code(study: Study, chart: Chart) -> str:
    """The same of a chart: of the runs, and the code that draws them."""
    drawing, file = chart.drawing, file_of(chart.drawing)
    module = drawing.partition(":")[0] if isinstance(drawing, str) else drawing.__module__
    return _digest([*_runs(study), source_fingerprint(module) if file is None else file.sha256])


def _runs(study: Study) -> list[str]:
    cases = [text for case in study.cases for text in (_key(case), case_fingerprint(case))]
    return cases + [fingerprint_of(scene) for scene in study.scenes]


def text_code(study: Study, text: Callable) -> str:
    """The same of a text for people that the function `text` reads off the runs of `study`."""
    return _digest([source_fingerprint(text.__module__), study_code(study)])


def scenes_code(studies: Sequence[Study], module: str) -> str:
    """The same of a table over the references of all scenes of `studies`, written by `module`."""
    scenes = {scene.name: scene for study in studies for scene in study.scenes}
    return _digest([source_fingerprint(module), *map(fingerprint_of, scenes.values())])


def studies_code(studies: Sequence[Study], module: str) -> str:
    """The same of a table over the runs of all `studies`."""
    return _digest([source_fingerprint(module), *map(study_code, studies)])


def _key(case: Case) -> str:
    """The key of a case, its vectors to six decimals (a micrometre): the place of a probe on a random organ is computed
    from the surface, and its last bits depend on the processor."""
    return json.dumps(_rounded(json.loads(case.key)), sort_keys=True, ensure_ascii=False)


def _rounded(value: object) -> object:
    if isinstance(value, dict):
        return {key: _rounded(inner) for key, inner in value.items()}
    if isinstance(value, list):
        vector = len(value) == 3 and all(isinstance(inner, float) for inner in value)
        return [round(inner, 6) + 0.0 if vector else _rounded(inner) for inner in value]  # 0.0 turns -0.0 into 0.0
    return value


def _digest(parts: Iterable[str]) -> str:
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()


def noted(published: Path) -> dict[str, str]:
    """Name -> hash, as noted in the published folder. Raises StudyError for a note that cannot be read."""
    path = published / FILE
    if not path.is_file():
        return {}
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        return {str(name): str(code) for name, code in data.items()}
    except (OSError, ValueError, AttributeError) as error:
        raise StudyError(f"{path} cannot be read ({error}); restore it from git") from error


def note(published: Path, new: Mapping[str, str]) -> Path:
    """Notes by which code these names were made; those that are no longer there are forgotten. Where the note lies."""
    codes = {name: code for name, code in noted(published).items() if (published / name).exists()}
    text = json.dumps(dict(sorted((codes | dict(new)).items())), indent=1) + "\n"
    write_whole(published / FILE, text.encode())
    return published / FILE


def compared(published: Path, makers: Mapping[str, tuple[Callable[[], str], str]]) -> list[Finding]:
    """What is published, name by name. makers: the hash of the present code, and the command that makes it again."""
    codes, findings = noted(published), []
    for name, (code, command) in makers.items():
        if not (published / name).exists():
            continue
        if name not in codes:
            findings.append(Finding(name, UNKNOWN, f"published before its code was noted; {command}, then publish it"))
        elif codes[name] == code():
            findings.append(Finding(name, CURRENT))
        else:
            findings.append(Finding(name, STALE, f"other code made it; {command}, then publish it"))
    return findings
