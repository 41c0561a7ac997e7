"""A link to itself, a folder or a pipe in the place of a file: the other files are read."""

import os

import pytest

from studies.runs.current import case_path
from studies.store.paths import index_path
from tests.studies.tiny import tiny_case


@pytest.fixture
def place(results):
    path = case_path(results, "tiny", tiny_case())
    path.unlink()
    return path


def link_to_itself(path):
    path.symlink_to(path.name)


def two_links_in_a_circle(path):
    path.symlink_to("other.h5")
    path.with_name("other.h5").symlink_to(path.name)


def dangling(path):
    path.symlink_to("nowhere.h5")


@pytest.mark.parametrize("what", [link_to_itself, two_links_in_a_circle, dangling])
def test_a_link_that_leads_nowhere_is_a_missing_case_and_replaced(organbench, tiny_file, results, place, what):
    what(place)
    code, out, err = organbench("show", tiny_file, "--results", results)
    assert code == 0 and not err and "1 missing" in out
    assert "free" in organbench("table", tiny_file, "--results", results)[1]
    assert "there is no results file" in organbench("show", place)[2]
    code, out, err = organbench("run", tiny_file, "--results", results)
    assert code == 0 and place.is_file() and not place.is_symlink(), err


@pytest.mark.parametrize("make", [os.mkdir, os.mkfifo])
def test_what_is_no_file_costs_its_case_alone(organbench, tiny_file, results, place, make):
    make(place)
    code, out, err = organbench("show", tiny_file, "--results", results)
    assert code == 0 and "1 stale" in out and "2 ok" not in out
    code, out, err = organbench("table", tiny_file, "--results", results)
    assert code == 0 and "free" in out
    assert f"{place} is not a file: delete it, and run its study again" in err


def test_a_folder_is_not_run_and_named_and_the_rest_runs(organbench, tiny_file, results, place):
    place.mkdir()
    (place / "mine.txt").write_text("kept")
    other = case_path(results, "tiny", tiny_case(dt_fraction=3.0, beyond_limit=True))
    other.unlink()
    code, _, err = organbench("run", tiny_file, "--results", results)
    assert code == 1 and f"{place} is a folder where a file belongs: delete it" in err and "Traceback" not in err
    assert other.is_file() and (place / "mine.txt").read_text() == "kept"


def test_a_folder_is_never_to_be_deleted_because_it_was_named(refused, results):
    assert "delete" not in refused("show", results) + refused("show", results / "tiny")


def test_a_folder_in_the_place_of_the_index_is_one_sentence(organbench, tiny_file, results):
    index = index_path(results, "tiny")
    index.mkdir()
    code, _, err = organbench("run", tiny_file, "--results", results)
    assert code == 0 and f"{index} is a folder, but the study's index belongs there: delete it" in err
    index.rmdir()
    assert organbench("run", tiny_file, "--results", results)[0] == 0 and index.is_file()
