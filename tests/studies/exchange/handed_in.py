"""Our own run of the octant, as another program would hand it in."""

import numpy as np

from massspring import ImplicitVolume
from studies.runs.case import Case
from studies.runs.recipes import TetrahedralBody
from tests.studies.octant import SCENE

NODES, FRAMES = 150, 40
CASE = Case(SCENE, TetrahedralBody(nodes=NODES), ImplicitVolume(), frames=FRAMES)


class HandedIn:
    """What a program has computed: steps from t = 0 on."""

    def __init__(self, t, positions, force, pressure):
        self.t, self.positions, self.force, self.pressure = t, positions, force, pressure

    def npz(self, path, **changes):
        data = {"t": self.t, "positions": self.positions, "force": self.force, "pressure": self.pressure} | changes
        np.savez(path, **{name: values for name, values in data.items() if values is not None})
        return path
