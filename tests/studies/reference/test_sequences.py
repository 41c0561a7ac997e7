"""The safety of nested meshes against stored sequences: the bar that coarser meshes give, and where finer ones ended.

Sequences: the published references, and those of sequences.csv: kidneys, livers and a spleen squeezed between planes
(n0 to n3: unknowns, fine to coarse; dij: change from mesh j to mesh i, relative to the size on i). The finest mesh is
not the truth either: of an error ~ n^-rate it has the share (n/n0)^rate left. The rates are those of all sequences.
"""

import csv
from functools import cache
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from scipy.optimize import brentq

from reference_fem.uncertainty import NESTED_SAFETY, NESTED_TWO, nested_error
from studies.reference.load import reference_for
from studies.reference.published import FOLDER, judged_scenes, published
from studies.reference.uncertainty import QUANTITIES
from studies.scene.quantities import allowed

RATES = {"force": 1.0, "force_end": 1.0, "surface": 0.8, "interior": 0.8, "surface_mean": 0.8}
BEFORE, BEFORE_TWO = 1.25, 3.0
"""The factors of version 0.3."""


class Sequence(NamedTuple):
    scene: str
    quantity: str
    unknowns: np.ndarray
    changes: np.ndarray
    """From mesh j to mesh i < j, [i, j]."""


@cache
def sequences() -> list[Sequence]:
    stored, scenes = list[Sequence](), judged_scenes()
    files = {entry.sha256: name for name, scene in scenes.items() if (entry := published(scene)) is not None}
    for name in files.values():  # scenes may share a reference
        reference, scene = reference_for(FOLDER, scenes[name]), scenes[name]
        if reference is None or not scene.reference.nested:
            continue
        at, meshes = reference.at, reference.meshes
        unknowns = np.array([mesh.unknowns for mesh in meshes], float)
        for quantity in RATES:
            if not allowed(scene, quantity):
                continue
            changes = np.zeros((len(meshes), len(meshes)))
            for i, j in zip(*np.triu_indices(len(meshes), 1), strict=True):
                changes[i, j] = QUANTITIES[quantity](at, meshes[j], meshes[i])
            stored.append(Sequence(name, quantity, unknowns, changes))
    with Path(__file__).with_name("sequences.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            unknowns = np.array([float(row[f"n{i}"]) for i in range(4) if row[f"n{i}"]])
            changes = np.zeros((len(unknowns), len(unknowns)))
            for i, j in zip(*np.triu_indices(len(unknowns), 1), strict=True):
                changes[i, j] = float(row[f"d{i}{j}"])
            stored.append(Sequence(row["scene"], row["quantity"], unknowns, changes))
    return stored


def errors_over_bars(meshes: int, left: bool = True) -> tuple[np.ndarray, np.ndarray]:
    """Of each mesh but the finest that has `meshes` − 1 coarser ones: its error over its bar of safety 1. The error is
    the change to the finest mesh, and, if `left`, what that has left. Also the scene of each."""
    factor = NESTED_SAFETY if meshes == 3 else NESTED_TWO
    rows = []
    for one in sequences():
        for j in range(1, len(one.unknowns) - meshes + 1):
            bar = nested_error(one.unknowns[j : j + meshes], one.changes[j, j + 1 : j + meshes]) / factor
            share = (one.unknowns[j] / one.unknowns[0]) ** RATES[one.quantity] if left else 0.0
            rows.append((one.changes[0, j] / (1.0 - share) / bar, one.scene))
    return np.array([ratio for ratio, _ in rows]), np.array([scene for _, scene in rows])


def rate_of(n: np.ndarray, changes: np.ndarray) -> float:
    """The rate p of three meshes, changes ~ n^-p, from those of the coarser two to the finest (2,); 0 to 6."""
    miss = lambda p: (n[2] ** -p - n[0] ** -p) / (n[1] ** -p - n[0] ** -p) - changes[1] / changes[0]  # noqa: E731
    low, high = 1e-3, 6.0
    return low if miss(low) > 0 else high if miss(high) < 0 else brentq(miss, low, high)


@pytest.mark.parametrize("quantity", RATES)
def test_the_rates_are_those_of_the_sequences(quantity):
    """The median over all threes of meshes: single ones scatter from 0 to 3."""
    rates = [
        rate_of(one.unknowns[list(three)], one.changes[three[0], three[1:]])
        for one in sequences()
        if one.quantity == quantity
        for three in combinations(range(len(one.unknowns)), 3)
    ]
    assert len(rates) > 80 and np.median(rates) == pytest.approx(RATES[quantity], abs=0.12)


@pytest.mark.parametrize(("meshes", "factor", "before"), [(3, NESTED_SAFETY, BEFORE), (2, NESTED_TWO, BEFORE_TWO)])
def test_95_of_100_errors_are_within_their_bars_and_not_many_more(meshes, factor, before):
    ratios, _ = errors_over_bars(meshes)
    assert 0.95 <= (ratios <= factor).mean() <= (ratios <= before).mean()
    assert (ratios <= 0.8 * factor).mean() < 0.95


@pytest.mark.parametrize(("meshes", "factor"), [(3, NESTED_SAFETY), (2, NESTED_TWO)])
def test_each_sequence_is_covered_by_a_factor_from_the_others(meshes, factor):
    ratios, scenes = errors_over_bars(meshes)
    others = {one: float(np.quantile(ratios[scenes != one], 0.95, method="higher")) for one in set(scenes)}
    inside = np.mean([ratio <= others[scene] for ratio, scene in zip(ratios, scenes, strict=True)])
    assert inside > 0.93 and 0.7 * factor < min(others.values()) < max(others.values()) < 1.15 * factor


def test_against_the_finest_mesh_alone_bars_seem_twice_as_wide_as_they_are():
    """What the finest mesh shares with the others its distance from them does not show."""
    seeming, real = (np.quantile(errors_over_bars(3, left)[0], 0.95) for left in (False, True))
    assert 1.5 < real / seeming < 2.5
