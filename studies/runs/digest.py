"""The hash of a case for studies of very many: what they share is written as JSON once."""

import hashlib
import json
import pickle
import weakref
from collections.abc import Callable
from functools import lru_cache
from typing import Any, Generic, TypeVar

from studies.runs.case import Case, case_to_dict
from studies.store.paths import key_digest
from studies.store.record import canonical

T, V = TypeVar("T"), TypeVar("V")
MOST = 100_000
"""Numbers that are remembered, and bodies and methods."""
APART = ("scene", "body", "method")
"""What cases share. The rest are numbers and words."""


class Remembered(Generic[T, V]):
    """A function of an object, called once in the life of that very object."""

    def __init__(self, of: Callable[[T], V]) -> None:
        self.of = of
        self.known: dict[int, tuple[weakref.ref[T], V]] = {}

    def __call__(self, thing: T) -> V:
        number = id(thing)
        if number not in self.known:
            self.set(thing, self.of(thing))
        return self.known[number][1]

    def set(self, thing: T, value: V) -> None:
        """What it will say of `thing`."""
        number = id(thing)
        self.known[number] = weakref.ref(thing, lambda _: self.known.pop(number, None)), value


def _digest(case: Case) -> str:
    found = _parts(case)
    if found is None:
        return key_digest(case.key)
    scene, body, method = found
    plain = {
        "beyond_limit": case.beyond_limit,
        "body": body,
        "dt": case.dt,
        "dt_fraction": case.dt_fraction,
        "frames": case.frames,
        "method": method,
        "precision": case.precision,
        "recorded": case.recorded,
        "scene": scene,
    }
    if case.precision == "float64":
        del plain["precision"]
    if not case.recorded:
        del plain["recorded"]
    text = ",".join(f'"{name}":{value if name in APART else _json(value)}' for name, value in plain.items())
    return hashlib.sha256(f"{{{text}}}".encode()).hexdigest()


case_digest = Remembered(_digest)
"""`studies.store.paths.key_digest` of the key of a case, some thirty times as quick."""
_scenes = Remembered[Any, str](lambda scene: "")
_others: dict[bytes, str] = {}


def _parts(case: Case) -> tuple[str, str, str] | None:
    """Canonical JSON of what cases share: of the scene by identity, of body and method by what they hold. None for a
    method of a class that was made on the fly."""
    try:  # equal bytes are equal settings of equal types: 1 and 1.0 are different JSON
        body, method = pickle.dumps(case.body), pickle.dumps(case.method)
    except (pickle.PicklingError, AttributeError, TypeError):
        return None
    if not (_scenes(case.scene) and body in _others and method in _others):
        if len(_others) > MOST:
            _others.clear()
        parts = case_to_dict(case)
        _scenes.set(case.scene, _canonical(parts["scene"]))
        _others[body], _others[method] = _canonical(parts["body"]), _canonical(parts["method"])
    return _scenes(case.scene), _others[body], _others[method]


def _canonical(part: Any) -> str:
    return canonical(json.dumps(part, sort_keys=True, ensure_ascii=False))


@lru_cache(MOST, typed=True)
def _json(value: Any) -> str:
    return canonical(json.dumps(value))
