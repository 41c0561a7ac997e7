"""The quick hash of a case is the hash of its key, whatever its settings are."""

from dataclasses import dataclass, fields, replace
from typing import ClassVar

import pytest

from massspring import Free, ImplicitVolume
from studies.exchange.entry import outside
from studies.runs import digest
from studies.runs.case import BodyRecipe, Case, case_to_dict
from studies.runs.digest import Remembered, case_digest
from studies.scenes import BALL_CLAMPED
from studies.store.paths import key_digest, key_hash
from tests.studies.tiny import SQUEEZE, tiny_case

OTHER = {
    "scene": BALL_CLAMPED,
    "body": BodyRecipe("surface", 60, weights=(1, 0.5, 0.5, 1)),
    "method": Free(),
    "dt": 0.001,
    "dt_fraction": 1 / 3,
    "frames": 7,
    "beyond_limit": True,
    "precision": "float32",
    "recorded": ("kinetic", "surface"),
    "timed": True,
}
"""Of every setting one that the tiny case does not have."""


@pytest.mark.parametrize("name", OTHER)
def test_it_is_the_hash_of_the_key(name):
    assert set(OTHER) == {field.name for field in fields(Case)}
    case = tiny_case(**{name: OTHER[name]})
    assert case_digest(case) == key_digest(case.key)
    assert case_digest(case)[:8] == key_hash(case.key)
    assert (case_digest(case) == case_digest(tiny_case())) == (name == "timed")


def test_equal_numbers_of_other_types_are_other_cases():
    """1 and 1.0 are equal, and other text in the key."""
    one, other = (tiny_case(body=BodyRecipe("tetrahedral", 60, stiffness=factor)) for factor in (1, 1.0))
    assert one == other
    assert case_digest(one) != case_digest(other)
    assert [case_digest(case) for case in (one, other)] == [key_digest(case.key) for case in (one, other)]


def test_what_cases_share_is_written_once(monkeypatch):
    written = []
    monkeypatch.setattr(digest, "case_to_dict", lambda case: written.append(case) or case_to_dict(case))
    scene = replace(SQUEEZE, title="another")
    cases = [Case(scene, BodyRecipe(nodes=77), ImplicitVolume(), dt_fraction=0.1 + 0.01 * k) for k in range(20)]
    assert len({case_digest(case) for case in cases}) == 20
    assert len(written) == 1


def test_a_method_that_cannot_be_pickled_is_hashed_too():
    case = tiny_case(method=outside("theirs"))
    assert case_digest(case) == key_digest(case.key)


def test_what_was_said_of_an_object_that_is_gone_is_not_said_of_the_next():
    @dataclass
    class Thing:
        kind: ClassVar[str] = "thing"
        number: int

    said = Remembered[Thing, int](lambda thing: thing.number)
    assert [said(Thing(number)) for number in range(50)] == list(range(50))
    assert not said.known
