"""The methods, each in its file. Adding one: write the file, add a line to METHODS; the contract test does the rest."""

from massspring.methods.base import Method, State, start
from massspring.methods.free import Free
from massspring.methods.implicit_volume import ImplicitVolume

METHODS: tuple[type[Method], ...] = (Free, ImplicitVolume)

__all__ = ["METHODS", "Free", "ImplicitVolume", "Method", "State", "start"]
