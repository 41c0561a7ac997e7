"""The stored fields of an equilibrium path."""

import numpy as np

from reference_fem import Equilibrium, Moment, nodes
from studies.reference.nested import FamilySolution
from studies.reference.problem import whole_forces
from studies.reference.sample import mean_pressure, sample_fields
from studies.scene.scene import Scene
from studies.store.record import Field, new_fields
from studies.store.schema import REFERENCE_FIELDS


def fields_of(scene: Scene, solution: FamilySolution) -> dict[str, Field]:
    """The equilibria at the checkpoints, one row each, NaN for checkpoints that the path did not reach; and the
    samples."""
    problem, equilibria = solution.problem, solution.equilibria
    x, tetrahedra = nodes(problem.mesh), problem.mesh.t.T.astype(np.int64)
    lengths = {"K": len(scene.checkpoints), "o": len(scene.obstacles), "g": len(problem.held), "n": len(x)}

    def row(e: Equilibrium) -> dict[str, np.ndarray | float]:
        return {
            "contact_force": whole_forces(scene, e.obstacle_force[None])[0],
            "held_force": e.held_force,
            "volume": e.volume / e.volume0,
            "pressure": mean_pressure(problem, e),
            "lumen_pressure": float(e.cavity_pressure.sum()) if scene.filled else np.nan,
            "min_j": e.min_J,
            "max_j": e.max_J,
            "penetration": e.penetration,
            "newton": float(e.newton_iterations),
            "energy": e.energy,
            "kinetic": _of_motion(e, "kinetic"),
            "balance": _of_motion(e, "balance"),
            "displacement": e.u,
        }

    rows = [row(e) for e in equilibria]
    values = {"t": np.array(scene.checkpoints), "nodes": x, "tetrahedra": tetrahedra}
    values |= sample_fields(solution.at, solution.samples, len(scene.checkpoints))
    for name in REFERENCE_FIELDS.keys() - values.keys():
        if REFERENCE_FIELDS[name].optional:
            continue
        shape = REFERENCE_FIELDS[name].shape.split()
        values[name] = np.full([lengths[part] if part in lengths else int(part) for part in shape], np.nan)
        for k, reached in enumerate(rows):
            values[name][k] = reached[name]
    return new_fields(REFERENCE_FIELDS, {name: values[name] for name in REFERENCE_FIELDS if name in values})


def _of_motion(equilibrium: Equilibrium, name: str) -> float:
    return getattr(equilibrium, name) if isinstance(equilibrium, Moment) else np.nan
