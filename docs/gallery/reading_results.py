# %% [markdown]
# # Reading results
#
# Results are tables (CSV, Parquet) and one HDF5 file per case; `organbench view` writes a file for ParaView. First we
# run a small study, so that there is something to read.

# %%
# %%writefile small.py
from dataclasses import replace

from massspring import Free, ImplicitVolume
from studies import BALL_SQUEEZE, Case, Study, SurfaceBody, TetrahedralBody

SCENE = replace(BALL_SQUEEZE, reference=None)
BODIES = TetrahedralBody(150), SurfaceBody(150)
CASES = tuple(Case(SCENE, body, method, frames=50) for body in BODIES for method in (Free(), ImplicitVolume()))
STUDY = Study("small", "What is in a results folder?", CASES, (), ("volume_worst", "min_j"))

# %% language="bash"
# organbench run small.py --results results --jobs 1
# organbench table small.py --results results --parquet small.parquet

# %% [markdown]
# ## Tables
#
# A table has a row per case. The name of each column contains its unit.

# %%
import pandas as pd

table = pd.read_parquet("small.parquet")
table[["body", "method", "status", "dt [ms]", "volume_worst [%]"]]

# %%
table.pivot(index="body", columns="method", values="volume_worst [%]")

# %% [markdown]
# ## Records
#
# The file with the name of the study opens like a tree: it links to each case and its arrays.

# %%
import h5py

with h5py.File("results/small/small.h5") as file:
    for name, case in file.items():
        print(name, "->", case.attrs["status"], case["volume"].shape, case["volume"].attrs["unit"])

# %% [markdown]
# `Run.load` verifies the file's checksum first. Arrays are `fields`, numbers and texts `attributes`.

# %%
from pathlib import Path

import matplotlib.pyplot as plt

from studies import Run

figure, axes = plt.subplots(figsize=(7, 3.4), layout="constrained")
for path in sorted(Path("results/small").glob("ball*.h5")):
    run = Run.load(path)
    force = pd.Series(abs(run.fields.contact_force[:, 0, 2]), run.fields.t)
    force.plot(ax=axes, label=path.stem.rsplit("-", 1)[0])
axes.set(xlabel="time [s]", ylabel="force on a plate [N]", ylim=(0, 5))
axes.legend(fontsize=8)
plt.show()

# %% [markdown]
# ## ParaView
#
# One file contains all cases side by side, in all steps. ParaView opens it; its library VTK reads it in Python.

# %% language="bash"
# organbench view results/small/ball*tetrahedral*.h5 -o small.vtkhdf

# %%
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOHDF import vtkHDFReader

reader = vtkHDFReader()
reader.SetFileName("small.vtkhdf")
reader.UpdateInformation()
steps = range(reader.GetNumberOfSteps())
for step in steps:
    reader.SetStep(step)
    reader.Update()
    grid = reader.GetOutput()
    ratio = vtk_to_numpy(grid.GetFieldData().GetArray("volume_ratio")).ravel()
    print(f"step {step}: {grid.GetNumberOfPoints()} points, V/V0 of each body: {ratio.round(4)}")

# %% [markdown]
# The last step, read by VTK and drawn with matplotlib:

# %%
points = 1e3 * vtk_to_numpy(grid.GetPoints().GetData())
moved = vtk_to_numpy(grid.GetPointData().GetArray("displacement"))
figure, axes = plt.subplots(figsize=(8, 3.4), layout="constrained")
shown = axes.scatter(points[:, 0], points[:, 2], c=1e3 * (moved**2).sum(axis=1) ** 0.5, s=8)
figure.colorbar(shown, label="displacement [mm]")
axes.set(xlabel="x [mm]", ylabel="z [mm]", aspect="equal")
plt.show()
