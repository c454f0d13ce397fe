"""The units of length of input files, and times on the site's clock for people.

Inside bimvox, lengths are in metres and angles in radians, and names carry their unit
(``_m _rad _s _ns _vox _kg``).
"""

from __future__ import annotations

from bimvox.errors import InputError

METRES_PER_UNIT: dict[str, float] = {
    "m": 1.0,
    "dm": 0.1,
    "cm": 0.01,
    "mm": 0.001,
    "ft": 0.3048,
    "in": 0.0254,
}


def mass_text(mass_kg: float) -> str:
    """Return a mass for people: kilograms below a tonne, tonnes to the 10 kg above."""
    return f"{mass_kg:.0f} kg" if mass_kg < 999.5 else f"{round(mass_kg / 1000.0, 2):,.10g} t"


NS_PER_S = 1_000_000_000
"""Nanoseconds in a second."""

NS_PER_H = 3600 * NS_PER_S
"""Nanoseconds in an hour."""


def metres_per(unit: str) -> float:
    """Return the length of one ``unit`` in metres.

    Raises:
        InputError: If the unit is unknown.
    """
    try:
        return METRES_PER_UNIT[unit]
    except KeyError:
        known = ", ".join(METRES_PER_UNIT)
        raise InputError(f"unknown unit {unit!r}", hint=f"use one of {known}") from None


def elapsed(seconds: float) -> str:
    """Return an elapsed time: ``8 d 16 h``, less than a day as on the clock; ``-`` before it starts."""
    sign, whole_h = "-" if seconds < -0.5 else "", round(abs(seconds) / 3600.0)
    return f"{sign}{whole_h // 24} d {whole_h % 24} h" if abs(seconds) >= 86_400.0 else f"{sign}{clock(abs(seconds))}"


def clock(seconds: float) -> str:
    """Return a time on the site's clock in hours, minutes and seconds: ``5:56:19``."""
    whole = round(seconds)
    return f"{whole // 3600}:{whole // 60 % 60:02d}:{whole % 60:02d}"
