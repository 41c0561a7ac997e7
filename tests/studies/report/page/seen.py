"""What a reader of report.html sees."""

import io
import time

import numpy as np
from PIL import Image


def pixels(png: bytes) -> np.ndarray:
    """A picture as numbers, (h, w, 3)."""
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)


def column(page, number: int) -> list[str]:
    """Cells of a column of the table of cases, counted from 1, in the rows that are shown."""
    return page.locator(f"#cases tbody tr:visible > :nth-child({number})").all_inner_texts()


def until(page, expression: str, argument=None, seconds: float = 10.0) -> None:
    """Waits until JavaScript is true of the page; playwright's own way needs eval, which the page forbids."""
    end = time.monotonic() + seconds
    while not page.evaluate(expression, argument):
        assert time.monotonic() < end, expression
        page.wait_for_timeout(20)
