"""Every case of report.html has an address, which opens it, follows what is chosen, and goes back; parts of the page
are loaded from the files next to it."""

import json
import shutil

import pytest

from studies.report.page import write as module
from studies.report.page.write import write_page
from tests.studies.report.page.made_up_page import made_up_parts
from tests.studies.report.page.seen import until


def ids(page) -> list[str]:
    return list(json.loads(page.locator("#data").text_content())["cases"])


def opened(page) -> str:
    """The id of the case that is shown."""
    return page.evaluate("state.given && state.shown ? state.id : ''")


def wait_for(page, number: str) -> None:
    until(page, "(id) => state.id === id && state.given?.title === DATA.cases[id].title", number)


def test_an_address_opens_its_case(visit):
    number = ids(visit())[1]
    page = visit(where=f"#case={number}")
    wait_for(page, number)
    assert page.input_value("#chosen") == number and page.locator("#unknown").is_hidden()
    assert page.locator("#cases tr.chosen a").get_attribute("href") == f"#case={number}"
    until(page, "Math.abs(byId('case').getBoundingClientRect().top) < 2")


def test_the_address_follows_and_the_back_button_goes_back(visit):
    page = visit()
    first, second, third = ids(page)[:3]
    assert page.evaluate("location.hash") == "" and opened(page) == first
    page.locator("#chosen").select_option(value=second)
    wait_for(page, second)
    assert page.evaluate("location.hash") == f"#case={second}"
    page.locator(f'#cases a[href="#case={third}"]').click()
    wait_for(page, third)
    page.locator('nav a[href="#charts"]').click()
    for number in (third, second, first):
        page.go_back()
        wait_for(page, number)
    page.go_forward()
    wait_for(page, second)


def test_an_unknown_address_has_a_message_and_the_first_case_is_shown(visit):
    page = visit(where="#case=<b>%")
    page.wait_for_selector("#canvas[data-shown]")
    assert "This page holds no case <b>%;" in page.inner_text("#unknown").replace("%3Cb%3E", "<b>")
    assert opened(page) == ids(page)[0]


@pytest.fixture(scope="module")
def thin(tmp_path_factory):
    """A page that has room for no case, and its folder."""
    root = tmp_path_factory.mktemp("thin")
    studies = made_up_parts(root)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "LIMIT", 1)
        path, _ = write_page(root, studies)
    assert path is not None
    return path


def visit_file(browser, path):
    page = browser.new_context(offline=True).new_page()
    page.goto(path.as_uri())
    return page


def test_cases_beside_the_page_are_loaded_without_a_server(browser, thin):
    page = visit_file(browser, thin)
    page.wait_for_selector("#canvas[data-shown]")
    assert page.evaluate("Object.keys(DATA.pieces).length") == 2  # a case and its reference, and no more
    assert page.locator("#names span").count() == 2 and page.locator("#plots figure").count() == 3
    page.locator("#chosen").select_option(index=1)
    until(page, "Object.keys(DATA.pieces).length > 2 && state.shown")


def test_a_page_without_its_folder_says_what_is_missing(browser, thin, tmp_path):
    page = visit_file(browser, shutil.copy(thin, tmp_path / "report.html"))
    until(page, "byId('no-replay').textContent !== ''")
    assert "Copy the folder along with the page" in page.inner_text("#no-replay")
    assert page.locator("#replay").is_hidden() and page.locator("#cases tbody tr:visible").count() == 9
