"""The bench of a population: it finds sound organs sound, and faults faulty."""

from dataclasses import replace

import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.bench import meshes as bench
from studies.bench.meshes import check_topology, faults, specimen, summary
from studies.geometry import organ


@pytest.fixture(scope="module")
def rows(mesh_cache):
    """A random solid and a random hollow organ."""
    return [specimen(name, 3, 300) for name in ("spleen", "bladder")]


def test_random_organs_are_sound(rows):
    assert not faults(rows)
    assert [row["hollow"] for row in rows] == [False, True]
    for row in rows:
        assert row["message"] == "" and 0 < row["cached_seconds"] < row["seconds"]
        assert 0 < row["ratio_min"] <= row["ratio_p1"] <= row["ratio_p50"] <= 1
        assert 0 < row["dihedral_min"] <= row["dihedral_p1"] <= row["dihedral_p50"] <= 70.6  # a regular tetrahedron's
    # Facets lie inside a convex surface: a straight solid is the smaller one, by the promised few per cent.
    assert 0.95 < rows[0]["straight_over_curved"] < 1.0
    assert [(line["meshed"], line["worst seed"]) for line in summary(rows)] == [("1/1", 3), ("1/1", 3)]


@pytest.mark.parametrize(
    ("which", "change", "sound"),
    [
        (0, {"ratio_min": 0.09}, False),
        (1, {"ratio_min": 0.09}, True),  # a wall may be flatter
        (1, {"ratio_min": 0.04}, False),
        (0, {"dihedral_min": 7.9}, False),
        (1, {"dihedral_min": 7.9}, True),
        (0, {"jacobian_min": 0.0}, False),
        (1, {"message": "it hangs"}, False),
    ],
)
def test_faults_are_found(rows, which, change, sound):
    spoiled = rows[which] | change
    assert faults([spoiled, rows[1 - which]]) == ([] if sound else [spoiled])


def test_a_failure_is_a_row_with_its_sentence(monkeypatch):
    def refuse(*_, **__):
        raise StudyError("spleen: no luck; try again")

    monkeypatch.setattr(bench, "organ", refuse)
    row = specimen("spleen", 0, 300)
    assert row["message"] == "spleen: no luck; try again" and faults([row]) == [row]
    assert summary([row]) == [{"organ": "spleen", "meshed": "0/1"}]


def test_topology_that_is_not_as_promised_is_refused(mesh_cache):
    mesh = organ("bladder", 300)
    check_topology(mesh)
    with pytest.raises(StudyError, match="the fill ends elsewhere than at the surface"):
        check_topology(replace(mesh, tetrahedra=mesh.tetrahedra[mesh.tetrahedra[:, 0] != mesh.tetrahedra[0, 0]]))
    inside_out = np.concatenate([mesh.outer_triangles, mesh.lumen_triangles])
    with pytest.raises(StudyError, match="lumen: the surface is inverted"):
        check_topology(replace(mesh, triangles=inside_out))
    with pytest.raises(StudyError, match="negative volume"):
        check_topology(replace(mesh, tetrahedra=mesh.tetrahedra[:, [1, 0, 2, 3]]))
