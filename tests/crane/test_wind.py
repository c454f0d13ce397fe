from math import sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bimvox.crane.wind import permitted_wind_m_s, wind_force_n

MASS = st.floats(10.0, 50_000.0)
AREA = st.floats(0.01, 200.0)


def test_the_formula_of_the_manuals():
    # A wall of 12 m2 and 3 t, drag 2.0: 24 m2 of sail area instead of the assumed 3.6 m2.
    assert permitted_wind_m_s(20.0, 3000.0, 12.0, 2.0) == pytest.approx(20.0 * sqrt(3.6 / 24.0))
    assert permitted_wind_m_s(20.0, 3000.0, 1.7, 2.0) == 20.0
    assert wind_force_n(20.0, 10.0, 1.2) == pytest.approx(10.0 * 1.2 * 250.0)  # 250 N/m2 at 20 m/s, as EN 13001-2


@given(MASS, AREA, st.floats(0.5, 2.5), st.floats(1.0, 30.0))
def test_at_the_permitted_speed_the_force_is_what_the_crane_assumes(mass, area, drag, limit):
    speed = permitted_wind_m_s(limit, mass, area, drag)
    assert 0.0 < speed <= limit
    if speed < limit:
        supposed = wind_force_n(limit, 1.2e-3 * mass, 1.0)
        assert wind_force_n(speed, area, drag) == pytest.approx(supposed, rel=1e-9)
