from dataclasses import replace
from math import cos, hypot, pi, radians, tan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bimvox.crane.choose_rig import NoGearError, choose_rig, sling_factor
from bimvox.crane.gear import Gear, GearKind, Rig
from bimvox.site.config.gear_file import gear_catalogue

GEAR = Gear(gear_catalogue())
PAIR = ((-2.0, 0.0, 0.0), (2.0, 0.0, 0.0))
FOUR = tuple((x, y, 0.0) for x in (-2.5, 2.5) for y in (-0.6, 0.6))


def rig_of(mass_kg: float, points, gear: Gear = GEAR, **more) -> Rig:
    limits = {"usual_m": 3.0, "step_m": 0.25, "most_angle_rad": pi / 6, "attached_by": GearKind.SHACKLE} | more
    return choose_rig(mass_kg, points, gear=gear, **limits)


def test_the_factor_on_a_sling_is_never_exceeded_nor_the_cosine_of_its_legs():
    assert sling_factor(1, 1, 0.0) == 1.0
    assert sling_factor(2, 2, 0.0) == 1.4  # EN 818-4, uniform load method; two vertical legs would carry twice one
    assert sling_factor(2, 2, pi / 3) == pytest.approx(1.0)
    assert sling_factor(2, 1, pi / 6) == pytest.approx(cos(pi / 6))
    assert sling_factor(4, 2, pi / 6) == pytest.approx(2 * cos(pi / 6))
    assert sling_factor(4, 2, radians(50.0)) == pytest.approx(2 * cos(radians(50.0)))


def test_a_pair_of_legs_gets_the_smallest_chain_and_shackles_that_carry_it():
    rig = rig_of(5000.0, PAIR)
    sling, shackles = rig.parts
    # 2 m out at no more than 30 degrees: 3.46 m, rounded up to 3.5 m; legs of 4.03 m lean by 29.7 degrees.
    assert (rig.kind, rig.height_m) == ("2_legs", 3.5)
    assert sling.angle_rad == pytest.approx(0.5191461142465229)
    assert (sling.length_m, sling.made_m) == (pytest.approx(hypot(2.0, 3.5)), 5.0)
    assert sling.name.endswith("13 mm")  # 10 mm: 1.4 x 3.15 t is less than 5 t
    assert sling.wll_kg == pytest.approx(1.4 * 5300.0)
    assert shackles.load_kg == pytest.approx(5000.0 / (2 * cos(sling.angle_rad)))
    assert (shackles.count, shackles.name) == (2, "bow shackle 3.25 t")
    assert rig.mass_kg == pytest.approx(3.8 + 2 * (5.7 + 5 * 3.8) + 2 * 0.7)
    assert sling.load_kg == pytest.approx(5000.0 + 2 * 0.7)


def test_of_four_legs_two_carry_and_of_two_unequal_ones_one():
    assert rig_of(5000.0, FOUR).top.carrying == 2
    uneven = rig_of(5000.0, ((-1.0, 0.0, 0.0), (2.0, 0.0, 0.0)))
    assert uneven.top.carrying == 1
    assert uneven.parts[1].load_kg == pytest.approx(5000.0 / cos(uneven.top.angle_rad))


def test_points_far_apart_hang_on_a_spreader():
    rig = rig_of(9000.0, tuple((1.4 * x, y, z) for x, y, z in FOUR))
    top, spreader, lower, shackles = rig.parts
    assert rig.kind == "spreader_4"
    assert (spreader.length_m, spreader.rated_kg) == (pytest.approx(7.0), 12_200.0)
    assert (lower.count, lower.legs) == (2, 2)
    assert lower.load_kg == pytest.approx((9000.0 + 4 * shackles.mass_kg) / 2)
    assert rig.drop_m == pytest.approx(0.6 / tan(pi / 6))
    assert top.load_kg == pytest.approx(9000.0 + rig.mass_kg - top.mass_kg)
    assert top.angle_rad <= pi / 6 + 1e-9
    assert rig_of(9000.0, FOUR, replace(GEAR, spreader_from_m=2.0)).kind == "spreader_4"


def test_where_no_gear_serves_the_strongest_is_named():
    with pytest.raises(NoGearError, match=r"no shackle carries 69.1 t.*bow shackle 55 t, carries 55 t"):
        rig_of(120_000.0, PAIR)
    with pytest.raises(NoGearError, match=r"no shackle carries 6,910 t"):
        rig_of(12_000_000.0, PAIR)
    with pytest.raises(NoGearError, match=r"no spreader of 24.0 m carries .*is at most 23 m long"):
        rig_of(9000.0, ((-12.0, 0.0, 0.0), (12.0, 0.0, 0.0)))
    with pytest.raises(NoGearError, match="the catalogue has none"):
        rig_of(900.0, PAIR, Gear(()))
    three = ((-9.0, 0.0, 0.0), (9.0, 1.0, 0.0), (9.0, -1.0, 0.0))
    with pytest.raises(NoGearError, match="a spreader is for 2 or 4 lifting points, not 3"):
        rig_of(9e5, three)


@given(
    st.floats(10.0, 60_000.0),
    st.floats(0.3, 5.0),
    st.floats(0.0, 1.5),
    st.sampled_from([2, 4]),
    st.floats(radians(15.0), radians(60.0)),
)
def test_no_piece_carries_more_than_its_limit_and_no_leg_leans_too_far(mass_kg, out_m, aside_m, count, angle_rad):
    points = [(-out_m, 0.0, 0.0), (out_m, 0.0, 0.0)]
    if count == 4:
        points = [(x, y, 0.0) for x in (-out_m, out_m) for y in (-aside_m - 0.1, aside_m + 0.1)]
    try:
        rig = rig_of(mass_kg, points, most_angle_rad=angle_rad)
    except NoGearError:
        return
    assert all(part.load_kg <= part.wll_kg * (1 + 1e-9) for part in rig.parts)
    assert all(part.angle_rad <= angle_rad + 1e-9 for part in rig.parts if part.kind is GearKind.CHAIN_SLING)
    assert rig.mass_kg == pytest.approx(sum(part.count * part.mass_kg for part in rig.parts))
    assert rig.height_m >= 3.0
