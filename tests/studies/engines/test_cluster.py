"""A sweep on a cluster leaves what one on this machine leaves, whatever dies on the way."""

from tests.studies.engines.conftest import assert_equal_bits, physics, swept
from tests.studies.tiny import content, tiny_study


def test_a_cluster_leaves_what_the_pool_leaves(scheduler, finished_sweep, tmp_path):
    study = tiny_study()
    count, progress = swept(tmp_path, study, scheduler)
    assert count == len(study.cases) + 2, "two are timed, one diverges"
    assert progress.begun == [("physics", 3), ("timing", 1)], "both workers are of one kind of machine"
    assert_equal_bits(physics(tmp_path, study), physics(finished_sweep, study))
    assert {path.name for path in (tmp_path / "tiny").iterdir()} == {
        path.name for path in (finished_sweep / "tiny").iterdir()
    }
    assert not list((tmp_path / "cache").glob("shared-*")), "its file of the check is gone"
    before = content(tmp_path / "tiny")
    again, progress = swept(tmp_path, study, "tcp://127.0.0.1:9")
    assert (again, progress.begun) == (0, []), "nothing to do needs no cluster"
    assert content(tmp_path / "tiny") == before
