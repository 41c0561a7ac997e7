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
    """Energy, forces and stiffness of `Elements`, in addition to the springs without length of the body."""

    energy: Callable
    """(elements, x) -> [J]."""
    forces_into: Callable
    """(elements, x, force): forces [N] into `force` (n, 3); returns whether an element has no gradient."""
    add_stiffness: Callable
    """(elements, places, x, factor, exact, data): adds `factor` times minus their derivative to `data`, or only a
    positive part of it if not `exact`."""


ELEMENT_LAWS: dict[str, Law] = {
    "neo_hookean": Law(element_energy, element_forces_into, add_element_stiffness),
    "corotated": Law(corotated_energy, corotated_forces_into, add_corotated_stiffness),
}


def supported(table: Capabilities, name: str, law: str) -> Capabilities:
    """The capabilities of a method called `name` with the law `law`; `table` holds those with the default law.

    Raises MassSpringError for an unknown law.
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
