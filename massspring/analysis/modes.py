"""Natural frequencies and modes of a body whose volumes are kept."""

import numpy as np
from scipy.sparse import block_array, csr_array, diags_array, eye_array
from scipy.sparse.linalg import ArpackError, eigsh

from massspring.analysis.stiffness import stiffness_at_rest
from massspring.body.body import Body
from massspring.errors import MassSpringError

SOFTNESS = 1e-10
"""Relative compliance added to the kept volumes, so that the system is regular even if some depend on others."""


def natural_frequencies(body: Body, count: int, keep: bool = True) -> tuple[np.ndarray, np.ndarray]:
    """The `count` lowest ω [1/s], ascending, (count,), and their modes (count, n, 3) with Σ m |u|² = 1 kg m² (eq. 5.5).

    K u − Jᵀ p = ω² M u with J u = 0 for the volumes that are kept; `keep` False: springs alone. Six frequencies of a
    free body are 0. Raises MassSpringError.
    """
    n = 3 * body.node_count
    if not 1 <= count < n - body.kept.count:
        raise MassSpringError(f"{count} modes asked of {body.node_count} nodes; give 1 to {n - body.kept.count - 1}")
    stiffness = stiffness_at_rest(body)
    mass = diags_array(np.repeat(body.moved_mass, 3))
    level = float(stiffness.diagonal().mean())
    if keep:
        gradients = body.kept.jacobian(body.rest)
        gradients = gradients * (level / np.abs(gradients.data).mean())
        m = body.kept.count
        stiffness = block_array([[stiffness, gradients.T], [gradients, -SOFTNESS * level * eye_array(m)]])
        mass = block_array([[mass, None], [None, csr_array((m, m))]])
    # Below all frequencies, near the lowest: that of a shear wave across the body.
    shift = -level / float(body.moved_mass.mean()) * body.node_count ** (-2.0 / 3.0)
    start = np.random.default_rng(0).standard_normal(n + body.kept.count * keep)
    try:
        square, shape = eigsh(stiffness.tocsc(), count, M=mass.tocsc(), sigma=shift, v0=start)
    except (ArpackError, RuntimeError) as error:
        raise MassSpringError(f"the natural frequencies did not converge: {error}") from error
    order = np.argsort(square)
    return np.sqrt(np.maximum(square[order], 0.0)), shape[:n, order].T.reshape(count, -1, 3)
