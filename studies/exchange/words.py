"""Descriptions of a scene in words, for readers who have never run this program."""

from massspring import Capsule, Obstacle, Plane, Sphere, Trajectory
from studies.scene.cut import Cut
from studies.scene.scene import Lumen, Scene

MATERIAL = (
    "Nearly incompressible neo-Hookean solid: W = mu/2 (J^(-2/3) tr(F^T F) - 3) + kappa/2 (J - 1)^2. kappa/mu is so "
    "large that the answer is that of an incompressible solid within the uncertainty of the reference: whatever keeps "
    "the volume of the tissue will do."
)
DAMPING = (
    "Every mass m with velocity v feels the force -damping m v. The loads are so slow that neither this nor inertia "
    "matters at the checkpoints; the reference is a path of equilibria."
)
DAMPING_OF_MOTION = (
    "Every mass m with velocity v feels the force -damping m v. The reference is a motion with the same damping: "
    "inertia matters, and so does the damping of a time step."
)
PATHS = "A path is the displacement from the place at rest [m]: straight between its key times, still outside them."


def moved(path: Trajectory) -> str:
    """A path in words."""
    if not any(any(row) for row in path.displacements):
        return "does not move"
    keys = [f"{_at(shift)} at {t:g} s" for t, shift in zip(path.times, path.displacements, strict=True)]
    return "is displaced by " + ", ".join(keys) + "; linear in between"


def obstacle_words(obstacle: Obstacle) -> str:
    """What a rigid obstacle is, whether it has friction, and how it moves."""
    if isinstance(obstacle, Plane):
        n = obstacle.unit_normal
        shape = f"plane through {_at(obstacle.point)} with normal {_at(n, '')}: the body stays where n.(x - point) >= 0"
    elif isinstance(obstacle, Sphere):
        shape = f"sphere of radius {obstacle.radius:g} m at {_at(obstacle.centre)}: the body stays outside"
    elif isinstance(obstacle, Capsule):
        ends = f"{_at(obstacle.start)} to {_at(obstacle.end)}"
        shape = f"capsule of radius {obstacle.radius:g} m from {ends}: the body stays outside"
    else:
        tip = f"of radius {obstacle.radius:g} m at {_at(obstacle.tip)}"
        shape = f"tip of a thin probe, {tip}, through which no surface passes; its shaft touches nothing"
    return f"Rigid {shape}; {friction_words(obstacle)}; it {moved(obstacle.path)}."


def friction_words(obstacle: Obstacle) -> str:
    """Its friction."""
    friction = getattr(obstacle, "friction", 0.0)
    if friction == "no_slip":
        return "no slip: what touches it moves with it"
    return "frictionless" if friction == 0 else f"Coulomb friction with coefficient {friction:g}"


def lumen_words(lumen: Lumen) -> str:
    """What fills a hollow organ."""
    if lumen.content == "open":
        return "The lumen is drained: its wall feels no pressure from inside."
    if set(lumen.filling.values) == {1.0}:
        return "The lumen is closed and full of an incompressible fluid without weight: its volume does not change."
    keys = zip(lumen.filling.times, lumen.filling.values, strict=True)
    factors = ", ".join(f"{value:g} at {t:g} s" for t, value in keys)
    return f"The lumen is closed; its volume is its volume at rest times {factors}, linear in between."


def cut_words(cut: Cut) -> str:
    """A cut that is there from the start."""
    faces = "touch without friction where the cut closes" if cut.contact else "pass through each other"
    return (
        "The meshes are cut from the start: nodes on the two faces of the cut are there twice, at one place, and both "
        "faces belong to the outer surface. A reader "
        "that joins points at one place shuts the cut again. The tables of faces therefore have a row for each pair of "
        "facets: the nodes behind the cut, then those in front of it, to where the normal of the plane points; nodes "
        f"at the front of the cut are single. In our own runs the organ is whole until t = {cut.at:g} s. The tissue "
        "has no memory, so equilibria after that do not depend on it, and only checkpoints after that are judged: "
        f"start at rest at t = 0 with the cut mesh. Its faces {faces}."
    )


def force_words(scene: Scene) -> str:
    """Which force is judged, and its sign."""
    named = scene.held[scene.probed.number].name if scene.probed.what == "held" else f"number {scene.probed.number}"
    what = "held region" if scene.probed.what == "held" else "obstacle"
    return (
        f"The force of the {what} {named} on the body, along {_at(scene.probed.direction, '')}: positive for a press. "
        "A mean over the time since the last step is as good as the value at the step."
    )


def start_words(scene: Scene) -> str:
    """How the body starts."""
    start = scene.start
    if start is None:
        return "At rest in its rest shape."
    speed = f"velocity = {start.speed} times the rest position about the origin [1/s, row by row]"
    shape = f"shape = {start.matrix} times the rest position about the middle of its box, nodes scattered by "
    return f"{shape}{start.scatter:g} of half its longest side; {speed}." if start.shaped else f"In motion: {speed}."


def _at(vector: object, unit: str = " m") -> str:
    # + 0.0: no zero with a sign
    return "(" + ", ".join(f"{float(x) + 0.0:.9g}" for x in vector) + f"){unit}"  # pyright: ignore[reportGeneralTypeIssues]
