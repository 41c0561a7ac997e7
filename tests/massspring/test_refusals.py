"""Bad input to massspring, one table: words of the sentence, and what is refused with it. Where a refusal needs more
than one line to bring about, it stands with its module."""

from functools import cache

import numpy as np
import pytest

from massspring import (
    AngularSprings,
    Attachment,
    Barycentre,
    Baumgarte,
    Capsule,
    ChainMail,
    Clock,
    Element,
    ExplicitElements,
    Free,
    ImplicitElements,
    ImplicitSprings,
    ImplicitVolume,
    LinearModes,
    MassSpringError,
    Material,
    Penalty,
    Plane,
    Pressure,
    Probe,
    Pyramid,
    Ramp,
    Setup,
    Sphere,
    StepLimit,
    Trajectory,
    Volumes,
    Xpbd,
    XpbdNeoHookean,
    make_clock,
    membrane_body,
    quadratic_body,
    step_limit,
    surface_body,
    tetrahedral_body,
)
from massspring.body.axis import virtual_nodes
from massspring.body.inside import mean_edge
from tests.massspring.conftest import SOFT, block, hollow_block, icosphere
from tests.massspring.quadratic import curved_solid, hollow_ball, linear_solid, quadratic_block

NAN, INF = float("nan"), float("inf")
MESH = icosphere(1)
SHIFTED = np.vstack([MESH[0], MESH[0] + 1.0]), np.vstack([MESH[1], MESH[1] + len(MESH[0])])
LIMIT = StepLimit(1000.0, 0.0)


@cache
def ball():
    return surface_body(*icosphere(2), SOFT)


@cache
def cells():
    return tetrahedral_body(*block((3, 3, 2)), SOFT)


@cache
def wall():
    return membrane_body(*MESH, 0.003, SOFT)


@cache
def hollow():
    points, triangles, tetrahedra, lumen = hollow_block()
    body = tetrahedral_body(points, triangles, tetrahedra, SOFT)
    return body.keeping(Volumes.closed_surfaces(body, {"wall": triangles, "lumen": lumen}))


@cache
def hollow_elements():
    points, triangles, tetrahedra, lumen = hollow_block()
    body = tetrahedral_body(points, triangles, tetrahedra, SOFT, "cotangent")
    return body.keeping(Volumes.nodal(body).joined(Volumes.closed_surfaces(body, {"lumen": lumen})))


def patches():
    return linear_solid().keeping(Volumes.patches(linear_solid()))


def spoiled():
    rest = np.zeros_like(cells().rest)
    rest[7, 1] = NAN
    return rest


def run(method=None, body=ball, **options):
    """Starts a run of a body under a method, by default springs alone."""
    options = {name: value() if callable(value) else value for name, value in options.items()}
    return Setup(body(), method or Free(), Clock(0.01, 1, 10), **options).start()


def met(*obstacles, **options):
    return run(obstacles=obstacles, **options)


def plane(*path):
    return Plane((0, 0, 1), (0, 0, -1), Trajectory(*path))


def held(*nodes, **options):
    return run(attachments=(Attachment(np.array(nodes, dtype=int)),), **options)


SQUARE, FALL = ((0, 0, 0), (0, 0, NAN)), Ramp((0.0, 1.0), (1.0, 1.1))
TABLE = [
    # Bodies.
    ("positive finite", lambda: Material(-1.0, 1000.0)),
    ("positive finite", lambda: Material(1.0, NAN)),
    ("unknown stiffness law", lambda: tetrahedral_body(*block((1, 1, 1)), SOFT, "stiff")),
    ("unknown axis 'curly'; known: straight, centre_line", lambda: surface_body(*MESH, SOFT, "curly")),
    ("separate parts", lambda: virtual_nodes(*SHIFTED, 0.01, "centre_line")),
    *[
        ("give four for structural, bending, inner, axial", lambda w=w: surface_body(*MESH, SOFT, weights=w))
        for w in ((1, 1, 1), (1, -1, 1, 1), (0, 0, 0, 1), (1, NAN, 1, 1))
    ],
    *[
        ("the wall is", lambda t=t, c=c: membrane_body(*MESH, t, SOFT, content=c))
        for t, c in ((0.0, 0.0), (-1.0, 0.0), (NAN, 0.0), (0.001, -1.0))
    ],
    ("unknown law 'rubber' of a wall", lambda: membrane_body(*MESH, 0.003, SOFT, law="rubber")),
    ("unknown inertia 'heavy'; choose lumped", lambda: quadratic_body(*quadratic_block(), SOFT, inertia="heavy")),
    ("unknown contact 'edges'; choose facets", lambda: quadratic_body(*quadratic_block(), SOFT, contact="edges")),
    *[
        (
            "give True or False for each of the 48 elements",
            lambda o=o: quadratic_body(*quadratic_block(), SOFT, own_volumes=o),
        )
        for o in (np.ones(48), np.ones(47, dtype=bool))
    ],
    ("the body has none; fill its mesh", lambda: Volumes.nodal(ball())),
    ("the body has none; fill its mesh", lambda: Volumes.regions(ball(), 4)),
    ("names a node beyond", lambda: cells().keeping(Volumes.nodal(hollow()))),
    # Time.
    *[("dt is", lambda dt=dt: make_clock(1.0, 10, dt, LIMIT)) for dt in (0.0, -1.0, NAN, "fast")],
    (r"dt = 0\.005 s lies above the stability limit of 0\.002 s; take", lambda: make_clock(1.0, 10, 0.005, LIMIT)),
    ("3 frames in inf s", lambda: make_clock(INF, 3, "auto", LIMIT)),
    *[(f"a frame takes {t} s", lambda t=t: Clock(t, 2, 3)) for t in (-0.005, 0.0, NAN)],
    ("frames = 2.5", lambda: Clock(0.01, 2.5, 3)),
    ("steps = 0; give a whole number from 1 on", lambda: Clock(0.01, 2, 0)),
    ("damping is -5.0 1/s; it must be zero or positive", lambda: step_limit(cells(), damping=-5.0)),
    ("damping is nan 1/s", lambda: step_limit(cells(), damping=NAN)),
    *[("numbered from 0 to", lambda i=i: step_limit(cells(), held_nodes=np.array([i]))) for i in (-1, 10**6)],
    *[("damping", lambda c=c: run(damping=c)) for c in (-1.0, NAN, 1000.0)],
    # What is around a body.
    *[("gravity is .*; give three finite numbers", lambda g=g: run(gravity=g)) for g in ((0.0, 0.0, NAN), (0.0, 9.81))],
    *[
        (r"have shape \(3, 3\); the body has", lambda n=n: run(**{n: np.zeros((3, 3))}))
        for n in ("velocity", "positions")
    ],
    ("velocities are not finite at node 7 and 0 more", lambda: run(body=cells, velocity=spoiled)),
    ("positions are not finite at node 7 and 0 more", lambda: run(body=cells, positions=spoiled)),
    ("starts 0.01 m inside", lambda: met(Sphere((0, 0, 0.05), 0.01))),
    ("starts 0.0001 m inside", lambda: met(Sphere((0.001, 0.002, 0.001), 1e-4))),
    ("starts .* inside the body", lambda: met(Capsule((0, 0, 0.2), (0.001, 0, 0.002), 1e-4))),
    ("starts .* inside", lambda: met(Sphere((0.3, 0.0, 0.0), 0.01), positions=ball().rest + np.array([0.3, 0.0, 0.0]))),
    ("needs a direction", lambda: Plane((0, 0, 0), (0, 0, 0))),
    ("needs a direction", lambda: Plane((0, 0, 0), (0, 0, NAN))),
    ("give finite metres", lambda: Plane((0, 0, INF), (0, 0, 1))),
    *[("must be positive", lambda r=r: Sphere((0, 0, 1), r)) for r in (0.0, NAN)],
    ("give finite metres", lambda: Sphere((0, NAN, 0), 0.1)),
    ("give it a length, or use a sphere", lambda: Capsule((0, 0, 1), (0, 0, 1), 0.1)),
    ("must be positive", lambda: Capsule((0, 0, 1), (0, 0, 2), 0.0)),
    ("give finite metres", lambda: Capsule((0, 0, 1), (0, 0, NAN), 0.1)),
    ("friction is -0.1", lambda: Plane((0, 0, -1), (0, 0, 1), friction=-0.1)),
    ("friction is 'sticky'", lambda: Sphere((0, 0, 1), 0.1, friction="sticky")),
    ("not finite", lambda: plane((0.0, 1.0), SQUARE)),
    ("not finite", lambda: plane((0.0, INF), ((0, 0, 0), (0, 0, 1)))),
    ("ascend", lambda: plane((1.0, 0.0), ((0, 0, 0), (0, 0, 0)))),
    ("one each", lambda: plane((0.0, 1.0), ((0, 0, 0),))),
    ("one each", lambda: Ramp((0.0, 1.0), (1.0,))),
    ("not finite", lambda: Ramp((0.0,), (NAN,))),
    ("ascend", lambda: Ramp((1.0, 0.0), (1.0, 1.0))),
    (
        "'lumn' names no kept volume; the body keeps wall, lumen",
        lambda: run(ImplicitVolume(), hollow, targets={"lumn": Ramp()}),
    ),
    (
        "'lumen' falls to 0 of its",
        lambda: run(ImplicitVolume(), hollow, targets={"lumen": Ramp((0.0, 1.0), (1.0, 0.0))}),
    ),
    ("volume 'whole', which method 'free' does not follow: it keeps no volume", lambda: run(targets={"whole": FALL})),
    ("holds no node", lambda: held()),
    ("names node 1000000", lambda: held(10**6)),
    ("the same node", lambda: held(3, 3)),
    *[
        ("the nodes of attachment 0 are", lambda n=n: run(attachments=(Attachment(np.array(n)),)))
        for n in ([0.5], [True])
    ],
    ("'float16'; choose float64 or float32", lambda: run(precision="float16")),
    # Thin probes.
    ("starts .* inside the body", lambda: met(Probe((0.001, 0.0, 0.002)))),
    ("starts .* inside the body", lambda: met(Probe((0.0, 0.0, 0.052), 0.3 * mean_edge(ball())))),
    ("starts .* inside", lambda: met(Probe((0, 0, 1), path=Trajectory((0.0,), ((0, 0, -1.0),))))),
    ("give finite metres", lambda: Probe((0, 0, NAN))),
    *[("zero or positive", lambda r=r: Probe((0, 0, 1), r)) for r in (-0.1, NAN)],
    ("use a Sphere, or a finer surface", lambda: met(Probe((0, 0, 1), 2 * mean_edge(ball())))),
    (
        "obstacle 0 is a thin probe, .* quadratic body .*; use",
        lambda: met(Probe((0, 0, 9)), method=ImplicitVolume(), body=curved_solid),
    ),
    (
        "float64 only.*contact at its nodes",
        lambda: met(Plane((0, 0, -9), (0, 0, 1)), method=ImplicitVolume(), body=curved_solid, precision="float32"),
    ),
    # Methods, and bodies that are none for them.
    *[
        ("must be|needs at least|not of 'node'", make)
        for make in (
            lambda: Penalty(0.0),
            lambda: Pressure(-1.0),
            lambda: Pyramid(NAN),
            lambda: Barycentre(INF),
            lambda: Element(-5.0),
            lambda: Xpbd(iterations=0),
            lambda: Xpbd(compliance=-1.0),
            lambda: Xpbd(volumes="node"),
            lambda: AngularSprings(0.0),
            lambda: ChainMail(stretch=0.0),
            lambda: ChainMail(shear=NAN),
            lambda: ChainMail(compression=1.0),
            lambda: LinearModes(bulk_ratio=1.0),
            lambda: LinearModes(bulk_ratio=INF),
            lambda: LinearModes(modes=0),
            lambda: XpbdNeoHookean(bulk_ratio=0.0),
            lambda: XpbdNeoHookean(iterations=0),
            lambda: ExplicitElements(0.0),
            lambda: ImplicitElements(bulk_ratio=-1.0),
            lambda: ImplicitElements(tolerance=0.0),
            lambda: ImplicitElements(most_passes=0),
        )
    ],
    ("cannot be negative", lambda: ChainMail(sweeps=-1)),
    *[("alpha is", lambda a=a: Baumgarte(alpha=a)) for a in (0.0, -1.0, NAN, INF)],
    *[
        ("law is 'hookean'; choose neo_hookean or", lambda m=m: m(law="hookean"))
        for m in (ExplicitElements, ImplicitElements)
    ],
    ("most_iterations is -1; give a whole number from 0 on", lambda: run(ImplicitVolume(most_iterations=-1))),
    ("most_iterations is 2.5; give a whole number", lambda: run(ImplicitVolume(most_iterations=2.5))),
    *[
        ("tolerance is .*; give a finite number", lambda v=v: run(ImplicitVolume(tolerance=v)))
        for v in ("x", NAN, True)
    ],
    ("no triangle springs, they harden without bound", lambda: run(ImplicitSprings(), wall)),
    ("its angles are as stiff as springs", lambda: run(AngularSprings(), wall)),
    ("could be filled", lambda: run(AngularSprings(), targets={"body": FALL})),
    ("could be filled", lambda: run(ChainMail(), targets={"body": FALL})),
    ("gravity has no effect", lambda: run(ChainMail(), gravity=(0.0, 0.0, -9.81))),
    ("nothing moves by itself", lambda: run(ChainMail(), velocity=lambda: np.full_like(ball().rest, 0.1))),
    ("no forces, so no friction", lambda: met(Sphere((0, 0, 1), 0.01, friction="no_slip"), method=ChainMail())),
    *[
        ("its springs must have no length", lambda m=m: run(m(), cells))
        for m in (ExplicitElements, ImplicitElements, XpbdNeoHookean)
    ],
    (
        "no quadratic body, its tetrahedra are linear",
        lambda: run(XpbdNeoHookean(), lambda: curved_solid(contact="nodes")),
    ),
    *[
        (
            "no quadratic body, its corotated elements",
            lambda m=m: run(m(law="corotated"), lambda: curved_solid(contact="nodes")),
        )
        for m in (ExplicitElements, ImplicitElements)
    ],
    *[
        ("keep nodal volumes only", lambda m=m: run(m(law="corotated"), patches))
        for m in (ExplicitElements, ImplicitElements)
    ],
    *[
        ("it keeps nodal volumes only", lambda m=m, b=b: run(m(), b))
        for m in (ImplicitElements, XpbdNeoHookean)
        for b in (patches, hollow_elements)
    ],
    ("no contact inside facets, obstacles touch its nodes", lambda: run(ImplicitElements(), curved_solid)),
    (
        "keep no volume of a lumen; take explicit_elements",
        lambda: run(ImplicitElements(), lambda: hollow_ball(contact="nodes")),
    ),
    *[
        ("may settle into another shape", lambda o=o: run(ImplicitVolume(recovers=True), cells, **o))
        for o in ({"precision": "float32"}, {"obstacles": (Probe((0.0, 0.0, 1.0)),)})
    ],
    ("back when its tetrahedra are, the body has none", lambda: run(ImplicitVolume(recovers=True))),
    (
        "'xpbd' does not support thin probes .*: it does not correct",
        lambda: met(Probe((0, 0, 1)), method=Xpbd("whole")),
    ),
]


@pytest.mark.parametrize(("words", "bad"), TABLE, ids=[f"{k} {words}" for k, (words, _) in enumerate(TABLE)])
def test_bad_input_is_refused_in_one_sentence(words, bad):
    with pytest.raises(MassSpringError, match=words) as caught:
        bad()
    assert "\n" not in str(caught.value)
