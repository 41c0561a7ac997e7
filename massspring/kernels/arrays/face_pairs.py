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
    """Where the mid-sides around each corner of quadratic faces begin in the next, (p + 1,) uint32."""
    side: np.ndarray
    """Their pairs, uint32; none around mid-sides and on linear faces."""
    reach: np.ndarray
    """Mean length of the edges of the faces at a pair at rest [m], (p,): a pair that slips farther is none."""
    normal: np.ndarray
    """Unit normal of both faces together, from behind the cut to its front, (p, 3)."""
    area: np.ndarray
    """Length of the sum that the normal is along, twice the areas of the triangles around both nodes [m²], (p,)."""
    lever: np.ndarray
    """Impulse of the last step times slip over `area`, what turns the triangles around a pair [N s/m], (p, 3)."""
    gap: np.ndarray
    """n·(x_front − x_behind) at the start of the step [m], (p,); inf where a pair cannot touch."""
    touches: np.ndarray
    """1 where the faces touch in this step, (p,) uint8."""
    impulse: np.ndarray
    """That a pair gave each other in the last step, positive where it pushes apart [N s], (p,)."""
    lost: np.ndarray
    """How many times a pair that touched slipped beyond its reach, (1,) int64."""
