"""The body of a scene after its cut, and the event that introduces it into a run."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components

from massspring import Attachment, Body, Event
from massspring.body.bisection import Growth, Pieces, cut_surface
from massspring.body.opening import parents
from massspring.body.points import PointVolumes
from massspring.body.volumes import Volumes
from massspring.layout.face_pairs import faces_behind
from studies.base.errors import DoesNotApply, StudyError
from studies.geometry.mesh.organ_mesh import OrganMesh, boundary_triangles
from studies.meshing.opened_mesh import Opened
from studies.runs.recipes import BodyRecipe
from studies.scene.cut import Cut
from studies.scene.scene import Scene

LUMEN = "lumen"
"""Name of the kept volume of the content of a hollow organ."""


@dataclass(frozen=True, eq=False)
class Opening:
    """The cut of the body of a record, by node numbers of the record."""

    frame: int
    """Number of frames before the cut, or before it begins to advance."""
    faces: np.ndarray
    """Triangles of the surface behind the cut, (u, 3)."""
    pairs: np.ndarray
    """Nodes behind the cut and in front of it, (p, 2)."""
    parts: np.ndarray
    """The piece of the body that each kept volume is in, (m,)."""


def pieces_of(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """The connected piece of each cell (k, c), (k,): cells are connected by their nodes."""
    ends = np.repeat(cells[:, :1], cells.shape[1], axis=1).ravel(), cells.ravel()
    graph = coo_array((np.ones(cells.size), ends), shape=(len(points), len(points)))
    label = connected_components(graph, directed=False)[1][cells[:, 0]]
    return np.unique(label, return_inverse=True)[1]


def check_blades(scene: Scene, kind: str) -> None:
    """Raises DoesNotApply for a surface body (`kind`) if a cut of the scene ends inside it or advances, or if there are
    several cuts."""
    if kind != "surface":
        return
    several = f"it has {len(scene.cuts)} cuts, and this body is cut once; take a tetrahedral body"
    for cut in scene.cuts:
        advances = (
            f"cut '{cut.name}' advances, and this body is cut in pieces at once; leave until out, or take a "
            "tetrahedral body"
        )
        ends = (
            f"cut '{cut.name}' ends inside the organ, where this body has no tissue; cut the whole section "
            "(within=None), or take a tetrahedral body"
        )
        reasons = {advances: cut.until is not None, ends: cut.within is not None, several: len(scene.cuts) > 1}
        _refuse(f"the surface body does not apply to scene '{scene.name}': ", reasons)


def _refuse(words: str, reasons: Mapping[str, bool]) -> None:
    """Raises DoesNotApply for the first reason that holds."""
    reason = next((reason for reason, holds in reasons.items() if holds), None)
    if reason is not None:
        raise DoesNotApply(words + reason)


def surface_pieces(body: Body, later: Opened, axis: str) -> Pieces:
    """The paper's body after a cut that opened the filled mesh to whose surface it belongs."""
    count = later.mesh.surface_count
    assert isinstance(later.mesh, OrganMesh)  # that of a quadratic body has no surface body
    return cut_surface(body, later.mesh.points[:count], later.mesh.triangles, later.parent[:count], axis)


def keeping_pieces(body: Body, volumes: Volumes | PointVolumes | None) -> Body:
    """The body that keeps `volumes`; if that is the whole volume and the body is in pieces, the volume of each
    piece."""
    if volumes is not None:
        return body.keeping(volumes)
    cells = body.tetrahedra.astype(np.int64)
    piece = pieces_of(body.rest, cells)
    if piece.max(initial=0) == 0:
        return body
    if body.share is not None:
        weight = csr_array((piece == np.arange(piece.max() + 1)[:, None]) * body.share)
        return body.keeping(Volumes.of_cells(tuple(f"piece {k}" for k in range(len(weight.indptr) - 1)), cells, weight))
    surfaces = {f"piece {k}": boundary_triangles(cells[piece == k]) for k in range(piece.max() + 1)}
    return body.keeping(Volumes.closed_surfaces(body, surfaces))


def check_opens(scene: Scene, recipe: BodyRecipe) -> None:
    """Raises StudyError for a body recipe with which a cut cannot open the lumen."""
    cut = next((cut for cut in scene.cuts if cut.opens_lumen), None)
    if cut is None:
        return
    if recipe.kind not in ("tetrahedral", "quadratic"):
        raise StudyError(
            f"cut '{cut.name}' opens a lumen, which a {recipe.kind} body cannot do yet; take a tetrahedral or a "
            "quadratic one"
        )
    if scene.filled and recipe.volumes == "whole":
        raise StudyError(
            f"cut '{cut.name}' opens a lumen, and the body keeps wall and content as one volume; keep them "
            'apart: volumes="scene" or "nodal"'
        )


def check_held(cuts: Sequence[Cut], body: Body, attachments: tuple[Attachment, ...]) -> None:
    """Raises StudyError for a piece of the cut body without held nodes, unless one of the cuts allows free pieces."""
    cells, points = (body.tetrahedra if len(body.tetrahedra) else body.triangles).astype(np.int64), body.rest
    held = np.concatenate([np.empty(0, np.int64), *(np.asarray(a.nodes) for a in attachments)])
    piece = pieces_of(points, cells)
    loose = [k for k in range(piece.max() + 1) if not np.isin(cells[piece == k], held).any()]
    if loose and not any(cut.free for cut in cuts):
        names = "' or '".join(cut.name for cut in cuts)
        raise StudyError(f"cut '{names}' leaves a piece that nothing holds; hold it, or let it go: free=True")


def event_of(
    frame: int,
    before: Body,
    after: Body,
    parent: np.ndarray,
    attachments: tuple[Attachment, ...],
    pairs: np.ndarray | None = None,
    growth: Growth | None = None,
) -> Event:
    """The event at which body `after` replaces `before`. `parent` (n',): the node before of each of its nodes; `pairs`:
    nodes of faces that touch; `growth`: new nodes and springs beyond copies."""
    was, now = before.kept, after.kept
    ended = (was.names.index(LUMEN),) if LUMEN in was.names and LUMEN not in now.names else ()
    whole = was.count - len(ended)
    if isinstance(was, PointVolumes) and isinstance(now, PointVolumes):
        volumes = parents(was.corner_volume, now.corner_volume)
    elif whole == 1:
        volumes = np.zeros(now.count, dtype=np.int64)
    elif whole == before.node_count and now.count == after.node_count:
        volumes = parent
    else:
        pieces = [pieces_of(body.rest, body.tetrahedra.astype(np.int64))[:, None] for body in (before, after)]
        if [whole, now.count] == [int(piece.max(initial=-1)) + 1 for piece in pieces]:  # as `keeping_pieces` has them
            volumes = parents(*pieces)
        else:
            raise StudyError(
                f"a body that is cut keeps one volume, or one per node or vertex, not {was.count}; change its volumes"
            )
    return Event(after, parent, volumes, frame, attachments, ended, pairs, growth)


def check_virtual(scene: Scene) -> None:
    """Raises DoesNotApply for a scene that virtual nodes cannot cut."""
    words = f"virtual nodes do not apply to scene '{scene.name}'"
    if len(scene.cuts) > 1:
        raise DoesNotApply(f"{words}, which has {len(scene.cuts)} cuts; take cut 'conforming'")
    if scene.cut is None:
        raise DoesNotApply(f"{words}: it has no cut; leave cut out")
    if scene.cut.until is not None:
        raise DoesNotApply(f"{words}, whose cut advances; leave until out, or take cut 'conforming'")
    if scene.cut.opens_lumen:
        raise DoesNotApply(f"{words}, whose cut opens a lumen; take cut 'conforming'")
    if scene.cut.contact:
        raise DoesNotApply(f"{words}, whose faces of the cut touch: no node lies on them; take cut 'conforming'")


def opening_of(frame: int, after: Body, triangles: np.ndarray, pairs: np.ndarray) -> Opening:
    """Where the body after an event was cut; surface `triangles` (f, 3) and `pairs` as they are recorded."""
    faces = faces_behind(triangles.astype(np.int64), pairs, int(triangles.max()) + 1)
    return Opening(frame, faces, pairs, parts_of(after))


def parts_of(body: Body) -> np.ndarray:
    """The piece of the body that each kept volume is in, (m,)."""
    kept, cells = body.kept, body.tetrahedra.astype(np.int64)
    if isinstance(kept, PointVolumes):
        piece, owner = pieces_of(body.rest, kept.cells.astype(np.int64)), kept.corner_volume
    elif kept.count == body.node_count:
        piece, owner = pieces_of(body.rest, cells), cells
    else:  # the whole, or as `keeping_pieces` has them
        return np.arange(kept.count)
    parts = np.zeros(kept.count, np.int64)
    parts[owner] = piece[:, None]
    return parts
