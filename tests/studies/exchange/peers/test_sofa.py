"""The scene file for SOFA, with a stand-in for SOFA that takes components and sends events."""

import importlib.util
import json
import sys
from contextlib import contextmanager
from types import ModuleType, SimpleNamespace

import meshio
import numpy as np
import pytest

from studies.exchange.export import SOFA, export
from studies.exchange.league.entry_file import judged_file, read_entry_file
from studies.scene.library import BALL_CLAMPED, BALL_SQUEEZE, LIVER_PROBE
from studies.store.record import Status
from tests.campaigns import campaign

NODES = 150


class Value:
    """Data of a component."""

    def __init__(self, value):
        self.value = value

    @contextmanager
    def writeable(self):
        yield self.value


class Node:
    """Takes components as SOFA's does."""

    def __init__(self, name):
        self.name, self.objects = name, []

    def addObject(self, what, **data):
        if not isinstance(what, str):
            self.run = what
            return what
        data = {name: np.array(value, float) if name == "position" else value for name, value in data.items()}
        component = SimpleNamespace(what=what, **{name: Value(value) for name, value in data.items()})
        self.objects.append(component)
        return component

    def addChild(self, name):
        self.child = Node(name)
        return self.child

    def the(self, what):
        """The components of a kind."""
        return [one for one in self.child.objects if one.what == what]


@pytest.fixture
def scene_file(tmp_path, monkeypatch):
    """Exports a scene and loads its file."""

    def load(scene):
        export(scene, tmp_path, NODES)
        sofa, core, simulation = ModuleType("Sofa"), ModuleType("Sofa.Core"), ModuleType("Sofa.Simulation")
        core.Controller, core.Node = type("Controller", (), {"__init__": lambda self, name: None}), Node
        sofa.Core, sofa.Simulation, sofa.__version__ = core, simulation, "25.12"
        simulation.init = lambda root: None

        def animate(root, dt):  # held nodes move, and no other
            root.run.onAnimateBeginEvent(None)
            root.run.onAnimateEndEvent(None)

        simulation.animate = animate
        modules = {"Sofa": sofa, "Sofa.Core": core, "Sofa.Simulation": simulation, "SofaRuntime": ModuleType("R")}
        for name, module in modules.items():
            monkeypatch.setitem(sys.modules, name, module)
        spec = importlib.util.spec_from_file_location("sofa_scene", tmp_path / SOFA.name)
        assert spec is not None and spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module

    return load


def mesh_of(folder):
    mesh = meshio.read(folder / "straight.vtu")
    return mesh.points, mesh.cells[0].data.astype(int)


def test_forces_of_the_elements_are_the_slope_of_their_energy(scene_file, tmp_path):
    sofa, mu, nu = scene_file(BALL_CLAMPED), 1800.0, 0.4
    rest, cells = mesh_of(tmp_path)
    cells = cells[:40]
    x = rest * [1.1, 0.95, 1.02] + 2e-3 * np.random.default_rng(0).standard_normal(rest.shape)

    def energy(x):
        before, after = (np.swapaxes(at[cells[:, 1:]] - at[cells[:, :1]], 1, 2) for at in (rest, x))
        stretches = np.linalg.svd(after @ np.linalg.inv(before), compute_uv=False) - 1.0
        lame = 2.0 * mu * nu / (1.0 - 2.0 * nu)
        density = mu * (stretches**2).sum(axis=1) + 0.5 * lame * stretches.sum(axis=1) ** 2
        return float((density * np.abs(np.linalg.det(before)) / 6.0).sum())

    forces = sofa.element_forces(rest, cells, x, mu, nu)
    h, way = 1e-7, np.random.default_rng(1).standard_normal(rest.shape)
    slope = (energy(x + h * way) - energy(x - h * way)) / (2.0 * h)
    assert (forces * way).sum() == pytest.approx(-slope, rel=1e-6)
    turn = np.linalg.qr(np.random.default_rng(2).standard_normal((3, 3)))[0]
    turn *= np.linalg.det(turn)
    assert np.abs(sofa.element_forces(rest, cells, rest @ turn.T, mu, nu)).max() < 1e-9


def test_the_clamped_ball_gets_its_components_and_its_held_nodes_move(scene_file, tmp_path):
    sofa = scene_file(BALL_CLAMPED)
    root = sofa.createScene(Node("root"))
    (elements,), (fixed,) = root.the("TetrahedronFEMForceField"), root.the("FixedProjectiveConstraint")
    mu = BALL_CLAMPED.tissue.shear_modulus
    assert elements.youngModulus.value / (2.0 * (1.0 + elements.poissonRatio.value)) == pytest.approx(mu)
    assert root.the("EulerImplicitSolver")[0].rayleighMass.value == BALL_CLAMPED.damping
    mesh = meshio.read(tmp_path / "straight.vtu")
    top = np.flatnonzero(mesh.point_data["held_top"] == 1)
    assert set(top) < set(fixed.indices.value)
    for _ in range(100):
        root.run.onAnimateBeginEvent(None)
        root.run.onAnimateEndEvent(None)
    x = root.the("MechanicalObject")[0].position.value
    assert np.allclose(x[top] - mesh.points[top], [0.0, 0.0, -0.0125 / 3.0])
    assert root.run.probed(x, 1.0) > 0.0  # the cap presses on the elements below it


@pytest.mark.parametrize("scene", [campaign(LIVER_PROBE), BALL_SQUEEZE], ids=lambda scene: scene.name)
def test_obstacles_move_and_push_with_the_law_of_the_component(scene_file, scene):
    sofa = scene_file(scene)
    root = sofa.createScene(Node("root"))
    field = root.the("SphereForceField" if scene is LIVER_PROBE else "PlaneForceField")[0]
    root.run.onAnimateBeginEvent(None)
    described, stiffness = root.run.scene["obstacles"][0], root.run.stiffness
    speed = np.array(scene.obstacles[0].path.displacements[1]) / scene.obstacles[0].path.times[1]
    x, normal = (
        np.array(described.get("centre", described.get("point"))) + sofa.STEP * speed,
        np.array([0.0, 0.0, -1.0]),
    )
    if scene is LIVER_PROBE:
        assert np.allclose(field.sphereCenter.value, x)
        x = x + field.sphereRadius.value * normal
    else:
        assert field.d.value == pytest.approx(x @ normal) and np.allclose(field.normal.value, normal)
    inside, outside = (x + off * normal for off in (-1e-3, 1e-3))
    pushed = sofa.contact_force(described, stiffness, np.array([inside, outside]), sofa.STEP)
    assert np.allclose(pushed, stiffness * 1e-3 * normal)


def test_what_it_hands_in_is_an_entry_of_the_league(scene_file, tmp_path):
    sofa = scene_file(LIVER_PROBE)
    sofa.main()
    entry = read_entry_file(tmp_path / "sofa.json")
    assert (entry.engine, entry.version, entry.nodes) == ("sofa", "25.12", NODES)
    record = judged_file(LIVER_PROBE, entry, tmp_path)
    assert record.status == Status.OK and "the body did not move" in record.attributes["warnings"]
    handed = np.load(tmp_path / "sofa.npz", allow_pickle=False)
    assert handed["t"] == pytest.approx([0.0, *LIVER_PROBE.checkpoints])
    assert json.loads((tmp_path / "sofa.json").read_text())["settings"]["poisson"] == sofa.POISSON


def test_a_scene_that_it_cannot_do_ends_with_a_sentence(scene_file, tmp_path):
    sofa = scene_file(BALL_CLAMPED)
    described = json.loads((tmp_path / "scene.json").read_text())
    (tmp_path / "scene.json").write_text(json.dumps(described | {"lumen": {}}))
    with pytest.raises(SystemExit, match="it knows solid organs, not a wall round a lumen"):
        sofa.createScene(Node("root"))
