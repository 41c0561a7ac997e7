"""Measured presses of silicone cylinders: two numbers are fitted to each run, and the force beyond is predicted. Which
one number more helps is decided on sample A and judged on sample B.

Data: Dawood et al. 2026 (docs/silicone.md). A run is judged at compressions from its own contact.
"""

import itertools
import lzma
from collections.abc import Callable, Iterator, Mapping
from io import StringIO
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares

from studies import StudyError
from studies.lab.silicone.cylinder import COULOMB, FINER, HEIGHT, MOONEY, RADIUS, REFERENCE, YEOH, sliding

AREA = np.pi * RADIUS**2
DATA = Path(__file__).with_name("compression.csv.xz")
HEAD = "material,run,compression_mm,load_N"
FITTED = np.linspace(0.05, 0.2, 31)
"""Compressions at which a law is fitted."""
FARTHEST = 3e-3
"""Offset of a contact either way [m]."""
JUDGED = [0.25, 0.3, 0.35, 0.4, 0.45, 0.5]
"""Compressions at which its force is compared with the measured one."""
TABLED = (0.3, 0.4, 0.5)
STICK, SLIDE, FRICTION = "plates stick, neo-Hooke", "plates slide, neo-Hooke", "Coulomb"
NUMBERS = {
    MOONEY: np.linspace(-0.3, 0.3, 25).round(3),
    YEOH: np.linspace(-0.06, 0.06, 25).round(3),
    FRICTION: np.array([*COULOMB, np.inf]),
}
"""One number more, and the values that it may have: b of `reference_curves`, or the coefficient of friction."""
SCOPES: dict[str, Callable[[str], str]] = {
    "all": lambda _: "all",
    "family": lambda material: material.split("_")[0],
    "material": lambda material: material,
}
"""Which materials share the number."""
Law = Callable[[np.ndarray], np.ndarray]
"""F/(mu A) at compressions."""


class Run(NamedTuple):
    """One press."""

    material: str
    sample: str
    """"A" decides, "B" judges."""
    way: np.ndarray
    """[mm]."""
    force: np.ndarray
    """[N]."""


def read_runs(path: Path) -> list[Run]:
    """The runs of a CSV with the columns of HEAD, plain or .xz; their names begin with that of the sample. Raises
    StudyError for a file without these columns, and for one without samples A and B of every material."""
    raw = path.read_bytes()
    try:
        text = (lzma.decompress(raw) if path.suffix == ".xz" else raw).decode()
    except (lzma.LZMAError, UnicodeDecodeError) as error:
        raise StudyError(f"{path} is no text ({error}); give a CSV, plain or .xz") from error
    if HEAD not in text:
        raise StudyError(f"{path} has no line '{HEAD}'; give these columns")
    table = pd.read_csv(StringIO(text[text.index(HEAD) :]))
    runs = [
        Run(str(rows["material"].iloc[0]), str(rows["run"].iloc[0])[0], *rows.iloc[:, 2:4].to_numpy().T)
        for _, rows in table.groupby(["material", "run"], sort=False)
    ]
    for material, sample in itertools.product(dict.fromkeys(run.material for run in runs), "AB"):
        if not any((run.material, run.sample) == (material, sample) for run in runs):
            raise StudyError(f"{path} has no sample {sample} of {material}; name its runs A1, A2 …, B1, B2 …")
    return runs


def read_curves(path: Path) -> pd.DataFrame:
    """The table of `cylinder.curves` in a CSV. Raises StudyError for another file."""
    try:
        table = pd.read_csv(path)
    except ValueError as error:
        raise StudyError(f"{path} is no table ({error}); give press_curves.csv of an earlier run") from error
    missing = {"compression", REFERENCE, MOONEY, YEOH, FINER, *COULOMB.values()} - {*table}
    if missing:
        raise StudyError(f"{path} lacks {', '.join(sorted(missing))}; give press_curves.csv of an earlier run")
    return table


def law(curves: pd.DataFrame, kind: str = STICK, number: float = 0.0) -> Law:
    """Of a column of `curves`, with one `number` more if `kind` is one of NUMBERS."""
    ratio = curves[REFERENCE] if kind != SLIDE else np.ones(len(curves))
    if kind in (MOONEY, YEOH):
        ratio = ratio + number * curves[kind]
    elif kind == FRICTION and np.isfinite(number):
        ratio = ratio * curves[COULOMB[number]] / curves[FINER]
    spline = CubicSpline(curves["compression"], ratio)
    return lambda compression: spline(compression) * sliding(compression)


def force_at(run: Run, offset: float, compression: np.ndarray) -> np.ndarray:
    """Measured at `compression` from a contact at `offset` [m], [N]; NaN beyond the end of the run."""
    return np.interp(1e3 * (offset + HEIGHT * compression), run.way, run.force, right=np.nan)


def fit(run: Run, law: Law, modulus: float | None = None) -> tuple[float, float]:
    """mu [Pa], unless it is given, and the offset of the contact [m], from the forces between 5 and 20 % compression:
    least squares, mu found for each offset. Raises StudyError for a run that ends before."""
    shape = AREA * law(FITTED)

    def modulus_at(offset: float) -> float:
        return float(shape @ force_at(run, offset, FITTED) / (shape @ shape)) if modulus is None else modulus

    def left(offset: np.ndarray) -> np.ndarray:
        return modulus_at(offset[0]) * shape - force_at(run, offset[0], FITTED)

    if not np.isfinite(left(np.array([FARTHEST]))).all():
        raise StudyError(f"a run of {run.material} ends at {run.way[-1]:.3g} mm; give 30 % of the height or more")
    offset = float(least_squares(left, [0.0], bounds=(-FARTHEST, FARTHEST), x_scale=1e-4, xtol=1e-12).x[0])
    return modulus_at(offset), offset


def judged(runs: list[Run], law: Law, moduli: Mapping[str, float] | None = None) -> pd.DataFrame:
    """A row for each run, by (material, sample): "mu" [Pa], fitted unless `moduli` has it, and the errors of the forces
    that `law` then predicts at JUDGED [%]."""
    rows = []
    for run in runs:
        mu, offset = fit(run, law, None if moduli is None else moduli[run.material])
        off = mu * AREA * law(np.array(JUDGED)) / force_at(run, offset, np.array(JUDGED)) - 1.0
        rows.append((run.material, run.sample, mu, *(100.0 * off)))
    return pd.DataFrame(rows, columns=["material", "sample", "mu", *JUDGED]).set_index(["material", "sample"])


def of_sample(rows: pd.DataFrame, sample: str) -> pd.DataFrame:
    """The mean over its runs, by material."""
    return pd.DataFrame(
        rows.loc[rows.index.get_level_values("sample") == sample].groupby("material", sort=False).mean()
    )


class Option(NamedTuple):
    """A law, with the numbers of its groups of materials."""

    kind: str
    scope: str
    """"" without a further number."""
    numbers: dict[str, float]
    rows: pd.DataFrame
    """As `judged`."""


def options(runs: list[Run], curves: pd.DataFrame) -> Iterator[Option]:
    """Without a further number, and with the one whose mean square error on sample A is least, of each kind and
    scope."""
    for kind in (STICK, SLIDE):
        yield Option(kind, "", {}, judged(runs, law(curves, kind)))
    for kind, numbers in NUMBERS.items():
        tried = [judged(runs, law(curves, kind, number)) for number in numbers]
        squares = pd.DataFrame([(of_sample(rows, "A")[JUDGED] ** 2).mean(axis=1) for rows in tried])
        for scope, group_of in SCOPES.items():
            groups = squares.columns.map(group_of)
            chosen = {group: int(np.argmin(squares.loc[:, groups == group].mean(axis=1))) for group in groups.unique()}
            own = [tried[chosen[group_of(run.material)]].iloc[n] for n, run in enumerate(runs)]
            rows = pd.DataFrame(own).set_axis(tried[0].index)
            yield Option(kind, scope, {group: float(numbers[which]) for group, which in chosen.items()}, rows)


def table_of_laws(found: list[Option]) -> pd.DataFrame:
    """Errors of materials [%], the mean of their runs, over all JUDGED on sample A and at TABLED on sample B, and how
    many of B are below 2 % at 30 %."""
    rows = []
    for one in found:
        off, on_a = of_sample(one.rows, "B").abs(), of_sample(one.rows, "A")[JUDGED]
        row = {"law": one.kind, "one number more by": one.scope, "rms on A": np.sqrt((on_a**2).to_numpy().mean())}
        row |= {f"{what} at {100 * c:.0f} %": getattr(off[c], what)() for c in TABLED for what in ("median", "max")}
        numbers = " ".join(f"{group} {number:g}" for group, number in one.numbers.items())
        rows.append(row | {"within 2 % at 30 %": (off[0.3] < 2.0).sum(), "numbers": numbers})
    return pd.DataFrame(rows)


def scatter(rows: pd.DataFrame, law: Law) -> pd.DataFrame:
    """Standard deviation over mean of the measured forces of all runs of a material, by material and JUDGED [%]."""
    force = (1.0 / (1.0 + 0.01 * rows[JUDGED])).mul(rows["mu"], axis=0) * law(np.array(JUDGED))
    by_material = force.groupby("material", sort=False)
    return pd.DataFrame(100.0 * by_material.std() / by_material.mean())


def table_of_materials(runs: list[Run], curves: pd.DataFrame, found: list[Option]) -> pd.DataFrame:
    """mu [kPa] if plates stick, and how many times larger it is if they slide; the errors [%] by sample, of B also with
    the mu of A; the scatter [%]; b of Mooney and Rivlin by material and its errors on B."""
    stick, slide = (one.rows for one in found[:2])
    more = next(one for one in found if (one.kind, one.scope) == (MOONEY, "material"))
    of_a = of_sample(stick, "A")["mu"].to_dict()
    by_a = judged([run for run in runs if run.sample == "B"], law(curves), of_a)
    mu, other = (pd.Series(rows["mu"].groupby("material", sort=False).mean()) for rows in (stick, slide))
    table = pd.DataFrame({"mu": 1e-3 * mu, "mu if plates slide": other / mu, "b": pd.Series(more.numbers)})
    parts = {"A": of_sample(stick, "A"), "B": of_sample(stick, "B"), "B by mu of A": of_sample(by_a, "B")}
    parts |= {"scatter": scatter(stick, law(curves)), "B with b": of_sample(more.rows, "B")}
    for name, part in parts.items():
        for c in TABLED:
            table[f"{name} at {100 * c:.0f} %"] = part[c]
    return table.rename_axis("material").reset_index()


def over_sliding(runs: list[Run], law: Law) -> pd.DataFrame:
    """Mean measured force over that of plates that slide with the mu of `law`, by compression and material."""
    at, ratios = np.linspace(0.05, 0.5, 91), dict[str, list[np.ndarray]]()
    for run in runs:
        mu, offset = fit(run, law)
        ratios.setdefault(run.material, []).append(force_at(run, offset, at) / (mu * AREA * sliding(at)))
    return pd.DataFrame({material: np.mean(parts, axis=0) for material, parts in ratios.items()}, at)
