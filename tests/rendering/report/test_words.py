from __future__ import annotations

import pytest

from bimvox.rendering.report.words import tonnes


@pytest.mark.parametrize(
    ("kg", "words"),
    [
        (8.0, "0.008"),
        (999.4, "0.999"),
        (999.9, "1.00"),
        (2413.0, "2.41"),
        (99_994.0, "99.99"),
        (99_999.0, "100.0"),
        (380_617.0, "380.6"),
        (1_234_567.0, "1,234.6"),
    ],
)
def test_masses_have_sensible_digits(kg, words):
    assert tonnes(kg) == words
