"""Tabs, tables and texts of report.html in a real browser: they work, and all of them can be read."""

from pathlib import Path

import pytest

from tests.studies.report.page.seen import column, pixels

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
    page.locator(f"#cases thead th:nth-child({status}) button").click()  # failed runs come first
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
    kinds = [cell.split("\n")[1].strip() for cell in column(page, 1)[1:7]]
    assert kinds == [
        "surface, 550 nodes free",
        *["surface, 550 nodes implicit_volume"],
        *kinds[2:],
    ] and kinds == sorted(kinds)


def test_the_table_filters_by_all_words_and_opens_a_case(visit):
    page = visit()
    page.get_by_label("Filter").fill("clamped FREE")
    assert page.inner_text("#count") == "2 of 9 cases"
    assert all("ball clamped" in name and "free" in name for name in column(page, 1))
    page.locator("#cases tbody tr:visible a").first.click()
    page.wait_for_selector("#chosen:focus")
    assert "free" in page.locator("#chosen option:checked").inner_text()
    assert page.locator("#plots figure").count() == 3


def test_a_filter_that_finds_nothing_says_so(visit):
    page = visit()
    assert page.locator("#no-rows").is_hidden()
    page.get_by_label("Filter").fill("nothing like it")
    assert page.locator("#cases tbody tr:visible").count() == 0 and page.inner_text("#count") == "0 of 9 cases"
    assert page.inner_text("#no-rows").startswith("No case holds all of these words: nothing, like, it.")
    page.get_by_label("Filter").fill("")
    assert page.locator("#no-rows").is_hidden()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_can_be_read_and_the_switch_changes_sides(visit, scheme):
    page = visit(color_scheme=scheme)
    for side in (scheme, {"light": "dark", "dark": "light"}[scheme]):
        worst = page.evaluate(RATIOS)
        assert len(worst) > 100 and worst[0]["ratio"] >= CONTRAST, (side, worst[:3])
        ground = page.evaluate("getComputedStyle(document.body).backgroundColor")
        light = sum(int(part) for part in ground[4:-1].split(",")) > 380
        assert light == (side == "light") and page.inner_text("#theme") == ("Dark page" if light else "Light page")
        chart = pixels(page.locator(".chart:visible").first.screenshot())
        assert (chart.mean() > 200) == light and (chart.mean() < 60) == (not light)
        page.click("#theme")


def test_all_that_can_be_operated_has_a_name(visit):
    page = visit()
    session = page.context.new_cdp_session(page)
    nodes = session.send("Accessibility.getFullAXTree")["nodes"]
    named = {"button", "slider", "searchbox", "combobox", "tab", "link", "checkbox", "image", "region", "tabpanel"}
    elements = [(n["role"]["value"], n.get("name", {}).get("value", "")) for n in nodes if not n.get("ignored")]
    assert {role for role, _ in elements} >= named - {"image"}
    assert [role for role, name in elements if role in named and not name.strip()] == []
    assert any(name.startswith("ball clamped") and "its reference, right" in name for _, name in elements)


@pytest.mark.parametrize(("width", "shown"), [(1400, 7), (390, 2)])
def test_names_and_the_first_numbers_are_seen_without_scrolling(visit, width, shown):
    page = visit(viewport={"width": width, "height": 800})
    box = page.locator("#cases").locator("xpath=..").bounding_box()
    first = ("case", "force", "displacement", "shape / size", "volume of the shape", "worst", "computing")
    heads = page.locator("#cases thead th").all_inner_texts()[: len(first)]
    assert [word for word, head in zip(first, heads, strict=True) if word not in head] == []
    for k in range(shown):
        cell = page.locator(f"#cases tbody tr:first-child > :nth-child({k + 1})").bounding_box()
        assert box["x"] <= cell["x"] and cell["x"] + cell["width"] <= box["x"] + box["width"], k
    heights = [row.bounding_box()["height"] for row in page.locator("#cases tbody tr").all()]
    assert max(heights) - min(heights) < 1.0
    page.evaluate("document.querySelector('#cases').parentNode.scrollLeft = 300")
    name = page.locator("#cases tbody tr:first-child th").bounding_box()
    assert name["x"] == pytest.approx(box["x"], abs=2)


def test_without_webgl_a_sentence_stands_in_and_the_rest_works(visit):
    page = visit("HTMLCanvasElement.prototype.getContext = () => null;")
    page.wait_for_selector("#plots svg")
    assert page.locator("#replay").is_hidden() and "no WebGL2" in page.inner_text("#no-replay")
    assert page.locator("#plots figure").count() == 3 and page.locator(".best tbody").count() >= 1
