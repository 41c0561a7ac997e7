"""References of scenes judged by another code on meshes of its own, where the extra `crosscheck` is installed.

A ball and its load are bodies of revolution, so NGSolve solves a meridian of third order; an organ it solves in three
dimensions, at third order as well. Mesh, elements, solver and contact are not the reference's. What is left is the bar
of the reference and the judge's own change.
"""

from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import KDTree

from reference_fem import NeoHookean, crosscheck
from reference_fem.crosscheck.meridian import Ball, MeridianMesh, MeridianSolution, between_planes, clamped_caps
from reference_fem.crosscheck.solid import SolidSolution, solve_solid
from reference_fem.oracles import Check, Oracle, Outcome
from studies.reference.load import Reference, load_reference
from studies.reference.reference_solves import reference_fingerprint, reference_solves
from studies.reference.solve import solve
from studies.scene.library import BALL_CLAMPED, BALL_INCISED, BALL_SQUEEZE, LIVER_PRESS
from studies.scene.library.ball_clamped import CAP
from studies.scene.scene import Scene
from studies.store.entry import why_stale
from studies.tools.verify.judge_mesh import JudgeMesh, judged_problem

TOGETHER = 1e-6
"""Of the size: two vertices so near are copies of one; a published reference is rounded."""


@dataclass(frozen=True, eq=False)
class OrganSolution:
    """An organ at the end of its scene."""

    scene: Scene
    solid: SolidSolution

    @property
    def force(self) -> np.ndarray:
        """The probed force at the end, (1,) [N]."""
        return self.scene.output_force(self.solid.obstacle_force[None], self.solid.held_force[None])

    @property
    def mesh(self) -> Any:
        """NGSolve's."""
        return self.solid.mesh

    def displacement(self, points: np.ndarray) -> np.ndarray:
        """(n, 3) [m] at rest points (n, 3) [m], about the middle between the held regions; of a place on a cut that
        behind it."""
        cut, displacements = self.scene.cut, np.empty_like(points)
        sides = np.zeros(len(points), bool) if cut is None else cut.plane.level(points) > 0
        for front in np.unique(sides):
            displacements[sides == front] = self._on_side(points[sides == front], front)
        return centred(self.scene, displacements)

    def opening(self, points: np.ndarray) -> np.ndarray:
        """Displacement in front of the scene's cut less that behind it, (n, 3) [m], at `points` (n, 3) [m] of it."""
        return self._on_side(points, True) - self._on_side(points, False)

    def _on_side(self, points: np.ndarray, front: bool) -> np.ndarray:
        """Displacement at points (n, 3) [m] of the body in front of the cut, or behind it; without one all is."""
        if self.scene.cut is None:
            return self.solid.displacement(points)
        mesh = self.solid.problem.mesh
        middles = mesh.p[:, mesh.t[:4]].mean(axis=1).T
        return self.solid.displacement(points, (self.scene.cut.plane.level(middles) > 0) == front)


Solution = MeridianSolution | OrganSolution


@dataclass(frozen=True)
class Judge:
    """A scene, how the other code solves it, and its two meshes, coarse and fine."""

    scene: Scene
    answer: Callable[[Any], Solution]
    coarse: MeridianMesh | JudgeMesh
    fine: MeridianMesh | JudgeMesh
    body: str = "meridian"
    elements: str = "triangles"


def ball_of(scene: Scene) -> Ball:
    """Its radius and material as the reference has them."""
    tissue = scene.tissue
    material = NeoHookean(tissue.shear_modulus, tissue.shear_modulus * tissue.bulk_over_shear)
    return Ball(float(scene.organ.parameters["radius"]), material)


def halves(pushes: list[float]) -> list[float]:
    """Each step in two: every second one is a checkpoint of the scene."""
    between = [(a + b) / 2 for a, b in zip([0.0, *pushes[:-1]], pushes, strict=True)]
    return [push for pair in zip(between, pushes, strict=True) for push in pair]


def clamped(mesh: MeridianMesh) -> MeridianSolution:
    """ball_clamped: one cap goes in, which is half of it for each about the ball's middle."""
    pushes = [-0.5 * float(BALL_CLAMPED.held[1].path(t)[2]) for t in moving(BALL_CLAMPED, BALL_CLAMPED.held[1].path)]
    return clamped_caps(ball_of(BALL_CLAMPED), CAP, halves(pushes), mesh)


def squeezed(mesh: MeridianMesh) -> MeridianSolution:
    """ball_squeeze."""
    path = BALL_SQUEEZE.obstacles[0].path
    pushes = [-float(path(t)[2]) for t in moving(BALL_SQUEEZE, path)]
    return between_planes(ball_of(BALL_SQUEEZE), halves(pushes), mesh)


def pressed_liver(mesh: JudgeMesh) -> OrganSolution:
    """liver_press, in two steps: without friction the end does not depend on the way."""
    times = LIVER_PRESS.checkpoints
    return OrganSolution(LIVER_PRESS, solve_solid(judged_problem(LIVER_PRESS, mesh), times[2::2]))


def moving(scene: Scene, path: Callable) -> list[float]:
    """Checkpoints [s] up to the first at which nothing moves any more: later ones are the same equilibrium."""
    last = np.linalg.norm(path(scene.checkpoints[-1]))
    before = [t for t in scene.checkpoints if np.linalg.norm(path(t)) < last * (1 - 1e-9)]
    return [*before, scene.checkpoints[-1]]


def incised_ball(mesh: JudgeMesh) -> OrganSolution:
    """ball_incised, opened from the start: the tissue has no memory."""
    return OrganSolution(BALL_INCISED, solve_solid(judged_problem(BALL_INCISED, mesh), BALL_INCISED.checkpoints))


JUDGES = (
    Judge(BALL_SQUEEZE, squeezed, MeridianMesh(0.14, 0), MeridianMesh(0.1, 0)),
    Judge(BALL_CLAMPED, clamped, MeridianMesh(0.2, 4), MeridianMesh(0.1, 4)),
    Judge(LIVER_PRESS, pressed_liver, JudgeMesh(330, 2), JudgeMesh(550, 3), "solid", "tetrahedra"),
    Judge(BALL_INCISED, incised_ball, JudgeMesh(120, 1), JudgeMesh(200, 2), "solid", "tetrahedra"),
)


def second_judges(root: Path) -> tuple[Oracle, ...]:
    """One oracle to a scene; it solves what is missing of the reference below `root`. Empty without NGSolve."""
    if not crosscheck.available():
        return ()

    def oracle(judge: Judge) -> Oracle:
        name, title = f"judge_{judge.scene.name}", f"{judge.scene.name}, second judge"
        source = f"NGSolve {version('ngsolve')}, {judge.body} of third order on its own mesh"
        return Oracle(name, title, source, lambda: verdict(judge, reference_of(root, judge.scene)), fast=False)

    return tuple(oracle(judge) for judge in JUDGES)


def reference_of(root: Path, scene: Scene) -> Reference:
    """The stored reference, after solving what is missing or stale. Raises StudyError where a path broke off."""
    for reference_solve in reference_solves(scene):
        if why_stale(reference_solve.path(root), reference_solve.key, reference_fingerprint()) is not None:
            solve(root, reference_solve)
    reference = load_reference(root, scene)
    assert reference is not None  # the scene has a plan
    return reference


def verdict(judge: Judge, reference: Reference) -> Outcome:
    """The numbers of the reference and of the judge; allowed is the reference's bar and the judge's change."""
    coarse, fine = judge.answer(judge.coarse), judge.answer(judge.fine)
    assert judge.scene.reference is not None  # it has been solved
    what = f"{fine.mesh.ne} {judge.elements} of third order"
    place = f"{judge.scene.name}, {len(reference.meshes)} meshes against {what}"
    count, bars = int(reference.record.attributes["unknowns"]), reference.total_uncertainty
    ours, theirs = reference.force[-1], fine.force[-1]
    change = abs(coarse.force[-1] / theirs - 1)
    checks = [Check("force_end", "N", theirs, float(ours), bars["force_end"] + change, place, count)]
    if "surface_mean" in bars:
        apart, own = surface_mean(reference, fine), surface_mean(reference, fine, coarse)
        allowed = bars["surface_mean"] + own
        checks.append(Check("mean distance of surfaces", "1", 0.0, apart, allowed, place, count, absolute=True))
    if isinstance(fine, OrganSolution) and isinstance(coarse, OrganSolution) and judge.scene.cut is not None:
        apart, own = openings_apart(reference, fine, coarse)
        checks.append(
            Check("distance of openings", "1", 0.0, apart, bars["opening"] + own, place, count, absolute=True)
        )
    return Outcome(tuple(checks))


def openings_apart(reference: Reference, fine: OrganSolution, coarse: OrganSolution) -> tuple[float, float]:
    """Relative L2 of the opening of a cut between the reference and the fine judge, and between the two judges [1], at
    the vertices of the reference's coarsest mesh that the cut parts."""
    count, vertices = len(reference.at.points), reference.mesh.p.T[: reference.mesh.nvertices]
    pairs = KDTree(vertices).query_pairs(TOGETHER * reference.size, output_type="ndarray")
    first = np.unique(pairs.min(axis=1))
    places = vertices[first[first < count]]
    ours, theirs = reference.meshes[0].opening, fine.opening(places)
    change = coarse.opening(places) - theirs
    size = float(np.linalg.norm(theirs))
    return float(np.linalg.norm(ours - theirs)) / size, float(np.linalg.norm(change)) / size


def surface_mean(reference: Reference, judge: Solution, other: Solution | None = None) -> float:
    """Area-weighted mean distance of surface points of the reference and of the judge, over the largest displacement
    [1]; of the judge and the other judge where one is given."""
    at = reference.at
    on = at.areas > 0
    points, weights = at.points[on], at.areas[on] / at.areas.sum()
    moved = reference.displacement(at.points)[on]
    size = np.linalg.norm(moved, axis=1).max()
    theirs = judge.displacement(points)
    if other is not None:
        return float(weights @ np.linalg.norm(other.displacement(points) - theirs, axis=1) / size)
    return float(weights @ np.linalg.norm(centred(reference.scene, moved) - theirs, axis=1) / size)


def centred(scene: Scene, moved: np.ndarray) -> np.ndarray:
    """Displacements (n, 3) [m] about the middle between the held regions: where the judge of a ball has
    its plane of symmetry."""
    end = scene.checkpoints[-1]
    return moved - np.mean([held.path(end) for held in scene.held], axis=0)
