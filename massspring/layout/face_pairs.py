"""Builds the arrays for faces of a cut that may touch, once before a run."""

import numpy as np

from massspring.body.body import Body
from massspring.body.points import PointVolumes
from massspring.errors import MassSpringError
from massspring.kernels.arrays.face_pairs import FacePairs


def face_pairs(body: Body, pairs: np.ndarray) -> FacePairs:
    """The arrays for `pairs` (p, 2): nodes of `body` behind a cut and their copies in front of it.

    Raises MassSpringError for pairs that are not the two sides of a cut."""
    pairs, n = np.asarray(pairs, dtype=np.int64).reshape(-1, 2), body.node_count
    if len(np.unique(pairs)) < pairs.size or pairs.min(initial=0) < 0 or pairs.max(initial=-1) >= n:
        raise MassSpringError(
            f"the pairs of faces name a node twice, or one beyond the {n} of the body; give each once"
        )
    if not np.array_equal(*body.rest[pairs.T]):
        raise MassSpringError(
            "a node and its copy lie apart at rest; give the pairs of a cut, behind and in front of it"
        )
    behind = faces_behind(body.triangles.astype(np.int64), pairs, n)
    of_node, copy = np.full(n, -1), np.arange(n)
    of_node[pairs[:, 0]], copy[pairs[:, 0]] = np.arange(len(pairs)), pairs[:, 1]
    if not np.isin(np.arange(len(pairs)), of_node[behind]).all():
        raise MassSpringError("a pair of nodes is on no face that its cut opened; give the pairs of a cut")
    side_start, side = _sides(body, of_node[behind], pairs)
    length = np.linalg.norm(body.rest[behind] - body.rest[np.roll(behind, 1, axis=1)], axis=2)
    at = of_node[behind].ravel()
    around = np.bincount(at[at >= 0], minlength=len(pairs))
    reach = np.bincount(at[at >= 0], np.repeat(length.mean(axis=1), 3)[at >= 0], len(pairs)) / around
    return FacePairs(
        node=pairs.astype(np.uint32),
        corner=np.column_stack([behind, copy[behind]]).astype(np.uint32),
        pair=np.ascontiguousarray(of_node[behind]),
        side_start=side_start,
        side=side,
        reach=reach,
        normal=np.zeros((len(pairs), 3)),
        area=np.zeros(len(pairs)),
        lever=np.zeros((len(pairs), 3)),
        gap=np.full(len(pairs), np.inf),
        touches=np.zeros(len(pairs), dtype=np.uint8),
        impulse=np.zeros(len(pairs)),
        lost=np.zeros(1, dtype=np.int64),
    )


def _sides(body: Body, faces: np.ndarray, pairs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The mid-sides around each corner, for quadratic bodies only; `faces` (t, 3): pairs at the corners of the flat
    parts of facets."""
    if not isinstance(body.kept, PointVolumes):
        return np.zeros(len(pairs) + 1, dtype=np.uint32), np.empty(0, dtype=np.uint32)
    is_corner = np.isin(pairs[:, 0], body.kept.cells[:, :4])
    ends = faces[:, [[0, 1], [0, 2], [1, 0], [1, 2], [2, 0], [2, 1]]].reshape(-1, 2)
    ends = ends[(ends >= 0).all(axis=1)]
    ends = np.unique(ends[is_corner[ends[:, 0]] & ~is_corner[ends[:, 1]]], axis=0)
    start = np.concatenate([[0], np.cumsum(np.bincount(ends[:, 0], minlength=len(pairs)))])
    return start.astype(np.uint32), ends[:, 1].astype(np.uint32)


def faces_behind(triangles: np.ndarray, pairs: np.ndarray, n: int) -> np.ndarray:
    """Those of the surface `triangles` (f, 3) of n nodes that are behind the cut, seen from in front of it, (t, 3)."""
    was = np.arange(n)
    was[pairs[:, 1]] = pairs[:, 0]
    _, inverse, count = np.unique(np.sort(was[triangles], axis=1), axis=0, return_inverse=True, return_counts=True)
    twice = count[inverse.reshape(-1)] == 2
    return triangles[twice & ~np.isin(triangles, pairs[:, 1]).any(axis=1)]
