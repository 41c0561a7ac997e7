# %% [markdown]
# # Your own method
#
# A method in a file of your own runs next to ours, in the same scene, with the same metrics. This one is an obvious
# shortcut: springs alone, and after each frame the body is scaled about its centre until it has its volume again. What
# does that cost?

# %%
# %%writefile shortcut.py
"""Is scaling as good as a constraint?"""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from massspring import Free, ImplicitVolume
from studies import BALL_SQUEEZE, Case, Chart, Study, TetrahedralBody

SCENE = replace(BALL_SQUEEZE, name="squeeze", reference=None)


@dataclass(frozen=True)
class Scaled(Free):
    """Springs alone; after each frame the body is scaled about its middle to the volume that it has at rest."""

    name: ClassVar[str] = "scaled"

    def start(self, body, attachments=(), v=None):
        """The body at rest, and what scaling needs to know of it."""
        return replace(super().start(body, attachments, v), memory=(body.triangles, body.volume))

    def advance(self, state, boundary):
        """One frame."""
        after = super().advance(state, boundary)
        triangles, volume = state.memory
        middle = after.x.mean(axis=0)
        a, b, c = (after.x[triangles] - middle).swapaxes(0, 1)
        ratio = (6 * volume / np.vecdot(a, np.cross(b, c)).sum()) ** (1 / 3)
        return after.moved_to(middle + ratio * (after.x - middle))


CASES = tuple(
    Case(SCENE, TetrahedralBody(nodes=150), method, frames=100) for method in (Free(), Scaled(), ImplicitVolume())
)
CHARTS = (Chart("volume.png", "studies.plots.volume_history:draw"), Chart("force.png", "studies.plots.force_path:draw"))
STUDY = Study("shortcut", "Is scaling as good as a constraint?", CASES, CHARTS, ("volume_worst", "min_j"))

# %% [markdown]
# The file is a study: you run, tabulate and draw it like those of the catalogue. If you edit its code, its own cases
# become stale, and no others.

# %% language="bash"
# organbench run shortcut.py --results results --jobs 1

# %% language="bash"
# organbench table shortcut.py --results results

# %%
from IPython.display import Image

Image("results/shortcut/volume.png", width=700)

# %% [markdown]
# Scaling keeps the volume to the last digit. But it moves nodes without a force, even into the plates, so the force
# stays that of springs alone. A constraint is a pressure, and the plates feel it.

# %%
from pathlib import Path

import matplotlib.pyplot as plt

from studies import read_record

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.2), layout="constrained")
for path in sorted(Path("results/shortcut").glob("squeeze-*.h5")):
    record = read_record(path)
    t, name = record.fields["t"].values, path.name.split("-")[3]
    left.plot(t, abs(record.fields["contact_force"].values[:, 0, 2]), label=name)
    right.plot(t, 1e3 * record.fields["penetration"].values.max(axis=1), label=name)
left.set(xlabel="time [s]", ylabel="force on a plate [N]")
right.set(xlabel="time [s]", ylabel="deepest node inside a plate [mm]")
left.legend()
plt.show()
