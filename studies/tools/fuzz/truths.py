"""What must hold at the end of a run that says it is finished; measured from its positions, not from its records."""

import numpy as np

from massspring import History, Probe, Setup
from studies.geometry.mesh.organ_mesh import signed_volume

DRIFT = 0.01
"""A kept volume this far off has drifted, as in studies.runs."""
INSIDE = 1e-2
"""Of the body's size: a node this deep in an obstacle is inside it."""
ROUND_OFF = {"float64": 1e-9, "float32": 1e-4}
"""Of the body's size and of its distance from the origin."""


def named(setup: Setup, history: History) -> tuple[str, str]:
    """What a finished run is called, and why: ok, inverted, drifted or penetrated."""
    smallest = float(history.min_j[-1])
    if smallest <= 0.0:
        return "inverted", f"an element is inverted at the end (smallest volume ratio {smallest:.3g})"
    deepest = float(np.max(history.penetration[-1], initial=0.0))
    if deepest > INSIDE * setup.body.size:
        return "penetrated", f"a node lies {1e3 * deepest:.3g} mm inside an obstacle"
    off = float(np.max(np.abs(history.volume[-1] / history.volume_target[-1] - 1.0)))
    if setup.method.volume_tol is not None and off > DRIFT:
        return "drifted", f"a kept volume ends {100 * off:.3g} % off"
    return "ok", ""


def broken(setup: Setup, history: History) -> str | None:
    """The first truth that a finished run does not meet, as a sentence; None when all hold."""
    return (
        _not_finite(history) or _wrong_volume(setup, history) or _moved_hold(setup, history) or _inside(setup, history)
    )


def _not_finite(history: History) -> str | None:
    for name in ("volume", "pressure", "contact_force", "penetration", "held_force", "final"):
        if not np.isfinite(getattr(history, name)).all():
            return f"the history of '{name}' has a number that is not finite"
    return None


def _wrong_volume(setup: Setup, history: History) -> str | None:
    """The recorded volume of a body that keeps its whole is what its surface encloses."""
    body = setup.body
    if body.kept.count > 1 or not np.array_equal(
        np.unique(np.abs(getattr(body.kept, "share", np.ones(1)).data)), [1.0]
    ):
        return None
    middle = history.final.mean(axis=0)
    volume = signed_volume(history.final - middle, body.triangles.astype(np.int64))
    allowed = _allowed(setup) / body.size * body.size**3
    if abs(volume - float(history.volume[-1, 0])) > allowed:
        return f"the recorded volume is {history.volume[-1, 0]:.6g} m³, the surface encloses {volume:.6g} m³"
    return None


def _moved_hold(setup: Setup, history: History) -> str | None:
    for attachment in setup.attachments:
        positions = setup.body.rest[attachment.nodes] + attachment.path(setup.clock.duration)
        off = float(np.abs(history.final[attachment.nodes] - positions).max())
        if off > _allowed(setup):
            return f"a clamped node is {off:.3g} m from its prescribed position"
    return None


def _inside(setup: Setup, history: History) -> str | None:
    """The recorded depth in solid obstacles is that of the final positions."""
    final, end = history.final[setup.body.surface_nodes], setup.clock.duration
    for number, obstacle in enumerate(setup.obstacles):
        if isinstance(obstacle, Probe):
            continue
        deepest = max(0.0, -float(obstacle.gap(final, end).min()))
        if abs(deepest - max(0.0, float(history.penetration[-1, number]))) > _allowed(setup):
            record = history.penetration[-1, number]
            return f"a node is {deepest:.3g} m inside obstacle {number}, the record says {record:.3g} m"
    return None


def _allowed(setup: Setup) -> float:
    far = float(np.abs(setup.body.rest).max())
    return ROUND_OFF[setup.precision] * max(setup.body.size, far)
