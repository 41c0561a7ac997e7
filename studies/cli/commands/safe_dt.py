"""`organbench safe-dt`: how long a step may be."""

from studies.cli.options import BodyKind, MethodName, SurfaceNodes, chosen_case
from studies.cli.terminal import SceneName, console
from studies.runs.safe_dt import safe_step


def safe_dt(
    scene: SceneName, method: MethodName = "implicit_volume", body: BodyKind = "tetrahedral", nodes: SurfaceNodes = 550
) -> None:
    """Predict the largest stable time step and verify it by runs just below and just above it."""
    step = safe_step(chosen_case(scene, method, body, nodes))
    limit = step.limit
    console.print(f"largest frequency  {limit.frequency:.4g} 1/s")
    whose = "stability limit" if step.conditionally_stable else "of explicit ones"
    console.print(f"{whose:<18} {1e3 * limit.damped:.4g} ms  (without damping {1e3 * limit.undamped:.4g} ms)")
    console.print(f"dt = auto          {1e3 * step.auto:.4g} ms  (margin {step.margin:.3g})")
    for dt, outcome in step.trials:
        console.print(f"run at             {1e3 * dt:.4g} ms  ({dt / limit.damped:.3g} of the limit): {outcome}")
    if step.bracket is not None:
        below, above = step.bracket
        console.print(f"bracket            stable at {1e3 * below:.4g} ms, diverges at {1e3 * above:.4g} ms")
    console.print(step.verdict)
