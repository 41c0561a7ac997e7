"""Tables of the boundary for the kernels, and the assembly of facet matrices into the tangent."""

from typing import NamedTuple

import numpy as np

from reference_fem.compiled import compiled


class Surface(NamedTuple):
    """Tables of the boundary for the contact kernel: nf facets, nq points each."""

    dofs: np.ndarray
    """Unknowns of the six nodes, u_x first, then u_y, u_z, (nf, 18) uint32."""
    positions: np.ndarray
    """Slots of the packed upper triangle of 18 x 18, (nf, 171) uint32."""
    rest: np.ndarray
    """Rest coordinates, interleaved like the unknowns, (3 N2,) [m]."""
    values: np.ndarray
    """Six functions at the points, (nq, 6)."""
    weights: np.ndarray
    """Rest areas, (nf, nq) [m²]."""
    penalty: np.ndarray
    """Basic eps of each facet, (nf,) [Pa/m]."""


def point_positions(x: np.ndarray, surface: Surface):
    """Positions of the contact points, (nf, nq, 3) [m]."""
    moved = (surface.rest + x[: len(surface.rest)])[surface.dofs].reshape(len(surface.dofs), 3, -1)
    return np.einsum("qa,fia->fqi", surface.values, moved)


@compiled()
def point_into(N: np.ndarray, nodes: np.ndarray, y: np.ndarray):
    """y = sum N_a x_a (3,), the point of a facet with nodes x (·, 3) where its functions are N [m]."""
    for i in range(3):
        y[i] = 0.0
        for a in range(len(N)):
            y[i] += N[a] * nodes[a, i]


@compiled()
def add_point_stiffness(N: np.ndarray, k: np.ndarray, K: np.ndarray):
    """K[ia, jb] += k_ij N_a N_b."""
    count = len(N)
    for i in range(3):
        for a in range(count):
            for j in range(3):
                for b in range(count):
                    K[count * i + a, count * j + b] += k[i, j] * N[a] * N[b]


@compiled()
def scatter(K: np.ndarray, positions: np.ndarray, values: np.ndarray):
    """values[positions] += packed upper triangle of K."""
    slot = 0
    for a in range(K.shape[0]):
        for b in range(a, K.shape[0]):
            values[positions[slot]] += K[a, b]
            slot += 1
