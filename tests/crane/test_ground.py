"""Loads on outriggers: equilibrium, symmetry, lift-off to three pads, tipping."""

from __future__ import annotations

from dataclasses import replace
from math import cos, pi, radians, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from named_cranes import default_luffing_crane
from scipy.optimize import minimize

from bimvox.crane.carrier import Carrier, Masses, Outriggers
from bimvox.crane.ground import G_M_S2, PADS, crane_kg, pad_loads_n, touches

JIB = default_luffing_crane("mobile-60t").luffing
MASSES = Masses(24_000.0, 0.4, 9_000.0, -0.5, 7_000.0, 0.4, 3.4)
CARRIER = Carrier(radians(20), 12_000.0, Outriggers("full", 3.6, 3.2, 3.3, 3.1), masses=MASSES)
X, Y = np.array([3.6, 3.6, -3.2, -3.2]), np.array([3.3, -3.1, 3.3, -3.1])


def wrench(slew_rad: float, radius_m: float, hung_kg: float) -> np.ndarray:
    """Return weight and moments of the single masses, point by point."""
    along = slew_rad - CARRIER.heading_rad
    boom_m = JIB.pivot_offset_m + 0.4 * (radius_m - JIB.pivot_offset_m)
    points = [(24_000.0, 0.4, 0.0)]
    for mass, ahead in ((9_000.0, -0.5), (12_000.0, -3.4), (7_000.0, boom_m), (hung_kg, radius_m)):
        points.append((mass, ahead * cos(along), ahead * sin(along)))
    return G_M_S2 * np.array([[m, m * x, m * y] for m, x, y in points]).sum(axis=0)


POSE = (st.floats(-7.0, 7.0), st.floats(4.0, 31.0), st.floats(0.0, 9_000.0))


@given(*POSE)
def test_the_pads_carry_the_weight_and_the_moments(slew_rad, radius_m, hung_kg):
    (loads,) = pad_loads_n(CARRIER, JIB, slew_rad, radius_m, hung_kg)
    weight, ahead, aside = wrench(slew_rad, radius_m, hung_kg)
    at = np.array([ahead, aside]) / weight
    if np.isinf(loads).any():
        assert not (-3.2 < at[0] < 3.6 and -3.1 < at[1] < 3.3)
        return
    assert (loads >= 0.0).all()
    assert loads.sum() == pytest.approx(weight)
    assert [loads @ X, loads @ Y] == pytest.approx([ahead, aside], abs=1e-6 * weight)


@given(*POSE)
def test_pads_that_only_push_store_the_least_energy(slew_rad, radius_m, hung_kg):
    (loads,) = pad_loads_n(CARRIER, JIB, slew_rad, radius_m, hung_kg)
    if np.isinf(loads).any():
        return
    scale, arms = wrench(slew_rad, radius_m, hung_kg)[0], np.stack([np.ones(4), X, Y])
    given_n = arms @ (loads / scale)
    constraints = {"type": "eq", "fun": lambda r: arms @ r - given_n}
    found = minimize(lambda r: r @ r, loads / scale, bounds=[(0, None)] * 4, constraints=constraints, method="SLSQP")
    assert (loads / scale) @ (loads / scale) <= found.fun + 1e-6


def test_a_load_over_a_corner_presses_that_pad_most_and_lifts_the_opposite_one():
    corner_rad = CARRIER.heading_rad + np.arctan2(3.3, 3.6)
    (heavy,) = pad_loads_n(CARRIER, JIB, corner_rad, 20.0, 9_000.0)
    assert PADS[int(np.argmax(heavy))] == "front left"
    assert touches(heavy).tolist() == [True, True, True, False]
    (empty,) = pad_loads_n(CARRIER, JIB, corner_rad, 6.0, 350.0)
    assert PADS[int(np.argmax(empty))] == "rear right"
    (tips,) = pad_loads_n(CARRIER, JIB, corner_rad, 30.0, 30_000.0)
    assert np.isinf(tips).all()


def test_on_a_square_base_the_loads_go_round_with_the_boom():
    square = replace(CARRIER, heading_rad=0.0, outriggers=Outriggers("square", 3.0, 3.0, 3.0, 3.0))
    square = replace(square, masses=replace(MASSES, carrier_ahead_m=0.0))
    loads = pad_loads_n(square, JIB, np.array([0.3, 0.3 + pi / 2]), 12.0, 3_000.0)
    front_left, front_right, rear_left, rear_right = loads[0]
    assert loads[1] == pytest.approx([front_right, rear_right, front_left, rear_left])
    assert np.allclose(pad_loads_n(CARRIER, JIB, 0.0, 8.0, 0.0), pad_loads_n(CARRIER, JIB, 2 * pi, 8.0, 0.0))


def test_without_masses_outriggers_or_counterweight_nothing_is_made_up():
    for less in ({"masses": None}, {"outriggers": None}, {"counterweight_kg": None}):
        assert pad_loads_n(replace(CARRIER, **less), JIB, 0.0, 8.0, 0.0) is None
    assert crane_kg(CARRIER) == 52_000.0
    assert crane_kg(replace(CARRIER, masses=None)) is None
