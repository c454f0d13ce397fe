from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from log_building import tiny_log
from opened_pages import Opened, failed_proof, passed_proof, revision_of, some_remarks, tiny_source

from bimvox.crane.load_chart import capacity_kg
from bimvox.records.lift import Status
from bimvox.records.unloading import unloading_lifts
from bimvox.rendering.page.document import document_of
from bimvox.rendering.page.page import page_of
from bimvox.rendering.page.source import PageSource


@pytest.fixture(scope="module")
def opened() -> Opened:
    return Opened(page_of(tiny_source(proof=passed_proof())))


def test_the_numbers_of_a_lift_are_those_of_the_log(opened):
    log = tiny_log()
    crane, lifts = log.plan.site.cranes[0], opened.document["revisions"][0]["lifts"]
    assert [lift["order"] for lift in lifts] == [0, 1, 2]
    for record, lift in zip(lifts, log.plan.lifts, strict=True):
        assert record["status"] == lift.status.value
        assert record["method"] == (lift.method.value if lift.method else None)
        assert (record["moves"], record["shortest_moves"]) == (lift.moves, lift.shortest_moves)
        assert record["reason"] == lift.reason
        assert record["blocked_by"] == list(lift.blocked_by)
        assert record["delivery"] == lift.place.delivery
        np.testing.assert_allclose(record["start_m"], log.plan.site.frame.corner_of(lift.place.cell_vox), atol=1e-6)
    for motion in log.motions:
        record, component = lifts[motion.order], log.plan.site.components[motion.component]
        assert record["duration_s"] == motion.loaded.duration_s
        assert record["bound_s"] == motion.loaded.bound_s
        assert record["begins_s"] == motion.start_ns / 1e9
        governs = record["governs"]
        radius_m = np.concatenate([motion.raising.radius_m, motion.loaded.radius_m]).max()
        load_kg = component.mass_kg + crane.rigging_mass_kg
        assert governs["radius_m"] == radius_m  # capacity falls with the radius
        assert governs["capacity_kg"] == pytest.approx(capacity_kg(crane.chart, radius_m))
        assert governs["utilisation"] == pytest.approx(load_kg / capacity_kg(crane.chart, radius_m))
        assert record["set"]["radius_m"] == motion.loaded.radius_m[-1]
        assert record["pick"]["height_m"] == motion.raising.height_m[0]


def test_golden_numbers_of_the_small_plan(opened):
    revision = opened.document["revisions"][0]
    assert (revision["planned"], revision["infeasible"], revision["carried"]) == (2, 1, 3)
    assert revision["begins_s"] == 0.0
    assert revision["ends_s"] == tiny_log().motions[-1].end_ns / 1e9
    first, blocked, last = revision["lifts"]
    assert (first["moves"], first["shortest_moves"], first["method"], first["stored"]) == (17, 15, "policy", "lying_x")
    assert (last["moves"], last["contact_moves"], last["method"], last["stored"]) == (16, 2, "search", "as_built")
    assert (blocked["motion"], blocked["governs"], blocked["proven"]) == (None, None, None)
    assert revision["critical_share"] == tiny_log().plan.site.rules.critical_share == 0.75
    assert first["governs"]["utilisation"] == pytest.approx(4606.370 / 7000.0, abs=1e-6)
    assert first["governs"]["load_kg"] == pytest.approx(4606.370, abs=0.001)
    part = opened.document["parts"][2]
    assert (part["global_id"], part["ifc_class"], part["cells"]) == ("0GlobalIdBeam", "IfcBeam", 4)
    assert part["target_m"] == [3.0, 2.0, 3.0]
    assert part["size_m"] == [4.0, 1.0, 1.0]


def test_a_lift_beyond_the_chart_is_critical_as_in_the_report():
    log = tiny_log()
    crane = log.plan.site.cranes[0]
    short = dataclasses.replace(crane, chart=dataclasses.replace(crane.chart, radius_m=(2.0, 2.5, 3.0)))
    site = dataclasses.replace(log.plan.site, cranes=(short,))
    log = dataclasses.replace(log, plan=dataclasses.replace(log.plan, site=site))
    document, _ = document_of(PageSource((revision_of(log),)))
    lifts = document["revisions"][0]["lifts"]
    assert [lift["critical"] for lift in lifts] == [lift["governs"] is not None for lift in lifts]
    assert {lift["governs"]["utilisation"] for lift in lifts if lift["governs"]} == {None}


def test_what_the_model_says_of_a_part_is_there():
    log = tiny_log()
    site = log.plan.site
    known = dataclasses.replace(
        site.components[0], type_name="C 300", storey="Level 1", material="C30/37", mass_source="quantity"
    )
    site = dataclasses.replace(site, components=(known, *site.components[1:]))
    log = dataclasses.replace(log, plan=dataclasses.replace(log.plan, site=site))
    document, _ = document_of(PageSource((revision_of(log),)))
    part = document["parts"][0]
    assert (part["type_name"], part["storey"], part["material"], part["mass_source"]) == (
        "C 300",
        "Level 1",
        "C30/37",
        "quantity",
    )
    assert document["parts"][1]["storey"] is None


def test_the_slab_and_what_stands_on_it(opened):
    site, document = tiny_log().plan.site, opened.document
    slab = opened.numbers(document["site"]["slab"]).reshape(site.shape[1], site.shape[0])
    assert (slab[:, :4] == 3).all()  # yard
    assert (slab[4:9, 4:10] == 2).all()  # construction area
    assert (slab[:4, 4:] == 1).all()
    (wall,) = document["standing"]
    assert (wall["kind"], wall["geometry"] is None) == ("structure", False)
    assert wall["name"] == next(one.name for one in site.blockers if one.id == wall["id"])
    (truck,) = document["revisions"][0]["obstructions"]
    assert truck["id"] == "truck-7"
    assert opened.numbers(truck["boxes"]).reshape(-1, 6).tolist() == [[7, 2, 1, 8, 4, 3]]


def test_the_slab_shows_the_access_of_trucks():
    log = tiny_log()
    site = log.plan.site
    site = dataclasses.replace(site, access=site.yard & (np.arange(site.shape[0]) < 2)[:, None])
    log = dataclasses.replace(log, plan=dataclasses.replace(log.plan, site=site))
    page = Opened(page_of(PageSource((revision_of(log),))))
    slab = page.numbers(page.document["site"]["slab"]).reshape(site.shape[1], site.shape[0])
    assert (slab[:, :2][site.yard.T[:, :2]] == 4).all()
    assert (slab[:, 2:4] == 3).all()


def test_shapes_are_within_a_millimetre_of_the_log(opened):
    for part, component in zip(opened.document["parts"], tiny_log().plan.site.components, strict=True):
        shape = opened.document["geometries"][part["geometry"]]
        points = opened.numbers(shape["points"]).reshape(-1, 3) * shape["step_m"] + part["low_m"] + part["target_m"]
        off_m = np.abs(points[:, None] - component.mesh.vertices_m[None]).max(axis=2).min(axis=1)
        assert off_m.max() <= 0.001
        boxes = opened.numbers(part["boxes"]).reshape(-1, 6)
        np.testing.assert_array_equal(boxes, component.shape.boxes)


def test_a_proof_is_of_lifts_and_says_what_failed():
    document, _ = document_of(tiny_source(proof=failed_proof("0GlobalIdBeam")))
    revision = document["revisions"][0]
    assert [lift["proven"] for lift in revision["lifts"]] == [True, None, False]
    assert not revision["proof"]["verified"]
    assert "truck-7" in revision["proof"]["checks"][0]["failures"][0]
    document, _ = document_of(tiny_source())
    assert document["revisions"][0]["proof"] is None
    assert all(lift["proven"] is None for lift in document["revisions"][0]["lifts"])


def test_a_revision_says_what_it_changed():
    before = tiny_log()
    beam = before.plan.lifts[2]
    detour = np.concatenate([beam.path_vox[:1] + np.array([0, 0, 1]), beam.path_vox])
    lifts = (*before.plan.lifts[:2], dataclasses.replace(beam, path_vox=detour.astype(np.int32)))
    labels = before.plan.site.labels.copy()
    labels[3, 3, 3] = 5
    site = dataclasses.replace(before.plan.site, labels=labels)
    after = dataclasses.replace(before, plan=dataclasses.replace(before.plan, site=site, lifts=lifts), revision=4)
    document, _ = document_of(PageSource((revision_of(before), revision_of(after))))
    first, second = document["revisions"]
    assert first["changes"] is None
    assert second["changes"] == {"since": 3, "kept": [0], "replanned": [2], "infeasible": [1], "changed_cells": 1}
    # What a revision keeps is stored once.
    assert len(document["motions"]) == 2


def test_lifts_that_an_extract_does_not_carry_are_named_without_motion():
    document, _ = document_of(PageSource((revision_of(tiny_log().extract([2])),)))
    revision = document["revisions"][0]
    assert [lift["carried"] for lift in revision["lifts"]] == [False, False, True]
    assert [lift["motion"] is not None for lift in revision["lifts"]] == [False, False, True]
    assert revision["begins_s"] == revision["lifts"][2]["begins_s"] > 0


def test_a_site_without_a_crane_has_nominal_times():
    document, _ = document_of(tiny_source(crane=False))
    revision = document["revisions"][0]
    assert document["crane"] is None
    assert not revision["timed"]
    planned = [lift for lift in revision["lifts"] if lift["status"] == Status.PLANNED.value]
    assert [document["motions"][lift["motion"]]["arrived_s"] for lift in planned] == [
        float(lift["moves"]) for lift in planned
    ]


def test_a_revision_has_its_verdict_and_its_remarks():
    remarks = some_remarks()
    document = Opened(page_of(tiny_source(proof=passed_proof(), remarks=remarks))).document
    (revision,) = document["revisions"]
    assert revision["remarks"] == [remark.to_dict() for remark in remarks]
    assert revision["verdict"] == {
        "proof": "proven",
        "proof_light": "serious",
        "remarks": "⚠\ufe0e 3 remarks (1 serious)",
        "remarks_light": "serious",
    }


def test_lifts_proven_against_earlier_obstructions_only_are_marked():
    proof = dataclasses.replace(passed_proof(), not_current=("0GlobalIdBeam",))
    (revision,) = Opened(page_of(tiny_source(proof=proof))).document["revisions"]
    assert [lift["current"] for lift in revision["lifts"]] == [True, True, False]
    assert [lift["number"] for lift in revision["proof"]["not_current"]] == [3]


def test_parts_that_the_crane_unloads_say_how():
    log = tiny_log()
    site = dataclasses.replace(log.plan.site, access=~log.plan.site.yard)
    with_access = dataclasses.replace(log, plan=dataclasses.replace(log.plan, site=site))
    bare, data = (Opened(page_of(PageSource((revision_of(one),)))).document for one in (log, with_access))
    assert "deliveries" not in bare["revisions"][0]
    (revision,) = data["revisions"]
    wanted = {one.order: one for one in unloading_lifts(site, [one for one in log.plan.lifts if one.place])}
    found = {lift["order"]: lift["unloading"] for lift in revision["lifts"] if "unloading" in lift}
    assert found.keys() == wanted.keys()
    for order, one in found.items():
        assert one["radius_m"] == pytest.approx(wanted[order].radius_m, abs=1e-3)
        assert one["utilisation"] == pytest.approx(wanted[order].utilisation, abs=1e-6)
    assert [one["number"] for one in revision["deliveries"]] == [0, 1]
    assert revision["deliveries"][0]["begins_s"] is None
