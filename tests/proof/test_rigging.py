import re
from dataclasses import replace
from math import pi

import numpy as np
import pytest
from box_sites import box_site, test_crane
from hypothesis import given
from hypothesis import strategies as st

from bimvox.crane.choose_rig import NoGearError, choose_rig
from bimvox.crane.gear import Gear, GearKind
from bimvox.proof.rigging import check_rigging
from bimvox.records.proof import Check
from bimvox.site.component import Component, Lifting
from bimvox.site.config.gear_file import gear_catalogue
from bimvox.site.site import Site

GEAR = Gear(gear_catalogue())
SITE = box_site([("beam", (1.0, 1.4, 0.0), (5.0, 1.6, 0.4))], crane=test_crane(), shape=(40, 30, 24))


def hung(site: Site, mass_kg: float, off_m: list[tuple[float, float, float]], by: GearKind) -> Component:
    """Return the beam with another mass, on points this far from the middle of its top, with gear chosen for them."""
    part, size_m = site.components[0], site.frame.voxel_size_m
    cell = np.add(part.target_vox, part.hook_line_vox) + np.array([0.5, 0.5, 0.0])
    usual_m = site.cranes[0].sling_m
    rig = choose_rig(
        mass_kg, off_m, usual_m=usual_m, step_m=size_m, most_angle_rad=site.rules.sling_angle_rad / 2.0,
        attached_by=by, gear=GEAR,
    )  # fmt: skip
    points = tuple((site.frame.corner_of(cell) + one).tolist() for one in np.array(off_m))
    rise = round((rig.height_m - usual_m) / size_m)
    return replace(part, mass_kg=mass_kg, lifting=Lifting(tuple(map(tuple, points)), "assumed", rise, rig))


def failures(part: Component) -> list[str]:
    check = Check("rigging")
    check_rigging(check, SITE, part, frozenset({0}))
    return list(check.failures)


@given(
    st.floats(50.0, 40_000.0),
    st.sampled_from([1, 2, 4]),
    st.floats(0.3, 6.0),
    st.floats(0.2, 1.2),
    st.floats(0.5, 1.0),
    st.sampled_from([GearKind.SHACKLE, GearKind.ROUND_SLING]),
)
def test_what_is_chosen_is_proven_by_rules_of_their_own(mass_kg, count, out_m, aside_m, uneven, by):
    ends = [-out_m * uneven, out_m]
    points = [(x, y, -0.1) for x in ends for y in (-aside_m, aside_m)]
    points = {1: [(0.0, 0.0, 0.0)], 2: [(x, 0.0, -0.1) for x in ends], 4: points}[count]
    try:
        part = hung(SITE, mass_kg, points, by)
    except NoGearError:
        return
    assert failures(part) == []


FAR = [(-4.0, -0.5, 0.0), (4.0, -0.5, 0.0), (-4.0, 0.5, 0.0), (4.0, 0.5, 0.0)]


@pytest.mark.parametrize(
    ("at", "changes", "says"),
    [
        (0, {"angle_rad": 0.1}, "its legs lean by 29.* degrees, not 5.7"),
        (0, {"carrying": 1}, "1 of 2 legs carrying; 2 of 2 do"),
        (1, {"length_m": 4.0}, "its spreader is 4.00 m long; its lifting points ask for 8.00 m"),
        (1, {"rated_kg": 6000.0, "wll_kg": 6000.0}, "spreader 24 t carries .* its working load limit is 6000 kg"),
        (2, {"legs": 1}, "a spreader with"),
        (2, {"rated_kg": 1000.0, "wll_kg": 1000.0}, "its working load limit is 1400 kg"),
        (3, {"count": 2}, "a spreader with"),
        (3, {"load_kg": 10.0}, r"not 10\.0 of"),
    ],
)
def test_a_piece_of_a_spreader_that_is_not_as_it_says_is_found(at, changes, says):
    part = hung(SITE, 8000.0, FAR, GearKind.SHACKLE)
    rig = part.lifting.rig
    assert rig.kind == "spreader_4"
    parts = list(rig.parts)
    parts[at] = replace(parts[at], **changes)
    found = failures(replace(part, lifting=replace(part.lifting, rig=replace(rig, parts=tuple(parts)))))
    assert any(re.search(says, text) for text in found), found


def test_legs_flatter_than_the_rules_allow_are_refused():
    loose = replace(SITE, rules=replace(SITE.rules, sling_angle_rad=2 * pi / 3))
    part = hung(loose, 8000.0, [(-2.0, 0.0, 0.0), (2.0, 0.0, 0.0)], GearKind.SHACKLE)
    assert any("degrees; 30.0 are allowed" in text for text in failures(part))
