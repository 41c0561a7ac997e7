"""Search for touching faces of a cut: together with the search for obstacles, and after each solve for the
multipliers."""

from massspring.kernels.contact.active_set import CONTACT_PASSES
from massspring.kernels.contact.face_pairs import measure_pairs, revise_pairs, turn_faces
from massspring.kernels.jit.decorators import njit_inlined
from massspring.kernels.jit.stage_clock import REVISION, SEARCH, end_stage
from massspring.kernels.step.begin import multiplier_stands


@njit_inlined
def begin_pairs(frame, pairs, gradient):
    """Measures the pairs, and applies to v* the rotation of their faces by the impulses of the last step, before v* is
    used elsewhere. Returns the change of G·v* [m³/s], 0 without a `gradient`."""
    if pairs is None:
        return 0.0
    measure_pairs(pairs, frame.nodes.x, frame.model.inverse_mass)
    flow = turn_faces(pairs, frame.nodes.x, frame.model.inverse_mass, frame.nodes.v_star, gradient)
    end_stage(frame.diagnostics.stage_times, SEARCH)
    return flow


@njit_inlined
def search_pairs(frame, push, passes, pairs):
    """Finds the pairs that touch with the push of the last step (eq. 9.9). Returns how many passes the active set may
    take."""
    if pairs is None:
        return passes
    revise_pairs(pairs, frame.model, frame.nodes, frame.contacts, push, frame.boundary.dt)
    end_stage(frame.diagnostics.stage_times, SEARCH)
    return CONTACT_PASSES


@njit_inlined
def contacts_stand(frame, step, push, reach, last, pairs):
    """As `multiplier_stands`, for the touched nodes and the touching pairs (eq. 9.9)."""
    if pairs is None:
        return multiplier_stands(frame, step, push, reach, last)
    stands = multiplier_stands(frame, step, push, reach, last or frame.boundary.radius.shape[0] == 0)
    if last:
        return True
    changes = revise_pairs(pairs, frame.model, frame.nodes, frame.contacts, push, frame.boundary.dt)
    end_stage(frame.diagnostics.stage_times, REVISION)
    return stands and changes == 0
