"""A calibration as a small JSON file: the recipe, how it was fitted and judged, by which code, and a digest."""

import hashlib
import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from studies.base.atomic import write_whole
from studies.base.errors import DamagedFile, OtherVersion, StudyError
from studies.runs.case import BodyRecipe
from studies.store.paths import readable, study_folder
from studies.tools.calibrate.verdict import Compared, Verdict

STUDY = "calibration"
"""Folder below the results: the files, and the records of all runs that were made for them."""
KIND, SCHEMA = "organbench calibration", 1
REMEDY = "`organbench calibrate` makes one"


@dataclass(frozen=True)
class SceneErrors:
    """Errors of one scene without and with a fit [%]; None for what the scene does not compare."""

    scene: str
    fitted: bool
    """Whether the fit was made on it."""
    force: Compared | None
    """force_end, signed."""
    displacement: Compared | None
    """mean_error."""


@dataclass(frozen=True)
class Trial:
    """A fit on some scenes, judged on others."""

    parameters: dict[str, float]
    """Name -> fitted value."""
    errors: tuple[SceneErrors, ...]
    force: Verdict | None
    displacement: Verdict | None
    remarks: tuple[str, ...] = ()

    @property
    def fitted(self) -> tuple[str, ...]:
        """Names of the scenes that it was fitted on."""
        return tuple(errors.scene for errors in self.errors if errors.fitted)


@dataclass(frozen=True)
class Calibration:
    """A recipe fitted on all scenes of an organ, and the trials of such a fit."""

    organ: str
    start: BodyRecipe
    recipe: BodyRecipe
    parameters: dict[str, float]
    """Name -> value in `recipe`."""
    fitted: tuple[str, ...]
    """Names of the scenes that `recipe` was fitted on."""
    verdict: Verdict
    trials: tuple[Trial, ...]
    fingerprint: str
    """Of the code that made the runs (studies.runs.current)."""
    date: str
    """Day it was made, ISO 8601."""
    versions: dict[str, str | None]

    @property
    def name(self) -> str:
        """Organ, kind, nodes, and what else of the body was chosen: "liver-surface-550"."""
        start, usual = self.start, BodyRecipe()
        chosen = [value for value, plain in ((start.law, usual.law), (start.volumes, usual.volumes)) if value != plain]
        return readable("-".join([self.organ, start.kind, str(start.nodes), *chosen]))


def calibration_path(results: Path, calibration: Calibration) -> Path:
    """Where a calibration lies below the results."""
    return study_folder(results, STUDY) / f"{calibration.name}.json"


def write_calibration(results: Path, calibration: Calibration) -> Path:
    """Writes it below the results; where. Raises StudyError when it cannot be written."""
    data = _data(calibration)
    whole = {"kind": KIND, "schema": SCHEMA, "digest": _digest(data), "calibration": data}
    path = calibration_path(results, calibration)
    write_whole(path, (json.dumps(whole, indent=1, ensure_ascii=False) + "\n").encode())
    return path


def read_calibration(path: Path | str) -> Calibration:
    """The calibration in a file. Raises StudyError where there is none; for one that was changed or cut, that another
    version wrote, or that is something else."""
    try:
        whole = json.loads(Path(path).read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise StudyError(f"there is no calibration {path}; {REMEDY}") from error
    except OSError as error:
        raise StudyError(
            f"{path} cannot be read ({error.strerror}); give a file that `organbench calibrate` wrote"
        ) from error
    except ValueError as error:
        raise DamagedFile(f"{path} is damaged or not a calibration ({_first_line(error)}); {REMEDY}") from error
    if not isinstance(whole, dict) or whole.get("kind") != KIND or not isinstance(whole.get("calibration"), dict):
        raise StudyError(f"{path} is JSON, but not a calibration; {REMEDY}")
    if whole.get("schema") != SCHEMA:
        raise OtherVersion(f"{path} was written by another version in another format; {REMEDY}")
    data = whole["calibration"]
    if whole.get("digest") != _digest(data):
        raise DamagedFile(f"{path} was changed after it was written, so it no longer records a fit; {REMEDY}")
    try:
        calibration = _adapter().validate_python(data)
    except ValidationError as error:
        raise OtherVersion(
            f"{path} has content that this version cannot read ({_first_line(error)}); {REMEDY}"
        ) from error
    if _data(calibration) != data:
        raise OtherVersion(f"{path} has settings that this version does not know; {REMEDY}")
    return calibration


def calibrated(path: Path | str) -> BodyRecipe:
    """The fitted recipe in a file that `organbench calibrate` wrote. Raises StudyError as `read_calibration` does."""
    return read_calibration(path).recipe


@cache
def _adapter() -> TypeAdapter[Calibration]:
    return TypeAdapter(Calibration)


def _data(calibration: Calibration) -> dict[str, Any]:
    return _adapter().dump_python(calibration, mode="json")


def _digest(data: Any) -> str:
    """SHA-256 (hex) of the canonical JSON."""
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()


def _first_line(error: Exception) -> str:
    if isinstance(error, ValidationError):
        first = error.errors(include_url=False)[0]
        return f"{'.'.join(str(part) for part in first['loc'])}: {first['msg']}"
    return str(error).split("\n")[0]
