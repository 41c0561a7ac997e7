"""Frames of the mass-spring bodies whose speed is promised: 20 steps each, a short run to a sample."""

from dataclasses import replace

from massspring import Free, ImplicitVolume, simulate
from studies.bench.slide import slide_setup
from studies.bench.solver import LARGE, probed_setup, squeezed_setup, volumes_setup

SETUPS = {
    "550 surface nodes": lambda: squeezed_setup(ImplicitVolume(), frames=20),
    "550 surface nodes, float32": lambda: replace(squeezed_setup(ImplicitVolume(), frames=20), precision="float32"),
    "550 surface nodes, free": lambda: squeezed_setup(Free(), frames=20),
    f"{LARGE} surface nodes": lambda: probed_setup(LARGE),
    f"{LARGE} surface nodes, float32": lambda: replace(probed_setup(LARGE), precision="float32"),
    f"{LARGE} surface nodes, two threads": lambda: replace(probed_setup(LARGE), threads=2),
    "128 volumes": lambda: volumes_setup(128),
    "one volume per node": lambda: volumes_setup(None),
    "thin probe, refined stomach": slide_setup,
}


class Steps:
    """Wall time of a run of a few frames; no `Setup` is imported, asv would call that to set up."""

    params = tuple(SETUPS)
    param_names = ("body",)
    timeout = 600.0
    warmup_time = 0.0

    def setup(self, body: str) -> None:
        """Builds the body and compiles what it needs."""
        self.run = SETUPS[body]()
        simulate(self.run)

    def time_run(self, body: str) -> None:
        """All frames."""
        simulate(self.run)
