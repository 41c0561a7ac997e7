"""Implicit constraint enforcement for one enclosed volume.

Hong, Jung, Choi, Welch (2005; IEEE Computer Graphics and Applications 26(5), 2006) and Jung, Hong, Choi (2005).
The constraint is linearised at the old positions and must hold at the end of the step; with contact inside:

    lam = [(V0 − V) − dt G·ṽ] / (dt² G·W̃·G)      v⁺ = ṽ + dt lam W̃ G      x⁺ = x + dt v⁺

Limits: V after a step is V0 + ½ Δxᵀ H Δx + V[Δx], second order in the last step only, so the error does not accumulate;
G = 0 (a body collapsed to a line) leaves nothing to push on, the step is counted and lam = 0.
"""

from dataclasses import dataclass, replace
from typing import ClassVar

from massspring.kernels.compiled import compiled
from massspring.kernels.contact import find_contacts, pressure_reach, revise_contacts
from massspring.kernels.layout import Drive
from massspring.kernels.motion import (
    add_held_impulse,
    advance,
    predict_velocity_into,
    prescribe_velocity_into,
    volume_multiplier,
)
from massspring.kernels.springs import spring_forces_into
from massspring.kernels.volume import volume_gradient_into
from massspring.methods.base import State, begin_frame

CONTACT_PASSES = 3
"""Active-set passes a step: one when nothing changes; lam is always solved for the set that is applied."""


@compiled
def implicit_volume_frame(network, motion, drive, tally, rest_volume, lam):
    """One frame of HCJ05 with contact inside the multiplier (eq. 6–13); returns the last lam [Pa]."""
    dt = drive.dt
    lightest = network.inverse_mass.max()
    for step in range(drive.position.shape[0]):
        spring_forces_into(motion.x, network.ends, network.rest_length, network.stiffness, motion.force)
        predict_velocity_into(
            motion.v, motion.force, network.inverse_mass, dt, drive.damping, drive.gravity, motion.v_star
        )
        held = drive.held_displacement[step]
        prescribe_velocity_into(
            motion.x, network.held_nodes, network.held_group, network.held_rest, held, dt, motion.v_star
        )
        error = rest_volume - volume_gradient_into(motion.x, network.triangles, motion.gradient)
        predicted = lam
        passes = 1
        if drive.radius.shape[0] > 0:
            find_contacts(network, motion, drive, step, predicted)
            passes = CONTACT_PASSES
        for sweep in range(passes):
            lam, mobility = volume_multiplier(motion, network.inverse_mass, error, dt)
            reach = pressure_reach(lam - predicted, mobility, lightest, dt)
            if sweep + 1 < passes and revise_contacts(network, motion, drive, step, lam, reach) == 0:
                break
        if not mobility > 0.0:
            tally.skipped[0] += 1
        add_held_impulse(network, motion, lam, dt, drive.gravity, tally.held_impulse)
        advance(motion, network.mass, network.inverse_mass, lam, dt, tally.contact_impulse)
    return lam


@dataclass(frozen=True)
class ImplicitVolume:
    """Keeps one enclosed volume with one multiplier, by one division per step (HCJ05)."""

    name: ClassVar[str] = "implicit_volume"
    order: ClassVar[int] = 1
    volume_tol: ClassVar[float | None] = 3e-4

    def advance(self, state: State, drive: Drive) -> State:
        """One frame."""
        after = begin_frame(state, drive)
        lam = implicit_volume_frame(after.network, after.motion, drive, after.tally, after.rest_volume, after.lam)
        return replace(after, lam=float(lam))
