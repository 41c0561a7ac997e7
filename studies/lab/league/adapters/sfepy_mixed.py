"""SfePy: quadratic displacements with linear pressures on straight tetrahedra, neo-Hookean, equilibria by Newton.

The volume is kept by the bulk modulus of the scene. Obstacles push by a penalty, integrated over the facets, and the
force is that integral. Inertia and damping are left out, as the scene allows: the loads are slow. A body that nothing
holds is held at three nodes so that it cannot turn or drift, which takes no force.
"""

# Checked alike where the package is not installed.
# pyright: reportMissingImports=false

import time
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from scene_folder import CannotDo, SceneFolder, hand_in, moved, place
from sfepy.base.base import IndexedStruct, output
from sfepy.discrete import Equation, Equations, FieldVariable, Function, Integral, Material, Problem
from sfepy.discrete.conditions import Conditions, EssentialBC
from sfepy.discrete.fem import FEDomain, Field, Mesh
from sfepy.mechanics.contact_bodies import ContactPlane, ContactSphere
from sfepy.solvers.ls import ScipyDirect
from sfepy.solvers.nls import Newton
from sfepy.terms import Term

INCREMENTS = 2
"""Load steps between two checkpoints."""
PENALTY = 2000.0
"""Pressure over depth, times the size of the body, over the shear modulus: depths of less than 0.1 % of the size."""
HALVINGS = 3
"""Of a load step that does not converge, at most."""
WIDE = 1.0
"""Half the edge of a plane [m]."""


class Body:
    """A scene in SfePy."""

    def __init__(self, scene: SceneFolder, penalty: float) -> None:
        """Raises CannotDo."""
        scene.check_simple()
        if np.any(scene.data["gravity"]):
            raise CannotDo("its adapter knows no weight")
        self.scene, self.obstacles, self.probed = scene, scene.obstacles("plane", "sphere"), scene.probed_obstacle
        self.now, self.holds = 0.0, list[Any]()
        output.set_output(quiet=True)
        mesh = Mesh.from_data("organ", scene.points, None, [scene.cells], [np.zeros(len(scene.cells), int)], ["3_4"])
        self.domain = FEDomain("domain", mesh)
        whole = self.domain.create_region("Omega", "all")
        outside = self.domain.create_region("Outside", "vertices of surface", "facet")
        self.field = Field.from_args("displacement", np.float64, "vector", whole, approx_order=2)
        pressures = Field.from_args("pressure", np.float64, "scalar", whole, approx_order=1)
        u, v = FieldVariable("u", "unknown", self.field), FieldVariable("v", "test", self.field, primary_var_name="u")
        p, q = FieldVariable("p", "unknown", pressures), FieldVariable("q", "test", pressures, primary_var_name="p")
        bulk, size = scene.data["material"]["bulk_modulus"], float(np.linalg.norm(np.ptp(scene.points, axis=0)))
        m = Material("m", mu=scene.mu, soft=1.0 / bulk, push=[[penalty * scene.mu / size, 0.0]])
        inner, outer = Integral("inner", order=3), Integral("outer", order=4)
        push = Term.new("dw_tl_he_neohook(m.mu, v, u)", inner, whole, m=m, v=v, u=u)
        push = push + Term.new("dw_tl_bulk_pressure(v, u, p)", inner, whole, v=v, u=u, p=p)
        self.inside = list(push)
        self.contacts = [self._contact(one, outer, outside, {"m": m, "u": u, "v": v}) for one in self.obstacles]
        for contact in self.contacts:
            push = push + contact
        kept = Term.new("dw_tl_volume(q, u)", inner, whole, q=q, u=u, term_mode="volume")
        kept = kept + Term.new("dw_dot(m.soft, q, p)", inner, whole, m=m, q=q, p=p)
        kept = kept - Term.new("dw_integrate(q)", inner, whole, q=q)
        self.u = u
        equations = Equations([Equation("push", push), Equation("kept", kept)])
        self.status = IndexedStruct()
        solver = Newton(
            {"i_max": 30, "eps_a": 1e-8 * scene.mu * size**2, "eps_r": 1e-6},
            lin_solver=ScipyDirect({}),
            status=self.status,
        )
        self.problem = Problem("organ", equations=equations)
        self.problem.set_solver(solver)
        self.problem.set_bcs(ebcs=Conditions(self._tied()))
        self.problem.time_update()
        self.state: Any = None

    def _contact(self, obstacle: dict[str, Any], integral: Any, region: Any, names: dict[str, Any]) -> Any:
        """A term whose obstacle is put in its place before each load step."""
        dummy = Material("at", values={".n": np.zeros(3), ".a": np.zeros(3), ".b": np.zeros((4, 3)), ".r": 0.0})
        words = "dw_contact_plane(m.push, at.n, at.a, at.b, v, u)"
        if obstacle["kind"] == "sphere":
            words = "dw_contact_sphere(m.push, at.a, at.r, v, u)"
        return Term.new(words, integral, region, at=dummy, **names)

    def _tied(self) -> list[Any]:
        scene = self.scene
        if scene.data["held"]:
            return [self._hold(number, held) for number, held in enumerate(scene.data["held"])]
        x = scene.points - scene.points.mean(axis=0)
        corners = np.abs(x).max() * np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
        nodes = [int(np.linalg.norm(x - corner, axis=1).argmin()) for corner in corners]
        fixed = ({"u.all": 0.0}, {"u.[1,2]": 0.0}, {"u.2": 0.0})
        return [
            EssentialBC(f"tied{k}", self.domain.create_region(f"Tied{k}", f"vertex {node}", "vertex"), values)
            for k, (node, values) in enumerate(zip(nodes, fixed, strict=True))
        ]

    def _hold(self, number: int, held: dict[str, Any]) -> Any:
        """A region with the nodes in the middle of its edges, which is where its path is at `self.now`."""
        nodes = ", ".join(map(str, self.scene.marked(held["point_data"])))
        region = self.domain.create_region(f"Held{number}", f"vertex {nodes}", "vertex")
        faces = self.domain.create_region(f"HeldFaces{number}", f"vertices of surface *v r.Held{number}", "facet")

        def way(ts: Any, coors: np.ndarray, **_: Any) -> np.ndarray:
            return np.broadcast_to(moved(held["path"], self.now), coors.shape).copy()

        where = faces if faces.has_cells() or len(faces.entities[2]) else region
        self.holds.append(where)
        return EssentialBC(f"held{number}", where, {"u.all": Function(f"way{number}", way)})

    def step(self, t: float) -> None:
        """To the equilibrium at time t [s]. Raises RuntimeError where Newton's method does not converge."""
        self.now = t
        for contact, one in zip(self.contacts, self.obstacles, strict=True):
            if one["kind"] == "sphere":
                contact.cs = ContactSphere(place(one, t), one["radius"])
            else:
                normal = -np.array(one["normal"])
                across = np.linalg.svd(normal[None])[2][1:]
                corners = [a * across[0] + b * across[1] for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
                contact.cp = ContactPlane(place(one, t), normal, place(one, t) + WIDE * np.array(corners))
        state = self.problem.solve(state0=self.state, save_results=False)()
        if self.status["condition"] != 0:
            raise RuntimeError(f"Newton's method does not converge at t = {t:g} s")
        self.state = state

    def advance(self, before: float, now: float, halvings: int = HALVINGS) -> None:
        """From the equilibrium at a time to that at another [s], in halves where that fails. Raises RuntimeError."""
        try:
            self.step(now)
        except RuntimeError:
            if halvings == 0:
                raise
            middle = 0.5 * (before + now)
            self.advance(before, middle, halvings - 1)
            self.advance(middle, now, halvings - 1)

    def positions(self) -> np.ndarray:
        """Of all nodes [m], (n, 3)."""
        return self.scene.points + self.u().reshape(-1, 3)[: len(self.scene.points)]

    def force(self) -> float:
        """The probed force [N]: the integral of the penalty over the facets, or what holds a region against the stress
        of the elements."""
        if self.probed is not None:
            push = self._values(self.contacts[self.probed], {"dw_mode": "vector"})
            return abs(self.scene.along(push.sum(axis=(0, 2))))
        push = np.sum([self._values(term, {}) for term in self.inside], axis=0)
        nodes = self.field.get_dofs_in_region(self.holds[self.scene.data["force"]["number"]])
        return self.scene.along(np.moveaxis(push, 1, 2)[np.isin(self.field.econn, nodes)].sum(axis=0))

    @staticmethod
    def _values(term: Any, options: dict[str, str]) -> np.ndarray:
        """Of a term for every node of every element, (k, 3, nodes) [N]."""
        values = term.evaluate(mode="weak", standalone=False, **options)[0]
        return values.reshape(len(values), 3, -1)


def run(scene: SceneFolder, out: Path, *, increments: int = INCREMENTS, penalty: float = PENALTY) -> None:
    """Runs the scene with `increments` load steps to a checkpoint and hands it in."""
    started = time.process_time()
    body = Body(scene, penalty)
    positions, forces = [scene.points], [0.0]
    for before, now in zip(scene.times[:-1], scene.times[1:], strict=True):
        for begin, end in pairwise(np.linspace(before, now, increments + 1).tolist()):
            body.advance(begin, end)
        positions.append(body.positions())
        forces.append(body.force())
    spent = time.process_time() - started
    hand_in(out, scene.times, np.array(positions), np.array(forces), spent / scene.data["duration"])
