"""A whole plan is never lost to one part, whatever its body is like."""

import pytest
from box_buildings import box_element, building_of
from hostile_bodies import BODIES, NAME, hostile_frame

import bimvox
from bimvox.bim.building import Casting, Role
from bimvox.library import prove
from bimvox.records.lift import Status
from bimvox.records.proof import Check, Verification

_REFUSED = ("tiny", "below the ground", "far away", "in a wrong unit")
"""Bodies that no crane can lift: the part is named with a reason, or left out with a note."""
_EVERY_TIME = (
    "sliver of 0.27 mm in one piece",
    "spike of 6 mm through a column",
    "open shell drawn 0.15 m in",
    "doubled faces, both sides",
    "flat",
    "as the slab",
    "far away",
    "in a wrong unit",
    "tiny",
)
_IN_THE_WAY = ("drawn into everything",)


def _plan(building):
    return bimvox.plan(bimvox.guess_site(building, voxel_size_m=0.25), jobs=1)


_OTHERS = [pytest.param(name, marks=pytest.mark.slow) for name in BODIES if name not in (*_EVERY_TIME, *_IN_THE_WAY)]


@pytest.mark.parametrize("body", [*_EVERY_TIME, *_OTHERS])
def test_one_bad_body_does_not_cost_the_good_parts(body):
    plan = _plan(hostile_frame(BODIES[body]()))
    assert plan.verified
    assert {lift.name: lift.reason for lift in plan.infeasible if lift.name != NAME} == {}
    bad = next((lift for lift in plan.lifts if lift.name == NAME), None)
    if body not in _REFUSED:
        assert bad is not None
        assert bad.is_planned, bad.reason
    elif bad is not None:
        assert bad.reason


@pytest.mark.parametrize(
    "mass_kg", [1e-6, *(pytest.param(kg, marks=pytest.mark.slow) for kg in (1e9, 1e12)), 2.1546e12]
)
def test_an_absurd_mass_costs_its_own_lift_at_most(mass_kg):
    plan = _plan(hostile_frame(BODIES["inside out"](), mass_kg=mass_kg))
    assert plan.verified
    assert {lift.name for lift in plan.lifts if lift.lift.status is Status.INFEASIBLE} <= {NAME}


@pytest.mark.parametrize("mass_kg", [1e-9, 2.1546e12])
def test_a_part_cast_in_place_needs_no_mass_that_makes_sense(mass_kg):
    plan = _plan(hostile_frame(BODIES["open shell"](), mass_kg=mass_kg, casting=Casting.IN_SITU))
    assert plan.verified
    assert [lift.name for lift in plan.lifts if lift.lift.status is Status.IN_SITU] == [NAME]
    assert not plan.infeasible or all(lift.name == NAME for lift in plan.infeasible)


@pytest.mark.parametrize("wrong", [{NAME}, {"column-1", "slab"}])
def test_a_failure_that_names_no_part_costs_only_the_lifts_that_cause_it(monkeypatch, wrong):
    verify = prove.verify_plan

    def failing(plan, **more):
        ids = {plan.site.components[lift.component].id for lift in plan.lifts if lift.status is Status.PLANNED}
        check = Check("timeline")
        check.look(not ids & wrong, "the motions do not follow each other")
        return Verification((*verify(plan, **more).checks, check))

    monkeypatch.setattr(prove, "verify_plan", failing)
    plan = _plan(hostile_frame(BODIES["inside out"]()))
    assert plan.verified
    assert {lift.name for lift in plan.infeasible} == wrong
    assert all("could not be proven" in (lift.reason or "") for lift in plan.infeasible)


def test_a_clash_that_the_proof_does_not_measure_is_not_listed(monkeypatch):
    """Its lifts are proven as all others are."""
    from bimvox.planning.contact.pairs import Contacts, ModelledClash

    find = Contacts._find_clashes
    wrong = ModelledClash("column-0", "beam", 0.5, (0.5, 0.0, 0.0))
    monkeypatch.setattr(Contacts, "_find_clashes", lambda self: (*find(self), wrong))
    plan = _plan(hostile_frame(BODIES["drawn 0.15 m in"]()))
    assert plan.verified
    assert not plan.infeasible
    assert [(clash.first, clash.second) for clash in plan.clashes] == [("column-0", NAME)]
    assert plan.preparation is not None
    assert plan.preparation.contacts.clashes == plan.clashes


def test_long_planks_of_a_low_building_get_a_grid_as_high_as_their_slings():
    strips = [
        box_element(f"strip-{n}", (0, y, 0), (9, y + 0.4, 0.4), role=Role.STRUCTURE) for n, y in enumerate((0, 17.6))
    ]
    planks = [box_element(f"plank-{n}", (3 * n, 0, 0.4), (3 * n + 3, 18, 0.46), ifc_class="IfcSlab") for n in range(3)]
    site = bimvox.guess_site(building_of(*strips, *planks), voxel_size_m=0.25)
    highest = max(part.target_vox[2] + part.lifting.sling_rise_vox for part in site.components)
    assert highest < site.site.shape[2]
    plan = bimvox.plan(site, jobs=1)
    assert plan.verified
    assert not plan.infeasible
