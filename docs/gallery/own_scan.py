# %% [markdown]
# # Your own scan
#
# A surface from a scanner has holes, specks and triangles that point inwards. This notebook makes such a file from a
# synthetic kidney, checks it, repairs it, makes a mesh, places a clamped region and a probe, and runs it. With your own
# file, begin at the mesh doctor.

# %%
import meshio
import numpy as np
from IPython.display import Image

from studies.geometry import organ

kidney = organ("kidney", 600, fill=False, exact=True)
faces = kidney.triangles.copy()
faces[100:160] = faces[100:160, ::-1]  # some point inwards
lowest = kidney.points[faces].mean(axis=1)[:, 2].argsort()
faces = np.delete(faces, lowest[:3], axis=0)  # a hole
speck = np.array([[0.0, 0.0, 0.0], [2e-3, 0.0, 0.0], [0.0, 2e-3, 0.0], [0.0, 0.0, 2e-3]]) + 0.2
points = np.vstack([kidney.points, speck])
faces = np.vstack([faces, len(kidney.points) + np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])])
meshio.write_points_cells("scan.ply", 1e3 * points, [("triangle", faces.astype(np.int32))])  # in millimetres

# %% [markdown]
# ## What is wrong with it
#
# The mesh doctor names each fault and the option that repairs it. Its exit code is 1 if it found a fault.

# %% language="bash"
# organbench mesh --check scan.ply --unit mm || echo exit code $?

# %% [markdown]
# ## A body of 150 surface nodes
#
# The command prints how far the mesh is from the file, in both directions, and both volumes.

# %% language="bash"
# organbench mesh --from scan.ply --unit mm --close-holes --nodes 150 -o body.vtu

# %%
body = meshio.read("body.vtu")
print({block.type: len(block.data) for block in body.cells}, f"{1e6 * kidney.volume:.0f} mL before the damage")

# %% [markdown]
# ## Where it is clamped and probed
#
# By default the blunter end of the longest axis is clamped, and the probe presses on the flattest patch that it can
# reach. `--hold` and `--probe` choose other places. The file's name does not say which organ it is, so `--tissue` does.

# %% language="bash"
# organbench place body.vtu --tissue kidney --nodes 150 -o my_scene.py --picture my_scene.png

# %%
Image("my_scene.png", width=700)

# %% [markdown]
# ## Run it
#
# The scene file is a study like all others: `organbench run my_scene.py` also solves the reference and runs the
# recommended body. That takes minutes to an hour. Here only the quick body of one volume runs, for 50 frames.

# %%
import matplotlib.pyplot as plt
from my_scene import CASES

from studies import Run, measure

case = CASES[-1].replaced(frames=50)
record = measure(case)
run = Run(case, record)
figure, axes = plt.subplots(figsize=(6, 3.2), layout="constrained")
axes.plot(run.field("t"), run.force)
axes.set(xlabel="time [s]", ylabel="force of the probe [N]", title=f"{record.status}: {case.name}")
plt.show()
