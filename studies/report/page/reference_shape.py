"""The reference for the page: the surface of its mesh at rest and at every checkpoint."""

from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from studies.geometry.mesh.organ_mesh import boundary_triangles
from studies.reference.load import Reference
from studies.report.page.pack import pack_frames, pack_indices
from studies.scene.as_json import scene_to_json
from studies.scene.scene import Scene
from studies.store.paths import key_hash

MOST_NODES = 65_535
"""Numbers of nodes have two bytes on the page."""
ENOUGH = 4_000
"""Nodes from which on a surface is drawn through its corners alone: the middles of its sides change no outline."""


def reference_id(scene: Scene) -> str:
    """The same for all cases that are compared with one reference."""
    return key_hash(scene_to_json(replace(scene, frames=1)))


def reference_shape(reference: Reference) -> dict[str, Any] | None:
    """JSON-able: checkpoints [s], triangles, and positions [m] at all of them; None where it has too many nodes."""
    scene = reference.scene
    signs = np.array(list(product((1.0, -1.0), repeat=3))) if scene.symmetric else np.ones((1, 3))
    triangles = reference.triangles
    if len(signs) * len(np.unique(triangles)) > ENOUGH:
        triangles = boundary_triangles(reference.field("tetrahedra"))
    nodes, faces = np.unique(reference.outside(triangles), return_inverse=True)
    if len(signs) * len(nodes) > MOST_NODES:
        return None
    faces = faces.reshape(-1, 3)
    rest = _mirrored(reference.field("nodes")[None, nodes], signs)[0]
    t, positions = from_rest(
        scene,
        np.asarray(reference.field("t"), float),
        rest,
        rest + _mirrored(reference.field("displacement")[:, nodes], signs),
    )
    turned = [(faces if sign.prod() > 0 else faces[:, ::-1]) + k * len(nodes) for k, sign in enumerate(signs)]
    size = float(np.linalg.norm(np.ptp(rest, axis=0)))
    return {
        "checkpoints": t.tolist(),
        "triangles": pack_indices(np.vstack(turned)),
        "positions": pack_frames(positions, size),
    }


def from_rest(scene: Scene, t: np.ndarray, rest: np.ndarray, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Times (K,) [s] and positions (K, v, 3) [m], before them those at rest (v, 3), where the scene begins there."""
    if scene.start is not None or (len(t) and t[0] <= 0):
        return t, positions
    return np.concatenate([[0.0], t]), np.concatenate([rest[None], positions])


def _mirrored(vectors: np.ndarray, signs: np.ndarray) -> np.ndarray:
    """Positions or displacements (K, n, 3) of an octant as those of the whole, (K, 8 n, 3)."""
    return (signs[None, :, None, :] * vectors[:, None]).reshape(len(vectors), -1, 3)
