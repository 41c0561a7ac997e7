"""MuJoCo: flexible bodies ("flex") of linear tetrahedra, Saint Venant-Kirchhoff, with contact by MuJoCo's solver.

Volume is kept as its documentation has it, by a Poisson ratio near ½; the shear modulus is that of the tissue. Damping
is that of the scene, on every degree of freedom. The positions of obstacles ("mocap" bodies) are set in each step. So
are those of held nodes, which are so heavy that forces do not move them in a step; the force of a held region is that
of MuJoCo's elements ("qfrc_spring") there.
"""

# Checked alike where the package is not installed.
# pyright: reportAttributeAccessIssue=false

from pathlib import Path
from typing import Any

import mujoco  # pyright: ignore[reportMissingImports]
import numpy as np
from scene_folder import SceneFolder, march, place

POISSON = 0.49
"""kappa is 50 mu. Nearer to ½ the force of a ball gains some percent, its volume nothing."""
STEP = 2e-3
"""[s]; implicit in positions (integrator "discrete")."""
HEAVY = 1e6
"""Factor on the mass of a held node."""

XML = """<mujoco>
<option timestep="{dt}" gravity="{gravity}" integrator="discrete" cone="elliptic"/>
<size memory="512M"/>
<worldbody>
{shapes}
<flexcomp name="organ" type="direct" dim="3" mass="{mass}" radius="1e-6" point="{points}" element="{cells}">
<contact condim="1" selfcollide="none" solref="{solref}"/>
<elasticity young="{young}" poisson="{poisson}"/>
</flexcomp>
</worldbody>
</mujoco>"""


def model_of(scene: SceneFolder, dt: float, poisson: float, stiff: float) -> mujoco.MjModel:
    """The scene as MuJoCo's model. Raises CannotDo."""
    scene.check_simple(masses=True)
    contact = f'condim="1" friction="0 0 0" solref="{stiff * dt} 1"'
    shapes = "\n".join(
        f'<body name="obstacle{k}" mocap="true" pos="{_text(place(o, 0.0))}"><geom {_shape(o)} {contact}/></body>'
        for k, o in enumerate(scene.obstacles("plane", "sphere"))
    )
    corners = scene.points[scene.cells]
    volumes = np.einsum("ij,ij->i", corners[:, 1] - corners[:, 0], _cross(corners)) / 6.0
    model = mujoco.MjModel.from_xml_string(
        XML.format(
            dt=dt,
            gravity=_text(scene.data["gravity"]),
            shapes=shapes,
            mass=scene.density * volumes.sum(),
            points=_text(scene.points.ravel()),
            cells=_text(scene.cells.ravel()),
            solref=f"{stiff * dt} 1",
            young=2.0 * scene.mu * (1.0 + poisson),
            poisson=poisson,
        )
    )
    _set_masses(model, scene, volumes)
    return model


def _set_masses(model: mujoco.MjModel, scene: SceneFolder, volumes: np.ndarray) -> None:
    """A quarter of each tetrahedron at its corners, where MuJoCo shares the mass evenly; and the scene's damping."""
    mass = np.bincount(scene.cells.ravel(), np.repeat(volumes / 4.0, 4), len(scene.points)) * scene.density
    mass += scene.hung
    model.dof_damping[_freedoms(model)] = scene.data["damping"]["rate"] * mass[:, None]
    mass[scene.held] *= HEAVY
    model.body_mass[model.flex_vertbodyid] = mass
    mujoco.mj_setConst(model, mujoco.MjData(model))  # bodies that only slide take their inertia from there


def _freedoms(model: mujoco.MjModel) -> np.ndarray:
    """Numbers of the three degrees of freedom of every node, (n, 3): slides along the axes, in `qpos` and `qvel`."""
    return model.body_dofadr[model.flex_vertbodyid][:, None] + np.arange(3)


def run(
    scene: SceneFolder,
    out: Path,
    *,
    step: float = STEP,
    poisson: float = POISSON,
    stiff: float = 2.0,
) -> None:
    """Runs the scene with steps of `step` and hands it in; stiff: time constant of contacts over the step."""
    model = model_of(scene, step, poisson, stiff)
    data, freedoms = mujoco.MjData(model), _freedoms(model)
    held = freedoms[scene.held]
    mujoco.mj_forward(model, data)

    def advance(t: float) -> None:
        for k, obstacle in enumerate(scene.data["obstacles"]):
            data.mocap_pos[k] = place(obstacle, t)
        data.qpos[held], data.qvel[held] = scene.held_at(t) - scene.points[scene.held], 0.0
        mujoco.mj_step(model, data)

    def positions() -> np.ndarray:
        return scene.points + data.qpos[freedoms]

    probed, nodes = scene.probed_obstacle, scene.probed_nodes

    def force(t: float) -> float:
        if probed is None:
            return scene.along(-data.qfrc_spring[freedoms[nodes]].sum(axis=0))
        return abs(scene.along(_contact_force(model, data, probed)))

    march(scene, out, step, advance, force, positions)


def _contact_force(model: mujoco.MjModel, data: mujoco.MjData, obstacle: int) -> np.ndarray:
    """Sum of the contact forces at an obstacle, up to its sign, (3,) [N]."""
    total, wrench = np.zeros(3), np.zeros(6)
    for number in range(data.ncon):
        contact = data.contact[number]
        if obstacle in (model.geom_bodyid[contact.geom[0]] - 1, model.geom_bodyid[contact.geom[1]] - 1):
            mujoco.mj_contactForce(model, data, number, wrench)
            total += wrench[0] * contact.frame[:3]
    return total


def _shape(obstacle: dict[str, Any]) -> str:
    if obstacle["kind"] == "sphere":
        return f'type="sphere" size="{obstacle["radius"]!r}"'
    return f'type="plane" size="1 1 1" zaxis="{_text(obstacle["normal"])}"'


def _cross(corners: np.ndarray) -> np.ndarray:
    return np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 0])


def _text(values: object) -> str:
    return " ".join(repr(value) for value in np.asarray(values).ravel().tolist())
