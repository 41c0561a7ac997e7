"""A cylinder of silicone that hangs under its weight, and the one point of it that was measured: SOFA's phantom.

examples/Benchmark/Accuracy/cylinder_TLEDTetraSolution.scn of the SOFA framework (2008): radius 19 mm, length 178 mm,
0.216 kg, one end clamped; the middle of the free end is 119.383 mm lower than the axis, 126.842 mm from the clamp.
Nobody measured its E. So E is fitted to how far the end hangs down, and how far it reaches is predicted.
"""

import numpy as np
from skfem import MeshTet, MeshTet2

from reference_fem import NeoHookean, PrescribedDisplacement, Problem, equilibrium_path, nodes
from studies.geometry.mesh.organ_mesh import tetrahedron_volumes

RADIUS, LENGTH, MASS = 0.019, 0.178, 0.216
"""[m], [m], [kg]."""
DOWN, ALONG = 0.119383, 0.126842
"""Of the middle of the free end, measured [m]."""
POISSON, GRAVITY = 0.49, 9.81
"""As in SOFA's scene; [1], [m/s²]."""
STEPS = (0.25, 0.5, 0.75, 1.0)
"""Moments of the path to the deep sag."""
FIRST_GUESS = 78e3
"""Of E [Pa]."""
SLOPE = 1.6
"""−d ln E/d ln(sag) of a sag this deep; 1 for a small one. A wrong value costs rounds of the fit, not accuracy."""
CLOSE = 3e-5
"""Of the sag at which the fit ends [m]."""


def cylinder_mesh(across: int, along: int) -> MeshTet:
    """Bricks of six tetrahedra, `across` × `across` × `along`, their square drawn to a polygon of the circle's area."""
    side = np.linspace(-1.0, 1.0, across + 1)
    box = MeshTet.init_tensor(side, side, np.linspace(0.0, LENGTH, along + 1))
    x, y, z = box.p
    points = np.array([x * np.sqrt(1 - y**2 / 2), y * np.sqrt(1 - x**2 / 2), z])
    area = np.abs(tetrahedron_volumes(points.T, box.t.T)).sum() / LENGTH
    points[:2] *= RADIUS * np.sqrt(np.pi / area)
    return MeshTet(points, box.t)


def free_end(mesh: MeshTet2, youngs: float) -> tuple[float, float]:
    """How far down and how far along the middle of the free end is at rest [m], with E = `youngs` [Pa]. Raises
    SolveError."""
    mu, points = youngs / (2.0 * (1.0 + POISSON)), nodes(mesh)
    problem = Problem(
        mesh=mesh,
        material=NeoHookean(mu, mu * 2.0 * (1.0 + POISSON) / (3.0 * (1.0 - 2.0 * POISSON))),
        held=(PrescribedDisplacement(where=lambda x: x[2] < 1e-9),),
        gravity=(0.0, -GRAVITY, 0.0),
        density=MASS / (np.pi * RADIUS**2 * LENGTH),
    )
    middle = int(np.argmin(np.linalg.norm(points - [0.0, 0.0, LENGTH], axis=1)))
    _, low, far = points[middle] + equilibrium_path(problem, STEPS)[-1].u[middle]
    return -float(low), float(far)


def fitted_cylinder(across: int, along: int) -> tuple[float, float]:
    """(E [Pa] at which the free end hangs as low as measured, how far along it then is [m]). Raises SolveError."""
    mesh, youngs = MeshTet2.from_mesh(cylinder_mesh(across, along)), FIRST_GUESS
    while True:
        low, far = free_end(mesh, youngs)
        if abs(low - DOWN) < CLOSE:
            return youngs, far
        youngs *= (low / DOWN) ** SLOPE
