from dataclasses import replace
from math import pi, sqrt, tan

import numpy as np
import pytest
from box_buildings import box_element
from hypothesis import given
from hypothesis import strategies as st

from bimvox.crane.gear import Gear, GearKind
from bimvox.site.config.gear_file import gear_catalogue
from bimvox.site.lifting import HangsAt, lifting_by, lifting_of

BEAM = box_element("beam", (0, 0, 0), (8, 0.4, 0.6))


def test_without_anchors_the_point_is_above_the_centre_of_mass():
    lifting = lifting_of(BEAM, HangsAt((4.0, 0.2), 0.75, 2.5, pi / 3, 0.25))
    assert lifting.points_m == ((4.0, 0.2, 0.75),)
    assert (lifting.source, lifting.sling_rise_vox) == ("centre_of_mass", 0)


def test_the_hook_is_as_high_as_the_angle_between_the_legs_requires():
    anchored = replace(BEAM, lifting_points_m=((1.0, 0.2, 0.6), (7.0, 0.2, 0.6)))
    lifting = lifting_of(anchored, HangsAt((4.0, 0.2), 0.75, 2.5, pi / 3, 0.25))
    # 3 m out, 30 degrees to the vertical: 5.196 m above the anchors, 2.546 m more than
    # 0.75 + 2.5, rounded up to 11 cells.
    assert lifting.source == "anchors"
    assert lifting.sling_rise_vox == int(np.ceil((0.6 + 3.0 * sqrt(3.0) - 3.25) / 0.25))
    assert lifting_of(anchored, HangsAt((4.0, 0.2), 0.75, 6.0, pi / 3, 0.25)).sling_rise_vox == 0
    assert lifting_of(anchored, HangsAt((4.0, 0.2), 0.75, 2.5, 2 * pi / 3, 0.25)).sling_rise_vox == 0


@given(
    st.lists(st.tuples(st.floats(-5, 5), st.floats(-5, 5), st.floats(-1, 0)), min_size=1, max_size=4),
    st.floats(0.3, 2.0),
)
def test_no_leg_leans_by_more_than_half_the_angle(points, angle):
    anchored = replace(BEAM, lifting_points_m=tuple(points))
    lifting = lifting_of(anchored, HangsAt((0.0, 0.0), 0.0, 2.0, angle, 0.5))
    hook_m = 2.0 + 0.5 * lifting.sling_rise_vox
    for x, y, z in points:
        assert np.hypot(x, y) <= (hook_m - z) * tan(angle / 2.0) + 1e-6
    if lifting.sling_rise_vox:
        lower = hook_m - 0.5
        assert any(np.hypot(x, y) > (lower - z) * tan(angle / 2.0) - 1e-6 for x, y, z in points)


def test_anchors_are_found_by_name():
    from bimvox.bim.ifc.assembly import is_lifting_anchor

    class Product:
        def __init__(self, name, object_type=None):
            self.Name, self.ObjectType = name, object_type

    for name in ("HIJSOOG DIAM.60", "Hijsanker", "Lifting eye", "nostolenkki", "Ancre de levage", "Transportanker"):
        assert is_lifting_anchor(Product(name)), name
    assert is_lifting_anchor(Product("M14", "lifting anchor"))
    for name in ("ANKER", "HALFEN38/150/1", "Lift shaft", "AFLOOP 110", "anchor bolt", None):
        assert not is_lifting_anchor(Product(name)), name


@pytest.mark.parametrize("yaw", [0.0, 0.4, pi / 2])
def test_points_move_with_their_element(yaw):
    from box_buildings import building_of

    from bimvox.bim.site_frame import in_site_frame

    building = building_of(replace(BEAM, lifting_points_m=((8.0, 0.4, 0.6),)))
    placed, _ = in_site_frame(building, ground_m=-1.0, yaw_rad=yaw)
    element = placed.elements[0]
    corner = element.mesh.vertices_m[np.argmin(np.linalg.norm(BEAM.mesh.vertices_m - (8.0, 0.4, 0.6), axis=1))]
    assert element.lifting_points_m[0] == pytest.approx(corner, abs=1e-5)


AT = HangsAt((4.0, 0.2), 0.75, 3.0, pi / 3, 0.25)
GEAR = Gear(gear_catalogue())


def test_gear_is_chosen_for_assumed_points_or_for_the_models_anchors():
    lifting = lifting_by(GEAR, BEAM, AT, upended=False)
    assert (lifting.source, lifting.points_m) == ("assumed", ((2.0, 0.2, 0.6), (6.0, 0.2, 0.6)))
    # From points 0.15 m below the cells' top to 30 degrees: 3.46 m, so 3.31 m above it, and two cells more than 3 m.
    assert (lifting.sling_rise_vox, lifting.rig.height_m) == (2, 3.5)
    assert lifting.rig.parts[1].kind is GearKind.SHACKLE
    anchored = replace(BEAM, lifting_points_m=((1.5, 0.2, 0.6), (6.5, 0.2, 0.6)))
    assert lifting_by(GEAR, anchored, AT, upended=False).source == "anchors"
    aside = replace(BEAM, lifting_points_m=((0.5, 0.2, 0.6), (1.5, 0.2, 0.6)))
    assert lifting_by(GEAR, aside, AT, upended=False).source == "assumed"


def test_steel_without_anchors_hangs_on_round_slings():
    steel = replace(BEAM, material="S355")
    assert lifting_by(GEAR, steel, AT, upended=False).rig.parts[1].kind is GearKind.ROUND_SLING


def test_a_part_that_no_gear_carries_says_so_and_has_no_rig():
    lifting = lifting_by(GEAR, replace(BEAM, mass_kg=150_000.0), AT, upended=False)
    assert lifting.rig is None
    assert "no shackle carries" in lifting.no_gear
    assert (lifting.source, lifting.sling_rise_vox) == ("centre_of_mass", 0)
