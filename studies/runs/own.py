"""Methods and stiffness laws of a user's own, beside METHODS and LAWS; they live as long as the process."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from types import ModuleType
from typing import TypeGuard

import numpy as np

from massspring import LITERATURE, METHODS, Body, Method
from massspring.body.laws import Edges, StiffnessLaw, laws_by_name
from massspring.body.membranes import MEMBRANE_LAWS
from massspring.body.smoothed import SMOOTHED
from studies.base.errors import StudyError
from studies.base.own_file import OwnFile, file_of

_METHODS: dict[str, type[Method]] = {}
_LAWS: dict[str, StiffnessLaw] = {}


def methods_by_name() -> dict[str, type[Method]]:
    """METHODS, LITERATURE and those of the user's files."""
    return {method.name: method for method in (*METHODS, *LITERATURE)} | _METHODS


def own_laws() -> Mapping[str, StiffnessLaw]:
    """The laws of the user's files, by name."""
    return _LAWS


def law_names() -> tuple[str, ...]:
    """All that a recipe may name: those of the project and of the user's files."""
    return (*laws_by_name(), *SMOOTHED, *MEMBRANE_LAWS, *_LAWS)


def own_law(law: StiffnessLaw) -> str:
    """Makes a law known to recipes; its name: `BodyRecipe(law=own_law(StiffnessLaw(bars)))`.

    Raises StudyError for what is no law, for a name that another law has, and for a law that is written in no file.
    """
    if not isinstance(law, StiffnessLaw):
        raise StudyError(f"a law is {law!r}; give a StiffnessLaw, as StiffnessLaw(function)")
    file = file_of(law.stiffness)
    if file is None:
        raise StudyError(f"law '{law.name}' is written in no file; write its function in a FILE.py")
    project = (*laws_by_name(), *SMOOTHED, *MEMBRANE_LAWS)
    before = _LAWS.get(law.name)
    _check_free("law", law.name, project, file, before and file_of(before.stiffness))
    _LAWS[law.name] = law
    return law.name


def add_methods(module: ModuleType) -> None:
    """Makes the methods known that a user's module defines or imports. Raises StudyError for a name that is taken."""
    for value in filter(_is_method, list(vars(module).values())):
        file = file_of(value)
        if file is not None:
            before = _METHODS.get(value.name)
            project = [method.name for method in (*METHODS, *LITERATURE)]
            _check_free("method", value.name, project, file, before and file_of(before))
            _METHODS[value.name] = value


def _is_method(value: object) -> TypeGuard[type[Method]]:
    return isinstance(value, type) and Method in value.__mro__ and value is not Method


def _check_free(noun: str, name: str, project: Iterable[str], file: OwnFile, before: OwnFile | None) -> None:
    """Raises StudyError for a name that the project or another file has."""
    if name in project:
        raise StudyError(f"{noun} '{name}' is one of the project's own; give yours another name")
    if before is not None and before.path != file.path:
        raise StudyError(f"{noun} '{name}' is defined in {before.path} and in {file.path}; rename one of them")


def files_of(method: Method, law: str) -> tuple[OwnFile, ...]:
    """The files of the user that a method and the law of this name are in, each once."""
    things = [type(method), *([_LAWS[law].stiffness] if law in _LAWS else [])]
    found = [file for file in map(file_of, things) if file is not None]
    return tuple({file.path: file for file in found}.values())


def forget() -> None:
    """Takes all of them away again."""
    _METHODS.clear()
    _LAWS.clear()


def sprung_by(body: Body, law: StiffnessLaw, mu: float) -> Body:
    """A tetrahedral body with the springs of a law of one's own; mu [Pa] of its tissue. Raises StudyError for
    stiffnesses that are not one finite number per edge."""
    edges = Edges(body.rest, body.tetrahedra)
    stiffness = np.ascontiguousarray(law.stiffness(edges, mu), dtype=np.float64)
    if stiffness.shape != edges.length.shape or not np.isfinite(stiffness).all():
        raise StudyError(
            f"law '{law.name}' gives stiffnesses of shape {stiffness.shape}, {(~np.isfinite(stiffness)).sum()} of them "
            f"not finite; give one number [N/m] for each of {len(edges.length)} edges"
        )
    length = edges.length if law.rest_length else np.zeros(len(stiffness))
    springs = replace(body.springs, rest_length=length, stiffness=stiffness)
    return replace(body, springs=springs, law=law.name, rest_pressure=0.0 if law.rest_length else mu)
