from __future__ import annotations

import pytest

from bimvox.rendering.report.words import length, tonnes


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


@pytest.mark.parametrize(
    ("metres", "words"), [(42.0, "42 m"), (31.427_1, "31.43 m"), (5.051_33, "5.05 m"), (7.5, "7.5 m")]
)
def test_lengths_are_shown_to_the_centimetre(metres, words):
    assert length(metres) == words
