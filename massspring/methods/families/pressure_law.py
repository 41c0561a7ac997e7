"""The loop of methods whose pressure is a function of the current volume and acts as one more force.

The pressure of a penalty is bounded by its modulus. That of a gas grows without bound as its volume goes to 0: the body
bursts, and the run diverges. If the pressure were limited like the correction of a constraint, the body would recover,
but steps beyond the stability limit would oscillate under that bound and seem stable. A surface without gradient is not
pushed. Contact and held nodes treat the pressure as a spring force, as in `free`: nothing is solved for
(docs/theory.md, eq. 10.8, 10.9).
"""

from dataclasses import replace

import numpy as np
from scipy.sparse import csr_array

from massspring.body.body import Body
from massspring.body.volumes import Volumes
from massspring.errors import MassSpringError
from massspring.kernels.arrays.layout import BoundaryConditions, Push
from massspring.kernels.forces.volume import pyramid_volume, volume_gradient_into
from massspring.kernels.jit.decorators import compiled, njit_lean
from massspring.kernels.jit.stage_clock import VOLUME, end_stage
from massspring.kernels.step.begin import begin_step, open_frame, search_contacts
from massspring.kernels.step.end import end_step
from massspring.layout.state import State
from massspring.methods.method import begin_frame

PENALTY, GAS, PYRAMIDS = 0, 1, 2


@compiled
def pressure_now(model, nodes, bulk_modulus, law, volume, target):
    """lam [Pa] of the current volume (eq. 10.8, 10.10)."""
    if law == GAS:
        return bulk_modulus * (target / volume - 1.0) if volume > 0.0 else np.inf
    if law == PYRAMIDS:
        volume = pyramid_volume(nodes.x, model.mass, model.triangles)
    return bulk_modulus * (target - volume) / target


@njit_lean
def pressure_frame(frame, bulk_modulus, law):
    """One frame of symplectic Euler with a known pressure (eq. 3.1, 3.2, 3.5, 3.7, 10.8); returns the last one [Pa]."""
    model, nodes, boundary, diagnostics = frame.model, frame.nodes, frame.boundary, frame.diagnostics
    lam = 0.0
    open_frame(frame)
    for step in range(boundary.position.shape[0]):
        volume, mobility = begin_step(frame, step, True)
        lam = pressure_now(model, nodes, bulk_modulus, law, volume, boundary.volume_target[step, 0])
        if not mobility > 0.0:
            lam = 0.0
            diagnostics.singular[0] += 1
        end_stage(diagnostics.stage_times, VOLUME)
        pressed = Push(nodes.gradient, lam)
        search_contacts(frame, step, pressed)
        # Contact does not change the pressure, so the mobility is 0.
        end_step(frame, step, pressed, 0.0, None)
    return lam


def push(state: State, boundary: BoundaryConditions, bulk_modulus: float, law: int) -> State:
    """One frame by the pressure `law`."""
    after = begin_frame(state, boundary)
    lam = pressure_frame(after.frame(boundary), bulk_modulus, law)
    return replace(after, lam=np.array([lam]))


def volume_stiffness(body: Body, bulk_modulus: float) -> csr_array:
    """B = √(K/V0) G at rest [√(N/m)], (3n, 1): dlam/dV = −K/V0, so that K_added = (K/V0) G Gᵀ (eq. 10.9)."""
    volumes = body.kept
    assert isinstance(volumes, Volumes)  # the methods that ask refuse others
    gradient = np.zeros_like(body.rest)
    share = volumes.share.tocoo()
    triangles = volumes.triangles[share.col]
    triangles = np.ascontiguousarray(np.where(share.data[:, None] > 0, triangles, triangles[:, ::-1]))
    volume = volume_gradient_into(body.rest, triangles, gradient)
    return csr_array(np.sqrt(bulk_modulus / volume) * gradient.reshape(-1, 1))


def check_modulus(method: str, name: str, value: float, unit: str = "Pa") -> None:
    """Raises MassSpringError for a modulus `value` [`unit`] that is not positive and finite."""
    if not 0.0 < value < float("inf"):
        raise MassSpringError(f"{method}'s {name} is {value} {unit}; it must be positive and finite")
