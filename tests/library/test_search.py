"""``verify --search``: what is called infeasible is infeasible for the reason given, and fewest moves are fewest."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
import seeded_faults as faults
from bimvox_cli.main import run as command
from box_sites import box_cells, box_site, test_crane
from two_cranes import two_crane_plan

import bimvox
from bimvox.library import search
from bimvox.library.plan_value import write_log_file
from bimvox.library.search import check_search
from bimvox.library.site import SITE_FILE
from bimvox.library.verify import prove_plan
from bimvox.log.plan_log import PlanLog
from bimvox.planning.assembly import Preparation
from bimvox.planning.preparation import preparation_in
from bimvox.progress import SilentProgress
from bimvox.records.lift import Epoch, Guide, Status
from bimvox.records.proof import Check
from bimvox.site.config.rules import RulesConfig
from bimvox.site.default_rules import ALL_KEPT, Kept
from bimvox.site.site import Blocker, Rules, Site

SAMPLES = Path(__file__).parents[2] / "sample_models"


@pytest.fixture(scope="module")
def good() -> PlanLog:
    return faults.good_log()


def searched(log: PlanLog) -> Check:
    return check_search(log, SilentProgress())


def site_with(crane: bool = True, **more: object) -> Site:
    own = test_crane(base=(10.0, -3.0, 0.0), jib=40.0, height=14.0) if crane else None
    return box_site(faults.PARTS, structure=[faults.WALL], crane=own, shape=(40, 30, 24), **more)


def obstructed(site: Site, low: tuple[float, float, float], high: tuple[float, float, float]) -> Site:
    crate = Blocker("crate", "obstruction", box_cells(site.frame, low, high))
    return dataclasses.replace(site, blockers=(*site.blockers, crate))


def over(site: Site, name: str) -> Site:
    """A crate in the place of a part."""
    part = next(part for part in site.components if part.id == name)
    low = site.frame.corner_of(np.array(part.target_vox))
    return obstructed(site, tuple(low), tuple(low + 0.5))


def parted(site: Site) -> Site:
    """A curtain between the building and the yard, as high as the site."""
    cells = np.zeros(site.shape, bool)
    cells[16, :, 1:] = True
    curtain = Blocker("curtain", "obstruction", np.argwhere(cells).astype(np.int32))
    return dataclasses.replace(site, blockers=(*site.blockers, curtain))


def test_a_good_plan_is_confirmed(good: PlanLog) -> None:
    check = searched(good)
    assert (check.passed, check.samples, check.undecided) == (True, 4, [])


@pytest.mark.parametrize("name", faults.FALSE_CLAIMS)
def test_a_false_claim_is_named(good: PlanLog, tmp_path: Path, name: str) -> None:
    forge, says = faults.FALSE_CLAIMS[name]
    write_log_file(tmp_path / "log.mcap", forge(good))
    assert bimvox.verify(tmp_path / "log.mcap").verified
    verdict = bimvox.verify(tmp_path / "log.mcap", search=True)
    (check,) = [check for check in verdict.checks if not check.passed]
    assert check.name == "search"
    assert any(says in failure for failure in check.failures), check.failures
    assert all(failure.startswith("lift ") for failure in check.failures)


@pytest.fixture(scope="module")
def careful() -> PlanLog:
    return faults.careful_log()


def test_a_plan_that_keeps_all_clearances_is_confirmed(careful: PlanLog) -> None:
    assert all(lift.kept == ALL_KEPT for lift in careful.plan.lifts)
    check = searched(careful)
    assert (check.passed, check.samples, check.undecided) == (True, 4, [])


@pytest.mark.parametrize("name", faults.GIVES_WAY_IN_VAIN)
def test_a_lift_that_gives_way_in_vain_is_named(careful: PlanLog, tmp_path: Path, name: str) -> None:
    forge, says = faults.GIVES_WAY_IN_VAIN[name]
    forged = forge(careful)
    write_log_file(tmp_path / "log.mcap", forged)
    verdict = bimvox.verify(tmp_path / "log.mcap")
    assert verdict.verified, verdict.failures
    (claim,) = [claim for claim in verdict.claims if claim.name == "gives_way"]
    assert claim.count == sum(lift.kept != ALL_KEPT for lift in forged.plan.lifts)
    check = searched(forged)
    assert any(says in failure for failure in check.failures), check.failures


@pytest.mark.parametrize(
    ("kept", "says"), [(1.9, "keeps a transit_clearance_m of 1.9 m"), (2.5, "of 2.5 m, which is not fewer cells")]
)
def test_a_smaller_clearance_of_as_many_cells_is_refused(careful: PlanLog, kept: float, says: str) -> None:
    verdict = prove_plan(faults.with_lift(careful, "beam", clearance_m=kept), SilentProgress())
    assert {check.name for check in verdict.checks if not check.passed} >= {"margin"}
    assert any(says in failure for failure in verdict.failures)


def test_a_clearance_that_no_path_keeps_is_confirmed() -> None:
    rules = RulesConfig(wind_speed_m_s=0.0).rules(has_crane=True)
    parts = [("a", (2.0, 2.0, 0.0), (3.0, 3.0, 1.0), {"start_vox": (22, 5, 1)})]
    # Above its place in the yard a beam is in the rope's way.
    beam = ("beam", (12.0, 2.5, 6.0), (12.5, 4.0, 7.0))
    log = faults.log_of(box_site(parts, structure=[beam], rules=rules, crane=test_crane(base=(13.0, 13.0, 0.0))))
    assert [lift.kept for lift in log.plan.lifts] == [Kept(None, 0.0)]
    check = searched(log)
    assert (check.failures, check.undecided) == ([], [])


def test_a_heading_that_is_kept_in_vain_is_named() -> None:
    log = faults.kept_headings_in_vain()
    assert prove_plan(log, SilentProgress()).verified
    check = searched(log)
    assert check.failed == 4
    assert all("it keeps its heading, but there is room to turn with the jib" in text for text in check.failures)


def test_a_crew_that_guides_in_vain_is_named(good: PlanLog) -> None:
    lift = faults.lift_of(good, "right")
    top_m = lift.contact_moves * good.plan.site.frame.voxel_size_m or 1.0
    guide = Guide(0.0, (0.0, 0.0, 0.0), ((top_m, 0.0, 0.0), (0.5 * top_m, 0.0, 0.01), (0.0, 0.0, 0.0)))
    check = searched(faults.with_lift(good, "right", guide=guide))
    assert any("(right): a crew guides it on its last moves, but it fits hanging" in text for text in check.failures)


def test_what_was_planned_before_a_change_is_undecided(careful: PlanLog) -> None:
    forged = faults.with_lift(careful, "beam", rope_clearance_m=0.0)
    check = searched(dataclasses.replace(forged, revision=1))
    assert check.passed
    assert any("may have been planned before something on the site changed" in text for text in check.undecided)


KINDS = {
    "blocked at its place": (lambda: over(site_with(), "beam"), "it is blocked at its place"),
    "too heavy": (
        lambda: dataclasses.replace(
            (site := site_with()),
            components=tuple(
                dataclasses.replace(part, mass_kg=50_000.0) if part.id == "beam" else part for part in site.components
            ),
        ),
        "governing radius",
    ),
    "yard full": (
        lambda: dataclasses.replace((site := site_with()), yard=np.zeros_like(site.yard)),
        "the yard has no free place for it",
    ),
    "enclosed": (
        lambda: parted(site_with(crane=False)),
        "no path leads out of the free space",
    ),
}


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_reason_is_confirmed(kind: str) -> None:
    make, says = KINDS[kind]
    log = faults.log_of(make())
    refused = [lift for lift in log.plan.lifts if lift.status is Status.INFEASIBLE]
    assert any(says in (lift.reason or "") for lift in refused), [lift.reason for lift in log.plan.lifts]
    check = searched(log)
    assert (check.failures, check.undecided, check.samples) == ([], [], 4)


def test_what_rests_on_a_refused_part_is_confirmed_too() -> None:
    log = faults.log_of(over(site_with(rules=Rules(by_other_means=False)), "beam"))
    assert "the parts that support it are not in place" in [lift.reason for lift in log.plan.lifts]
    assert searched(log).passed


def test_another_reason_than_the_true_one_is_named() -> None:
    log = faults.log_of(over(site_with(), "beam"))
    other = faults.with_lift(log, "beam", reason="it is too ugly", blocked_by=())
    (failure,) = searched(other).failures
    assert "(beam): it is infeasible, but for another reason: it is blocked at its place" in failure
    blamed = faults.with_lift(log, "beam", blocked_by=("wall",))
    assert "it (by wall)" in searched(blamed).failures[0]


def test_a_refused_path_that_is_refused_again_is_not_decided(good: PlanLog) -> None:
    beside = faults.a_surface_beside_its_cells(good)
    refused = faults.unplanned(beside, "slab", "its lift could not be proven: shapes: its cells miss its surface")
    check = searched(refused)
    assert (check.failures, check.samples) == ([], 3)
    (said,) = check.undecided
    assert said.startswith("lift 4 (slab): a path of ")
    assert "moves is found, and refused too (shapes: slab" in said


def test_a_lift_held_when_the_obstructions_changed_is_not_decided(good: PlanLog) -> None:
    forged = faults.called_infeasible(good, "slab", "it is held on the hook (braked): nothing leads on")
    held = faults.carried_out_until(forged, Epoch(forged.motions[-1].end_ns, ()))
    check = searched(held)
    assert check.passed
    assert [sentence.split(": ")[1] for sentence in check.undecided] == [
        "the cranes were stopped; how they stand is not in the log"
    ]


def test_another_order_or_yard_than_the_planners_is_not_decided() -> None:
    log = faults.log_of(over(site_with(), "beam"))
    place = faults.lift_of(log, "beam").place
    assert place is not None
    x, y, z = place.cell_vox
    moved = faults.with_lift(log, "beam", place=dataclasses.replace(place, cell_vox=(x + 1, y, z)))
    (said,) = searched(moved).undecided
    assert "(beam): it is infeasible in the order and the yard of the plan" in said


def test_each_lift_is_searched_with_the_obstructions_of_its_time(good: PlanLog) -> None:
    place = faults.lift_of(good, "beam").place
    crated = faults.with_blocker(good, "crate", place.shape.cells[:1] + np.array(place.cell_vox))
    check = searched(faults.carried_out_until(crated, Epoch(good.motions[-1].start_ns, ())))
    assert (check.failures, check.undecided, check.samples) == ([], [], 4)
    assert any("(beam): the search takes other last moves" in sentence for sentence in searched(crated).undecided)


def test_a_lift_that_claims_nothing_is_not_searched(good: PlanLog) -> None:
    check = searched(faults.with_lift(good, "beam", shortest_moves=None))
    assert (check.passed, check.samples, check.undecided) == (True, 3, [])


def test_an_extract_is_searched_as_far_as_it_goes(good: PlanLog) -> None:
    assert searched(good.extract([1, 3])).samples == 2


def test_nothing_is_searched_in_what_is_refused_already(good: PlanLog, tmp_path: Path) -> None:
    write_log_file(tmp_path / "log.mcap", faults.a_step_removed(good))
    (check,) = [c for c in bimvox.verify(tmp_path / "log.mcap", search=True).checks if c.name == "search"]
    assert (check.samples, check.undecided) == (0, ["nothing was searched, because another check failed"])


def test_the_command_counts_what_is_not_decided(
    good: PlanLog, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "220")
    moved = faults.log_of(over(site_with(), "slab"))
    place = faults.lift_of(moved, "slab").place
    assert place is not None
    x, y, z = place.cell_vox
    moved = faults.with_lift(moved, "slab", place=dataclasses.replace(place, cell_vox=(x + 1, y, z)))
    path = tmp_path / "log.mcap"
    write_log_file(path, moved)
    assert command(["verify", str(path), "--search", "--json"]) in (0, 1)
    document = json.loads(capsys.readouterr().out)
    assert len(document["checks"]["search"]["undecided"]) == 1
    command(["verify", str(path), "--search"])
    assert "what could not be decided" in capsys.readouterr().out


def test_parts_whose_crane_the_site_file_names_are_not_given_to_others(monkeypatch: pytest.MonkeyPatch) -> None:
    plan, motions = two_crane_plan()
    named = plan.site.components[0]
    text = (SAMPLES / "hall.site.toml").read_text() + f'[[component]]\nglobal_id = "{named.id}"\ncrane = "west"\n'
    asked: list[list[str]] = []

    def preparation_of(site: Site, *, free: list[str]) -> tuple[Site, Preparation]:
        asked.append(free)
        return site, preparation_in(plan)

    monkeypatch.setattr(search, "preparation_of", preparation_of)
    for attached in ({}, {SITE_FILE: text.encode()}):
        searched(PlanLog(plan=plan, motions=motions, attachments=attached))
    everyone = [part.id for part in plan.site.components]
    assert asked == [everyone, everyone[1:]]
