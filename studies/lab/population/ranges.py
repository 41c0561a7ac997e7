"""What varies between the members of a population, how far, and where that is known from."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from studies import BLADDER_FILL, KIDNEY_PROBE, LIVER_PROBE, SPLEEN_SAG, STOMACH_PROBE, ReferencePlan, Scene

Range = tuple[float, float]
MEMBER = ReferencePlan(variants=(), tolerance=0.01, most=90e3)
"""Of a member: a minute of processor time; bars of up to half of the target in force, 0.6 % in mean displacement."""
SQUEEZED = replace(MEMBER, at_contact=0, tolerance=0.008)
"""Of a squeezed member: bars below a third of the targets. A plane touches so much that no halving is needed there."""
SQUEEZE: Range = (0.10, 0.45)
"""Share of its thickness by which two planes squeeze a member of any organ [1]."""


@dataclass(frozen=True)
class Palpation:
    """A probe that is pushed in."""

    radius: Range
    """Of the probe [m]: a fingertip to two fingers."""
    depth: Range
    """How far the probe is pushed in [m]."""
    shift: float
    """How far from the palpation point of the default organ the probe may stand, along the surface [m]."""


@dataclass(frozen=True)
class Filling:
    """A lumen whose volume grows."""

    share: Range
    """Final volume of the lumen over that at rest [1]."""


@dataclass(frozen=True)
class Sagging:
    """An organ that hangs from what holds it."""

    acceleration: Range
    """Share of gravity that pulls along the direction of the scene's [m/s²]."""


@dataclass(frozen=True)
class Ranges:
    """Of the organ of a scene. All that is drawn is drawn evenly between two ends."""

    scene: Scene
    """Whose clock, damping and density the members share."""
    spread: float
    """Of all lengths of the organ (studies.geometry.vary)."""
    shear_modulus: Range
    """[Pa]."""
    load: Palpation | Filling | Sagging
    plan: ReferencePlan
    """Of every member."""
    sources: tuple[str, ...]
    own: Mapping[str, Range] = field(default_factory=dict)
    """Of single lengths of the organ, such as its wall, in place of the spread [m]."""


RANGES: dict[str, Ranges] = {
    "liver": Ranges(
        LIVER_PROBE,
        spread=0.2,
        shear_modulus=(1370.0, 2660.0),
        load=Palpation(radius=(0.015, 0.025), depth=(0.005, 0.012), shift=0.030),
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
        load=Palpation(radius=(0.011, 0.018), depth=(0.0035, 0.007), shift=0.015),
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
        load=Palpation(radius=(0.020, 0.030), depth=(0.008, 0.015), shift=0.025),
        plan=replace(MEMBER, base=430),
        sources=(
            "about 1 L after a meal (Ferrua and Singh, J. Food Sci. 75 (2010) R151); no spread is given there, 20 % of "
            "the lengths are assumed",
            "wall 4.9 ± 1.6 mm (Suk et al., J. Clin. Ultrasound 36 (2008) 462), one standard deviation to both sides",
            "shear modulus 0.64 kPa by MR elastography, no spread known; errors of a uniform body pressed slowly do "
            "not depend on it",
        ),
        own={"wall": (0.0033, 0.0065)},
    ),
    "spleen": Ranges(
        SPLEEN_SAG,
        spread=0.2,
        shear_modulus=(3000.0, 4200.0),
        load=Sagging(acceleration=(1.7, 4.9)),
        plan=MEMBER,
        sources=(
            "volume 215 mL, 107 to 315, by CT (Prassopoulos et al., Eur. Radiol. 7 (1997) 246): a spread of 20 % gives "
            "± 24 %",
            "gravity on a table tilted by 10 to 30 degrees: upright, elements at the outline of the hilum invert",
            "shear modulus 3.6 ± 0.3 kPa by MR elastography (Talwalkar et al. 2009), two standard deviations to both "
            "sides",
        ),
    ),
    "bladder": Ranges(
        BLADDER_FILL,
        spread=0.2,
        shear_modulus=(10_000.0, 10_000.0),
        load=Filling(share=(1.08, 1.2)),
        plan=MEMBER,
        sources=(
            "capacity of healthy adults 300 to 400 mL (Lukacz et al., Int. J. Clin. Pract. 65 (2011) 1026); a spread "
            "of 20 % of the lengths is assumed",
            "wall 3 mm full, 5 mm empty (Jequier, Am. J. Roentgenol. 149 (1987) 563)",
            "filled by 8 to 20 %: from 23 % on a wall of one kept volume snaps through at the dome",
            "shear modulus assumed: displacements of a uniform wall do not depend on it",
        ),
        own={"wall": (0.003, 0.005)},
    ),
}
RANGES["thin_liver"] = replace(
    RANGES["liver"],
    own={"margin": (0.002, 0.007), "left_lobe": (0.040, 0.051)},
    plan=replace(MEMBER, base=1000, most=120e3),  # fewer nodes lose the margin
    sources=(
        "margin and left lobe: an adaptive body of 1,194 nodes loses 3.1 % of the size of one with the least of both, "
        "3.05 % of a real liver's (Visible Human female, HuBMAP CCF 3D Reference Object Library); the largest are "
        "below those of all other random livers",
        *RANGES["liver"].sources,
    ),
)
"""Name of the members -> what varies."""
