"""Volumes: what they enclose, that they are independent, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse.csgraph import connected_components

from massspring import Body, MassSpringError, Volumes, tetrahedral_body
from massspring.body.partition import cell_graph, node_patches, partition
from massspring.body.volumes import PATCH
from tests.massspring.conftest import SOFT, block, hollow_block


@pytest.mark.parametrize("hollow", [False, True], ids=["block", "hollow"])
@pytest.mark.parametrize("count", [2, 3, 8, 16])
def test_regions_are_connected_and_balanced(count, hollow):
    points, _, tetrahedra = hollow_block()[:3] if hollow else block((4, 4, 4))
    volume = np.abs(np.linalg.det(points[tetrahedra[:, 1:]] - points[tetrahedra[:, :1]])) / 6
    region = partition(points, tetrahedra, volume, count)
    graph = cell_graph(points, tetrahedra)
    for r in range(count):
        cells = np.flatnonzero(region == r)
        assert connected_components(graph[cells][:, cells])[0] == 1
    share = np.bincount(region, weights=volume) * count / volume.sum()
    # 336 to 384 cells: a region of 16 has 21, and each of the four bisections may miss its cut by a cell or two.
    assert share.min() > 0.75 and share.max() < 1.25


def test_the_volume_of_a_node_is_a_quarter_of_its_tetrahedra(block_body):
    quarter = np.bincount(block_body.tetrahedra.ravel(), weights=np.repeat(block_body.tetrahedron_volumes / 4, 4))
    assert np.allclose(Volumes.nodal(block_body).measure(block_body.rest), quarter, rtol=1e-12)


def test_wall_and_lumen_are_what_they_are_called(hollow_body):
    wall, lumen = hollow_body.rest_volumes
    assert wall == pytest.approx(hollow_body.tetrahedron_volumes.sum(), rel=1e-12)
    # 8 cells of 0.02 m edge; 15 % of distortion moves 26 nodes of their hull at random.
    assert lumen == pytest.approx(8 * 0.02**3, rel=0.1)


def turned_lumen(body: Body) -> Volumes:
    return Volumes.closed_surfaces(body, {"lumen": hollow_block()[3][:, ::-1].copy()})


REDUNDANT = {
    "whole after parts": lambda b: Volumes.regions(b, 4).joined(Volumes.whole(b)),
    "parts after whole": lambda b: Volumes.whole(b).joined(Volumes.regions(b, 4)),
    "whole after nodes": lambda b: Volumes.nodal(b).joined(Volumes.whole(b)),
    "two partitions": lambda b: Volumes.regions(b, 4).joined(
        replace(Volumes.regions(b, 3), names=("part 0", "part 1", "part 2"))
    ),
    "outer after wall and lumen": lambda b: Volumes.closed_surfaces(
        b, {**hollow_surfaces(), "outer": outer_triangles()}
    ),
}


def hollow_surfaces() -> dict[str, np.ndarray]:
    _, triangles, _, lumen = hollow_block()
    return {"wall": triangles, "lumen": lumen}


def outer_triangles() -> np.ndarray:
    _, triangles, _, lumen = hollow_block()
    inner = {tuple(sorted(t)) for t in lumen.tolist()}
    return np.array([t for t in triangles.tolist() if tuple(sorted(t)) not in inner])


@pytest.mark.parametrize("name", REDUNDANT)
def test_volumes_that_follow_from_others_are_refused(hollow_body, name):
    with pytest.raises(MassSpringError, match=r"is redundant: it follows from .*; leave one of them out"):
        REDUNDANT[name](hollow_body)


def test_independent_volumes_may_be_joined(hollow_body):
    """Regions of the wall together with the lumen; and all but one of the parts together with the whole."""
    lumen = Volumes.closed_surfaces(hollow_body, {"lumen": hollow_surfaces()["lumen"]})
    both = Volumes.regions(hollow_body, 5).joined(lumen)
    assert both.names[-1] == "lumen"
    assert both.measure(hollow_body.rest)[:5].sum() == pytest.approx(hollow_body.volume, rel=1e-12)
    assert both.measure(hollow_body.rest)[5] == pytest.approx(hollow_body.rest_volumes[1], rel=1e-12)


BAD = {
    "too many regions": (lambda b: Volumes.regions(b, 10**6), "1000000 regions asked of a mesh of .* nodes"),
    "more than nodes": (
        lambda b: Volumes.regions(b, b.node_count + 1),
        "regions asked of a mesh of .* nodes; more volumes than nodes lock it",
    ),
    "no region": (lambda b: Volumes.regions(b, 0), "0 regions asked"),
    "no surface": (lambda b: Volumes.closed_surfaces(b, {}), "name at least one"),
    "open": (lambda b: Volumes.closed_surfaces(b, {"lumen": hollow_surfaces()["lumen"][1:]}), "'lumen': .* open at 3"),
    "inside-out": (turned_lumen, "'lumen': .* inverted"),
    "one name twice": (
        lambda b: Volumes.whole(b).joined(replace(lumen_of(b), names=("whole",))),
        "give each its own name",
    ),
}


def lumen_of(body: Body) -> Volumes:
    return Volumes.closed_surfaces(body, {"lumen": hollow_surfaces()["lumen"]})


@pytest.mark.parametrize("name", BAD)
def test_bad_volumes_are_refused_in_one_sentence(hollow_body, name):
    build, words = BAD[name]
    with pytest.raises(MassSpringError, match=words) as caught:
        build(hollow_body)
    assert "\n" not in str(caught.value)


def test_a_body_whose_sheets_do_not_fit_its_tetrahedra_is_refused():
    points, _, tetrahedra, _ = hollow_block()
    with pytest.raises(MassSpringError, match="but the tetrahedra fill"):
        tetrahedral_body(points, outer_triangles(), tetrahedra, SOFT)


def test_patches_are_connected_sums_of_nodal_volumes(block_body):
    patches, nodal = Volumes.patches(block_body), Volumes.nodal(block_body)
    patch = node_patches(block_body.rest, block_body.tetrahedra, PATCH)
    x = block_body.rest + 0.01 * block_body.size * np.random.default_rng(3).standard_normal(block_body.rest.shape)
    assert patches.count == -(-block_body.node_count // PATCH)
    np.testing.assert_allclose(patches.measure(x), np.bincount(patch, weights=nodal.measure(x)), rtol=1e-10)
    assert np.bincount(patch).max() <= 2 * PATCH
    for number in range(patches.count):
        own = np.flatnonzero(patch == number)
        reached, inside = {own[0]}, set(own)
        for _ in range(len(own)):
            near = block_body.tetrahedra[np.isin(block_body.tetrahedra, list(reached)).any(axis=1)].ravel()
            reached |= inside & set(near.tolist())
        assert reached == inside
