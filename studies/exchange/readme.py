"""README.md of an exported scene: what the files are, in which units, and how to hand results in."""

from collections.abc import Mapping, Sequence
from typing import Any

TEXT = """# {name}

{title}.

Everything is in SI units: metres, seconds, kilograms, newtons, pascals. `scene.json` holds all numbers of this page and
more, each with a description; {version_words}.

## Files

| file | content |
|---|---|
{meshes}{cut_files}
| surface.vtu | the outer surface: triangles, turned outward, with the first nodes of straight.vtu |
| paths.csv | displacement [m] of every obstacle and held region{lumen_column} over time [s] |
| scene.json | material, loads, checkpoints, what is judged |
| solve.py | a program to start from: reads the above, and hands in a body that does not move |

Point data of the meshes is 1 or 0: {point_data}.

## The scene

- **Material.** mu = {mu:g} Pa, kappa = {kappa:g} Pa, density {rho:g} kg/m3. {material}
- **Start.** {start}
- **Gravity** {gravity} m/s2. **Damping** {damping:g} 1/s: {damping_words}
{loads}
- **Lumen.** {lumen}{cut}
- **Time.** {duration:g} s; positions are judged at {checkpoints} s.
- **Force.** {force}

## What is judged

| metric | unit | definition | |
|---|---|---|---|
{metrics}

Errors of displacement and force are against a finite-element reference whose uncertainty is known. The *last
checkpoint* is t = {last:g} s.
{yardsticks}

## Handing results in

Positions [m] of **all nodes of one of the meshes, in the order of its file**. Whatever mesh or method computed them
will do: interpolate to these nodes. Steps: t = 0 with the rest positions, every checkpoint, and any others; volume,
smallest J and penetration are taken over all steps that are handed in. Store 64-bit floats.

| file | what must be in it |
|---|---|
| NAME.npz | `t` (F), `positions` (F, n, 3); where asked `force` (F), `pressure` (F), `lumen_pressure` (F) |
| NAME.csv | columns t, node, x, y, z: a row for each node and step |
| NAME.vtkhdf | an unstructured grid that moves in steps, or stands still with the point data `displacement` |
| NAME.pvd | VTU files with their times (`timestep`), points or `displacement` as above |
| a folder | VTU files in order of their names: rest and every checkpoint, nothing else |

    python solve.py
    organbench judge {name} mine.npz --nodes {nodes} --name mine     accepted as "the body did not move"
    organbench judge {name} FILE --nodes {nodes} --name NAME --force FORCE.csv --seconds S

FORCE.csv has the columns t and force [N]. S is the computing time [s] for one simulated second, on one core where you
can. `pressure` is positive in compression.
"""


def readme(scene: Mapping[str, Any], nodes: int, rows: Sequence[Sequence[str]] = ()) -> str:
    """The text for what `description` gives; nodes: vertices on the outer surface; rows: as `export` takes them."""
    return TEXT.format(
        name=scene["name"],
        title=scene["title"],
        version_words=f'its layout is "{scene["schema"]}" {scene["version"]}',
        meshes="\n".join(_mesh_rows(scene)),
        cut_files="".join(f"\n| {row}" for row in _cut_rows(scene)),
        lumen_column=", and the factor of the lumen's volume," if scene["lumen"] else "",
        point_data=", ".join(f"`{name}`" for name in _point_data(scene)),
        mu=scene["material"]["shear_modulus"],
        kappa=scene["material"]["bulk_modulus"],
        rho=scene["material"]["density"],
        material=scene["material"]["words"],
        start=scene["start"]["words"],
        gravity=tuple(scene["gravity"]),
        damping=scene["damping"]["rate"],
        damping_words=scene["damping"]["words"],
        loads="\n".join(_loads(scene)),
        lumen=scene["lumen"]["words"] if scene["lumen"] else "None: the organ is solid.",
        cut=f"\n- **Cut.** {scene['cut']['words']}" if scene["cut"] else "",
        duration=scene["duration"],
        checkpoints=", ".join(f"{t:g}" for t in scene["checkpoints"]),
        force=scene["force"]["words"],
        metrics="\n".join(_metric_rows(scene)),
        last=scene["checkpoints"][-1],
        nodes=nodes,
        yardsticks="\n".join(_yardsticks(rows)),
    )


def _yardsticks(rows: Sequence[Sequence[str]]) -> list[str]:
    if not rows:
        return ["", "No measured body of ours was at hand for this scene."]
    head = ["", "What our own bodies reach at the last checkpoint:", "", "| body | force_end [%] | mean_error [%] |"]
    return [*head, "|---|---|---|", *(f"| {' | '.join(row)} |" for row in rows)]


def _mesh_rows(scene: Mapping[str, Any]) -> list[str]:
    rows = [
        f"| {mesh['file']} | {mesh['nodes']} nodes, {mesh['tetrahedra']} {mesh['cells']} |"
        for mesh in scene["meshes"].values()
    ]
    why = scene["why_no_curved_mesh"]
    return [*rows, f"| (no curved mesh) | {why} |"] if why else rows


def _cut_rows(scene: Mapping[str, Any]) -> list[str]:
    files = {kind: scene["cut"]["files"][kind] for kind in scene["meshes"]} if scene["cut"] else {}
    return [f"{file} | pairs of facets of the cut, by nodes of {kind}.vtu |" for kind, file in files.items()]


def _point_data(scene: Mapping[str, Any]) -> list[str]:
    return ["outer", *(["lumen"] if scene["lumen"] else []), *(held["point_data"] for held in scene["held"])]


def _loads(scene: Mapping[str, Any]) -> list[str]:
    rows = [f"- **Held region {h['name']}**: its nodes move together; it {h['path']['words']}." for h in scene["held"]]
    return rows + [f"- **Obstacle {number}.** {o['words']}" for number, o in enumerate(scene["obstacles"])]


def _metric_rows(scene: Mapping[str, Any]) -> list[str]:
    rows = [(m["name"], m["unit"], m["definition"].replace("|", "\\|"), m["better"]) for m in scene["judged"]]
    return [f"| {' | '.join(row)} |" for row in rows]
