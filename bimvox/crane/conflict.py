"""Conflicts of two cranes: too near within bounds of a span each, and over time (EN 17076: anti-collision).

A crane's track gives bounds of its axes for every span of the site's clock, including the braking distances. So two
cranes whose spans are apart stay apart even if one or both stop at any moment.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.crane.outline import CraneOutline

# Whether two cranes may come too near each other within the bounds of a span each (EN 17076: anti-collision).
#
# A span is not a point in time: everything that a part sweeps between the bounds counts. For two strips that turn about
# two axes, the least distance is found by halving the ranges of their angles; a half is discarded when no pose in it
# can be near. Nothing is sampled.

PARTS = ("jib", "counter-jib", "mast", "load", "rope")
SLEW_LOW, SLEW_HIGH, RADIUS_LOW, RADIUS_HIGH, LOWEST, HOOK_LOW, HOOK_HIGH, LOAD_HALF, ROPE_HALF = range(9)
"""Columns of a span: angles (rad), radii of the hook (m), lowest point of the load, heights of the hook, and radii of
the discs that contain the load and the rope on plan, including swing (m)."""
COLUMNS = 9

TOLERANCE_M = 0.05
"""Poses may count as too near if their distance is above the limit by no more than this."""


def numbers_of(outline: CraneOutline) -> NDArray[np.float64]:
    """Return the outline as an array for kernels."""
    return np.array([*outline.solids_m, float(outline.luffs)])


@kernel
def meet(
    outline_a: NDArray[np.float64],
    row_a: NDArray[np.float64],
    outline_b: NDArray[np.float64],
    row_b: NDArray[np.float64],
    separation_m: float,
) -> bool:
    """Return whether two cranes may come too near each other within the bounds of a row each; see ``numbers_of``."""
    parts_a, parts_b = np.empty((5, 5)), np.empty((5, 5))
    _parts_of(outline_a, row_a, parts_a)
    _parts_of(outline_b, row_b, parts_b)
    one = _pair_too_near(outline_a, row_a, parts_a, outline_b, row_b, parts_b, separation_m, TOLERANCE_M)[0]
    return bool(one >= 0)


@kernel
def clear_of_one(
    outline_a: NDArray[np.float64],
    rows_a: NDArray[np.float64],
    outline_b: NDArray[np.float64],
    rows_b: NDArray[np.float64],
    separation_m: float,
) -> NDArray[np.bool_]:
    """Return (N,) whether a crane in each of (N, 9) rows is clear of another one in at least one of (M, 9) rows."""
    clear = np.zeros(rows_a.shape[0], np.bool_)
    for i in range(rows_a.shape[0]):
        for j in range(rows_b.shape[0]):
            if not meet(outline_a, rows_a[i], outline_b, rows_b[j], separation_m):
                clear[i] = True
                break
    return clear


@kernel
def each_clear(
    outline_a: NDArray[np.float64],
    rows_a: NDArray[np.float64],
    outline_b: NDArray[np.float64],
    rows_b: NDArray[np.float64],
    separation_m: float,
) -> NDArray[np.bool_]:
    """Return (N,) whether two cranes are clear of each other in each of (N, 9) pairs of rows."""
    clear = np.zeros(rows_a.shape[0], np.bool_)
    for i in range(rows_a.shape[0]):
        clear[i] = not meet(outline_a, rows_a[i], outline_b, rows_b[i], separation_m)
    return clear


@kernel
def _parts_of(outline: NDArray[np.float64], row: NDArray[np.float64], parts: NDArray[np.float64]) -> None:
    """Write the five parts in one span: inner and outer radius, half width, lowest, highest."""
    luffs = outline[14] > 0.0
    end = min(outline[2], row[RADIUS_HIGH]) if luffs else outline[2]
    parts[0] = 0.0, end, outline[3], outline[4], outline[5]
    parts[1] = -outline[6], 0.0, outline[7], outline[8], outline[9]
    parts[2] = 0.0, 0.0, outline[10], outline[11], outline[12]
    parts[3] = row[RADIUS_LOW], row[RADIUS_HIGH], row[LOAD_HALF], row[LOWEST], row[HOOK_HIGH]
    parts[4] = row[RADIUS_LOW], row[RADIUS_HIGH], row[ROPE_HALF], row[HOOK_LOW], outline[13]


@kernel
def _pair_too_near(
    outline_a: NDArray[np.float64],
    row_a: NDArray[np.float64],
    parts_a: NDArray[np.float64],
    outline_b: NDArray[np.float64],
    row_b: NDArray[np.float64],
    parts_b: NDArray[np.float64],
    separation_m: float,
    tolerance_m: float,
) -> tuple[int, int, float, float]:
    """Return the first pair of parts that is too near in a pair of spans, its distance and the required distance."""
    dx, dy = outline_b[0] - outline_a[0], outline_b[1] - outline_a[1]
    apart = np.sqrt(dx * dx + dy * dy)
    for one in range(5):
        for other in range(5):
            if (one == 2 and other > 1) or (other == 2 and one > 1):
                continue  # masts do not move; the collision rule keeps loads and ropes away from them
            if (
                parts_a[one, 3] - parts_b[other, 4] >= separation_m
                or parts_b[other, 3] - parts_a[one, 4] >= separation_m
            ):
                continue
            needed = separation_m + parts_a[one, 2] + parts_b[other, 2]
            reach_a = max(abs(parts_a[one, 0]), abs(parts_a[one, 1]))
            reach_b = max(abs(parts_b[other, 0]), abs(parts_b[other, 1]))
            if apart - reach_a - reach_b >= needed:
                continue
            distance = _nearest(row_a, parts_a[one], row_b, parts_b[other], dx, dy, needed, tolerance_m)
            if distance < needed:
                return one, other, max(0.0, distance - parts_a[one, 2] - parts_b[other, 2]), separation_m
    return -1, -1, 0.0, 0.0


@kernel
def _nearest(
    row_a: NDArray[np.float64],
    part_a: NDArray[np.float64],
    row_b: NDArray[np.float64],
    part_b: NDArray[np.float64],
    dx: float,
    dy: float,
    needed: float,
    tolerance: float,
) -> float:
    """Return a distance of two turning strips below ``needed``; infinite if they never get so near.

    Branch and bound over the rectangle of both angles: no point moves further from the middle pose than its radius
    times half the range.
    """
    reach_a = max(abs(part_a[0]), abs(part_a[1]))
    reach_b = max(abs(part_b[0]), abs(part_b[1]))
    stack = np.empty((128, 4))
    stack[0] = row_a[SLEW_LOW], row_a[SLEW_HIGH], row_b[SLEW_LOW], row_b[SLEW_HIGH]
    count = 1
    while count > 0:
        count -= 1
        low_a, high_a, low_b, high_b = stack[count]
        mid_a, mid_b = 0.5 * (low_a + high_a), 0.5 * (low_b + high_b)
        ca, sa, cb, sb = np.cos(mid_a), np.sin(mid_a), np.cos(mid_b), np.sin(mid_b)
        distance = _segments_apart(
            part_a[0] * ca,
            part_a[0] * sa,
            part_a[1] * ca,
            part_a[1] * sa,
            dx + part_b[0] * cb,
            dy + part_b[0] * sb,
            dx + part_b[1] * cb,
            dy + part_b[1] * sb,
        )
        if distance < needed:
            return distance
        sweep_a, sweep_b = 0.5 * reach_a * (high_a - low_a), 0.5 * reach_b * (high_b - low_b)
        if distance - sweep_a - sweep_b >= needed:
            continue
        if sweep_a + sweep_b < tolerance or count + 2 > 128:
            return needed - 1e-9
        if sweep_a >= sweep_b:
            stack[count] = low_a, mid_a, low_b, high_b
            stack[count + 1] = mid_a, high_a, low_b, high_b
        else:
            stack[count] = low_a, high_a, low_b, mid_b
            stack[count + 1] = low_a, high_a, mid_b, high_b
        count += 2
    return np.inf


@kernel
def _segments_apart(ax: float, ay: float, bx: float, by: float, cx: float, cy: float, dx: float, dy: float) -> float:
    """Return the distance of the segments a-b and c-d on plan."""
    ux, uy, vx, vy = bx - ax, by - ay, dx - cx, dy - cy
    cross = ux * vy - uy * vx
    if abs(cross) > 1e-12:
        s = ((cx - ax) * vy - (cy - ay) * vx) / cross
        t = ((cx - ax) * uy - (cy - ay) * ux) / cross
        if 0.0 <= s <= 1.0 and 0.0 <= t <= 1.0:
            return 0.0
    least = _point_apart(ax, ay, cx, cy, vx, vy)
    least = min(least, _point_apart(bx, by, cx, cy, vx, vy))
    least = min(least, _point_apart(cx, cy, ax, ay, ux, uy))
    least = min(least, _point_apart(dx, dy, ax, ay, ux, uy))
    return float(np.sqrt(least))


@kernel
def _point_apart(px: float, py: float, ax: float, ay: float, ux: float, uy: float) -> float:
    """Return the squared distance of a point from the segment that starts at a along u."""
    length = ux * ux + uy * uy
    along = 0.0 if length <= 0.0 else min(max(((px - ax) * ux + (py - ay) * uy) / length, 0.0), 1.0)
    x, y = px - ax - along * ux, py - ay - along * uy
    return x * x + y * y


SPAN_NS = 500_000_000
"""Length of a span of a track."""

_LOWS = (SLEW_LOW, RADIUS_LOW, LOWEST, HOOK_LOW)
_SIGNS = np.where(np.isin(np.arange(COLUMNS), _LOWS), -1.0, 1.0)
"""Times these, a span includes another one if no column is less."""


@dataclass(frozen=True, slots=True, eq=False)
class CraneTrack:
    """Bounds of a crane's position, span by span; before the first span it rests in ``first``, at the end in ``last``.

    Attributes:
        start_ns: Start of the first span, on the site's clock.
        spans: (N, 9) float64 bounds from ``start_ns + n * SPAN_NS`` for one span; see ``SLEW_LOW``.
        first: (9,) float64 position before the first span.
        last: (9,) float64 position after the last span.
    """

    start_ns: int
    spans: NDArray[np.float64]
    first: NDArray[np.float64]
    last: NDArray[np.float64]

    @property
    def end_ns(self) -> int:
        """End of the last span."""
        return self.start_ns + len(self.spans) * SPAN_NS

    def later(self, by_ns: int) -> CraneTrack:
        """Return the track shifted to a later time."""
        return replace(self, start_ns=self.start_ns + by_ns)


@dataclass(frozen=True, slots=True)
class Conflict:
    """Two cranes that come too near each other.

    Attributes:
        time_ns: Start of the first such span, on the site's clock.
        parts: Part of the first and of the second crane (``PARTS``).
        distance_m: Their distance on plan.
        needed_m: The required distance.
    """

    time_ns: int
    parts: tuple[str, str]
    distance_m: float
    needed_m: float


def joined(tracks: Sequence[CraneTrack]) -> CraneTrack:
    """Return consecutive tracks of one crane as one track; between them the crane rests where the previous one ends."""
    start_ns = tracks[0].start_ns
    count = max(-(-(track.end_ns - start_ns) // SPAN_NS) for track in tracks)
    spans = np.full((count, COLUMNS), -np.inf)  # times the signs
    for n, track in enumerate(tracks):
        late_ns = track.start_ns - start_ns
        first, is_between = late_ns // SPAN_NS, late_ns % SPAN_NS > 0
        own = track.spans * _SIGNS
        _spread(spans, first, own)
        if is_between:
            _spread(spans, first + 1, own)
        until_ns = tracks[n + 1].start_ns if n + 1 < len(tracks) else start_ns + count * SPAN_NS
        idle = slice((track.end_ns - start_ns) // SPAN_NS, -(-(until_ns - start_ns) // SPAN_NS))
        rows = max(0, min(idle.stop, count) - idle.start)
        _spread(spans, idle.start, np.broadcast_to(track.last * _SIGNS, (rows, COLUMNS)))
    return CraneTrack(start_ns, spans * _SIGNS, tracks[0].first, tracks[-1].last)


def first_conflict(
    cranes: tuple[CraneOutline, CraneOutline],
    a: CraneTrack,
    b: CraneTrack,
    separation_m: float,
    *,
    from_ns: int | None = None,
) -> Conflict | None:
    """Return the first conflict of two cranes; None if there is none.

    Before and after its track, each crane rests at the track's first and last position.

    Args:
        cranes: Their outlines.
        a: Track of the first crane.
        b: Track of the second crane.
        separation_m: Distance that parts keep on plan if their heights differ by no more than this.
        from_ns: The search starts at this time; None: at the earlier start.
    """
    begin_ns = min(a.start_ns, b.start_ns) if from_ns is None else from_ns
    end_ns = max(a.end_ns, b.end_ns, begin_ns + 1)
    time_ns, one, other, distance_m, needed_m = _first_conflict(
        numbers_of(cranes[0]),
        numbers_of(cranes[1]),
        _rows_of(a),
        _rows_of(b),
        np.array([a.start_ns, b.start_ns, begin_ns, end_ns, SPAN_NS], np.int64),
        separation_m,
        TOLERANCE_M,
    )
    if one < 0:
        return None
    return Conflict(int(time_ns), (PARTS[one], PARTS[other]), float(distance_m), float(needed_m))


def first_start(
    cranes: tuple[CraneOutline, CraneOutline],
    a: CraneTrack,
    b: CraneTrack,
    separation_m: float,
    starts_ns: tuple[int, int, int],
    until_ns: int,
) -> int | None:
    """Return how much later a track must begin so that it has no conflict after its start; None if there is no time.

    Args:
        cranes: Their outlines.
        a: Track of the first crane.
        b: Track of the second crane.
        separation_m: As for ``first_conflict``.
        starts_ns: What ``a`` may be shifted by: the first time, the step, and the last time.
        until_ns: The search ends with the first conflict of a track that is shifted by more than this.
    """
    found = _first_start(
        numbers_of(cranes[0]),
        numbers_of(cranes[1]),
        _rows_of(a),
        _rows_of(b),
        np.array([a.start_ns, b.start_ns, *starts_ns, until_ns, SPAN_NS], np.int64),
        separation_m,
        TOLERANCE_M,
    )
    return None if found < 0 else int(found)


def _spread(spans: NDArray[np.float64], at: int, rows: NDArray[np.float64]) -> None:
    """Widen the spans from ``at`` on so that they include the rows, both times the signs."""
    own = spans[at : at + len(rows)]
    np.maximum(own, rows[: len(own)], out=own)


def _rows_of(track: CraneTrack) -> NDArray[np.float64]:
    """Return a track as an array for kernels: where the crane is before it, in each span, and after it."""
    return np.concatenate([track.first[None], track.spans, track.last[None]])


@kernel
def _first_conflict(
    outline_a: NDArray[np.float64],
    outline_b: NDArray[np.float64],
    rows_a: NDArray[np.float64],
    rows_b: NDArray[np.float64],
    clock: NDArray[np.int64],
    separation_m: float,
    tolerance_m: float,
) -> tuple[int, int, int, float, float]:
    """Return the first conflict over all pairs of spans that overlap in time."""
    start_a, start_b, begin, end, length = clock
    parts_a, parts_b = np.empty((5, 5)), np.empty((5, 5))
    last_a, last_b = -1, -1
    time = begin
    while True:
        # Row 0 is before the first span, the last row is after the last one. From the end on, both rest.
        at_a, at_b = rows_a.shape[0] - 1, rows_b.shape[0] - 1
        if time < end:
            at_a = min(max((time - start_a) // length + 1, 0), at_a)
            at_b = min(max((time - start_b) // length + 1, 0), at_b)
        moved_a = last_a < 0 or _differ(rows_a[at_a], rows_a[last_a])
        moved_b = last_b < 0 or _differ(rows_b[at_b], rows_b[last_b])
        last_a, last_b = at_a, at_b
        if moved_a:
            _parts_of(outline_a, rows_a[at_a], parts_a)
        if moved_b:
            _parts_of(outline_b, rows_b[at_b], parts_b)
        if moved_a or moved_b:
            one, other, distance, needed = _pair_too_near(
                outline_a, rows_a[at_a], parts_a, outline_b, rows_b[at_b], parts_b, separation_m, tolerance_m
            )
            if one >= 0:
                return time, one, other, distance, needed
        if time == end:
            return end, -1, -1, 0.0, 0.0
        next_a = start_a + at_a * length if at_a < rows_a.shape[0] - 1 else end
        next_b = start_b + at_b * length if at_b < rows_b.shape[0] - 1 else end
        time = min(max(next_a, time + 1), max(next_b, time + 1), end)


@kernel
def _differ(row: NDArray[np.float64], other: NDArray[np.float64]) -> bool:
    """Return whether two rows differ; those of a crane at rest do not."""
    count = 0
    for n in range(COLUMNS):
        count += row[n] != other[n]
    return count > 0


@kernel
def _first_start(
    outline_a: NDArray[np.float64],
    outline_b: NDArray[np.float64],
    rows_a: NDArray[np.float64],
    rows_b: NDArray[np.float64],
    clock: NDArray[np.int64],
    separation_m: float,
    tolerance_m: float,
) -> int:
    """Return the first shift of the first crane's rows without a conflict; -1 if there is none."""
    start_a, start_b, shift, step, latest, until, length = clock
    own, span = np.empty(5, np.int64), np.empty(5, np.int64)
    end_a, end_b = start_a + (rows_a.shape[0] - 2) * length, start_b + (rows_b.shape[0] - 2) * length
    met, free_from = np.int64(-1), shift
    while shift <= latest:
        begin = shift
        end = max(end_a + shift, end_b, begin + 1)
        own[:] = start_a + shift, start_b, begin, end, length
        one = -1
        if met >= 0:  # where it was in conflict with a shorter shift, it mostly still is
            span[:] = own[0], own[1], min(begin + met, end - 1), min(begin + met, end - 1) + 1, length
            one = _first_conflict(outline_a, outline_b, rows_a, rows_b, span, separation_m, tolerance_m)[1]
        if one < 0:
            time, one = _first_conflict(outline_a, outline_b, rows_a, rows_b, own, separation_m, tolerance_m)[:2]
            if one < 0:
                return int(shift)
            if met < 0:  # it must not come to rest before the other crane has left that place for the last time
                first = max((max(end_a, 0) + shift - start_b) // length + 1, 1)
                at = _last_met(outline_a, rows_a[-1], outline_b, rows_b, first, separation_m, tolerance_m)
                free_from = start_b + at * length - max(end_a, 0) if at > 0 else shift
            met = time - begin
        if shift > until:
            return -1
        shift += max(step, -((shift - free_from) // step) * step)
        if shift - step > until:
            return -1
    return -1


@kernel
def _last_met(
    outline_a: NDArray[np.float64],
    row_a: NDArray[np.float64],
    outline_b: NDArray[np.float64],
    rows_b: NDArray[np.float64],
    first: int,
    separation_m: float,
    tolerance_m: float,
) -> int:
    """Return the last row, from ``first`` on, in which the second crane meets the first one at rest; 0 if none."""
    parts_a, parts_b = np.empty((5, 5)), np.empty((5, 5))
    _parts_of(outline_a, row_a, parts_a)
    for at in range(rows_b.shape[0] - 2, first - 1, -1):
        if at == rows_b.shape[0] - 2 or _differ(rows_b[at], rows_b[at + 1]):
            _parts_of(outline_b, rows_b[at], parts_b)
            one = _pair_too_near(outline_a, row_a, parts_a, outline_b, rows_b[at], parts_b, separation_m, tolerance_m)[
                0
            ]
            if one >= 0:
                return at
    return 0
