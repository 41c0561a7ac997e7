"""An entry on the page: the reference itself, a tenth too far, among the published rows of its scene."""

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from studies.exchange.entry import entry_files, run_of_entry
from studies.exchange.meshes import given_meshes
from studies.meshing.bounds import SHAPE, SHAPE_VOLUME
from studies.metrics.metrics import force_end, mean_error, shape_volume
from studies.metrics.wish import SOLID
from studies.reference.load import reference_for
from studies.scene.library import BALL_CLAMPED
from studies.store.record import read_record
from studies.tools.advise.campaign import published_for
from tests.studies.report.page.test_write import data_of

NODES, TOO_FAR, TOO_STRONG = 150, 1.1, 1.2


@pytest.fixture(scope="module")
def handed_in(mesh_cache, tmp_path_factory):
    """Positions and forces of the reference of ball_clamped, each off by a known factor."""
    scene, path = BALL_CLAMPED, tmp_path_factory.mktemp("handed") / "mine.npz"
    points = given_meshes(scene, NODES)[0][0].points
    reference = reference_for(Path("none"), scene)
    positions = points + TOO_FAR * reference.displacements(points)
    t = np.concatenate([[0.0], reference.field("t")])
    force = TOO_STRONG * np.concatenate([[0.0], reference.force])
    np.savez(path, t=t, positions=np.concatenate([points[None], positions]), force=force)
    return path


@pytest.fixture
def page(organbench, handed_in, tmp_path):
    """What `judge` wrote, and its words."""
    options = ("--results", tmp_path, "--name", "mine", "--nodes", NODES, "--seconds", 0.2)
    code, out, _ = organbench("judge", "ball_clamped", handed_in, *options)
    assert code == 0 and str(tmp_path / "report.html") in out
    return (tmp_path / "report.html").read_text(encoding="utf-8")


def test_the_entry_is_shown_first_and_moves_beside_the_reference(page):
    data = data_of(page)
    (case,) = data["cases"].values()
    assert case["entry"] == "mine" and case["replayed"] and data["cases"][data["first"]] is case


def test_its_row_is_among_the_published_ones_in_the_order_of_how_near_they_are(page, tmp_path):
    table = pd.read_csv(published_for(tmp_path) / "accuracy" / "accuracy.csv")
    published = table.loc[table["scene"] == "ball_clamped"]
    texts = re.findall(r"<tr.*?</tr>", page[page.index('<table id="cases">') :], re.DOTALL)[1:]
    (place,) = [number for number, text in enumerate(texts) if ">entry<" in text]
    assert len(texts) == len(published) + 1 and all(">published<" in text for text in texts if text != texts[place])
    errors = [published["force_end [%]"].abs() / SOLID[0], published["mean_error [%]"] / SOLID[1]]
    shapes = [published["shape_error [%]"] / SHAPE, published["shape_volume [%]"].abs() / SHAPE_VOLUME]
    share = pd.concat([*errors, *(shape.where(shape > 1) for shape in shapes)], axis=1).max(axis=1)
    assert place == (share < entry_share(tmp_path)).sum() and 0 < place < len(published)


def entry_share(results) -> float:
    """The largest share of a target, of which the force is known: a fifth too large."""
    (path,) = entry_files(results)
    run = run_of_entry(read_record(path), reference_for(results, BALL_CLAMPED))
    assert force_end(run) == pytest.approx(100 * (TOO_STRONG - 1), abs=0.01)
    return max(force_end(run) / SOLID[0], mean_error(run) / SOLID[1], abs(shape_volume(run)) / SHAPE_VOLUME)


def test_the_page_says_what_the_entry_misses_and_goes_with_it(page, organbench, refused, tmp_path):
    answer = re.search(r"How near is mine\?</strong>(.*?)</li>", page)
    assert answer and "force off by +20.0" in answer[1] and "misses the target in force and displacement" in answer[1]
    assert page.count("<code>organbench judge ball_clamped mine.npz --name mine --seconds 0.2") == 1
    for path in entry_files(tmp_path):
        path.unlink()
    assert "nothing is stored" in refused("report", "--results", tmp_path)
