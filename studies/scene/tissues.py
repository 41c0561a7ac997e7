"""Tissues with the sources of their constants."""

import math
import re
from dataclasses import dataclass

from studies.base.errors import StudyError


@dataclass(frozen=True)
class Tissue:
    """Nearly incompressible soft tissue; the mass-spring body matches mu, and its volume constraint replaces kappa."""

    shear_modulus: float
    """mu [Pa]."""
    density: float
    """rho [kg/m³]."""
    source: str
    """Where the numbers come from."""
    bulk_over_shear: float = 5000.0
    """kappa/mu of the reference [1]."""

    def __post_init__(self) -> None:
        for name, unit in (("shear_modulus", "Pa"), ("density", "kg/m³"), ("bulk_over_shear", "1")):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 < value < math.inf:
                raise StudyError(f"a tissue has {name} = {value!r} [{unit}]; give a finite number above 0")


KIDNEY = Tissue(4900.0, 1050.0, "kidney, MR elastography at 45 Hz: 4.9 ± 0.5 kPa; density about 1,050 kg/m³")


SPLEEN = Tissue(
    3600.0, 1060.0, "spleen, MR elastography at 60 Hz: 3.6 ± 0.3 kPa (Talwalkar et al. 2009); density as liver"
)


STOMACH = Tissue(640.0, 1058.0, "stomach wall, MR elastography: 0.64 kPa; wall tests at large stretch are far stiffer")


BLADDER = Tissue(10_000.0, 1040.0, "bladder wall, assumed: published moduli span a decade; the pressure scales with mu")


LIVER = Tissue(1800.0, 1060.0, "liver, MR elastography: 1.8 ± 0.4 kPa; density 1,060 kg/m³")


TISSUES = {"bladder": BLADDER, "kidney": KIDNEY, "liver": LIVER, "spleen": SPLEEN, "stomach": STOMACH}


def tissue_named(text: str) -> str:
    """The tissue of TISSUES whose name is a word of a text, such as a file name: "spleen" of "VH_F_Spleen.stl".

    Raises StudyError for none or several.
    """
    words = {word.lower() for word in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", text)}
    names = [name for name in TISSUES if name in words]
    if len(names) != 1:
        what = f"names {' and '.join(names)}" if names else "does not name its organ"
        raise StudyError(f"{text} {what}; say which tissue it is: --tissue {', '.join(TISSUES)}")
    return names[0]
