"""The script and the style of report.html in a real browser without network: it moves, obeys keys, sorts, filters, has
an address for every case, and can be read."""

import base64
import io
import json
import shutil
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from studies.report.page import write
from tests.studies.report.page.made_up_page import made_up_page, made_up_parts
from tests.studies.report.page.unpack import unpack_frames, unpack_series

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
"""WebGL by software, which needs an option."""


@pytest.fixture(scope="session")
def file(tmp_path_factory):
    """The page; to be read, not changed."""
    return made_up_page(tmp_path_factory.mktemp("browser"))


@pytest.fixture(scope="module")
def browser():
    """Chromium; without it, or without what drives it, a test is skipped."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="the extra 'browser' is not installed")
    if CHROMIUM is None:
        pytest.skip("no Chromium is installed (Debian: apt-get install chromium)")
    with sync_api.sync_playwright() as driver:
        started = driver.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield started
        started.close()


@pytest.fixture
def visit(browser, file):
    """Opens the page; afterwards the only request was the page, and `complaints` is empty."""
    contexts, requests, complaints = [], [], []

    def go(before: str = "", where: str = "", **options):
        context = browser.new_context(offline=True, **{"viewport": {"width": 1280, "height": 900}} | options)
        contexts.append(context)
        if before:
            context.add_init_script(before)
        page = context.new_page()
        page.on("request", lambda request: requests.append(request.url))
        page.on("console", lambda message: complaints.append(message.text))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.goto(file.as_uri() + where)
        if not before:
            page.wait_for_selector("#canvas[data-shown]")
        return page

    yield go
    for context in contexts:
        context.close()
    assert {url.split("#")[0] for url in requests} <= {file.as_uri()} and complaints == []


FIRST_PICTURE = 2.0
"""[s]."""
CONTRAST = 4.5
RATIOS = (Path(__file__).parent / "contrast.js").read_text(encoding="utf-8")


def pixels(png: bytes) -> np.ndarray:
    """A picture as numbers, (h, w, 3)."""
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)


def picture(page) -> np.ndarray:
    """What is drawn on the canvas, wherever on the screen it is, (h, w, 3)."""
    return pixels(base64.b64decode(page.evaluate("canvas.toDataURL()").split(",")[1]))


def column(page, number: int) -> list[str]:
    """Cells of a column of the table of cases, counted from 1, in the rows that are shown."""
    return page.locator(f"#cases tbody tr:visible > :nth-child({number})").all_inner_texts()


def until(page, expression: str, argument=None, seconds: float = 10.0) -> None:
    """Waits until JavaScript is true of the page; playwright's own way needs eval, which the page forbids."""
    end = time.monotonic() + seconds
    while not page.evaluate(expression, argument):
        assert time.monotonic() < end, expression
        page.wait_for_timeout(20)


def shown(page) -> float:
    return float(page.get_attribute("#canvas", "data-shown"))


def to_time(page, key: str) -> None:
    page.focus("#time")
    page.keyboard.press(key)


def choose(page, *words: str) -> None:
    """Opens the first case whose name holds all words."""
    names = page.locator("#chosen option").all_inner_texts()
    page.locator("#chosen").select_option(label=next(name for name in names if all(word in name for word in words)))


def ids(page) -> list[str]:
    return list(json.loads(page.locator("#data").text_content())["cases"])


def wait_for(page, number: str) -> None:
    until(page, "(id) => state.id === id && state.given?.title === DATA.cases[id].title", number)


def test_the_first_picture_comes_soon_and_the_body_moves_beside_its_reference(visit):
    page = visit()
    took = [visit().evaluate("performance.now()") / 1e3 for _ in range(3)]  # other processes may use the machine
    assert min(took) <= FIRST_PICTURE
    last = picture(page)  # at full load, where the difference is
    assert shown(page) == 4.0
    to_time(page, "Home")
    first, half = picture(page), last.shape[1] // 2
    assert shown(page) == 0.0
    for side in (slice(0, half), slice(half, None)):  # the case and its reference, each with another shape
        rims = [np.abs(frame[:, side] - first[40, 20]).max(axis=2) > 10 for frame in (first, last)]
        assert (rims[0] != rims[1]).sum() > 500
    red = last[:, :, 0] - last[:, :, 2]
    assert (red[:, :half] > 60).sum() > 1000 and (red[:, half:] > 60).sum() == 0  # errors in colour, left alone


def test_positions_are_read_as_they_were_packed(visit):
    page = visit()
    data = json.loads(page.locator("#data").text_content())
    case = data["pieces"][f"case-{data['first']}"]
    given, history = case["replay"]["positions"], case["histories"]["volume"]["values"]
    unpacked = page.evaluate("async (given) => (await frames(given)).map((frame) => [...frame])", given)
    assert np.allclose(np.array(unpacked).reshape(-1, 6, 3), unpack_frames(given), atol=1e-8)
    values = page.evaluate("(given) => series(given)", history)
    assert np.allclose(np.array(values, dtype=float), unpack_series(history), rtol=1e-12, atol=1e-300)


def test_slider_play_and_picture_obey_keys(visit):
    page = visit()
    to_time(page, "Home")
    page.keyboard.press("ArrowRight")
    assert shown(page) == pytest.approx(4 / 120, abs=1e-3)
    to_time(page, "Home")
    page.focus("#play")
    page.keyboard.press("Enter")
    page.wait_for_selector("#canvas:not([data-shown='0.000'])")
    page.focus("#canvas")
    page.keyboard.press(" ")
    still = shown(page)
    page.wait_for_timeout(100)
    assert shown(page) == still > 0
    to_time(page, "End")
    front = picture(page)
    for key in ("ArrowLeft", "ArrowUp", "+"):
        page.focus("#canvas")
        page.keyboard.press(key)
        assert (picture(page) != front).any(), key
        page.keyboard.press("Home")
        assert (picture(page) == front).all(), key


def test_an_entry_from_outside_is_replayed_under_its_own_name(visit):
    page = visit()
    choose(page, "theirs-half_step")
    page.wait_for_selector("#canvas[data-shown]")
    assert page.locator("#names span").all_inner_texts() == ["theirs-half_step", "reference"]
    to_time(page, "Home")
    rest = picture(page)
    to_time(page, "End")
    moved, half = np.abs(picture(page) - rest) > 30, rest.shape[1] // 2
    assert moved[:, :half].any(axis=2).sum() > 500 and moved[:, half:].any(axis=2).sum() > 500
    choose(page, "entry unable")
    assert page.locator("#replay").is_hidden() and page.inner_text("#no-replay")


def test_a_scene_that_compares_no_points_colours_none_and_an_early_end_is_named(visit):
    page = visit()
    choose(page, "ball squeeze · tetra")
    page.wait_for_selector("#canvas[data-shown]")
    assert page.locator("#bar").is_hidden()
    choose(page, "surface", "free")
    assert page.locator("#replay").is_hidden()
    assert "diverged" in page.inner_text("#about") and page.locator("#plots path.case").count() == 2


def test_without_motion_the_body_jumps_from_frame_to_frame(visit):
    pictures = {}
    for motion in ("reduce", "no-preference"):
        page = visit(reduced_motion=motion)
        page.fill("#time", "60")  # a recorded frame, and a moment that is none
        frame = picture(page)
        page.fill("#time", "61")
        pictures[motion] = (picture(page) == frame).all()
    assert pictures == {"reduce": True, "no-preference": False}


def test_obstacles_are_round_and_where_the_scene_says(visit):
    page = visit()
    choose(page, "ball squeeze · tetra")
    page.wait_for_selector("#canvas[data-shown]")
    to_time(page, "End")
    discs = page.evaluate("veilsAt(state.shown, state.t).map((veil) => [...veil.x])")
    heights = sorted({round(float(z), 4) for disc in discs for z in disc[2::3]})
    assert heights == pytest.approx([-0.035, 0.035], abs=0.001)  # two planes, 15 mm each into a ball of 50 mm
    for span in ([0, 0, 0], [0.3, -0.4, 1.2]):
        x = np.array(page.evaluate("(span) => capsule(0.5, span).x", span)).reshape(-1, 3)
        share = np.clip(x @ np.array(span) / max(np.dot(span, span), 1e-300), 0, 1)
        assert np.allclose(np.linalg.norm(x - share[:, None] * span, axis=1), 0.5)


def test_tabs_obey_arrows(visit):
    page = visit()
    page.focus("[role=tab]")
    for key, name in (("ArrowRight", "frame_rate"), ("ArrowRight", "volume_loss"), ("End", "frame_rate")):
        page.keyboard.press(key)
        assert page.evaluate("document.activeElement.id") == f"tab-{name}"
        assert page.locator("[role=tabpanel]:visible").get_attribute("id") == f"panel-{name}"


def test_the_table_sorts_by_size_of_errors_with_what_is_unknown_last(visit):
    page = visit()
    heads = page.locator("#cases thead th").all_inner_texts()
    number = next(k for k, head in enumerate(heads, 1) if head.startswith("force"))
    head = page.locator(f"#cases thead th:nth-child({number})")
    for word, order in (("ascending", 1), ("descending", -1)):
        head.locator("button").focus()
        page.keyboard.press("Enter")
        assert head.get_attribute("aria-sort") == word
        cells = [cell.split("±")[0].replace("−", "-").replace("†", "") for cell in column(page, number)]
        sizes = [abs(float(cell)) for cell in cells if cell.strip() != "–"]
        assert len(sizes) == 6 and sizes == sorted(sizes)[::order] and cells[6:] == ["–"] * 3
    page.locator("#cases thead th:nth-child(1) button").click()
    assert head.get_attribute("aria-sort") is None and "onerror" in column(page, 1)[0]


def test_the_table_filters_by_all_words_and_opens_a_case(visit):
    page = visit()
    page.get_by_label("Filter").fill("nothing like it")
    assert column(page, 1) == [] and page.locator("#no-rows").is_visible()
    page.get_by_label("Filter").fill("clamped FREE")
    assert page.locator("#no-rows").is_hidden() and len(column(page, 1)) == 2
    assert all("ball clamped" in name and "free" in name for name in column(page, 1))
    page.locator("#cases tbody tr:visible a").first.click()
    page.wait_for_selector("#chosen:focus")
    assert "free" in page.locator("#chosen option:checked").inner_text()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_can_be_read_and_the_switch_changes_sides(visit, scheme):
    page = visit(color_scheme=scheme)
    for side in (scheme, {"light": "dark", "dark": "light"}[scheme]):
        worst = page.evaluate(RATIOS)
        assert len(worst) > 100 and worst[0]["ratio"] >= CONTRAST, (side, worst[:3])
        chart = pixels(page.locator(".chart:visible").first.screenshot())
        assert chart.mean() > 200 if side == "light" else chart.mean() < 60
        page.click("#theme")


def test_all_that_can_be_operated_has_a_name(visit):
    page = visit()
    nodes = page.context.new_cdp_session(page).send("Accessibility.getFullAXTree")["nodes"]
    named = {"button", "slider", "searchbox", "combobox", "tab", "link", "checkbox", "region", "tabpanel"}
    elements = [(n["role"]["value"], n.get("name", {}).get("value", "")) for n in nodes if not n.get("ignored")]
    assert {role for role, _ in elements} >= named
    assert [role for role, name in elements if role in {*named, "image"} and not name.strip()] == []


def test_without_webgl_a_sentence_stands_in_and_the_rest_works(visit):
    page = visit("HTMLCanvasElement.prototype.getContext = () => null;")
    page.wait_for_selector("#plots svg")
    assert page.locator("#replay").is_hidden() and "no WebGL2" in page.inner_text("#no-replay")
    assert page.locator("#plots figure").count() == 3 and page.locator(".best tbody").count() >= 1


def test_the_address_opens_a_case_follows_and_goes_back(visit):
    first, second, third = ids(visit())[:3]
    page = visit(where=f"#case={second}")
    wait_for(page, second)
    page.locator("#chosen").select_option(value=first)
    wait_for(page, first)
    assert page.evaluate("location.hash") == f"#case={first}"
    page.locator(f'#cases a[href="#case={third}"]').click()
    wait_for(page, third)
    page.locator('nav a[href="#charts"]').click()
    for number in (third, first, second):
        page.go_back()
        wait_for(page, number)


def test_an_unknown_address_has_a_message_and_the_first_case_is_shown(visit):
    page = visit(where="#case=<b>%")
    page.wait_for_selector("#canvas[data-shown]")
    assert "<b>%" in page.inner_text("#unknown").replace("%3Cb%3E", "<b>")
    assert page.evaluate("state.id") == ids(page)[0]


def test_cases_beside_the_page_are_loaded_without_a_server_and_missed_without_the_folder(
    browser, tmp_path, monkeypatch
):
    monkeypatch.setattr(write, "LIMIT", 1)  # a page that has room for no case
    path, _ = write.write_page(tmp_path, made_up_parts(tmp_path))
    assert path is not None
    page = browser.new_context(offline=True).new_page()
    page.goto(path.as_uri())
    page.wait_for_selector("#canvas[data-shown]")
    assert page.evaluate("Object.keys(DATA.pieces).length") == 2  # a case and its reference, and no more
    page.locator("#chosen").select_option(index=1)
    until(page, "Object.keys(DATA.pieces).length > 2 && state.shown")
    page.goto(shutil.copy(path, tmp_path / "moved.html").as_uri())
    shutil.rmtree(tmp_path / write.FOLDER)
    page.reload()
    until(page, "byId('no-replay').textContent !== ''")
    assert page.locator("#replay").is_hidden() and len(column(page, 1)) == 9
