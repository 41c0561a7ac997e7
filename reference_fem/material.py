"""Nearly incompressible materials with the pressure as an unknown (docs/theory.md, reference)."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from reference_fem.errors import ReferenceProblem


@dataclass(frozen=True)
class NeoHookean:
    """W = mu/2 (J^-2/3 tr FᵀF - 3) + p (J - 1) - p²/(2 kappa); the pressure is zero at rest.

    p is positive in tension: the Cauchy stress is its deviator plus p. mu, kappa in Pa.
    Raises ReferenceProblem when mu or kappa is not a positive finite number.
    """

    mu: float
    kappa: float

    def __post_init__(self):
        for name, value in (("mu", self.mu), ("kappa", self.kappa)):
            if not (np.isfinite(value) and value > 0.0):
                raise ReferenceProblem(
                    f"the material's {name} is {value} Pa: it must be positive and finite "
                    f"(a nearly incompressible tissue has kappa of about 1000 mu)"
                )

    @property
    def parameters(self):
        """What the compiled element kernel needs: (mu, kappa) [Pa]."""
        return np.array([self.mu, self.kappa])

    def energy_density(self, F, p):
        """W [J/m³] for F (..., 3, 3) and p (...) [Pa]; written apart from the kernel, to check it."""
        J = np.linalg.det(F)
        isochoric = np.sum(F * F, axis=(-2, -1)) * J ** (-2.0 / 3.0) - 3.0
        return 0.5 * self.mu * isochoric + p * (J - 1.0) - 0.5 * p**2 / self.kappa


@njit(cache=True)
def cofactor_into(F, cof):
    """cof = dJ/dF (3, 3) and J = det F."""
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        for r in range(3):
            s, t = (r + 1) % 3, (r + 2) % 3
            cof[i, r] = F[j, s] * F[k, t] - F[j, t] * F[k, s]
    return F[0, 0] * cof[0, 0] + F[0, 1] * cof[0, 1] + F[0, 2] * cof[0, 2]


@njit(cache=True)
def neo_hookean_into(F, p, parameters, H, P, A):
    """P = dW/dF (3, 3) [Pa], A = dP/dF (9, 9) [Pa], H = F^-T; returns J, and J <= 0 leaves the rest unset.

    With m = mu J^-2/3: P = m (F - I1/3 H) + p J H and, row iJ, column kL,
    A = m (1 - 2/3 (F⊗H + H⊗F)) + (2/9 m I1 + p J) H⊗H + (m I1/3 - p J) H_iL H_kJ.
    """
    J = cofactor_into(F, H)
    if not J > 0.0:
        return J
    I1 = 0.0
    for i in range(3):
        for r in range(3):
            H[i, r] /= J
            I1 += F[i, r] * F[i, r]
    m = parameters[0] * J ** (-2.0 / 3.0)
    pJ = p * J
    direct, crossed, mixed = 2.0 / 9.0 * m * I1 + pJ, m * I1 / 3.0 - pJ, 2.0 / 3.0 * m
    for i in range(3):
        for r in range(3):
            P[i, r] = m * F[i, r] - crossed * H[i, r]
            for k in range(3):
                for s in range(3):
                    A[3 * i + r, 3 * k + s] = (
                        direct * H[i, r] * H[k, s]
                        + crossed * H[i, s] * H[k, r]
                        - mixed * (F[i, r] * H[k, s] + H[i, r] * F[k, s])
                    )
            A[3 * i + r, 3 * i + r] += m
    return J
