"""The archive of the tiny study."""

import zipfile
from dataclasses import replace

import pytest

from studies.catalog import Chart
from studies.report.archive.packing import pack
from tests.studies.tiny import tiny_study

DAY = "2026-11-22"
STUDY = replace(
    tiny_study(columns=("volume_worst", "step_time", "real_time")),
    charts=(Chart("volume.png", "studies.plots.volume_history:draw"),),
)


@pytest.fixture(scope="session")
def packed(finished_sweep, tmp_path_factory):
    """The archive of the tiny study, with a chart; to be read, not changed."""
    target = tmp_path_factory.mktemp("archive") / "tiny.zip"
    pack(finished_sweep, [STUDY], target, DAY)
    return target


@pytest.fixture
def unpacked(packed, tmp_path):
    """A folder that it was unpacked to."""
    folder = tmp_path / "unpacked"
    with zipfile.ZipFile(packed) as archive:
        archive.extractall(folder)
    return folder
