"""The bars for the voxelizer, checked on the measurements."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from benchmarks.voxelize.result import CaseResult

CELLS_PER_SECOND = 200e6
DENSE_CELLS = 10_000_000
"""Least number of solid cells for which a dense case shows the rate."""
RATIOS = (("open3d", 10.0), ("pyvista-parts", 50.0), ("sparse-cubes", 90.0))
RATIO_CASE = "office, 0.1 m"
LARGE_CASE = "office, 0.05 m"
LARGE_MB, LARGE_S = 200.0, 5.0


@dataclass(frozen=True, slots=True)
class Bar:
    """One bar.

    Attributes:
        what: The requirement.
        found: The measurement.
        passed: Whether it is met.
    """

    what: str
    found: str
    passed: bool


def check(cases: Sequence[CaseResult]) -> list[Bar]:
    """Return the bars that these cases can check."""
    return [*_rates(cases), *_ratios(cases), *_large(cases), *_exactness(cases)]


def _rates(cases: Sequence[CaseResult]) -> Iterator[Bar]:
    for case in cases:
        ours = case.row("bimvox")
        if not case.dense or ours is None or ours.median_s is None or ours.solid_cells is None:
            continue
        if ours.solid_cells >= DENSE_CELLS:
            rate = ours.solid_cells / ours.median_s
            what = f"{case.name}: at least {CELLS_PER_SECOND / 1e6:.0f} million labelled solid cells a second"
            yield Bar(what, f"{rate / 1e6:.0f} million", rate >= CELLS_PER_SECOND)


def _ratios(cases: Sequence[CaseResult]) -> Iterator[Bar]:
    for case in cases:
        if case.name != RATIO_CASE:
            continue
        for key, least in RATIOS:
            row, ratio = case.row(key), case.ratio(key)
            if row is None:
                continue
            what = f"{case.name}: at least {least:.0f} times as fast as {row.tool.title}"
            ours = case.row("bimvox")
            if ratio is not None:
                yield Bar(what, f"{ratio:.0f} times", ratio >= least)
            elif row.timeout_s is not None and ours is not None and ours.median_s is not None:
                ratio = row.timeout_s / ours.median_s
                yield Bar(what, f"more than {ratio:.0f} times (it was stopped)", ratio >= least)
            else:
                yield Bar(what, f"not measured: {row.failure}", passed=False)


def _large(cases: Sequence[CaseResult]) -> Iterator[Bar]:
    for case in cases:
        ours = case.row("bimvox")
        if case.name == LARGE_CASE and ours is not None and ours.median_s is not None:
            what = f"{case.name}: under {LARGE_MB:.0f} MB and {LARGE_S:.0f} s for {case.cells / 1e6:.0f} million cells"
            passed = ours.memory_mb < LARGE_MB and ours.median_s < LARGE_S
            yield Bar(what, f"{ours.memory_mb:.0f} MB, {ours.median_s:.2f} s", passed)


def _exactness(cases: Sequence[CaseResult]) -> Iterator[Bar]:
    for case in cases:
        ours = case.row("bimvox")
        if ours is not None and ours.score is not None:
            score = ours.score
            found = f"{score.missed:,} missed, {score.extra:,} extra of {score.filled:,} filled"
            yield Bar(f"{case.name}: no cell missed, none extra", found, score.missed == 0 and score.extra == 0)
