"""The factored tangent of one evaluation, and the displacements by given forces."""

import numpy as np

from reference_fem.system.saddle_point import Evaluation, System


class Tangent:
    """Factors of a tangent, with its cavities as a border. Raises SolveError when it is singular.

    With K b = dV/dx, the fields move by d + b dp, and dV/dx·(d + b dp) = -misfit gives dp: one more solve for each
    cavity, no dense row in the pattern (docs/theory.md, eq. 6.7).
    """

    def __init__(self, system: System, evaluation: Evaluation):
        self.system, self.evaluation = system, evaluation
        system.solver.factor(system.pattern.upper(evaluation.values))
        if system.lumens:
            self.columns = system.solver.solve(np.asfortranarray(evaluation.gradients[:, system.pattern.free].T))
            self.matrix = evaluation.gradients[:, system.pattern.free] @ self.columns
            for k, lumen in enumerate(system.lumens):
                if lumen.by_pressure:
                    self.matrix[k] = np.eye(len(system.lumens))[k]

    def respond(
        self,
        forces: np.ndarray,
        misfits: np.ndarray | float = 0.0,
        lifted: np.ndarray | float = 0.0,
        checked: bool = True,
    ):
        """Change of all unknowns (total, ...) that balances forces on the free ones (n, ...) and closes the misfits.

        misfits (nc, ...): of the cavities. lifted (m, ...): change of the held unknowns, its forces among `forces`.
        checked: whether the solve checks its residual (SymmetricSolver.solve).
        """
        system, m = self.system, self.system.field_count
        change = np.zeros((system.total, *forces.shape[1:]))
        change[system.pattern.held] = lifted
        change[system.pattern.free] = system.solver.solve(forces, checked)
        if system.lumens:
            right = misfits - self.evaluation.gradients @ change[:m]
            for k, lumen in enumerate(system.lumens):
                if lumen.by_pressure:
                    right[k] = np.broadcast_to(misfits, right.shape)[k]
            change[m:] = np.linalg.solve(self.matrix, right)
            change[system.pattern.free] += self.columns @ change[m:]
        return change

    def newton(self, lift: np.ndarray, more: np.ndarray | float = 0.0):
        """Newton's change of all unknowns (total,), by `lift` (m,) at the held ones, with more forces on the free
        ones."""
        system, evaluation = self.system, self.evaluation
        forces = more - evaluation.residual[system.pattern.free] - system.pattern.lifting(evaluation.values) @ lift
        return self.respond(forces, -evaluation.residual[system.field_count :], lift)
