"""Seconds of what has never run, from its size, which is known before there is a mesh."""

import math

import numpy as np

from studies.base.errors import StudyError
from studies.geometry.organs import make_shape
from studies.reference.reference_solves import ReferenceSolve
from studies.runs.case import Case
from studies.scene.scene import Scene

SECONDS_PER_UNKNOWN = 2e-3
"""Of a load path, [s]: the median of 51 reference solutions of the catalogue with 10,832 to 89,683 unknowns, on two
cores of an AMD EPYC (family 25, model 17) that did other work too; each is within a factor of seven of it."""
SECONDS_PER_UNKNOWN_STEP = 4e-4
"""Of a motion, for each time step [s]: a fifth of a load path, which has five checkpoints; not measured."""
OCTANT, OCTANT_ORDER = 176.5, 2.14
"""Unknowns of an octant times this power of its element size over the radius: 3,153 at 0.26 and 16,482 at 0.12."""
STEP = {"surface": 0.40, "membrane": 0.40, "tetrahedral": 0.30, "quadratic": 0.23}
"""Stability limit over size √(rho/mu) / √n of a body with n surface nodes: medians of results/published, as are all
numbers from here on (426 cases; the organ's size is the diagonal of its box)."""
BY_MASS, HOLLOW_STEP, GRADED_STEP = {"lumped": 1.0, "stiffness": 1.8, "heavy": 5.0}, 0.6, 0.7
"""Factors on the limit: masses, a wall, elements that are halved."""
MICROSECONDS = {"surface": 0.04, "membrane": 0.04, "tetrahedral": 0.06, "quadratic": 0.4}
"""Of a step, per surface node, with one volume or with one per vertex of a quadratic body."""
BY_VOLUMES = {"nodal": 0.5, "patches": 0.5, "regions": 0.13}
"""The same of a tetrahedral body with more volumes."""
BY_METHOD = {
    "implicit_elements": 45.0,
    "implicit_springs": 16.0,
    "linear_modes": 3.6,
    "elastic_response": 1.7,
    "chain_mail": 1.0,
    "xpbd": 0.5,
    "element": 0.4,
}
"""The same of methods that take longer than the body alone tells."""
MOST_PER_NODE = 6.5
"""Unknowns of a reference on a whole organ of n surface nodes, over n^1.5. No scene of the catalogue has more."""
MESH, GRADED_MESH = 3.0, 10.0
"""Seconds for the mesh and the body of a case."""
MARGIN = 1.2
"""Box of an organ over the extent of its surface."""


def unknowns(solve: ReferenceSolve) -> float:
    """About how many unknowns the finest mesh of a reference will have, rather too many."""
    plan = solve.scene.reference
    assert plan is not None  # a reference belongs to a plan
    if plan.nested:
        return plan.most
    finest = plan.levels[-1]
    return OCTANT / finest**OCTANT_ORDER if plan.mesh == "octant" else MOST_PER_NODE * finest**1.5


def solve_seconds(solve: ReferenceSolve) -> float:
    """Of a reference, all its meshes."""
    dt = solve.scene.reference and solve.scene.reference.dt
    each = SECONDS_PER_UNKNOWN if dt is None else SECONDS_PER_UNKNOWN_STEP * solve.scene.duration / dt
    return unknowns(solve) * each


def case_seconds(case: Case) -> float:
    """Of a run with its mesh. One whose organ cannot be read fails before its first step."""
    mesh = GRADED_MESH if case.body.graded else MESH
    try:
        return mesh + run_seconds(case)
    except StudyError:
        return mesh


def timing_seconds(case: Case) -> float:
    """Of measuring the frame times of a case that runs: none of one whose organ cannot be read."""
    from studies.metrics.timing.cases import BUDGET, REPEATS  # with pandas

    try:
        once = run_seconds(case)
    except StudyError:
        return 0.0
    return once * min(max(BUDGET / once, 1.0), REPEATS)


def run_seconds(case: Case) -> float:
    """Of all steps of a run, each at the median cost of its kind. Raises StudyError for an organ that is not read."""
    scene, body = case.scene, case.body
    wave = math.sqrt(scene.tissue.shear_modulus * body.stiffness / scene.tissue.density)
    limit = STEP[body.kind] * organ_size(scene) / math.sqrt(body.nodes) / wave
    limit *= BY_MASS[body.mass]
    limit *= HOLLOW_STEP if scene.lumen is not None and body.kind != "surface" else 1.0
    limit *= GRADED_STEP if body.graded else 1.0
    dt = case.dt_fraction * limit if case.dt == "auto" else float(case.dt)
    steps = max(scene.duration / dt, case.frames or scene.frames)
    usual = BY_VOLUMES.get(body.volumes, MICROSECONDS[body.kind]) if body.kind == "tetrahedral" else None
    return 1e-6 * steps * body.nodes * BY_METHOD.get(case.method.name, usual or MICROSECONDS[body.kind])


def organ_size(scene: Scene) -> float:
    """Diagonal of the box around an organ [m]. Raises StudyError."""
    if scene.organ.shape != "file":
        return make_shape(scene.organ.shape, scene.organ.parameters).size
    from studies.scene.checks import surface_of  # with the readers of meshes

    return MARGIN * float(np.linalg.norm(np.ptp(surface_of(scene.organ, scene.name)[0], axis=0)))
