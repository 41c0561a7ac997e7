"""Makes the mass-spring body of a quadratic mesh."""

import numpy as np

from massspring import Body, Material, quadratic_body
from studies.base.errors import DoesNotApply
from studies.geometry import OrganMesh
from studies.meshing.quadratic_mesh import QuadraticMesh
from studies.meshing.scene_mesh import patch_nodes
from studies.runs.recipes import BodyRecipe, QuadraticBody
from studies.scene.inertia import why_inertia_matters
from studies.scene.scene import Scene


def check_masses(scene: Scene, recipe: BodyRecipe) -> None:
    """Raises DoesNotApply for masses other than those of the tissue in a scene in which inertia matters."""
    reason = None if recipe.mass == "lumped" else why_inertia_matters(scene)
    if reason is not None:
        kind = "heavy masses" if recipe.mass == "heavy" else "masses by stiffness"
        raise DoesNotApply(f"{kind} do not apply to scene '{scene.name}': {reason}")


def quadratic_for(scene: Scene, recipe: QuadraticBody, mesh: QuadraticMesh) -> Body:
    """The body of quadratic tetrahedra with the volumes of its recipe, and one for a lumen that is filled and closed;
    a heavy one as heavy as its tissue.

    Raises MassSpringError for a mesh that gives no valid body.
    """
    material = Material(recipe.stiffness * scene.tissue.shear_modulus, scene.tissue.density)
    lumen = mesh.lumen if scene.filled and mesh.hollow else None
    own = with_own_volumes(scene, recipe, mesh)
    inertia = "lumped" if recipe.mass == "lumped" else "stiffness"
    return quadratic_body(mesh.points, mesh.cells, material, lumen, inertia, recipe.contact, own)


def with_own_volumes(scene: Scene, recipe: QuadraticBody, mesh: QuadraticMesh) -> np.ndarray:
    """Which elements keep a volume of their own, (k,) bool: none, all, or those with a node in a held region."""
    if recipe.volumes != "mixed":
        return np.full(len(mesh.cells), recipe.volumes == "element")
    at_held = np.zeros(len(mesh.points), dtype=bool)
    for held in scene.held:
        at_held[patch_nodes(mesh, held.name, held.region)] = True
    return at_held[mesh.cells].max(axis=1)


def flat_mesh(mesh: OrganMesh | QuadraticMesh, body: Body) -> OrganMesh:
    """The mesh of flat triangles and tetrahedra that replace curved elements in contact and measurement."""
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
