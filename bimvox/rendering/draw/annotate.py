"""Text on the picture: title, caption and legend, in Pillow's built-in font."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from bimvox.rendering.colours import FAINT_INK, INK, PAPER
from bimvox.rendering.scene.scene import LegendEntry, Scene, Swatch

Font = ImageFont.FreeTypeFont | ImageFont.ImageFont

_LEAST_TEXT_PX = 11
_FADE = 0.85


def frame_for(scene: Scene, size_px: tuple[int, int]) -> tuple[float, float, float, float]:
    """Return the frame ``x0 y0 x1 y1`` that title, caption and legend leave for the picture."""
    width, height = size_px
    margin = _margin(size_px)
    top = margin * 0.5 + _heading_height(scene, size_px)
    rows = _legend_rows(scene.legend, size_px)
    bottom = height - margin - len(rows) * _row_height(size_px)
    # If the text would cover the picture, the picture goes below it.
    if bottom - top < 0.4 * height:
        return margin, margin, width - margin, height - margin
    return margin, top, width - margin, bottom - 0.3 * margin


def annotate(pixels: NDArray[np.uint8], scene: Scene) -> NDArray[np.uint8]:
    """Return the picture with the scene's title, caption and legend; the picture fades behind them."""
    size_px = (pixels.shape[1], pixels.shape[0])
    margin = _margin(size_px)
    legend_top = size_px[1] - 0.7 * margin - len(_legend_rows(scene.legend, size_px)) * _row_height(size_px)
    if scene.legend:
        pixels = _faded(pixels, round(legend_top - 0.3 * margin), size_px[1])
    if scene.title or scene.caption:
        # The end of a long jib, and the surroundings of a focus, also lie under the heading.
        pixels = _faded(pixels, 0, round(0.5 * margin + _heading_height(scene, size_px)))
    image = Image.fromarray(pixels)
    draw = ImageDraw.Draw(image)
    y = 0.8 * margin
    if scene.title:
        font = _font(_title_px(size_px))
        draw.text((margin, y), _shortened(scene.title, font, size_px[0] - 2 * margin), fill=INK, font=font)
        y += 1.35 * _title_px(size_px)
    if scene.caption:
        font = _font(_text_px(size_px))
        draw.text((margin, y), _shortened(scene.caption, font, size_px[0] - 2 * margin), fill=FAINT_INK, font=font)
    y = legend_top
    for row in _legend_rows(scene.legend, size_px):
        x = margin
        for entry in row:
            _draw_entry(draw, entry, x, y, size_px)
            x += _entry_width(entry, size_px)
        y += _row_height(size_px)
    return np.asarray(image)


def _faded(pixels: NDArray[np.uint8], first_row: int, end_row: int) -> NDArray[np.uint8]:
    """Return the picture with rows ``first_row`` to ``end_row`` faded, because a crane's jib may cross them."""
    faded = pixels.copy()
    rows = slice(max(0, first_row), max(0, end_row))
    band = pixels[rows].astype(np.float32)
    faded[rows] = (band + _FADE * (np.array(PAPER, np.float32) - band) + 0.5).astype(np.uint8)
    return faded


def _draw_entry(draw: ImageDraw.ImageDraw, entry: LegendEntry, x: float, y: float, size_px: tuple[int, int]) -> None:
    side = _text_px(size_px)
    x0, y0 = round(x), round(y + 0.12 * side)
    x1, y1 = x0 + side, y0 + side
    thin = max(1, round(side / 12))
    if entry.swatch is Swatch.FILL:
        draw.rectangle((x0, y0, x1, y1), fill=entry.rgb, outline=tuple(int(0.45 * c) for c in entry.rgb), width=1)
    elif entry.swatch is Swatch.BOX:
        draw.rectangle((x0, y0, x1, y1), outline=entry.rgb, width=2 * thin)
    else:
        middle = (y0 + y1) // 2
        draw.line((x0, middle, x1, middle), fill=entry.rgb, width=3 * thin)
    draw.text((x1 + 0.45 * side, y), entry.label, fill=INK, font=_font(side))


def _legend_rows(legend: Sequence[LegendEntry], size_px: tuple[int, int]) -> list[list[LegendEntry]]:
    room = size_px[0] - 2 * _margin(size_px)
    rows: list[list[LegendEntry]] = []
    used = 0.0
    for entry in legend:
        width = _entry_width(entry, size_px)
        if not rows or used + width > room:
            rows.append([])
            used = 0.0
        rows[-1].append(entry)
        used += width
    return rows


def _entry_width(entry: LegendEntry, size_px: tuple[int, int]) -> float:
    side = _text_px(size_px)
    return side * 2.7 + float(_font(side).getlength(entry.label))


def _heading_height(scene: Scene, size_px: tuple[int, int]) -> float:
    title = 1.35 * _title_px(size_px) if scene.title else 0.0
    caption = 1.4 * _text_px(size_px) if scene.caption else 0.0
    return title + caption + (0.8 * _margin(size_px) if scene.title or scene.caption else 0.0)


def _shortened(text: str, font: Font, room_px: float) -> str:
    if font.getlength(text) <= room_px:
        return text
    while text and font.getlength(text + "...") > room_px:
        text = text[:-1]
    return text + "..."


def _margin(size_px: tuple[int, int]) -> float:
    return max(4.0, 0.03 * min(size_px))


def _row_height(size_px: tuple[int, int]) -> float:
    return 1.6 * _text_px(size_px)


def _text_px(size_px: tuple[int, int]) -> int:
    return max(_LEAST_TEXT_PX, round(0.0215 * size_px[1]))


def _title_px(size_px: tuple[int, int]) -> int:
    return max(_LEAST_TEXT_PX + 1, round(0.036 * size_px[1]))


def _font(size: int) -> Font:
    return ImageFont.load_default(size)
