"""Frames of the mass-spring bodies whose speed is promised: 20 steps each, a short run to a sample."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

import massspring as ms
import studies

LARGE = 19_500
"""Surface nodes of the paper's refined stomach."""
RADIUS = 0.05
"""Of the ball [m]."""
STEPS = 20
TISSUE = ms.Material(1800.0, 1060.0)


def ball(nodes: int, fill: bool = False):
    """A ball with so many surface nodes."""
    return studies.organ("ball", nodes, {}, fill, {"radius": RADIUS})


def setup_of(body: ms.Body, method: ms.Method, frames: int, come: Callable, share: float = 1.0) -> ms.Setup:
    """A body held below; what `come` makes of the clock's duration times `share` comes at it from above."""
    clock = ms.Clock(STEPS * 0.5 * ms.step_limit(body).undamped, frames, STEPS)
    bottom = ms.Attachment(body.surface_nodes[body.rest[body.surface_nodes, 2] < -0.8 * RADIUS].astype(np.int64))
    return ms.Setup(body, method, clock, (come(share * clock.duration),), (bottom,), damping=40.0)


def moved(seconds: float, x: float, z: float) -> ms.Trajectory:
    """From rest by (x, 0, z) radii."""
    return ms.Trajectory((0.0, seconds), ((0.0, 0.0, 0.0), (x * RADIUS, 0.0, z * RADIUS)))


def lid(depth: float):
    """A plane that goes down by so many radii."""
    return lambda seconds: ms.Plane((0.0, 0.0, RADIUS), (0.0, 0.0, -1.0), moved(seconds, 0.0, -depth))


def squeezed(method: ms.Method) -> ms.Setup:
    """The paper's surface body under one plane."""
    mesh = ball(550)
    return setup_of(ms.surface_body(mesh.points, mesh.triangles, TISSUE), method, 20, lid(0.3), 0.5)


def probed() -> ms.Setup:
    """The refined surface body, into which a sphere goes by 6 % of the radius while it slides sideways by 10 %."""
    mesh, size = ball(LARGE), 0.15 * RADIUS
    body = ms.surface_body(mesh.points, mesh.triangles, TISSUE)
    sphere = lambda seconds: ms.Sphere((0.0, 0.0, RADIUS + size), size, moved(seconds, 0.1, -0.06))  # noqa: E731
    return setup_of(body, ms.ImplicitVolume(), 12, sphere)


def volumes(count: int | None) -> ms.Setup:
    """A filled ball that keeps so many regions, or one volume per node, under one plane."""
    mesh = ball(550, fill=True)
    body = ms.tetrahedral_body(mesh.points, mesh.triangles, mesh.tetrahedra, TISSUE)
    body = body.keeping(ms.Volumes.nodal(body) if count is None else ms.Volumes.regions(body, count))
    return setup_of(body, ms.ImplicitVolume(), 40, lid(0.1))


def slide() -> ms.Setup:
    """The thin probe on the refined stomach, at its own time step."""
    return studies.prepare(studies.Case(studies.STOMACH_SLIDE, studies.SurfaceBody(LARGE))).setup


SETUPS = {
    "550 surface nodes": lambda: squeezed(ms.ImplicitVolume()),
    "550 surface nodes, float32": lambda: replace(squeezed(ms.ImplicitVolume()), precision="float32"),
    "550 surface nodes, free": lambda: squeezed(ms.Free()),
    f"{LARGE} surface nodes": probed,
    f"{LARGE} surface nodes, float32": lambda: replace(probed(), precision="float32"),
    "128 volumes": lambda: volumes(128),
    "one volume per node": lambda: volumes(None),
    "thin probe, refined stomach": slide,
}


class Steps:
    """Wall time of a run of a few frames."""

    params = tuple(SETUPS)
    param_names = ("body",)
    timeout = 600.0
    warmup_time = 0.0

    def setup(self, body: str) -> None:
        """Builds the body and compiles what it needs."""
        self.run = SETUPS[body]()
        ms.simulate(self.run)

    def time_run(self, body: str) -> None:
        """All frames."""
        ms.simulate(self.run)
