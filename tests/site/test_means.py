"""What is a lift of the crane, what is cast in place, and what is set by hand."""

from __future__ import annotations

import dataclasses
from dataclasses import replace

import numpy as np
import pytest
from box_buildings import box_element

from bimvox.bim.building import Casting
from bimvox.bim.kinds.kind import Confidence, Judgement, Kind
from bimvox.errors import SelectionError
from bimvox.site.config.crane import CraneConfig
from bimvox.site.config.site_config import ComponentConfig, MeansConfig, ModelConfig, SiteConfig
from bimvox.site.demand import means_by
from bimvox.site.means import Means, means_of, nothing_to_lift

BEAM = box_element("beam", (0, 0, 3), (6, 0.3, 3.5), ifc_class="IfcBeam")
DECK = box_element("deck", (0, 0, 3.3), (30, 20, 3.6), ifc_class="IfcSlab")
SLAB = box_element("slab", (0, 0, 0), (30, 20, 0.3), ifc_class="IfcSlab")
FOOTING = box_element("footing", (2, 2, -0.5), (4, 4, 0.1), ifc_class="IfcSlab")
LINTEL = box_element("lintel", (0, 0, 2), (1.2, 0.1, 2.1), mass_kg=30.0)


def works(*elements, entries=(), **limits):
    found = means_of(elements, {entry.global_id: entry for entry in entries}, MeansConfig(**limits))
    return {name: one.means for name, one in found.items()}


def cast(element, casting):
    return dataclasses.replace(element, casting=casting)


def test_a_usual_part_is_lifted():
    assert works(BEAM) == {"beam": Means.CRANE}


def test_what_the_file_states_about_casting_decides():
    found = means_of([BEAM, cast(dataclasses.replace(BEAM, id="poured"), Casting.IN_SITU)], {}, MeansConfig())
    assert found["poured"] == (Means.IN_SITU, "the building file says that it is cast in place")
    stated = dataclasses.replace(cast(DECK, Casting.PRECAST), judgement=Judgement(Kind.PRECAST, Confidence.STATED))
    assert works(BEAM, stated)["deck"] is Means.CRANE


def test_a_floor_beyond_the_road_that_only_its_words_call_precast_is_drawn_in_one_piece():
    named = dataclasses.replace(cast(DECK, Casting.PRECAST), judgement=Judgement(Kind.PRECAST, Confidence.NAMED))
    assert works(BEAM, named)["deck"] is Means.IN_SITU
    plank = box_element("plank", (0, 0, 3.3), (12, 1.2, 3.5), ifc_class="IfcSlab")
    assert works(dataclasses.replace(named, id="plank", mesh=plank.mesh))["plank"] is Means.CRANE


@pytest.mark.parametrize("kind", [Kind.MASONRY, Kind.LIGHT, Kind.GLAZING, Kind.EARTH])
def test_what_a_trade_builds_of_pieces_is_built_in_place_whatever_it_weighs(kind):
    wall = box_element("wall", (0, 0, 0), (6, 0.3, 3), ifc_class="IfcWall")
    known = dataclasses.replace(wall, judgement=Judgement(kind, Confidence.NAMED, "its material says so"))
    found = means_of([BEAM, known, dataclasses.replace(known, id="small", mass_kg=3.0)], {}, MeansConfig())
    assert found["wall"] == (Means.BUILT, "its material says so")
    assert found["small"].means is Means.BUILT
    assert works(BEAM, cast(known, Casting.PRECAST))["wall"] is Means.CRANE


def test_a_floor_of_timber_beyond_the_road_is_built_in_place_and_a_bar_is_lifted():
    timber = Judgement(Kind.TIMBER, Confidence.NAMED, "its material says so")
    floor = dataclasses.replace(box_element("floor", (0, 0, 3), (9, 7.7, 3.3), ifc_class="IfcSlab"), judgement=timber)
    panel = dataclasses.replace(box_element("panel", (0, 0, 3), (9, 2.5, 3.3), ifc_class="IfcSlab"), judgement=timber)
    glulam = dataclasses.replace(box_element("glulam", (0, 0, 3), (40, 0.2, 4), ifc_class="IfcBeam"), judgement=timber)
    assert works(floor, panel, glulam) == {"floor": Means.BUILT, "panel": Means.CRANE, "glulam": Means.CRANE}
    said = "it is 7.7 m wide, the limit is 5.5 m: timber beyond what goes by road in one piece is built in place"
    assert means_of([floor], {}, MeansConfig())["floor"].why == said
    assert means_of([floor], {}, MeansConfig(), selected=True)["floor"].means is Means.CRANE


def test_sandwich_panels_are_built_in_place_however_they_are_drawn():
    panel = box_element("panel", (0, 0, 0), (6, 0.1, 1.1), ifc_class="IfcPlate")
    light = dataclasses.replace(panel, judgement=Judgement(Kind.LIGHT, Confidence.NAMED))
    assert works(BEAM, light)["panel"] is Means.BUILT
    mullion = dataclasses.replace(light, ifc_class="IfcMember")
    assert works(BEAM, mullion)["panel"] is Means.BUILT
    rail = dataclasses.replace(mullion, judgement=Judgement(Kind.LIGHT, Confidence.ASSUMED, "'cladding' in its name"))
    assert works(BEAM, rail)["panel"] is Means.CRANE


def test_steel_beyond_the_road_is_not_cast():
    deck = dataclasses.replace(DECK, judgement=Judgement(Kind.STEEL, Confidence.NAMED))
    assert works(BEAM, deck)["deck"] is Means.CRANE


def test_a_layered_floor_of_concrete_is_concrete_although_its_mean_density_is_not():
    deck = dataclasses.replace(DECK, mass_kg=88e3, mass_source="density")
    assert works(BEAM, deck)["deck"] is Means.CRANE
    assert works(BEAM, dataclasses.replace(deck, judgement=Judgement(Kind.CONCRETE)))["deck"] is Means.IN_SITU


@pytest.mark.parametrize(
    ("high", "says"),
    [
        ((30, 20, 3.6), "it weighs 432.0 t, the limit is 70 t"),
        ((12, 6, 3.45), "it is 6.0 m wide, the limit is 5.5 m"),
        ((41, 0.4, 3.6), "it is 41.0 m long, the limit is 40 m"),
    ],
)
def test_concrete_beyond_what_goes_by_road_is_cast_in_place(high, says):
    part = box_element("part", (0, 0, 3.3), high, ifc_class="IfcSlab")
    found = means_of([BEAM, part], {}, MeansConfig())["part"]
    assert found.means is Means.IN_SITU
    assert found.why.startswith(says)


def test_a_sloping_part_goes_by_road_laid_flat():
    flight = box_element("flight", (0, 0, 0), (9, 6.0, 0.3), ifc_class="IfcStairFlight")
    assert works(BEAM, flight)["flight"] is Means.IN_SITU, "it is 6 m wide"
    brace = box_element("brace", (0, 0, 0), (12, 0.4, 0.4), ifc_class="IfcBeam")
    x, y, z = brace.mesh.vertices_m.T
    up = np.stack([0.6 * x - 0.8 * z, y, 0.8 * x + 0.6 * z], axis=1)
    assert np.ptp(up, axis=0)[[0, 2]].min() > MeansConfig().widest_m
    sloping = dataclasses.replace(brace, mesh=dataclasses.replace(brace.mesh, vertices_m=up))
    assert works(BEAM, sloping)["brace"] is Means.CRANE


def test_steel_of_that_size_is_lifted_or_refused_but_not_cast():
    truss = dataclasses.replace(BEAM, id="truss", mass_kg=7850.0 * 6 * 0.3 * 0.5 * 12, mass_source="density")
    assert works(BEAM, truss)["truss"] is Means.CRANE


def test_what_is_under_a_slab_on_the_ground_that_is_cast_in_place_is_cast_too():
    assert works(BEAM, SLAB, FOOTING) == {"beam": Means.CRANE, "slab": Means.IN_SITU, "footing": Means.IN_SITU}
    assert works(BEAM, DECK, box_element("stool", (2, 2, 0), (4, 4, 3)))["stool"] is Means.CRANE
    assert works(BEAM, SLAB, cast(FOOTING, Casting.PRECAST))["footing"] is Means.CRANE


def test_what_lies_in_the_ground_is_a_foundation_unless_it_is_as_high_as_a_cellar():
    def work(name, low, high, ifc_class="IfcWall", **more):
        return works(BEAM, box_element(name, low, high, ifc_class=ifc_class, **more))[name]

    assert work("crawl_space", (0, 0, -0.9), (21, 0.35, 0)) is Means.IN_SITU
    assert work("ground_beam", (0, 0, -0.5), (6, 0.4, -0.1), "IfcBeam") is Means.IN_SITU
    assert work("pad", (0, 0, -0.8), (1.2, 1.2, -0.2), "IfcFooting") is Means.IN_SITU
    assert work("cellar", (0, 0, -2.5), (6, 0.3, 0)) is Means.CRANE
    assert work("plinth", (0, 0, -0.5), (6, 0.3, 0.4)) is Means.CRANE
    assert work("plank", (0, 0, -0.2), (6, 1.2, 0), "IfcSlab") is Means.CRANE
    assert work("precast", (0, 0, -0.5), (6, 0.4, 0), casting=Casting.PRECAST) is Means.CRANE
    assert work("steel", (0, 0, -0.5), (6, 0.4, 0), judgement=Judgement(Kind.STEEL)) is Means.CRANE


def test_a_stair_in_a_cellar_is_not_cast_because_a_slab_on_the_ground_is_over_it():
    flight = box_element("flight", (2, 2, -0.9), (4, 3, 0.1), ifc_class="IfcStairFlight")
    assert works(SLAB, flight)["flight"] is Means.CRANE


def test_insulation_under_a_slab_on_the_ground_is_laid_and_not_cast():
    strip = box_element("strip", (2, 0, -0.4), (12, 0.5, 0.0), mass_kg=35.0 * 10 * 0.5 * 0.4 * 3)
    strip = dataclasses.replace(strip, mass_source="density")
    found = means_of([BEAM, SLAB, strip], {}, MeansConfig(lift_from_kg=10.0))["strip"]
    assert found.means is Means.BY_HAND
    assert "too light for concrete" in found.why
    guessed = dataclasses.replace(strip, mass_source="default")
    assert works(BEAM, SLAB, guessed, lift_from_kg=10.0)["strip"] is Means.IN_SITU


def test_what_a_few_people_carry_is_set_by_hand():
    assert works(BEAM, LINTEL)["lintel"] is Means.BY_HAND
    assert works(BEAM, LINTEL, lift_from_kg=30.0)["lintel"] is Means.CRANE


def test_no_rule_is_dropped_where_nothing_would_be_left_to_lift():
    assert works(LINTEL) == {"lintel": Means.BY_HAND}
    assert works(cast(BEAM, Casting.IN_SITU)) == {"beam": Means.IN_SITU}
    assert works(DECK) == {"deck": Means.IN_SITU}


def test_the_site_file_overrides_everything():
    entries = [ComponentConfig(global_id="deck", means="crane"), ComponentConfig(global_id="beam", means="by_hand")]
    assert works(BEAM, DECK, LINTEL, entries=entries, lift_from_kg=0.0) == {
        "beam": Means.BY_HAND,
        "deck": Means.CRANE,
        "lintel": Means.CRANE,
    }


def test_a_model_in_which_nothing_is_lifted_says_what_is():
    entries = {"deck": ComponentConfig(global_id="deck", means="in_situ")}
    found = list(means_of([DECK], entries, MeansConfig()).values())
    assert isinstance(nothing_to_lift(found), SelectionError)
    assert str(nothing_to_lift(found)).startswith("nothing to lift: of 1 part, 1 is cast in place")
    assert "no part of the model is a component" in str(nothing_to_lift([]))


def test_what_the_site_file_says_of_a_type_wins_over_kind_casting_and_size():
    stated = [dataclasses.replace(one, stated_means="crane") for one in (cast(DECK, Casting.IN_SITU), LINTEL)]
    assert works(*stated) == {"deck": Means.CRANE, "lintel": Means.CRANE}
    found = means_of([dataclasses.replace(BEAM, stated_means="built")], {}, MeansConfig())
    assert found["beam"] == (Means.BUILT, "the site file says so")
    under = dataclasses.replace(FOOTING, stated_means="crane")
    assert works(SLAB, under)["footing"] is Means.CRANE


def test_masonry_that_a_person_selects_to_be_lifted_is_lifted():
    wall = dataclasses.replace(BEAM, id="wall", judgement=Judgement(Kind.MASONRY, Confidence.NAMED))
    poured = cast(dataclasses.replace(BEAM, id="poured"), Casting.IN_SITU)
    found = means_of([wall, poured], {}, MeansConfig(), selected=True)
    assert {name: one.means for name, one in found.items()} == {"wall": Means.CRANE, "poured": Means.IN_SITU}


def test_concrete_that_no_gear_lifts_is_cast_and_what_is_stated_to_be_precast_is_not():
    deck = box_element("deck", (0, 0, 3.3), (24, 3, 3.6), ifc_class="IfcSlab")
    stated = cast(dataclasses.replace(deck, id="stated"), Casting.PRECAST)
    steel = dataclasses.replace(deck, id="steel", judgement=Judgement(Kind.STEEL, Confidence.NAMED))
    parts = [BEAM, deck, stated, steel]
    found = means_of(parts, {}, MeansConfig(), lambda part: "" if part is BEAM else "no spreader of 25 m carries it")
    assert [found[part.id].means for part in parts] == [Means.CRANE, Means.IN_SITU, Means.CRANE, Means.CRANE]
    assert found["deck"].why.startswith("no spreader of 25 m carries it: concrete that nothing lifts")


def test_parts_of_a_type_of_which_most_are_cast_are_cast_too():
    def walls(*, short, long):
        lengths_m = [3.0] * short + [45.0] * long
        return [
            dataclasses.replace(
                box_element(f"wall-{n}", (0, 9 * n, 0), (x_m, 9 * n + 0.3, 3), ifc_class="IfcWall"),
                name=f"wall {n}",
                judgement=Judgement(Kind.CONCRETE, Confidence.NAMED),
            )
            for n, x_m in enumerate(lengths_m)
        ]

    assert set(works(BEAM, *walls(short=3, long=1)).values()) == {Means.CRANE, Means.IN_SITU}
    assert works(*walls(short=3, long=1))["wall-0"] is Means.IN_SITU
    assert works(*walls(short=20, long=1))["wall-0"] is Means.CRANE
    precast = cast(walls(short=1, long=1)[0], Casting.PRECAST)
    assert works(precast, *walls(short=1, long=1)[1:])["wall-0"] is Means.CRANE
    asked = ComponentConfig(global_id="wall-0", means="crane")
    assert works(*walls(short=3, long=1), entries=[asked])["wall-0"] is Means.CRANE


HEAVY = {
    "long floor": box_element("part", (0, 0, 3), (34, 3, 3.25), ifc_class="IfcSlab"),
    "thick wall": box_element("part", (0, 0, 0), (12, 0.6, 3.9), ifc_class="IfcWall"),
    "block": box_element("part", (0, 0, 0), (4, 2, 3.5), ifc_class="IfcBuildingElementProxy"),
}
SITE = SiteConfig(model=ModelConfig(path="a.ifc"))


@pytest.mark.parametrize("name", sorted(HEAVY))
def test_concrete_that_goes_by_road_but_that_nothing_lifts_is_cast_in_place(name):
    part = HEAVY[name]
    found = means_by(SITE, [part], {})["part"]
    assert found.means is Means.IN_SITU
    assert "that nothing lifts in one piece" in found.why
    assert means_by(SITE, [replace(part, casting=Casting.PRECAST)], {})["part"].means is Means.CRANE


def test_a_crane_with_rigging_of_its_own_is_not_asked_for_gear():
    own = CraneConfig(machine="flat-top-800", base_m=(0.0, -20.0, 0.0), sling_m=4.0, rigging_mass_kg=500.0)
    assert means_by(SITE.model_copy(update={"crane": own}), [HEAVY["block"]], {})["part"].means is Means.CRANE
