"""The methods, each in its file. Adding one: write the file, add a line to METHODS; the contract test does the rest."""

from massspring.methods.base import Method, State, start
from massspring.methods.baumgarte import Baumgarte
from massspring.methods.free import Free
from massspring.methods.implicit_volume import ImplicitVolume
from massspring.methods.post_stabilization import PostStabilization
from massspring.methods.projection import Projection
from massspring.methods.shake import Shake

METHODS: tuple[type[Method], ...] = (Free, ImplicitVolume, Shake, Projection, PostStabilization, Baumgarte)

__all__ = [
    "METHODS",
    "Baumgarte",
    "Free",
    "ImplicitVolume",
    "Method",
    "PostStabilization",
    "Projection",
    "Shake",
    "State",
    "start",
]
