"""The available elements, each with its claims."""

from dataclasses import dataclass

import skfem
from skfem import ElementTetMini, ElementTetP1, ElementTetP2, ElementTriP1, ElementTriP2

from reference_fem.errors import SolveError


@dataclass(frozen=True)
class Element:
    """One way to interpolate displacement and pressure on a tetrahedron."""

    name: str
    displacement: skfem.Element
    pressure: skfem.Element | None
    """Continuous pressure, an unknown at the vertices; None: constant in each element, and eliminated there."""
    order: int
    """Lowest quadrature order with positive weights that keeps the rates."""
    rates: tuple[float, float]
    """Lower bounds on the orders of the L2 errors of displacement and pressure in the mesh size, at kappa/mu = 1000."""
    locks: bool
    """Whether it becomes far too stiff as kappa/mu grows (locking)."""
    source: str

    @property
    def facet(self) -> skfem.Element:
        """Its displacement on a boundary triangle."""
        return ElementTriP2() if isinstance(self.displacement, ElementTetP2) else ElementTriP1()


ELEMENTS = {
    entry.name: entry
    for entry in (
        Element("P2/P1", ElementTetP2(), ElementTetP1(), 5, (3.0, 2.0), False, "Taylor and Hood 1973; the default"),
        Element("MINI", ElementTetMini(), ElementTetP1(), 6, (2.0, 1.5), False, "Arnold, Brezzi and Fortin 1984"),
        # condensed: 5 % fewer unknowns than P2/P1, but on the same mesh of the manufactured solution (15,000 unknowns)
        # its error of u is 40 times larger, and without functions on the faces its pressure loses order at large kappa
        Element("P2/P0", ElementTetP2(), None, 5, (1.7, 0.8), False, "mean dilatation, Nagtegaal, Parks and Rice 1974"),
        Element("P1", ElementTetP1(), None, 5, (2.0, 1.0), True, "displacement alone: the control that must lock"),
    )
}
"""The elements that a problem can name."""


DEFAULT = "P2/P1"


def find_element(name: str) -> Element:
    """The entry called `name`; raises SolveError with the choices."""
    if name not in ELEMENTS:
        raise SolveError(f"there is no element {name!r}: choose one of {', '.join(ELEMENTS)}")
    return ELEMENTS[name]
