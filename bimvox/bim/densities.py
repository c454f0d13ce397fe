"""Density by the name of a material, in the languages that models come in."""

from __future__ import annotations

import re

DEFAULT_DENSITY_KG_M3 = 2400.0
"""Of parts whose material is unknown: plain concrete, heavy enough to be on the safe side for most parts."""

_TABLE: tuple[tuple[str, float], ...] = (
    # First match wins: compounds before the words they contain ("Stahlbeton" is concrete, "Betonstahl" is steel).
    (r"betonst[aå][hl]l?|betonstaal|rebar|reinforcing|reinforcement|bewehrung|wapening", 7850.0),
    (r"porenbeton|gasbeton|cellenbeton|aerated|aircrete|ytong", 600.0),
    (r"lightweight concrete|leichtbeton", 1800.0),
    # EN 1991-1-1 Table A.1: normal weight concrete 24 kN/m3, and 1 kN/m3 more for its reinforcement.
    (r"concrete|beton|béton|betong|hormig[oó]n|calcestruzzo|concreto|precast|\bc\d\d[/_-]\d\d|\bb\d\d\b", 2500.0),
    (r"alumini?um|\balu", 2700.0),
    (
        r"steel|stahl|staal|acier|acero|acciaio|\bst[åa]l\b|stål|\bs ?(235|275|355|420|460)|\bfe ?\d{3}|metal|\biron",
        7850.0,
    ),
    (r"plaster|gypsum|gips|pl[âa]tre", 900.0),
    (r"insulation|d[äa]mm|isolati|wool|wolle|\bwol\b|\beps\b|\bxps\b|\bpir\b|\bpur\b|styro", 40.0),
    (
        r"timber|wood|holz|\bhout|\bbois\b|madera|legno|plywood|glulam|\bclt\b|\bgl ?\d\d|\bosb\b|\bkvh\b|spruce|oak",
        500.0,
    ),
    (r"brick|masonry|mauerwerk|ziegel|metselwerk|baksteen|ladrillo|brique|block|kalk[sz]and|\bcmu\b", 1800.0),
    (r"glass|glas\b|glazing|verre|vidrio|vetro", 2500.0),
    (r"stone|granit|marble|naturstein|natuursteen", 2700.0),
    (r"\bair\b|cavity|luft|spouw", 1.2),
)
_COMPILED = tuple((re.compile(pattern, re.IGNORECASE), density) for pattern, density in _TABLE)


def density_by_name(material: str) -> float | None:
    """Return the density that a material's name implies, kg/m3; None where it says nothing.

    >>> density_by_name("Concrete - Precast C35/45")
    2500.0
    """
    return next((density for pattern, density in _COMPILED if pattern.search(material)), None)
