"""A small cluster on this machine, and what a sweep on it leaves."""

import logging
from contextlib import nullcontext
from dataclasses import replace

import pytest
from distributed import LocalCluster

from studies.runs.current import case_path
from studies.store.record import read_record
from studies.sweep.engines.cluster import Cluster
from studies.sweep.run_studies import run_studies
from tests.studies.tiny import Silent


@pytest.fixture(scope="module")
def scheduler():
    """Address of a scheduler with two workers of one thread each, in threads of this process: pieces have processes of
    their own."""
    options = {"n_workers": 2, "threads_per_worker": 1, "processes": False, "dashboard_address": ":0"}
    with LocalCluster(protocol="tcp://", silence_logs=logging.CRITICAL, **options) as cluster:
        yield cluster.scheduler_address


def engine_at(address, patience=20.0):
    """The engine of a cluster that is there."""
    return Cluster(lambda: nullcontext(address), patience)


def swept(root, study, address, patience=20.0, **settings):
    """Runs a study there: number of pieces, and the progress of them."""
    progress = Silent()
    with engine_at(address, patience) as engine:
        return run_studies(root, [study], engine, progress, **settings), progress


def physics(root, study):
    """What is stored of each case, but for the seconds that it took."""
    cases = {}
    for case in study.cases:
        record = read_record(case_path(root, study.name, case))
        attributes = {name: value for name, value in record.attributes.items() if name != "seconds"}
        fields = {name: field.values for name, field in record.fields.items()}
        cases[case.name] = repr(replace(record, attributes=attributes, fields={})), fields  # NaN is not equal to itself
    return cases


def assert_equal_bits(one, other):
    """Records with equal headers, and fields equal to the bit."""
    assert one.keys() == other.keys()
    for name in one:
        assert one[name][0] == other[name][0]
        assert one[name][1].keys() == other[name][1].keys()
        for field, values in one[name][1].items():
            assert values.tobytes() == other[name][1][field].tobytes(), (name, field)
