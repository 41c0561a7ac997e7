"""Middles drawn to outlines make what a plane presses, and what hangs, more accurate, on organs that the catalogue does
not hold."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import Plane, Trajectory
from studies.geometry import LIVER_PRESS_DIRECTION, SHAPES, vary
from studies.lab.population.draw import Population
from studies.meshing import graded_mesh
from studies.meshing.scene_mesh import mesh_for
from studies.metrics.metrics import mean_error
from studies.metrics.run import Run
from studies.reference.load import Reference
from studies.reference.reference_solves import ReferenceSolve
from studies.reference.solve import solve
from studies.runs.case import Case
from studies.runs.recipes import QuadraticBody
from studies.runs.run import measure
from studies.scene.library.spleen_sag import SPLEEN_SAG
from studies.scene.placing import press_times, scaled
from studies.scene.scene import ForceOutput, Held, Organ, ReferencePlan, Scene
from studies.store.record import Record, Status, read_record

GAP, DEPTH, PRESS_END, DURATION = 0.0012, 0.018, 6.0, 8.0
"""Of the plane [m], and its clock [s], as in liver_press."""


def pressed(member: int) -> Scene:
    """A liver of the population, pressed from the front."""
    scene, inward = Population("liver", 40).scenes()[member], LIVER_PRESS_DIRECTION
    front = float((mesh_for(scene, 550).points @ np.array(inward)).min())
    path = Trajectory((0.0, PRESS_END), ((0.0, 0.0, 0.0), scaled(inward, DEPTH + GAP)))
    return replace(
        scene,
        obstacles=(Plane(scaled(inward, front - GAP), inward, path),),
        probed=ForceOutput("obstacle", 0, inward),
        duration=DURATION,
        checkpoints=press_times(0.0, PRESS_END, 4, DURATION),
        damping=2.0,
        reference=ReferencePlan(base=360, at_contact=0, variants=()),
    )


def last_force(scene: Scene, record: Record) -> float:
    """At the last checkpoint [N]."""
    return float(scene.output_force(*(record.fields[n].values for n in ("contact_force", "held_force")))[-1])


@pytest.mark.campaign
@pytest.mark.parametrize("member", [1, 3])
def test_a_liver_nobody_has_seen(member, mesh_cache, tmp_path, monkeypatch):
    """Against a reference of its own (docs/accuracy.md)."""
    scene = pressed(member)
    truth = last_force(scene, read_record(solve(tmp_path, ReferenceSolve(scene))))
    body = QuadraticBody(794, graded=True, mass="stiffness")

    def error() -> float:
        return abs(last_force(scene, measure(Case(scene, body, dt_fraction=0.8))) / truth - 1)

    drawn_error = error()
    monkeypatch.setattr(graded_mesh, "middles", lambda scene: 0.5)
    assert drawn_error < 0.03 and drawn_error < 0.5 * error()


@pytest.mark.campaign
@pytest.mark.parametrize("seed", [1, 3])
def test_a_spleen_nobody_has_seen_hangs(seed, mesh_cache, tmp_path, monkeypatch):
    """Against a reference of its own (docs/accuracy.md)."""
    shape = vary("spleen", seed)
    scene = replace(
        SPLEEN_SAG,
        name=f"spleen_{seed}",
        organ=Organ("spleen", shape),
        held=(Held("hilum", SHAPES["spleen"](**shape).regions["hilum"]),),
        reference=ReferencePlan(base=400, variants=()),
    )
    truth = Reference(scene, read_record(solve(tmp_path, ReferenceSolve(scene))))
    case = Case(scene, QuadraticBody(994, graded=True, mass="stiffness"), dt_fraction=0.8)

    def error() -> float:
        record = measure(case)
        assert record.status == Status.OK, record.message
        return mean_error(Run(case, record, truth))

    drawn_error = error()
    monkeypatch.setattr(graded_mesh, "middles", lambda scene: 0.5)
    assert drawn_error < 1.7 and drawn_error < 0.6 * error()
