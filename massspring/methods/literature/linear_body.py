"""A held organ as a linear elastic body: K u = f of its elements at rest, held nodes prescribed (eq. 14.1, 14.2)."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.linalg import splu

from massspring.analysis.stiffness import blocks, stiffness_at_rest
from massspring.body.body import Body
from massspring.errors import MassSpringError
from massspring.kernels.arrays.layout import BoundaryConditions, Model
from massspring.methods.elements.implicit_elements import ImplicitElements
from massspring.methods.elements.tangent import elements_of
from massspring.world.obstacles import Surroundings

STRAIGHT = 1e-6
"""Distance from a straight line, over the extent of the held nodes, within which held nodes leave the body free to
rotate about the line."""


@dataclass(frozen=True, eq=False)
class LinearBody:
    """n nodes, held in g attachments; displacements are flat, (3n,)."""

    rest: np.ndarray
    """[m], (n, 3)."""
    free: np.ndarray
    """Numbers of the coordinates that are not held, (f,)."""
    inner: csr_array
    """K of the free coordinates [N/m], (f, f)."""
    factor: Any
    """Its LU factors."""
    follow: np.ndarray
    """Ψ: displacements at rest when one attachment moves by 1 along an axis [1], (3n, 3g)."""
    pull: csr_array
    """Force of attachments per displacement, K summed over their nodes [N/m], (3g, 3n)."""
    mass: np.ndarray
    """Gravitational mass of each node [kg], (n,)."""
    inertia: np.ndarray
    """Inertial mass of each node [kg], (n,)."""
    held_mass: np.ndarray
    """Gravitational mass of the nodes of each attachment [kg], (g,)."""

    def solve(self, forces: np.ndarray) -> np.ndarray:
        """K⁻¹ `forces` (3n, …) [N] with held nodes at rest [m]."""
        moved = np.zeros_like(forces)
        moved[self.free] = self.factor.solve(np.ascontiguousarray(forces[self.free]))
        return moved

    def held_impulse(self, u: np.ndarray, boundary: BoundaryConditions) -> np.ndarray:
        """Impulse of each attachment in a step that ends at displacements `u` (3n,) [m]: (g, 3) [N s] (eq. 3.6)."""
        force = (self.pull @ u).reshape(-1, 3)
        return boundary.dt * (force - self.held_mass[:, None] * boundary.gravity)


def linear_stiffness(body: Body, bulk_modulus: float) -> csr_array:
    """K [N/m] of (13.1) at rest with a bulk modulus [Pa] at every point of every element, (3n, 3n) (eq. 14.1)."""
    elements = elements_of(body, bulk_modulus)
    weight, gradient = bulk_modulus * elements.weight, elements.gradient
    block = np.einsum("kq,kqai,kqbj->kabij", weight, gradient, gradient, optimize=True)
    nodes = elements.node.shape[1]
    rows, columns = np.repeat(elements.node, nodes, axis=1).ravel(), np.tile(elements.node, (1, nodes)).ravel()
    volume = blocks(rows, columns, block.reshape(-1, 3, 3), body.node_count)
    return csr_array(stiffness_at_rest(body) + volume)


def linear_body(body: Body, model: Model, bulk_modulus: float) -> LinearBody:
    """The body at rest with the held nodes of `model`. Raises MassSpringError if these allow a rigid motion."""
    check_held(model)
    stiffness = linear_stiffness(body, bulk_modulus)
    n, groups = body.node_count, int(model.held_group.max()) + 1
    mask = np.repeat(model.inverse_mass > 0.0, 3)
    free = np.flatnonzero(mask)
    held = 3 * model.held_nodes.astype(np.int64)[:, None] + np.arange(3)
    column = 3 * model.held_group.astype(np.int64)[:, None] + np.arange(3)
    follow = np.zeros((3 * n, 3 * groups))
    follow[held.ravel(), column.ravel()] = 1.0
    carried = csr_array((np.ones(held.size), (column.ravel(), held.ravel())), shape=(3 * groups, 3 * n))
    inner = csr_array(stiffness[free][:, free])
    factor = splu(inner.tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    follow[free] = -factor.solve((stiffness @ follow)[free])
    return LinearBody(
        rest=body.rest,
        free=free,
        inner=inner,
        factor=factor,
        follow=follow,
        pull=csr_array(carried @ stiffness),
        mass=body.mass,
        inertia=body.moved_mass,
        held_mass=np.bincount(model.held_group, weights=body.mass[model.held_nodes], minlength=groups),
    )


def check_held(model: Model) -> None:
    """Raises MassSpringError if no nodes are held, or all held nodes lie on one line."""
    place = model.held_rest
    extent = np.linalg.svd(place - place.mean(axis=0), compute_uv=False) if len(place) > 2 else np.zeros(3)
    if not extent[1] > STRAIGHT * extent[0]:
        raise MassSpringError(
            "the clamped nodes lie on a line, so the body can rotate about it; clamp three nodes that are not collinear"
        )


def why_not_linear(body: Body) -> str | None:
    """Why a body cannot be treated as linear elastic elements; None if it can."""
    return ImplicitElements().why_not(body)


def why_not_among(surroundings: Surroundings) -> str | None:
    """Why a linear body does not support such surroundings; None if it does."""
    if not surroundings.attachments:
        return "no nodes are clamped, and a linear body swells when it rotates; clamp part of it"
    if surroundings.rough:
        return "its contacts are frictionless; take implicit_elements"
    if surroundings.targets:
        return "its elements follow no target of a volume; take explicit_elements"
    return None


def check_ratio(method: str, name: str, value: float) -> None:
    """Raises MassSpringError for a bulk modulus over mu with which a body has no stiffness in some direction."""
    if not 1.0 < value < float("inf"):
        raise MassSpringError(f"{method}'s {name} is {value} mu; it must be above 1 and finite")
