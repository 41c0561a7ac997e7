"""Common parts of methods on tetrahedra: their arrays, and the loop with an explicit pressure per cell."""

from dataclasses import replace

import numpy as np
from scipy.sparse import coo_array, csr_array

from massspring.body.body import Body
from massspring.kernels.arrays.layout import BoundaryConditions, Push
from massspring.kernels.forces.tetrahedron_volumes import (
    Cells,
    add_barycentre_forces,
    add_volume_forces,
    fill,
    mean_pressure,
)
from massspring.kernels.jit.decorators import njit_lean
from massspring.kernels.jit.stage_clock import VOLUME, end_stage
from massspring.kernels.step.begin import add_to_prediction, begin_step, open_frame, search_contacts
from massspring.kernels.step.end import end_step
from massspring.layout.state import State
from massspring.methods.method import begin_frame


def cells_of(body: Body) -> Cells:
    """The tetrahedra of a body at rest, with scratch arrays."""
    corners = body.rest[body.tetrahedra]
    reach = np.linalg.norm(corners - corners.mean(axis=1, keepdims=True), axis=2).sum(axis=1)
    k, n = len(body.tetrahedra), body.node_count
    return Cells(
        tetrahedra=body.tetrahedra,
        rest_volume=body.tetrahedron_volumes,
        rest_whole=float(body.rest_volumes[0]),
        filling=np.ones(1),
        rest_reach=reach,
        slope=np.zeros((k, 3, 3)),
        **{name: np.zeros(k) for name in ("pressure", "right", "diagonal", "search", "image")},
        **{name: np.zeros((n, 3)) for name in ("y", "gradient", "push")},
    )


def cell_stiffness(body: Body, slopes: np.ndarray, weight: np.ndarray) -> csr_array:
    """B = √weight_t dC_t/dx [√(N/m)], (3n, k), of energies ½ weight_t C_t², `slopes` dC_t/dx (k, 4, 3) (eq. 10.9)."""
    k = len(body.tetrahedra)
    rows = 3 * body.tetrahedra.astype(np.int64)[:, :, None] + np.arange(3)
    columns = np.broadcast_to(np.arange(k)[:, None, None], rows.shape)
    values = np.sqrt(weight)[:, None, None] * slopes
    return coo_array((values.ravel(), (rows.ravel(), columns.ravel())), shape=(3 * body.node_count, k)).tocsr()


@njit_lean
def cells_frame(frame, cells, bulk_modulus, barycentric):
    """One frame of symplectic Euler with an explicit pressure in every cell (eq. 3.1, 3.2, 3.5, 3.7, 10.11, 10.12)."""
    nodes, boundary, diagnostics = frame.nodes, frame.boundary, frame.diagnostics
    nothing = Push(nodes.gradient, 0.0)
    open_frame(frame)
    for step in range(boundary.position.shape[0]):
        fill(cells, boundary, step)
        begin_step(frame, step, False)
        cells.push[:] = 0.0
        if barycentric:
            add_barycentre_forces(nodes.x, cells, bulk_modulus, cells.push)
        else:
            diagnostics.singular[0] += add_volume_forces(nodes.x, cells, bulk_modulus, cells.push)
        add_to_prediction(frame.model, nodes, cells.push, boundary.dt)
        end_stage(diagnostics.stage_times, VOLUME)
        search_contacts(frame, step, nothing)
        end_step(frame, step, nothing, 0.0, None)
    return mean_pressure(cells)


def own_cells(state: State) -> Cells:
    """The cells of the state with a copy of their memory, so that a frame does not change the old state."""
    return state.memory._replace(pressure=state.memory.pressure.copy(), filling=state.memory.filling.copy())


def push_cells(state: State, boundary: BoundaryConditions, bulk_modulus: float, barycentric: bool) -> State:
    """One frame of `cells_frame`."""
    after = begin_frame(state, boundary)
    cells = own_cells(state)
    lam = cells_frame(after.frame(boundary), cells, bulk_modulus, barycentric)
    return replace(after, lam=np.array([lam]), memory=cells)
