from __future__ import annotations

import pytest

from bimvox.records.proof import Remark, Severity, in_words


def remarks(serious: int = 0, minor: int = 0, notes: int = 0) -> list[Remark]:
    counts = {Severity.SERIOUS: serious, Severity.MINOR: minor, Severity.NOTE: notes}
    return [Remark("kind", severity, "text") for severity, count in counts.items() for _ in range(count)]


@pytest.mark.parametrize(
    ("counts", "words"),
    [
        ({}, "no remarks"),
        ({"minor": 1}, "1 remark"),
        ({"serious": 2, "minor": 4, "notes": 1}, "6 remarks (2 serious)"),
        ({"serious": 1}, "1 remark (1 serious)"),
        ({"minor": 1200}, "1,200 remarks"),
        ({"notes": 1}, "1 note"),
        ({"notes": 3}, "3 notes"),
    ],
)
def test_the_count_next_to_the_verdict(counts, words):
    assert in_words(remarks(**counts)) == words
