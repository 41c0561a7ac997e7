"""The hash of a case for studies of very many: what they share is written as JSON once."""

import hashlib
import json
import pickle
import weakref
from collections.abc import Callable
from functools import lru_cache
from typing import Any, Generic, NamedTuple, TypeVar

from studies.runs.case import Case, case_to_dict
from studies.scene.scene import Scene
from studies.store.paths import key_digest
from studies.store.record import canonical

T = TypeVar("T")
V = TypeVar("V")
MOST = 100_000
"""Numbers that are remembered, and bodies and methods."""


class Remembered(Generic[T, V]):
    """A function of an object, called once in the life of that very object."""

    def __init__(self, of: Callable[[T], V]) -> None:
        self.of = of
        self.known: dict[int, tuple[weakref.ref[T], V]] = {}

    def __call__(self, thing: T) -> V:
        """What the function gives for `thing`."""
        found = self.known.get(id(thing))
        return self.set(thing, self.of(thing)) if found is None else found[1]

    def set(self, thing: T, value: V) -> V:
        """What it will say of `thing`."""
        number, known = id(thing), self.known
        known[number] = weakref.ref(thing, lambda _: known.pop(number, None)), value
        return value


class Parts(NamedTuple):
    """What tells two cases apart beside numbers: equal parts are equal settings of equal types (1 is not 1.0)."""

    scene: int
    """Its id: valid while it lives."""
    body: tuple[type, bytes]
    method: tuple[type, bytes]


def parts_of(case: Case) -> Parts | None:
    """None for a method with settings that cannot be pickled."""
    try:
        return Parts(id(case.scene), _settings(case.body), _settings(case.method))
    except (pickle.PicklingError, AttributeError, TypeError):
        return None


def _settings(thing: object) -> tuple[type, bytes]:
    return type(thing), pickle.dumps(tuple(vars(thing).values()))


def _digest(case: Case) -> str:
    parts = parts_of(case)
    if parts is None:
        return key_digest(case.key)
    scene, body, method = _texts(case, parts)
    chosen = "" if case.precision == "float64" else f'"precision":{_json(case.precision)},'
    if case.recorded:
        chosen += f'"recorded":{_json(case.recorded)},'
    text = (
        f'{{"beyond_limit":{_json(case.beyond_limit)},"body":{body},"dt":{_json(case.dt)},'
        f'"dt_fraction":{_json(case.dt_fraction)},"frames":{_json(case.frames)},"method":{method},{chosen}"scene":{scene}}}'
    )
    return hashlib.sha256(text.encode()).hexdigest()


case_digest = Remembered(_digest)
"""`studies.store.paths.key_digest` of the key of a case, some thirty times as quick."""
_scenes = Remembered[Scene, str](lambda scene: "")
_others: dict[tuple[type, bytes], str] = {}


def _texts(case: Case, parts: Parts) -> tuple[str, str, str]:
    """Canonical JSON of scene, body and method."""
    found = _scenes(case.scene), _others.get(parts.body), _others.get(parts.method)
    if not all(found):
        if len(_others) > MOST:
            _others.clear()
        data = case_to_dict(case)
        _scenes.set(case.scene, _canonical(data["scene"]))
        _others[parts.body], _others[parts.method] = _canonical(data["body"]), _canonical(data["method"])
        return _texts(case, parts)
    return found  # pyright: ignore[reportReturnType]


def _canonical(part: Any) -> str:
    return canonical(json.dumps(part, sort_keys=True, ensure_ascii=False))


@lru_cache(MOST, typed=True)
def _json(value: Any) -> str:
    return canonical(json.dumps(value))
