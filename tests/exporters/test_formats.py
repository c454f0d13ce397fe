from __future__ import annotations

from pathlib import Path

import pytest

from bimvox.exporters.formats import FORMATS, Source, format_for, formats_in_words, formats_of


@pytest.mark.parametrize(
    ("source", "name", "out", "wanted"),
    [
        (Source.LOG, None, None, "mcap"),
        (Source.GRID, None, None, "vti"),
        (Source.LOG, "glb", None, "glb"),
        (Source.LOG, None, Path("plan.XML"), "msproject"),
        (Source.LOG, None, Path("plan.layout"), "mcap"),
        (Source.LOG, "csv", Path("plan.glb"), "csv"),
        (Source.GRID, None, Path("x.PLY"), "ply"),
        (Source.GRID, None, Path("x.csv"), "vti"),
    ],
)
def test_the_format_is_the_requested_one_otherwise_that_of_the_name(
    source: Source, name: str | None, out: Path | None, wanted: str
) -> None:
    found = format_for(source, name, out)
    assert found is not None
    assert (found.source, found.name) == (source, wanted)


def test_a_format_of_another_source_is_not_offered() -> None:
    assert format_for(Source.LOG, "vti", None) is None
    assert format_for(Source.GRID, "msproject", None) is None


def test_every_format_is_named_once_for_its_source_and_in_the_help() -> None:
    assert len({(one.source, one.name) for one in FORMATS}) == len(FORMATS)
    words = formats_in_words()
    assert all(f"{one.name} (" in words for source in Source for one in formats_of(source))
    assert words.startswith("Of a log: mcap (default; ")
