"""What varies between the members of a population, how far, and where that is known from."""

from dataclasses import dataclass, replace

from studies.scene.library import KIDNEY_PROBE, LIVER_PROBE, STOMACH_PROBE
from studies.scene.scene import ReferencePlan, Scene

Range = tuple[float, float]
MEMBER = ReferencePlan(variants=(), tolerance=0.01, most=90e3)
"""Of a member: a minute of processor time, bars of about a third of the target."""


@dataclass(frozen=True)
class Ranges:
    """Of one organ. All that is drawn is drawn evenly between two ends."""

    scene: Scene
    """Whose clock, damping and density the members share."""
    spread: float
    """Of all lengths of the organ (studies.geometry.vary)."""
    shear_modulus: Range
    """[Pa]."""
    radius: Range
    """Of the probe [m]: a fingertip to two fingers."""
    depth: Range
    """How far the probe is pushed in [m]."""
    shift: float
    """How far from the palpation point of the default organ the probe may stand, along the surface [m]."""
    plan: ReferencePlan
    """Of every member."""
    sources: tuple[str, ...]
    wall: Range | None = None
    """Thickness of the wall of a hollow organ [m]; None for a solid one."""


RANGES: dict[str, Ranges] = {
    "liver": Ranges(
        LIVER_PROBE,
        spread=0.2,
        shear_modulus=(1370.0, 2660.0),
        radius=(0.015, 0.025),
        depth=(0.005, 0.012),
        shift=0.030,
        plan=MEMBER,
        sources=(
            "volume 1,505 ± 385 mL by MR, n = 2,773 (Eur. J. Radiol. 106 (2018) 32): a spread of 20 % gives ± 24 %",
            "stiffness 1.37 to 2.66 kPa in 102 healthy adults by MR elastography (Obrzut et al., Pol. Arch. Intern. "
            "Med.: 2.14 ± 0.28 kPa)",
        ),
    ),
    "kidney": Ranges(
        KIDNEY_PROBE,
        spread=0.2,
        shear_modulus=(3900.0, 5900.0),
        radius=(0.011, 0.018),
        depth=(0.0035, 0.007),
        shift=0.015,
        plan=MEMBER,
        sources=(
            "volume 137 ± 30 mL by ultrasound (Lee, J. Korean Soc. Med. Ultrasound 15 (1996) 63): a spread of 20 % "
            "gives ± 24 %",
            "shear modulus 4.9 ± 0.5 kPa by MR elastography at 45 Hz (J. Magn. Reson. Imaging 34 (2011) 880), two "
            "standard deviations to both sides",
        ),
    ),
    "stomach": Ranges(
        STOMACH_PROBE,
        spread=0.2,
        shear_modulus=(640.0, 640.0),
        radius=(0.020, 0.030),
        depth=(0.008, 0.015),
        shift=0.025,
        plan=replace(MEMBER, base=430),
        sources=(
            "about 1 L after a meal (Ferrua and Singh, J. Food Sci. 75 (2010) R151); no spread is given there, 20 % of "
            "the lengths are assumed",
            "wall 4.9 ± 1.6 mm (Suk et al., J. Clin. Ultrasound 36 (2008) 462), one standard deviation to both sides",
            "shear modulus 0.64 kPa by MR elastography, no spread known; errors of a uniform body pressed slowly do "
            "not depend on it",
        ),
        wall=(0.0033, 0.0065),
    ),
}
"""Organ -> what varies."""
