"""A file is read whole, whatever its program puts beside or behind the cells, or it is refused."""

import struct

import meshio
import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.geometry import read_mesh
from studies.geometry.doctor.examine import examine
from studies.geometry.files import opening
from studies.geometry.files.opening import opened
from studies.geometry.files.units import Source
from studies.geometry.mesh.organ_mesh import signed_volume, tetrahedron_volumes
from tests.studies.geometry.boxes import box, split
from tests.studies.geometry.files import writers

SIDES = (60.0, 50.0, 40.0)
VOLUME = 60.0 * 50 * 40
POINTS, FACES = split(*box(high=SIDES), times=1)
CORNERS = np.array([[x, y, z] for x in (0, 60) for y in (0, 50) for z in (0, 40)], float)
HEXAHEDRON = np.array([[0, 4, 6, 2, 1, 5, 7, 3]])
WEDGES = np.array([[0, 4, 6, 1, 5, 7], [0, 6, 2, 1, 7, 3]])
TETRAHEDRA = np.array([[0, 4, 6, 7], [0, 6, 2, 7], [0, 2, 3, 7], [0, 3, 1, 7], [0, 1, 5, 7], [0, 5, 4, 7]])
TEXT = "".join("{:g} {:g} {:g}\n".format(*point) for point in POINTS)


def second_order():
    """Points and tetrahedra of ten nodes."""
    pairs = np.sort(np.vstack([TETRAHEDRA[:, pair] for pair in ([0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3])]), 1)
    edges, at = np.unique(pairs, axis=0, return_inverse=True)
    rows = np.hstack([TETRAHEDRA, at.reshape(6, -1).T + len(CORNERS)])
    return np.vstack([CORNERS, CORNERS[edges].mean(axis=1)]), rows


def volume_in(path, **options):
    content = opened(Source(path, "mm", **options))
    if len(content.tetrahedra):
        return float(np.abs(tetrahedron_volumes(content.points, content.tetrahedra)).sum())
    return signed_volume(content.points, content.triangles)


def written(path, content):
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def vtu(*pieces):
    """Pieces (points, cells, kind in VTK, ghosts) as parallel programs write them."""

    def array(name, values, kind="Int64"):
        words = " ".join(map(str, np.ravel(values).tolist()))
        return f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="3" format="ascii">{words}</DataArray>'

    text = ""
    for points, cells, kind, ghosts in pieces:
        ends, kinds = cells.shape[1] * np.arange(1, len(cells) + 1), np.full(len(cells), kind)
        text += f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(cells)}">'
        text += f"<CellData>{array('vtkGhostType', ghosts, 'UInt8')}</CellData>"
        text += f"<Points>{array('Points', points, 'Float64')}</Points><Cells>{array('connectivity', cells)}"
        text += array("offsets", ends) + array("types", kinds, "UInt8") + "</Cells></Piece>"
    return f'<VTKFile type="UnstructuredGrid" version="2.2"><UnstructuredGrid>{text}</UnstructuredGrid></VTKFile>'


def ply(faces, extra, edges=""):
    head = (
        f"ply\nformat ascii 1.0\nelement vertex {len(POINTS)}\nproperty float x\nproperty float y\nproperty float z\n"
    )
    head += f"element face {len(FACES)}\nproperty list uchar int vertex_indices\n{extra}end_header\n"
    return head + TEXT + "".join(faces.format(*face) for face in FACES) + edges


def stl(more):
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *POINTS[face].ravel(), 0) for face in FACES)
    return b"x".ljust(80, b"\0") + struct.pack("<I", len(FACES)) + body + more


def abaqus(*parts, end=""):
    """Parts (points, tetrahedra), each with nodes counted from 1."""
    text = "*Heading\n"
    for number, (points, cells) in enumerate(parts):
        nodes = [f"{k + 1}, {x:g}, {y:g}, {z:g}\n" for k, (x, y, z) in enumerate(points)]
        rows = [f"{k + 1}, {', '.join(map(str, row + 1))}\n" for k, row in enumerate(cells)]
        half = len(nodes) // 2  # in two blocks, with a comment between the lines of one
        text += f"*Part, name=p{number}\n*Node\n{''.join(nodes[:half])}*NODE, nset=b\n** rest\n{''.join(nodes[half:])}"
        text += f"*Element, type=c3d4\n{''.join(rows)}*End Part\n"
    return text + end


HALF = TETRAHEDRA[:3], TETRAHEDRA[3:]
GMSH = (
    f"$NOD\n{len(CORNERS)}\n"
    + "".join(f"{k + 1} {x:g} {y:g} {z:g}\n" for k, (x, y, z) in enumerate(CORNERS))
    + f"$ENDNOD\n$ELM\n{len(TETRAHEDRA)}\n"
    + "".join(f"{k + 1} 4 1 1 4 {' '.join(map(str, row + 1))}\n" for k, row in enumerate(TETRAHEDRA))
    + "$ENDELM\n"
)
SOLID = [
    "facet normal 0 0 0\nouter loop\n"
    + "".join("vertex {:g} {:g} {:g}\n".format(*point) for point in POINTS[face])
    + "endloop\nendfacet\n"
    for face in FACES
]
FILES = {
    "pieces.vtu": vtu(
        (CORNERS, HALF[0], 10, [0, 0, 0]), (CORNERS, np.vstack([HALF[1], HALF[0]]), 10, [0, 0, 0, 1, 1, 1])
    ),
    "mixed.vtu": vtu((CORNERS, HEXAHEDRON, 12, [0]), (CORNERS[:0], TETRAHEDRA[:0], 10, [])),
    "wedges.vtu": vtu((CORNERS, WEDGES, 13, [0, 0])),
    "ten.vtu": vtu((*second_order(), 24, [0] * 6)),
    "edges.ply": ply("3 {} {} {}\n", "element edge 1\nproperty int vertex1\nproperty int vertex2\n", "0 1\n"),
    "textured.ply": ply("3 {} {} {} 6 0 0 1 0 0 1\n", "property list uchar float texcoord\n"),
    "trailing.stl": stl(b"end of export"),
    "capitals.STL": (
        "solid a\n" + "".join(SOLID[:9]) + "endsolid a\nsolid b\n" + "".join(SOLID[9:]) + "endsolid b\n"
    ).upper(),
    "mark.obj": b"\xef\xbb\xbf" + writers.obj([("one", POINTS, FACES)]),
    "old.msh": GMSH,
    "parts.inp": abaqus((CORNERS, HALF[0]), (CORNERS, HALF[1])),
}


@pytest.mark.filterwarnings("ignore:.*by their corners")
@pytest.mark.parametrize("name", FILES)
def test_what_other_programs_write_is_read_whole(tmp_path, name):
    assert volume_in(written(tmp_path / name, FILES[name])) == pytest.approx(VOLUME, rel=1e-6)


def test_a_surface_beside_tetrahedra_is_named(tmp_path):
    cells = [("tetra", TETRAHEDRA), ("triangle", np.array([[0, 4, 6], [8, 9, 10]]))]
    meshio.write_points_cells(tmp_path / "two.vtu", np.vstack([CORNERS, CORNERS[:3] + 90]), cells)
    with pytest.warns(UserWarning, match="1 triangles that bound no tetrahedron are left out"):
        opened(Source(tmp_path / "two.vtu"))


def test_curved_cells_are_announced(tmp_path):
    with pytest.warns(UserWarning, match=r"ten\.vtu: its curved sides are read as flat, by their corners"):
        opened(Source(written(tmp_path / "ten.vtu", FILES["ten.vtu"])))


KINDS = {
    "vtk": "vtk",
    "msh": "gmsh",
    "MSH": "ansys",
    "mesh": "medit",
    "inp": "abaqus",
    "bdf": "nastran",
    "fem": "nastran",
    "su2": "su2",
    "vol": "netgen",
    "ply": "ply",
    "off": "off",
    "obj": "obj",
    "stl": "stl",
}


@pytest.mark.parametrize("suffix", KINDS)
def test_fewer_cells_than_the_file_states_are_refused(tmp_path, monkeypatch, suffix):
    path, solid = tmp_path / f"body.{suffix}", suffix not in ("ply", "off", "obj", "stl")
    cells = [("tetra", TETRAHEDRA)] if solid else [("triangle", FACES)]
    meshio.write_points_cells(path, CORNERS if solid else POINTS, cells, file_format=KINDS[suffix])
    assert volume_in(path) == pytest.approx(VOLUME, rel=1e-6)

    def all_but_one(copy):
        return meshio.Mesh(CORNERS, [(kind, rows[:-1]) for kind, rows in cells])

    if suffix in ("inp", "MSH"):
        return  # their readers count
    monkeypatch.setitem(opening.READERS, f".{suffix}", (all_but_one,))
    with pytest.raises(StudyError, match=rf"states {len(cells[0][1])} cells, and {len(cells[0][1]) - 1} can be read"):
        volume_in(path)


TWICE = (CORNERS, HALF[0]), (CORNERS, HALF[1])
REFUSED = {
    "its header states 48 triangles, and 50 seem to follow": ("more.stl", stl(bytes(100))),
    "a mesh of ANSYS Fluent": ("fluent.msh", '(0 "a mesh")\n(2 3)\n(10 (0 1 4 0 3))\n(12 (0 1 1 0))\n'),
    "its assembly moves": ("a.inp", abaqus(*TWICE, end="*Instance, name=a, part=p0\n1., 0., 0.\n*End Instance\n")),
    "leaves out parts": ("a.inp", abaqus(*TWICE, end="*Instance, name=a, part=p0\n*End Instance\n")),
    "it includes other files": ("a.inp", abaqus(*TWICE, end="*INCLUDE, INPUT=/etc/passwd\n")),
    "two of its nodes have the same number": ("a.inp", abaqus(*TWICE).replace("*End Part\n*Part, name=p1\n", "")),
    "VTK's kind 42 are not known": ("a.vtu", vtu((CORNERS, HEXAHEDRON, 42, [0]))),
    "the points of a piece are not as many": ("a.vtu", FILES["pieces.vtu"].replace('Points="8"', 'Points="9"')),
    "the cells of a piece are not as many": ("a.vtu", FILES["pieces.vtu"].replace('Cells="6"', 'Cells="7"')),
    "packed by vtkLZ4DataCompressor": (
        "a.vtu",
        FILES["ten.vtu"].replace("version", 'compressor="vtkLZ4DataCompressor" version'),
    ),
    "no reader knows its ending": ("a.xyz", "1 2 3\n"),
}


@pytest.mark.parametrize("reason", REFUSED)
def test_the_reason_of_a_refusal_is_true(tmp_path, reason):
    name, content = REFUSED[reason]
    with pytest.raises(StudyError, match=reason) as caught:
        opened(Source(written(tmp_path / name, content)))
    assert "cut short" not in str(caught.value)


def test_gmsh_is_given_no_program(tmp_path):
    trap = tmp_path / "trap"
    for suffix in ("msh", "mesh", "bdf", "nas"):
        path = written(tmp_path / f"a.{suffix}", f'System "touch {trap}";\n')
        with pytest.raises(StudyError):
            opened(Source(path))
    assert not trap.exists()


def test_parts_of_tetrahedra_are_chosen(tmp_path):
    path = tmp_path / "two.vtu"
    two = np.vstack([0.5 * CORNERS + 90, CORNERS]), [("tetra", np.vstack([TETRAHEDRA, TETRAHEDRA + 8]))]
    meshio.write_points_cells(path, *two)
    assert volume_in(path, part="1") == pytest.approx(VOLUME) and volume_in(path, part="2") == pytest.approx(VOLUME / 8)
    rows = examine(Source(path, "mm")).measures["part_list"]
    assert [row["cells"] for row in rows] == [6, 6] and rows[0]["size"] == pytest.approx([0.06, 0.05, 0.04])
    assert read_mesh(Source(path, "mm", part="2")).volume == pytest.approx(1e-9 * VOLUME / 8)


@pytest.mark.parametrize("cells", [HEXAHEDRON, HEXAHEDRON[:, [4, 5, 6, 7, 0, 1, 2, 3]]])
def test_the_boundary_of_hexahedra_looks_outward(tmp_path, cells):
    points = np.vstack([CORNERS, CORNERS[[4, 5, 6, 7]] + [60, 0, 0]])
    path = tmp_path / "two.vtk"
    both = np.vstack([cells, [[4, 8, 10, 6, 5, 9, 11, 7]]])
    meshio.write_points_cells(path, points, [("hexahedron", both)])
    mesh = read_mesh(path, unit="mm")
    assert mesh.volume == pytest.approx(2e-9 * VOLUME) and len(mesh.triangles) == 20
