"""Tables of a population: what is rigid in an error, the worst members, and how often two meshes name a bad one."""

from dataclasses import replace

import numpy as np
import pytest

from studies.metrics.trust import judgements, tally
from studies.report.population import members_of, rigid_share, trust_of, worst_of
from studies.runs.case import Case
from studies.runs.recipes import QuadraticBody
from studies.store.record import Status
from tests.studies.made_up_run import POINTS, SCENE, bend, run

FINE = QuadraticBody(1594, graded="adaptive")
COARSE = replace(FINE, nodes=1194)


@pytest.fixture(autouse=True)
def flat_facets(monkeypatch):
    monkeypatch.setattr("studies.metrics.run.six_node_facets", lambda triangles: triangles)


def member(number, body, motion, force=2.0, status=Status.OK):
    """A member of a population; the force of its reference is 2 N."""
    values = {"snapshots": np.stack([POINTS, POINTS + motion(POINTS)])}
    made = run(force=force * np.array([0.25, 0.5, 0.75, 1.0]), values=values, status=status)
    return replace(made, case=Case(replace(SCENE, name=f"liver_0_{number:03d}"), body))


def shifted(x):
    return bend(x) + np.array([0.0, 6e-3, 0.0])


def turned(x):
    return bend(x) + np.cross([0.0, 1e-3, 2e-3], x - x.mean(axis=0))


def squeezed(x):
    return bend(x) + 2e-3 * (x - x.mean(axis=0)) * [1.0, 0.0, 0.0]


@pytest.mark.parametrize(("motion", "share"), [(shifted, 100.0), (turned, 100.0), (squeezed, 0.0)])
def test_a_rigid_motion_explains_itself_and_nothing_of_a_strain(motion, share):
    assert rigid_share(member(0, FINE, motion)) == pytest.approx(share, abs=0.2)  # triangles lean one way


def test_half_of_a_mixed_error_is_rigid():
    """A shift and a strain that are orthogonal and of equal square mean."""
    alone = member(0, FINE, squeezed).boundary_errors
    size = np.sqrt(np.average((alone.wrong**2).sum(axis=1), weights=alone.areas))
    both = member(0, FINE, lambda x: squeezed(x) + np.array([0.0, 0.0, size]))
    assert rigid_share(both) == pytest.approx(50.0, abs=0.2)


def bad_and_good():
    """Members 0 and 1: both meshes right; 2: far apart and wrong; 3: alike and wrong; 4: apart, the finer right."""
    pairs = [(2.0, 2.0), (2.0, 2.0), (2.6, 2.3), (2.3, 2.3), (2.3, 2.0)]
    return [
        member(number, body, bend, force)
        for number, forces in enumerate(pairs)
        for body, force in zip((COARSE, FINE), forces, strict=True)
    ]


def test_judgements_are_held_against_the_reference():
    verdicts = judgements(bad_and_good())
    assert [one.within for one in verdicts] == [True, True, False, False, True]
    assert [one.trusted for one in verdicts] == [True, True, False, True, False]
    assert tally(verdicts) == (2, 1, 3, 1)


def with_fewer_nodes(runs):
    return [
        replace(one, case=replace(one.case, body=replace(one.case.body, nodes=one.case.body.nodes - 400)))
        for one in runs
    ]


def test_bodies_with_fewer_nodes_are_never_trusted_and_those_that_are_alike_and_wrong_are_counted():
    coarse = with_fewer_nodes(bad_and_good())
    verdicts = judgements(coarse)
    assert not any(one.trusted for one in verdicts)
    assert [one.alike for one in verdicts] == [True, True, False, True, False]
    assert trust_of(coarse).splitlines()[-1] == "| all | – | – | – | – | 2, 1 |"


def test_where_nothing_is_compared_nothing_is_judged():
    runs = [
        replace(one, case=replace(one.case, scene=replace(one.case.scene, quantities=("volume",))))
        for one in bad_and_good()
    ]
    assert judgements(runs) == []


def test_the_members_on_which_the_rule_was_chosen_are_counted_apart():
    runs = [*bad_and_good(), *(member(30, body, bend, force) for body, force in ((COARSE, 2.6), (FINE, 2.3)))]
    assert trust_of(runs).splitlines()[2:] == [
        "| liver | 2, 1 | 3, 1 | 1, 1 | 0, 0 | – |",
        "| all | 2, 1 | 3, 1 | 1, 1 | 0, 0 | – |",
    ]
    assert trust_of(bad_and_good()).splitlines()[-1] == "| all | 2, 1 | 3, 1 | – | – | – |"
    assert "No results" in trust_of([])


def test_the_worst_come_first_and_the_lost_are_named():
    runs = [member(0, FINE, bend), member(1, FINE, shifted), member(2, FINE, bend, status=Status.INVERTED)]
    rows = worst_of(runs).splitlines()[2:]
    assert [row.split(" | ")[0] for row in rows] == ["| liver_0_001", "| liver_0_000", "| liver_0_002"]
    assert "| inverted |" in rows[2]


def test_an_organ_without_a_force_has_dashes():
    runs = [member(number, FINE, shifted) for number in range(2)]
    still = [
        replace(one, case=replace(one.case, scene=replace(one.case.scene, quantities=("surface", "volume"))))
        for one in runs
    ]
    (row,) = members_of(still).splitlines()[2:]
    assert "| 2, 0 | – | – | – | 20 (" in row
