"""How wrong a mass may be, by where it comes from."""

from __future__ import annotations

ASSUMED = 0.25
"""From this share on, a mass is an assumption."""
_BY_SOURCE = {"quantity": 0.03, "density": 0.1, "default": ASSUMED}
_GUESSED_VOLUME = 0.4


def mass_uncertainty(source: str, volume_guessed: bool) -> float:
    """Return the share by which a mass may be wrong (professional judgement).

    Args:
        source: Where the mass comes from: ``quantity``, ``density`` or ``default``; empty if that is not known.
        volume_guessed: Whether the volume is guessed, because the mesh is open.
    """
    if volume_guessed and source != "quantity":
        return _GUESSED_VOLUME
    return _BY_SOURCE.get(source, ASSUMED)
