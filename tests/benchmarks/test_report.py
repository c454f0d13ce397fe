"""The tables and the bars."""

from __future__ import annotations

import json

import pytest

from benchmarks.voxelize.bars import check
from benchmarks.voxelize.report import as_json, as_markdown
from benchmarks.voxelize.result import CaseResult, Row
from benchmarks.voxelize.score import Score
from benchmarks.voxelize.tool import OURS, TOOLS


def case(name: str, *rows: Row, dense: bool = False) -> CaseResult:
    return CaseResult(
        name=name,
        voxel_size_m=0.1,
        dense=dense,
        parts=3,
        triangles=36,
        cells=30_000_000,
        windows=2,
        judged_pairs=4,
        judged_cells=1000,
        undecided_cells=0,
        rows=rows,
    )


def ours(seconds: float, *, missed: int = 0, solid: int = 40_000_000, memory_mb: float = 50.0) -> Row:
    return Row(
        OURS,
        "0.1.0",
        cpu_s=(seconds, 9.0, 0.001),
        wall_s=(seconds,) * 3,
        memory_mb=memory_mb,
        solid_cells=solid,
        score=Score(400, missed, 0),
    )


def peer(key: str, seconds: float) -> Row:
    return Row(TOOLS[key], "9", cpu_s=(seconds,), wall_s=(seconds,), memory_mb=3.0, score=Score(200, 50, 3))


def test_a_row_holds_the_median_the_ratio_and_what_is_wrong():
    table = as_markdown([case("office, 0.1 m", ours(0.2), peer("open3d", 1.9))], [])
    assert "| tool | office, 0.1 m (30 M cells) |" in table
    assert "| bimvox 0.1.0 | 200 ms, 0/0 |" in table
    assert "| Open3D surface 9 | x9.5, 25/1.5 |" in table


def test_a_peer_that_fails_is_in_the_table_and_in_the_figures():
    failed = Row(TOOLS["open3d"], "", "open3d is not installed")
    cases = [case("office, 0.1 m", ours(0.2), failed)]
    table = as_markdown(cases, check(cases))
    assert "| Open3D surface | open3d is not installed |" in table
    assert "- **Not met**: office, 0.1 m: at least 10 times as fast as Open3D surface" in table
    tools = json.loads(as_json(cases, []))["cases"][0]["tools"]
    assert tools[1]["failure"] == "open3d is not installed"
    assert tools[0]["solid_cells_per_s"] == 200_000_000
    (bar,) = [bar for bar in check(cases) if "Open3D" in bar.what]
    assert not bar.passed


@pytest.mark.parametrize(("seconds", "passed"), [(2.1, True), (1.9, False)])
def test_ratios_are_held_to_the_bars(seconds, passed):
    bars = check([case("office, 0.1 m", ours(0.2), peer("open3d", seconds))])
    assert [bar.passed for bar in bars if "Open3D" in bar.what] == [passed]
    assert not [bar for bar in bars if "sparse-cubes" in bar.what]


def test_a_peer_that_was_stopped_is_at_least_as_slow_as_its_limit():
    stopped = Row(TOOLS["sparse-cubes"], "9", "over 60 s, stopped", timeout_s=60.0)
    (bar,) = [bar for bar in check([case("office, 0.1 m", ours(0.2), stopped)]) if "sparse-cubes" in bar.what]
    assert bar.passed and "more than 300 times" in bar.found


def test_dense_rate_large_grid_and_exactness_are_checked():
    met = check([case("blob", ours(0.2), dense=True), case("office, 0.05 m", ours(0.4))])
    assert [bar.passed for bar in met] == [True, True, True, True]
    unmet = check(
        [case("blob", ours(0.21, missed=1), dense=True), case("office, 0.05 m", ours(0.4, missed=1, memory_mb=900.0))]
    )
    assert [bar.passed for bar in unmet] == [False, False, False, False]
    assert not [bar for bar in check([case("toy", ours(0.2, solid=1000), dense=True)]) if "a second" in bar.what]
