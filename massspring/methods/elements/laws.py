"""The laws of elastic elements. Adding one: its three kernels in a file, and a line in ELEMENT_LAWS."""

from collections.abc import Callable
from dataclasses import replace
from typing import Literal, NamedTuple

from massspring.body.body import Body
from massspring.errors import MassSpringError
from massspring.kernels.forces.corotated import add_corotated_stiffness, corotated_energy, corotated_forces_into
from massspring.kernels.forces.elements import add_element_stiffness, element_energy, element_forces_into
from massspring.methods.capabilities import Capabilities, No

LINEAR = No("its corotated elements are linear")
LawName = Literal["neo_hookean", "corotated"]


class Law(NamedTuple):
    """Energy, forces and stiffness of `Elements`, beside the springs without length of the body."""

    energy: Callable
    """(elements, x) -> [J]."""
    forces_into: Callable
    """(elements, x, force): forces [N], (n, 3), in place; whether an element has no direction to push in."""
    add_stiffness: Callable
    """(elements, places, x, factor, exact, data): `factor` times minus their derivative, or what is positive of it."""


ELEMENT_LAWS: dict[str, Law] = {
    "neo_hookean": Law(element_energy, element_forces_into, add_element_stiffness),
    "corotated": Law(corotated_energy, corotated_forces_into, add_corotated_stiffness),
}


def supported(table: Capabilities, name: str, law: str) -> Capabilities:
    """What a method of this name supports with a law, of what its `table` has.

    Raises MassSpringError for a law that there is not.
    """
    if law not in ELEMENT_LAWS:
        raise MassSpringError(f"{name}'s law is '{law}'; choose {' or '.join(ELEMENT_LAWS)}")
    if law != "corotated":
        return table
    return replace(table, point_volumes=LINEAR, facet_contact=No("obstacles touch its nodes"))


def has_nodal_volumes(body: Body) -> bool:
    """Whether a body keeps one volume per node, and no other."""
    return body.kept.names == tuple(f"node {i}" for i in range(body.node_count))


def why_not_corotated(body: Body) -> str | None:
    """Why a body cannot have corotated elements; None when it can."""
    return None if has_nodal_volumes(body) else "its corotated elements keep nodal volumes only; take law neo_hookean"
