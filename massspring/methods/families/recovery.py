"""Recovery of a body with several volumes from any start: meanwhile it has the springs and the one volume of the paper
(docs/theory.md, eq. 8.15).

Shapes with inverted tetrahedra that compensate each other can satisfy several volumes, and springs and volumes together
hold such folds. Springs with rest length and one volume (JHC05) hold hardly any. They act until every tetrahedron has
nearly its rest volume; then the springs and volumes of the body take over its positions and velocities.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from massspring.analysis.stability import largest_frequency
from massspring.body.body import NO_FACETS, Body, Material
from massspring.body.build import tetrahedral_body
from massspring.body.volumes import tetrahedron_volumes
from massspring.kernels.arrays.layout import BoundaryConditions
from massspring.layout.allocate import keeps_one, start
from massspring.layout.state import State
from massspring.world.obstacles import Attachment
from massspring.world.targets import fastest_filling

LEAST, MOST = 0.5, 2.0
"""Range of volume over rest volume of all tetrahedra [1] in which the body counts as recovered: away from 0 and wider
than in normal motion."""
SOFTER = 0.25
"""Stiffness of the springs over that with which they would oscillate as fast as the body at rest. A stretched network
has twice the largest ω² that it has at rest (2.07 in a ball), and the pressure of a volume error adds to it."""
SLOW, THROWN = 0.03, 1.0
"""Speeds over that of a shear wave [1]. Below SLOW a body that has not recovered counts as stuck; it then gets random
velocities of size THROWN, increased by THROWN each further time."""


@dataclass(frozen=True, eq=False)
class Recovery:
    """The memory of a method for a body that has not recovered yet."""

    simple: State
    """State of the substitute body: the same nodes with springs that have a rest length, and one volume."""
    tetrahedra: np.ndarray
    """(k, 4) uint32."""
    rest_volumes: np.ndarray
    """Of the tetrahedra [m³], (k,)."""
    parts: np.ndarray
    """Factor of each kept volume in the one volume, (m,)."""
    wave: float
    """Speed of a shear wave [m/s]."""
    throws: int = 0
    """How often the body has been stuck."""


def why_not_recover(body: Body) -> str | None:
    """Why recovery of `body` cannot be checked; None if it can."""
    return None if len(body.tetrahedra) else "it is back when its tetrahedra are, the body has none; fill its mesh"


def recovery_of(body: Body, attachments: tuple[Attachment, ...], v: np.ndarray | None) -> Recovery:
    """The recovery of a body at rest, or with velocities `v` (n, 3) [m/s]. Raises MassSpringError for bad
    attachments."""
    simple = simple_body(body)
    kept = body.kept
    parts = np.ones(1) if keeps_one(kept) else kept.parts_of(body.triangles)
    state = start(simple, attachments, v)
    return Recovery(state, body.tetrahedra, body.tetrahedron_volumes, parts, fastest_filling(simple) * simple.size)


def simple_body(body: Body) -> Body:
    """The substitute body: the same nodes with one volume, and springs with rest length that allow the same step as
    `body`."""
    springs = body.springs
    if body.rest_pressure:
        tissue = Material(body.rest_pressure, 1.0)
        springs = tetrahedral_body(body.rest, body.triangles, body.tetrahedra, tissue).springs
    simple = replace(
        body,
        springs=springs,
        volumes=body.volumes if keeps_one(body.kept) else None,
        rest_pressure=0.0,
        local_bulk=0.0,
        contact_facets=NO_FACETS,
    )
    slower = largest_frequency(body) / largest_frequency(simple)
    return simple.stiffened(min(1.0, SOFTER * slower * slower))


def is_back(recovery: Recovery, x: np.ndarray) -> bool:
    """Whether every tetrahedron has between LEAST and MOST of its rest volume with nodes at `x` (n, 3) [m]."""
    ratio = tetrahedron_volumes(x, recovery.tetrahedra) / recovery.rest_volumes
    return bool(ratio.min() > LEAST and ratio.max() < MOST)


def simpler(state: State, recovery: Recovery, boundary: BoundaryConditions) -> tuple[State, BoundaryConditions]:
    """The substitute body at the positions and velocities of `state`, and the boundary conditions of the frame for
    it."""
    simple = recovery.simple
    nodes = simple.nodes._replace(x=state.nodes.x, v=state.nodes.v)
    one = np.ascontiguousarray((boundary.volume_target @ recovery.parts)[:, None])
    return replace(simple, nodes=nodes, diagnostics=state.diagnostics), boundary._replace(volume_target=one)


def followed_by(state: State, recovery: Recovery, simple: State, steps: int) -> State:
    """`state` with positions and velocities of the substitute body after a frame of `steps` steps; if that is stuck,
    with random velocities added.

    The steps count as limited, since only the one volume was kept.
    """
    throws, nodes = recovery.throws, state.nodes._replace(x=simple.nodes.x, v=simple.nodes.v)
    if _is_stuck(simple, recovery.wave):
        nodes = nodes._replace(v=_thrown(simple, THROWN * (1 + throws) * recovery.wave, throws))
        throws += 1
    simple.diagnostics.limited[0] = steps
    memory, lam = replace(recovery, simple=simple, throws=throws), simple.lam[0] * recovery.parts
    return replace(state, nodes=nodes, diagnostics=simple.diagnostics, lam=lam, memory=memory)


def _is_stuck(state: State, wave: float) -> bool:
    """Whether the volume has no gradient, or the body is at rest except for a translation."""
    v = state.nodes.v
    fastest = math.sqrt(float(((v - v.mean(axis=0)) ** 2).sum(axis=1).max()))
    return state.diagnostics.singular[0] > 0 or fastest < SLOW * wave


def _thrown(state: State, speed: float, seed: int) -> np.ndarray:
    """Velocities [m/s], (n, 3), with noise of size `speed` added at free nodes, without a change of their momentum."""
    free, mass = state.model.inverse_mass > 0.0, state.model.mass
    noise = speed * np.random.default_rng(seed).standard_normal(state.nodes.v.shape)
    noise[~free] = 0.0
    noise[free] -= mass[free] @ noise[free] / mass[free].sum()
    return state.nodes.v + noise
