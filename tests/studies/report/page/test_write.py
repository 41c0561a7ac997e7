"""The page as a file: complete, within its size, without outside resources, and valid with any names and texts."""

import base64
import hashlib
import io
import json
import re
import shutil
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pandas as pd
import pytest

from studies.metrics.table import study_table
from studies.report.page import write as module
from studies.report.page.markup import script_json
from studies.report.page.part import part_path, read_part, write_part
from studies.report.page.svg import inline
from studies.report.page.write import write_page
from studies.report.results import report
from studies.store.ledger import Ledger
from tests.studies.plots.made_up import POINTS, STRETCH
from tests.studies.report.page.made_up_page import COLUMNS, HELD, MOMENTS, NASTY, losses, made_up_parts, rates, theirs
from tests.studies.report.page.unpack import unpack_frames, unpack_series
from tests.studies.tiny import tiny_study

VOID = {"meta", "link", "input", "br", "img"}


class Parsed(HTMLParser):
    """Elements with their attributes; the stack of open ones must close in order."""

    def __init__(self, text):
        super().__init__()
        self.elements, self.open, self.wrong = [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            self.wrong.append(tag)

    def ids(self):
        return [attributes["id"] for _, attributes in self.elements if "id" in attributes]


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """The folder in which the parts of two studies are kept, and the studies."""
    root = tmp_path_factory.mktemp("page")
    return root, made_up_parts(root)


@pytest.fixture(scope="module")
def page(kept):
    """The file and its text."""
    path, remarks = write_page(*kept)
    assert path is not None and remarks == []
    return path, path.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def parsed(page):
    return Parsed(page[1])


def cases_of(text):
    """Cases by id, with what is kept of them."""
    data = data_of(text)
    return {number: case | data["pieces"][f"case-{number}"] for number, case in data["cases"].items()}


def data_of(text):
    return json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)[1])


def test_it_is_whole_html_with_names_that_are_there_once(parsed):
    assert parsed.wrong == [] and parsed.open == []
    ids = parsed.ids()
    assert len(ids) == len(set(ids))
    for _, attributes in parsed.elements:
        for name in ("aria-labelledby", "aria-controls", "aria-describedby", "for"):
            assert set((attributes.get(name) or "").split()) <= set(ids), attributes


def test_nothing_comes_from_elsewhere(page, parsed):
    names = ("src", "href", "xlink:href")
    links = [attributes[name] for _, attributes in parsed.elements for name in names if name in attributes]
    assert links and all(link.startswith(("#", "data:")) for link in links)
    inside = [link for link in links if link.startswith("#")]
    cases = {link.removeprefix("#case=") for link in inside if link.startswith("#case=")}
    assert cases == set(data_of(page[1])["cases"])
    assert all(link[1:] in parsed.ids() for link in inside if not link.startswith("#case="))
    assert "default-src 'none'" in page[1] and "@import" not in page[1]
    assert not re.search(r"url\((?!#)", page[1])


def test_no_script_runs_but_its_own_and_no_name_or_text_can_break_it(page, parsed):
    """The policy names the script by its digest: no other runs, and no handler in an attribute."""
    script = page[1].split("<script>")[1].split("</script>")[0]
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    policy = re.search(r"script-src ([^;]*);", page[1])
    assert policy is not None and policy[1] == f"'sha256-{digest}' 'strict-dynamic'"
    assert NASTY not in page[1] and "<img" not in page[1]
    assert [tag for tag, _ in parsed.elements].count("script") == 2
    assert any(NASTY in case["about"] for case in data_of(page[1])["cases"].values())


@pytest.mark.parametrize("text", ["</script>", "<!--<script>", "\u2028 & \u2029", "é ≤ 𝒳"])
def test_json_in_a_script_is_no_markup_and_reads_back(text):
    written = script_json({text: text})
    assert not set("<>&\u2028\u2029") & set(written) and json.loads(written) == {text: text}


def test_all_cases_are_in_the_table_once_and_all_rows_in_the_csv(page, parsed):
    table = page[1][page[1].index('<table id="cases">') : page[1].rindex("</table>")]
    assert table.count("<tr") - 1 == len(losses()) + len(theirs())  # those of the other study are the same cases
    link = next(attributes["href"] for _, attributes in parsed.elements if attributes.get("id") == "csv")
    rows = pd.read_csv(io.BytesIO(base64.b64decode(link.split(",", 1)[1])))
    assert len(rows) == len(losses()) + len(rates()) + 2 * len(theirs())
    assert set(rows["method"][rows["entry"]]) == {"theirs-half_step", "unable"}
    assert rows["force_end [%]"][0] == pytest.approx(-20.0) and NASTY in set(rows["scene"])


def test_a_case_of_two_studies_has_replay_and_frame_times(page):
    cases, data = cases_of(page[1]), data_of(page[1])
    both = [case for case in cases.values() if "replay" in case and "frame" in case["histories"]]
    assert len(both) == 2 and len(cases) == len(losses()) + len(theirs())
    held = [case["replay"] for case in cases.values() if "replay" in case and case["scene"] == "ball_clamped"]
    # Along z, of the worst of the four: it is at its end, which goes 1.6 times as far, from the first checkpoint on.
    worst = (1.6 - HELD.checkpoints[0] / HELD.checkpoints[-1]) * 0.3 * 0.05
    assert [replay["largest"] for replay in held] == [pytest.approx(worst)] * 4
    recorded = [case["replay"] for case in cases.values() if not case.get("replay", {"straight": True})["straight"]]
    assert [replay["positions"]["shape"] for replay in recorded] == [[len(MOMENTS), 6]] * 4
    first = cases[data["first"]]["replay"]
    assert first["comparable"] and not first["straight"]


def test_a_case_without_recorded_positions_moves_between_its_checkpoints(page):
    """Of every record that reached one; the rest says why not."""
    cases = cases_of(page[1]).values()
    (straight,) = [case for case in cases if case.get("replay", {}).get("straight") and "entry" not in case]
    assert straight["scene"] == "ball_clamped" and "surface, 550" in straight["title"]
    assert straight["replay"]["times"] == pytest.approx([0.0, *HELD.checkpoints])
    assert len({case["why"] for case in cases if "replay" not in case}) == 2


def test_the_reference_has_its_own_shape_and_moves_as_it_did(page):
    """Nodes and triangles of its own surface; here it has six nodes, and each case another six."""
    data, cases = data_of(page[1]), cases_of(page[1])
    shape = data["pieces"][f"reference-{cases[data['first']]['replay']['reference']}"]
    moved = unpack_frames(shape["positions"])
    share = np.array(shape["checkpoints"]) / HELD.checkpoints[-1]
    assert shape["checkpoints"] == pytest.approx([0.0, *HELD.checkpoints])
    assert moved == pytest.approx((1 + share[:, None, None] * (STRETCH - 1)) * POINTS[:6], abs=2e-5)
    errors = unpack_series(cases[data["first"]]["replay"]["errors"]).reshape(len(share), 6)
    truth = np.linalg.norm(0.2 * share[:, None, None] * (STRETCH - 1) * POINTS[:6], axis=-1)
    assert errors == pytest.approx(truth, abs=1e-6)


def test_entries_from_outside_stand_beside_ours_under_their_own_names(page):
    """With the replay of what they handed in: of one that moves 5 % too far."""
    cases = {case["entry"]: case for case in cases_of(page[1]).values() if "entry" in case}
    assert set(cases) == {"theirs-half_step", "unable"}
    judged, unable = cases["theirs-half_step"], cases["unable"]
    assert judged["again"] == "organbench judge ball_clamped theirs.npz --name theirs-half_step"
    assert "nan" not in judged["title"] + judged["about"] and set(judged["histories"]) == {"volume", "force"}
    shown = unpack_frames(judged["replay"]["positions"])
    truth = unpack_frames(data_of(page[1])["pieces"][f"reference-{judged['replay']['reference']}"]["positions"])
    assert shown[0] == pytest.approx(POINTS[:6], abs=1e-4)
    assert shown[-1] - POINTS[:6] == pytest.approx(1.05 * (truth[-1] - POINTS[:6]), abs=2e-4)
    assert "replay" not in unable and "it knows no caps" in unable["about"]


@pytest.mark.parametrize(("less", "outside"), [(5_000, 4), (10**6, 12)])
def test_what_has_no_room_in_the_page_lies_beside_it(kept, page, tmp_path, monkeypatch, less, outside):
    """Whole: nothing is left out. The first case and its reference have room before all others."""
    root = shutil.copytree(kept[0], tmp_path / "kept")
    limit = len(page[1].encode()) - less
    monkeypatch.setattr(module, "LIMIT", limit)
    (root / module.FOLDER).mkdir()
    (root / module.FOLDER / "case-00000000.js").write_text("of an earlier page")
    path, remarks = write_page(root, kept[1])
    assert path is not None
    assert (len(path.read_bytes()) <= limit) == (less < 10**6) and len(remarks) == (less == 10**6)
    text = path.read_text(encoding="utf-8")
    assert Parsed(text).wrong == []
    files = sorted((root / module.FOLDER).iterdir())
    inside, whole = data_of(text), data_of(page[1])
    assert len(files) >= outside and (less < 10**6) == (f"case-{whole['first']}" in inside["pieces"])
    loaded = {}
    for file in files:
        call = re.fullmatch(r'keepPiece\("(.*?)", (.*)\);\n', file.read_text(encoding="utf-8"))
        assert call is not None and file.name == f"{call[1]}.js"
        loaded[call[1]] = json.loads(call[2])
    assert inside["pieces"] | loaded == whole["pieces"] and not set(inside["pieces"]) & set(loaded)


def test_report_writes_it_the_same_again_and_nothing_without_results(results, tmp_path):
    assert write_page(tmp_path, [tiny_study()]) == (None, []) and not (tmp_path / "report.html").exists()
    before = report(Ledger(results), [tiny_study()])[0][-1].read_bytes()
    part_path(results, tiny_study()).unlink()
    assert report(Ledger(results), [tiny_study()])[0][-1].read_bytes() == before


@pytest.mark.parametrize("text", ['{"rows"', "[]", "of this {}"])
def test_a_damaged_part_is_gathered_again(results, text):
    before = report(Ledger(results), [tiny_study()])[0][-1].read_bytes()
    path = part_path(results, tiny_study())
    whole = path.read_bytes()
    path.write_text(text.replace("of this", whole.decode().splitlines()[0] + "\n"))
    assert report(Ledger(results), [tiny_study()])[0][-1].read_bytes() == before and path.read_bytes() == whole


def test_a_damaged_part_of_a_study_without_results_is_left_out_and_named(kept, tmp_path):
    root = shutil.copytree(kept[0], tmp_path / "kept")
    part_path(root, kept[1][0]).write_text("[]")
    path, (remark,) = write_page(root, kept[1])
    assert path is not None and "volume_loss is left out" in remark and "volume_loss.page.json is damaged" in remark


@pytest.mark.parametrize("kind", ["cases", "references"])
def test_no_part_writes_a_file_elsewhere(kept, tmp_path, monkeypatch, kind):
    """A stranger may write a part with its digest: a part that names files is refused."""
    monkeypatch.setattr(module, "LIMIT", 0)
    root = shutil.copytree(kept[0], tmp_path / "kept")
    path = part_path(root, kept[1][0])
    part = json.loads(path.read_bytes().split(b"\n", 1)[1])
    part[kind] = {"/../../../stray": next(iter(part[kind].values()))}
    content = json.dumps(part).encode()
    path.write_bytes(hashlib.sha256(content).hexdigest().encode() + b"\n" + content)
    remarks = write_page(root, kept[1])[1]
    assert "volume_loss is left out" in remarks[0] and not list(tmp_path.rglob("*stray*"))


def test_commands_name_the_file_of_an_own_study(kept, tmp_path, monkeypatch):
    root = shutil.copytree(kept[0], tmp_path / "kept")
    own = replace(kept[1][0], word="my rod.py")
    write_part(root, own, losses(), study_table(losses(), COLUMNS), {})
    calls = []
    monkeypatch.setattr(module, "answers", lambda best, scenes, _: calls.append((best, scenes)) or {})
    path, _ = write_page(root, [own, kept[1][1]])
    assert path is not None
    best, scenes = calls[-1]  # its scenes are answered for, and come first
    assert scenes == {run.case.scene.name for run in losses()} and best[0]["scene"] in scenes
    text = path.read_text(encoding="utf-8")
    assert "organbench run &#39;my rod.py&#39; frame_rate" in text and "organbench report &#39;my rod.py&#39;" in text
    runs = [case["run"] for case in data_of(text)["cases"].values() if "entry" not in case]
    assert len(runs) == len(losses()) and all(run.startswith("organbench run 'my rod.py' --case ") for run in runs)


def test_charts_are_the_same_again_and_refer_to_themselves_alone(kept, tmp_path):
    made_up_parts(tmp_path)
    charts = [read_part(root, kept[1][0])["charts"] for root in (kept[0], tmp_path)]
    shown, again = ([inline(chart["svg"], "c", "A <title>") for chart in each] for each in charts)
    assert shown == again and [chart["file"] for chart in charts[0]] == ["volume.png", "squeeze.png"]
    for chart, text in zip(charts[0], shown, strict=True):
        assert len(text) < len(chart["svg"]) and "<metadata" not in text and "&lt;title&gt;" in text
        assert Parsed(text).wrong == [] and "<text" in text
        used = set(re.findall(r"(?:url\(#|href=\"#)([^\")]+)", text))
        assert used <= set(Parsed(text).ids()) and all(name.startswith("c-") for name in used)
    assert "data:image/png" in charts[0][1]["svg"]  # faces, which may be thousands, as a picture
