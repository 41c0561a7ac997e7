"""The neighbours of all nodes in the layout of `kernels.fused`: rings first, slices of 64 nodes with lists of similar
length."""

from dataclasses import dataclass

import numpy as np

from massspring.body.springs import Springs
from massspring.kernels.arrays.layout import Slices
from massspring.kernels.fused.chunk import LANES

LONGEST, PIECE = 24, 10
"""LONGEST: springs outside its ring up to which a node takes one lane. A node with more is split into pieces of PIECE
springs: a virtual node joined to forty others would make 63 lanes wait for it."""
CACHE_LINE = 64  # bytes
WINDOW = 2048
"""Nodes along a space-filling curve among which lists are sorted by length. In wider windows the neighbours of a slice
are spread over the body and miss the first-level cache; narrower windows have more empty places."""


def aligned(shape: tuple[int, ...], real: np.dtype) -> np.ndarray:
    """Zeros aligned to a cache line, so that no vector load crosses two lines (saves 20 %)."""
    size = int(np.prod(shape)) * real.itemsize
    room = np.zeros(size + CACHE_LINE, dtype=np.uint8)
    begin = -room.ctypes.data % CACHE_LINE
    return room[begin : begin + size].view(real).reshape(shape)


@dataclass(frozen=True)
class _Lists:
    """Lists of neighbours, flat: for every entry its list, its place in the list, its node, and its spring (-1:
    none)."""

    of: np.ndarray
    at: np.ndarray
    node: np.ndarray
    spring: np.ndarray


def rings(triangles: np.ndarray, nodes: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The closed walks round the nodes of a closed surface: (centre (c,), and of its entries: walk, place, neighbour).

    Walks have the orientation of the triangles. A node at which two sheets touch has two walks.
    """
    corners = np.concatenate([np.roll(triangles, -turn, axis=1) for turn in range(3)]).astype(np.int64)
    key = corners[:, 0] * nodes + corners[:, 1]
    order = np.argsort(key)
    centre, neighbour = corners[order, 0], corners[order, 1]
    after = np.searchsorted(key[order], centre * nodes + corners[order, 2])
    seen = np.zeros(len(key), dtype=bool)
    centres, walks, places, visits, count = [], [], [], [], 0
    while not seen.all():
        rest = np.flatnonzero(~seen)
        first = rest[np.unique(centre[rest], return_index=True)[1]]
        centres.append(centre[first])
        walk, now, place = np.arange(count, count + len(first)), first, 0
        count += len(first)
        while len(now):
            seen[now] = True
            walks.append(walk)
            places.append(np.full(len(now), place))
            visits.append(now)
            going = after[now] != first
            walk, first, now, place = walk[going], first[going], after[now][going], place + 1
    return np.concatenate(centres), np.concatenate(walks), np.concatenate(places), neighbour[np.concatenate(visits)]


def _lists_of(springs: Springs, triangles: np.ndarray, nodes: int) -> tuple[np.ndarray, _Lists, _Lists]:
    """Centre of each ring, the entries of the rings with their springs, and all other springs node by node."""
    ends = springs.ends.astype(np.int64)
    here, there = np.concatenate([ends[:, 0], ends[:, 1]]), np.concatenate([ends[:, 1], ends[:, 0]])
    number = np.tile(np.arange(springs.count), 2)
    centre, walk, place, neighbour = rings(triangles, nodes)
    spring, other = np.full(len(walk), -1), np.ones(len(here), dtype=bool)
    if springs.count:
        keys, first = np.unique(here * nodes + there, return_index=True)
        key = centre[walk] * nodes + neighbour
        index = np.minimum(np.searchsorted(keys, key), len(keys) - 1)
        joined = keys[index] == key
        spring[joined] = number[first[index[joined]]]
        other[first[index[joined]]] = False
    order = np.flatnonzero(other)[np.argsort(here[other], kind="stable")]
    owner = here[order]
    at = np.arange(len(owner)) - np.searchsorted(owner, owner)
    return centre, _Lists(walk, place, neighbour, spring), _Lists(owner, at, there[order], number[order])


@dataclass(frozen=True)
class _Slots:
    """Lanes of slices, with the node, ring and other springs of each."""

    node: np.ndarray
    """Node of each lane, (S, LANES); empty lanes repeat a node of their slice."""
    lanes: np.ndarray
    """Lanes in use, (S,)."""
    pieces: int
    """Number of slices of pieces, which come first."""
    ring: _Lists
    """Rings by lane: `of` is slice × LANES + lane."""
    rest: _Lists


def _slots(centre: np.ndarray, ring: _Lists, rest: _Lists, place_of: np.ndarray) -> _Slots:
    """Assigns a lane to every node, or several if it has too many neighbours or several rings, in the order of places
    on a curve."""
    nodes = len(place_of)
    rings_of, springs_of = np.bincount(centre, minlength=nodes), np.bincount(rest.of, minlength=nodes)
    split = (rings_of > 1) | (springs_of > LONGEST)
    # First the rings, then the springs of nodes without one and those of split nodes, in pieces.
    pieces = np.where(split, -(-springs_of // PIECE), (rings_of == 0).astype(np.int64))
    first_piece = len(centre) + np.concatenate([[0], np.cumsum(pieces)])[:-1]
    owner = np.concatenate([centre, np.repeat(np.arange(nodes), pieces)])
    own = first_piece.copy()
    own[centre] = np.arange(len(centre))
    cut = split[rest.of]
    rest_of = np.where(cut, first_piece[rest.of] + rest.at // PIECE, own[rest.of])
    rest_at = np.where(cut, rest.at % PIECE, rest.at)
    lengths = [np.bincount(of, minlength=len(owner)) for of in (ring.of, rest_of)]
    along = place_of[owner]
    order = np.lexsort((along, lengths[1], lengths[0], along // WINDOW, ~split[owner]))
    parted = int(split[owner].sum())
    piece_slices = -(-parted // LANES)
    place = np.empty(len(owner), dtype=np.int64)
    place[order] = np.r_[np.arange(parted), piece_slices * LANES + np.arange(len(owner) - parted)]
    slices = piece_slices - (-(len(owner) - parted) // LANES)
    lanes = np.bincount(place // LANES, minlength=slices)
    node = np.zeros(slices * LANES, dtype=np.int64)
    node[place] = owner
    node = node.reshape(-1, LANES)
    node = np.where(np.arange(LANES) < lanes[:, None], node, node[:, :1])
    ring = _Lists(place[ring.of], ring.at, ring.node, ring.spring)
    return _Slots(node, lanes, piece_slices, ring, _Lists(place[rest_of], rest_at, rest.node, rest.spring))


def _rows(lists: _Lists, slices: int) -> np.ndarray:
    """Length of the longest list of each slice, (S,)."""
    longest = np.zeros(slices, dtype=np.int64)
    np.maximum.at(longest, lists.of // LANES, lists.at + 1)
    return longest


def _by_node(node: np.ndarray, piece: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The nodes, ascending; the pieces node by node; the first piece of each node."""
    order = np.argsort(node, kind="stable")
    owners, start = np.unique(node[order], return_index=True)
    return owners, piece[order], np.r_[start, len(node)].astype(np.int64)


def places_in_slices(springs: Springs, triangles: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """New number of each node, (n,), such that the nodes of a slice are consecutive and nodes in pieces come last.

    `triangles` (f, 3): the kept surface; `rest` (n, 3) [m]. Applied to a body with these numbers, it leaves them
    unchanged.
    """
    slots = _slots(*_lists_of(springs, triangles, len(rest)), along_curve(rest))
    used = np.arange(LANES) < slots.lanes[:, None]
    whole, split = (slots.node[part][used[part]] for part in (np.s_[slots.pieces :], np.s_[: slots.pieces]))
    place = np.empty(len(rest), dtype=np.int64)
    place[np.concatenate([whole, np.unique(split)])] = np.arange(len(rest))
    return place


def _springs_by_lane(
    slots: _Slots, springs: Springs, start: np.ndarray, ring_rows: np.ndarray, real: np.dtype
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Neighbours, their rest lengths [m] and stiffnesses [N/m], (r, LANES) each: rings first, `ring_rows` (S,) of them.

    A short ring is filled with its first neighbour, a short list with the node itself.
    """
    begins = slots.node.copy()
    first = slots.ring.at == 0
    begins.reshape(-1)[slots.ring.of[first]] = slots.ring.node[first]
    of_row = np.repeat(np.arange(len(slots.node)), np.diff(start))
    in_ring = np.arange(start[-1]) < (start[:-1] + ring_rows)[of_row]
    neighbour = np.where(in_ring[:, None], begins[of_row], slots.node[of_row]).astype(np.uint32)
    rest_length, stiffness = aligned(neighbour.shape, real), aligned(neighbour.shape, real)
    for lists, begin in ((slots.ring, start[:-1]), (slots.rest, start[:-1] + ring_rows)):
        row, lane = begin[lists.of // LANES] + lists.at, lists.of % LANES
        neighbour[row, lane] = lists.node
        row, lane, spring = (part[lists.spring >= 0] for part in (row, lane, lists.spring))
        rest_length[row, lane], stiffness[row, lane] = springs.rest_length[spring], springs.stiffness[spring]
    return neighbour, rest_length, stiffness


def slices_of(springs: Springs, triangles: np.ndarray, inverse_mass: np.ndarray, rest: np.ndarray) -> Slices:
    """The layout for `springs` and the kept surface `triangles` (f, 3) on nodes of `inverse_mass` (n,) [1/kg].

    Nodes that are near each other at rest, (n, 3) [m], share a slice as far as their lists have similar lengths.
    """
    real = rest.dtype
    slots = _slots(*_lists_of(springs, triangles, len(rest)), along_curve(rest))
    node, slices = slots.node, len(slots.node)
    ring_rows, rest_rows = _rows(slots.ring, slices), _rows(slots.rest, slices)
    start = np.r_[0, np.cumsum(ring_rows + rest_rows)]
    neighbour, rest_length, stiffness = _springs_by_lane(slots, springs, start, ring_rows, real)
    used = np.arange(LANES) < slots.lanes[:, None]
    in_a_row = used.all(axis=1) & (np.diff(node, axis=1) == 1).all(axis=1)
    pieces = np.flatnonzero(used[: slots.pieces])
    split_node, split_piece, split_start = _by_node(node.reshape(-1)[pieces], pieces)
    held = np.flatnonzero(used & (inverse_mass[node] == 0.0))
    held = held[held >= slots.pieces * LANES]
    different, stiffness_row = np.unique(stiffness, axis=0, return_inverse=True)
    shared = aligned(different.shape, real)
    shared[...] = different
    return Slices(
        node=node.astype(np.uint32),
        lanes=slots.lanes,
        first=np.where(in_a_row, node[:, 0], -1),
        start=start,
        rings=ring_rows,
        neighbour=neighbour,
        rest_length=rest_length,
        stiffness=shared,
        stiffness_row=stiffness_row.reshape(-1).astype(np.uint32),
        inverse_mass=inverse_mass[node].astype(real),
        pieces=slots.pieces,
        split_node=split_node.astype(np.uint32),
        split_start=split_start,
        split_piece=split_piece,
        held_start=np.searchsorted(held, LANES * np.arange(slices + 1)),
        held_lane=held % LANES,
        origin=int(triangles[0, 0]),
        without_length=bool(springs.count and not springs.rest_length.any()),
    )


CURVE_BITS = 20  # per axis: a millionth of the body, so that no two nodes share a cell


def along_curve(x: np.ndarray) -> np.ndarray:
    """Position of each point along a space-filling curve, Morton's order, (n,).

    It interleaves the bits of the three coordinates x [m], (n, 3) (Morton 1966).
    """
    cells = 1 << CURVE_BITS
    size = max(float(np.ptp(x, axis=0).max()), np.finfo(float).tiny)
    cell = np.minimum((x - x.min(axis=0)) / size * cells, cells - 1).astype(np.int64)
    key = np.zeros(len(x), dtype=np.int64)
    for bit in range(CURVE_BITS):
        for axis in range(3):
            key |= ((cell[:, axis] >> bit) & 1) << (3 * bit + axis)
    place = np.empty(len(x), dtype=np.int64)
    place[np.argsort(key, kind="stable")] = np.arange(len(x))
    return place
