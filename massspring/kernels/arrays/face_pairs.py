"""The faces of a cut that may touch each other, as arrays."""

from typing import NamedTuple

import numpy as np

from massspring.kernels.jit.by_address import by_address


@by_address
class FacePairs(NamedTuple):
    """p nodes behind a cut and their copies in front of it, t triangles of its faces."""

    node: np.ndarray
    """Behind the cut and in front of it, (p, 2) uint32; no node is in two pairs."""
    corner: np.ndarray
    """Of each triangle behind the cut its corners, then their copies, both seen from in front of it, (t, 6) uint32."""
    pair: np.ndarray
    """Which pair each corner belongs to, −1 for a node of the front of the cut, (t, 3) int64."""
    side_start: np.ndarray
    """First entry of each corner of quadratic faces in `side`, (p + 1,) uint32."""
    side: np.ndarray
    """Pairs of the mid-sides around each corner, uint32; none for mid-sides and on linear faces."""
    reach: np.ndarray
    """Mean length of the edges of the faces at a pair at rest [m], (p,). A pair that slips farther cannot touch."""
    normal: np.ndarray
    """Unit normal of both faces together, from behind the cut to its front, (p, 3)."""
    area: np.ndarray
    """Length of the vector sum that `normal` is parallel to, twice the area vectors of the triangles around both nodes
    [m²], (p,)."""
    lever: np.ndarray
    """Impulse of the last step times slip over `area`: the couple that turns the triangles around a pair [N s/m], (p,
    3)."""
    gap: np.ndarray
    """n·(x_front − x_behind) at the start of the step [m], (p,); inf where a pair cannot touch."""
    touches: np.ndarray
    """1 where the faces touch in this step, (p,) uint8."""
    impulse: np.ndarray
    """Impulse between the two nodes of a pair in the last step, positive if it pushes them apart [N s], (p,)."""
    lost: np.ndarray
    """How many times a pair that touched slipped beyond its reach, (1,) int64."""
