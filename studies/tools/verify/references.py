"""Published references solved again, by the code as it is."""

import tempfile
from pathlib import Path

from reference_fem.oracles import Check
from studies.reference.load import Reference, load_reference, reference_for
from studies.reference.published import published
from studies.reference.reference_solves import ReferenceSolve
from studies.reference.sample import Sample, SamplePoints
from studies.reference.solve import solve
from studies.reference.uncertainty import QUANTITIES
from studies.scene.library import CUT, JUDGED
from studies.scene.scene import Scene


def published_scenes() -> dict[str, Scene]:
    """Scenes of the catalogue that have a published reference, by name."""
    return {scene.name: scene for scene in (*JUDGED, *CUT) if published(scene) is not None}


def solved_again(scene: Scene) -> list[Check]:
    """Checks of the scene, solved again by its plan, against the published one, within the sum of both error bars.

    Raises StudyError where it does not converge.
    """
    with tempfile.TemporaryDirectory() as folder:
        solve(Path(folder), ReferenceSolve(scene))
        again = load_reference(Path(folder), scene)
    former = reference_for(Path(), scene)
    assert again is not None and former is not None  # published scenes have a plan
    return checks_of(former, again)


def checks_of(former: Reference, again: Reference) -> list[Check]:
    """A check for each quantity of the scene, at the sample points of the second."""
    place, count = f"{again.scene.name}, {len(again.meshes)} meshes", int(again.record.attributes["unknowns"])
    there, here = (sample_at(reference, again.at) for reference in (former, again))
    checks = []
    for name, bar in again.total_uncertainty.items():
        allowed = bar + former.total_uncertainty[name]
        apart = QUANTITIES[name](again.at, here, there)
        checks.append(Check(name, "1", 0.0, apart, allowed, place, count, absolute=True))
    return checks


def sample_at(reference: Reference, at: SamplePoints) -> Sample:
    """The finest mesh of a reference, sampled at points of another reference."""
    finest = reference.meshes[0]
    series = {name: reference.field(name) for name in ("volume", "pressure", "lumen_pressure")}
    u = reference.displacement(at.points)
    return Sample("", finest.unknowns, finest.size, u, reference.force, **series, frequency=finest.frequency)
