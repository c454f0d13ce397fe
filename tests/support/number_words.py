"""Numbers in words, as the page is to write them: a second time, from the exact values."""

from __future__ import annotations

import math
import re
from datetime import datetime
from decimal import ROUND_HALF_UP, Decimal
from typing import Any


def fixed(value: float, digits: int) -> str:
    """A number with so many digits; halves of what is written go away from zero, and nothing is a negative zero."""
    exact = Decimal(repr(float(value))).quantize(Decimal(1).scaleb(-digits), ROUND_HALF_UP)
    return f"{exact if exact else abs(exact):,}"


def near(seconds: float) -> int:
    return math.floor(seconds + 0.5)


def clock(seconds: float) -> str:
    whole = near(max(0.0, seconds))
    return f"{whole // 3600}:{whole // 60 % 60:02d}:{whole % 60:02d}"


def short_clock(seconds: float) -> str:
    return re.sub(r"^0:0?", "", clock(seconds))


def span(seconds: float) -> str:
    if seconds < 60:
        return f"{fixed(seconds, 1)} s"
    whole, minutes = near(seconds), near(seconds / 60)
    return f"{whole // 60} min {whole % 60} s" if whole < 3600 else f"{minutes // 60} h {minutes % 60} min"


def tonnes(kg: float) -> str:
    return f"{fixed(kg, 0)} kg" if kg < 1000 else f"{fixed(kg / 1000, 2)} t"


def percent(share: float | None) -> str:
    return "–" if share is None else f"{fixed(share * 100, 0)} %"


def metres(value: float) -> str:
    return f"{fixed(value, 2)} m"


def point(at: Any) -> str:
    """A place; micrometres are noise of sines and cosines, which would decide about halves."""
    return ", ".join(f"{axis} {fixed(round(value, 6), 2)}" for axis, value in zip("xyz", at, strict=True)) + " m"


def counted(count: int, noun: str) -> str:
    return f"{count:,} {noun}{'' if count == 1 else 's'}"


def sentence(text: str) -> str:
    return text[:1].upper() + text[1:]


def date(iso: str) -> str:
    at = datetime.fromisoformat(iso)
    return f"{at:%a} {at.day} {at:%b %Y %H:%M}"
