"""Charts of matplotlib as SVG inside a page: small, with names of their own, and with a title for screen readers."""

import base64
import html
import io
import re

from PIL import Image

NUMBER = re.compile(r"(\d+\.\d{2})\d+")
PLACES = re.compile(r'(?<=[\s"])(d|points|x|y|x1|x2|y1|y2|width|height)="([^"]*)"')
"""Attributes with coordinates, which a hundredth of a point suffices for."""
PICTURE, COLOURS = re.compile(r"data:image/png;base64,\s*([A-Za-z0-9+/=\s]+)"), 128
NAMES = re.compile(r'(\bid="|url\(#|href="#)')
UNUSED_NAME = re.compile(r' id="(?!m[0-9a-f]{6}|p[0-9a-f]{6}|h[0-9a-f]{6}|image|DejaVu)[^"]*"')
"""Of groups: nothing refers to them."""


def inline(text: str, name: str, title: str) -> str:
    """An SVG file as an element of a page. name: unique on the page, for what the file refers to in itself."""
    body = text[text.index("<svg") : text.rindex("</svg>") + len("</svg>")]
    body = re.sub(r"<metadata>.*?</metadata>", "", body, flags=re.DOTALL)
    body = re.sub(r"<!--.*?-->", "", body, flags=re.DOTALL)
    body = PICTURE.sub(_small_picture, body)
    body = UNUSED_NAME.sub("", body)
    body = NAMES.sub(rf"\g<1>{name}-", body)
    body = PLACES.sub(_rounded, body)
    head, rest = body.split(">", 1)
    head = re.sub(r'\s(width|height|id)="[^"]*"', "", head)
    rest = re.sub(r">\s+<", "><", rest)
    return (
        f'{head} role="img" aria-labelledby="{name}-title"><title id="{name}-title">{html.escape(title)}</title>{rest}'
    )


def _small_picture(found: re.Match[str]) -> str:
    """A PNG with COLOURS colours in place of one with all."""
    image = Image.open(io.BytesIO(base64.b64decode(found[1]))).convert("RGBA")
    small = io.BytesIO()
    image.quantize(COLOURS, Image.Quantize.FASTOCTREE).save(small, "png", optimize=True)
    return f"data:image/png;base64,{base64.b64encode(small.getvalue()).decode('ascii')}"


def _rounded(found: re.Match[str]) -> str:
    short = NUMBER.sub(r"\1", found[2])
    return f'{found[1]}="{short}"'
