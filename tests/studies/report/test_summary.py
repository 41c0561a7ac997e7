"""Tables for README and docs: the recommended body, its numbers, and the mark of one that misses the target."""

from dataclasses import replace

import numpy as np
import pytest

from massspring.body.quadratic import boundary_facets, parts_of_facets
from studies.meshing.true_surface import ShapeErrors
from studies.metrics.timing.protocol import FrameTiming
from studies.report.summary import ladder_of, recommended_of
from studies.runs.recipes import QuadraticBody, SurfaceBody
from studies.scene.library.spleen_sag import SPLEEN_SAG
from studies.store.record import Status
from tests.massspring.quadratic import second_order
from tests.studies import made_up_run
from tests.studies.tiny import cube

PAPER = SurfaceBody(550)
EVEN = QuadraticBody(594, mass="stiffness")
GRADED = QuadraticBody(794, graded=True, mass="stiffness")
DEVIATION = {PAPER: -0.7, EVEN: -0.02, GRADED: 0.01}
FRAME_NS = {PAPER: 1e7, EVEN: 1e8, GRADED: 5e8}
FLOORS = 0.001
KEPT = ShapeErrors(0.0042, -0.0013)


def six_node_parts():
    """Surface triangles of the cube as quadratic tetrahedra, numbered as POINTS."""
    points, cells = second_order(*cube(1, made_up_run.EDGE)[::2])
    number = np.linalg.norm(made_up_run.POINTS - points[:, None], axis=2).argmin(axis=1)
    return number[parts_of_facets(boundary_facets(cells))]


def run(body, deviation, *, uncertainty=FLOORS, shape=KEPT, cpu=None, **changes):
    """A body whose force is off by `deviation` and whose displacement is right; a frame is a second."""
    truth = made_up_run.reference()
    truth.total_uncertainty = dict.fromkeys(truth.total_uncertainty, uncertainty)
    force = np.array([0.5, 1.0, 1.5, 2.0]) * (1.0 + deviation)
    values = {"triangles": six_node_parts()} if body.kind == "quadratic" else {}
    made = made_up_run.run(force=force, reference=truth, attributes={"volumes": 7}, values=values, **changes)
    times = np.full((3, 4), FRAME_NS[body])
    timing = FrameTiming(times, cpu_ns=None if cpu is None else cpu * times, processor="" if cpu is None else "Z80")
    made = replace(made, case=replace(made.case, body=body, dt_fraction=0.8), timing=timing)
    vars(made)["shape"] = shape  # a cube is no ball
    return made


def runs(**changes):
    return [run(body, deviation, **changes) for body, deviation in DEVIATION.items()]


def test_the_cheapest_body_that_suffices_stands_beside_the_papers():
    (row,) = recommended_of(runs()).splitlines()[2:]
    assert row == (
        "| ball_clamped | −70.0 ± 0.1 | 0.0 ± 0.1 "
        "| quadratic, masses by stiffness, 594, 0.8 | −2.0 ± 0.1 | 0.0 ± 0.1 | 0.42 | −0.13 | 10 |"
    )


@pytest.mark.parametrize(("cpu", "cell"), [(0.95, "| 10 (10.5) |"), (0.8, "| 10 (12.5) ¶ |")])
def test_a_time_stands_beside_that_of_the_processor_and_is_marked_where_it_waited(cpu, cell):
    row, *notes = (line for line in recommended_of(runs(cpu=cpu)).splitlines()[2:] if line)
    assert row.endswith(cell) and "Z80" in notes[0] and [note[0] for note in notes[1:]] == ["¶"] * (cpu < 0.9)


@pytest.mark.parametrize(("body", "deviation", "uncertainty"), [(EVEN, -0.05, FLOORS), (GRADED, 0.01, 0.2)])
def test_the_nearest_is_marked_where_none_suffices_or_the_reference_cannot_tell(body, deviation, uncertainty):
    near = run(body, deviation, uncertainty=uncertainty)
    row, note = (line for line in recommended_of([run(PAPER, -0.7), near]).splitlines()[2:] if line)
    assert f"{body.nodes}, 0.8 ‡" in row and note.startswith("‡")


@pytest.mark.parametrize("shape", [ShapeErrors(0.0101, 0.0), ShapeErrors(0.0, -0.0051), ShapeErrors(0.0, 0.0051)])
def test_a_body_that_does_not_keep_the_shape_is_not_recommended(shape):
    """The cheaper one meets the target, but lacks a piece of its organ."""
    short = run(EVEN, -0.02, shape=shape)
    assert "594" not in recommended_of([run(PAPER, -0.7), short, run(GRADED, 0.01)])


def test_a_shape_that_was_not_measured_is_a_dash_and_what_ended_badly_is_not_named():
    unknown = run(EVEN, -0.02, shape=ShapeErrors(np.nan, np.nan))
    (row,) = recommended_of([run(PAPER, -0.7), unknown]).splitlines()[2:]
    assert "594, 0.8 | −2.0 ± 0.1 | 0.0 ± 0.1 | – | – |" in row
    bad = run(EVEN, -0.02, status=Status.INVERTED)
    assert "794" in recommended_of([run(PAPER, -0.7), bad, run(GRADED, 0.01)])
    assert "594" not in ladder_of([bad, run(GRADED, 0.01)])


def test_the_ladder_has_every_body_of_its_scenes_in_order():
    rows = ladder_of(runs()).splitlines()[2:]
    assert [row.split(" | ")[1].split(", ")[-1] for row in rows] == ["550", "594", "794"]
    assert all(" | 7 | 0.8 | " in row for row in rows)
    elsewhere = [replace(one, case=replace(one.case, scene=SPLEEN_SAG)) for one in runs()]
    assert ladder_of(elsewhere).splitlines()[2:] == []
