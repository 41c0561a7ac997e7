"""A study by name: of the catalogue, or of a Python file of the user."""

import math
import warnings
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.catalog import STUDIES, Study
from studies.catalog.demo import DEMO
from studies.catalog.of_scene import BODIES, bodies
from studies.runs.case import Case, case_from_json, case_to_dict
from studies.scene.clock import check_clock
from studies.sweep.find_scene import SUFFIX, read_user_file

ON = "@"
"""Between the name of a study and a folder of surfaces: "accuracy@meshes", or "accuracy@meshes:mm"."""
MOVED = {"population": "studies/lab/population/study.py"}
"""Studies that were in the catalogue."""
NO_CASE = "the text is not a stored case: "
"""How `case_from_json` begins; of a case that was never stored these words say nothing."""
FEWEST = 4
"""Nodes of a body: those of a tetrahedron."""
MAIN = "main"
"""Stands for the main studies of the catalogue; no study has this name."""


def find_study(name: str) -> Study:
    """A study of the catalogue, or that of a Python file (STUDY, else one of SCENE); either on a folder of surfaces,
    where ON and one follow.

    Warns of files in the folder that are repaired or refused. Raises StudyError, for whatever is wrong with the file.
    """
    if ON in name:
        return _on_folder(*name.split(ON, 1))
    if not name.endswith(SUFFIX):
        return catalogue_study(name)
    study = replace(read_user_file(name).as_study, word=name)
    file = Path(name).name
    if not study.cases:
        raise StudyError(f"{file}: the study '{study.name}' has no cases; give at least one")
    if any(study.name == other.name and study.cases != other.cases for other in (*STUDIES, DEMO)):
        raise StudyError(f"{file}: '{study.name}' is a study of the program; give yours a name of its own")
    for scene in study.scenes:
        check_clock(scene, f"{file}: ")
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Pydantic serializer warnings")  # the sentence for an odd setting is ours
        for case in study.cases:
            _check_stored(name, case)
    by_key = sorted(study.cases, key=lambda case: case.key)
    double = next((one for one, other in pairwise(by_key) if one.key == other.key), None)
    if double is not None:
        raise StudyError(f"{file}: the case {double.name} of scene '{double.scene.name}' is there twice; leave one out")
    return study


def _on_folder(name: str, given: str) -> Study:
    from studies.catalog.folder import study_on  # with the geometry of scans, which takes a while to load

    folder, _, unit = given.partition(":") if not Path(given).is_dir() else (given, "", "")
    study = bodies() if name == BODIES else find_study(name)
    study, placed = study_on(study, Path(folder), unit or None)
    for one in placed:
        sentence = "; ".join(one.words)
        if sentence:
            warnings.warn(sentence if one.scene else f"{one.path.name} is refused: {sentence}", stacklevel=2)
    return replace(study, word=f"{name}{ON}{given}")


def catalogue_study(name: str) -> Study:
    """A study of the catalogue by name. Raises StudyError with the nearest name, and for one that is a file now."""
    if name in MOVED:
        raise StudyError(f"the study '{name}' is a file of a clone: {MOVED[name]}")
    return lookup(name, {study.name: study for study in (*STUDIES, DEMO)}, "study")


def find_studies(names: Sequence[str]) -> list[Study]:
    """The studies of so many names; the main ones of the catalogue for none, and for the name "main"."""
    groups = [[s for s in STUDIES if s.main] if name == MAIN else [find_study(name)] for name in names or [MAIN]]
    return [study for group in groups for study in group]


def _check_stored(name: str, case: Case) -> None:
    """Raises StudyError for a case that would not come back from its record as it is, with the first odd setting."""
    which = f"{Path(name).name}: scene '{case.scene.name}', case {case.name}"
    _check_settings(which, case)
    try:
        back = case_from_json(case.key)
        odd = _difference(case_to_dict(case.replaced(timed=False)), case_to_dict(back))
    except StudyError as error:
        raise StudyError(f"{which}: {str(error).removeprefix(NO_CASE)}; correct this setting") from error
    except Exception as error:  # a setting of a user may be anything
        raise StudyError(f"{which}: a setting is neither a number, a text nor a tuple of these ({error})") from error
    if odd is not None or back != case.replaced(timed=False):
        odd = odd or "a setting cannot be stored and read back; use the project's own types"
        raise StudyError(f"{which}: {odd}")
    if not case.name.isprintable():
        raise StudyError(f"{name}: case {case.name!r} has a name with characters that cannot be printed; rename it")


def _check_settings(which: str, case: Case) -> None:
    """Raises StudyError for settings of a body or a cut for which storing gives no error, or no clear one."""
    if not isinstance(case.scene.cuts, tuple):
        raise StudyError(f"{which}: scene.cuts is no tuple; write (Cut(...),)")
    for cut in case.scene.cuts:
        if not cut.name or not cut.name.isprintable():
            raise StudyError(f"{which}: a cut has the name {cut.name!r}; give it one")
    nodes, graded = case.body.nodes, case.body.graded
    if type(nodes) is int and nodes < FEWEST:
        raise StudyError(f"{which}: body.nodes is {nodes}; give a whole number from {FEWEST} on")
    if isinstance(graded, str) and graded != "adaptive":
        raise StudyError(f"{which}: body.graded is {graded!r}; give False, True or 'adaptive'")
    if case.body.cut != "conforming" and not case.scene.cuts:
        raise StudyError(f"{which}: body.cut is {case.body.cut!r}, and the scene has no cut; leave it out")


def _difference(given: Any, back: Any, where: str = "") -> str | None:
    """What is wrong with the first setting that is another after it was stored; None when none is."""
    if isinstance(given, float) and not math.isfinite(given) and given != back:
        return f"{where} is {given}; give a finite number"
    if isinstance(given, dict) and isinstance(back, dict):
        pairs = [(f"{where}.{key}" if where else key, value, back.get(key)) for key, value in given.items()]
    elif isinstance(given, list | tuple) and isinstance(back, list | tuple) and len(given) == len(back):
        pairs = [(f"{where}[{k}]", a, b) for k, (a, b) in enumerate(zip(given, back, strict=True))]
    else:
        if type(given) is int and type(back) is float:
            return f"{where} is the whole number {given}; write {float(given)}"
        same = type(given) is type(back) and given == back
        return None if same else f"{where} = {given!r} cannot be stored and read back; use the project's own types"
    return next((odd for odd in (_difference(a, b, path) for path, a, b in pairs) if odd), None)
