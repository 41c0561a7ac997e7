"""Charts of matplotlib as SVG inside a page: small, with unique ids, and with a title for screen readers."""

import base64
import html
import io
import re
from xml.etree import ElementTree

from PIL import Image

from studies.base.errors import StudyError

NUMBER = re.compile(r"(\d+\.\d{2})\d+")
PLACES = re.compile(r'(?<=[\s"])(d|points|x|y|x1|x2|y1|y2|width|height)="([^"]*)"')
"""Attributes with coordinates, which a hundredth of a point suffices for."""
PICTURE, COLOURS = re.compile(r"data:image/png;base64,\s*([A-Za-z0-9+/=\s]+)"), 128
NAMES = re.compile(r'(\bid="|url\(#|href="#)([\w.-]+)')
UNUSED_NAME = re.compile(r' id="(?!m[0-9a-f]{6}|p[0-9a-f]{6}|h[0-9a-f]{6}|image|DejaVu)[^"]*"')
"""Of groups: nothing refers to them."""


DRAWN = "svg, g, defs, path, rect, circle, ellipse, line, polyline, polygon, use, text, tspan, image, clipPath, pattern"
TAGS = frozenset(DRAWN.split(", "))
DESCRIBED = (
    "viewBox, version, preserveAspectRatio, id, d, points, x, y, x1, x2, y1, y2, cx, cy, r, rx, ry, dx, dy, width, "
    "height, transform, style, clip-path, clip-rule, fill, fill-rule, fill-opacity, stroke, stroke-width, "
    "stroke-opacity, stroke-linecap, stroke-linejoin, stroke-dasharray, stroke-dashoffset, opacity, text-anchor, "
    "font-size, font-family, font-weight, font-style, href, patternUnits, patternTransform, clipPathUnits"
)
ATTRIBUTES = frozenset(DESCRIBED.split(", "))
"""Attributes in charts of matplotlib. Everything else is removed from any file: scripts, event handlers, foreign
elements, links."""
OWN = re.compile(r"#[\w.-]+|data:image/png;base64,[A-Za-z0-9+/=\s]+")
"""What an element may refer to: another one of its file, or a picture that it brings along."""
ELSEWHERE = re.compile(r"url\(\s*(?!#)|[@\\]|position", re.IGNORECASE)
"""Parts of a style or an attribute that refer to something outside the chart."""


def inline(text: str, name: str, title: str) -> str:
    """An SVG file as an element of a page. name: unique on the page, for what the file refers to in itself.

    Raises StudyError for text that is no SVG."""
    body = cleaned(text)
    body = PICTURE.sub(_small_picture, body)
    body = UNUSED_NAME.sub("", body)
    numbers: dict[str, int] = {}  # matplotlib's names hash places, which may differ by their last bit
    body = NAMES.sub(lambda match: f"{match[1]}{name}-{numbers.setdefault(match[2], len(numbers))}", body)
    body = PLACES.sub(_rounded, body)
    head, rest = body.split(">", 1)
    head = re.sub(r'\s(width|height|id)="[^"]*"', "", head)
    return (
        f'{head} role="img" aria-labelledby="{name}-title"><title id="{name}-title">{html.escape(title)}</title>{rest}'
    )


def cleaned(text: str) -> str:
    """Only TAGS and ATTRIBUTES of an SVG file, without names of XML, which HTML does not need.

    Raises StudyError for text that is no SVG."""
    try:
        root = ElementTree.fromstring(text[text.index("<svg") : text.rindex("</svg>") + len("</svg>")])
    except (ValueError, ElementTree.ParseError) as error:
        raise StudyError(
            f"a stored chart is not an SVG file ({error}); delete the folder cache of the results"
        ) from error
    _clean(root)
    root.attrib.pop("style", None)  # it could lay the chart over the page
    return ElementTree.tostring(root, encoding="unicode", short_empty_elements=False)


def _clean(element: ElementTree.Element) -> None:
    element.tag = _local(element.tag)
    attributes = {_local(name): value for name, value in element.attrib.items()}
    element.attrib.clear()
    element.attrib.update({name: value for name, value in attributes.items() if _allowed(name, value)})
    if element.tag not in ("text", "tspan"):
        element.text = None
    element.tail = element.tail if (element.tail or "").strip() else None
    for child in list(element):
        if not isinstance(child.tag, str) or _local(child.tag) not in TAGS:
            element.remove(child)
        else:
            _clean(child)


def _allowed(name: str, value: str) -> bool:
    if name == "href":
        return OWN.fullmatch(value) is not None
    return name in ATTRIBUTES and not ELSEWHERE.search(value)


def _local(name: str) -> str:
    """A name without its namespace."""
    return name.rpartition("}")[2]


def _small_picture(match: re.Match[str]) -> str:
    """A PNG with COLOURS colours in place of one with all."""
    image = Image.open(io.BytesIO(base64.b64decode(match[1]))).convert("RGBA")
    small = io.BytesIO()
    image.quantize(COLOURS, Image.Quantize.FASTOCTREE).save(small, "png", optimize=True)
    return f"data:image/png;base64,{base64.b64encode(small.getvalue()).decode('ascii')}"


def _rounded(match: re.Match[str]) -> str:
    short = NUMBER.sub(r"\1", match[2])
    return f'{match[1]}="{short}"'
