"""The buildings of the scale benchmark, and its tables."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from benchmarks.scale.building import boxes, size_for, write_site
from benchmarks.scale.measure import Measured
from benchmarks.scale.report import Way, as_json, as_markdown, bars


def measured(components: int, seconds: float, memory_mb: float = 500.0, log_mb: float = 10.0) -> Measured:
    stages = {"open": 1.0, "lifts": seconds / 2, "prove": seconds / 2 - 1.0}
    return Measured(components, components, True, seconds, 0.9 * seconds, memory_mb, log_mb, stages)


def test_parts_do_not_run_into_each_other():
    for lines, storeys in ((2, 4), (6, 4), (7, 1)):
        parts = list(boxes(lines, storeys))
        assert len({name for _, name, _, _ in parts}) == len(parts)
        for n, (_, _, low, high) in enumerate(parts):
            for _, _, other_low, other_high in parts[n + 1 :]:
                overlap = [min(a, b) - max(c, d) for a, b, c, d in zip(high, other_high, low, other_low, strict=True)]
                assert min(overlap) <= 1e-9


@pytest.mark.slow
def test_the_site_of_500_is_200_by_200_by_60_cells_and_the_same_each_time(tmp_path: Path):
    from bimvox.library.site import load_site
    from bimvox.progress import SilentProgress

    folders = tmp_path / "a", tmp_path / "b"
    for folder in folders:
        folder.mkdir()
        site = write_site(folder, 500)
    for file in folders[0].iterdir():
        assert file.read_bytes() == (folders[1] / file.name).read_bytes()
    loaded = load_site(site, SilentProgress())
    assert loaded.site.shape == (200, 200, 60)
    assert len(loaded.site.components) == 500


def test_a_building_grows_in_plan_until_the_crane_reaches_no_further_and_then_upwards(tmp_path: Path):
    assert [size_for(n) for n in (50, 1084, 1085, 2000, 5000)] == [(3, 4), (6, 4), (7, 4), (7, 5), (7, 12)]
    assert len({name for _, name, _, _ in boxes(7, 12)}) == 5052
    site = write_site(tmp_path, 2000).read_text()
    assert "high_m = [74.0, 50.0, 33.5]" in site
    assert "jib_height_m = 38.0" in site


def test_a_building_that_does_not_fit_is_refused(tmp_path: Path):
    with pytest.raises(ValueError, match="no building of 6000 components"):
        write_site(tmp_path, 6000)


def test_bars_are_met_by_a_linear_cost_and_not_by_a_quadratic_one():
    linear = [measured(n, 5.0 + 0.04 * n) for n in (50, 100, 200, 500, 1000, 5000)]
    assert [bar.passed for bar in bars(linear)] == [True] * 6
    quadratic = [measured(n, 5.0 + 0.001 * n * n, 5000.0, 60.0) for n in (50, 100, 200, 500, 1000, 5000)]
    assert [bar.passed for bar in bars(quadratic)] == [False] * 6
    told = as_markdown([Way("one way", tuple(quadratic)), Way("another", tuple(linear))])
    assert told.index("## One way") < told.index("**not met**") < told.index("## Another")
    assert told.count("| 1,000 |") == 2
    assert [way["title"] for way in json.loads(as_json([Way("a", tuple(linear))]))["ways"]] == ["a"]
    assert len(bars(linear[:2])) == 0
