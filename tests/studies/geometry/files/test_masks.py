"""Label masks: the surface of one label, as large as its voxels, in the place that the header gives it."""

import builtins
import os
import warnings
from dataclasses import replace

import nibabel
import nrrd
import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.geometry import check_surface, read_mesh, scan
from studies.geometry.files.opening import opened
from studies.geometry.files.units import Source
from studies.geometry.mesh.organ_mesh import signed_volume

SPACING = (1.0, 1.5, 2.0)
AXES = (28.0, 24.0, 20.0)
"""Half axes of an ellipsoid [mm]."""
MIDDLE = (40.0, -12.0, 7.0)


def ellipsoid(shift=0.0):
    """Labels: 1 in the ellipsoid, 2 in a block beside it; the affine places its middle at MIDDLE [mm]."""
    shape = (70, 45, 30)
    grid = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1) * SPACING
    away = (grid - 0.5 * np.array(shape) * SPACING - (shift, 0, 0)) / AXES
    labels = ((away**2).sum(axis=-1) < 1).astype(np.uint8)
    labels[2:5, 2:5, 2:5] = 2
    affine = np.diag([*SPACING, 1.0])
    affine[:3, 3] = np.array(MIDDLE) - 0.5 * np.array(shape) * SPACING
    return labels, affine


def nifti(path, labels, affine, unit="mm"):
    image = nibabel.Nifti1Image(labels, affine)
    image.header.set_xyzt_units(xyz=unit)
    nibabel.save(image, path)
    return path


@pytest.fixture(scope="module")
def mask(tmp_path_factory):
    return nifti(tmp_path_factory.mktemp("mask") / "liver.nii.gz", *ellipsoid())


def test_a_label_becomes_a_surface_of_its_volume_in_its_place(mask):
    surface = scan(Source(mask, part="1"), fill=False)
    check_surface(surface.points, surface.triangles)
    labels, _ = ellipsoid()
    assert surface.volume == pytest.approx(1e-9 * np.prod(SPACING) * (labels == 1).sum(), rel=1e-3)
    np.testing.assert_allclose(1e3 * surface.points.mean(axis=0), MIDDLE, atol=0.5)
    np.testing.assert_allclose(1e3 * np.ptp(surface.points, axis=0), 2 * np.array(AXES), rtol=0.05)
    # Near the true ellipsoid everywhere, and not a staircase of voxels.
    away = np.linalg.norm((1e3 * surface.points - MIDDLE) / AXES, axis=1) - 1
    assert np.abs(away).max() * min(AXES) < 0.75 * max(SPACING)


def test_a_mirrored_image_still_looks_outward(tmp_path):
    labels, affine = ellipsoid()
    path = nifti(tmp_path / "turned.nii", labels, np.diag([-1.0, 1, 1, 1]) @ affine)
    surface = read_mesh(Source(path, part="1"))
    assert surface.volume > 0 and surface.points[:, 0].mean() == pytest.approx(-1e-3 * MIDDLE[0], abs=1e-3)


@pytest.mark.parametrize("across", [2, 3, 8])
def test_a_small_label_has_the_volume_of_its_voxels(tmp_path, across):
    grid = np.stack(np.meshgrid(*[np.arange(across + 4) - (across + 3) / 2] * 3, indexing="ij"), axis=-1)
    labels = ((grid**2).sum(axis=-1) < across**2 / 4).astype(np.uint8)
    content = opened(Source(nifti(tmp_path / "ball.nii", labels, np.diag([5.0, 5.0, 9.0, 1.0]))))
    assert signed_volume(content.points, content.triangles) == pytest.approx(225 * labels.sum(), rel=1e-3)


def slicer(path, labels, affine, signs=(1, 1, 1), **header):
    """An NRRD file of the same body as a NIfTI image with this affine; signs: of its space."""
    turned = np.diag([*signs, 1.0]) @ affine
    header = {"space directions": turned[:3, :3].T, "space origin": turned[:3, 3]} | header
    nrrd.write(str(path), labels, {key.replace("_", " "): value for key, value in header.items()})
    return path


SPACES = {
    "right-anterior-superior": (1, 1, 1),
    "left-posterior-superior": (-1, -1, 1),
    "left-anterior-superior": (-1, 1, 1),
    "LPS": (-1, -1, 1),
}


@pytest.mark.parametrize("space", SPACES)
def test_one_patient_lies_in_the_same_place_in_either_format(tmp_path, mask, space):
    path = slicer(tmp_path / "liver.nrrd", *ellipsoid(), SPACES[space], space=space)
    with pytest.warns(UserWarning, match="assuming millimetres"):
        content = opened(Source(path, part="1"))
    expected = opened(Source(mask, part="1"))
    assert content.unit == expected.unit == "mm"
    np.testing.assert_allclose(content.points, expected.points, atol=1e-4)
    assert signed_volume(content.points, content.triangles) > 0


def test_without_a_patient_space_the_sides_are_uncertain(tmp_path):
    path = slicer(tmp_path / "liver.nrrd", *ellipsoid(), space_units=["mm"] * 3)
    with pytest.warns(UserWarning, match=r"liver\.nrrd: its header names no patient space, so left and right may be"):
        assert opened(Source(path, part="1")).unit == "mm"


UNITS = {"microns": "um", "micrometer": "um", "millimeter": "mm", "Meters": "m", "inches": "in"}


def test_a_header_states_the_unit(tmp_path):
    for stated, unit in UNITS.items():
        path = slicer(tmp_path / "a.nrrd", *ellipsoid(), space="RAS", space_units=[stated] * 3)
        assert opened(Source(path, part="1")).unit == unit
    for stated, unit in {"micron": "um", "mm": "mm", "meter": "m"}.items():
        path = nifti(tmp_path / "a.nii", *ellipsoid(), unit=stated)
        assert opened(Source(path, part="1")).unit == unit


def test_segments_of_slicer_may_overlap(tmp_path):
    """3D Slicer writes overlapping segments as layers, an array (l, a, b, c)."""
    labels, affine = ellipsoid()
    layers = np.stack([labels == 1, np.roll(labels, 5, 0) == 1, labels == 2], axis=0).astype(np.uint8)
    names = {}
    for k, name in enumerate(["Liver", "tumour", "stone"]):
        names |= {f"Segment{k}_Layer": str(k), f"Segment{k}_LabelValue": "1", f"Segment{k}_Name": name}
    path, rows = tmp_path / "two.seg.nrrd", np.vstack([np.full(3, np.nan), affine[:3, :3].T])
    header = {"kinds": ["list", *["domain"] * 3], "space directions": rows, "space origin": affine[:3, 3]}
    nrrd.write(str(path), layers, header | names | {"space": "RAS", "space units": ["mm"] * 3})
    middles = [read_mesh(Source(path, part=name)).points.mean(axis=0) for name in ("liver", "tumour")]
    np.testing.assert_allclose(1e3 * (middles[1] - middles[0]), (5, 0, 0), atol=1e-3)
    with pytest.raises(StudyError, match=r"3 labels: 1 \(Liver\) of .*; 3 of them are called '1'"):
        opened(Source(path, part="1"))
    nrrd.write(str(path), layers, header | {"kinds": ["RGB-color", *["domain"] * 3], "space": "RAS"})
    with pytest.raises(StudyError, match="has an axis of kind 'RGB-color', so it is no label mask"):
        opened(Source(path))


def test_the_data_of_a_header_lie_in_its_folder(tmp_path):
    folder = tmp_path / "here"
    folder.mkdir()
    slicer(folder / "a.nhdr", *ellipsoid(), space="RAS", space_units=["mm"] * 3)
    file = next(name for name in folder.iterdir() if name.suffix != ".nhdr")
    header = (folder / "a.nhdr").read_text()
    assert opened(Source(folder / "a.nhdr", part="1")).unit == "mm"
    whole = Source(folder / "a.nhdr").sha256
    file.rename(folder / "kept")
    assert Source(folder / "a.nhdr").sha256 != whole  # results belong to the voxels too
    (folder / "kept").rename(file)
    assert Source(folder / "a.nhdr").sha256 == whole
    (tmp_path / file.name).write_bytes(file.read_bytes())
    (folder / "link").symlink_to(tmp_path / file.name)
    os.mkfifo(folder / "pipe")
    for other in (f"../{file.name}", str(file), "link", "pipe", "missing"):
        (folder / "a.nhdr").write_text(header.replace(file.name, other))
        with pytest.raises(StudyError, match=r"is no file in the folder of a\.nhdr; put it there"):
            opened(Source(folder / "a.nhdr", part="1"))


@pytest.mark.parametrize("kind", ["uint8_t", "unsigned char", "short int", "double", "unsigned long long int"])
def test_a_mask_that_promises_too_many_voxels_is_not_unpacked(tmp_path, kind):
    path, side = tmp_path / "a.nrrd", {"u": 1261, "s": 1001, "d": 631}[kind[0]] if "long" not in kind else 631
    head = f"NRRD0004\ntype: {kind}\ndimension: 3\nsizes: {{0}} {{0}} {{0}}\nencoding: gzip\nendian: little\n\n"
    path.write_bytes(head.format(side).encode() + b"no gzip")
    with pytest.raises(StudyError, match=r"a\.nrrd holds 2\.0\d GB unpacked; at most 2 GB are read: crop the image"):
        opened(Source(path))
    path.write_bytes(head.format(side - 2).encode() + b"no gzip")
    with pytest.raises(StudyError, match="its packed data are damaged"):
        opened(Source(path))
    nibabel.save(nibabel.Nifti1Image(np.zeros((2, 2, 2), np.uint8), np.eye(4)), tmp_path / "a.nii")
    content = bytearray((tmp_path / "a.nii").read_bytes())
    content[40:48] = np.array([3, 1300, 1300, 1300], "<i2").tobytes()
    (tmp_path / "a.nii").write_bytes(content)
    with pytest.raises(StudyError, match=r"a\.nii holds 2\.2 GB unpacked"):
        opened(Source(tmp_path / "a.nii"))


def test_segments_of_slicer_have_names(tmp_path):
    labels, affine = ellipsoid()
    header = {
        "space": "left-posterior-superior",
        "space directions": affine[:3, :3],
        "space origin": affine[:3, 3],
        "space units": ["mm", "mm", "mm"],
        "Segment0_Name": "Liver",
        "Segment0_LabelValue": "1",
        "Segment1_Name": "stone",
        "Segment1_LabelValue": "2",
    }
    path = tmp_path / "case.seg.nrrd"
    nrrd.write(str(path), labels, header)
    assert read_mesh(Source(path, part="liver")).volume == read_mesh(Source(path, part="1")).volume > 1e-5
    with pytest.raises(StudyError, match=r"holds 2 labels: 1 \(Liver\) of .* voxels, 2 \(stone\) of 27 voxels; choose"):
        read_mesh(path)


def test_an_axis_that_lists_segments_does_not_change_the_size_of_a_voxel(tmp_path):
    """3D Slicer writes one layer of segments as an array (1, a, b, c); its first axis has no direction in space."""
    labels, affine = ellipsoid()
    rows = np.vstack([np.full(3, np.nan), affine[:3, :3].T])
    header = {"space": "left-posterior-superior", "space origin": affine[:3, 3], "kinds": ["list", *["domain"] * 3]}
    plain, listed = tmp_path / "plain.nrrd", tmp_path / "listed.seg.nrrd"
    nrrd.write(str(plain), labels, {"space directions": rows[1:], "space origin": affine[:3, 3]})
    nrrd.write(str(listed), labels[None], header | {"space directions": rows})
    volumes = [read_mesh(Source(path, "mm", part="1")).volume for path in (plain, listed)]
    assert volumes[0] == volumes[1] == pytest.approx(4e-9 / 3 * np.pi * np.prod(AXES), rel=0.02)


def test_a_warning_names_an_organ_cut_off_by_the_image(tmp_path):
    labels, affine = ellipsoid(shift=30.0)
    path = nifti(tmp_path / "cut.nii", labels, affine)
    with pytest.warns(UserWarning, match=r"cut\.nii: label 1 reaches the edge of the image"):
        check_surface(*(lambda c: (c.points, c.triangles))(opened(Source(path, part="1"))))


def test_what_is_no_mask_gets_a_sentence(tmp_path, mask):
    labels, affine = ellipsoid()
    grey = np.random.default_rng(0).integers(0, 4000, labels.shape).astype(np.int16)
    few = np.random.default_rng(1).integers(0, 239, labels.shape).astype(np.int16)
    nowhere = tmp_path / "no_space.nrrd"
    nrrd.write(str(nowhere), labels, {"spacings": [1.0, np.nan, 2.0]})
    half = tmp_path / "half.nii.gz"
    half.write_bytes(mask.read_bytes()[:900])
    codes = nifti(tmp_path / "codes.nii", *ellipsoid())
    with open(codes, "r+b") as file:
        file.seek(123)  # xyzt_units
        file.write(b"\5")
    furlongs = slicer(tmp_path / "furlongs.nrrd", labels, affine, space="RAS", space_units=["furlong"] * 3)
    mixed = slicer(tmp_path / "mixed.nrrd", labels, affine, space="RAS", space_units=["mm", "um", "mm"])
    mirror = slicer(tmp_path / "mirror.nrrd", labels, affine, space="3D-left-handed")
    cases = {
        "liver.nii.gz holds 2 labels: .*; there is no '7' among them": Source(mask, part="7"),
        "holds 2 labels: 1 of .* voxels, 2 of 27 voxels; choose one by --part": Source(mask),
        r"grey\.nii holds grey values \(3,999 .*\), not a mask: segment it first \(3D": Source(
            nifti(tmp_path / "grey.nii", grey, affine)
        ),
        r"holds grey values \(238 different ones, and 100% of neigh.*\), not a mask: segment": Source(
            nifti(tmp_path / "few.nii", few, affine), part="204"
        ),
        r"holds grey values \(down to -1,000\)": Source(nifti(tmp_path / "ct.nii", grey - np.int16(1000), affine)),
        r"holds grey values \(fractions\)": Source(
            nifti(tmp_path / "soft.nii", (0.3 * labels).astype(np.float32), affine)
        ),
        "holds no label: every voxel is 0": Source(nifti(tmp_path / "no.nii", 0 * labels, affine)),
        r"no_space\.nrrd does not say how its three axes lie in space": Source(nowhere),
        "has 4 dimensions": Source(nifti(tmp_path / "two.nii", np.stack([labels, labels], axis=-1), affine)),
        r"furlongs\.nrrd states its lengths in an unknown unit, 'furlong'; say --unit m, cm": Source(furlongs),
        r"codes\.nii states its lengths in an unknown unit, 'with the code 5'": Source(codes),
        r"mixed\.nrrd has axes in different units \(mm, um\)": Source(mixed),
        r"mirror\.nrrd is in the space '3d-left-handed', a mirror image; export it as right-": Source(mirror),
        "half.nii.gz is not a mesh that can be read .it is cut short": Source(half),
    }
    for sentence, source in cases.items():
        with pytest.raises(StudyError, match=sentence) as caught:
            content = opened(replace(source, part="1") if source.part is None and "unit" in sentence else source)
            source.metres(content.longest_side, content.unit)
        assert "\n" not in str(caught.value)


def test_many_labels_side_by_side_are_a_mask(tmp_path):
    """Up to as many as a segmentation of the whole body has: 117 blocks, each the neighbour of others."""
    blocks = np.arange(1, 118).reshape(13, 9, 1).repeat(5, 0).repeat(5, 1).repeat(20, 2).astype(np.int16)
    path = nifti(tmp_path / "body.nii", blocks, np.diag([3.0, 3.0, 3.0, 1.0]))
    assert len(opened(Source(path, part="60")).triangles) > 100


def test_a_header_without_a_unit_means_millimetres(tmp_path):
    path = nifti(tmp_path / "liver.nii", *ellipsoid(), unit="unknown")
    sentence = r"liver\.nii: its header does not say the unit; assuming millimetres \(the convention\); --unit sets"
    with pytest.warns(UserWarning, match=sentence):
        surface = scan(Source(path, part="1"), fill=False)
    assert 1e3 * np.ptp(surface.points[:, 0]) == pytest.approx(2 * AXES[0], rel=0.05)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert opened(Source(path, "cm", part="1")).unit == "mm"


def test_without_the_reader_the_sentence_says_how_to_install_it(mask, monkeypatch):
    load = builtins.__import__

    def without(name, *rest, **options):
        if name in ("nibabel", "nrrd"):
            raise ImportError(name)
        return load(name, *rest, **options)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(
        StudyError, match=r"nibabel, which reads it, is not installed; run .*-m pip install .organbench"
    ):
        opened(Source(mask))
