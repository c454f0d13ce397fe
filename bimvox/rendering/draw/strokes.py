"""Antialiased lines in space; hidden parts are dotted and faint."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.rendering.draw.camera import Camera
from bimvox.rendering.scene.scene import Strokes
from bimvox.site.construction import Rgb

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
