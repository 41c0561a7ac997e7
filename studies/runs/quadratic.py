"""From the quadratic mesh of a scene to its mass-spring body."""

from massspring import Body, Material, quadratic_body
from studies.base.errors import DoesNotApply
from studies.geometry import OrganMesh
from studies.meshing.quadratic_mesh import QuadraticMesh
from studies.runs.case import BodyRecipe
from studies.scene.inertia import why_inertia_matters
from studies.scene.scene import Scene


def check_masses(scene: Scene, recipe: BodyRecipe) -> None:
    """Raises DoesNotApply for masses that are not the tissue's in a scene where they matter."""
    reason = why_inertia_matters(scene) if recipe.mass == "stiffness" else None
    if reason is not None:
        raise DoesNotApply(f"masses by stiffness do not apply to scene '{scene.name}': {reason}")


def quadratic_for(scene: Scene, recipe: BodyRecipe, mesh: QuadraticMesh) -> Body:
    """The body of quadratic tetrahedra with one volume per vertex, and one for a lumen that is filled and closed.

    Raises MassSpringError for a mesh that makes no body.
    """
    material = Material(recipe.stiffness * scene.tissue.shear_modulus, scene.tissue.density)
    lumen = mesh.lumen if scene.filled and mesh.hollow else None
    return quadratic_body(mesh.points, mesh.cells, material, lumen, recipe.mass, recipe.contact)


def flat_mesh(mesh: OrganMesh | QuadraticMesh, body: Body) -> OrganMesh:
    """The flat triangles and tetrahedra that stand for curved elements where a body touches and is measured."""
    if isinstance(mesh, OrganMesh):
        return mesh
    return OrganMesh(
        mesh.name,
        mesh.points,
        body.triangles,
        body.tetrahedra,
        mesh.surface_count,
        mesh.patches,
        mesh.recipe,
        mesh.outer_count,
        cuts=mesh.cuts,
    )
