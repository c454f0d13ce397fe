"""Layers of a scene, which can be hidden."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from enum import StrEnum

import numpy as np

from bimvox.errors import SelectionError
from bimvox.rendering.scene.scene import Scene


class Layer(StrEnum):
    """A layer that a picture can leave out."""

    GROUND = "ground"
    """Ground and areas."""
    STRUCTURE = "structure"
    OBSTRUCTIONS = "obstructions"
    UNBUILT = "unbuilt"
    ASSEMBLED = "assembled"
    CRANE = "crane"
    PATHS = "paths"
    BOXES = "boxes"
    """Start and target boxes."""
    WORDS = "words"
    """Title, caption and legend."""


def without(scene: Scene, hidden: Collection[Layer]) -> Scene:
    """Return a scene without the solids, lines and legend entries of some layers; the camera stays the same.

    The picture's options handle ``WORDS``.
    """
    if not hidden:
        return scene
    drawn = np.array([layer not in hidden for layer in scene.layers] or [True] * len(scene.palette), np.bool_)
    numbers = np.arange(len(drawn)).astype(scene.solids.dtype)
    numbers[~drawn] = 0
    return replace(
        scene,
        solids=numbers[scene.solids],
        strokes=tuple(strokes for strokes in scene.strokes if strokes.layer not in hidden),
        blocks=() if Layer.CRANE in hidden else scene.blocks,
        legend=tuple(entry for entry in scene.legend if entry.layer not in hidden),
        points_m=np.zeros((0, 3)) if Layer.CRANE in hidden else scene.points_m,
    )


def layers_named(names: Collection[str]) -> frozenset[Layer]:
    """Return the layers of these names.

    Raises:
        SelectionError: If there is no such layer.
    """
    known = {layer.value: layer for layer in Layer}
    for name in names:
        if name not in known:
            raise SelectionError(f"there is no layer {name!r}", hint=f"layers are {', '.join(known)}")
    return frozenset(known[name] for name in names)
