"""The page's own program, run by Node: it unpacks, interpolates and determines states as the log does."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from log_building import tiny_log
from opened_pages import Opened, tiny_source

from bimvox.log.moving import tracks_of
from bimvox.log.plan_log import log_times
from bimvox.log.scene import states_before
from bimvox.rendering.page import page as assets
from bimvox.rendering.page.page import page_of
from bimvox.rendering.words import plain
from bimvox.site.component import ConstructionState

NODE = shutil.which("node")
WEB = Path(assets.__file__).parent / "web"
PRELUDE = """
import { readFileSync } from "node:fs";
import { opened, unpack } from "%(web)s/container.mjs";
import { gunzip } from "%(web)s/inflate.mjs";
import { axesAt, hookOf, loadAt, motionOf, storedAt, wayOf } from "%(web)s/motion.mjs";
import { Plan, sorted } from "%(web)s/plan.mjs";
import { clock, localDate, nameOf, plain, shortClock, span } from "%(web)s/words.mjs";
const packed = readFileSync(process.argv[2], "utf8");
const asked = JSON.parse(readFileSync(process.argv[3], "utf8"));
const { document: page, numbers } = await unpack(packed);
const motions = page.motions.map((record) => motionOf(record, numbers, page.scales));
const plan = new Plan(page.revisions[0], page.parts, motions);
"""

pytestmark = pytest.mark.skipif(NODE is None, reason="Node.js is not here")


@pytest.fixture(scope="module", params=[True, False], ids=["crane", "no crane"])
def crane(request) -> bool:
    return request.param


def run(folder: Path, body: str, asked: Any = None, *, crane: bool = True) -> Any:
    (folder / "packed").write_text(Opened(page_of(tiny_source(crane=crane))).packed)
    (folder / "asked.json").write_text(json.dumps(asked))
    (folder / "run.mjs").write_text(PRELUDE % {"web": WEB.as_uri()} + f"\nconsole.log(JSON.stringify({body}));")
    done = subprocess.run(
        [NODE, folder / "run.mjs", folder / "packed", folder / "asked.json"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_loads_are_where_the_log_has_them(tmp_path, crane):
    tracks = tracks_of(tiny_log(crane=crane))
    asked = [[track.lift.order, ((track.time_ns - track.start_ns) / 1e9).tolist()] for track in tracks]
    body = """asked.map(([order, times]) => times.map((at) => {
      const lift = plan.lifts[order];
      return loadAt(plan.motionOf(lift), page.crane?.base_m, lift.stored, at);
    }))"""
    for track, found in zip(tracks, run(tmp_path, body, asked, crane=crane), strict=True):
        corner_m = np.array([entry["corner"] for entry in found])
        assert np.linalg.norm(corner_m - track.corner_m, axis=1).max() < 0.02
        tilt = np.array([entry["tilt"] for entry in found])
        held = track.time_ns < track.arrived_ns
        assert np.abs(tilt - track.tilt)[held].max() < 0.005


def test_states_are_those_of_the_log(tmp_path, crane):
    log = tiny_log(crane=crane)
    numbers = {None: 0, "unbuilt": 1, "in_transit": 2, "arrived": 3, "assembled": 4}
    asked, wanted = [], []
    for track in tracks_of(log):
        before = states_before(log.all_lifts, track.lift.order)
        for time_ns, state in (
            (track.lifted_ns, ConstructionState.IN_TRANSIT),
            (track.arrived_ns, ConstructionState.ARRIVED),
            (track.assembled_ns, ConstructionState.ASSEMBLED),
        ):
            if time_ns == track.end_ns and track.lift.order == 0:
                continue  # the next lift starts at that moment
            asked.append(time_ns / 1e9 + 1e-6)
            now = {**before, track.lift.component: state}
            wanted.append([numbers[now.get(n)] for n in range(3)])
    found = run(tmp_path, "asked.map((time) => Array.from(plan.statesAt(time)))", asked, crane=crane)
    assert found == wanted


def test_a_part_that_lies_in_the_yard_fills_its_cells_there(tmp_path):
    site = tiny_log().plan.site
    found = run(tmp_path, "plan.lifts.map((lift) => storedAt(lift, page.parts[lift.part]))")
    for lift, entry in zip(tiny_log().plan.lifts, found, strict=True):
        x, y, z, w = entry["tilt"]
        size = np.array(site.components[lift.component].shape.size_vox) * site.frame.voxel_size_m
        corners = np.array([[a, b, c] for a in (0, size[0]) for b in (0, size[1]) for c in (0, size[2])])
        u = np.array([x, y, z])
        turned = corners + 2 * np.cross(u, np.cross(u, corners) + w * corners) + entry["corner"]
        np.testing.assert_allclose(turned.min(axis=0), site.frame.corner_of(lift.place.cell_vox), atol=1e-6)
        high = site.frame.corner_of(np.array(lift.place.cell_vox) + lift.place.shape.size_vox)
        np.testing.assert_allclose(turned.max(axis=0), high, atol=1e-6)


def test_unpacking_for_old_browsers_gives_the_same(tmp_path):
    body = """(() => {
      const bytes = Uint8Array.from(atob(packed.trim()), (letter) => letter.charCodeAt(0));
      return JSON.stringify(opened(gunzip(bytes)).document) === JSON.stringify(page);
    })()"""
    assert run(tmp_path, body) is True


def test_a_lift_is_critical_from_the_share_that_the_site_says(tmp_path):
    assert run(tmp_path, "plan.hot") == tiny_log().plan.site.rules.critical_share


def test_search_and_sorting(tmp_path):
    body = """({
      beam: plan.matching("BEAM").map((lift) => lift.order),
      id: plan.matching("0globalidcolumna").map((lift) => lift.order),
      words: plan.matching("column infeasible").map((lift) => lift.order),
      none: plan.matching("door").length,
      critical: sorted(plan, plan.lifts, "utilisation", true).map((lift) => lift.order),
      duration: sorted(plan, plan.lifts, "duration", true).map((lift) => lift.order),
      names: sorted(plan, plan.lifts, "name", false).map((lift) => lift.order),
    })"""
    found = run(tmp_path, body)
    lengths = [motion.end_ns - motion.start_ns for motion in tiny_log().motions]
    assert found["beam"] == [2]
    assert found["id"] == [0]
    assert found["words"] == [1]
    assert found["none"] == 0
    assert found["critical"][-1] == 1
    assert found["duration"] == ([0, 2, 1] if lengths[0] > lengths[1] else [2, 0, 1])
    assert found["names"] == [2, 0, 1]


def test_times_in_words(tmp_path):
    body = "[clock(0), clock(3723.4), shortClock(288), shortClock(3723), span(30.25), span(252), span(41207)]"
    assert run(tmp_path, "[localDate(1773385950)]") == ["Fri 13 Mar 2026 07:12"]
    assert run(tmp_path, body) == ["0:00:00", "1:02:03", "4:48", "1:02:03", "30.3 s", "4 min 12 s", "11 h 27 min"]


def test_without_a_start_the_site_has_numbered_working_days(tmp_path):
    log = tiny_log()
    times = log_times(log)
    assert times is not None
    middles_ns = [(motion.hooked_ns + motion.released_ns) // 2 for motion in log.motions]
    asked = [at_ns / 1e9 for at_ns in middles_ns]
    words = [times.clock_in_words(at_ns) for at_ns in middles_ns]
    found = run(tmp_path, "asked.map((at) => plan.dateAt(at))", asked)
    assert found == words
    days = "plan.revision.days = [0, 86400, 4 * 86400]"
    week = f"[3, 4, 5, 6, 7].map((day) => {{ {days}; return plan.local(day * 86400 - 3600); }})"
    assert run(tmp_path, week) == ["day 2 23:00", "day 2 23:00", "day 3 23:00", "day 3 23:00", "day 3 23:00"]
    assert run(tmp_path, "plan.dateAt(0)", crane=False) is None


def test_control_characters_of_names_are_written_out(tmp_path):
    name = 'Stütze\x1b[31m\u202e\x9b "<b>'
    found = run(tmp_path, "[plain(asked), nameOf({ name: asked })]", name)
    assert found == [plain(name)] * 2


def test_a_path_ends_at_the_target(tmp_path, crane):
    site = tiny_log(crane=crane).plan.site
    found = run(
        tmp_path,
        "plan.timed.map((lift) => wayOf(plan.motionOf(lift), page.crane?.base_m, page.parts[lift.part]))",
        crane=crane,
    )
    for lift, way in zip(tiny_log(crane=crane).planned, found, strict=True):
        component = site.components[lift.component]
        middle = np.array(component.target_vox) + np.array(component.shape.size_vox) / 2
        np.testing.assert_allclose(way[-1], site.frame.corner_of(middle), atol=0.02)
        assert len(way) > 3
