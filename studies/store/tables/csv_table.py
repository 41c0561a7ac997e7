"""Tables as people and spreadsheets read them."""

from pathlib import Path

import pandas as pd

from studies.base.atomic import write_whole


def write_table(path: Path, table: pd.DataFrame) -> Path:
    """A table as CSV with six significant digits; whole or not at all."""
    write_whole(path, table.to_csv(index=False, float_format="%.6g").encode())
    return path
