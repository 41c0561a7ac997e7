"""Coulomb's friction in Newton passes: directed along the last force minus a resistance to the slip since then (eq.
13.8)."""

import numpy as np

from massspring.kernels.contact.node_contact import FREE, SLIDES, STICKS
from massspring.methods.implicit.contact import SLIP_RESOLUTION, Contact, TouchedRows

WITHIN = 1.0 - 1e-9
"""Share of the friction limit below which a node sticks: allows for round-off."""


class RubbedContact(Contact):
    """Touched nodes whose friction changes direction gradually from pass to pass.

    If friction were along the slip, as with springs, nodes of soft elements that hardly slip would alternate without
    end.
    """

    resistance: np.ndarray
    """Resistance r of each node to slip [kg], (n,)."""
    let_go: np.ndarray | None = None
    """Nodes that stuck in this step and were then pulled off, (n,) bool; None before the first pass of the step."""

    def revise(self, end: np.ndarray, active: TouchedRows, impulses: np.ndarray) -> bool:
        """As with springs; also records the nodes that stuck and are pulled off."""
        mode = self.contacts.mode
        stuck = mode == STICKS
        revised = super().revise(end, active, impulses)
        self.let_go = (stuck & (mode == FREE)) | (False if self.let_go is None else self.let_go)
        return revised

    def meet(self, nodes: np.ndarray, carried: np.ndarray) -> None:
        """Nodes that reach a rough obstacle stick at first, except those that were pulled off while they stuck."""
        new = slice(None) if self.let_go is None else ~self.let_go[nodes]
        self.stick(nodes[new], carried[new])

    def apply_friction(self, end: np.ndarray, active: TouchedRows, impulses: np.ndarray) -> bool:
        """F ← mu γ_n t/|t|, t = F − r s with the slip s of the last pass; a node sticks if |t| < mu γ_n. Returns
        whether one does."""
        if not self.boundary.rough:
            return False
        slides = self.rubbed(active)
        nodes, obstacle = active.nodes[slides], active.obstacle[slides]
        most = self.boundary.friction[obstacle] * np.maximum(impulses[slides], 0.0)
        slip = self.boundary.dt * self.slip(end, nodes)
        trial = self.friction_impulse[nodes] - self.resistance[nodes, None] * slip
        size = np.linalg.norm(trial, axis=1)
        sticks = size < WITHIN * most
        moves = ~sticks & (size > 0.0)
        self.friction_impulse[nodes[moves]] = (most[moves] / size[moves])[:, None] * trial[moves]
        self.stick(nodes[sticks], self.boundary.velocity[self.step][obstacle[sticks]])
        return bool(sticks.any())

    def stiffness(self, end: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Slipping nodes, (c,), and the derivative of their friction by the slip s, |F|/|s| (1 − ŝ ŝᵀ − n nᵀ) [kg], (c,
        3, 3), in a step that ends at `end` (n, 3)."""
        nodes = np.flatnonzero((self.contacts.mode == SLIDES) & self.friction_impulse.any(axis=1))
        slip = self.boundary.dt * self.slip(end, nodes)
        length = np.linalg.norm(slip, axis=1)
        moves = length > SLIP_RESOLUTION * self.model.correction_limit
        nodes, along = nodes[moves], slip[moves] / length[moves, None]
        normal, force = self.contacts.normal[nodes], np.linalg.norm(self.friction_impulse[nodes], axis=1)
        across = np.eye(3) - np.einsum("ci,cj->cij", along, along) - np.einsum("ci,cj->cij", normal, normal)
        return nodes, (force / length[moves])[:, None, None] * across
