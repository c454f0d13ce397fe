"""Charts by sector: what a mobile crane carries depends on where its boom points."""

from __future__ import annotations

from dataclasses import replace
from math import pi, radians

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from named_cranes import default_luffing_crane

from bimvox.crane.carrier import Carrier, Outriggers, SectorChart
from bimvox.crane.load_chart import LoadChart, capacity_kg
from bimvox.crane.reach import HOOK_FORBIDDEN, hook_floor
from bimvox.crane.sectors import capacities_kg, name_towards, towards, utilisations, with_charts
from bimvox.errors import InputError
from bimvox.grid.frame import GridFrame
from bimvox.proof.crane.axes import shares_of_capacity

REAR = LoadChart((6.0, 14.0, 20.0), (14_000.0, 9_000.0, 5_000.0))
LEAST = LoadChart((6.0, 14.0, 20.0), (14_000.0, 6_000.0, 2_000.0))


def mobile(heading_deg: float = 30.0, front: LoadChart | None = None):
    """Return a crane with a better chart over its rear; over its front it has ``front``, None: nothing."""
    sectors = (
        SectorChart("over front", radians(-30), radians(30), front),
        SectorChart("over rear", radians(150), radians(210), REAR),
    )
    carrier = Carrier(radians(heading_deg), 12_000.0, Outriggers("full", 3.5, 3.5, 3.4, 3.4), sectors)
    return replace(default_luffing_crane("mobile-60t"), chart=LEAST, carrier=carrier)


def test_the_sector_follows_from_the_slewing_angle_and_the_carriers_heading():
    crane = mobile(heading_deg=30.0)
    for slew_deg, name, carries in (
        (30, "over front", 0),
        (120, "", 6_000),
        (210, "over rear", 9_000),
        (-150, "over rear", 9_000),
    ):
        assert name_towards(crane, radians(slew_deg)) == name
        assert capacities_kg(crane, radians(slew_deg), 10.0) == carries
        assert capacity_kg(towards(crane, radians(slew_deg)).chart, 10.0) == carries
    assert utilisations(crane, [radians(210), radians(30)], [10.0, 10.0], 4_500.0).tolist() == [0.5, np.inf]
    plain = default_luffing_crane("mobile-60t")
    assert towards(plain, 1.0) is plain


def test_on_the_line_between_two_sectors_the_smaller_capacity_holds():
    crane = mobile(heading_deg=0.0, front=LEAST)
    assert capacities_kg(crane, radians(150), 10.0) == 6_000
    assert capacities_kg(crane, radians(150) + 1e-5, 10.0) == 9_000
    assert name_towards(crane, radians(150)) == "over rear"


@given(
    st.lists(st.tuples(st.floats(-7.0, 7.0), st.floats(0.5, 30.0)), min_size=1, max_size=30),
    st.floats(-360.0, 360.0),
    st.booleans(),
)
def test_the_proof_reads_the_same_sectors_in_its_own_way(poses, heading_deg, front):
    crane = mobile(heading_deg, LEAST if front else None)
    slew_rad, radius_m = np.array(poses).T
    ours = utilisations(crane, slew_rad, radius_m, 3_000.0)
    proven = shares_of_capacity(crane, slew_rad, radius_m, 3_000.0)
    # On the line itself the planner counts the smaller capacity.
    assert (proven <= ours).all()
    away = np.abs(
        np.remainder(np.degrees(slew_rad)[:, None] - heading_deg - np.array([-30, 30, 150, 210]) + 180, 360) - 180
    )
    clear = (away > 1e-3).all(axis=1)
    assert (proven[clear] == ours[clear]).all()


def test_a_hook_with_a_load_stays_out_of_a_sector_that_does_not_carry_it():
    crane, frame = replace(mobile(heading_deg=0.0), base_m=(20.0, 20.0, 0.0)), GridFrame((0.0, 0.0, 0.0), 1.0)
    floor = hook_floor(crane, frame, np.zeros((40, 40), np.int32), 4_000.0, True)
    # 4 t and the tackle are carried at 17 m over the rear only, at 10 m also over the side, and over the front nowhere.
    assert floor[3, 20] < HOOK_FORBIDDEN
    assert floor[20, 3] == HOOK_FORBIDDEN
    assert floor[20, 10] < HOOK_FORBIDDEN
    assert floor[30, 20] == HOOK_FORBIDDEN


def test_every_chart_of_a_crane_is_scaled():
    half = with_charts(mobile(), lambda own: LoadChart(own.radius_m, tuple(kg / 2.0 for kg in own.capacity_kg)))
    assert capacities_kg(half, radians(210), 10.0) == 4_500.0
    assert capacities_kg(half, radians(120), 10.0) == 3_000.0


@pytest.mark.parametrize(
    "sectors",
    [
        ((-0.5, 0.5), (0.4, 2.0)),
        ((0.0, 1.0), (5.0, 7.0)),
    ],
)
def test_sectors_that_overlap_are_refused(sectors):
    with pytest.raises(InputError, match="overlap"):
        Carrier(sectors=tuple(SectorChart(f"{n}", *one, LEAST) for n, one in enumerate(sectors)))
    with pytest.raises(InputError, match="sector"):
        SectorChart("back", 1.0, 1.0 + 2.1 * pi, LEAST)
