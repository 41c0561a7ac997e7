"""Homogeneous states, in which any mesh is exact: a block pulled and squeezed along one axis, its sides free; and one
whose whole boundary moves affinely."""

import numpy as np
from skfem import MeshTet

from reference_fem import exact
from reference_fem.elements.shapes import nodes
from reference_fem.model.material import Material, MooneyRivlin, NeoHookean
from reference_fem.model.problem import PrescribedDisplacement, Problem
from reference_fem.oracles.base import Check, Oracle, Outcome, unknowns
from reference_fem.oracles.bodies import block, symmetry
from reference_fem.statics.equilibrium import equilibrium_path
from reference_fem.system.state import NewtonSettings

STRETCHES = (0.7, 0.8, 0.9, 1.5)
LAWS = {"neo-Hookean": NeoHookean(1.0, 1000.0), "Mooney-Rivlin": MooneyRivlin(0.3, 0.2, 1000.0)}
TIGHT = NewtonSettings(force_tol=1e-11, volume_tol=1e-12)
"""Newton converges quadratically: after one more iteration only round-off is left."""


def pull(material: Material, stretch: float, mesh: MeshTet):
    """(problem, equilibrium) of the block at one stretch; the pulled end is the last held region."""
    end = PrescribedDisplacement(lambda x: x[2] > 1 - 1e-9, (2,), lambda t: (0.0, 0.0, (stretch - 1.0) * t))
    problem = Problem(mesh, material, [*symmetry(), end])
    return problem, equilibrium_path(problem, [0.5, 1.0], TIGHT)[-1]


def measure() -> Outcome:
    mesh, checks = block(skew=0.1), []
    for law, material in LAWS.items():
        for stretch in STRETCHES:
            problem, state = pull(material, stretch, mesh)
            at = f"{law}, stretch {stretch:g}"
            side = exact.uniaxial_lateral_stretch(material, stretch)
            for what, unit, expected, value in (
                ("force", "mu m²", exact.uniaxial_stress(material, stretch), state.held_force[3, 2]),
                ("V/V0", "1", stretch * side**2, state.volume),
            ):
                mesh_name = f"block, {mesh.nelements} P2/P1"
                checks.append(Check(f"{what}, {at}", unit, expected, float(value), 1e-8, mesh_name, unknowns(problem)))
    return Outcome(tuple(checks))


ORACLE = Oracle("uniaxial", "Block with free sides, pulled and squeezed", "closed form at kappa = 1000 mu", measure)


STRAIN = 5e-4
"""Volume change, so that the pressure is not zero."""
RATIOS = (10.0, 1e3, 1e5)


def affine():
    """A shear and stretch with det F = 1 + STRAIN, (3, 3)."""
    F = np.array([[1.1, 0.2, 0.0], [0.0, 0.95, 0.1], [0.05, 0.0, 0.98]])
    return F * ((1.0 + STRAIN) / np.linalg.det(F)) ** (1.0 / 3.0)


def measure_patch() -> Outcome:
    """Largest error of displacement and pressure, from kappa/mu = 10 to 1e5."""
    mesh, checks = block(skew=0.1), []
    x, F = nodes(mesh), affine()
    shape = lambda x: (F - np.eye(3)) @ x  # noqa: E731
    held = [PrescribedDisplacement(lambda x: np.ones(x.shape[1], bool), (0, 1, 2), lambda t: (t, t, t), shape)]
    for ratio in RATIOS:
        problem = Problem(mesh, MooneyRivlin(0.3, 0.2, ratio), held)
        state = equilibrium_path(problem, [1.0], TIGHT)[0]
        misfit = float(np.abs(state.u - x @ (F - np.eye(3)).T).max())
        about = (f"block, {mesh.nelements} P2/P1", unknowns(problem))
        checks.append(Check(f"worst u error, kappa/mu {ratio:g}", "m", 0.0, misfit, 1e-8, *about, absolute=True))
        worst = float(state.p[np.argmax(np.abs(state.p - ratio * STRAIN))])
        checks.append(Check(f"worst pressure, kappa/mu {ratio:g}", "mu", ratio * STRAIN, worst, 1e-8, *about))
    return Outcome(tuple(checks))


PATCH_ORACLE = Oracle("patch", "Patch test: affine boundary, constant pressure", "closed form", measure_patch)
