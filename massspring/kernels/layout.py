"""What a compiled frame loop is given: plain tuples of arrays, so that a frame costs one call from Python."""

from typing import NamedTuple

import numpy as np


class Network(NamedTuple):
    """What does not change during a run; s springs, f triangles, n nodes, h held nodes, c surface nodes."""

    ends: np.ndarray
    """Spring ends, (s, 2) uint32. Unsigned: signed indices cost up to 1.9 times in gather loops."""
    rest_length: np.ndarray
    """[m], (s,)."""
    stiffness: np.ndarray
    """[N/m], (s,)."""
    triangles: np.ndarray
    """Closed surface, outward, (f, 3) uint32."""
    mass: np.ndarray
    """[kg], (n,)."""
    inverse_mass: np.ndarray
    """[1/kg], (n,); 0 marks a node whose motion is prescribed."""
    surface_nodes: np.ndarray
    """Nodes that obstacles can touch, (c,) uint32."""
    held_nodes: np.ndarray
    """(h,) uint32."""
    held_group: np.ndarray
    """Attachment each held node belongs to, (h,) uint32."""
    held_rest: np.ndarray
    """Rest positions of the held nodes [m], (h, 3)."""


class Motion(NamedTuple):
    """What changes at every step, with the scratch arrays of the loop: nothing is allocated inside it."""

    x: np.ndarray
    """Positions [m], (n, 3)."""
    v: np.ndarray
    """Velocities [m/s], (n, 3)."""
    v_star: np.ndarray
    """Velocities after all known forces [m/s], (n, 3)."""
    force: np.ndarray
    """Spring forces [N], (n, 3)."""
    gradient: np.ndarray
    """G = dV/dx [m²], (n, 3)."""
    touched: np.ndarray
    """0 for a free node, else 1 + the obstacle it lies on, (n,) uint32."""
    normal: np.ndarray
    """Unit normal of the touched obstacle, towards the body, (n, 3)."""
    approach: np.ndarray
    """Normal velocity that ends the step on the obstacle [m/s], (n,)."""
    clearance: np.ndarray
    """Distance to the nearest obstacle at the end of the predicted step [m], (n,)."""


class Drive(NamedTuple):
    """One frame's outside world, q steps, o obstacles, g attachments."""

    dt: float
    """[s]."""
    damping: float
    """Mass-proportional damping c [1/s]."""
    gravity: np.ndarray
    """[m/s²], (3,)."""
    is_plane: np.ndarray
    """(o,) bool; what is no plane is a sphere."""
    plane_normal: np.ndarray
    """Unit normals, towards the body, (o, 3)."""
    radius: np.ndarray
    """Of the spheres [m], (o,)."""
    position: np.ndarray
    """Plane points and sphere centres at the end of each step [m], (q, o, 3)."""
    held_displacement: np.ndarray
    """Of the attachments at the end of each step [m], (q, g, 3)."""


class Tally(NamedTuple):
    """What a frame measures of itself; the loop adds, the caller starts it at zero."""

    contact_impulse: np.ndarray
    """Impulse of each obstacle on the body [N s], (o, 3)."""
    held_impulse: np.ndarray
    """Impulse of each attachment on the body [N s], (g, 3)."""
    skipped: np.ndarray
    """Steps whose volume gradient vanished, so that no pressure could act, (1,) int64."""
