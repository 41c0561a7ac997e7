"""How a body with several volumes comes back from any shape: until then it is the paper's (docs/theory.md, eq. 8.15).

Several volumes are met by shapes in which tetrahedra are inside out and make up for each other, and springs with the
volumes hold such folds. Springs with rest length and one volume (JHC05) hold nearly none: they take the body until no
tetrahedron is far from its volume, and leave it to its own springs and volumes then, with its places and speeds.
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
"""Volumes of tetrahedra over those at rest [1] between which the body is back: far from both 0 and its own motion."""
SOFTER = 0.25
"""Stiffness of the springs against those that oscillate as fast as the body at rest: a network that is drawn out has
twice the largest ω² it has at rest (2.07 in a ball), and the pressure of a wrong volume adds to it."""
SLOW, THROWN = 0.03, 1.0
"""Speeds over that of a shear wave [1]: below the first a body that is not back is stuck; with the second it is thrown
about, and each later time with as much more."""


@dataclass(frozen=True, eq=False)
class Recovery:
    """What a method remembers of a body that is not back yet."""

    simple: State
    """The same nodes with springs of rest length and one volume."""
    tetrahedra: np.ndarray
    """(k, 4) uint32."""
    rest_volumes: np.ndarray
    """Of the tetrahedra [m³], (k,)."""
    parts: np.ndarray
    """What each kept volume has in the one, (m,)."""
    wave: float
    """Speed of a shear wave [m/s]."""
    throws: int = 0
    """How often the body was stuck."""


def why_not_recover(body: Body) -> str | None:
    """Why it cannot be decided whether `body` has recovered; None when it can."""
    return None if len(body.tetrahedra) else "it is back when its tetrahedra are, the body has none; fill its mesh"


def recovery_of(body: Body, attachments: tuple[Attachment, ...], v: np.ndarray | None) -> Recovery:
    """Of a body at rest, or with velocities `v` (n, 3) [m/s]. Raises MassSpringError for bad attachments."""
    simple = simple_body(body)
    kept = body.kept
    parts = np.ones(1) if keeps_one(kept) else kept.parts_of(body.triangles)
    state = start(simple, attachments, v)
    return Recovery(state, body.tetrahedra, body.tetrahedron_volumes, parts, fastest_filling(simple) * simple.size)


def simple_body(body: Body) -> Body:
    """The same nodes with one volume, and springs with rest length that allow the step that `body` allows."""
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
    """Whether every tetrahedron of nodes at `x` (n, 3) [m] has about its volume."""
    ratio = tetrahedron_volumes(x, recovery.tetrahedra) / recovery.rest_volumes
    return bool(ratio.min() > LEAST and ratio.max() < MOST)


def simpler(state: State, recovery: Recovery, boundary: BoundaryConditions) -> tuple[State, BoundaryConditions]:
    """The body of one volume where `state` is, and that frame for it."""
    simple = recovery.simple
    nodes = simple.nodes._replace(x=state.nodes.x, v=state.nodes.v)
    one = np.ascontiguousarray((boundary.volume_target @ recovery.parts)[:, None])
    return replace(simple, nodes=nodes, diagnostics=state.diagnostics), boundary._replace(volume_target=one)


def followed_by(state: State, recovery: Recovery, simple: State, steps: int) -> State:
    """`state` where the body of one volume ended a frame of so many steps, thrown about if that is stuck.

    The steps count as limited: the volumes were kept as one.
    """
    throws, nodes = recovery.throws, state.nodes._replace(x=simple.nodes.x, v=simple.nodes.v)
    if _is_stuck(simple, recovery.wave):
        nodes = nodes._replace(v=_thrown(simple, THROWN * (1 + throws) * recovery.wave, throws))
        throws += 1
    simple.diagnostics.limited[0] = steps
    memory, lam = replace(recovery, simple=simple, throws=throws), simple.lam[0] * recovery.parts
    return replace(state, nodes=nodes, diagnostics=simple.diagnostics, lam=lam, memory=memory)


def _is_stuck(state: State, wave: float) -> bool:
    """Whether the volume has nothing to push on, or the body has come to rest apart from a common motion."""
    v = state.nodes.v
    fastest = math.sqrt(float(((v - v.mean(axis=0)) ** 2).sum(axis=1).max()))
    return state.diagnostics.singular[0] > 0 or fastest < SLOW * wave


def _thrown(state: State, speed: float, seed: int) -> np.ndarray:
    """Velocities [m/s] with noise of size `speed` at free nodes that leaves their momentum as it is, (n, 3)."""
    free, mass = state.model.inverse_mass > 0.0, state.model.mass
    noise = speed * np.random.default_rng(seed).standard_normal(state.nodes.v.shape)
    noise[~free] = 0.0
    noise[free] -= mass[free] @ noise[free] / mass[free].sum()
    return state.nodes.v + noise
