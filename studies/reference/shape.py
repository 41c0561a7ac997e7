"""How far the finest mesh of a reference is from the true shape of its organ."""

from studies.meshing.bounds import REFERENCE_SHAPE
from studies.meshing.rest_surface import rest_surfaces
from studies.meshing.true_surface import ShapeErrors, shape_errors
from studies.reference.solution import Solution, doubled


def shape_of(solution: Solution) -> ShapeErrors:
    """Deviation of the finest, curved mesh from the true shape; the faces of a cut, inside the organ, are left out."""
    points, facets, _ = solution.boundary
    if solution.scene.cuts:
        facets = facets[~doubled(points, facets, solution.size)]
    return shape_errors(solution.scene.organ, rest_surfaces(points, facets), filled=True)


def shape_attributes(name: str, shape_error: float) -> dict[str, float | str]:
    """What the record of a reference says of its shape_error [1]: the number, and beyond REFERENCE_SHAPE a warning."""
    if shape_error != shape_error:
        return {}
    warning = (
        f"the reference of '{name}' is up to {100 * shape_error:.2g} % of the size off the organ's shape (bound "
        f"{REFERENCE_SHAPE:g} %), and its ± does not contain what that changes: smooth the shape, or give its plan a "
        "larger base"
    )
    beyond = 100 * shape_error > REFERENCE_SHAPE
    return {"shape_error": shape_error} | ({"warnings": warning} if beyond else {})
