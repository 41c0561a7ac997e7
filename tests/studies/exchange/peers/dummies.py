"""Adapters of programs that are none: each ends in another way. `run` is chosen by the name of the module's file."""

import sys
import time

import numpy as np

from studies.exchange.peers.scene_folder import CannotDo, hand_in


def squeezed(scene, out):
    """Squeezes all positions with the planes, at a fifth of real time; the force grows with them."""
    scene.check_simple()
    factor = 1.0 - 0.1 * scene.times / scene.times[-1]
    positions = np.stack([scene.points * [1.0, 1.0, f] for f in factor])
    hand_in(out, scene.times, positions, 10.0 * scene.times, 5.0)


def unable(scene, out):
    raise CannotDo("it knows no frictionless planes")


def crashed(scene, out):
    print("some words", file=sys.stderr)
    raise ZeroDivisionError("in its solver")


def hung(scene, out):
    time.sleep(60.0)


def shifted(scene, out):
    hand_in(out, scene.times, np.stack([scene.points + 1.0] * len(scene.times)), scene.times, 1.0)
