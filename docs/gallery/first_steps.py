# %% [markdown]
# # First steps
#
# A ball of 5 cm is squeezed between two plates by 30 % of its diameter: once with springs alone, once with its volume
# kept by one Lagrange multiplier. A *scene* is what happens to an organ, a *body* is particles, springs and volumes,
# and a *method* advances them in time. The three together are a *case*; `measure` runs it.

# %%
import matplotlib.pyplot as plt

from studies import BALL_SQUEEZE, Case, Free, ImplicitVolume, Run, TetrahedralBody, measure, study_table

body = TetrahedralBody(nodes=150)
cases = [Case(BALL_SQUEEZE, body, method, frames=100) for method in (Free(), ImplicitVolume())]
records = [measure(case) for case in cases]

# %% [markdown]
# A record holds arrays with their units, and numbers about the run.

# %%
for name, field in records[0].fields.items():
    print(f"{name:16} {field.values.shape!s:12} {field.unit:5} {field.description}")

# %%
for name in ("nodes", "springs", "dt", "dt_limit", "steps"):
    print(f"{name:10} {records[0].attributes[name]:.4g}")

# %% [markdown]
# Springs alone lose volume while the plates close; the constraint keeps it. The force differs too: a body that
# cannot lose volume is stiffer.

# %%
figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.2), layout="constrained")
for case, record in zip(cases, records, strict=True):
    t, volume = record.fields["t"].values, record.fields["volume"].values[:, 0]
    force = record.fields["contact_force"].values[:, 0, 2]
    left.plot(t, 100 * (volume / record.attributes["rest_volume"] - 1), label=case.method.name)
    right.plot(t, abs(force), label=case.method.name)
left.set(xlabel="time [s]", ylabel="change of volume [%]")
right.set(xlabel="time [s]", ylabel="force on a plate [N]")
right.legend()
plt.show()

# %% [markdown]
# The surface at the last checkpoint, seen from the side:

# %%
figure = plt.figure(figsize=(9, 3.6), layout="constrained")
for number, (case, record) in enumerate(zip(cases, records, strict=True), start=1):
    x, y, z = 1e3 * record.fields["snapshots"].values[-1].T
    axes = figure.add_subplot(1, 2, number, projection="3d")
    axes.plot_trisurf(x, y, z, triangles=record.fields["triangles"].values, edgecolor="white", linewidth=0.3)
    axes.set(title=case.method.name, xlabel="x [mm]", ylabel="y [mm]", zlabel="z [mm]")
    axes.set_aspect("equal")
    axes.view_init(elev=10)
plt.show()

# %% [markdown]
# Metrics are numbers computed from a run. Some compare with the finite-element reference, which `organbench run
# volume_loss` solves; without it they are not a number (NaN).

# %%
runs = [Run(case, record) for case, record in zip(cases, records, strict=True)]
study_table(runs, ["volume_worst", "min_j", "force_end"])[["method", "status", "volume_worst [%]", "min_j [1]"]]
