"""Meshes of the oracles: a block, an eighth of a ball, an eighth of a thick shell (side or radius 1 m)."""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from skfem import MeshTet, MeshTet2

from reference_fem.elements.shapes import curve, nodes
from reference_fem.model.problem import PrescribedDisplacement


def block(cells: Sequence[int] = (2, 2, 2), skew: float = 0.0):
    """Unit cube; skew moves its inner vertices, so that all elements differ."""
    mesh = MeshTet.init_tensor(*[np.linspace(0.0, 1.0, n + 1) for n in cells])
    inner = np.all((mesh.p > 1e-9) & (mesh.p < 1 - 1e-9), axis=0)
    mesh.p[:, inner] += skew * np.random.default_rng(3).uniform(-1.0, 1.0, (3, inner.sum()))
    return mesh


def symmetry():
    """The three coordinate planes; each holds the component normal to it."""
    return [PrescribedDisplacement(lambda x, c=c: np.abs(x[c]) < 1e-9, (c,)) for c in range(3)]


def kuhn_simplex(n: int):
    """n³ equal tetrahedra in 1 >= a >= b >= c >= 0: points (k, 3), elements (n³, 4)."""
    cells = np.array(list(itertools.product(range(n), repeat=3)))
    corners = []
    for axes in itertools.permutations(range(3)):
        path = [cells]
        for axis in axes:
            path.append(path[-1] + np.eye(3, dtype=int)[axis])
        corners.append(np.stack(path, axis=1))
    corners = np.concatenate(corners)
    a, b, c = corners.transpose(2, 0, 1)
    corners = corners[((a >= b) & (b >= c)).all(axis=1)]
    points, elements = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    return points / n, elements.reshape(-1, 4)


def towards_pole(direction: np.ndarray, grade: float):
    """Unit vectors moved towards +z; at the pole the polar angle is scaled by `grade`."""
    share = np.arccos(np.clip(direction[:, 2], -1.0, 1.0)) / (np.pi / 2)
    angle = np.pi / 2 * (grade * share + (1.0 - grade) * share**2)
    across = np.hypot(direction[:, 0], direction[:, 1])
    across[across == 0.0] = 1.0
    return np.column_stack(
        (np.sin(angle) * direction[:, 0] / across, np.sin(angle) * direction[:, 1] / across, np.cos(angle))
    )


def ball_octant(n: int, grade: float = 0.5, radial: float = 0.3):
    """x, y, z >= 0 part of the unit ball, n³ curved elements, finer at the pole +z."""
    simplex, elements = kuhn_simplex(n)
    radius = simplex[:, 0]
    toward = np.column_stack((radius - simplex[:, 1], simplex[:, 1] - simplex[:, 2], simplex[:, 2]))
    size = np.linalg.norm(toward, axis=1)
    toward = toward / np.where(size > 0.0, size, 1.0)[:, None]
    points = towards_pole(toward, grade) * (radius * (1.0 + radial * (1.0 - radius)))[:, None]
    points[radius == 0.0] = 0.0
    points[np.abs(points) < 1e-14] = 0.0
    return round_off(points, elements, (1.0,))


def whole_ball(n: int):
    """The unit ball, 8 n³ curved elements: eight octants, joined where they meet."""
    octant = ball_octant(n, grade=1.0, radial=0.0)
    signs = list(itertools.product((1.0, -1.0), repeat=3))
    corners = octant.doflocs[:, : octant.nvertices].T
    points = np.concatenate([corners * sign for sign in signs])
    elements = np.concatenate([octant.t.T + k * len(corners) for k in range(8)])
    # a tolerance of 1e-9 of the radius joins mirrored nodes that differ by round-off; adding zero turns -0.0 into 0.0
    _, first, merged = np.unique(points.round(9) + 0.0, axis=0, return_index=True, return_inverse=True)
    return round_off(points[first], merged[elements], (1.0,))


def shell_octant(inner: float, n: int, layers: int):
    """inner <= r <= 1, x, y, z >= 0: n² columns of prisms, each cut in three by ascending vertex number."""
    index = {pair: k for k, pair in enumerate((i, j) for i in range(n + 1) for j in range(n + 1 - i))}
    flat = np.array([(i, j, n - i - j) for i, j in index], dtype=float)
    triangles = [(index[i, j], index[i + 1, j], index[i, j + 1]) for i in range(n) for j in range(n - i)]
    triangles += [
        (index[i + 1, j], index[i + 1, j + 1], index[i, j + 1]) for i in range(n - 1) for j in range(n - 1 - i)
    ]
    directions = flat / np.linalg.norm(flat, axis=1)[:, None]
    radii = inner * (1.0 / inner) ** (np.arange(layers + 1) / layers)
    points = np.concatenate([r * directions for r in radii])
    elements, count = [], len(flat)
    for layer in range(layers):
        for triangle in triangles:
            a, b, c = sorted(v + layer * count for v in triangle)
            elements += [(a, b, c, c + count), (a, b, b + count, c + count), (a, a + count, b + count, c + count)]
    return round_off(points, np.array(elements), (inner, 1.0))


def round_off(points: np.ndarray, elements: np.ndarray, radii: Sequence[float]):
    """Mesh whose faces on the given radii are curved."""
    mesh = MeshTet(np.ascontiguousarray(points.T), np.ascontiguousarray(elements.T))
    for radius in radii:
        mesh = curve(mesh, lambda x, r=radius: r * x / np.linalg.norm(x, axis=0), on_radius(radius))
    return mesh


def on_radius(radius: float):
    """A function of points (3, N) that returns whether each is on the sphere of this radius about the origin."""
    return lambda x: np.abs(np.linalg.norm(x, axis=0) - radius) < 1e-9


def mapped(cells: Sequence[int], place: Callable[[np.ndarray], np.ndarray]):
    """A second-order mesh of the unit cube, cells along each edge, its nodes moved by place: (3, N) -> (3, N) [m]."""
    mesh = MeshTet.init_tensor(*[np.linspace(0.0, 1.0, n + 1) for n in cells])
    return replace(MeshTet2.from_mesh(mesh), doflocs=place(nodes(mesh).T))


def straight(mesh: MeshTet):
    """The same mesh with straight sides, without mid-side nodes."""
    return MeshTet(np.ascontiguousarray(mesh.doflocs[:, : mesh.nvertices]), mesh.t)


def between(bottom: float, top: float):
    """A slab one element thick in plane strain: z is held on both faces [m]."""
    return PrescribedDisplacement(lambda x: (x[2] < bottom + 1e-9) | (x[2] > top - 1e-9), (2,))
