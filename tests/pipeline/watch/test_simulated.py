"""A watch that carries out its plan, by a clock that the test sets."""

from __future__ import annotations

import json
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bimvox_pipeline.verify import verify
from bimvox_pipeline.watch.file_watch import state_of
from bimvox_pipeline.watch.live import driven_until_ns, live_logs
from bimvox_pipeline.watch.plan import WatchedPlan
from bimvox_pipeline.watch.simulate import PlanClock
from bimvox_pipeline.watch.watch import Watcher
from planned_frame import copy_to

from bimvox.crane.kinematics import hook_of
from bimvox.library.arguments import PolicyWish
from bimvox.library.attached_files import check_attached_files
from bimvox.library.plan import policy_of
from bimvox.library.prove import prepared
from bimvox.library.site import load_site
from bimvox.log import schema as topics
from bimvox.log.mcap.reader import read_contents, salvage_contents
from bimvox.log.plan_json import held_files
from bimvox.log.plan_log import PlanLog
from bimvox.log.reader import read_log
from bimvox.log.segments import NOW_NS
from bimvox.progress import SilentProgress
from bimvox.revision.current_plan import HeldCranes, last_finished, motion_under_way
from bimvox.stop.redirect import Held

EMPTY = {"version": 1, "unit": "m", "obstructions": []}


@pytest.fixture(scope="module")
def parts(tmp_path_factory) -> tuple[Any, Any, Any]:
    quiet = SilentProgress()
    loaded = load_site(copy_to(tmp_path_factory.mktemp("frame")) / "frame.site.toml", quiet)
    _, preparation = prepared(loaded.site, quiet)
    policy = policy_of(loaded, loaded.site, preparation, PolicyWish("none"), quiet)
    return loaded, preparation, policy


class Hand:
    """A wall clock that is set by hand."""

    def __init__(self) -> None:
        self.now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


class Simulated:
    """Return a watcher of an empty file that carries out the plan on disk, ten times as fast as the wall clock."""

    def __init__(self, folder: Path, parts: tuple[Any, Any, Any]) -> None:
        self.parts, self.target = parts, folder / "frame.mcap"
        self.hand = Hand()
        self.file = folder / "obstructions.json"
        self.watcher = self.another(10.0)
        self.put()
        self.taken_up = list(self.watcher.take_up(state_of(self.file)))
        self.watcher.begin()

    def another(self, speed: float) -> Watcher:
        """Return a new watcher of the same file and log."""
        loaded, preparation, policy = self.parts
        plan = WatchedPlan(loaded, policy, self.target, 0)
        return Watcher(plan, preparation, self.file, SilentProgress(), PlanClock(speed, self.hand))

    def put(self, *entries: dict[str, Any]) -> None:
        self.file.write_text(json.dumps(EMPTY | {"obstructions": list(entries)}))

    def at(self, time_ns: int) -> None:
        self.hand.now_s = (time_ns - self.watcher._plan.carried_out_ns) / 1e10

    def look(self) -> list[dict[str, Any]]:
        return list(self.watcher.change(replace(state_of(self.file), seen_s=self.hand.now_s)))

    def box_ahead(self, order: int, share: float) -> dict[str, Any]:
        """Return a box below the hook that the load of a lift reaches later."""
        current = self.watcher.current
        assert current is not None
        loaded = current.motions[order].loaded
        at = int(share * (len(loaded.time_ns) - 1))
        crane, frame = current.plan.site.cranes[0], current.plan.site.frame
        hook_m = hook_of(crane, loaded.slew_rad[at], loaded.radius_m[at], loaded.height_m[at])
        low = hook_m - [0.05, 0.05, crane.sling_m + 0.5 * frame.voxel_size_m]
        return {"id": "drone", "box": {"min": low.tolist(), "max": (low + 0.1).tolist()}}


@pytest.fixture
def simulated(site_folder, parts) -> Simulated:
    return Simulated(site_folder, parts)


def test_every_part_goes_through_its_states_in_order(simulated):
    current = simulated.watcher.current
    simulated.at(current.motions[2].start_ns)
    assert simulated.watcher.wants_another_look()
    told = simulated.look()
    first = current.plan.site.components[current.plan.lifts[0].component].id
    assert [one["state"] for one in told if one["component"] == first] == ["in_transit", "arrived", "assembled"]
    assert [one["time_s"] for one in told] == sorted(one["time_s"] for one in told)
    assert {one["event"] for one in told} == {"state"}
    assert len(told) == 6
    assert simulated.look() == []
    assert not simulated.watcher.wants_another_look()


def test_a_load_in_the_air_is_stopped_and_the_segment_proves_it(simulated):
    current = simulated.watcher.current
    motion = current.motions[3]
    first, last = (motion.start_ns + int(motion.loaded.time_ns[n]) for n in (0, -1))
    simulated.at(int(first + 0.3 * (last - first)))
    simulated.look()
    simulated.put(simulated.box_ahead(3, 0.6))
    *_, told = [one for one in simulated.look() if one["event"] != "state"]
    assert told["event"] == "replanned"
    stopped = told["stopped"]
    assert stopped["safe"]
    assert not stopped["held"]
    assert stopped["component"] == current.plan.site.components[motion.component].id
    assert told["time_s"] < stopped["rest_s"] < stopped["goes_on_s"]
    assert stopped["goes_on_s"] - told["time_s"] >= 30.0, "ten times as fast: a plan takes seconds, so minutes go by"
    assert stopped["component"] in told["replanned"]
    segment = Path(told["segment"])
    assert verify(segment, progress=SilentProgress())["verified"]
    (event,) = [event for event in read_log(segment).events if event.kind == "stop"]
    assert event.fields["how"] == stopped["how"]
    simulated.watcher.close()
    whole = simulated.target
    assert verify(whole, progress=SilentProgress())["verified"]
    assert len(read_log(whole).plan.history) == 1


def test_after_a_kill_it_resumes_at_the_last_revision(simulated, site_folder, parts):
    current = simulated.watcher.current
    now_ns = current.motions[4].start_ns + 10**9
    simulated.at(now_ns)
    simulated.look()
    simulated.put(simulated.box_ahead(6, 0.5))
    told = simulated.look()[-1]
    assert int(read_log(Path(told["segment"])).metadata[NOW_NS]) == pytest.approx(now_ns, abs=100)
    done = simulated.watcher.current.motions[2]
    again = simulated.another(1.0)
    found = list(again.take_up(state_of(simulated.file)))
    assert [one["event"] for one in found] == ["unchanged"], [
        {k: v for k, v in one.items() if k in ("stopped", "blocked")} for one in (told, *found)
    ]
    again.begin()
    assert again._execution.clock.now_ns == pytest.approx(now_ns, abs=100)
    assert np.array_equal(again.current.motions[2].loaded.slew_rad, done.loaded.slew_rad)
    simulated.put()
    list(again.change(replace(state_of(simulated.file), seen_s=simulated.hand.now_s)))
    assert len(again.current.plan.history) == 2


def said_of_held_loads(record: PlanLog, held: Held) -> None:
    """The file of held loads is compared with the plan, and its stop with its motion."""
    assert check_attached_files(record).passed, check_attached_files(record).failures
    assert held.stop is not None
    aside = replace(held.stop.trajectory, slew_rad=held.stop.trajectory.slew_rad + 0.5)
    later = replace(held.stop, start_ns=held.motion.end_ns + 1)
    other = replace(held.motion, component=held.motion.component + 1)
    nowhere = replace(held.stop.trajectory, radius_m=held.stop.trajectory.radius_m * np.nan)
    ends = tuple(replace(axis, end=axis.end + 2.0) for axis in held.stop.axes)
    for forged, says in (
        (replace(held, reason="all is well"), "reason is it is held"),
        (replace(held, stop=replace(held.stop, trajectory=aside)), "its stop begins where the load was not"),
        (replace(held, stop=replace(held.stop, axes=ends)), "it hangs where its stop does not end"),
        (replace(held, stop=later), "it is stopped at a time at which it does not move"),
        (replace(held, motion=other), "it is held with the motion of another lift"),
        (replace(held, stop=replace(held.stop, trajectory=nowhere)), "positions of its motion make no sense"),
    ):
        files = {**record.attachments, **held_files(HeldCranes((forged,)))}
        failures = check_attached_files(replace(record, attachments=files)).failures
        assert len(failures) == 1 and says in failures[0], failures


def test_a_held_load_is_known_after_a_kill_and_continues_when_it_can(simulated, site_folder, parts):
    current = simulated.watcher.current
    loaded = current.motions[5].loaded
    simulated.at(current.motions[5].start_ns + int(loaded.time_ns[len(loaded.time_ns) // 2]))
    simulated.look()
    target = current.plan.site.components[current.motions[5].component]
    low = current.plan.site.frame.corner_of(np.array(target.target_vox) + target.shape.cells[0]) + 0.1
    simulated.put({"id": "on its place", "box": {"min": list(low), "max": list(low + 0.2)}})
    told = simulated.look()[-1]
    assert told["stopped"]["held"], told
    (held,) = simulated.watcher.current.held_loads
    said_of_held_loads(read_log(Path(told["log"]).with_name(f"frame.r{told['revision']:04d}.mcap")), held)
    again = simulated.another(10.0)
    list(again.take_up(replace(state_of(simulated.file), seen_s=simulated.hand.now_s)))
    (known,) = again.current.held_loads
    assert known.lift.component == held.lift.component
    assert (known.how, known.is_safe, known.stop.end_ns) == (held.how, held.is_safe, held.stop.end_ns)
    assert np.array_equal(known.stop.trajectory.slew_rad, held.stop.trajectory.slew_rad)
    simulated.put()
    again.begin()
    (stopped,) = [d["stopped"] for d in again.change(replace(state_of(simulated.file), seen_s=0.0)) if "stopped" in d][
        :1
    ]
    assert not stopped["held"]
    assert again.current.held is None
    assert held.lift.order in again.current.motions
    again.close()


def test_what_is_carried_out_is_in_a_growing_log_and_the_clock_continues_from_there(simulated, site_folder, parts):
    target = site_folder / "frame.mcap"
    simulated.watcher.show_to(())
    simulated.watcher._show()
    motion = simulated.watcher.current.motions[3]
    now_ns = motion.start_ns + int(motion.loaded.time_ns[len(motion.loaded.time_ns) // 2])
    simulated.at(now_ns)
    simulated.look()
    (path,) = live_logs(target).values()
    until, there = time.monotonic() + 30.0, set()
    while not {topics.SCENE, topics.JOINTS, topics.LOAD, topics.TF} <= there:
        assert time.monotonic() < until
        time.sleep(0.1)
        there = {message.topic for message in salvage_contents(path.read_bytes(), path).messages}
    first = simulated.watcher._plan.first
    assert driven_until_ns(target, first) >= now_ns - 100
    assert driven_until_ns(target, "another plan") == 0
    again = simulated.another(10.0)
    list(again.take_up(state_of(simulated.file)))
    again.show_to(())
    again.begin()
    assert again._execution.clock.now_ns == pytest.approx(now_ns, abs=100)
    assert len(live_logs(target)) == 2
    again.close()
    simulated.put(simulated.box_ahead(3, 0.9))
    assert [one["event"] for one in simulated.look() if one["event"] != "state"] == ["replanned"]
    simulated.watcher.close()
    happened = [m.data for m in read_contents(path.read_bytes(), path).messages if m.topic == topics.EVENTS]
    assert [b"replan" in data for data in happened] == [True, False]
    assert b"stop" in happened[1]


def test_after_a_pending_lift_no_time_is_known(simulated):
    current = simulated.watcher.current
    gap = replace(current, motions={o: m for o, m in current.motions.items() if o != 3}, pending=frozenset({3}))
    now_ns = current.motions[5].start_ns + 10**9
    assert last_finished(current, now_ns) == 4
    assert last_finished(gap, now_ns) == 2
    assert motion_under_way(gap, current.plan.lifts[5], now_ns) is None
    assert motion_under_way(current, current.plan.lifts[5], now_ns) is current.motions[5]


def test_a_run_killed_at_once_does_not_change_the_clock(simulated, site_folder, parts):
    """Its live log exists but is empty: the previous one says how far the plan was carried out."""
    target = site_folder / "frame.mcap"
    simulated.watcher.show_to(())
    simulated.at(300 * 10**9)
    simulated.watcher._show()
    simulated.watcher.close()
    (path,) = live_logs(target).values()
    path.with_name("frame.live0001.mcap").write_bytes(path.read_bytes()[:100])
    path.with_name("frame.live0002.mcap").write_bytes(b"")
    again = simulated.another(10.0)
    list(again.take_up(state_of(simulated.file)))
    again.begin()
    assert again._execution.clock.now_ns == pytest.approx(300 * 10**9, abs=100)
    again.close()
