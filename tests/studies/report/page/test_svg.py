"""A stored chart may only draw in the page: scripts, links and overlays are removed."""

import re
from xml.etree import ElementTree

import pytest

from studies.base.errors import StudyError
from studies.report.page.svg import inline

HEAD = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" viewBox="0 0 9 9"'
GOOD = '<path id="m0123456789" d="M0 0L1 1" style="fill: none; stroke: #112233; clip-path: url(#p1)"/>'


def shown(inside: str, head: str = "") -> str:
    return inline(f"<?xml version='1.0'?>{HEAD} {head}>{inside}{GOOD}</svg>", "c", "A chart")


@pytest.mark.parametrize(
    "evil",
    [
        "<script>alert(1)</script>",
        "<path d='M0 0' onclick='alert(1)' onload='alert(1)'/>",
        "<a xlink:href='javascript:alert(1)'><text>click</text></a>",
        "<foreignObject><div xmlns='http://www.w3.org/1999/xhtml'><img onerror='alert(1)'/></div></foreignObject>",
        "<image xlink:href='http://x/y.png'/>",
        "<image href='data:image/svg+xml;base64,PHN2Zz4='/>",
        "<use xlink:href='http://x/y.svg#a'/>",
        "<set attributeName='href' to='javascript:alert(1)'/>",
        "<style>* { background: url(http://x) } body { display: none }</style>",
        "<path d='M0 0' style='fill: url(http://x)'/>",
        "<path d='M0 0' style='fill: u\\72l(http://x)'/>",
        "<g style='position: fixed'/>",
        "<!-- <script>alert(1)</script> --><?evil alert?>",
        "<metadata><script>alert(1)</script></metadata>",
        "<g>alert</g>",
    ],
)
def test_what_acts_loads_or_covers_is_left_out_and_what_draws_stays(evil):
    text = shown(evil)
    assert not re.search(r"alert|http|script|foreign|position|<a |<set|<anim|<style|metadata|\\|url\((?!#)", text)
    assert 'd="M0 0L1 1" style="fill: none; stroke: #112233; clip-path: url(#c-1)"' in text


@pytest.mark.parametrize(
    "head", ["onload='alert(1)'", "style='position: fixed; top: 0'", "style='margin-top: -900px'", "class='x'"]
)
def test_the_chart_itself_cannot_act_or_leave_its_place(head):
    root = ElementTree.fromstring(shown("", head))
    assert set(root.attrib) == {"viewBox", "role", "aria-labelledby"}


def test_text_stays_text():
    text = shown("<text x='1.23456'>&lt;script&gt; <tspan>a</tspan> b</text>")
    assert '<text x="1.23">&lt;script&gt; <tspan>a</tspan> b</text>' in text


@pytest.mark.parametrize("text", ["", "no chart", "<svg", "<svg><g></svg>", "</svg><svg"])
def test_what_is_no_svg_is_refused(text):
    with pytest.raises(StudyError, match="is not an SVG file"):
        inline(text, "c", "A chart")


def test_entities_of_a_hostile_file_are_never_expanded():
    bomb = '<!DOCTYPE svg [<!ENTITY a "aaaaaaaaaa">]>' + f"{HEAD}><text>&a;</text></svg>"
    with pytest.raises(StudyError, match="undefined entity"):
        inline(bomb, "c", "A chart")
