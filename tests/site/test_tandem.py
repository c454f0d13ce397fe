"""Which parts two cranes carry together, by the site file and by what one crane carries."""

from dataclasses import replace
from math import radians, tan

import pytest
from box_buildings import box_element, building_of, rasterise_boxes
from pydantic import ValidationError
from tandem_sites import tandem_site

from bimvox.crane.tower_crane import TowerCrane
from bimvox.errors import ConfigError
from bimvox.site.build import PlacedModel, build_site
from bimvox.site.collision import HOOK_FORBIDDEN, hook_room
from bimvox.site.config.crane import CraneConfig
from bimvox.site.config.rules import RulesConfig, TandemConfig
from bimvox.site.config.site_config import AreasConfig, ComponentConfig, ModelConfig, SiteConfig
from bimvox.site.default_rules import TandemRules
from bimvox.site.machine import cranes_of
from bimvox.site.placement import site_extent
from bimvox.site.tandem import HELD, halves, jibs_apart, level_kg, over_both, pairs_for, part_on, seen_by

YARD = ((0.0, 0.0), (10.0, 0.0), (10.0, 6.0), (0.0, 6.0))
CRANES = (
    CraneConfig(name="west", machine="hammerhead-30", base_m=(-9.0, -8.0), jib_height_m=15.5, jib_length_m=24.0),
    CraneConfig(name="east", machine="hammerhead-30", base_m=(19.5, -8.0), jib_height_m=22.0, jib_length_m=24.0),
)
PARTS = building_of(
    box_element("girder", (0.0, 9.0, 0.0), (10.0, 9.5, 0.4), ifc_class="IfcBeam"),
    box_element("block", (4.0, 11.0, 0.0), (5.0, 12.0, 0.5), ifc_class="IfcBeam"),
    box_element("post", (8.0, 11.0, 0.0), (8.5, 11.5, 3.0), ifc_class="IfcColumn"),
)


def config(*components, cranes=CRANES, **rules) -> SiteConfig:
    return SiteConfig(
        name="plot",
        model=ModelConfig(path="a.ifc", voxel_size_m=0.25),
        areas=AreasConfig(yard=(YARD,)),
        crane=cranes,
        rules=RulesConfig(**rules),
        component=components,
    )


def built(given: SiteConfig, heavier: float = 1.0):
    cranes = cranes_of(given)
    elements = [
        replace(one, mass_kg=(one.mass_kg or 4_800.0) * (heavier if one.id == "girder" else 1.0))
        for one in PARTS.elements
    ]
    frame, shape = site_extent(given, PARTS, cranes[0])
    parts = [(element, rasterise_boxes(element.mesh, frame, shape)) for element in elements]
    return build_site(given, PlacedModel(parts, frame, shape), cranes=cranes, rasterise=rasterise_boxes)


def carried_by_two(site) -> list[str]:
    return [part.id for part in site.components if part.tandem is not None]


def test_nothing_is_carried_by_two_cranes_unless_the_site_file_asks():
    site = built(config())
    assert carried_by_two(site) == [] and site.rules.tandem is None


def test_with_the_table_they_carry_what_none_carries_alone():
    site = built(config(tandem=TandemConfig()))
    assert carried_by_two(site) == ["girder"]
    (girder, *_) = site.components
    assert {girder.crane, girder.tandem.second} == {0, 1}
    assert girder.lifting.source == HELD and girder.lifting.points_m == girder.tandem.points_m
    assert [point[0] for point in girder.tandem.points_m] == pytest.approx([2.0, 8.0])
    assert site.rules.tandem == TandemRules()


def test_nothing_that_one_crane_carries_or_that_two_are_too_weak_for():
    assert carried_by_two(built(config(tandem=TandemConfig()), heavier=0.1)) == []
    assert carried_by_two(built(config(tandem=TandemConfig()), heavier=2.0)) == []


def test_a_part_that_the_site_file_names_or_excludes():
    asked = ComponentConfig(global_id="girder", tandem=True)
    assert carried_by_two(built(config(asked), heavier=0.5)) == ["girder"]
    excluded = ComponentConfig(global_id="girder", tandem=False)
    assert carried_by_two(built(config(excluded, tandem=TandemConfig()))) == []
    named = ComponentConfig(global_id="girder", crane="west")
    assert carried_by_two(built(config(named, tandem=TandemConfig()))) == []


@pytest.mark.parametrize(
    ("entry", "more", "said"),
    [
        ({"global_id": "post", "pose": "lying_x"}, {}, "it must come as it is set"),
        ({"global_id": "girder", "crane": "west"}, {}, "the site file names one crane for it"),
        ({"global_id": "girder"}, {"cranes": CRANES[:1]}, "the site has no two cranes"),
        ({"global_id": "girder", "means": "by_hand"}, {}, "no crane lifts it"),
    ],
)
def test_a_part_that_two_cranes_cannot_carry(entry, more, said):
    with pytest.raises(ConfigError, match=said):
        built(config(ComponentConfig(tandem=True, **entry), **more))


def test_a_part_that_no_two_cranes_reach():
    far = (CRANES[0], CRANES[1].model_copy(update={"base_m": (60.0, -8.0)}))
    with pytest.raises(ConfigError, match="no two cranes of the site reach"):
        built(config(ComponentConfig(global_id="girder", tandem=True), cranes=far))


def test_values_of_the_table():
    assert TandemConfig(most_share=0.8, off_level_deg=5.0).value() == TandemRules(0.8, radians(5.0))
    with pytest.raises(ValidationError):
        TandemConfig(most_share=1.1)
    with pytest.raises(ValidationError):
        ComponentConfig(global_id="girder", pinned=True, tandem=True)


def test_the_digests_tell_who_carries_a_part():
    one, other = built(config()), built(config(tandem=TandemConfig()), heavier=1.2)
    assert one.fixed_digest != other.fixed_digest


def test_each_half_has_the_largest_mass_on_its_hook():
    site = tandem_site()
    (beam,) = site.components
    first, second = halves(site, beam)
    more_kg = 24_000.0 * 0.5 * tan(radians(3.0)) / 6.0  # half a metre below its points, which are 6 m apart
    assert level_kg(beam) == pytest.approx((12_000.0, 12_000.0))
    assert (first.mass_kg, second.mass_kg) == pytest.approx((12_000.0 + more_kg,) * 2)
    assert (first.crane, second.crane) == (0, 1)
    assert first.shape is beam.shape and first.tandem is None
    at_m = [site.frame.corner_of(np_add(half.target_vox, half.hook_line_vox))[:2] + 0.25 for half in (first, second)]
    assert at_m[0] == pytest.approx((8.0, 18.5)) and at_m[1] == pytest.approx((14.0, 18.5))


def np_add(*vectors):
    return [sum(values) for values in zip(*vectors, strict=True)]


def test_a_site_as_one_of_its_cranes_sees_it():
    site = tandem_site(
        parts=(("small", (3.0, 18.0, 0.0), (5.0, 19.0, 1.0)), ("beam", (6.0, 18.0, 0.0), (16.0, 19.0, 1.0)))
    )
    small, beam = site.components
    for number in (0, 1):
        seen = seen_by(site, number)
        assert seen.components[0] is small and seen.components[1].crane == number
        assert part_on(site, 1, number) is seen.components[1]
    assert part_on(site, 0, 1) is small and beam.tandem is not None


def test_the_hook_line_may_be_where_both_hooks_may_be():
    site = tandem_site()
    (beam,) = site.components
    top = site.ground_vox + 1
    room = hook_room(site, site.cranes[0], top, beam)
    own = [hook_room(site, site.cranes[half.crane], top, half, most_used=0.75).floor for half in halves(site, beam)]
    shifts = [half.hook_offset_vox[0] - beam.hook_offset_vox[0] for half in halves(site, beam)]
    for x, y in ((20, 30), (25, 34), (5, 40), (45, 8)):
        both = [
            one[x + by, y] if 0 <= x + by < one.shape[0] else HOOK_FORBIDDEN
            for one, by in zip(own, shifts, strict=True)
        ]
        may = max(both) < HOOK_FORBIDDEN and jibs_apart(site, beam)[x, y]
        assert (room.floor[x, y] < HOOK_FORBIDDEN) == may
    assert over_both(site, beam, own, -7)[0, -1].max() >= -7


def test_a_short_part_is_held_nearer_to_its_ends():
    """The two hook blocks need 4 m: 2 m between them, and room."""
    site = tandem_site(parts=(("block", (6.0, 18.0, 0.0), (12.0, 20.0, 1.0)),))
    (first, second) = site.components[0].tandem.points_m
    assert (first[0], second[0]) == pytest.approx((7.0, 11.0))


def test_the_nearer_crane_holds_the_nearer_end():
    site = tandem_site()
    (found, *_) = pairs_for(site, replace(site.components[0], tandem=None))
    west, east = (site.cranes[number] for number in found.cranes)
    assert isinstance(west, TowerCrane) and west.base_m[0] < east.base_m[0]
    assert found.tandem.points_m[0][0] < found.tandem.points_m[1][0]
