"""Wrong arguments that people give to the library."""

from __future__ import annotations

import time
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from box_sites import box_site, test_crane
from guided_sites import bays_of_slabs
from two_cranes import two_crane_site

import bimvox
from bimvox.library.arguments import constants_of, workers_of
from bimvox.library.prove import plan_and_prove, prepared
from bimvox.library.site import rasterise
from bimvox.motion.time_plan import time_plan
from bimvox.planning.contact.pairs import Contacts
from bimvox.planning.planner import LiftSearch, LiftTask, plan_lifts, predicted
from bimvox.policy.choice import NO_POLICY
from bimvox.progress import SilentProgress
from bimvox.records.lift import Status
from bimvox.revision.current_plan import RevisionRequest, current_plan_of
from bimvox.revision.revise import revise
from bimvox.site.build import with_digests, with_obstructions
from bimvox.site.obstructions.obstruction_set import Box, Obstruction, ObstructionSet
from bimvox.workers import ALONE, Workers

SAMPLES = Path(__file__).parents[2] / "sample_models"


@pytest.fixture(scope="module")
def plan() -> bimvox.Plan:
    return bimvox.plan(bimvox.load_site(SAMPLES / "paper.site.toml"), policy="none")


@pytest.mark.parametrize("value", ["paper.site.toml", None, 3])
def test_a_plan_needs_a_site(value: Any) -> None:
    with pytest.raises(bimvox.BimvoxError, match="takes a site") as caught:
        bimvox.plan(value)
    assert "load_site" in str(caught.value.hint)


@pytest.mark.parametrize("voxel_size_m", [0.0, -1.0, float("nan"), float("inf")])
def test_a_guessed_site_needs_a_cell_size(voxel_size_m: float) -> None:
    building = bimvox.read(SAMPLES / "frame.ifc")
    with pytest.raises(bimvox.BimvoxError, match="voxel_size_m is"):
        bimvox.guess_site(building, voxel_size_m=voxel_size_m)


@pytest.mark.parametrize(("name", "least"), [("seed", 0), ("steps", 1), ("retrain", 0)])
def test_a_number_out_of_range_is_refused(plan: bimvox.Plan, name: str, least: int) -> None:
    site = bimvox.load_site(SAMPLES / "paper.site.toml")
    options: dict[str, Any] = {name: least - 1}
    with pytest.raises(bimvox.errors.InputError, match=f"{name} is {least - 1}") as caught:
        bimvox.plan(site, policy="none", **options)
    assert caught.value.hint == f"give {least} or more"


@pytest.fixture(scope="module")
def building() -> bimvox.Building:
    return bimvox.read(SAMPLES / "frame.ifc")


def test_an_argument_of_another_kind_is_refused_with_a_sentence_and_a_hint(
    plan: bimvox.Plan, building: bimvox.Building, tmp_path: Path
) -> None:
    site, png = bimvox.load_site(SAMPLES / "paper.site.toml"), tmp_path / "x.png"
    verbs: Any = bimvox
    wrong = {
        r"^read\(\) takes the path of a file, not an int": lambda: verbs.read(5),
        r"^voxelize\(\) takes a building, not a str": lambda: verbs.voxelize("frame.ifc"),
        r"^voxel_size_m is '0.25'": lambda: verbs.voxelize(building, "0.25"),
        r"^voxel_size_m is -1": lambda: verbs.voxelize(building, -1),
        r"^threads is 0": lambda: verbs.voxelize(building, 1.0, threads=0),
        r"^load_site\(\) takes the path of a site file, not a Building": lambda: verbs.load_site(building),
        r"^guess_site\(\) takes a building, not a str": lambda: verbs.guess_site("frame.ifc"),
        r"^crane is 5": lambda: verbs.guess_site(building, crane=5),
        r"^seed is 'a'": lambda: verbs.plan(site, seed="a"),
        r"^policy is 5": lambda: verbs.plan(site, policy=5),
        r"^progress is 5": lambda: verbs.plan(site, progress=5),
        r"^revise\(\) takes a plan, not a LoadedSite": lambda: verbs.revise(site, bimvox.ObstructionSet.of([])),
        r"^obstructions are an ObstructionSet or the path": lambda: verbs.revise(plan, None),
        r"^verify\(\) takes the path of a log, or a plan, not a LoadedSite": lambda: verbs.verify(site),
        r"^render\(\) takes a plan, a site or a grid, not a Building": lambda: verbs.render(building, png),
        r"^export\(\) takes a plan, a grid or the path of a log, not a LoadedSite": lambda: verbs.export(site, png),
        r"x.png: no format has this suffix": lambda: verbs.export(plan, png),
        r"^to is 'xls'": lambda: verbs.export(plan, png, to="xls"),
        r"^there is no lift 99": lambda: verbs.export(plan, png, to="csv", lifts=[99]),
        r"^a grid has no lifts": lambda: verbs.export(verbs.voxelize(building, 1.0), png, lifts=[1]),
        r"^the ifc format adds": lambda: verbs.export(plan, tmp_path / "x.ifc"),
        r"^size_px is 640": lambda: verbs.render(plan, png, size_px=640),
        r"^size_px is \(0, 0\)": lambda: verbs.render(plan, png, size_px=(0, 0)),
        r"^lift is '3'": lambda: verbs.render(plan, png, lift="3"),
        r"^write_log\(\) takes a plan, not a PosixPath": lambda: verbs.write_log(tmp_path / "x.mcap", plan),
        r"^write_log\(\) takes the path of a file, not a Plan": lambda: verbs.write_log(plan, plan),
        r"^read_log\(\) takes the path of a log, not a Plan": lambda: verbs.read_log(plan),
    }
    for said, call in wrong.items():
        with pytest.raises(bimvox.BimvoxError, match=said) as caught:
            call()
        assert caught.value.hint, said
    assert not list(tmp_path.iterdir())


def test_a_log_has_the_name_of_a_log(plan: bimvox.Plan, tmp_path: Path) -> None:
    with pytest.raises(bimvox.errors.InputError, match="a log is an MCAP file") as caught:
        bimvox.write_log(plan, tmp_path / "plan.txt")
    assert caught.value.hint == "name it plan.mcap"
    assert not list(tmp_path.iterdir())


def test_obstructions_are_a_set_or_a_file(plan: bimvox.Plan) -> None:
    crate = bimvox.Obstruction("crate", bimvox.Box((1, 1, 1), (2, 2, 2)))
    wrong: list[Any] = [[crate], crate, 3]
    for value in wrong:
        with pytest.raises(bimvox.BimvoxError, match="ObstructionSet or the path") as caught:
            bimvox.revise(plan, value)
        assert "ObstructionSet.of" in str(caught.value.hint)


def test_a_plan_says_what_became_of_its_obstructions(plan: bimvox.Plan) -> None:
    far = bimvox.ObstructionSet.of([bimvox.Obstruction("far", bimvox.Box((900, 900, 0), (901, 901, 1)))])
    assert any("far" in note and "outside" in note for note in bimvox.revise(plan, far).notes)


def test_values_that_make_no_sense_are_not_drawn(plan: bimvox.Plan, tmp_path: Path) -> None:
    site = plan.site
    parts = (replace(site.components[0], mass_kg=float("nan")), *site.components[1:])
    record = replace(plan.record, plan=replace(plan.record.plan, site=replace(site, components=parts)))
    for name in ("x.html", "x.png", "x.gif"):
        with pytest.raises(bimvox.errors.InputError, match="values of the plan make no sense"):
            bimvox.render(replace(plan, record=record), tmp_path / name)
    assert not list(tmp_path.iterdir())


QUIET = SilentProgress()


@pytest.fixture(scope="module")
def site():
    """12 blocks on 12 blocks, without other means: what cannot be lifted is not set, and nothing stands on it."""
    parts = [
        (f"{'low' if z == 0.0 else 'high'} {x:g} {y:g}", (x, y, z), (x + 1.0, y + 1.0, z + 1.0))
        for z in (0.0, 1.0)
        for x in (2.0, 4.0, 6.0, 8.0)
        for y in (2.0, 4.0, 6.0)
    ]
    made = box_site(parts, crane=test_crane(base=(8.0, -3.0, 0.0), jib=40.0, height=14.0), shape=(60, 40, 24))
    return with_digests(replace(made, rules=replace(made.rules, by_other_means=False)))


@contextmanager
def processes(count):
    """So many processes, all of them ready."""
    workers = Workers(count, (plan_lifts, time_plan))
    begun = workers.begin(time.sleep, [(0.2,)] * (count - 1))
    until_s = time.monotonic() + 60.0
    while not begun.is_finished and time.monotonic() < until_s:
        time.sleep(0.02)
    assert begun.is_finished, "the other processes are ready"
    begun.finished()
    yield workers
    assert workers.count == count, "no task failed"
    workers.close()


@pytest.fixture(scope="module")
def two():
    with processes(2) as workers:
        yield workers


def blocked(site):
    """The site with a box where two of the low blocks are to stand."""
    box = Obstruction("box", Box((4.1, 2.1, 0.1), (4.9, 4.9, 0.9)))
    return with_obstructions(site, ObstructionSet.of([box]), rasterise)


def alike(one, other):
    """Whether two plans with their motions are the same, to the bit."""
    lifts = zip(one.plan.lifts, other.plan.lifts, strict=True)
    for a, b in lifts:
        assert (a.component, a.status, a.reason, a.blocked_by, a.method, a.guide) == (
            b.component, b.status, b.reason, b.blocked_by, b.method, b.guide,
        )  # fmt: skip
        assert (a.path_vox is None) == (b.path_vox is None)
        assert a.path_vox is None or np.array_equal(a.path_vox, b.path_vox)
    for a, b in zip(one.motions, other.motions, strict=True):
        assert (a.order, a.phases, a.start_ns, a.end_ns) == (b.order, b.phases, b.start_ns, b.end_ns)
        for way, same in zip(a.trajectories, b.trajectories, strict=True):
            assert way.axes.tobytes() == same.axes.tobytes()
            assert way.time_ns.tobytes() == same.time_ns.tobytes()
    return True


@pytest.mark.parametrize("place", ["free", "blocked"])
def test_two_processes_plan_what_one_does(site, two, place):
    own = blocked(site) if place == "blocked" else site
    own, preparation = prepared(own, QUIET)
    alone = plan_and_prove(own, preparation, NO_POLICY, progress=QUIET)
    with two.knowing(*constants_of(own, preparation)):
        shared = plan_and_prove(own, preparation, NO_POLICY, progress=QUIET, workers=two)
    assert alike(alone, shared)
    assert alone.verdict == shared.verdict
    refused = [lift for lift in alone.plan.lifts if lift.status is Status.INFEASIBLE]
    assert bool(refused) == (place == "blocked")
    places = {id(place) for place in preparation.places}
    assert all(id(lift.place) in places for lift in shared.plan.lifts if lift.place is not None)


@pytest.fixture(scope="module")
def guided():
    """Slabs that crews guide to their places, as one process plans them."""
    own, preparation = prepared(with_digests(bays_of_slabs()), QUIET)
    return own, preparation, plan_and_prove(own, preparation, NO_POLICY, progress=QUIET)


@pytest.mark.parametrize("count", [pytest.param(2, marks=pytest.mark.slow), 3])
def test_any_number_of_processes_plans_the_same_guides(guided, count):
    own, _, alone = guided
    assert sum(lift.guide is not None for lift in alone.plan.lifts) >= 10
    with processes(count) as workers:
        own, preparation = prepared(own, QUIET, workers)
        with workers.knowing(*constants_of(own, preparation)):
            shared = plan_and_prove(own, preparation, NO_POLICY, progress=QUIET, workers=workers)
        assert alike(alone, shared)
        assert shared.verdict == alone.verdict


@pytest.mark.parametrize("backward", [False, True])
def test_guides_do_not_depend_on_which_lifts_are_searched_first(guided, backward):
    """Whoever searches a chunk has searched others before it, or none."""
    own, preparation, alone = guided
    anew = replace(preparation, contacts=Contacts(own))
    told = tuple(lift.is_set for lift in alone.plan.lifts)
    chunks = [range(first, first + 3) for first in range(0, len(told), 3)]
    found = {}
    for chunk in reversed(chunks) if backward else chunks[1::2]:
        for lift in LiftSearch(own, anew, (), told).steps([LiftTask(n) for n in chunk]):
            found[lift.order] = lift
    assert {n: lift.guide for n, lift in found.items()} == {n: alone.plan.lifts[n].guide for n in found}
    assert all(np.array_equal(lift.path_vox, alone.plan.lifts[n].path_vox) for n, lift in found.items())


def test_two_processes_plan_two_cranes_as_one_does(two):
    own = two_crane_site()
    own, preparation = prepared(own, QUIET)
    alone = plan_and_prove(own, preparation, NO_POLICY, progress=QUIET)
    with two.knowing(*constants_of(own, preparation)):
        shared = plan_and_prove(own, preparation, NO_POLICY, progress=QUIET, workers=two)
    assert alike(alone, shared)
    assert alone.verdict == shared.verdict
    assert {"cranes", "turns"} <= {check.name for check in shared.verdict.checks if check.samples}


@pytest.mark.parametrize("now_s", [None, 400])
def test_two_processes_revise_two_cranes_as_one_does(two, now_s):
    own = two_crane_site()
    own, preparation = prepared(own, QUIET)
    made = plan_and_prove(own, preparation, NO_POLICY, progress=QUIET)
    path_vox = made.plan.lifts[-1].path_vox
    low = own.frame.corner_of(path_vox[len(path_vox) // 2]) + 0.1
    there = with_obstructions(
        own, ObstructionSet.of([Obstruction("box", Box(tuple(low), tuple(low + 0.3)))]), rasterise
    )
    current, now_ns = current_plan_of(made.plan, made.motions), None if now_s is None else now_s * 10**9
    found = []
    with two.knowing(*constants_of(own, preparation)):
        for workers in (ALONE, two):
            (part,) = revise(current, RevisionRequest(there, preparation, now_ns=now_ns, workers=workers))
            found.append(replace(made, plan=part.current.plan, motions=part.current.chain))
    assert not np.array_equal(found[0].plan.lifts[-1].path_vox, path_vox)
    assert alike(*found)


def test_what_turns_out_otherwise_than_predicted_is_searched_again(site):
    own = blocked(site)
    own, preparation = prepared(own, QUIET)
    plan = plan_lifts(own, preparation)
    told = predicted(own, preparation, [])
    assert [lift.is_set for lift in plan.lifts] != list(told), "the box blocks paths, which nobody foretells"
    assert predicted(own, preparation, plan.lifts) == tuple(lift.is_set for lift in plan.lifts)


def test_two_processes_revise_as_one_does(site, two):
    site, preparation = prepared(site, QUIET)
    made = plan_and_prove(site, preparation, NO_POLICY, progress=QUIET)
    current, there = current_plan_of(made.plan, made.motions), blocked(site)
    found = []
    with two.knowing(*constants_of(site, preparation)):
        for workers in (ALONE, two):
            parts = list(revise(current, RevisionRequest(there, preparation, first=4, workers=workers)))
            found.append(parts)
    assert [(part.made, part.replanned, part.retimed) for part in found[0]] == [
        (part.made, part.replanned, part.retimed) for part in found[1]
    ]
    assert len(found[0]) > 1
    last = [replace(made, plan=parts[-1].current.plan, motions=parts[-1].current.chain) for parts in found]
    assert alike(*last)


def test_few_parts_are_planned_without_workers(site):
    with workers_of(site, None) as workers:
        assert workers is ALONE
    with workers_of(replace(site, components=site.components * 5), 1) as workers:
        assert workers is ALONE
    several = two_crane_site()
    for times, is_alone in ((7, True), (8, False)):  # 49 and 56 parts
        with workers_of(replace(several, components=several.components * times), 2) as workers:
            assert (workers is ALONE) is is_alone
