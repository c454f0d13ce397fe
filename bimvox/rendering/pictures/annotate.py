"""Text on the picture: title, caption and legend, in Pillow's built-in font."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from bimvox.compiled import kernel
from bimvox.rendering.colours import FAINT_INK, INK, PAPER
from bimvox.rendering.pictures.camera import Camera
from bimvox.rendering.pictures.scene import LegendEntry, Scene, Strokes, Swatch
from bimvox.site.component import Rgb

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


# Antialiased lines in space; hidden parts are dotted and faint.

_DOT_PX = 7.0
_EDGE_PX = 0.9


def draw_strokes(
    colour: NDArray[np.float32],
    depth_m: NDArray[np.float32],
    strokes: Strokes,
    camera: Camera,
    samples: int,
    bias_m: float,
) -> None:
    """Draw lines over a picture.

    Args:
        colour: (H, W, 3) float32 sRGB 0..1, changed in place.
        depth_m: (H, W) float32 depth buffer.
        strokes: The lines.
        camera: With the samples as its pixels.
        samples: Samples per pixel in each direction.
        bias_m: A line up to this far behind a surface still counts as in front of it.
    """
    if not len(strokes.segments_m):
        return
    scale = samples * max(0.6, camera.size_px[1] / samples / 800.0)
    ends = camera.project(strokes.segments_m)
    middle = strokes.segments_m.mean(axis=(0, 1))
    width = max(strokes.width_px * scale, strokes.width_m * camera.pixels_per_metre(middle))
    reach = width / 2.0 + _EDGE_PX * scale + 1.0
    height_px, width_px = depth_m.shape
    low = np.clip(np.floor(ends[..., :2].min(axis=(0, 1)) - reach), 0, (width_px, height_px)).astype(int)
    high = np.clip(np.ceil(ends[..., :2].max(axis=(0, 1)) + reach), 0, (width_px, height_px)).astype(int)
    if (high <= low).any():
        return
    lengths = np.linalg.norm(ends[:, 1, :2] - ends[:, 0, :2], axis=1)
    starts = np.r_[0.0, np.cumsum(lengths)[:-1]]
    window = (slice(low[1], high[1]), slice(low[0], high[0]))
    offset = np.array([low[0], low[1], 0.0])

    def stroke(radius_px: float, rgb: Rgb) -> None:
        seen = np.zeros((high[1] - low[1], high[0] - low[0]), np.float32)
        hidden = np.zeros_like(seen)
        _cover(ends - offset, starts, radius_px, _DOT_PX * scale, bias_m, depth_m[window], seen, hidden)
        # A visible segment covers the picture, even where another one is hidden.
        alpha = np.maximum(strokes.opacity * seen, strokes.hidden_opacity * hidden)[..., None]
        colour[window] += alpha * (np.array(rgb, np.float32) / np.float32(255.0) - colour[window])

    if strokes.edge is not None:
        stroke(width / 2.0 + _EDGE_PX * scale, strokes.edge)
    stroke(width / 2.0, strokes.rgb)


@kernel
def _cover(
    ends: NDArray[np.float64],
    starts: NDArray[np.float64],
    radius: float,
    dot: float,
    bias: float,
    depth: NDArray[np.float32],
    seen: NDArray[np.float32],
    hidden: NDArray[np.float32],
) -> None:
    """Compute how much of each sample the segments cover, visible and hidden."""
    rows, columns = depth.shape
    for n in range(len(ends)):
        ax, ay, az = ends[n, 0, 0], ends[n, 0, 1], ends[n, 0, 2]
        bx, by, bz = ends[n, 1, 0], ends[n, 1, 1], ends[n, 1, 2]
        ux, uy = bx - ax, by - ay
        square = ux * ux + uy * uy
        reach = radius + 1.0
        for row in range(max(0, int(min(ay, by) - reach)), min(rows, int(max(ay, by) + reach) + 1)):
            y = row + 0.5
            # Only the columns that the segment can reach in this row, not its whole bounding box.
            left, right = min(ax, bx) - reach, max(ax, bx) + reach
            if abs(uy) > 1e-9:
                slope = ux / uy
                slack = reach * np.sqrt(1.0 + slope * slope)
                middle = ax + (y - ay) * slope
                left, right = max(left, middle - slack), min(right, middle + slack)
            for column in range(max(0, int(left)), min(columns, int(right) + 1)):
                x = column + 0.5
                t = 0.0
                if square > 0.0:
                    t = min(1.0, max(0.0, ((x - ax) * ux + (y - ay) * uy) / square))
                distance = np.sqrt((x - ax - t * ux) ** 2 + (y - ay - t * uy) ** 2)
                cover = min(1.0, radius + 0.5 - distance)
                if cover <= 0.0:
                    continue
                at = 1.0 / ((1.0 - t) / az + t / bz)
                if at <= depth[row, column] + bias:
                    seen[row, column] = max(seen[row, column], cover)
                elif (starts[n] + t * np.sqrt(square)) % dot < 0.55 * dot:
                    hidden[row, column] = max(hidden[row, column], cover)
