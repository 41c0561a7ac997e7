"""Newton's method on one load step."""

from dataclasses import replace

import numpy as np

from reference_fem.contact import augmented as contact
from reference_fem.contact.augmented import NO_GUESS
from reference_fem.contact.faces import gaps_and_slopes, misplacement_of_faces
from reference_fem.errors import SingularTangent
from reference_fem.statics import active_set
from reference_fem.statics.tangent import Tangent
from reference_fem.system.saddle_point import Evaluation, System
from reference_fem.system.state import Loads, NewtonSettings, State

PENALTY_GROWTH = 2.0
"""Factor on the contact penalty at each multiplier update inside a step: updates alone converge slowly if a facet is
partly in contact, since its points then pose more conditions than six nodes can satisfy."""

MERIT_GROWTH = 5.0
"""Largest rise of the error in one accepted iteration: points that come into contact raise it before it falls."""

LOOSE = 1e4
"""Factor on both tolerances before a multiplier update: solving closer first saves no iteration afterwards."""


HESITATION = 8
"""Iterations in which a stuck point may be released and held again; after that a released point stays released to the
end of the load step. Some points have no pressure while held but have one when released, and would alternate without
end."""


SHUT = 1e-6
"""Gap between the faces of a cut, over the root of their area, below which they coincide: round-off."""
FAINT = 1e-9
"""A negligible pressure [Pa] that marks points of closed faces as touching."""


class StepFailed(Exception):
    """A load step did not converge; the path tries a smaller one."""


def check_outside(system: System, x: np.ndarray, rows: np.ndarray):
    """Raises StepFailed where an obstacle has slipped through the surface: a smaller step keeps it out, if the facets
    are small enough for it."""
    slipped = system.inside.first(rows, x)
    if slipped is not None:
        raise StepFailed(f"obstacle {slipped} slips through the surface, whose facets may be too large for it")


def solve_step(system: System, state: State, t: float, load: float, more: np.ndarray | float = 0.0) -> State:
    """The equilibrium at time t from the one in `state`; raises StepFailed.

    more: a further dead force, (field_count,) [N].

    Multipliers are updated, and the penalty raised, only while some point is deeper than allowed, or is pushed although
    it is as far outside; the next step starts with the low penalty again.
    """
    target, stiffness = system.held_at(t), 1.0
    force, filling = system.force_at(t, load) + more, system.filling_at(t, load)
    loads = Loads(force, system.obstacles_at(t), state.pressure, filling, grip=state.hold, faces=state.face_pressure)
    x, evaluation, before = state.x, first_guess(system, state, loads), None
    if not evaluation.usable:
        raise StepFailed("an element of the state that the step starts from is inverted")
    for iteration in range(1, system.settings.max_iterations + 1):
        change, guess, face_guess = direction(system, evaluation, x, target)
        grip = let_go(loads.grip, guess) if iteration > HESITATION else loads.grip
        loads = loads._replace(guess=guess, face_guess=face_guess, grip=grip)
        x, evaluation = search(system, x, change, loads, before)
        arrived = np.array_equal(x[system.pattern.held], target)
        distance, allowed = misplacement(system, x, evaluation)
        off, last = distance > allowed, evaluation
        if arrived and settled(evaluation, system.settings, LOOSE if off else 1.0):
            if not off:
                check_outside(system, x, loads.rows)
                hold = contact.renewed_grip(evaluation.touch, system.sticks, system.surface, x)
                settled_in = State(t, load, x, loads.multiplier, evaluation.touch.pressure, iteration)
                settled_in = replace(settled_in, faces=loads.faces, face_pressure=evaluation.faces.pressure)
                return replace(settled_in, stiffness=stiffness, grip=loads.grip, hold=hold)
            stiffness *= PENALTY_GROWTH
            grip = loads.grip._replace(traction=evaluation.touch.traction)
            loads = loads._replace(multiplier=evaluation.touch.pressure, stiffness=stiffness, grip=grip)
            loads = loads._replace(faces=evaluation.faces.pressure)
        before = evaluation = system.evaluate(x, loads)
    failed = unmet(last, system.settings, arrived, distance, allowed)
    raise StepFailed(f"{system.settings.max_iterations} Newton iterations did not meet: {failed}")


def first_guess(system: System, state: State, loads: Loads):
    """The evaluation for the first direction: the body at its current position, with the motion of the obstacles
    linearised."""
    old = system.obstacles_at(state.t)
    loads = loads._replace(rows=old, shift=loads.rows[:, 1:4] - old[:, 1:4])
    if len(system.faces.dofs):
        # Coincident faces count as touching: points that separate are easier to find than points that meet.
        shut = gaps_and_slopes(state.x, system.faces)[0] <= SHUT * np.sqrt(system.faces.weights.sum())
        loads = loads._replace(face_guess=np.where(shut, np.maximum(loads.faces, FAINT), loads.faces))
    return system.evaluate(state.x, loads)


def let_go(grip: contact.Grip, guess: np.ndarray):
    """The grip without points whose predicted pressure is 0."""
    return grip._replace(stuck=grip.stuck & (guess > 0.0)) if grip.stuck.size else grip


def direction(system: System, evaluation: Evaluation, x: np.ndarray, target: np.ndarray):
    """Newton's change at x, which also takes the held unknowns to their target; and the predicted contact pressures.

    Raises StepFailed if the tangent is singular; a shorter step may avoid that.
    """
    try:
        tangent = Tangent(system, evaluation)
        lift = target - x[system.pattern.held]
        if not (len(system.rows) or len(system.faces.dofs)):
            return tangent.newton(lift), NO_GUESS, evaluation.faces.guess
        return active_set.settled(system, tangent, x, tangent.newton(lift, active_set.excess(system, evaluation, x)))
    except SingularTangent as singular:
        raise StepFailed(str(singular)) from singular


def settled(evaluation: Evaluation, settings: NewtonSettings, slack: float):
    """Whether both relative errors are below their tolerances times slack, and every held point is also pressed."""
    if contact.mistaken(evaluation.touch):
        return False
    return evaluation.errors[0] <= slack * settings.force_tol and evaluation.errors[1] <= slack * settings.volume_tol


def misplacement(system: System, x: np.ndarray, evaluation: Evaluation) -> tuple[float, float]:
    """Distance [m] of contact from an obstacle's surface, or from where it stuck; and its bound [m], a share of the
    largest displacement."""
    allowed = system.settings.penetration_tol * float(np.abs(x[: system.displacement_count]).max())
    touch = evaluation.touch
    return max(contact.misplacement(touch), contact.slippage(touch), misplacement_of_faces(evaluation.faces)), allowed


def unmet(evaluation: Evaluation, settings: NewtonSettings, arrived: bool, distance: float, allowed: float) -> str:
    """The tests of a step that an iteration did not pass, with their numbers and bounds."""
    force, volume = evaluation.errors
    tests = (
        (force <= settings.force_tol, f"relative force error {force:.1e} (bound {settings.force_tol:g})"),
        (volume <= settings.volume_tol, f"relative volume error {volume:.1e} (bound {settings.volume_tol:g})"),
        (arrived, "held nodes are not at their places"),
        (not contact.mistaken(evaluation.touch), "points that stick to an obstacle are not those that it presses"),
        (
            distance <= allowed,
            f"contact {1e3 * distance:.2g} mm from where it acts (bound {1e3 * allowed:.2g} mm): does an obstacle "
            "press what is held?",
        ),
    )
    return ", ".join(words for met, words in tests if not met)


def search(system: System, x: np.ndarray, direction: np.ndarray, loads: Loads, before: Evaluation | None):
    """The first of a few halved trial steps that inverts no element and does not raise the error by more than
    MERIT_GROWTH, and its evaluation without tangent: half of them are the last of their step or of their multiplier."""
    share = 1.0
    while share > 1e-2:
        trial = x + share * direction
        evaluation = system.evaluate(trial, loads, tangent=False)
        if evaluation.usable and (before is None or evaluation.errors.max() <= MERIT_GROWTH * before.errors.max()):
            return trial, evaluation
        share *= 0.5
    raise StepFailed("no share of Newton's step keeps the elements upright and the error in bounds")
