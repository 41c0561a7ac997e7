"""Which faces of a cut are open while it advances, so that at each stage the surface of the body is a valid closed
surface."""

from collections.abc import Sequence

import numpy as np

from studies.geometry.mesh.organ_mesh import row_keys

JUST = 1e-9
"""Tolerance over the length of the path of a front: a node that lies on the front counts as passed."""


def faces_in_stages(
    faces: np.ndarray, parting: np.ndarray, along: np.ndarray, shares: Sequence[float]
) -> list[np.ndarray]:
    """The faces of a cut (f, 3) that are open once its front has covered each of the ascending `shares` (s,) of its
    path, (f,) bool each; no face closes again.

    The front moves over the nodes `parting` (n,) bool, those that the whole cut doubles, in the order of their position
    `along` (n,) its direction. When it passes a node, the node is doubled and all faces around it open. A node waits if
    the surface of the opened body would touch itself in a point or an edge.
    """
    first, last = along[parting].min(), along[parting].max()
    passed = np.zeros(len(parting), dtype=bool)
    stages = []
    for share in shares:
        reached = parting & (along <= first + (share + JUST) * (last - first))
        passed = parted(faces, parting, passed, reached | passed)
        stages.append(passed[faces].any(axis=1))
    return stages


def parted(faces: np.ndarray, parting: np.ndarray, before: np.ndarray, reached: np.ndarray) -> np.ndarray:
    """The doubled nodes, (n,) bool: those of the stage `before` (n,), and all of those `reached` (n,) that need not
    wait."""
    while True:
        passed = reached | (parting & ~_corners(faces[~reached[faces].any(axis=1)], len(parting)))
        bad = meetings(faces, parting, passed)
        if not bad.any():
            return passed
        near = _corners(faces[bad[faces].any(axis=1)], len(parting))
        wait = near & reached & ~before
        reached = reached & ~wait if wait.any() else before


def _corners(rows: np.ndarray, n: int) -> np.ndarray:
    """Whether each of n nodes is in the rows, (n,) bool."""
    inside = np.zeros(n, dtype=bool)
    inside[rows] = True
    return inside


def meetings(faces: np.ndarray, parting: np.ndarray, passed: np.ndarray) -> np.ndarray:
    """Nodes at which the surface of the body would touch itself if the nodes `passed` (n,) were doubled, (n,) bool.

    In a valid state the open faces around a single node form one fan, or around a node of the outline fans that each
    begin at the outline. A side between two single nodes has at most one open face, and is not in the outline."""
    n, is_open = len(passed), passed[faces].any(axis=1)
    half = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, place, inverse, count = np.unique(row_keys(half), return_index=True, return_inverse=True, return_counts=True)
    sides, opened = half[place], np.bincount(inverse.ravel(), np.repeat(is_open, 3)).astype(int)
    # The other sides with one face are the front of the whole cut, whose nodes stay single.
    outline = (count == 1) & parting[sides].any(axis=1)
    still = ~passed[sides].any(axis=1)
    bad = np.zeros(n, dtype=bool)
    bad[sides[still & ((opened == 2) | (outline & (opened == 1)))]] = True
    corners, inner, outer = (
        np.bincount(rows.ravel(), minlength=n)
        for rows in (faces[is_open], sides[opened == 2], sides[outline & (opened == 1)])
    )
    fans = corners - inner
    of_outline = _corners(sides[outline], n)
    return bad | (~passed & np.where(of_outline, fans != outer, fans > 1))
