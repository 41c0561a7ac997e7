"""Checks of a set-up before it runs, and of its surroundings in each frame; each error message is one sentence."""

import warnings
from collections.abc import Collection, Mapping
from dataclasses import fields, is_dataclass

import numpy as np

from massspring.body.body import Body
from massspring.body.inside import is_inside, mean_edge
from massspring.body.points import PointVolumes
from massspring.body.surface import winding_number
from massspring.body.volumes import PATCH, Volumes
from massspring.errors import MassSpringError
from massspring.kernels.arrays.layout import BoundaryConditions
from massspring.layout.probe_arrays import tip_depth
from massspring.layout.state import State
from massspring.methods.capabilities import No
from massspring.methods.method import Method
from massspring.world.obstacles import Attachment, Capsule, Obstacle, Plane, Probe, Sphere, Surroundings
from massspring.world.trajectories import Ramp

INSIDE = 1e-6
"""Depth, over the size of the body, to which an obstacle may reach into it at the start: round-off of touching
positions."""


def check_surroundings(gravity: tuple[float, float, float], damping: float, dt: float) -> None:
    """Raises MassSpringError for gravity [m/s²] or damping [1/s] that no step `dt` [s] could use."""
    if len(gravity) != 3 or not np.isfinite(gravity).all():
        raise MassSpringError(f"gravity is {gravity} m/s²; give three finite numbers")
    if not (np.isfinite(damping) and damping >= 0):
        raise MassSpringError(f"damping is {damping} 1/s; it must be zero or positive")
    if damping * dt >= 1:
        raise MassSpringError(
            f"damping {damping:g} 1/s reverses velocities within one step of {dt:.3g} s; "
            f"keep dt below {1 / damping:.3g} s"
        )


def check_nodal(what: str, values: np.ndarray | None, body: Body) -> None:
    """Raises MassSpringError unless there are none, or three finite numbers for every node."""
    if values is None:
        return
    if np.shape(values) != (body.node_count, 3):
        raise MassSpringError(
            f"{what} have shape {np.shape(values)}; the body has {body.node_count} nodes, give ({body.node_count}, 3)"
        )
    bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
    if len(bad):
        raise MassSpringError(f"{what} are not finite at node {bad[0]} and {len(bad) - 1} more; give numbers")


def check_targets(targets: Mapping[str, Ramp], body: Body, method: Method) -> None:
    """Raises MassSpringError for a target that the method ignores, that names no kept volume, or that falls to 0."""
    supported = method.capabilities.targets
    if targets and isinstance(supported, No):
        raise MassSpringError(
            f"a target is given for volume '{next(iter(targets))}', which method '{method.name}' does not follow: "
            f"{supported.because}; leave it out, or take implicit_volume"
        )
    for name, ramp in targets.items():
        if name not in body.kept.names:
            names = ", ".join(body.kept.names[:6])
            raise MassSpringError(f"target '{name}' names no kept volume; the body keeps {names}")
        if min(ramp.values) <= 0:
            raise MassSpringError(f"target '{name}' falls to {min(ramp.values):g} of its rest volume; keep it positive")


def check_body(body: Body, method: Method) -> None:
    """Raises MassSpringError for a body that the method cannot advance.

    Springs without length need one volume for every node or every few nodes: within one volume of many nodes some parts
    would shrink as others grow.
    """
    reason = method.why_not(body)
    if reason is not None:
        raise MassSpringError(f"method '{method.name}' does not apply to this body: {reason}")
    if body.rest_pressure and isinstance(body.kept, Volumes) and PATCH * body.kept.count < body.node_count:
        raise MassSpringError(
            f"springs of law '{body.law}' pull every part of the body together, and it keeps {body.kept.count} "
            f"volumes for {body.node_count} nodes; keep one volume per node, or for {PATCH} of them"
        )


def check_settings(method: Method) -> None:
    """Raises MassSpringError for a number among the settings of one of this package's methods that is not finite, below
    0, or not whole where its default is."""
    for setting in fields(method) if is_dataclass(method) and type(method).__module__.startswith("massspring.") else ():
        value, usual = getattr(method, setting.name), setting.default
        if isinstance(usual, bool) or not isinstance(usual, int | float):
            continue
        kinds = int | np.integer if isinstance(usual, int) else int | float | np.number
        if isinstance(value, bool) or not isinstance(value, kinds) or not 0 <= value < np.inf:
            kind = "whole" if isinstance(usual, int) else "finite"
            raise MassSpringError(
                f"method '{method.name}': {setting.name} is {value!r}; give a {kind} number from 0 on, such as {usual}"
            )


def check_among(surroundings: Surroundings, method: Method) -> None:
    """Raises MassSpringError for surroundings that the method cannot run in."""
    reason = method.why_not_among(surroundings)
    if reason is not None:
        raise MassSpringError(f"method '{method.name}' does not apply to these surroundings: {reason}")


def check_facets(precision: str, body: Body, obstacles: Collection[object]) -> None:
    """Raises MassSpringError for single precision if obstacles touch a body with contact inside facets: the forces
    would differ in the fourth digit."""
    if precision == "float32" and len(body.contact_facets) and obstacles:
        raise MassSpringError(
            "obstacles touch this quadratic body inside its facets, which runs in float64 only; "
            "leave precision at float64, or make the body with contact at its nodes"
        )


def check_probe(number: int, probe: Probe, method: Method, body: Body, x: np.ndarray) -> None:
    """Raises MassSpringError for a thin probe that the method or the body does not support, that starts inside the body
    at `x` (n, 3), or that is too thick for contact with single triangles."""
    supported = method.capabilities.thin_probes
    if isinstance(supported, No):
        raise MassSpringError(
            f"method '{method.name}' does not support thin probes (obstacle {number}): {supported.because}; "
            "use a Sphere, or implicit_volume"
        )
    if isinstance(body.kept, PointVolumes):
        raise MassSpringError(
            f"obstacle {number} is a thin probe, and the volumes of a quadratic body cannot be kept next to one; "
            "use a Sphere, or a tetrahedral body"
        )
    edge = mean_edge(body)
    if probe.radius > edge:
        raise MassSpringError(
            f"obstacle {number} is a probe of radius {probe.radius:.3g} m on a surface with edges of {edge:.3g} m; "
            "use a Sphere, or a finer surface"
        )
    inside = is_inside(probe.anchor + probe.path(0.0), x, body.triangles)
    depth = tip_depth(probe, x, body.triangles, 0.0)
    if inside or depth > INSIDE * body.size:
        raise _starts_inside(number, depth)


def check_solid(number: int, obstacle: Plane | Sphere | Capsule, body: Body, x: np.ndarray) -> None:
    """Raises MassSpringError for an obstacle that starts inside the body at `x` (n, 3)."""
    depth = starting_depth(obstacle, body, x)
    if depth > INSIDE * body.size:
        raise _starts_inside(number, depth)


def _starts_inside(number: int, depth: float) -> MassSpringError:
    return MassSpringError(
        f"obstacle {number} starts {depth:.3g} m inside the body; start its path outside the surface"
    )


def starting_depth(obstacle: Plane | Sphere | Capsule, body: Body, x: np.ndarray) -> float:
    """How deep the body at `x` (n, 3) reaches into an obstacle at the start [m]; an obstacle that lies between the
    nodes counts too."""
    depth = -float(obstacle.gap(x[body.surface_nodes], 0.0).min())
    if isinstance(obstacle, Plane):
        return depth
    ends = [obstacle.anchor + obstacle.path(0.0)]
    if isinstance(obstacle, Capsule):
        ends.append(ends[0] + obstacle.span)
    inside = any(abs(winding_number(end, x, body.triangles)) > 0.5 for end in ends)
    return max(depth, obstacle.radius) if inside else depth


def check_face_pairs(
    pairs: np.ndarray,
    method: Method,
    attachments: Collection[Attachment],
    precision: str,
    probes: bool,
) -> None:
    """Raises MassSpringError for faces of a cut that may touch in a run that cannot keep them apart."""
    supported = method.capabilities.face_contact
    if isinstance(supported, No):
        raise MassSpringError(
            f"method '{method.name}' does not support contact between the faces of a cut: {supported.because}; "
            "take implicit_volume, or leave the pairs out"
        )
    if precision != "float64" or probes:
        raise MassSpringError(
            "faces of a cut that may touch are advanced in float64 and without thin probes; leave these out"
        )
    held = np.isin(np.asarray(pairs), np.concatenate([[], *(np.asarray(a.nodes) for a in attachments)]))
    alone = int((held.sum(axis=1) == 1).sum())
    if alone:
        raise MassSpringError(
            f"{alone} nodes on a cut are attached and their copies are not; attach both, or leave these pairs out"
        )


def check_slip(lost: int, pairs: int) -> None:
    """Warns of pairs on a cut that touched and slid over each other by more than an edge."""
    if lost:
        warnings.warn(
            f"{lost} of {pairs} pairs of nodes on the cut slid over each other by more than an edge while they touched;"
            " from there on nothing keeps them apart",
            stacklevel=3,
        )


def check_probes(state: State, obstacles: tuple[Obstacle, ...]) -> str | None:
    """Message that names the first thin probe that was driven through held tissue, or None."""
    if state.probing is None or not state.probing.passed.any():
        return None
    thin = [number for number, obstacle in enumerate(obstacles) if isinstance(obstacle, Probe)]
    p = int(np.flatnonzero(state.probing.passed)[0])
    triangle = int(state.probing.passed[p]) - 1
    held = int((state.model.inverse_mass[state.model.triangles[triangle]] == 0.0).sum())
    return (
        f"the thin probe that is obstacle {thin[p]} was driven through triangle {triangle}, {held} of whose corners "
        "are attached; lead its path past attached tissue, or attach fewer nodes"
    )


def check_loads(boundary: BoundaryConditions) -> str | None:
    """Message that names the first obstacle, attachment or target that is not finite, or None."""
    for what, values in (
        ("obstacle", boundary.position),
        ("attachment", boundary.held_displacement),
        ("target of kept volume", boundary.volume_target[:, :, None]),
    ):
        finite = np.isfinite(values)
        if not finite.all():
            bad = np.flatnonzero(~finite.all(axis=(0, 2)))
            return f"{what} {bad[0]} is no longer finite; correct its path"
    return None
