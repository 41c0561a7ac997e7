"""Tables of what is stored: CSV as people and spreadsheets read it, Parquet with every digit and the types."""

import io
from pathlib import Path

import pandas as pd

from studies.base.atomic import write_whole
from studies.base.errors import StudyError
from studies.base.install import pip_install


def write_table(path: Path, table: pd.DataFrame) -> Path:
    """A table as CSV with six significant digits; whole or not at all."""
    write_whole(path, table.to_csv(index=False, float_format="%.6g").encode())
    return path


def write_parquet(path: Path, table: pd.DataFrame) -> Path:
    """A table as Parquet; whole or not at all. Raises StudyError where pyarrow, of the extra parquet, is missing."""
    image = io.BytesIO()
    try:
        table.to_parquet(image, engine="pyarrow", index=False)
    except ImportError as error:
        raise StudyError(
            f"{path} needs the package pyarrow, which is not installed: {pip_install('organbench[parquet]')}, or "
            "write --csv"
        ) from error
    write_whole(path, image.getvalue())
    return path
