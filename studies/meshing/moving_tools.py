"""Elements under moving spheres and capsules: a tool slips through facets that are much wider than it is."""

import numpy as np

from massspring import Capsule, Sphere
from massspring.world.depth import facets_within
from studies.meshing.held_mesh import HeldMesh
from studies.scene.inertia import top_speed
from studies.scene.scene import Scene

ROUNDS = 40
"""Most rounds of halving."""
MOMENTS = 400
"""Most moments looked at between two keys of a path."""


def fine_under_tools(scene: Scene, body: HeldMesh, radii: float) -> HeldMesh:
    """`body` with elements halved until no facet that a moving sphere or capsule reaches has a side of more than
    `radii` of it."""
    for _ in range(ROUNDS):
        x, outer = body.mesh.p.T, body.mesh.boundary_facets()
        facets = np.asarray(body.mesh.facets).T[outer]
        sides = np.linalg.norm(x[facets] - x[np.roll(facets, 1, axis=1)], axis=2).max(axis=1)
        wide = np.zeros(len(facets), dtype=bool)
        for _, tool in moving_tools(scene):
            reached = np.any([facets_within(tool, x, facets, t) for t in moments_of(tool)], axis=0)
            wide |= reached & (sides > radii * tool.radius)
        if not wide.any():
            break
        body = body.bisected(np.unique(np.asarray(body.mesh.f2t)[0, outer[wide]]))
    return body


def moving_tools(scene: Scene) -> list[tuple[int, Sphere | Capsule]]:
    """The moving spheres and capsules with their numbers."""
    return [
        (number, one)
        for number, one in enumerate(scene.obstacles)
        if isinstance(one, Sphere | Capsule) and top_speed(one.path) > 0
    ]


def moments_of(tool: Sphere | Capsule) -> list[float]:
    """Times [s] between which an obstacle moves by at most half its radius: all where it stops or turns, and more."""
    times = np.array(tool.path.times)
    ways = np.linalg.norm(np.diff(tool.path(times), axis=0), axis=1)
    parts = np.ceil(2.0 * ways / tool.radius).astype(int).clip(1, MOMENTS)
    between = [np.linspace(times[k], times[k + 1], int(n), endpoint=False) for k, n in enumerate(parts)]
    return np.concatenate([*between, times[-1:]]).tolist()
