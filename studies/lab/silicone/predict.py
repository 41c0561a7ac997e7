"""What both solvers say of the loads that nothing was fitted to, and the table of who says what."""

import csv
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from massspring import ExplicitElements, ImplicitVolume
from studies.lab.silicone.beam import SIDE, Beam, Contestant, reference_rest, reference_swing
from studies.lab.silicone.chart import Bar, Point
from studies.lab.silicone.measured import LOADS, Load, swing_of

DURATION = 2.5
"""Of a release [s]: six cycles of the slowest swing, and the mean of the last of it."""
STEP = 0.005
"""Of the reference [s], a twenty-fifth of the shortest period."""
FINE, COARSE = Beam(3, 10), Beam(2, 6)
"""Of the reference; what the second says otherwise is its error bar."""
FIRST_GUESS = 260_000.0
"""Of E [Pa]."""
CLOSE = 1e-4
"""Share of the sag at which a fit ends."""

CONTESTANTS = (
    Contestant("quadratic, a volume per vertex", Beam(3, 10), "quadratic", ImplicitVolume()),
    Contestant("the same, load at mid-height", Beam(3, 10), "quadratic", ImplicitVolume(), height=0.5 * SIDE),
    Contestant("linear elements, a volume per node", Beam(5, 16), "cotangent", ImplicitVolume(), nodal=True),
    Contestant("explicit elements (K = 50 mu)", Beam(5, 16), "cotangent", ExplicitElements(), nodal=True),
    Contestant("springs, one volume", Beam(5, 16), "van_gelder", ImplicitVolume()),
)
"""The first is what we recommend."""
HEAD = ["who", "tip load [N]", "sag [mm]", "frequency [Hz]", "damping ratio [1]"]


def predicted() -> Iterator[Point]:
    """All rows; E is fitted on each mesh of the reference, and bodies have that of the finer."""
    yield from map(measured_row, LOADS)
    youngs = fitted_youngs(FINE)
    for contestant in CONTESTANTS:
        yield from body_rows(contestant, youngs)
    yield from reference_rows(COARSE, "reference, coarser mesh", fitted_youngs(COARSE))
    yield from reference_rows(FINE, "reference", youngs)


def measured_row(load: Load) -> Point:
    """Mean of both runs."""
    values = (float(np.mean(value)) for value in (load.sag, load.frequency, load.damping))
    return Point("measured", load.newton, *values)


def bars() -> dict[str, list[Bar]]:
    """What was measured: of the sag its stated uncertainty, of the rest half the difference of the two runs."""
    pairs = [(load, measured_row(load)) for load in LOADS]
    return {"sag": [Bar(row.newton, row.sag, load.uncertainty) for load, row in pairs]} | {
        name: [Bar(row.newton, getattr(row, name), 0.5 * float(np.ptp(getattr(load, name)))) for load, row in pairs]
        for name in ("frequency", "damping")
    }


def fitted_youngs(beam: Beam) -> float:
    """E [Pa] at which the reference on `beam` sags under its weight alone as far as the silicone does.

    The sag of a slender beam is nearly 1/E: E ← E sag/measured, until they are equal. Raises SolveError.
    """
    youngs, measured_sag = FIRST_GUESS, measured_row(LOADS[0]).sag
    while True:
        sag = 1e3 * float(reference_rest(beam, youngs, LOADS[0]).mean())
        if abs(sag / measured_sag - 1.0) < CLOSE:
            return youngs
        youngs *= sag / measured_sag


def fitted_damping() -> float:
    """c [1/s] of −c M v that damps the unloaded swing as measured: c = 2 ζ ω, ω = 2πf/√(1 − ζ²)."""
    row = measured_row(LOADS[0])
    return 4.0 * np.pi * row.damping * row.frequency / np.sqrt(1.0 - row.damping**2)


def reference_rows(beam: Beam, who: str, youngs: float) -> Iterator[Point]:
    """Of every load; the sag is that at rest."""
    for load in LOADS:
        t, sag = reference_swing(beam, youngs, load, fitted_damping(), DURATION, STEP)
        swing = swing_of(t, sag.mean(axis=1))
        rest = 1e3 * float(reference_rest(beam, youngs, load).mean())
        yield Point(who, load.newton, rest, swing.frequency, swing.damping)


def body_rows(contestant: Contestant, youngs: float) -> Iterator[Point]:
    """Of every load."""
    for load in LOADS:
        t, sag = contestant.swing(youngs, load, fitted_damping(), DURATION)
        swing = swing_of(t, sag.mean(axis=1))
        yield Point(contestant.name, load.newton, 1e3 * swing.sag, swing.frequency, swing.damping)


def write_table(path: Path, rows: Sequence[Point]) -> None:
    """Replaces the table."""
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(HEAD)
        table.writerows((row.who, row.newton, *(f"{value:.4f}" for value in row[2:])) for row in rows)


def read_table(path: Path) -> list[Point]:
    """Its rows."""
    with path.open(newline="", encoding="utf-8") as file:
        return [Point(who, *map(float, values)) for who, *values in list(csv.reader(file))[1:]]
