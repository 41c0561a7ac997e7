"""Nodes that a test activates on obstacles by hand."""

import numpy as np

from massspring.kernels.arrays.layout import Contacts
from massspring.kernels.contact.node_contact import SLIDES


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
