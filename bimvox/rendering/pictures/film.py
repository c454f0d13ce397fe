"""Animations as GIF, which opens everywhere, and WebP, which is smaller and has all colours. Deterministic."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import BinaryIO, Literal

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from bimvox.compiled import kernel
from bimvox.errors import InputError
from bimvox.records.motion import LiftMotion, PhaseName
from bimvox.records.track import LoadTrack
from bimvox.rendering.colours import INK, PAPER
from bimvox.rendering.pictures.camera import FILM_PX, Camera, View
from bimvox.rendering.pictures.film_scene import Film
from bimvox.rendering.pictures.picture import PictureOptions, camera_of, picture_of
from bimvox.rendering.pictures.scene import Layer, without

FilmFormat = Literal["gif", "webp"]

_HOLD_S = 1.5
"""Additional time of the last frame before the film restarts."""
_COLOURS = 144
"""GIF: number of colours taken from the frames, in addition to the exact ones of legend and background."""
_CLEAR = 255
"""GIF: index of a pixel that does not change."""
_SAMPLED_FRAMES = 6
_WEBP_QUALITY = 78


@dataclass(frozen=True, slots=True)
class FilmOptions:
    """Options of an animation.

    Attributes:
        size_px: Width and height.
        view: The direction of view; the camera does not move.
        fps: Frames a second; GIF counts in hundredths of a second, so 10, 20, 25 and 50 are exact.
        samples: Samples per pixel in each direction.
        hidden: Layers that are left out.
    """

    size_px: tuple[int, int] = FILM_PX
    view: View = field(default_factory=View)
    fps: float = 10.0
    samples: int = 2
    hidden: frozenset[Layer] = frozenset()

    def __post_init__(self) -> None:
        if not 0.1 <= self.fps <= 50.0:
            raise InputError(f"{self.fps:g} frames a second cannot be shown", hint="give 0.1 to 50")
        _ = self.picture

    @property
    def picture(self) -> PictureOptions:
        """Options of one frame."""
        return PictureOptions(self.size_px, self.view, self.samples, annotated=Layer.WORDS not in self.hidden)

    @property
    def frame_ms(self) -> int:
        """Duration of a frame."""
        return max(20, round(100.0 / self.fps) * 10)


def write_film(
    stream: BinaryIO,
    film: Film,
    times_ns: Sequence[int],
    options: FilmOptions,
    file_format: FilmFormat,
    told: Callable[[str, int, int], None] | None = None,
) -> None:
    """Write an animation with at least two frames, at ascending times.

    ``told`` is called as ``(stage, done, total)`` for every frame.
    """
    camera = camera_of(without(film.whole(times_ns), options.hidden), options.picture)
    frames = _frames(film, times_ns, options, camera, told)
    durations = [options.frame_ms] * (len(times_ns) - 1) + [options.frame_ms + round(1000 * _HOLD_S)]
    if file_format == "gif":
        images = _paletted(frames, _palette(film, times_ns, options, camera))
        settings = {"disposal": 1, "optimize": False, "transparency": _CLEAR}
    else:
        images = (Image.fromarray(pixels) for pixels in frames)
        settings = {"quality": _WEBP_QUALITY, "method": 3}
    first = next(images)
    first.save(stream, file_format, save_all=True, append_images=images, duration=durations, loop=0, **settings)


def _frames(
    film: Film,
    times_ns: Sequence[int],
    options: FilmOptions,
    camera: Camera,
    told: Callable[[str, int, int], None] | None,
) -> Iterator[NDArray[np.uint8]]:
    for n, time_ns in enumerate(times_ns):
        if told is not None:
            told("draw", n, len(times_ns))
        yield picture_of(without(film.scene(time_ns), options.hidden), options.picture, camera)
    if told is not None:
        told("draw", len(times_ns), len(times_ns))


def _palette(film: Film, times_ns: Sequence[int], options: FilmOptions, camera: Camera) -> NDArray[np.uint8]:
    """Return (N, 3) colours for all frames, taken from a few of them; a palette per frame would flicker."""
    chosen = [times_ns[n] for n in np.unique(np.linspace(0, len(times_ns) - 1, _SAMPLED_FRAMES).round().astype(int))]
    small = replace(options, samples=1)
    shown = [picture_of(without(film.scene(at), options.hidden), small.picture, camera) for at in chosen]
    found = Image.fromarray(np.concatenate(shown)).quantize(
        _COLOURS, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE
    )
    exact = [PAPER, INK, *(entry.rgb for entry in film.scene(times_ns[0]).legend)]
    colours = [*(found.getpalette() or [])[: 3 * _COLOURS], *(value for rgb in dict.fromkeys(exact) for value in rgb)]
    return np.array(colours, np.uint8).reshape(-1, 3)


def _paletted(frames: Iterator[NDArray[np.uint8]], palette: NDArray[np.uint8]) -> Iterator[Image.Image]:
    """Yield frames in the palette's colours; unchanged pixels are transparent, which compresses best."""
    # Unused palette entries repeat a colour; the last index is the transparent one.
    whole = np.concatenate([palette, np.repeat(palette[:1], 256 - len(palette), axis=0)])
    before: NDArray[np.uint8] | None = None
    for pixels in frames:
        index = _nearest(pixels, palette)
        shown = index if before is None else np.where(index == before, np.uint8(_CLEAR), index)
        before = index
        image = Image.fromarray(np.ascontiguousarray(shown, np.uint8), mode="P")
        image.putpalette(whole.tobytes())
        image.info["transparency"] = _CLEAR
        yield image


@kernel
def _nearest(pixels: NDArray[np.uint8], palette: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the nearest colour of each pixel: (H, W, 3) and (N, 3) with N up to 255 -> (H, W) uint8.

    Exact; Pillow's own search merges neighbouring colours.
    """
    rows, columns = pixels.shape[0], pixels.shape[1]
    index = np.zeros((rows, columns), np.uint8)
    for row in range(rows):
        for column in range(columns):
            red, green, blue = pixels[row, column, 0], pixels[row, column, 1], pixels[row, column, 2]
            # Most pixels equal the one before them.
            if column and (
                pixels[row, column - 1, 0] == red
                and pixels[row, column - 1, 1] == green
                and pixels[row, column - 1, 2] == blue
            ):
                index[row, column] = index[row, column - 1]
                continue
            best, least = 0, np.int64(1 << 30)
            for n in range(len(palette)):
                a = np.int64(palette[n, 0]) - np.int64(red)
                b = np.int64(palette[n, 1]) - np.int64(green)
                c = np.int64(palette[n, 2]) - np.int64(blue)
                distance = a * a + b * b + c * c
                if distance < least:
                    best, least = n, distance
            index[row, column] = best
    return index


# The pace of an animation: times on the site's clock, denser while something moves.
#
# Slinging takes minutes and motion seconds, so a film at a constant pace would mostly show a crane at rest. Time while
# the hook rests passes ``STANDING`` times as fast; the clock in the picture shows the true time.

STANDING = 20.0
_STILL = frozenset((PhaseName.HOOK_ON, PhaseName.SET, PhaseName.RELEASE))
_MOST_FRAMES = 5000


def frame_times_ns(tracks: Sequence[LoadTrack], motions: Sequence[LiftMotion], frames: int) -> list[int]:
    """Return the times of an animation's frames, ascending, from the first lift's start to the last lift's end.

    The tracks are those of the lifts to show, in ascending order. Without motions (no crane), the pace is constant.

    Raises:
        InputError: If there are fewer than 2 or too many frames, or no lifts.
    """
    if not tracks:
        raise InputError("no lift of the plan has a time", hint="a picture (.png) shows the plan without times")
    if not 2 <= frames <= _MOST_FRAMES:
        raise InputError(
            f"an animation of {frames} frames cannot be made",
            hint=f"seconds times frames a second must be from 2 to {_MOST_FRAMES}",
        )
    by_order = {motion.order: motion for motion in motions}
    at_ns, weights = [tracks[0].start_ns], [0.0]
    for track in tracks:
        motion = by_order.get(track.lift.order)
        spans = [(track.start_ns, track.end_ns, False)]
        if motion is not None and motion.phases:
            spans = [(phase.start_ns, phase.end_ns, phase.name in _STILL) for phase in motion.phases]
        for start_ns, end_ns, still in spans:
            # A gap before it (lifts that are not shown) is skipped.
            if start_ns > at_ns[-1]:
                at_ns.append(start_ns)
                weights.append(weights[-1])
            at_ns.append(end_ns)
            weights.append(weights[-1] + (end_ns - start_ns) / (STANDING if still else 1.0))
    wanted = np.linspace(0.0, weights[-1], frames)
    times = np.interp(wanted, weights, np.array(at_ns, np.float64))
    return [int(time) for time in np.rint(times)]


def default_seconds(lifts: int) -> float:
    """Return the default length of an animation of this many lifts, seconds."""
    return 8.0 if lifts == 1 else float(min(24.0, max(6.0, 0.2 * lifts)))
