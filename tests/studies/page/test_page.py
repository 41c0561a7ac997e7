"""The page as a file: complete, within its size, nothing from elsewhere, and whole whatever names and texts hold."""

import base64
import io
import json
import re
import shutil
from html.parser import HTMLParser

import pandas as pd
import pytest

from studies.catalog import Chart
from studies.report.page import write as module
from studies.report.page.markup import script_json
from studies.report.page.pack import unpack_frames
from studies.report.page.part import part_path, read_part
from studies.report.page.svg import inline
from studies.report.page.write import ASSETS, SCRIPTS, write_page
from studies.report.results import draw_charts, report
from tests.plots.made_up import POINTS
from tests.studies.page.made_up_page import HELD, MOMENTS, NASTY, losses, made_up_parts, rates, theirs
from tests.studies.tiny import tiny_study

VOID = {"meta", "link", "input", "br", "img"}


class Parsed(HTMLParser):
    """Elements with their attributes; the stack of open ones must close in order."""

    def __init__(self, text):
        super().__init__()
        self.found, self.open, self.wrong = [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            self.wrong.append(tag)

    def ids(self):
        return [attributes["id"] for _, attributes in self.found if "id" in attributes]


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


def data_of(text):
    return json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)[1])


def test_it_is_whole_html_with_names_that_are_there_once(parsed):
    assert parsed.wrong == [] and parsed.open == []
    ids = parsed.ids()
    assert len(ids) == len(set(ids))
    for _, attributes in parsed.found:
        for name in ("aria-labelledby", "aria-controls", "aria-describedby", "for"):
            assert set((attributes.get(name) or "").split()) <= set(ids), attributes


def test_nothing_comes_from_elsewhere(page, parsed):
    names = ("src", "href", "xlink:href")
    links = [attributes[name] for _, attributes in parsed.found for name in names if name in attributes]
    assert links and all(link.startswith(("#", "data:")) for link in links)
    assert all(link[1:] in parsed.ids() for link in links if link.startswith("#"))
    assert "default-src 'none'" in page[1] and "@import" not in page[1]
    assert not re.search(r"url\((?!#)", page[1])


def test_no_name_or_text_can_break_it(page, parsed):
    assert NASTY not in page[1] and "<img" not in page[1]
    assert [tag for tag, _ in parsed.found].count("script") == 2
    assert any(NASTY in case["about"] for case in data_of(page[1])["cases"].values())


@pytest.mark.parametrize("text", ["</script>", "<!--<script>", "\u2028 & \u2029", "é ≤ 𝒳"])
def test_json_in_a_script_is_no_markup_and_reads_back(text):
    written = script_json({text: text})
    assert not set("<>&\u2028\u2029") & set(written) and json.loads(written) == {text: text}


def test_all_cases_are_in_the_table_once_and_all_rows_in_the_csv(page, parsed):
    table = page[1][page[1].index('<table id="cases">') : page[1].index("</table>")]
    assert table.count("<tr>") - 1 == len(losses()) + len(theirs())  # those of the other study are the same cases
    link = next(attributes["href"] for _, attributes in parsed.found if attributes.get("id") == "csv")
    rows = pd.read_csv(io.BytesIO(base64.b64decode(link.split(",", 1)[1])))
    assert len(rows) == len(losses()) + len(rates()) + 2 * len(theirs())
    assert set(rows["method"][rows["entry"]]) == {"theirs-half_step", "unable"}
    assert rows["force_end [%]"][0] == pytest.approx(-20.0) and NASTY in set(rows["scene"])
    assert "volume_loss, frame_rate".replace("_", " ") in table


def test_a_case_of_two_studies_has_replay_and_frame_times(page):
    cases = data_of(page[1])["cases"]
    both = [case for case in cases.values() if "replay" in case and "frame" in case["histories"]]
    assert len(both) == 2 and len(cases) == len(losses()) + len(theirs())
    held = [case["replay"] for case in cases.values() if "replay" in case and case["scene"] == "ball_clamped"]
    # Half of the way along z, of the worse of the two.
    assert [replay["largest"] for replay in held] == pytest.approx([0.5 * 0.3 * 0.05] * 3)
    assert both[0]["replay"]["positions"]["shape"] == [len(MOMENTS), 6]
    assert cases[data_of(page[1])["first"]]["replay"]["comparable"]


def test_entries_from_outside_stand_beside_ours_under_their_own_names(page):
    """With the replay of what they handed in: of one that moves 5 % too far."""
    cases = {case["entry"]: case for case in data_of(page[1])["cases"].values() if "entry" in case}
    assert set(cases) == {"theirs-half_step", "unable"}
    assert page[1].count('<span class="entry">entry</span>') == 2
    judged, unable = cases["theirs-half_step"], cases["unable"]
    assert judged["again"] == "organbench judge ball_clamped theirs.npz --name theirs-half_step"
    assert "nan" not in judged["title"] + judged["about"] and set(judged["histories"]) == {"volume", "force"}
    times, checkpoints = judged["replay"]["times"], HELD.checkpoints
    assert times == pytest.approx([0.0, *checkpoints]) and judged["replay"]["comparable"]
    shown = unpack_frames(judged["replay"]["positions"])
    truth = unpack_frames(judged["replay"]["reference"])
    assert shown[0] == pytest.approx(POINTS[:6], abs=1e-4)
    assert shown[-1] - POINTS[:6] == pytest.approx(1.05 * (truth[-1] - POINTS[:6]), abs=2e-4)
    assert "replay" not in unable and "so there is no replay" in unable["why"]
    assert "skipped (unable: it knows no caps)" in unable["about"]
    assert f"{len(losses()) + 2} cases, 2 of them entries from outside, of 2 studies" in page[1]


@pytest.mark.parametrize(
    ("less", "said"),
    [
        (300, ["no replay of 1 of 5 cases"]),
        (5_000, ["no replay of 5 of 5 cases", "no histories of"]),
        (10**6, ["no replay of 5 of 5 cases", "no histories of 7 of 7 cases", "more than"]),
    ],
)
def test_no_more_than_its_limit_and_what_had_to_go_is_said(kept, page, tmp_path, monkeypatch, less, said):
    root = shutil.copytree(kept[0], tmp_path / "kept")
    limit = len(page[1].encode()) - less
    monkeypatch.setattr(module, "LIMIT", limit)
    path, remarks = write_page(root, kept[1])
    assert (len(path.read_bytes()) <= limit) == (less < 10**6) and len(remarks) == len(said)
    assert all(words in remark for words, remark in zip(said, remarks, strict=True))
    assert Parsed(path.read_text(encoding="utf-8")).wrong == []


def test_without_results_there_is_no_page(tmp_path):
    assert write_page(tmp_path, [tiny_study()]) == (None, []) and not (tmp_path / "report.html").exists()


def test_report_writes_it_the_same_again(results):
    written, _ = report(results, [tiny_study()])
    assert written[-1] == results / "report.html" and part_path(results, tiny_study()).is_file()
    before = written[-1].read_bytes()
    assert report(results, [tiny_study()])[0][-1].read_bytes() == before
    part_path(results, tiny_study()).unlink()
    assert report(results, [tiny_study()])[0][-1].read_bytes() == before


def test_a_chart_that_keeps_no_svg_is_left_out_and_said(results):
    study = tiny_study(charts=(Chart("own.png", lambda runs, path: path.write_bytes(b"own")),))
    assert any("chart own.png is left out" in remark for remark in report(results, [study])[1])


def test_charts_are_the_same_again_small_and_without_what_a_page_has_no_use_for(kept, tmp_path):
    made_up_parts(tmp_path)
    charts = [read_part(root, kept[1][0])["charts"] for root in (kept[0], tmp_path)]
    assert charts[0] == charts[1] and [chart["file"] for chart in charts[0]] == ["volume.png", "squeeze.png"]
    for chart in charts[0]:
        shown = inline(chart["svg"], "c", "A <title>")
        assert len(shown) < len(chart["svg"]) and "<metadata" not in shown and "&lt;title&gt;" in shown
        assert Parsed(shown).wrong == [] and "<text" in shown
        used = set(re.findall(r"(?:url\(#|href=\"#)([^\")]+)", shown))
        assert used <= set(Parsed(shown).ids()) and all(name.startswith("c-") for name in used)
    assert "data:image/png" in charts[0][1]["svg"]  # faces, which may be thousands, as a picture


def test_pictures_are_as_without_copies(kept, tmp_path):
    """Keeping an SVG changes no PNG."""
    study = kept[1][0]
    draw_charts(tmp_path, study, losses())
    for chart in study.charts:
        name = f"{study.name}/{chart.file}"
        assert (tmp_path / name).read_bytes() == (kept[0] / name).read_bytes()


def test_scripts_and_style_are_small_and_belong_to_the_package():
    files = sorted(path.name for path in ASSETS.iterdir())
    assert files == sorted([*SCRIPTS, "page.css", "page.html"])
    assert all(len(path.read_text(encoding="utf-8").splitlines()) <= 250 for path in ASSETS.iterdir())
    settings = (ASSETS.parents[3] / "pyproject.toml").read_text(encoding="utf-8")
    assert 'studies = ["report/page/assets/*"]' in settings
