"""Parts that float, alone or together, are named; parts that something carries or holds are not."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from drawn_plans import motions_by_hand, plan_by_hand
from remarked_plans import named, of_kind, plan_of
from slab_yards import slab_site

from bimvox.bim.building import TriangleMesh
from bimvox.bim.kinds.kind import Confidence, Judgement, Kind
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.records.lift import Guide, Lift, LiftPlan, ModelledClash, Status
from bimvox.records.proof import Severity
from bimvox.site.means import Means

COLUMN = ("column", (2.0, 2.0, 0.0), (2.5, 2.5, 3.0))
BEAM = ("beam", (2.0, 2.0, 3.0), (6.0, 2.5, 3.5))
CLOUD = ("cloud", (8.0, 8.0, 5.9), (9.0, 9.0, 6.4))
NEXT = ("next", (9.0, 8.0, 5.9), (10.0, 9.0, 6.4))


def test_a_part_that_touches_nothing_is_serious_and_says_how_high() -> None:
    (remark,) = of_kind(plan_of([COLUMN, BEAM, CLOUD]), "floats")
    assert (remark.component, remark.severity) == ("cloud", Severity.SERIOUS)
    assert remark.text == "floats 5.9 m above the ground: nothing is under it or next to it"


def test_parts_that_hold_only_each_other_all_float() -> None:
    found = named(plan_of([COLUMN, CLOUD, NEXT]), "floats")
    assert set(found) == {"cloud", "next"}
    assert "it touches only another part that floats" in found["next"]


def test_a_part_on_structure_or_next_to_a_held_part_does_not_float() -> None:
    wall = [("wall", (8.0, 8.0, 0.0), (9.0, 9.0, 5.9))]
    assert not named(plan_of([COLUMN, BEAM, CLOUD, NEXT], structure=wall), "floats")


def test_a_joint_is_not_a_gap_but_a_decimetre_is() -> None:
    above = {gap: ("beam", (2.0, 2.0, 3.0 + gap), (6.0, 2.5, 3.5 + gap)) for gap in (0.04, 0.1)}
    assert not named(plan_of([COLUMN, above[0.04]]), "floats")
    assert set(named(plan_of([COLUMN, above[0.1]]), "floats")) == {"beam"}


def test_what_rests_on_a_refused_part_floats() -> None:
    assert set(named(plan_of([COLUMN, BEAM], refused=["column"]), "floats")) == {"beam"}


def test_what_rests_on_a_part_that_is_set_otherwise_does_not_float() -> None:
    plan = plan_of([COLUMN, BEAM], refused=["column"])
    lifts = (dataclasses.replace(plan.lifts[0], by_other_means=True), *plan.lifts[1:])
    assert plan.site.components[lifts[0].component].id == "column"
    assert not named(dataclasses.replace(plan, lifts=lifts), "floats")


def test_a_model_that_is_rounded_down_to_a_cell_stands_on_the_ground() -> None:
    low = ("slab", (2.0, 2.0, 0.3), (6.0, 6.0, 0.5))
    assert not named(plan_of([low]), "floats")
    (note,) = of_kind(plan_of([low]), "assumed_ground")
    assert "300 mm above it, stands on it" in note.text


def test_a_part_inside_another_one_does_not_float() -> None:
    core = ("core", (2.2, 2.2, 1.0), (2.3, 2.3, 2.0))
    assert not named(plan_of([COLUMN, core]), "floats")


def test_an_extract_has_no_remarks_about_parts_that_it_does_not_carry() -> None:
    plan = plan_of([COLUMN, BEAM, CLOUD])
    extract = LiftPlan(plan.site, plan.lifts[1:2])
    assert not of_kind(extract, "floats", context=(plan.lifts[0], plan.lifts[2]))
    refused = Lift(0, 0, None, Status.INFEASIBLE)
    assert of_kind(extract, "floats", context=(refused, plan.lifts[2]))


def test_a_part_between_others_hangs_unless_something_is_under_it() -> None:
    columns = [("a", (2.0, 2.0, 0.0), (2.5, 2.5, 6.0)), ("b", (6.0, 2.0, 0.0), (6.5, 2.5, 6.0))]
    beam = ("beam", (2.5, 2.0, 3.0), (6.0, 2.5, 3.5))
    (remark,) = of_kind(plan_of([*columns, beam]), "hangs")
    assert (remark.component, remark.severity) == ("beam", Severity.MINOR)
    corbel = ("corbel", (2.5, 2.0, 2.6), (2.8, 2.5, 2.98))
    assert not of_kind(plan_of([*columns, beam], structure=[corbel]), "hangs")
    assert not of_kind(plan_of([COLUMN, BEAM, CLOUD]), "hangs")


def test_a_part_set_before_what_holds_it_is_named() -> None:
    (remark,) = of_kind(plan_of([COLUMN, BEAM], unheld=("beam",)), "unheld")
    assert (remark.component, remark.severity) == ("beam", Severity.SERIOUS)


def test_a_building_without_foundations_is_one_remark() -> None:
    cloud = [(f"cloud {n}", (float(n), 2.0, 1.5), (n + 1.0, 3.0, 2.5)) for n in range(12)]
    (remark,) = of_kind(plan_of([*cloud, ("column", (2.0, 8.0, 0.0), (2.5, 8.5, 3.0))]), "floats")
    assert (remark.component, remark.severity) == (None, Severity.SERIOUS)
    assert remark.text.startswith("12 parts float 1.5 m above the ground and touch only each other: foundations are")


def weighing(mass_kg: float, *, is_open: bool = False) -> LiftPlan:
    """A plan of one part of 2 m3."""
    plan = plan_of([("part", (1.0, 1.0, 0.0), (3.0, 2.0, 1.0))])
    (part,) = plan.site.components
    mesh = TriangleMesh(part.mesh.vertices_m, np.delete(part.mesh.faces, 0, axis=0)) if is_open else part.mesh
    site = dataclasses.replace(plan.site, components=(dataclasses.replace(part, mass_kg=mass_kg, mesh=mesh),))
    return dataclasses.replace(plan, site=site)


@pytest.mark.parametrize("kg_m3", [80.0, 420.0, 2500.0, 7850.0, 8900.0])
def test_what_is_built_with_is_not_odd(kg_m3: float) -> None:
    assert not named(weighing(2.0 * kg_m3), "density")


@pytest.mark.parametrize(
    ("kg_m3", "severity", "says"),
    [
        (7.85, Severity.SERIOUS, "weighs 16 kg, 8 kg/m3 of what it encloses: lighter than a building part"),
        (40.0, Severity.MINOR, "weighs 80 kg, 40 kg/m3 of what it encloses: lighter than a building part"),
        (11_300.0, Severity.MINOR, "weighs 22.6 t, 11,300 kg/m3 of what it encloses: denser than steel"),
        (19_300.0, Severity.SERIOUS, "weighs 38.6 t, 19,300 kg/m3 of what it encloses: denser than steel"),
    ],
)
def test_an_odd_density_is_remarked(kg_m3: float, severity: Severity, says: str) -> None:
    (remark,) = of_kind(weighing(2.0 * kg_m3), "density")
    assert remark.severity is severity
    assert remark.component == "part"
    assert remark.text.startswith(says)


@pytest.mark.parametrize(
    ("doubted_kg", "mass_kg", "says"),
    [
        (
            (44.0, 4262.5),
            4262.5,
            "the model states 44 kg, but by volume and material it weighs 4,262 kg: it is planned",
        ),
        ((25_000.0, 2500.0), 25_000.0, "the model states 25,000 kg, but by volume and material it weighs 2,500 kg"),
        ((2.45, 2500.0), 2500.0, "the model states 2.45 kg, but"),
        ((-3000.0, 2500.0), 2500.0, "the model states -3,000 kg, but"),
    ],
)
def test_a_stated_mass_that_volume_and_material_contradict_is_serious(
    doubted_kg: tuple[float, ...], mass_kg: float, says: str
) -> None:
    plan = weighing(mass_kg)
    (part,) = plan.site.components
    site = dataclasses.replace(plan.site, components=(dataclasses.replace(part, doubted_kg=doubted_kg),))
    (remark,) = of_kind(dataclasses.replace(plan, site=site), "stated_mass")
    assert (remark.component, remark.severity) == ("part", Severity.SERIOUS)
    assert remark.text.startswith(says)
    assert f"planned with {mass_kg:,.0f} kg; say what it weighs ([[component]] mass_kg)" in remark.text
    assert not named(plan, "stated_mass")


def test_nothing_is_said_of_an_open_mesh() -> None:
    assert not named(weighing(20.0, is_open=True), "density")


def test_a_guided_load_is_remarked_with_its_tilt():
    plan = plan_by_hand(crane=True)
    guide = Guide(0.0, (0.0, 0.0, 0.0), ((1.0, 0.0, 0.0), (0.5, 0.06, -0.04), (0.0, 0.0, 0.0)))
    lifts = (dataclasses.replace(plan.lifts[0], guide=guide), *plan.lifts[1:])
    guided = dataclasses.replace(plan, lifts=lifts)
    (remark,) = of_kind(guided, "guided", motions_by_hand(guided))
    assert remark.severity is Severity.MINOR
    assert remark.component == plan.site.components[plan.lifts[0].component].id
    assert "tilted by 2.3 degrees and held 0.06 m aside, from 1.0 m above it" in remark.text
    assert of_kind(plan, "guided", motions_by_hand(plan)) == []


PARTS = [(name, (2.0 * n + 2.0, 2.0, 0.0), (2.0 * n + 3.0, 3.0, 3.0)) for n, name in enumerate("abc")]


def clash(first: str, second: str, depth_m: float, *, way: bool = True) -> ModelledClash:
    return ModelledClash(first, second, depth_m, (depth_m, 0.0, 0.0) if way else None)


def test_a_deep_pair_names_both_parts_with_the_depth() -> None:
    found = named(plan_of(PARTS, clashes=(clash("a", "b", 2.0), clash("a", "c", 0.06))), "overlap")
    assert found == {
        "a": "is drawn 2000 mm into b, and 1 more",
        "b": "is drawn 2000 mm into a",
        "c": "is drawn 60 mm into a",
    }


def test_a_depth_of_tolerance_is_a_note_with_the_count() -> None:
    plan = plan_of(PARTS, clashes=(clash("a", "b", 0.05), clash("b", "c", 0.012)))
    assert not named(plan, "overlap")
    (note,) = of_kind(plan, "small_overlaps")
    assert note.severity is Severity.NOTE
    assert note.text == "parts overlap in the model by up to 50 mm, and may do so when they are set: 2 pairs"


def test_a_pair_without_a_way_out_is_serious_whatever_depth_is_listed() -> None:
    (first, second) = of_kind(plan_of(PARTS, clashes=(clash("a", "b", 0.02, way=False),)), "overlap")
    assert first.severity is Severity.SERIOUS
    assert first.text == "is drawn at least 20 mm into b"
    assert second.name == "b"


@pytest.mark.parametrize(
    ("changes", "is_serious"),
    [
        ({}, True),
        ({"judgement": Judgement(Kind.PRECAST, Confidence.STATED)}, True),
        ({"judgement": Judgement(Kind.STEEL, Confidence.NAMED)}, True),
        ({"judgement": Judgement(Kind.TIMBER, Confidence.NAMED)}, False),
        ({"judgement": Judgement(Kind.MASONRY, Confidence.NAMED)}, False),
        ({"means": Means.IN_SITU}, False),
        ({"means": Means.BUILT}, False),
        ({"means": Means.BY_HAND}, False),
    ],
)
def test_what_is_cut_or_cast_around_the_other_part_is_not_serious(changes: dict, is_serious: bool) -> None:
    plan = plan_of(PARTS, clashes=(clash("a", "b", 0.2),))
    parts = plan.site.components
    site = dataclasses.replace(plan.site, components=(dataclasses.replace(parts[0], **changes), *parts[1:]))
    found = of_kind(dataclasses.replace(plan, site=site), "overlap")
    assert {remark.severity for remark in found} == {Severity.SERIOUS if is_serious else Severity.MINOR}
    assert all(remark.text.endswith("is cut, cast or built on site") for remark in found) is not is_serious


def test_the_pair_that_cannot_be_set_is_named_first() -> None:
    plan = plan_of(PARTS, clashes=(clash("a", "b", 0.5), clash("a", "c", 0.1)))
    parts = list(plan.site.components)
    parts[1] = dataclasses.replace(parts[1], means=Means.IN_SITU)
    site = dataclasses.replace(plan.site, components=tuple(parts))
    assert named(dataclasses.replace(plan, site=site), "overlap")["a"] == "is drawn 100 mm into c, and 1 more"


@pytest.mark.parametrize(
    ("name", "ifc_class", "is_serious"),
    [
        ("Bohrpfahl 3", "IfcMember", False),
        ("POER", "", False),
        ("F1", "IfcFooting", False),
        ("P-12", "IfcPile", False),
        ("old wall", "IfcWall", True),
        ("", "", True),
    ],
)
def test_a_column_stands_in_the_pocket_of_its_footing(name: str, ifc_class: str, is_serious: bool) -> None:
    plan = plan_of(
        PARTS[:1], clashes=(clash("a", "under", 0.2),), structure=[("under", (2.0, 2.0, 0.0), (3.0, 3.0, 0.2))]
    )
    changes = {"name": name, "ifc_class": ifc_class}
    named_so = [dataclasses.replace(one, **changes) if one.id == "under" else one for one in plan.site.blockers]
    plan = dataclasses.replace(plan, site=dataclasses.replace(plan.site, blockers=tuple(named_so)))
    (found,) = of_kind(plan, "overlap")
    assert (found.severity is Severity.SERIOUS) is is_serious


def part_of(size: tuple[float, float, float], mass_kg: float = 1000.0) -> LiftPlan:
    x, y, z = size
    plan = plan_of([("part", (1.0, 1.0, 0.0), (1.0 + x, 1.0 + y, z))], shape=(140, 40, 40))
    (component,) = plan.site.components
    site = dataclasses.replace(plan.site, components=(dataclasses.replace(component, mass_kg=mass_kg),))
    return dataclasses.replace(plan, site=site)


@pytest.mark.parametrize(
    ("size", "mass_kg"),
    [((12.0, 2.4, 0.3), 24_000.0), ((0.4, 0.4, 13.0), 5000.0), ((6.0, 0.2, 3.6), 9000.0), ((8.0, 3.5, 0.3), 20_000.0)],
    ids=["slab", "column", "panel", "panel drawn flat"],
)
def test_ordinary_precast_parts_go_by_lorry(size: tuple[float, float, float], mass_kg: float) -> None:
    assert not named(part_of(size, mass_kg), "transport")


@pytest.mark.parametrize(
    ("size", "mass_kg", "said"),
    [
        ((20.0, 0.5, 1.2), 20_000.0, "is 20.0 m long (a lorry takes 13.6 m)"),
        ((8.0, 4.2, 0.3), 20_000.0, "is 4.2 m wide (a lorry takes 3.0 m)"),
        ((4.0, 3.0, 2.9), 20_000.0, "is 2.9 m high (a lorry takes 2.8 m)"),
        ((10.0, 1.0, 1.0), 30_000.0, "weighs 30.0 t (a lorry carries 24.0 t)"),
    ],
)
def test_what_needs_a_permit_is_minor(size: tuple[float, float, float], mass_kg: float, said: str) -> None:
    (remark,) = of_kind(part_of(size, mass_kg), "transport")
    assert remark.severity is Severity.MINOR
    assert said in remark.text
    assert remark.text.endswith("a special transport with a permit")


@pytest.mark.parametrize(
    ("size", "mass_kg"),
    [((10.0, 8.0, 0.3), 60_000.0), ((42.0, 1.0, 2.0), 69_000.0), ((10.0, 4.0, 0.3), 145_800.0), ((5.0, 5.0, 4.2), 9e3)],
    ids=["wide", "long", "cast in place", "high"],
)
def test_what_cannot_go_by_road_is_serious(size: tuple[float, float, float], mass_kg: float) -> None:
    (remark,) = of_kind(part_of(size, mass_kg), "transport")
    assert remark.severity is Severity.SERIOUS
    assert remark.text.endswith("it cannot go by road in one piece")


def test_a_part_turned_on_plan_is_measured_along_itself() -> None:
    plan = part_of((12.0, 1.0, 1.0), 20_000.0)
    (component,) = plan.site.components
    x, y, z = component.mesh.vertices_m.T
    vertices = component.mesh.vertices_m.copy()
    vertices[:, 0], vertices[:, 1], vertices[:, 2] = 0.6 * x - 0.8 * y + 5.0, 0.8 * x + 0.6 * y, z
    turned = dataclasses.replace(component, mesh=dataclasses.replace(component.mesh, vertices_m=vertices))
    site = dataclasses.replace(plan.site, components=(turned,))
    assert not named(dataclasses.replace(plan, site=site), "transport")


def test_a_brace_is_laid_flat_on_a_lorry() -> None:
    plan = part_of((8.0, 0.1, 0.1))
    (component,) = plan.site.components
    x, y, z = component.mesh.vertices_m.T
    vertices = np.stack([0.6 * x - 0.8 * z, y, 0.8 * x + 0.6 * z], axis=1)
    brace = dataclasses.replace(component, mesh=dataclasses.replace(component.mesh, vertices_m=vertices))
    site = dataclasses.replace(plan.site, components=(brace,))
    assert not named(dataclasses.replace(plan, site=site), "transport")


@pytest.mark.parametrize(
    ("mass_kg", "said"),
    [(21.0, "one person carries that"), (25.0, "one person carries that"), (70.0, "by the bundle"), (76.0, None)],
)
def test_what_a_person_carries_needs_no_separate_lift(mass_kg: float, said: str | None) -> None:
    found = of_kind(part_of((1.0, 0.2, 0.1), mass_kg), "hand_load")
    assert len(found) == (said is not None)
    assert all(said in remark.text and remark.severity is Severity.MINOR for remark in found if said)


@pytest.mark.parametrize(("payload_kg", "lorries", "why"), [
    (24_000.0, "1 lorry, ", "weigh 0.3 loads, and fewer lorries cannot"),
    (8_000.0, "2 lorries, ", "weigh 1.0 loads, and the yard"),
])  # fmt: skip
def test_lorries_that_are_not_full_are_named_with_the_reason(payload_kg, lorries, why) -> None:
    site = slab_site(((4.0, 2.0, 0.2),) * 2, crane=False, rules={"truckload_kg": payload_kg})
    plan = plan_lifts(site, prepare(site))
    if payload_kg == 8_000.0:  # in two deliveries
        first, second = plan.lifts
        assert second.place is not None
        later = dataclasses.replace(second, place=dataclasses.replace(second.place, delivery=1))
        plan = dataclasses.replace(plan, lifts=(first, later))
    (remark,) = of_kind(plan, "lorries")
    assert remark.severity is Severity.NOTE
    assert remark.text.startswith(lorries)
    assert why in remark.text


def test_full_lorries_are_not_worth_a_remark() -> None:
    site = slab_site(((4.0, 2.0, 0.2),) * 2, crane=False, rules={"truckload_kg": 8_000.0})
    assert not of_kind(plan_lifts(site, prepare(site)), "lorries")
