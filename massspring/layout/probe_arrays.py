"""Builds the arrays of the stage for thin probes, and measures how deep a tip is (docs/theory.md, section 11)."""

import numpy as np

from massspring.body.body import Body
from massspring.body.inside import is_inside, mean_edge, new_pair, surface_distance
from massspring.kernels.arrays.layout import FrameDiagnostics
from massspring.kernels.probe.arrays import COUNTS, Probing, Rows
from massspring.kernels.probe.broad_phase import TRIANGLE_BLOCK
from massspring.layout.sell_chunks import along_curve
from massspring.world.obstacles import Probe

SKIN = 0.01
"""Distance that a surface keeps from a tip without thickness, over the mean edge, so that the tip is always on one
side."""
MOST_ROWS = 24
"""Most point contacts of a step. A thin tip in a dimple touches one to eight triangles; triangles without a row are
carried."""


def kept_radius(probe: Probe, body: Body) -> float:
    """Distance that the surface keeps from the tip [m]: the radius of the probe, at least SKIN mean edges."""
    return max(probe.radius, SKIN * mean_edge(body))


def new_probing(body: Body, surface: np.ndarray, probes: tuple[Probe, ...], diagnostics: FrameDiagnostics) -> Probing:
    """The initial arrays for probes on the triangles `surface` (f, 3): no pair sleeps, nothing is in contact."""
    count, triangles, nodes = len(probes), len(surface), body.node_count
    number = np.argsort(along_curve(body.rest[surface].mean(axis=1)))
    many, kept = MOST_ROWS, body.kept.count
    rows = Rows(
        count=np.zeros(1, dtype=np.int64),
        **{name: np.zeros(many, dtype=np.uint32) for name in ("triangle", "probe")},
        node=np.zeros((many, 3), dtype=np.uint32),
        weight=np.zeros((many, 3)),
        direction=np.zeros((many, 3)),
        moves=np.zeros((many, 3, 3)),
        **{name: np.zeros((many, kept)) for name in ("flow", "answer")},
        **{name: np.zeros(many) for name in ("right", "impulse")},
        active=np.zeros(many, dtype=np.bool_),
        **{name: np.zeros((many, many)) for name in ("matrix", "small")},
        part=np.zeros((2, many)),
    )
    return Probing(
        radius=np.array([kept_radius(probe, body) for probe in probes]),
        skipping=True,
        travel=np.zeros(1),
        surface=np.ascontiguousarray(surface[number]),
        number=number.astype(np.uint32),
        wake=np.full((count, -(-triangles // TRIANGLE_BLOCK)), -np.inf),
        near=np.zeros((count, triangles), dtype=np.uint32),
        near_count=np.zeros(count, dtype=np.int64),
        time=np.zeros(triangles),
        passing=np.zeros((triangles, 6)),
        rows=rows,
        **{name: np.zeros((nodes, 3)) for name in ("base", "push", "velocity")},
        change=np.zeros(kept),
        **{name: np.zeros(nodes, dtype=np.uint32) for name in ("carried", "taken")},
        taken_count=np.zeros(1, dtype=np.int64),
        passed=np.zeros(count, dtype=np.int64),
        pair=new_pair(),
        diagnostics=diagnostics,
        counts=np.zeros(len(COUNTS), dtype=np.int64),
    )


def fresh(probing: Probing, diagnostics: FrameDiagnostics) -> Probing:
    """A copy that a frame may change without a change to the state from which it starts."""
    kept = {name: getattr(probing, name).copy() for name in ("travel", "wake", "passed", "counts")}
    return probing._replace(diagnostics=diagnostics, **kept)


def tip_depth(probe: Probe, x: np.ndarray, triangles: np.ndarray, t: float) -> float:
    """How deep the surface lies in a probe at time `t` [m]: its radius minus the distance of the tip, or plus the
    distance if the tip is inside the surface.

    `x` (n, 3) [m]. Negative while they are apart.
    """
    tip = probe.anchor + probe.path(t)
    distance = surface_distance(tip, x, triangles)
    return probe.radius + distance if is_inside(tip, x, triangles) else probe.radius - distance
