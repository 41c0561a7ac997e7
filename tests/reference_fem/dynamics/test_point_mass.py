"""Masses hung at nodes: gravity pulls them, and they are inert; against statics and one heavy mass on a spring."""

import numpy as np
import pytest
from skfem import MeshTet, MeshTet2

from reference_fem import (
    NeoHookean,
    PointMass,
    PrescribedDisplacement,
    Problem,
    SolveError,
    equilibrium_path,
    natural_frequencies,
    nodes,
)

G = 9.81
MESH = MeshTet2.from_mesh(MeshTet.init_tensor(np.linspace(0, 0.1, 5), np.linspace(0, 0.03, 3), np.linspace(0, 0.03, 3)))
TIP = np.flatnonzero(nodes(MESH)[:, 0] > 0.1 - 1e-9)


def beam(mass: float, gravity: float = G) -> Problem:
    """Held at one end; `mass` [kg] shared by all nodes of the other."""
    hung = tuple(PointMass(int(node), mass / len(TIP)) for node in TIP)
    held = (PrescribedDisplacement(where=lambda x: x[0] < 1e-9),)
    return Problem(MESH, NeoHookean(90e3, 45e6), held, gravity=(0, 0, -gravity), density=1070.0, masses=hung)


def test_the_holder_carries_the_weight_of_what_hangs():
    state = equilibrium_path(beam(0.05), (1.0,))[-1]
    weight = (0.05 + 1070.0 * 0.1 * 0.03**2) * G
    assert state.held_force[0, 2] == pytest.approx(weight, rel=1e-6)


def test_a_heavy_tip_swings_as_a_mass_on_a_spring():
    """omega² = k/m with the stiffness k of the tip in statics, measured by a small weight; the beam has a thousandth of
    the mass."""
    plain = equilibrium_path(beam(1e-3, 0.01), (1.0,))[-1].u[TIP, 2].mean()
    more = equilibrium_path(beam(2e-3, 0.01), (1.0,))[-1].u[TIP, 2].mean()
    stiffness = 1e-3 * 0.01 / (plain - more)
    omega = natural_frequencies(beam(100.0), 2).elastic.min()
    # The face turns too, which takes 3 h²/(4 L²) of a hundredth part: (0.75 · 0.03² + …)/0.1².
    assert omega == pytest.approx(np.sqrt(stiffness / 100.0), rel=0.02)


@pytest.mark.parametrize(("node", "mass"), [(10**6, 1.0), (0, -1.0), (0, float("nan"))])
def test_a_mass_that_cannot_hang_is_refused(node, mass):
    problem = Problem(**{**vars(beam(1.0)), "masses": (PointMass(node, mass),)})
    with pytest.raises(SolveError, match="hangs at node"):
        natural_frequencies(problem, 1)
