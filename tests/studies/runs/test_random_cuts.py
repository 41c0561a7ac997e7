"""Random cuts through random organs: each runs, or is refused with a sentence; mass and volume stay the same."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from massspring import ImplicitVolume, MassSpringError, Trajectory, simulate
from studies.base.errors import StudyError
from studies.geometry import BallRegion, HalfSpace
from studies.meshing.graded_mesh import MIDDLE, halved
from studies.meshing.scene_mesh import mesh_for
from studies.meshing.shaping import quadratic_mesh
from studies.runs.case import Case
from studies.runs.cutting import LUMEN
from studies.runs.prepare import prepared_on
from studies.runs.recipes import QuadraticBody, TetrahedralBody
from studies.scene.checks import check_scene, surface_of
from studies.scene.cut import Cut
from studies.scene.scene import ForceOutput, Held, Lumen, Organ, Scene
from studies.scene.tissues import LIVER

FRAMES, DURATION, NODES = 20, 0.4, 120
HOLLOW = {"hollow ball": {"wall": 0.008}, "stomach": {}}
unit = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1)


def vector(values):
    return tuple(float(value) for value in values)


@st.composite
def scenes(draw):
    """An organ held at both ends of the cut's normal, pulled apart, and cut along a random plane."""
    name = draw(st.sampled_from(["ball", "liver", "kidney", "spleen", *HOLLOW]))
    organ, hollow = Organ(name.removeprefix("hollow "), HOLLOW.get(name, {})), name in HOLLOW
    points, _ = surface_of(organ, name)
    normal = np.array(draw(unit))
    normal /= np.linalg.norm(normal)
    side = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    side /= np.linalg.norm(side)
    along = points @ normal
    level, extent = along.min() + draw(st.floats(0.15, 0.85)) * np.ptp(along), np.ptp(along)
    near = points[np.argsort(np.abs(along - level))[:50]]
    middle = near.mean(axis=0) + (level - near.mean(axis=0) @ normal) * normal
    half, reach = 0.5 * np.ptp(near @ side), draw(st.floats(0.2, 0.6))
    blades = {
        "none": None,
        "front": HalfSpace(vector(middle + (2 * reach - 1) * half * side), vector(side)),
        "disc": BallRegion(vector(middle), reach * half),
    }
    within = blades[draw(st.sampled_from(["none", "front"] if hollow else list(blades)))]
    at, advance = draw(st.floats(0.2, 0.8)) * DURATION, draw(st.sampled_from([0.0, 0.5]))
    cut = Cut(
        "cut",
        HalfSpace(vector(middle), vector(normal)),
        within,
        at,
        at + advance * (DURATION - at) if advance else None,
        vector(side) if advance else None,
        contact=draw(st.booleans()) and not hollow,
        opens_lumen=hollow,
    )
    pull = draw(st.floats(0.0, 0.15)) * extent
    ends = ((along.min() + 0.15 * extent, normal), (along.max() - 0.15 * extent, -normal))
    held = [
        Held(
            f"end {k}",
            HalfSpace(vector(place * normal), vector(out)),
            Trajectory((0.0, DURATION), ((0.0, 0.0, 0.0), vector(-0.5 * pull * out))),
        )
        for k, (place, out) in enumerate(ends)
    ]
    return Scene(
        name="cut",
        title="A random cut",
        organ=organ,
        tissue=LIVER,
        duration=DURATION,
        frames=FRAMES,
        checkpoints=(DURATION,),
        probed=ForceOutput("held", 0, (0.0, 0.0, 1.0)),
        reference=None,
        held=tuple(held),
        damping=15.0,
        cuts=(cut,),
        lumen=Lumen(draw(st.sampled_from(["closed", "open"]))) if hollow else None,
    )


def tissue(body):
    """The volume of a body's tissue at rest [m³]."""
    return body.kept.measure(body.rest)[[name != LUMEN for name in body.kept.names]].sum()


@pytest.mark.campaign
@settings(max_examples=40, deadline=None, suppress_health_check=list(HealthCheck))
@given(scenes(), st.sampled_from(["van_gelder", "cotangent", "quadratic"]))
def test_a_cut_parts_the_body_and_changes_nothing_else(scene, body):
    quadratic = body == "quadratic" and scene.lumen is None
    law = "van_gelder" if body == "quadratic" else body
    nodal = TetrahedralBody(NODES, law=law, volumes="nodal")
    recipe = QuadraticBody(4 * NODES - 6) if quadratic else nodal
    try:
        check_scene(scene)
        if quadratic:
            mesh = quadratic_mesh(scene, *halved(scene, NODES, 0, 0, even=True), MIDDLE)
        else:
            mesh = mesh_for(scene, NODES, even=True)
        prepared = prepared_on(Case(scene, recipe, ImplicitVolume(), dt_fraction=0.8), mesh)
    except (StudyError, MassSpringError) as refused:
        if "ended with code" in str(refused):  # a mesher that dies says nothing that helps
            raise
        return
    setup, whole, opening = prepared.setup, prepared.setup.body, prepared.opening
    for event in setup.events:
        assert abs(event.body.mass.sum() / whole.mass.sum() - 1.0) < 1e-12
        assert abs(tissue(event.body) / tissue(whole) - 1.0) < 1e-12
    history = simulate(setup, snapshots=[opening.frame, FRAMES], time_limit=20.0)
    if history.outcome == "finished":
        apart = np.diff(history.snapshots[:, opening.pairs], axis=2)
        assert not apart[0].any(), "copies of a node lie apart before the cut"
        pulled = np.abs(setup.attachments[0].path(DURATION)).max() > 1e-3 * whole.size
        assert apart[1].any() or not pulled, "nothing opens"
        for attachment in setup.later[-1].attachments:
            place = prepared.body.rest[attachment.nodes] + attachment.path(DURATION)
            assert np.abs(history.final[attachment.nodes] - place).max() < 1e-9
