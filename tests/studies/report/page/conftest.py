"""report.html of made-up results in a real browser without network."""

import shutil

import pytest

from tests.studies.report.page.made_up_page import made_up_page

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
