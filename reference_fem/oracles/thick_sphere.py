"""A thick sphere inflated by its content: the pressure of the lumen, over the stretch of its inner radius."""

import numpy as np
from skfem import MeshTet

from reference_fem import exact
from reference_fem.model.cavity import Cavity
from reference_fem.model.material import NeoHookean
from reference_fem.model.problem import Problem
from reference_fem.oracles.base import Check, Curve, Oracle, Outcome, unknowns
from reference_fem.oracles.bodies import shell_octant, symmetry
from reference_fem.statics.equilibrium import equilibrium_path
from reference_fem.system.state import NewtonSettings

STRETCHES = (1.1, 1.25, 1.5)
MESHES = {0.5: ((4, 3), (6, 4), (8, 5)), 0.8: ((8, 3),)}
"""Inner over outer radius -> meshes of an octant: elements per quarter circle, layers."""
KAPPA = 5000.0
"""Bulk modulus over mu. The closed form is incompressible; its pressure differs by about mu/kappa."""


def inflate(inner: float, mesh: MeshTet):
    """(problem, lumen pressures [mu] at STRETCHES): the octant, its content grown to the cube of the stretch."""
    middle = 0.5 * (inner + 1.0)
    lumen = Cavity(lambda x: np.linalg.norm(x, axis=0) < middle, volume=lambda t: t**3)
    problem = Problem(mesh, NeoHookean(1.0, KAPPA), symmetry(), cavities=[lumen])
    path = equilibrium_path(problem, STRETCHES, NewtonSettings(start=1.0))
    return problem, [float(state.cavity_pressure[0]) for state in path]


def measure() -> Outcome:
    """Lumen pressures of a thick and a thinner wall; the error at the largest stretch over mesh size."""
    checks, sizes, errors = [], [], []
    for inner, meshes in MESHES.items():
        for columns, layers in meshes:
            problem, pressures = inflate(inner, shell_octant(inner, columns, layers))
            expected = [exact.thick_sphere_pressure(1.0, inner, 1.0, stretch) for stretch in STRETCHES]
            if len(meshes) > 1:
                sizes.append(1.0 / columns)
                errors.append(abs(pressures[-1] / expected[-1] - 1.0))
        mesh = f"octant, {columns} columns x {layers} layers"
        for stretch, truth, pressure in zip(STRETCHES, expected, pressures, strict=True):
            quantity = f"lumen pressure, B/A {1.0 / inner:g}, stretch {stretch:g}"
            checks.append(Check(quantity, "mu", truth, pressure, 1e-3, mesh, unknowns(problem)))
    curve = Curve("oracles: error of the main quantity", "thick sphere, pressure", tuple(sizes), tuple(errors))
    return Outcome(tuple(checks), (curve,))


ORACLE = Oracle("thick_sphere", "Thick sphere, inflated", "closed form, incompressible neo-Hookean", measure)
