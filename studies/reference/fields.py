"""What of an equilibrium path is stored."""

from collections.abc import Sequence

import numpy as np

from reference_fem import Equilibrium, Moment, Problem, nodes
from studies.reference.problem import whole_forces
from studies.scene.scene import Scene
from studies.store.record import Field


def fields_of(scene: Scene, problem: Problem, found: Sequence[Equilibrium]) -> dict[str, Field]:
    """The equilibria at the checkpoints, one row each; NaN where the path did not get there."""
    count = len(scene.checkpoints)
    x, tetrahedra = nodes(problem.mesh), problem.mesh.t.T.astype(np.int64)

    def series(values: list, unit: str, description: str) -> Field:
        shape = np.shape(values[0]) if values else ()
        padded = np.full((count, *shape), np.nan)
        if values:
            padded[: len(values)] = values
        return Field(padded, unit, description)

    contact = [whole_forces(scene, e.obstacle_force[None])[0] for e in found]
    return {
        "t": Field(np.array(scene.checkpoints), "s", "scene time of each equilibrium"),
        "contact_force": series(contact, "N", "force of each obstacle on the body"),
        "held_force": series([e.held_force for e in found], "N", "force of each held region on the body"),
        "volume": series([e.volume / e.volume0 for e in found], "1", "volume over rest volume"),
        "pressure": series(
            [mean_pressure(tetrahedra, e) for e in found], "Pa", "volume mean of the pressure, compression positive"
        ),
        "lumen_pressure": series(
            [float(e.cavity_pressure.sum()) if scene.filled else np.nan for e in found], "Pa", "pressure of the lumen"
        ),
        "min_j": series([e.min_J for e in found], "1", "smallest J at a quadrature point"),
        "max_j": series([e.max_J for e in found], "1", "largest J at a quadrature point"),
        "penetration": series([e.penetration for e in found], "m", "deepest penetration of an obstacle"),
        "newton": series([float(e.newton_iterations) for e in found], "1", "Newton iterations"),
        "energy": series([e.energy for e in found], "J", "strain energy"),
        "kinetic": series([_of_motion(e, "kinetic") for e in found], "J", "kinetic energy; NaN without motion"),
        "balance": series([_of_motion(e, "balance") for e in found], "J", "energy gained by the time steps themselves"),
        "displacement": series([e.u for e in found], "m", "displacement of the second-order nodes"),
        "nodes": Field(x, "m", "rest positions of the second-order nodes"),
        "tetrahedra": Field(tetrahedra, "1", "vertices of each tetrahedron"),
    }


def _of_motion(equilibrium: Equilibrium, name: str) -> float:
    return getattr(equilibrium, name) if isinstance(equilibrium, Moment) else np.nan


def mean_pressure(tetrahedra: np.ndarray, equilibrium: Equilibrium) -> float:
    """Volume mean of −p [Pa]: p of the solver is positive in tension, the multiplier of the springs in compression."""
    volume = equilibrium.weights.sum(axis=1)
    return -float(volume @ equilibrium.p[tetrahedra].mean(axis=1) / volume.sum())
