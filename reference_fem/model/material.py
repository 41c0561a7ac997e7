"""Nearly incompressible materials with the pressure as an unknown (docs/theory.md, reference).

Every material is W = iso(F) + p (J - 1) - p²/(2 kappa): p is positive in tension, the Cauchy stress is its deviator
plus p, and the pressure is zero at rest. The compiled law has two terms; a neo-Hookean solid has only the first.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from reference_fem.compiled import compiled
from reference_fem.errors import SolveError


def check_modulus(name: str, value: float):
    """Refuse a modulus that is not a positive finite number."""
    if not (np.isfinite(value) and value > 0.0):
        raise SolveError(
            f"the material's {name} is {value} Pa: it must be positive and finite "
            f"(a nearly incompressible tissue has kappa of about 1000 mu)"
        )


class TwoTermLaw(ABC):
    """Base class of all materials: everything that follows from `parameters`."""

    mu: float
    """Shear modulus at rest [Pa]."""
    kappa: float
    """Bulk modulus [Pa]."""

    @property
    @abstractmethod
    def parameters(self) -> np.ndarray:
        """Parameters of the compiled law: (2 c1, 2 c2, kappa) [Pa]."""

    def energy_density(self, F: np.ndarray, p: np.ndarray):
        """W [J/m³] for F (..., 3, 3) and p (...) [Pa]; independent of the kernel, to check it."""
        m1, m2, kappa = self.parameters
        J, C = np.linalg.det(F), np.swapaxes(F, -1, -2) @ F
        I1 = np.trace(C, axis1=-2, axis2=-1)
        I2 = 0.5 * (I1**2 - np.sum(C * C, axis=(-2, -1)))
        isochoric = m1 * (I1 * J ** (-2.0 / 3.0) - 3.0) + m2 * (I2 * J ** (-4.0 / 3.0) - 3.0)
        return 0.5 * isochoric + p * (J - 1.0) - 0.5 * p**2 / kappa

    def stress(self, F: np.ndarray, p: np.ndarray):
        """First Piola-Kirchhoff stress P (..., 3, 3) [Pa], P Fᵀ = dev(m1 b + m2 (I1 b - b²)) + J p.

        m1, m2 = 2 c1 J^-2/3, 2 c2 J^-4/3, b = F Fᵀ; independent of the kernel, to check it.
        """
        J = np.linalg.det(F)[..., None, None]
        b, one = F @ np.swapaxes(F, -1, -2), np.eye(3)
        I1 = np.trace(b, axis1=-2, axis2=-1)[..., None, None]
        shear = self.parameters[0] * J ** (-2.0 / 3.0) * b + self.parameters[1] * J ** (-4.0 / 3.0) * (I1 * b - b @ b)
        deviator = shear - np.trace(shear, axis1=-2, axis2=-1)[..., None, None] / 3.0 * one
        return (deviator + J * np.asarray(p)[..., None, None] * one) @ np.swapaxes(np.linalg.inv(F), -1, -2)


@dataclass(frozen=True)
class NeoHookean(TwoTermLaw):
    """W = mu/2 (J^-2/3 I1 - 3) + p (J - 1) - p²/(2 kappa); mu, kappa in Pa.

    Raises SolveError when mu or kappa is not a positive finite number.
    """

    mu: float
    kappa: float

    def __post_init__(self):
        check_modulus("mu", self.mu)
        check_modulus("kappa", self.kappa)

    @property
    def parameters(self):
        """(mu, 0, kappa) [Pa]."""
        return np.array([self.mu, 0.0, self.kappa])


@dataclass(frozen=True)
class MooneyRivlin(TwoTermLaw):
    """W = c1 (J^-2/3 I1 - 3) + c2 (J^-4/3 I2 - 3) + p (J - 1) - p²/(2 kappa), shear modulus 2 (c1 + c2); all in Pa.

    Two-term law of Mooney (1940) and Rivlin (1948), made isochoric (docs/theory.md, eq. 6.14). Raises SolveError
    when kappa or the shear modulus is not positive and finite, or c1 or c2 is negative: then the energy is not
    polyconvex.
    """

    c1: float
    c2: float
    kappa: float

    def __post_init__(self):
        for name, value in (("c1", self.c1), ("c2", self.c2)):
            if not value >= 0.0:
                raise SolveError(
                    f"the material's {name} is {value} Pa: it must not be negative, or large strains have no solution"
                )
        check_modulus("mu = 2 (c1 + c2)", self.mu)
        check_modulus("kappa", self.kappa)

    @property
    def mu(self):
        """Shear modulus at rest [Pa]."""
        return 2.0 * (self.c1 + self.c2)

    @property
    def parameters(self):
        """(2 c1, 2 c2, kappa) [Pa]."""
        return np.array([2.0 * self.c1, 2.0 * self.c2, self.kappa])


Material = NeoHookean | MooneyRivlin


@compiled()
def cofactor_into(F: np.ndarray, cof: np.ndarray):
    """cof = dJ/dF (3, 3) and J = det F."""
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        for r in range(3):
            s, t = (r + 1) % 3, (r + 2) % 3
            cof[i, r] = F[j, s] * F[k, t] - F[j, t] * F[k, s]
    return F[0, 0] * cof[0, 0] + F[0, 1] * cof[0, 1] + F[0, 2] * cof[0, 2]


@compiled()
def response_into(
    F: np.ndarray,
    p: float,
    parameters: np.ndarray,
    H: np.ndarray,
    P: np.ndarray,
    A: np.ndarray,
    scratch: np.ndarray,
    tangent: bool,
):
    """P = dW/dF (3, 3) [Pa], H = F^-T and, if tangent, A = dP/dF (9, 9) [Pa]; returns J, and J <= 0 leaves the rest
    unset.

    With m = 2 c1 J^-2/3: P = m (F - I1/3 H) + p J H and, row iJ, column kL,
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
            if not tangent:
                continue
            for k in range(3):
                for s in range(3):
                    A[3 * i + r, 3 * k + s] = (
                        direct * H[i, r] * H[k, s]
                        + crossed * H[i, s] * H[k, r]
                        - mixed * (F[i, r] * H[k, s] + H[i, r] * F[k, s])
                    )
            A[3 * i + r, 3 * i + r] += m
    if parameters[1] != 0.0:
        add_second_invariant(F, H, I1, parameters[1] * J ** (-4.0 / 3.0), P, A, scratch)
    return J


@compiled()
def add_second_invariant(
    F: np.ndarray, H: np.ndarray, I1: float, m: float, P: np.ndarray, A: np.ndarray, scratch: np.ndarray
):
    """P += m (D - 2/3 I2 H), A += its derivative, m = 2 c2 J^-4/3; I2 = (I1² - |C|²)/2, D = I1 F - F C.

    A: m (dD - 4/3 (D⊗H + H⊗D) + 2/3 I2 (4/3 H⊗H + H_iL H_kJ)), and with b = F Fᵀ
    dD = 2 F⊗F - F_iL F_kJ + (I1 δ_ik - b_ik) δ_JL - δ_ik C_LJ.
    """
    C, b, D = scratch[0], scratch[1], scratch[2]
    I2 = 0.5 * I1 * I1
    for i in range(3):
        for r in range(3):
            C[i, r] = F[0, i] * F[0, r] + F[1, i] * F[1, r] + F[2, i] * F[2, r]
            b[i, r] = F[i, 0] * F[r, 0] + F[i, 1] * F[r, 1] + F[i, 2] * F[r, 2]
            I2 -= 0.5 * C[i, r] * C[i, r]
    for i in range(3):
        for r in range(3):
            D[i, r] = I1 * F[i, r] - (F[i, 0] * C[0, r] + F[i, 1] * C[1, r] + F[i, 2] * C[2, r])
            P[i, r] += m * (D[i, r] - 2.0 / 3.0 * I2 * H[i, r])
    for i in range(3):
        for r in range(3):
            for k in range(3):
                for s in range(3):
                    slope = 2.0 * F[i, r] * F[k, s] - F[i, s] * F[k, r]
                    slope -= 4.0 / 3.0 * (D[i, r] * H[k, s] + H[i, r] * D[k, s])
                    slope += 2.0 / 3.0 * I2 * (4.0 / 3.0 * H[i, r] * H[k, s] + H[i, s] * H[k, r])
                    A[3 * i + r, 3 * k + s] += m * slope
                A[3 * i + r, 3 * k + r] -= m * b[i, k]
                A[3 * i + r, 3 * i + k] -= m * C[r, k]
            A[3 * i + r, 3 * i + r] += m * I1
