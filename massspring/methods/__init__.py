"""The methods. Adding one: write its class in a file, add a line to METHODS; the contract test does the rest."""

from massspring.methods.barycentre import Barycentre
from massspring.methods.element import Element
from massspring.methods.elements.explicit_elements import ExplicitElements
from massspring.methods.elements.implicit_elements import ImplicitElements
from massspring.methods.elements.xpbd_neo_hookean import XpbdNeoHookean
from massspring.methods.free import Free
from massspring.methods.implicit_springs import ImplicitSprings
from massspring.methods.implicit_volume import ImplicitVolume
from massspring.methods.literature.angular_springs import AngularSprings
from massspring.methods.literature.chain_mail import ChainMail
from massspring.methods.literature.elastic_response import ElasticResponse
from massspring.methods.literature.linear_modes import LinearModes
from massspring.methods.method import Method
from massspring.methods.one_volume import Baumgarte, PostStabilization, Projection, Shake
from massspring.methods.pressures import Penalty, Pressure, Pyramid
from massspring.methods.semi_implicit import SemiImplicit
from massspring.methods.xpbd import Xpbd

METHODS: tuple[type[Method], ...] = (
    Free,
    ImplicitVolume,
    Shake,
    Projection,
    PostStabilization,
    Baumgarte,
    Penalty,
    Pressure,
    Pyramid,
    Barycentre,
    Element,
    Xpbd,
    ImplicitSprings,
    SemiImplicit,
    ExplicitElements,
    ImplicitElements,
    XpbdNeoHookean,
)

LITERATURE: tuple[type[Method], ...] = (AngularSprings, ChainMail, LinearModes, ElasticResponse)
"""Alternatives from the literature; they do not make the claims that the contract test measures for METHODS."""

VARIANTS: tuple[Method, ...] = (
    Element(hard=True),
    Xpbd(volumes="whole"),
    ImplicitVolume(recovers=True),
    ExplicitElements(law="corotated"),
    ImplicitElements(law="corotated"),
)
"""Settings with which a method solves, or may solve, other equations than by default; the contract test covers them
too."""
