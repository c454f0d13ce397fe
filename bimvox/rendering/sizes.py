"""Sizes of pictures and animations, and which suffixes are animations."""

from __future__ import annotations

from typing import Final, Literal

PICTURE_PX: Final = (1280, 800)
FILM_PX: Final = (640, 400)
FILMS: Final[dict[str, Literal["gif", "webp"]]] = {".gif": "gif", ".webp": "webp"}
"""The formats of animations, by suffix."""
