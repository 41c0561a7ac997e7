"""Springs as arguments of compiled loops: triangle springs, and the other springs in slices of 64 nodes."""

from typing import NamedTuple

import numpy as np

from massspring.kernels.jit.by_address import by_address


@by_address
class Membrane(NamedTuple):
    """t triangle springs; edge a of a triangle lies opposite its node a."""

    triangles: np.ndarray
    """(t, 3) uint32."""
    rest_square: np.ndarray
    """L_a² [m²], (t, 3)."""
    stiffness: np.ndarray
    """k_a of each edge [N/m³], (t, 3)."""
    coupling: np.ndarray
    """c_a of the two edges that meet at node a [N/m³], (t, 3)."""


@by_address
class Slices(NamedTuple):
    """Neighbours of all nodes: S slices of 64 nodes, r rows of 64 neighbours.

    The first rows of a slice walk the rings of its nodes: the neighbours on the kept surface in order, first to last.
    The others are all remaining springs. Shorter lists are filled up with springs of no stiffness. The first `pieces`
    slices hold pieces of nodes that have too many neighbours for a lane, or several rings.
    """

    node: np.ndarray
    """(S, 64) uint32; empty lanes repeat a node of the slice."""
    lanes: np.ndarray
    """Lanes in use, (S,) int64."""
    first: np.ndarray
    """First node of a full slice whose nodes have consecutive numbers, else -1, (S,) int64."""
    start: np.ndarray
    """First row of each slice, (S + 1,) int64."""
    rings: np.ndarray
    """Number of rows of each slice that are rings, (S,) int64."""
    neighbour: np.ndarray
    """(r, 64) uint32."""
    rest_length: np.ndarray
    """[m], (r, 64)."""
    stiffness: np.ndarray
    """The u different rows of stiffnesses [N/m], (u, 64): few if all springs of a kind are equally stiff; 0 for no
    spring."""
    stiffness_row: np.ndarray
    """Index into `stiffness` of each row, (r,) uint32."""
    inverse_mass: np.ndarray
    """[1/kg], (S, 64)."""
    pieces: int
    split_node: np.ndarray
    """Nodes in pieces, (q,) uint32."""
    split_start: np.ndarray
    """First entry of each split node in `split_piece`, (q + 1,) int64."""
    split_piece: np.ndarray
    """Slice × 64 + lane of each piece, int64."""
    held_start: np.ndarray
    """Where in `held_lane` each slice begins, (S + 1,) int64."""
    held_lane: np.ndarray
    """Lanes of the nodes whose motion is prescribed, but for those in pieces, int64."""
    origin: int
    """The node to which the positions are relative in the sum for the volume."""
    without_length: bool
    """Whether all springs have a rest length of 0."""
