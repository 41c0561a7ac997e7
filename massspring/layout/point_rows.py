"""Builds the arrays for volumes over points (kernels.points), once before a run."""

import numpy as np
from scipy.sparse import csr_array, diags_array

from massspring.body.body import Body
from massspring.body.points import FAR, NEAR, PointVolumes
from massspring.kernels.points.arrays import AREAS, BLOCK, CORNERS, POINTS, ROWS, SUMS, PointRows
from massspring.layout.facet_rows import facet_rows
from massspring.layout.sell_chunks import aligned
from massspring.layout.volume_inverse import coarser, inverse_at_rest, middles

REAL = np.dtype(np.float64)


def point_rows(body: Body, volumes: PointVolumes, inverse_mass: np.ndarray) -> PointRows:
    """The arrays of `volumes` on `body`; `inverse_mass` (n,) [1/kg] is 0 at held nodes."""
    m, n, blocks = volumes.count, body.node_count, -(-len(volumes.cells) // BLOCK)
    schur = _compliance(volumes.jacobian(body.rest), inverse_mass)
    diagonal, inverse = inverse_at_rest(schur, coarser(volumes), middles(volumes, body.rest))
    closed = np.empty((0, 3), dtype=np.uint32) if volumes.closed is None else volumes.closed.triangles
    node_start, node_entry = _entries(volumes.cells, n, 3)
    volume_start, volume_entry = _entries(volumes.corner_volume, volumes.tissue_count, 1)
    return PointRows(
        node=_in_blocks(volumes.cells.astype(np.uint32)),
        per_weight=_in_blocks(1.0 / volumes.weight),
        own=float(NEAR),
        other=float(FAR),
        bulk=body.local_bulk,
        rest_pressure=body.rest_pressure,
        eased=body.rest_lam.copy(),
        corner_volume=_in_blocks(volumes.corner_volume.astype(np.uint32)),
        node_start=node_start,
        node_entry=node_entry,
        volume_start=volume_start,
        volume_entry=volume_entry,
        closed_triangles=closed,
        closed_nodes=np.unique(closed).astype(np.uint32),
        closed_gradient=np.zeros((n, 3)),
        heavier=body.mass - body.moved_mass,
        area=aligned((blocks * POINTS * AREAS, BLOCK), REAL),
        stretch=aligned((blocks * POINTS, BLOCK), REAL),
        most_squeezed=np.full((1, BLOCK), -np.inf),
        corner_pressure=aligned((blocks * CORNERS, BLOCK), REAL),
        corner_share=aligned((blocks * CORNERS, BLOCK), REAL),
        element_push=aligned((blocks * ROWS, BLOCK), REAL),
        tile=aligned((SUMS + POINTS, BLOCK), REAL),
        push=aligned((n, 3), REAL),
        diagonal=diagonal,
        inverse=inverse,
        node_vector=aligned((n, 4), REAL),
        field=aligned((n, 3), REAL),
        moved=aligned((n, 3), REAL),
        facets=facet_rows(body.contact_facets, body.rest, inverse_mass),
        **{name: np.zeros(m) for name in ("volume", "lam", "right", "search", "image", "allowed")},
    )


def _compliance(rows: csr_array, inverse_mass: np.ndarray) -> csr_array:
    """J W Jᵀ of the rows (m, 3n) of J."""
    return csr_array(rows @ diags_array(np.repeat(inverse_mass, 3)) @ rows.T)


def _in_blocks(table: np.ndarray) -> np.ndarray:
    """A table of elements (k, c) in blocks: each row has one column of BLOCK elements, (c b, BLOCK); unused places
    repeat the first element."""
    count, width = table.shape
    blocks = -(-count // BLOCK)
    filled = np.full((blocks * BLOCK, width), table[:1], dtype=table.dtype)
    filled[:count] = table
    rows = aligned((blocks * width, BLOCK), table.dtype)
    rows[:] = filled.reshape(blocks, BLOCK, width).transpose(0, 2, 1).reshape(-1, BLOCK)
    return rows


def _entries(table: np.ndarray, count: int, components: int) -> tuple[np.ndarray, np.ndarray]:
    """For each of `count` owners named in `table` (k, c): its first entry, (count + 1,), and the flat indices of its
    entries in a blocked table with `components` rows per column, (k c,)."""
    elements, width = table.shape
    element, column = np.repeat(np.arange(elements), width), np.tile(np.arange(width), elements)
    place = ((element // BLOCK * width + column) * components) * BLOCK + element % BLOCK
    order = np.argsort(table.ravel(), kind="stable")
    start = np.concatenate([[0], np.cumsum(np.bincount(table.ravel(), minlength=count))])
    return start.astype(np.uint32), place[order].astype(np.uint32)
