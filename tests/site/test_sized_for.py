"""A crane is not sized for parts that may as well be cast."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest
from box_buildings import box_element, building_of

from bimvox.bim.building import Casting
from bimvox.bim.kinds.kind import Confidence, Judgement, Kind
from bimvox.errors import SelectionError
from bimvox.site.catalogue import catalogue, machine_called, machines_called
from bimvox.site.config.site_config import ComponentConfig, ModelConfig, SiteConfig
from bimvox.site.demand import rigs_of
from bimvox.site.guess import USUAL_TM, complete_config, cranes_that_fit, guess_site

MODEL = ModelConfig(path="a.ifc")
LIGHT = [box_element(f"beam-{n}", (6.0 * n, 0, 3), (6.0 * n + 5, 0.3, 3.5), ifc_class="IfcBeam") for n in range(5)]
WALL = box_element("wall", (0, 12, 0), (10, 12.35, 3.8), ifc_class="IfcWall")
"""33 t, further in than a usual crane carries it."""

_SHORT = [box_element(f"short-{n}", (3.0 * n, 6, 0), (3.0 * n + 2, 6.35, 3.8), ifc_class="IfcWall") for n in range(2)]


def tm(config):
    return machine_called(config.crane.machine).load_moment_tm


def test_concrete_that_only_a_very_large_crane_lifts_is_cast():
    building = building_of(*LIGHT, WALL)
    config = guess_site(building, MODEL)
    assert tm(config) <= USUAL_TM
    (entry,) = config.component
    assert (entry.global_id, entry.means) == ("wall", "in_situ")
    assert entry.why is not None
    assert entry.why.startswith("no usual crane (up to 300 tm) lifts it")
    own, _ = cranes_that_fit(config, building)
    assert (own.parts, own.unserved) == (5, ())
    assert tm(config) == tm(guess_site(building_of(*LIGHT), MODEL)), "it is chosen for the others"


def test_walls_like_those_that_are_cast_are_cast():
    walls = [replace(WALL, name="wall 1"), *(replace(one, name=f"wall {n}") for n, one in enumerate(_SHORT, start=2))]
    config = guess_site(building_of(*LIGHT, *walls), MODEL)
    assert {entry.global_id for entry in config.component} == {"wall", "short-0", "short-1"}


def test_what_is_stated_to_be_precast_and_what_the_site_file_lifts_is_what_the_crane_is_sized_for():
    stated = guess_site(building_of(*LIGHT, replace(WALL, casting=Casting.PRECAST)), MODEL)
    assert tm(stated) > USUAL_TM
    assert stated.component == ()
    said = SiteConfig(model=MODEL, component=[ComponentConfig(global_id="wall", means="crane")])
    assert tm(complete_config(said, building_of(*LIGHT, WALL))) > USUAL_TM


def test_a_doubtful_part_makes_a_large_crane_no_larger():
    sure = replace(WALL, id="sure", global_id="sure", casting=Casting.PRECAST)
    far = box_element("far", (40, 30, 0), (50, 30.35, 3.8), ifc_class="IfcWall")
    alone = guess_site(building_of(*LIGHT, sure), MODEL)
    both = guess_site(building_of(*LIGHT, sure, far), MODEL)
    assert tm(alone) > USUAL_TM
    assert tm(both) >= tm(alone)
    assert [entry.global_id for entry in both.component] in ([], ["far"])


_STEEL = replace(WALL, judgement=Judgement(Kind.STEEL, Confidence.NAMED), mass_source="density")


@pytest.mark.parametrize(
    "part",
    [
        replace(_STEEL, volume_guessed=True),
        replace(WALL, judgement=Judgement(Kind.TIMBER, Confidence.ASSUMED)),
        replace(_STEEL, mesh=box_element("roof", (0, 8, 4), (10, 16, 4.2)).mesh),
    ],
    ids=["open mesh", "kind assumed", "wider than the road"],
)
def test_a_doubtful_part_of_another_kind_is_asked_about_and_not_cast(part):
    building = building_of(*LIGHT, part)
    config = guess_site(building, MODEL)
    assert tm(config) <= USUAL_TM
    assert config.component == ()
    own, _ = cranes_that_fit(config, building)
    assert [part.component for part in own.unserved] == ["wall"]


@pytest.mark.parametrize("machine", ["flat-top-800", "flat-top-75"])
def test_of_a_machine_that_is_asked_for_nothing_is_cast(machine):
    config = guess_site(building_of(*LIGHT, WALL), MODEL, machines=machines_called(machine))
    assert (config.crane.machine, config.component) == (machine, ())


def test_if_all_parts_are_doubtful_and_heavy_nothing_is_lifted_unless_a_larger_crane_is_asked_for():
    with pytest.raises(SelectionError, match="no usual crane") as caught:
        guess_site(building_of(WALL), MODEL)
    (larger,) = re.findall(r"--crane (\S+);", caught.value.hint or "")
    config = guess_site(building_of(WALL), MODEL, machines=machines_called(larger))
    own, _ = cranes_that_fit(config, building_of(WALL))
    assert (own.machine, own.unserved) == (larger, ())


def test_a_part_without_gear_is_not_promised():
    part = box_element("block", (0, 8, 0), (4, 12, 4.0), ifc_class="IfcBuildingElementProxy")
    part = replace(part, casting=Casting.PRECAST)
    building = building_of(*LIGHT, part)
    config = guess_site(building, MODEL)
    assert tm(config) == tm(guess_site(building_of(*LIGHT), MODEL)), "no crane is sized for what nothing hangs on"
    own, _ = cranes_that_fit(config, building)
    assert [(one.component, one.reason[:22]) for one in own.unserved] == [("block", "has no gear for it: no")]


def girder(name, y, t):
    """A precast girder of 39 m, so broad that it weighs ``t`` tonnes."""
    mesh = box_element(name, (0, y, 3), (39, y + t / (39 * 1.2 * 2.4), 4.2)).mesh
    one = box_element(name, (0, y, 3), (39, y + 1, 4.2), ifc_class="IfcBeam")
    return replace(one, mesh=mesh, mass_kg=1000.0 * t, casting=Casting.PRECAST)


def test_a_girder_as_heavy_as_the_road_allows_has_gear():
    (heavy,) = rigs_of(SiteConfig(model=MODEL), [girder("girder", 0, 70)]).mass_kg
    assert heavy > 0.0


def test_what_no_tower_crane_lifts_gets_a_mobile_crane():
    girders = [girder(f"girder-{n}", 3.0 * n, 45) for n in range(3)]
    config = guess_site(building_of(*girders), MODEL)
    assert machine_called(config.crane.machine).kind == "mobile"
    assert cranes_that_fit(config, building_of(*girders))[0].serves


def test_no_machine_that_lifts_nothing_is_proposed(monkeypatch):
    towers = tuple(machine for machine in catalogue() if machine.kind != "mobile")
    monkeypatch.setattr("bimvox.site.guess.catalogue", lambda: towers)
    girders = [girder(f"girder-{n}", 3.0 * n, 55) for n in range(3)]
    with pytest.raises(
        SelectionError, match="nothing to lift: no machine of the catalogue lifts any of the 3"
    ) as error:
        guess_site(building_of(*girders), MODEL)
    assert "flat-top-1150, carries " in error.value.message
    assert "--crane flat-top-1150" in error.value.hint
    said = guess_site(building_of(*girders), MODEL, machines=machines_called("flat-top-1150"))
    assert said.crane.machine == "flat-top-1150", "who asks for a machine gets it"


def test_of_heavy_and_light_parts_the_light_ones_are_served():
    building = building_of(*LIGHT, girder("girder", 6, 55))
    own, _ = cranes_that_fit(guess_site(building, MODEL), building)
    assert [part.component for part in own.unserved] == ["girder"]
