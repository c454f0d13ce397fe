"""The colours of the log's scene, from the table in ``bimvox.site.construction``, as viewers need them."""

from __future__ import annotations

from bimvox.site.construction import KIND_RGB, STATE_RGB, ConstructionState, Rgb

__all__ = ["KIND_RGBA", "STATE_RGBA", "ConstructionState", "Rgba"]

Rgba = tuple[float, float, float, float]


def _opaque(rgb: Rgb) -> Rgba:
    red, green, blue = (round(value / 255.0, 4) for value in rgb)
    return (red, green, blue, 1.0)


STATE_RGBA: dict[ConstructionState, Rgba] = {state: _opaque(rgb) for state, rgb in STATE_RGB.items()}
KIND_RGBA: dict[str, Rgba] = {kind: _opaque(rgb) for kind, rgb in KIND_RGB.items()}
