"""A site with two cranes, from the site file to the log, and its revision when something gets in the way."""

from __future__ import annotations

import dataclasses
import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bimvox_pipeline.plan import plan
from bimvox_pipeline.verify import verify
from bimvox_pipeline.watch.file_watch import state_of
from bimvox_pipeline.watch.live import live_logs
from bimvox_pipeline.watch.plan import WatchedPlan, WatchWish
from bimvox_pipeline.watch.simulate import PlanClock
from bimvox_pipeline.watch.watch import Watcher, watch

from bimvox.crane.kinematics import hook_of
from bimvox.cranes.lift import NoFreeTimeError
from bimvox.cranes.schedule import time_lifts
from bimvox.library import prove
from bimvox.library.arguments import PolicyWish
from bimvox.library.hand_over import handed_over
from bimvox.library.plan import policy_of
from bimvox.library.prove import prepared
from bimvox.library.site import load_site
from bimvox.log import schema as topics
from bimvox.log.mcap.reader import read_contents, salvage_contents
from bimvox.log.reader import read_log
from bimvox.log.schema import of_crane
from bimvox.planning.order_search import prepare
from bimvox.progress import SilentProgress
from bimvox.records.motion import LiftMotion

SAMPLES = Path(__file__).parents[2] / "sample_models"


SITE = """
name = "frame"
[sequence]
search = false
[model]
path = "frame.ifc"
voxel_size_m = 0.25
[areas]
construction = [[-1, -1], [7.5, -1], [7.5, 7.5], [-1, 7.5]]
yard = [[[-0.5, -8.5], [6.5, -8.5], [6.5, -2], [-0.5, -2]], [[10, -6], [16, -6], [16, 6], [10, 6]]]
[[crane]]
name = "west"
machine = "hammerhead-30"
base_m = [-3, 0]
jib_height_m = 15.5
jib_length_m = 18
[[crane]]
name = "east"
machine = "hammerhead-30"
base_m = [20, 1]
jib_height_m = 26
"""


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """Return the folder of the sample frame with two cranes of different heights, and the plan's document."""
    folder = tmp_path_factory.mktemp("frame")
    shutil.copy(SAMPLES / "frame.ifc", folder)
    (folder / "frame.site.toml").write_text(SITE)
    document = plan(
        folder / "frame.site.toml", folder / "frame.mcap", wish=PolicyWish("none"), progress=SilentProgress()
    )
    return folder, document


def test_every_lift_is_planned_and_each_crane_has_its_share(two: tuple[Path, dict[str, Any]]) -> None:
    _, document = two
    assert not document["infeasible"]
    cranes = document["figures"]["cranes"]
    assert [crane["name"] for crane in cranes] == ["west", "east"]
    by_name = [lift["crane"] for lift in document["lifts"]]
    assert [by_name.count(crane["name"]) for crane in cranes] == [crane["lifts"] for crane in cranes]
    assert all(crane["lifts"] >= 3 and 0.3 < crane["busy_share"] <= 1.0 for crane in cranes)
    assert document["figures"]["crane_hours"] < sum(crane["busy_hours"] for crane in cranes)


@pytest.mark.slow
def test_the_log_is_proven_from_itself_and_deterministic(two: tuple[Path, dict[str, Any]], tmp_path: Path) -> None:
    folder, _ = two
    assert verify(folder / "frame.mcap", progress=SilentProgress())["verified"]
    plan(folder / "frame.site.toml", tmp_path / "again.mcap", wish=PolicyWish("none"), progress=SilentProgress())
    assert (tmp_path / "again.mcap").read_bytes() == (folder / "frame.mcap").read_bytes()


@pytest.mark.slow
def test_a_change_keeps_paths_and_times_before_it(two: tuple[Path, dict[str, Any]], tmp_path: Path) -> None:
    folder, _ = two
    before = read_log(folder / "frame.mcap")
    last, site = before.plan.lifts[-1], before.plan.site
    assert last.path_vox is not None
    first = before.motions[0]
    way = [tuple(cell) for cell in last.path_vox.tolist()]
    met = {tuple(cell) for cell in before.plan.lifts[first.order].path_vox.tolist()}
    # Where the first lift's path is furthest away.
    apart = np.abs(np.array(way[1:-1])[:, None] - np.array(sorted(met))[None]).max(axis=2).min(axis=1)
    at_m = site.frame.corner_of(np.array(way[1 + int(np.argmax(apart))]))
    box = {"min": [float(n) for n in at_m], "max": [float(n) for n in at_m + 0.5]}
    for name in ("frame.ifc", "frame.site.toml", "frame.mcap"):
        shutil.copy(folder / name, tmp_path)
    file = tmp_path / "way.json"
    file.write_text(json.dumps({"version": 1, "unit": "m", "obstructions": [{"id": "box", "box": box}]}))
    site_file, log = tmp_path / "frame.site.toml", tmp_path / "frame.mcap"
    documents = list(
        watch(
            file,
            site=site_file,
            out=log,
            wish=PolicyWish("none"),
            how=WatchWish(once=True),
            progress=SilentProgress(),
        )
    )
    assert [document["event"] for document in documents] == ["replanned"]
    now = read_log(log)
    motions = {motion.order: motion for motion in now.motions}
    changed = {lift.order for lift in now.plan.lifts if lift.component == last.component}
    for one, other in zip(before.plan.lifts, now.plan.lifts, strict=True):
        if one.order not in changed and one.path_vox is not None and other.path_vox is not None:
            kept = np.array_equal(one.path_vox, other.path_vox)
            assert kept or site.components[one.component].global_id in documents[0]["replanned"]
    assert motions[first.order].phases == first.phases
    assert verify(log, progress=SilentProgress())["verified"]


@pytest.mark.slow
def test_a_log_with_a_lift_that_was_handed_over_is_proven_to_be_of_its_files(
    two: tuple[Path, dict[str, Any]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, document = two
    refused: list[str] = []

    def timed(made: Any, *more: Any) -> Any:
        if not refused:  # the first part that the other crane can pick and set
            preparation = prepare(made.site)
            for part in made.site.components:
                if handed_over(made.site, preparation, [part.id])[2]:
                    refused.append(part.id)
                    raise NoFreeTimeError(part.id, "busy")
        return time_lifts(made, *more)

    monkeypatch.setattr(prove, "time_lifts", timed)
    site_file = folder / "frame.site.toml"
    again = plan(site_file, tmp_path / "again.mcap", wish=PolicyWish("none"), progress=SilentProgress())
    assert not again["infeasible"]
    before, after = ({lift["component"]: lift["crane"] for lift in one["lifts"]} for one in (document, again))
    assert [name for name in before if before[name] != after[name]] == refused
    log = tmp_path / "again.mcap"
    found = verify(log, site=site_file, progress=SilentProgress())
    assert found["verified"], found
    # A watch continues from it: with the site file as it is, the part stays with the crane that it was handed to.
    file = tmp_path / "way.json"
    file.write_text(json.dumps({"version": 1, "unit": "m", "obstructions": []}))
    assert watched(file, site_file, log) == ["unchanged"]
    last = read_log(log).plan.lifts[-1]
    assert last.path_vox is not None
    at_m = read_log(log).plan.site.frame.corner_of(last.path_vox[2 * len(last.path_vox) // 3])
    box = {"min": [float(n) for n in at_m], "max": [float(n) for n in at_m + 0.5]}
    file.write_text(json.dumps({"version": 1, "unit": "m", "obstructions": [{"id": "box", "box": box}]}))
    assert watched(file, site_file, log) == ["replanned"]
    assert cranes_in(log) == after
    assert verify(log, site=site_file, progress=SilentProgress())["verified"]
    # A watch that makes the first plan hands it over, too.
    refused.clear()
    new = tmp_path / "new.mcap"
    file.write_text(json.dumps({"version": 1, "unit": "m", "obstructions": []}))
    assert watched(file, site_file, new) == ["planned"]
    assert cranes_in(new) == after
    assert watched(file, site_file, new) == ["unchanged"]


def watched(file: Path, site_file: Path, log: Path) -> list[str]:
    """Return the events of a watch that looks at its file once."""
    wish, how = PolicyWish("none"), WatchWish(once=True)
    documents = watch(file, site=site_file, out=log, wish=wish, how=how, progress=SilentProgress())
    return [document["event"] for document in documents]


def cranes_in(log: Path) -> dict[str, str]:
    """Return the name of each part's crane, by the part's id."""
    site = read_log(log).plan.site
    return {part.id: site.cranes[part.crane].name for part in site.components}


class Hand:
    """A wall clock that is set by hand."""

    def __init__(self) -> None:
        self.now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


class CarriedOut:
    """Return a watch that carries out the plan on disk at the speed of the wall clock, checked by hand."""

    def __init__(self, folder: Path, hand: Hand) -> None:
        quiet = SilentProgress()
        loaded = load_site(folder / "frame.site.toml", quiet)
        _, preparation = prepared(loaded.site, quiet)
        policy = policy_of(loaded, loaded.site, preparation, PolicyWish("none"), quiet)
        self.hand, self.file, self.log = hand, folder / "way.json", folder / "frame.mcap"
        plan = WatchedPlan(loaded, policy, self.log, 0)
        self.watcher = Watcher(plan, preparation, self.file, quiet, PlanClock(1.0, hand))
        self.watcher.show_to(())
        if not self.file.exists():
            self.put()
        self.started_s = hand.now_s
        self.taken_up = list(self.watcher.take_up(state_of(self.file)))
        self.watcher.begin()

    def put(self, *boxes: dict[str, Any]) -> None:
        self.file.write_text(json.dumps({"version": 1, "unit": "m", "obstructions": list(boxes)}))

    def look(self, time_ns: int | None = None) -> list[dict[str, Any]]:
        if time_ns is not None:
            self.hand.now_s = self.started_s + (time_ns - self.watcher._plan.carried_out_ns) / 1e9
        return list(self.watcher.change(dataclasses.replace(state_of(self.file), seen_s=self.hand.now_s)))

    def box(self, order: int, later_ns: int) -> dict[str, Any]:
        """Return a box at the position of a lift's load at a time."""
        current = self.watcher.current
        assert current is not None
        motion = current.motions[order]
        crane, frame = current.plan.site.cranes[motion.crane], current.plan.site.frame
        times, axes = motion.samples()
        at_m = hook_of(crane, *(np.array(np.interp(later_ns, times, axis)) for axis in axes.T))
        low = at_m - [0.05, 0.05, crane.sling_m + 0.5 * frame.voxel_size_m]
        return {"id": "drone", "box": {"min": low.tolist(), "max": (low + 0.1).tolist()}}


@pytest.fixture
def carried(two: tuple[Path, dict[str, Any]], tmp_path: Path) -> CarriedOut:
    for name in ("frame.ifc", "frame.site.toml", "frame.mcap"):
        shutil.copy(two[0] / name, tmp_path)
    return CarriedOut(tmp_path, Hand())


def at_share(motion: LiftMotion, share: float) -> int:
    first, last = (motion.start_ns + int(motion.loaded.time_ns[n]) for n in (0, -1))
    return int(first + share * (last - first))


def test_every_part_goes_through_its_states_in_order_of_time(carried: CarriedOut):
    current = carried.watcher.current
    end_ns = max(motion.end_ns for motion in current.chain)
    told = carried.look(end_ns // 2) + carried.look(end_ns)
    assert {one["event"] for one in told} == {"state"}
    assert [one["time_s"] for one in told] == sorted(one["time_s"] for one in told)
    for motion in current.chain:
        name = current.plan.site.components[motion.component].id
        assert [one["state"] for one in told if one["component"] == name] == ["in_transit", "arrived", "assembled"]
    carried.watcher.close()
    (live,) = live_logs(carried.log).values()
    seen = {message.topic for message in read_contents(live.read_bytes(), live).messages}
    of_second = {of_crane(name, 1) for name in (topics.LOAD, topics.JOINTS, topics.COMMAND, topics.PLANNED)}
    assert of_second <= seen
    # Truncated, as by kill -9, it can be recovered.
    live.write_bytes(live.read_bytes()[:-100])
    assert of_second <= {message.topic for message in salvage_contents(live.read_bytes(), live).messages}


@pytest.mark.slow
def test_an_affected_load_stops_the_cranes_and_the_whole_log_is_proven(carried: CarriedOut):
    current = carried.watcher.current
    motion = current.motions[3]
    carried.look(at_share(motion, 0.2))
    carried.put(carried.box(3, at_share(motion, 0.6)))
    *_, told = [one for one in carried.look() if one["event"] != "state"]
    assert told["event"] == "replanned", told
    stopped = told["stopped"]
    assert stopped["component"] == current.plan.site.components[motion.component].id
    assert stopped["safe"]
    assert not stopped["held"], told["blocked"]
    assert told["time_s"] < stopped["rest_s"] < stopped["goes_on_s"]
    assert stopped in told["all_stopped"]
    segment = Path(told["segment"])
    assert verify(segment, progress=SilentProgress())["verified"]
    assert len([event for event in read_log(segment).events if event.kind == "stop"]) == len(told["all_stopped"])
    carried.watcher.close()
    document = verify(carried.log, progress=SilentProgress())
    assert document["verified"], document
    assert len(read_log(carried.log).plan.history) == 1


@pytest.mark.slow
def test_held_cranes_are_known_after_a_kill_and_continue_when_they_can(carried: CarriedOut):
    current = carried.watcher.current
    motion = current.motions[3]
    now_ns = at_share(motion, 0.3)
    carried.look(now_ns)
    target = current.plan.site.components[motion.component]
    low = current.plan.site.frame.corner_of(np.array(target.target_vox) + target.shape.cells[0]) + 0.05
    carried.put({"id": "on its place", "box": {"min": list(low), "max": list(low + 0.1)}})
    told = carried.look()[-1]
    assert told["stopped"]["held"], told
    assert told["pending"]
    held = carried.watcher.current.held
    # Only the files are left of the first watch.
    again = CarriedOut(carried.log.parent, carried.hand)
    known = again.watcher.current.held
    assert [one.lift.order for one in known.loads] == [one.lift.order for one in held.loads]
    assert [one.stop.end_ns for one in known.loads if one.stop] == [one.stop.end_ns for one in held.loads if one.stop]
    assert [hook.crane for hook in known.hooks] == [hook.crane for hook in held.hooks]
    assert again.watcher._execution.clock.now_ns == pytest.approx(now_ns, abs=2 * 10**6)
    again.put()
    *_, told = again.look(now_ns + 300 * 10**9)
    assert told["event"] == "replanned"
    assert not told["stopped"]["held"]
    assert not told["pending"]
    assert again.watcher.current.held is None
    again.watcher.close()
    assert verify(again.log, progress=SilentProgress())["verified"]
