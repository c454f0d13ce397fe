"""Inserting a benchmark's output between its markers in a page."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.document import put_into

DOCS = Path(__file__).parents[2] / "docs"


def test_text_goes_between_the_markers_and_nothing_else_changes(tmp_path: Path):
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- bench-x: begin -->\nold\n<!-- bench-x: end -->\nafter\n")
    put_into(page, "bench-x", "new\n")
    put_into(page, "bench-x", "new\n")
    assert page.read_text() == "before\n<!-- bench-x: begin -->\nnew\n<!-- bench-x: end -->\nafter\n"
    page.write_text("no markers")
    with pytest.raises(ValueError, match="lacks the markers"):
        put_into(page, "bench-x", "new\n")


@pytest.mark.parametrize(("page", "name"), [("voxelizing.md", "bench-voxelize"), ("scale.md", "bench-scale")])
def test_the_page_has_a_place_for_the_tables(page: str, name: str):
    text = (DOCS / page).read_text(encoding="utf-8")
    assert text.count(f"<!-- {name}: begin -->") == text.count(f"<!-- {name}: end -->") == 1
