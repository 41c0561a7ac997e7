"""Springs without length are implicit, pressures linearised at the start of the step: one constant matrix, no passes.

Ascher, Ruuth, Wetton (1995), implicit-explicit Euler: zero-length springs are linear, f = −K x, so that

    A v⁺ = M v + dt (−K x + Jᵀ lam + m g + f_c),   A = (1 + c dt) M + dt² K

(docs/theory.md, eq. 12.5) is solved exactly by one back-solve with a factor made once. Volumes are linearised at x as
in HCJ05, with S = J A⁻¹ Jᵀ and a back-solve per iteration.

Limits: the change of Jᵀ with x stays explicit, which bounds dt where pressures are far above mu; long steps lose energy
and do not resolve motion within a step. Contact is inside facets, where a step changes a force in proportion to the
masses alone, ∝ 1/dt², so long steps approach the force slowly: at twice the explicit limit a pressed block has 84 % of
its force 0.4 s after the press, at ten times a sixth. The method suits bodies that are held, filled or sag under
gravity, not pressed ones.
"""

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.linalg import splu

from massspring.body.body import Body
from massspring.body.points import PointVolumes
from massspring.kernels.arrays.layout import Accuracy, BoundaryConditions, Model
from massspring.kernels.points.arrays import PointRows
from massspring.layout.allocate import start
from massspring.layout.state import State
from massspring.layout.volume_inverse import coarser, inverse_at_rest, middles
from massspring.methods.capabilities import Capabilities
from massspring.methods.families.points import SpringFactor, point_volumes_frame
from massspring.methods.implicit.factor import constant_matrix, triangular
from massspring.methods.method import Method, begin_frame
from massspring.world.obstacles import Attachment


@dataclass(frozen=True)
class SemiImplicit(Method):
    """Implicit-explicit Euler for quadratic bodies: springs implicit by one constant matrix, volumes by HCJ05."""

    tolerance: float = 1e-5
    """Volume error that an iterative solve may leave, over the volume [1]."""
    most_iterations: int = 200

    name: ClassVar[str] = "semi_implicit"
    order: ClassVar[int] = 1
    volume_tol: ClassVar[float | None] = 3e-4
    conserves_angular_momentum: ClassVar[bool] = False
    capabilities: ClassVar[Capabilities] = Capabilities(
        "points", "limited", conditionally_stable=False, prestress=True, point_volumes=True, facet_contact=True
    )

    def start(self, body: Body, attachments: tuple[Attachment, ...] = (), v: np.ndarray | None = None) -> State:
        """The body at rest, or with velocities `v` (n, 3) [m/s], and no matrix factored yet."""
        kept = body.kept
        assert isinstance(kept, PointVolumes)  # other bodies are refused
        memory = Prepared(kept.jacobian(body.rest), coarser(kept), middles(kept, body.rest), {})
        return start(body, attachments, v, memory=memory)

    def advance(self, state: State, boundary: BoundaryConditions) -> State:
        after = begin_frame(state, boundary)
        assert isinstance(after.rows, PointRows)  # other bodies are refused
        implicit, rows = after.memory.at(after.model, after.rows, boundary.dt, boundary.damping)
        rows.lam[:] = after.lam + after.model.rest_lam
        point_volumes_frame(after.frame(boundary), rows, implicit, Accuracy(self.tolerance, self.most_iterations), None)
        return replace(after, rows=rows, lam=rows.lam - after.model.rest_lam)


@dataclass(frozen=True, eq=False)
class Prepared:
    """The factors of a run, one for each step length and damping."""

    jacobian: csr_array
    """J at rest [m²], (m, 3n)."""
    coarse: csr_array
    """Of the volumes, (m, c) (layout.volume_inverse)."""
    middle: np.ndarray
    """Of the volumes [m], (m, 3)."""
    factors: dict[tuple[float, float], tuple[SpringFactor, Any]]

    def at(self, model: Model, rows: PointRows, dt: float, damping: float) -> tuple[SpringFactor, PointRows]:
        """The factor for steps of `dt` [s] with `damping` [1/s], and the rows with S⁻¹ for that factor."""
        if (dt, damping) not in self.factors:
            implicit, schur = _factored(self.jacobian, model, dt, damping)
            self.factors[dt, damping] = implicit, inverse_at_rest(schur, self.coarse, self.middle)
        implicit, (diagonal, inverse) = self.factors[dt, damping]
        return implicit, rows._replace(diagonal=diagonal, inverse=inverse)


def _factored(jacobian: csr_array, model: Model, dt: float, damping: float) -> tuple[SpringFactor, np.ndarray]:
    """The factor, and S = J A⁻¹ Jᵀ at rest, (m, m)."""
    matrix = constant_matrix(model, dt, damping)
    free, held = (np.flatnonzero(mask) for mask in (model.inverse_mass > 0.0, model.inverse_mass == 0.0))
    inner = csr_array(matrix[free][:, free])
    across = csr_array(matrix.copy())
    across.data[~np.isin(across.indices, held)] = 0.0
    across.data[np.repeat(model.inverse_mass == 0.0, np.diff(across.indptr))] = 0.0
    across.eliminate_zeros()
    implicit = SpringFactor(
        triangular(inner.tocsc(), free),
        across.indptr.astype(np.uint32),
        across.indices.astype(np.uint32),
        across.data,
    )
    solve = splu(inner.tocsc()).solve
    components = [csr_array(jacobian[:, axis::3])[:, free].toarray() for axis in range(3)]
    schur = sum(part @ solve(np.ascontiguousarray(part.T)) for part in components)
    return implicit, np.asarray(schur)
