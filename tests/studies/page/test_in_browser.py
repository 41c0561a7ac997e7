"""report.html in a real browser without network: it loads in silence, moves, sorts, obeys keys, and can be read."""

import base64
import io
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from studies.report.page.pack import unpack_frames, unpack_series
from tests.studies.page.made_up_page import NASTY, made_up_page

sync_api = pytest.importorskip("playwright.sync_api", reason="the extra 'browser' is not installed")
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed (Debian: apt-get install chromium)")
FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
"""WebGL by software, which has to be asked for."""
FIRST_PICTURE = 2.0
"""[s]."""
CONTRAST = 4.5
RATIOS = (Path(__file__).parent / "contrast.js").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return made_up_page(tmp_path_factory.mktemp("browser"))


@pytest.fixture(scope="module")
def browser():
    with sync_api.sync_playwright() as driver:
        started = driver.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield started
        started.close()


@pytest.fixture
def visit(browser, file):
    """Opens the page; afterwards nothing may have been asked for or complained of but what `complaints` lists."""
    contexts, asked, complaints = [], [], []

    def go(before: str = "", **options):
        context = browser.new_context(offline=True, **{"viewport": {"width": 1280, "height": 900}} | options)
        contexts.append(context)
        if before:
            context.add_init_script(before)
        page = context.new_page()
        page.on("request", lambda request: asked.append(request.url))
        page.on("console", lambda message: complaints.append(message.text))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.goto(file.as_uri())
        if not before:
            page.wait_for_selector("#canvas[data-shown]")
        return page

    yield go
    for context in contexts:
        context.close()
    assert set(asked) <= {file.as_uri()} and complaints == []


def screen(page) -> np.ndarray:
    """The canvas as it is on the screen, (h, w, 3)."""
    return pixels(page.locator("#canvas").screenshot())


def picture(page) -> np.ndarray:
    """What is drawn on the canvas, wherever on the screen it is, (h, w, 3)."""
    return pixels(base64.b64decode(page.evaluate("canvas.toDataURL()").split(",")[1]))


def pixels(png: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)


def took(page) -> float:
    """From the start of loading to the first picture [s]."""
    return page.evaluate("performance.now()") / 1e3


def shown(page) -> float:
    return float(page.get_attribute("#canvas", "data-shown"))


def to_time(page, key: str) -> None:
    page.focus("#time")
    page.keyboard.press(key)


def test_the_first_picture_comes_soon_and_the_body_moves_beside_its_reference(visit):
    page = visit()
    assert min(took(page), *(took(visit()) for _ in range(2))) <= FIRST_PICTURE  # others may be at work here too
    first = screen(page)
    to_time(page, "End")
    last = screen(page)
    assert shown(page) == 4.0 and page.inner_text("#clock") == "4.00 s of 4 s"
    half = first.shape[1] // 2
    for side in (slice(0, half), slice(half, None)):  # the case and its reference, each more than a blank
        assert (np.abs(last - first)[:, side].max(axis=2) > 30).sum() > 500
        ground = first[40, 20]
        rims = [np.abs(frame[:, side] - ground).max(axis=2) > 10 for frame in (first, last)]
        assert (rims[0] != rims[1]).sum() > 500  # it has another shape, not only another colour
    red = last[:, :, 0] - last[:, :, 2]
    assert (red[:, :half] > 60).sum() > 1000 and (red[:, half:] > 60).sum() == 0  # errors in colour, left alone


def test_positions_are_read_as_they_were_packed(visit):
    page = visit()
    data = json.loads(page.locator("#data").text_content())
    case = data["cases"][data["first"]]
    given = case["replay"]["positions"]
    seen = page.evaluate("async (given) => (await frames(given)).map((frame) => [...frame])", given)
    assert np.allclose(np.array(seen).reshape(-1, 6, 3), unpack_frames(given), atol=1e-8)
    history = case["histories"]["volume"]["values"]
    values = page.evaluate("(given) => series(given)", history)
    assert np.allclose(np.array(values, dtype=float), unpack_series(history), rtol=1e-12, atol=1e-300)


def test_slider_play_and_picture_obey_keys(visit):
    page = visit()
    to_time(page, "ArrowRight")
    assert shown(page) == pytest.approx(4 / 120, abs=1e-3)
    page.keyboard.press("PageUp")
    assert shown(page) > 0.3 and page.get_attribute("#time", "aria-valuetext") == page.inner_text("#clock")
    to_time(page, "Home")
    page.focus("#play")
    page.keyboard.press("Enter")
    page.wait_for_selector("#canvas:not([data-shown='0.000'])")
    assert page.inner_text("#play") == "Pause"
    page.focus("#canvas")
    page.keyboard.press(" ")
    still = shown(page)
    page.wait_for_timeout(100)
    assert page.inner_text("#play") == "Play" and shown(page) == still > 0
    to_time(page, "End")
    front = picture(page)
    for key in ("ArrowLeft", "ArrowUp", "+"):
        page.focus("#canvas")
        page.keyboard.press(key)
        assert (picture(page) != front).any(), key
        page.keyboard.press("Home")
        assert (picture(page) == front).all(), key


def test_dragging_turns_and_the_button_turns_back(visit):
    page = visit()
    page.locator("#canvas").scroll_into_view_if_needed()
    front, box = picture(page), page.locator("#canvas").bounding_box()
    page.mouse.move(box["x"] + 200, box["y"] + 150)
    page.mouse.down()
    page.mouse.move(box["x"] + 320, box["y"] + 190, steps=4)
    page.mouse.up()
    assert (np.abs(picture(page) - front) > 30).any()
    page.click("#home")
    assert (picture(page) == front).all()


def test_tabs_obey_arrows(visit):
    page = visit()
    page.focus("[role=tab]")
    for key, name in (("ArrowRight", "frame_rate"), ("ArrowRight", "volume_loss"), ("End", "frame_rate")):
        page.keyboard.press(key)
        assert page.evaluate("document.activeElement.id") == f"tab-{name}"
        assert page.get_attribute(f"#tab-{name}", "aria-selected") == "true"
        assert page.locator("[role=tabpanel]:visible").get_attribute("id") == f"panel-{name}"
        assert page.locator(f"#panel-{name} svg").first.bounding_box()["height"] > 100


def column(page, number: int) -> list[str]:
    return page.locator(f"#cases tbody tr:visible > :nth-child({number})").all_inner_texts()


def test_the_table_sorts_by_size_of_errors_with_what_is_unknown_last(visit):
    page = visit()
    heads = page.locator("#cases thead th").all_inner_texts()
    number, status = (
        next(k for k, head in enumerate(heads, 1) if head.startswith(word)) for word in ("force", "status")
    )
    page.locator(f"#cases thead th:nth-child({status}) button").click()  # those that ended badly come first
    head = page.locator(f"#cases thead th:nth-child({number})")
    for word, order in (("ascending", 1), ("descending", -1)):
        head.locator("button").focus()
        page.keyboard.press("Enter")
        assert head.get_attribute("aria-sort") == word
        cells = [cell.split("±")[0].replace("−", "-").replace("†", "") for cell in column(page, number)]
        known = [abs(float(cell)) for cell in cells if cell.strip() != "–"]
        assert len(known) == 6 and known == sorted(known)[::order] and cells[6:] == ["–"] * 3
    page.locator("#cases thead th:nth-child(2) button").click()
    assert head.get_attribute("aria-sort") is None and column(page, 2) == sorted(column(page, 2), key=str.lower)


def test_the_table_filters_by_all_words_and_opens_a_case(visit):
    page = visit()
    page.get_by_label("Filter").fill("clamped FREE")
    assert page.inner_text("#count") == "2 of 9 cases"
    assert set(column(page, 5)) == {"free"} and set(column(page, 2)) == {"ball clamped"}
    page.locator("#cases tbody tr:visible button").first.click()
    page.wait_for_selector("#chosen:focus")
    assert "free" in page.locator("#chosen option:checked").inner_text()
    assert page.locator("#plots figure").count() == 3
    page.get_by_label("Filter").fill("nothing like it")
    assert page.locator("#cases tbody tr:visible").count() == 0


def test_an_entry_from_outside_is_found_sorted_and_replayed_under_its_own_name(visit):
    page = visit()
    page.get_by_label("Filter").fill("entry")
    assert page.inner_text("#count") == "2 of 9 cases"
    assert column(page, 5) == ["theirs-half_step entry", "unable entry"]
    page.get_by_label("Filter").fill("")
    heads = page.locator("#cases thead th").all_inner_texts()
    force = next(k for k, head in enumerate(heads, 1) if head.startswith("force"))
    page.locator(f"#cases thead th:nth-child({force}) button").click()
    assert column(page, 5)[0] == "theirs-half_step entry"  # 5 % off, all others more
    page.locator("#cases tbody tr:visible button").first.click()
    page.wait_for_selector("#canvas[data-shown]")
    assert page.locator("#names span").all_inner_texts() == ["theirs-half_step", "reference"]
    assert "so does the entry" in page.inner_text("#colours") and page.locator("#bar").is_visible()
    assert "organbench judge ball_clamped" in page.inner_text("#about")
    to_time(page, "Home")
    rest = picture(page)
    to_time(page, "End")
    moved = np.abs(picture(page) - rest) > 30
    half = rest.shape[1] // 2
    assert moved[:, :half].any(axis=2).sum() > 500 and moved[:, half:].any(axis=2).sum() > 500
    page.locator("#chosen").select_option(label=next(
        name for name in page.locator("#chosen option").all_inner_texts() if "entry unable" in name
    ))  # fmt: skip
    assert page.locator("#replay").is_hidden() and "no replay" in page.inner_text("#no-replay")
    assert "it knows no caps" in page.inner_text("#about")


def test_odd_names_are_shown_as_they_are(visit):
    page = visit()
    page.locator("#chosen").select_option(label=next(
        text for text in page.locator("#chosen option").all_inner_texts() if "onerror" in text
    ))  # fmt: skip
    assert NASTY in page.inner_text("#about") and page.locator("img").count() == 0


def test_a_scene_that_compares_no_points_colours_none_and_an_early_end_is_told(visit):
    page = visit()
    names = page.locator("#chosen option").all_inner_texts()
    page.locator("#chosen").select_option(label=next(name for name in names if name.startswith("ball squeeze · tetra")))
    page.wait_for_selector("#canvas[data-shown]")
    assert page.locator("#bar").is_hidden() and "no error is coloured" in page.inner_text("#colours")
    page.locator("#chosen").select_option(label=next(name for name in names if "surface" in name and "free" in name))
    assert page.locator("#replay").is_hidden() and "no replay" in page.inner_text("#no-replay")
    assert "diverged" in page.inner_text("#about") and page.locator("#plots path.case").count() == 2


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_can_be_read_and_the_switch_changes_sides(visit, scheme):
    page = visit(color_scheme=scheme)
    for side in (scheme, {"light": "dark", "dark": "light"}[scheme]):
        worst = page.evaluate(RATIOS)
        assert len(worst) > 100 and worst[0]["ratio"] >= CONTRAST, (side, worst[:3])
        ground = page.evaluate("getComputedStyle(document.body).backgroundColor")
        light = sum(int(part) for part in ground[4:-1].split(",")) > 380
        assert light == (side == "light") and page.get_attribute("#theme", "aria-pressed") == str(not light).lower()
        page.click("#theme")


def test_all_that_can_be_operated_has_a_name(visit):
    page = visit()
    session = page.context.new_cdp_session(page)
    nodes = session.send("Accessibility.getFullAXTree")["nodes"]
    named = {"button", "slider", "searchbox", "combobox", "tab", "link", "checkbox", "image", "region", "tabpanel"}
    found = [(n["role"]["value"], n.get("name", {}).get("value", "")) for n in nodes if not n.get("ignored")]
    assert {role for role, _ in found} >= named - {"image"}
    assert [role for role, name in found if role in named and not name.strip()] == []
    assert any(name.startswith("ball clamped") and "its reference, right" in name for _, name in found)


def test_a_narrow_window_scrolls_down_alone(visit):
    page = visit(viewport={"width": 400, "height": 800})
    assert page.evaluate("document.documentElement.scrollWidth") == 400
    assert page.locator("#canvas").bounding_box()["width"] > 300


def test_without_webgl_a_sentence_stands_in_and_the_rest_works(visit):
    page = visit("HTMLCanvasElement.prototype.getContext = () => null;")
    page.wait_for_selector("#plots svg")
    assert page.locator("#replay").is_hidden() and "no WebGL2" in page.inner_text("#no-replay")
    assert page.locator("#plots figure").count() == 3 and page.locator("#findings li").count() >= 3


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
    names = page.locator("#chosen option").all_inner_texts()
    page.locator("#chosen").select_option(label=next(name for name in names if name.startswith("ball squeeze · tetra")))
    page.wait_for_selector("#canvas[data-shown]")
    to_time(page, "End")
    pressed = picture(page)
    discs = page.evaluate("veilsAt(state.shown, state.t).map((veil) => [...veil.x])")
    heights = sorted({round(float(z), 4) for disc in discs for z in disc[2::3]})
    assert heights == pytest.approx([-0.035, 0.035], abs=0.001)  # two planes, 15 mm each into a ball of 50 mm
    page.evaluate("() => { state.shown.obstacles = []; draw(); }")
    assert (np.abs(picture(page) - pressed).max(axis=2) > 10).sum() > 1000
    for span in ([0, 0, 0], [0.3, -0.4, 1.2]):
        x = np.array(page.evaluate("(span) => capsule(0.5, span).x", span)).reshape(-1, 3)
        share = np.clip(x @ np.array(span) / max(np.dot(span, span), 1e-300), 0, 1)
        assert np.allclose(np.linalg.norm(x - share[:, None] * span, axis=1), 0.5)
