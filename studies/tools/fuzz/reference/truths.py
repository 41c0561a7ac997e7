"""What must hold in a state that the reference calls converged; measured in plain NumPy from its unknowns."""

from collections.abc import Iterator

import numpy as np
from skfem import ElementTetP2, ElementTriP2
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTri

from reference_fem import Equilibrium
from reference_fem.dynamics.motion_path import Moment
from reference_fem.elements.shapes import basis_table, displacement_table, element_nodes, facet_nodes, nodes
from reference_fem.elements.surface import point_positions
from reference_fem.model.obstacles import gaps
from reference_fem.system.assembly import deformation
from reference_fem.system.saddle_point import System
from reference_fem.system.state import State

ROUND_OFF = 1e-9
"""Of what is summed: far above what double precision leaves on these meshes, far below every tolerance drawn."""
CORNERS = np.vstack((np.zeros(3), np.eye(3), np.full(3, 0.25))).T
"""And the middle."""


def broken(system: System, equilibrium: Equilibrium, state: State | None) -> str | None:
    """The first truth that a state does not meet, as a sentence; None when all hold.

    state: the unknowns behind `equilibrium`; None for a moment of a motion, whose forces do not balance at one instant.
    """
    measured = always(system, equilibrium) if state is None else at_rest(system, equilibrium, state)
    return next((sentence for wrong, sentence in measured if wrong), None)


def always(system: System, equilibrium: Equilibrium) -> Iterator[tuple[bool, str]]:
    """Of a state of rest and of a moment alike."""
    names = ("u", "p", "obstacle_force", "held_force", "reaction", "J", "cavity_pressure", "energy")
    kinetic = equilibrium.kinetic if isinstance(equilibrium, Moment) else 0.0
    for name in (*names, "v", "a") if isinstance(equilibrium, Moment) else names:
        yield not np.isfinite(getattr(equilibrium, name)).all(), f"'{name}' has a number that is not finite"
    yield (
        not equilibrium.J.min() > 0.0,
        f"the least volume ratio is {equilibrium.J.min():.3g} where the elements are integrated",
    )
    least = -ROUND_OFF * system.problem.material.mu * system.volume
    yield min(equilibrium.energy, kinetic) < least, f"the energies are {equilibrium.energy:.3g} and {kinetic:.3g} J"
    inside = enclosed(system, equilibrium.u)
    off = abs(equilibrium.volume / inside - 1.0) if inside is not None else 0.0
    yield off > ROUND_OFF, f"the reported volume differs by {off:.3g} from the volume of the surface"


def at_rest(system: System, equilibrium: Equilibrium, state: State) -> Iterator[tuple[bool, str]]:
    """Of an equilibrium: all of that, and its balance, its volume and its depth in the obstacles."""
    yield from always(system, equilibrium)
    off, allowed = unbalanced(system, equilibrium, state)
    yield off > allowed, f"forces of {off:.3g} N are out of balance, {allowed:.3g} N allowed"
    off, allowed = unequal(system, equilibrium, state)
    yield off > allowed, f"nodes without contact feel {off:.3g} N, {allowed:.3g} N allowed"
    off, allowed = pressure_gap(system, equilibrium, state), system.settings.volume_tol + ROUND_OFF
    yield off > allowed, f"V/V0 - 1 is {off:.3g} off the mean pressure over kappa, {allowed:.3g} allowed"
    deep, moved = depth(system, state), float(np.abs(state.x[: system.displacement_count]).max())
    allowed = system.settings.penetration_tol * moved + ROUND_OFF * float(np.ptp(system.nodes))
    yield deep > allowed, f"a point lies {deep:.3g} m inside an obstacle, {allowed:.3g} m allowed"


def enclosed(system: System, u: np.ndarray) -> float | None:
    """Volume [m³] inside the deformed surface, by the divergence theorem; None with bubbles, which no rule integrates
    exactly."""
    if system.problem.element == "MINI":
        return None
    where, area = wall(system, u, facet_nodes(system.problem.mesh))
    return float(np.sum(where * area)) / 3.0


def wall(system: System, u: np.ndarray, table: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points of deformed facets (k, 6) and their outward areas, both (k, nq, 3) [m], [m²]."""
    points, weights = get_quadrature(RefTri, 4)
    values, slopes = basis_table(ElementTriP2(), points)
    y = (nodes(system.problem.mesh) + u)[table]
    y_r, y_s = (np.einsum("qa,fai->fqi", slopes[:, k], y) for k in range(2))
    return np.einsum("qa,fai->fqi", values, y), np.cross(y_r, y_s) * weights[:, None]


def sizes(system: System, equilibrium: Equilibrium) -> float:
    """The forces at work [N], that the tolerance of forces is a share of."""
    weight = system.problem.density * system.volume * np.linalg.norm(np.asarray(system.problem.gravity))
    area = np.sum(np.linalg.norm(wall(system, equilibrium.u, facet_nodes(system.problem.mesh))[1], axis=-1))
    filled = np.abs(equilibrium.cavity_pressure).sum() * area
    floor = ROUND_OFF * system.problem.material.mu * system.volume ** (2.0 / 3.0)
    at_work = (np.linalg.norm(equilibrium.reaction), np.abs(equilibrium.obstacle_force).sum(), weight, filled, floor)
    return float(max(at_work))


def unbalanced(system: System, equilibrium: Equilibrium, state: State) -> tuple[float, float]:
    """(|contact + held + weight| [N], what the tolerance allows); a lumen pushes on nothing else than the body.

    Of a body cut at planes of symmetry only the weight and the obstacles count across a lumen's open side: there the
    resultant is that of `unequal`.
    """
    if system.lumens:
        return 0.0, 0.0
    weight = state.load * system.problem.density * system.volume * np.asarray(system.problem.gravity)
    total = equilibrium.obstacle_force.sum(axis=0) + equilibrium.held_force.sum(axis=0) + weight
    free = np.sqrt(system.displacement_count)
    allowed = free * system.settings.force_tol * sizes(system, equilibrium) + _noise(system, state)
    return float(np.linalg.norm(total)), allowed


def _noise(system: System, state: State) -> float:
    """Round-off of the stresses, summed over the body [N]."""
    stress = _stress(system, state)
    return 1e-13 * float(np.abs(stress).max()) * system.volume ** (2.0 / 3.0) * len(system.nodes)


def _stress(system: System, state: State) -> np.ndarray:
    return system.problem.material.stress(*deformation(state.x, system.elements, system.problem.material.kappa))


def unequal(system: System, equilibrium: Equilibrium, state: State) -> tuple[float, float]:
    """(norm of internal force and weight at free unknowns that no obstacle and no lumen touches [N], allowed)."""
    mesh, gradients = system.problem.mesh, system.elements.gradients
    table = displacement_table(mesh, system.element)
    local = np.einsum("eq,eqir,eqra->eai", system.elements.weights, _stress(system, state), gradients)
    force = np.zeros_like(system.nodes)
    np.add.at(force, table.ravel(), -local.reshape(-1, 3))
    force += system.force_at(state.t, state.load)[: force.size].reshape(-1, 3)
    quiet = np.zeros(system.field_count, dtype=bool)
    quiet[system.pattern.free[system.pattern.free < system.field_count]] = True
    quiet = quiet[: force.size].reshape(-1, 3)
    quiet[_touched(system, state)] = False
    off = float(np.linalg.norm(force[quiet]))
    return off, system.settings.force_tol * sizes(system, equilibrium) + _noise(system, state)


def _touched(system: System, state: State) -> np.ndarray:
    """Numbers of the nodes on facets that an obstacle or a lumen may press."""
    count = system.surface.dofs.shape[1] // 3
    table = system.surface.dofs[:, :count].astype(np.int64) // 3
    pressed = np.zeros(len(table), dtype=bool)
    for row in system.obstacles_at(state.t):
        near = 2.0 * system.settings.penetration_tol * np.abs(state.x[: system.displacement_count]).max()
        pressed |= (gaps(row, point_positions(state.x, system.surface)) <= near).any(axis=1)
    pressed |= (state.multiplier > 0.0).any(axis=(0, 2))
    for lumen in system.lumens:
        pressed |= np.isin(table, lumen.wall.dofs // 3).all(axis=1)
    return np.unique(table[pressed])


def pressure_gap(system: System, equilibrium: Equilibrium, state: State) -> float:
    """How far V/V0 - 1, from the surface where it can be, is off the mean of p / kappa."""
    inside = enclosed(system, equilibrium.u)
    volume = equilibrium.volume if inside is None else inside
    _, p = deformation(state.x, system.elements, system.problem.material.kappa)
    mean = float(np.sum(system.elements.weights * p)) / system.volume
    return abs(volume / system.volume - 1.0 - mean / system.problem.material.kappa)


def depth(system: System, state: State) -> float:
    """Deepest point of the surface inside an obstacle [m]."""
    y = point_positions(state.x, system.surface)
    return max((-float(gaps(row, y).min()) for row in system.obstacles_at(state.t)), default=0.0)


def corner_ratio(system: System, u: np.ndarray) -> tuple[float, float]:
    """(least volume ratio at the corners of the elements, where none is integrated; how far from flat they are there at
    rest, over the element's middle: not above 0 where the mesh itself is folded)."""
    mesh = system.problem.mesh
    _, shape = basis_table(ElementTetP2(), CORNERS)
    table, rest = element_nodes(mesh), nodes(mesh)
    now, before = (np.linalg.det(np.einsum("eni,qJn->eqiJ", x[table], shape)) for x in (rest + u, rest))
    middle = before[:, -1:]
    return float(np.min(now / before)), float(np.min(before / middle))
