from __future__ import annotations

from bimvox.rendering.words import counted, hours
from bimvox.units import clock


def test_numbers_read_as_people_write_them():
    assert counted(1, "part") == "1 part"
    assert counted(1200, "part") == "1,200 parts"
    assert hours(59 * 60 * 10**9) == "59 min"
    assert hours(60 * 60 * 10**9) == "1 h 0 min"
    assert clock(3 * 3600 + 61) == "3:01:01"
