"""What stands around the replay of report.html in a real browser: tabs and tables obey, all of it can be read."""

from pathlib import Path

import pytest

from tests.studies.page.made_up_page import NASTY
from tests.studies.page.seen import column

CONTRAST = 4.5
RATIOS = (Path(__file__).parent / "contrast.js").read_text(encoding="utf-8")


def test_tabs_obey_arrows(visit):
    page = visit()
    page.focus("[role=tab]")
    for key, name in (("ArrowRight", "frame_rate"), ("ArrowRight", "volume_loss"), ("End", "frame_rate")):
        page.keyboard.press(key)
        assert page.evaluate("document.activeElement.id") == f"tab-{name}"
        assert page.get_attribute(f"#tab-{name}", "aria-selected") == "true"
        assert page.locator("[role=tabpanel]:visible").get_attribute("id") == f"panel-{name}"
        assert page.locator(f"#panel-{name} svg").first.bounding_box()["height"] > 100


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


def test_odd_names_are_shown_as_they_are(visit):
    page = visit()
    page.locator("#chosen").select_option(label=next(
        text for text in page.locator("#chosen option").all_inner_texts() if "onerror" in text
    ))  # fmt: skip
    assert NASTY in page.inner_text("#about") and page.locator("img").count() == 0


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
