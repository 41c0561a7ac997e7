"""Builds the arrays for volumes over points (kernels.points), once before a run."""

import numpy as np
from scipy.sparse import csr_array, diags_array

from massspring.body.body import Body
from massspring.body.points import FAR, NEAR, SLOPES, PointVolumes
from massspring.kernels.points.arrays import AREAS, BLOCK, CORNERS, NODES, POINTS, ROWS, SUMS, ElementRows, PointRows
from massspring.layout.facet_rows import facet_rows
from massspring.layout.sell_chunks import aligned
from massspring.layout.volume_inverse import coarser, inverse_at_rest, middles

REAL, SINGLE = np.dtype(np.float64), np.dtype(np.float32)
ROUNDING = 1e-9
"""Largest difference between forces that are the same, over the largest force."""


def point_rows(body: Body, volumes: PointVolumes, inverse_mass: np.ndarray) -> PointRows:
    """The arrays of `volumes` on `body`; `inverse_mass` (n,) [1/kg] is 0 at held nodes."""
    m, n = volumes.count, body.node_count
    schur = _compliance(volumes.jacobian(body.rest), inverse_mass)
    diagonal, inverse = inverse_at_rest(schur, coarser(volumes), middles(volumes, body.rest))
    closed = np.empty((0, 3), dtype=np.uint32) if volumes.closed is None else volumes.closed.triangles
    exact, rigidity, elastic = _element_rows(volumes, n, REAL), _rigidity(body, volumes), springs_are_elements(body)
    return PointRows(
        exact=exact,
        quick=_element_rows(volumes, n, SINGLE),
        area=aligned((len(exact.node) // NODES * POINTS * AREAS, BLOCK), SINGLE),
        velocity=aligned((n, 4), SINGLE),
        rigidity=_in_blocks(rigidity if elastic else np.zeros_like(rigidity), 0.0),
        elastic=elastic,
        per_weight=_in_blocks(1.0 / volumes.weight),
        bulk=body.local_bulk,
        rest_pressure=body.rest_pressure,
        eased=body.rest_lam.copy(),
        corner_eased=np.zeros_like(exact.corner_pressure),
        most_squeezed=np.full((1, BLOCK), -np.inf),
        closed_triangles=closed,
        closed_nodes=np.unique(closed).astype(np.uint32),
        closed_gradient=np.zeros((n, 3)),
        heavier=body.mass - body.moved_mass,
        diagonal=diagonal,
        inverse=inverse,
        node_vector=aligned((n, 4), REAL),
        field=aligned((n, 3), REAL),
        moved=aligned((n, 3), REAL),
        facets=facet_rows(body.contact_facets, body.rest, inverse_mass),
        **{name: np.zeros(m) for name in ("volume", "lam", "right", "search", "image", "allowed")},
    )


def _element_rows(volumes: PointVolumes, nodes: int, real: np.dtype) -> ElementRows:
    """The elements with scratch in the precision `real`."""
    blocks = -(-len(volumes.cells) // BLOCK)
    start, entry = _entries(volumes.corner_volume, volumes.tissue_count)
    return ElementRows(
        node=_in_blocks(volumes.cells.astype(np.uint32)),
        used=_in_blocks(np.ones((len(volumes.cells), 1), dtype=real), 0.0),
        own=float(NEAR),
        other=float(FAR),
        corner_volume=_in_blocks(volumes.corner_volume.astype(np.uint32)),
        volume_start=start,
        volume_entry=entry,
        tile=aligned((SUMS + POINTS, BLOCK), real),
        corner_pressure=aligned((blocks * CORNERS, BLOCK), real),
        corner_share=aligned((blocks * CORNERS, BLOCK), real),
        corner_force=aligned((POINTS * AREAS, BLOCK), real),
        push=aligned((ROWS, BLOCK), real),
        force=aligned((nodes, 4), real),
    )


def _rigidity(body: Body, volumes: PointVolumes) -> np.ndarray:
    """−mu w_q ∇b_i·∇b_j of the pairs of three corners at each point [N/m], (k, 24)."""
    slope = np.einsum("qja,kqai->kqji", np.linalg.pinv(SLOPES), volumes.gradient)  # ∇N_a = Σ_j ∂N_a/∂b_j ∇b_j
    first, second = np.triu_indices(3)
    product = np.einsum("kqpi,kqpi->kqp", slope[:, :, first], slope[:, :, second])
    return (-body.rest_pressure * volumes.weight[:, :, None] * product).reshape(len(volumes.cells), -1)


def springs_are_elements(body: Body) -> bool:
    """Whether the springs of a body are the stiffness mu K of its elements, mu its pressure at rest, and nothing else:
    tried on random displacements."""
    volumes, springs = body.kept, body.springs
    if not isinstance(volumes, PointVolumes) or len(body.membrane.triangles) or springs.rest_length.any():
        return False
    u, force = np.random.default_rng(0).standard_normal((body.node_count, 3)), np.zeros((body.node_count, 3))
    strain = np.einsum("kqai,kac->kqic", volumes.gradient, u[volumes.cells])
    part = body.rest_pressure * np.einsum("kq,kqai,kqic->kac", volumes.weight, volumes.gradient, strain)
    np.subtract.at(force, volumes.cells, part)
    size = float(np.abs(force).max())
    pull = springs.stiffness[:, None] * (u[springs.ends[:, 1]] - u[springs.ends[:, 0]])
    np.subtract.at(force, springs.ends[:, 0], pull)
    np.add.at(force, springs.ends[:, 1], pull)
    return float(np.abs(force).max()) <= ROUNDING * size


def _compliance(rows: csr_array, inverse_mass: np.ndarray) -> csr_array:
    """J W Jᵀ of the rows (m, 3n) of J."""
    return csr_array(rows @ diags_array(np.repeat(inverse_mass, 3)) @ rows.T)


def _in_blocks(table: np.ndarray, spare: float | None = None) -> np.ndarray:
    """A table of elements (k, c) in blocks: each row has one column of BLOCK elements, (c b, BLOCK); unused places
    repeat the first element, or are `spare`."""
    count, width = table.shape
    blocks = -(-count // BLOCK)
    filled = np.full((blocks * BLOCK, width), table[:1] if spare is None else spare, dtype=table.dtype)
    filled[:count] = table
    rows = aligned((blocks * width, BLOCK), table.dtype)
    rows[:] = filled.reshape(blocks, BLOCK, width).transpose(0, 2, 1).reshape(-1, BLOCK)
    return rows


def _entries(table: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """For each of `count` owners named in `table` (k, c): its first entry, (count + 1,), and the flat indices of its
    entries in a blocked table, (k c,)."""
    elements, width = table.shape
    element, column = np.repeat(np.arange(elements), width), np.tile(np.arange(width), elements)
    place = (element // BLOCK * width + column) * BLOCK + element % BLOCK
    order = np.argsort(table.ravel(), kind="stable")
    start = np.concatenate([[0], np.cumsum(np.bincount(table.ravel(), minlength=count))])
    return start.astype(np.uint32), place[order].astype(np.uint32)
