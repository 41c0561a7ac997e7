"""Bodies made without a mesher: a distorted block of tetrahedra and an icosphere."""

import numpy as np
import pytest
from scipy.spatial import Delaunay

from massspring import Body, Material, Volumes, surface_body, tetrahedral_body
from massspring.kernels.arrays.layout import Contacts
from massspring.kernels.contact.node_contact import SLIDES
from massspring.kernels.fused.chunk import pad_positions
from massspring.kernels.fused.sweep import predict_from_places
from massspring.kernels.jit.decorators import njit_lean
from tests.massspring.rows import KINDS

SOFT = Material(shear_modulus=1800.0, density=1060.0)
CUBE_TETRAHEDRA = np.array([[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]])
"""Kuhn's six tetrahedra of a cube whose corner (x, y, z) has number x + 2 y + 4 z; neighbours match."""


def block(cells: tuple[int, int, int], edge: float = 0.02, distortion: float = 0.15) -> tuple[np.ndarray, ...]:
    """Points, outward boundary triangles and tetrahedra of a block with moved interior and surface nodes."""
    shape = tuple(c + 1 for c in cells)
    grid = np.stack(np.meshgrid(*(np.arange(s) for s in shape), indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(grid)).reshape(shape)
    corners = [
        number[x : x + cells[0], y : y + cells[1], z : z + cells[2]].ravel()
        for z in (0, 1)
        for y in (0, 1)
        for x in (0, 1)
    ]
    tetrahedra = np.stack(corners, axis=1)[:, CUBE_TETRAHEDRA].reshape(-1, 4)
    random = np.random.default_rng(7)
    points = edge * (grid + distortion * random.uniform(-1, 1, grid.shape))
    return points, boundary(tetrahedra), tetrahedra


def boundary(tetrahedra: np.ndarray) -> np.ndarray:
    """Outward faces of single cells, (f, 3)."""
    faces = tetrahedra[:, [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]].reshape(-1, 3)
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return faces[first[count == 1]]


def hollow_block(cells: int = 4, edge: float = 0.02) -> tuple[np.ndarray, ...]:
    """A block whose inner cells are missing: points, all boundary triangles, tetrahedra, triangles round the lumen."""
    points, _, tetrahedra = block((cells, cells, cells), edge)
    cell = np.arange(cells**3)
    inside = np.all([(c > 0) & (c < cells - 1) for c in np.unravel_index(cell, (cells,) * 3)], axis=0)
    outside = ~np.repeat(inside, len(CUBE_TETRAHEDRA))
    used, renumbered = np.unique(tetrahedra[outside], return_inverse=True)
    tetrahedra = renumbered.reshape(-1, 4)
    triangles = boundary(tetrahedra)
    centre = points[used].mean(axis=0)
    reach = np.abs(points[used] - centre).max(axis=1)
    lumen = triangles[(reach[triangles] < (cells / 2 - 0.5) * edge).all(axis=1)]
    return points[used], triangles, tetrahedra, lumen[:, ::-1].copy()


def icosphere(levels: int, radius: float = 0.05) -> tuple[np.ndarray, np.ndarray]:
    """Points and outward triangles of an icosahedron split `levels` times: 10 · 4^levels + 2 nodes."""
    golden = (1 + 5**0.5) / 2
    points = [(0, s, t * golden) for s in (-1, 1) for t in (-1, 1)]
    points = np.array(points + [(y, z, x) for x, y, z in points] + [(z, x, y) for x, y, z in points], dtype=float)
    near = np.linalg.norm(points[:, None] - points[None], axis=2) < 2.1
    triples = [
        (i, j, k) for i in range(12) for j in range(i) for k in range(j) if near[i, j] and near[j, k] and near[k, i]
    ]
    triangles = np.array(triples)
    for _ in range(levels):
        edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        unique, inverse = np.unique(edges, axis=0, return_inverse=True)
        middle = len(points) + inverse.reshape(-1, 3)
        points = np.vstack([points, points[unique].mean(axis=1)])
        a, b, c = triangles.T
        ab, bc, ca = middle.T
        triangles = np.vstack([np.column_stack(t) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    points *= radius / np.linalg.norm(points, axis=1)[:, None]
    p, q, r = points[triangles].transpose(1, 0, 2)
    inward = np.einsum("ij,ij->i", np.cross(q - p, r - p), p) < 0
    triangles[inward] = triangles[inward][:, [0, 2, 1]]
    return points, triangles


@pytest.fixture(scope="session")
def block_body() -> Body:
    """3 × 3 × 2 cells, 162 tetrahedra, distorted by 15 %."""
    return tetrahedral_body(*block((3, 3, 2)), SOFT)


@pytest.fixture(scope="session")
def filled_ball() -> Body:
    """217 nodes on spherical shells, turned against each other so that no four of them lie flat; 734 tetrahedra."""
    turn, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    shells = [icosphere(2)[0], 0.68 * icosphere(1)[0] @ turn, 0.36 * icosphere(0)[0] @ turn.T, np.zeros((1, 3))]
    points = np.vstack(shells)
    tetrahedra = Delaunay(points).simplices.astype(np.int64)
    a, b, c, d = points[tetrahedra].transpose(1, 0, 2)
    negative = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) < 0
    tetrahedra[negative] = tetrahedra[negative][:, [0, 2, 1, 3]]
    return tetrahedral_body(points, boundary(tetrahedra), tetrahedra, SOFT)


@pytest.fixture(scope="session")
def ball_body() -> Body:
    """Surface body of 162 nodes and its virtual nodes."""
    return surface_body(*icosphere(2), SOFT)


@pytest.fixture(scope="session")
def hollow_body() -> Body:
    """A wall of one cell around a lumen of 2 × 2 × 2 cells, both kept."""
    points, triangles, tetrahedra, lumen = hollow_block()
    body = tetrahedral_body(points, triangles, tetrahedra, SOFT)
    return body.keeping(Volumes.closed_surfaces(body, {"wall": triangles, "lumen": lumen}))


@pytest.fixture(params=KINDS)
def kept_body(request: pytest.FixtureRequest) -> Body:
    """Every kind of volumes: the whole of either kind of body, wall and lumen, regions, one per node."""
    return body_of(request.param, request)


def body_of(kind: str, request: pytest.FixtureRequest) -> Body:
    """The body of a kind of KINDS."""
    if kind in ("regions", "nodal"):
        block_body = request.getfixturevalue("block_body")
        return block_body.keeping(Volumes.nodal(block_body) if kind == "nodal" else Volumes.regions(block_body, 7))
    return request.getfixturevalue(f"{kind}_body")


@pytest.fixture(params=["hollow", "regions", "nodal"])
def several(request: pytest.FixtureRequest, block_body: Body, hollow_body: Body) -> Body:
    """Bodies that keep more than one volume."""
    kinds = {"regions": Volumes.regions(block_body, 7), "nodal": Volumes.nodal(block_body)}
    return hollow_body if request.param == "hollow" else block_body.keeping(kinds[request.param])


@pytest.fixture(params=["block", "ball"])
def body(request: pytest.FixtureRequest) -> Body:
    """Either kind of body."""
    return request.getfixturevalue(f"{request.param}_body")


def list_active(contacts: Contacts) -> None:
    """Lists the touched nodes, as the contact search does for those that it activates."""
    nodes = np.flatnonzero(contacts.mode)
    contacts.active[: len(nodes)] = nodes
    contacts.active_count[0] = len(nodes)


def activate(contacts: Contacts, nodes: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Activates free nodes (c,) on one obstacle, with random normals; the target speeds along them [m/s], (c,)."""
    normals = rng.normal(size=(len(nodes), 3))
    contacts.normal[nodes] = normals / np.linalg.norm(normals, axis=1)[:, None]
    approach = 0.05 * rng.normal(size=len(nodes))
    contacts.contact_id[nodes], contacts.mode[nodes] = 1, SLIDES
    contacts.direction[nodes] = contacts.normal[nodes]
    contacts.v_target[nodes] = approach[:, None] * contacts.normal[nodes]
    list_active(contacts)
    return approach


@njit_lean
def gather_and_predict(model, nodes, work, boundary, keeps):
    """v* and (V, G·v*, G·W·G) from `x`, as `predict_from_places`."""
    pad_positions(nodes, work, 0, nodes.x.shape[0])
    return predict_from_places(model, nodes, work, boundary, keeps)
