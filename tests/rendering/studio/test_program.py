"""The pure modules of the studio's page, run by Node: geometry, view, snapping, undo, set-ups, colours, numbers."""

from __future__ import annotations

import json
import math
import shutil
import subprocess
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from bimvox.rendering.page.page import web_files

NODE = shutil.which("node")
MODULES = (
    "calendar",
    "geometry",
    "view",
    "snap",
    "history",
    "setup",
    "use",
    "types",
    "dimensions",
    "numbers",
    "revision",
    "carried",
)

pytestmark = pytest.mark.skipif(NODE is None, reason="Node.js is not here")

SETUP = {
    "cranes": [{"name": "", "machine": "flat-top-75", "base_m": [-4, -4], "height_m": 20, "jib_m": None, "falls": 2}],
    "yard": [[[0, -10], [8, -10], [8, -4], [0, -4]]],
    "construction": [[-1, -1], [9, -1], [9, 9], [-1, 9]],
    "zones": [{"name": "road", "kind": "slow", "share": 0.4, "polygon": [[20, 0], [30, 0], [30, 5]]}],
    "means": {"b": "in_situ"},
}
PARTS = [
    {"id": "a", "name": "Beam 10", "class": "IfcBeam", "storey": "Level 2", "low_m": 6, "means": "crane"},
    {"id": "b", "name": "Beam 9", "class": "IfcBeam", "storey": "Level 2", "low_m": 6, "means": "crane"},
    {"id": "c", "name": "Column", "class": "IfcColumn", "storey": "Level 1", "low_m": 0, "means": "crane"},
    {"id": "d", "name": "Old wall", "class": "IfcWall", "storey": None, "low_m": -1, "means": "pinned"},
]
FOUND = {
    "a": {"utilisation": 0.75, "reason": None},
    "b": {"utilisation": None, "reason": None},
    "c": {"utilisation": None, "reason": "too far"},
    "d": {"utilisation": None, "reason": None},
}


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Callable[..., Any]:
    """Return what evaluates an expression over the modules, each under its own name, laid out as they are served."""
    folder = tmp_path_factory.mktemp("web")
    for name, content in web_files().items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(content)
    imports = "".join(f'import * as {name} from "{(folder / "studio" / name).as_uri()}.mjs";\n' for name in MODULES)

    def evaluated(body: str, asked: Any = None) -> Any:
        program = f"{imports}const asked = {json.dumps(asked)};\nconsole.log(JSON.stringify({body}));"
        done = subprocess.run([NODE, "--input-type=module"], input=program, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    return evaluated


def test_areas_centres_and_nearest_points(run):
    square = [[0, 0], [4, 0], [4, 2], [0, 2]]
    assert run("[geometry.areaOf(asked), geometry.centreOf(asked), geometry.boundsOf(asked)]", square) == [
        8,
        [2, 1],
        [0, 0, 4, 2],
    ]
    assert run("geometry.nearestOfAll(geometry.edgesOf(asked), [5, 1])", square) == [4, 1]
    assert run("[geometry.isInside(asked, [1, 1]), geometry.isInside(asked, [5, 1])]", square) == [True, False]
    assert run("geometry.centreOf([[1, 1], [3, 1], [5, 1]])") == [3, 1]  # no area


@pytest.mark.parametrize("turn", [0.0, 20.0, -133.7])
def test_map_coordinates_are_those_of_a_turned_frame(run, turn):
    points = np.random.default_rng(1).uniform(-200, 200, (20, 2))
    site_map = {"eastings_m": 691234.5, "northings_m": 5334567.25, "x_axis_deg": turn}
    body = """asked[0].map((at) => {
      const there = geometry.toMap(at, asked[1]);
      return [there, geometry.fromMap(there, asked[1])];
    })"""
    there, back = zip(*run(body, [points.tolist(), site_map]), strict=True)
    cos, sin = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    wanted = points @ np.array([[cos, sin], [-sin, cos]]) + [691234.5, 5334567.25]
    np.testing.assert_allclose(there, wanted, atol=1e-6)
    np.testing.assert_allclose(back, points, atol=1e-6)


def test_north_is_the_models_or_the_maps(run):
    body = "[geometry.northOf(12, asked), geometry.northOf(null, asked), geometry.northOf(null, null)]"
    assert run(body, {"x_axis_deg": 20}) == [12, 20, None]


def test_a_fitted_view_holds_the_bounds_and_pixels_come_back(run):
    body = """(() => {
      const one = view.fitted([-10, -5, 30, 15], 800, 600, [10, 20, 30, 40]);
      const corners = [[-10, -5], [30, 15]].map((at) => view.toPixels(one, at));
      const back = corners.map((at) => view.toMetres(one, at));
      const near = view.zoomed(one, 0.5, [100, 100]);
      const still = [one, near].map((each) => view.toMetres(each, [100, 100]));
      const before = view.toPixels(one, [0, 0]);
      const panned = view.toPixels(view.panned(one, 30, 40), [0, 0]).map((value, n) => value - before[n]);
      return { corners, back, still, scale: near.scale / one.scale, panned };
    })()"""
    found = run(body)
    (x0, y1), (x1, y0) = found["corners"]
    assert min(x0 - 10, 770 - x1, y0 - 20, 560 - y1) >= -1e-9
    np.testing.assert_allclose(found["back"], [[-10, -5], [30, 15]])
    np.testing.assert_allclose(*found["still"])
    assert found["scale"] == pytest.approx(0.5)
    np.testing.assert_allclose(found["panned"], [30, 40])


def test_scale_bars_have_round_lengths(run):
    lengths = run("[0.003, 0.04, 0.09, 0.2, 1].map((scale) => view.scaleBar({ scale }, 100))")
    assert [bar["length_m"] for bar in lengths] == pytest.approx([0.2, 2, 5, 20, 100])
    for bar, scale in zip(lengths, [0.003, 0.04, 0.09, 0.2, 1], strict=True):
        assert bar["pixels"] <= 100 + 1e-9
        assert bar["pixels"] * scale == pytest.approx(bar["length_m"])
    assert run("view.multiples(-5, 11, 5)") == [-5, 0, 5, 10]


def test_a_point_snaps_to_corners_then_edges_then_the_grid(run):
    edges = [[[0, 0], [10.2, 0]]]
    snap = "asked[0].map((at) => snap.snapped(at, asked[1], 0.3))"
    places = [[10.1, 0.1], [4.2, 0.2], [4.2, 0.4], [-0.1, 7.74]]
    assert run(snap, [places, edges]) == [
        {"at": [10.2, 0], "on": "corner"},
        {"at": [4.2, 0], "on": "edge"},
        {"at": [4, 0.5], "on": "grid"},
        {"at": [0, 7.5], "on": "grid"},
    ]
    assert run("snap.snapped([4.2344, 0.1], asked, 0.3, true)", edges) == {"at": [4.234, 0.1], "on": None}
    assert run("[snap.stepOf('ArrowUp', false), snap.stepOf('ArrowLeft', true), snap.stepOf('a', true)]") == [
        [0, 0.5],
        [-0.1, 0],
        None,
    ]


def test_undo_and_redo(run):
    body = """(() => {
      const all = new history.History({ n: 0 });
      all.push({ n: 1 }, "one");
      all.push({ n: 1 }, "nothing");
      all.push({ n: 2 }, "two");
      all.push({ n: 3 }, "two", true);
      const said = [all.undo(), all.state.n, all.undo(), all.state.n, all.undo()];
      said.push(all.redo(), all.state.n, all.redo(), all.state.n, all.redo());
      const changed = [all.isChanged, (all.markSaved(), all.isChanged), (all.undo(), all.isChanged)];
      all.push({ n: 9 }, "nine");
      return [said, changed, all.canRedo];
    })()"""
    said, changed, redo = run(body)
    assert said == ["two", 1, "one", 0, None, "one", 1, "two", 3, None]
    assert changed == [True, False, True]
    assert redo is False


def test_handles_move_what_they_hold_and_nothing_else(run):
    handles = run("setup.handlesOf(asked)", SETUP)
    assert [handle["id"] for handle in handles] == [
        "cranes/0",
        "yard/0",
        *(f"yard/0/{n}" for n in range(4)),
        "construction/0",
        *(f"construction/0/{n}" for n in range(4)),
        "zones/0",
        *(f"zones/0/{n}" for n in range(3)),
    ]
    assert handles[1]["at"] == [4, -7]
    body = """asked[1].map((id) => {
      const moved = setup.moved(asked[0], id, [0.5, -0.1]);
      return { moved, anchors: [asked[0], moved].map((one) => setup.anchorOf(one, id)) };
    })"""
    ids = [handle["id"] for handle in handles]
    for name, found in zip(ids, run(body, [SETUP, ids]), strict=True):
        room, *numbers = name.split("/")
        assert {key for key in SETUP if found["moved"][key] != SETUP[key]} == {room}
        np.testing.assert_allclose(np.diff(found["anchors"], axis=0)[0], [0.5, -0.1], atol=1e-9)
        if len(numbers) == 2:
            before, after = (str(one[room]).replace(" ", "").split("],[") for one in (SETUP, found["moved"]))
            assert sum(a != b for a, b in zip(before, after, strict=True)) == 1


def test_corners_and_areas_come_and_go(run):
    more = run("setup.withCorner(asked, 'yard/0', 3)", SETUP)["yard"][0]
    assert len(more) == 5
    assert more[4] == [0, -7]
    assert run("setup.withoutCorner(asked, 'zones/0', 1)", SETUP) == SETUP  # three stay
    assert len(run("setup.withoutCorner(asked, 'yard/0', 1)", SETUP)["yard"][0]) == 3
    assert run("setup.withoutArea(asked, 'yard/0')", SETUP) == SETUP  # the last yard stays
    assert run("setup.withoutArea(asked, 'zones/0')", SETUP)["zones"] == []
    access = run("setup.withArea(asked, 'access', [0, 0], '', [12, 4])", SETUP)
    assert access["access"] == [[[-6, -2], [6, -2], [6, 2], [-6, 2]]]
    assert [area["id"] for area in run("setup.areasOf(asked)", access)][:2] == ["yard/0", "access/0"]
    assert run("setup.moved(asked, 'access/0/1', [1, 0])", access)["access"][0][1] == [7, -2]
    assert run("setup.withoutArea(asked, 'access/0')", access)["access"] == []
    zone = run("setup.withArea(asked, 'zones', [0.2, 0], 'limiter')", SETUP)["zones"][1]
    assert zone["lowest_hook_m"] == 10
    assert run("setup.withKind(asked, 0, 'public')", SETUP)["zones"][0] == {
        "name": "road",
        "kind": "public",
        "polygon": SETUP["zones"][0]["polygon"],
    }


def test_obstructions_stay_boxes_and_are_not_part_of_the_site_file(run):
    boxes = [{"id": "truck", "min": [0, 0, 0], "max": [2.5, 8, 4]}]
    given = {**SETUP, "boxes": boxes}
    moved = "setup.moved(asked[0], asked[1], asked[2]).boxes[0]"
    assert run(moved, [given, "boxes/0", [1, -1]]) == {"id": "truck", "min": [1, -1, 0], "max": [3.5, 7, 4]}
    assert run(moved, [given, "boxes/0/1", [1, -1]]) == {"id": "truck", "min": [0, -1, 0], "max": [3.5, 8, 4]}
    assert run(moved, [given, "boxes/0/3", [9, -1]]) == {"id": "truck", "min": [2.4, 0, 0], "max": [2.5, 7, 4]}
    assert run("setup.withObstruction(asked, [1, 2]).boxes.map((box) => box.id)", given) == ["truck", "obstruction 2"]
    assert run("setup.saved(asked)", given) == SETUP
    assert run("setup.withoutArea(asked, 'boxes/0').boxes", given) == []
    body = """(() => {
      const all = new history.History(asked, setup.saved);
      all.push(setup.moved(asked, "boxes/0", [1, 1]), "move");
      const before = all.isChanged;
      all.push(setup.moved(asked, "cranes/0", [1, 1]), "move");
      return [before, all.isChanged];
    })()"""
    assert run(body, given) == [False, True]


def test_cranes_are_added_under_names_of_their_own_and_removed(run):
    body = """(() => {
      const place = setup.acrossOf(asked.cranes[0].base_m, [[[0, 0], [8, 0], [8, 6], [0, 6]]]);
      const two = setup.withNewCrane(asked, "flat-top-75", place);
      const three = setup.withNewCrane(two, "flat-top-75", [1.1, 2.4]);
      const again = setup.withNewCrane(setup.withoutCrane(three, 1), "flat-top-75", [0, 0]);
      const names = again.cranes.map(({ name }) => name);
      return [three.cranes.map(({ name, base_m }) => [name, base_m]), names, setup.withoutCrane(asked, 0) === asked];
    })()"""
    three, again, stays = run(body, SETUP)
    assert three == [["Crane 1", [-4, -4]], ["Crane 2", [12, 10]], ["Crane 3", [1, 2.5]]]
    assert again == ["Crane 1", "Crane 3", "Crane 4"]
    assert stays


def test_a_revision_is_told_in_words(run):
    event = {"revision": 2, "kept": ["a", "b"], "replanned": ["c"], "retimed": [], "infeasible": ["d"]}
    event |= {
        "blocked": [{"component": "d", "reason": "its place is taken", "blocked_by": ["truck"]}],
        "latency_ms": 84,
    }
    words = "Revision 2: 2 kept, 1 replanned, 0 with new motion, 1 refused · 84 ms"
    assert run("revision.revisionWords(asked)", event) == words
    assert run("[...revision.changesOf(asked)].map(([id, change]) => [id, revision.changeWords(change)])", event) == [
        ["c", "new path"],
        ["d", "cannot be set: its place is taken (truck)"],
    ]


def test_a_revision_names_its_cause_and_the_load_that_was_stopped(run):
    event = {"revision": 3, "kept": ["a"], "replanned": ["b"], "retimed": ["c"], "infeasible": []}
    event |= {"obstructions": ["truck"], "stopped": {"component": "b", "held": False, "safe": True}}
    assert run("revision.revisionWords(asked)", event).startswith("Revision 3 (truck): 1 kept, 1 replanned")
    assert run("[...revision.changesOf(asked).values()].map(revision.changeWords)", event) == [
        "same path, new motion, because of truck",
        "new path, because of truck",
    ]
    assert run("revision.stopWords(asked, (id) => id.toUpperCase())", event) == (
        "B was stopped and goes on along a new path"
    )
    held = {"stopped": {"component": "b", "held": True, "safe": False}}
    assert "is held" in run("revision.stopWords(asked, (id) => id)", held)
    assert "no stop was free" in run("revision.stopWords(asked, (id) => id)", held)
    assert run("revision.stopWords(asked, (id) => id)", {"stopped": None}) is None


def test_a_plan_that_is_carried_out_has_a_time_and_parts_on_the_way(run):
    body = """(() => {
      let now = 0;
      const one = new carried.CarriedOut(() => now);
      const told = [];
      const tell = () => told.push(one.words((id) => id));
      const state = (component, name, time_s) => one.take({ event: "state", component, state: name, time_s });
      tell();
      one.take({ event: "planned", kept: [], replanned: ["a", "b"] });
      one.take({ event: "clock", time_s: 0, speed: 60 });
      now = 2000;
      tell();
      state("a", "in_transit", 100);
      tell();
      const stages = ["a", "b"].map((id) => one.stageOf(id));
      one.take({ event: "replanned", kept: ["b"], replanned: ["a"], stopped: { component: "a", held: true } });
      tell();
      one.take({ event: "replanned", kept: ["b"], replanned: ["a"], stopped: null });
      state("a", "assembled", 110);
      state("b", "assembled", 200);
      now = 9e6;
      tell();
      return [told, stages, one.stageOf("b")];
    })()"""
    told, stages, last = run(body)
    assert told == [
        "The simulation starts",
        "0:02:00 · between two lifts · 0 of 2 set",
        "0:02:00 · lifting a · 0 of 2 set",
        "0:02:00 · a is held · 0 of 2 set",
        "0:03:20 · all parts are set · 2 of 2 set",
    ]
    assert stages == ["lifting", "unset"]
    assert last == "set"


def test_each_part_has_the_colour_of_its_use(run):
    states = run("asked[0].map((part) => use.stateOf(part, asked[1], asked[2][part.id]))", [PARTS, SETUP, FOUND])
    assert states == ["u2", "in_situ", "cannot", "pinned"]
    bands = run(
        "asked.map((utilisation) => use.stateOf({ id: 'x', means: 'crane' }, { means: {} }, { utilisation }))",
        [0, 0.5, 0.51, 0.9, 0.901, 1],
    )
    assert bands == ["u1", "u1", "u2", "u3", "u4", "u4"]
    assert run("use.stateOf({ id: 'x', means: 'crane' }, { means: {} })") == "unknown"
    assert run("use.countsOf(asked[0], asked[1], asked[2])", [PARTS, SETUP, FOUND]) == dict.fromkeys(states, 1)


def test_the_list_is_grouped_from_below_and_filtered(run):
    groups = run("use.grouped(asked)", PARTS)
    assert [group["title"] for group in groups] == ["No storey · Wall", "Level 1 · Column", "Level 2 · Beam"]
    assert [part["name"] for part in groups[2]["parts"]] == ["Beam 9", "Beam 10"]
    find = "use.matching(asked[0], asked[1], null, () => 'u1').map((part) => part.id)"
    assert run(find, [PARTS, "BEAM level"]) == ["a", "b"]
    assert run(find, [PARTS, "beam 9"]) == ["b"]
    assert run(find, [PARTS, "roof"]) == []
    shown = "use.matching(asked[0], '', new Set(['cannot']), (part) => asked[1][part.id])"
    assert [part["id"] for part in run(shown, [PARTS, {"a": "u1", "c": "cannot"}])] == ["c"]
    assert run("use.commonMeans(asked[0], asked[1])", [PARTS[:2], SETUP]) == ""
    assert run("setup.withMeans(asked, ['a', 'b'], 'by_hand').means", SETUP) == {"a": "by_hand", "b": "by_hand"}


def test_a_correction_of_a_type_is_found_by_what_selects_it(run):
    row = {"select": "IfcWall", "kind": "concrete", "means": "crane"}
    timber = run("types.withType(asked[0], asked[1], 'kind', 'timber')", [SETUP, row])
    assert timber["kinds"] == [{"select": "IfcWall", "kind": "timber", "means": None}]
    assert run("types.typeOf(asked[0], asked[1])", [timber, row]) == {
        "kind": "timber",
        "means": "crane",
        "isChosen": True,
    }
    assert run("types.typeOf(asked[0], asked[1]).isChosen", [SETUP, row]) is False
    built = run("types.withType(asked[0], asked[1], 'means', 'built')", [timber, row])
    assert built["kinds"] == [{"select": "IfcWall", "kind": "timber", "means": "built"}]
    assert run("types.withPartKind(asked, 'a', 'steel').part_kinds", SETUP) == {"a": "steel"}
    assert run("[types.sameKinds(asked[0], asked[0]), types.sameKinds(asked[0], asked[1])]", [timber, built]) == [
        True,
        False,
    ]


def test_dimensions_of_what_is_dragged(run):
    edges = [[[0, 0], [9, 0]]]
    texts = "dimensions.dimensionsOf(asked[0], asked[1], asked[2]).map((one) => one.text)"
    assert run(texts, [SETUP, "cranes/0", edges]) == ["5.66 m", "4.00 m"]
    assert run(texts, [SETUP, "yard/0/0", edges]) == ["6.00 m", "8.00 m"]
    assert run(texts, [SETUP, "yard/0", edges]) == ["8.00 m", "6.00 m", "8.00 m", "6.00 m"]
    assert run("dimensions.areaWords(asked)", SETUP["yard"][0]) == "48.0 m²"


def test_typed_shifts(run):
    typed = ["07:00-16:00", "7:00 – 12:00,13:00-17:00", "22:00-06:00", "", "7-16", "07:00-25:00", "07:60-08:00"]
    assert run("asked.map(calendar.shiftsOf)", typed) == [
        ["07:00-16:00"],
        ["07:00-12:00", "13:00-17:00"],
        ["22:00-06:00"],
        None,
        None,
        None,
        None,
    ]


def test_typed_numbers(run):
    typed = ["12.5", " -3 ", "12,5", "+.5", "4 m", "1,234.5", "", "x", "1e3", "12.5.1"]
    assert run("asked.map(numbers.numberOf)", typed) == [12.5, -3, 12.5, 0.5, 4, None, None, None, None, None]
    site_map = {"eastings_m": 500000, "northings_m": 4000000, "x_axis_deg": 90}
    assert run("numbers.shownPair([3, 4], asked)", site_map) == [499996, 4000003]
    assert run("numbers.pointOf([499996, 4000003], asked)", site_map) == [3, 4]
    assert run("[numbers.shownPair([3, 4], null), numbers.written(-0.0001)]") == [[3, 4], "0"]
