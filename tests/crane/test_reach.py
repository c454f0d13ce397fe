import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from named_cranes import default_crane

from bimvox.crane.load_chart import capacity_kg, utilisation
from bimvox.crane.reach import HOOK_FORBIDDEN, allowed_radii_m, counted_kg, hook_floor
from bimvox.grid.frame import GridFrame


def brute_force(crane, frame, top, mass_kg, rope):
    floor = np.full(top.shape, HOOK_FORBIDDEN)
    for i, j in np.ndindex(top.shape):
        x, y, _ = frame.centre_of((i, j, 0))
        radius = float(np.hypot(x - crane.base_m[0], y - crane.base_m[1]))
        lowest = int(top[i, j]) if rope else 0
        slings_end_m = frame.corner_of((i, j, lowest))[2] + crane.sling_m
        if (
            crane.min_radius_m <= radius <= crane.jib_length_m
            and capacity_kg(crane.chart, radius) >= mass_kg + crane.tackle_kg
            and slings_end_m <= crane.jib_height_m + 1e-6
        ):
            floor[i, j] = lowest
    return floor


def hook_allowed(crane, frame, shape, mass_kg):
    return hook_floor(crane, frame, np.zeros(shape, np.int32), mass_kg, rope=False) != HOOK_FORBIDDEN


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(-30.0, 50.0), st.floats(-30.0, 50.0), st.floats(0.0, 9000.0), st.booleans())
def test_the_floor_is_that_of_brute_force(seed, x, y, mass_kg, rope):
    crane = default_crane("hammerhead-45", (x, y, 0.0), jib_height_m=9.0)
    frame = GridFrame((-3.0, 4.0, -0.7), 0.7)
    top = np.random.default_rng(seed).integers(0, 20, (23, 31)).astype(np.int32)
    assert (hook_floor(crane, frame, top, mass_kg, rope) == brute_force(crane, frame, top, mass_kg, rope)).all()


def test_without_a_crane_nothing_is_forbidden():
    top = np.full((4, 5), 3, np.int32)
    floor = hook_floor(None, GridFrame((0.0, 0.0, 0.0), 1.0), top, 1e9, rope=True)
    assert floor.dtype == np.int32
    assert (floor == 0).all()
    assert hook_allowed(None, GridFrame((0.0, 0.0, 0.0), 1.0), (4, 5), 1e9).all()


def test_a_load_too_heavy_may_be_nowhere():
    crane = dataclasses.replace(default_crane("hammerhead-45"), min_radius_m=0.0)
    low_m, high_m = allowed_radii_m(crane, 8000.0)  # at most 8 t, which includes the slings
    assert high_m < low_m
    assert not hook_allowed(crane, GridFrame((-0.5, -0.5, 0.0), 1.0), (40, 40), 8000.0).any()


def test_a_heavier_load_reaches_less_far():
    crane = default_crane("hammerhead-45")
    frame = GridFrame((-50.0, -50.0, 0.0), 1.0)
    light, heavy = (hook_allowed(crane, frame, (100, 100), mass) for mass in (1000.0, 5000.0))
    assert heavy.sum() < light.sum()
    assert not (heavy & ~light).any()
    assert allowed_radii_m(crane, 1000.0) == pytest.approx((2.8, 45.0))


def test_a_load_reaches_less_far_if_less_of_the_capacity_is_permitted():
    crane = default_crane("hammerhead-45")
    _, whole_m = allowed_radii_m(crane, 4000.0)
    _, less_m = allowed_radii_m(crane, 4000.0, 0.8)
    hung_kg = 4000.0 + crane.tackle_kg
    assert less_m < whole_m
    assert utilisation(crane.chart, less_m, hung_kg) == pytest.approx(0.8, abs=1e-9)
    assert allowed_radii_m(crane, counted_kg(crane, 4000.0, 0.8)) == pytest.approx((crane.min_radius_m, less_m))
    assert counted_kg(crane, 4000.0, 1.0) == 4000.0
