"""The page in a real browser: drawing, playing, searching and clicking work, and its numbers are those of the log."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from log_building import tiny_log
from opened_pages import EVIL, evil_log, failed_proof, passed_proof, revision_of, some_remarks, tiny_source
from seen_pages import Seen, contrast, show
from two_cranes import two_crane_plan

from bimvox.crane.kinematics import hook_of
from bimvox.log.moving import tracks_of
from bimvox.log.plan_log import PlanLog
from bimvox.records.lift import Method
from bimvox.records.proof import Check, Remark, Severity, Verification
from bimvox.rendering.page.page import page_of
from bimvox.rendering.page.source import PageSource, Revision
from bimvox.rendering.pictures.cranes import poses_at

pytestmark = pytest.mark.browser

TO_PIXELS = """(at) => {
  const { camera, scene } = window.page, m = camera.matrix(scene.radius);
  const box = document.getElementById("canvas").getBoundingClientRect();
  const clip = [0, 1, 2, 3].map((row) => m[row] * at[0] + m[4 + row] * at[1] + m[8 + row] * at[2] + m[12 + row]);
  return [box.left + (clip[0] / clip[3] + 1) / 2 * box.width, box.top + (1 - clip[1] / clip[3]) / 2 * box.height];
}"""


def clock(seconds: float) -> str:
    whole = int(seconds + 0.5)
    return f"{whole // 3600}:{whole // 60 % 60:02d}:{whole % 60:02d}"


def test_the_first_frame_is_a_picture_of_the_site(seen):
    picture = seen.picture()
    colours = np.unique(picture.reshape(-1, 3), axis=0)
    assert len(colours) > 200
    orange = (picture[..., 0] > 150) & (picture[..., 2] < 60) & (picture[..., 1] < picture[..., 0] - 50)
    assert orange.sum() > 50  # parts wait in the yard
    assert seen.page.title() == "tiny: lift plan"
    assert "2 lifts planned, 1 refused" in seen.text("#facts")
    assert seen.text("#proof") == "✓ proven"


def test_the_first_view_holds_jib_counter_jib_and_yard(seen):
    ends = seen.page.evaluate(
        """() => {
          const { scene, camera, plan, time } = window.page;
          const m = camera.matrix(100);
          return scene.cranes.flatMap((crane, n) => crane.ends(scene.poseOf(plan, n, time))).map(([x, y, z]) => {
            const w = m[3] * x + m[7] * y + m[11] * z + m[15];
            return [(m[0] * x + m[4] * y + m[8] * z + m[12]) / w, (m[1] * x + m[5] * y + m[9] * z + m[13]) / w];
          });
        }"""
    )
    assert len(ends) == 2
    assert all(abs(value) <= 1.0 for end in ends for value in end), ends


def test_following_from_above_does_not_look_along_the_rope(seen):
    seen.page.keyboard.press("1")
    seen.wait("window.page.camera.elevation > 80 && !window.page.camera.glide")
    seen.page.keyboard.press("4")
    seen.wait("window.page.camera.elevation < 60 && !window.page.camera.glide")
    seen.page.keyboard.press("4")


def test_every_lift_is_in_the_list_with_the_numbers_of_the_log(seen):
    log = tiny_log()
    rows = seen.page.eval_on_selector_all("#list tbody tr", "(rows) => rows.map((row) => row.innerText)")
    assert len(rows) == 3
    assert "infeasible" in rows[1]
    for n, motion in enumerate(log.motions):
        component = log.plan.site.components[motion.component]
        seen.page.click(f'#list tr[data-part="{motion.component}"] button')
        lift, terms = log.plan.lifts[motion.order], seen.terms()
        assert seen.text("#panel-part h2") == component.name
        assert terms["GlobalId"] == component.global_id
        assert terms["Class"] == component.ifc_class
        assert terms["Mass"] == f"{component.mass_kg / 1000:.2f} t"
        assert terms["Cells"] == str(len(component.shape.cells))
        assert terms["Moves"].startswith(f"{lift.moves} cells")
        assert terms["Shortest"] == f"{lift.shortest_moves} cells"
        found_by = {Method.POLICY: "policy", Method.GREEDY: "towards the target", Method.SEARCH: "search (A*)"}
        assert terms["Found by"] == found_by[lift.method]
        # Each lift has a delivery of its own, which is unloaded for half an hour before it.
        minutes = 7 * 60 + 30 * (n + 1) + (motion.start_ns - log.motions[0].start_ns) // (60 * 10**9)
        assert terms["Begins"] == f"day 1 {minutes // 60:02}:{minutes % 60:02}"
        assert terms["Bound"].startswith(f"{motion.loaded.bound_s:.1f} s")
        assert terms["Carrying"] == f"{motion.loaded.duration_s:.1f} s"
        crane = log.plan.site.cranes[0]
        assert terms["On the hook"].startswith(f"{(component.mass_kg + crane.tackle_kg) / 1000:.2f} t ")
        radius_m = max(motion.raising.radius_m.max(), motion.loaded.radius_m.max())
        assert terms["Gross capacity"].endswith(f"at {radius_m:.2f} m")
        share = float(terms["Utilisation"].removesuffix(" %"))
        assert f"{share:.0f} %" in rows[motion.order]
        assert "✓ Proven" in seen.text("#panel-part")


def second(seen):
    """The second of the log that the page shows; its words have minutes."""
    return round(seen.page.evaluate("() => window.page.time"))


def test_sliding_shows_that_time_and_playing_continues(seen):
    log = tiny_log()
    first, last = log.motions
    track = tracks_of(log)[1]
    seen.seek(track.lifted_ns / 1e9 + 5)
    assert second(seen) == round(track.lifted_ns / 1e9 + 5)
    assert "Lift 3 of 3: Beam" in seen.text("#now")
    assert seen.text("#clock").startswith("day 1 0"), "in the same words as everywhere"
    assert seen.page.get_attribute("#time", "aria-valuetext").endswith("lift 3 of 3")
    assert seen.text("#live") == "Lift 3 of 3: Beam"
    before = seen.picture()
    blue = (before[..., 2] > 120) & (before[..., 0] < 60)
    assert blue.sum() > 100  # the load and its path
    seen.page.select_option("#speed", "20")
    seen.page.click("#play")
    seen.wait(f"Number(document.getElementById('time').value) > {track.lifted_ns / 1e9 + 8}")
    assert seen.page.get_attribute("#play", "aria-label") == "Pause"
    seen.page.keyboard.press("Escape")
    seen.page.click("#play")
    stopped = seen.text("#clock")
    assert seen.shows_other(before, by=50)
    assert seen.text("#clock") == stopped
    seen.page.click("#next")
    assert second(seen) == round(last.end_ns / 1e9)
    seen.page.click("#previous")
    seen.page.click("#previous")
    assert second(seen) == round(first.start_ns / 1e9)


def test_the_load_is_drawn_where_the_log_has_it(seen):
    track = tracks_of(tiny_log())[1]
    for n in (0, len(track.time_ns) // 3, len(track.time_ns) // 2):
        seen.seek(track.time_ns[n] / 1e9)
        seen.picture()
        place = seen.page.evaluate("() => window.page.scene.rows.placeOf(window.page.scene.partRow(2))[0]")
        np.testing.assert_allclose(place, track.corner_m[n], atol=0.11)  # the slider steps by 0.1 s
        seen.page.evaluate("(at) => window.page.seek(at)", track.time_ns[n] / 1e9)
        seen.picture()
        place = seen.page.evaluate("() => window.page.scene.rows.placeOf(window.page.scene.partRow(2))[0]")
        np.testing.assert_allclose(place, track.corner_m[n], atol=0.02)


def test_a_click_on_a_part_in_the_view_chooses_it(seen):
    log = tiny_log()
    seen.seek(log.motions[-1].end_ns / 1e9)
    seen.picture()
    for index in (2, 0):
        component = log.plan.site.components[index]
        low, high = component.mesh.bounds_m
        middle = (low + high) / 2
        eye = np.array(seen.page.evaluate("() => window.page.camera.eye"))
        # The side nearest to the camera: the middle of the face that it sees best.
        axis = int(np.argmax(np.abs((eye - middle) / (high - low))[:2]))
        at = middle.copy()
        at[axis] = high[axis] if eye[axis] > middle[axis] else low[axis]
        x, y = seen.page.evaluate(TO_PIXELS, at.tolist())
        seen.page.mouse.click(x, y)
        assert seen.text("#panel-part h2") == component.name
        assert seen.page.get_attribute("#list tr.chosen", "data-part") == str(index)
    seen.page.mouse.click(640, 240)
    assert seen.page.evaluate("() => window.page.chosen") is None
    assert seen.page.locator("#list tr.chosen").count() == 0


def test_a_drag_turns_the_view_and_chooses_nothing(seen):
    before = seen.page.evaluate("() => window.page.camera.azimuth")
    seen.page.mouse.move(600, 400)
    seen.page.mouse.down()
    seen.page.mouse.move(700, 420, steps=4)
    seen.page.mouse.up()
    assert seen.page.evaluate("() => window.page.camera.azimuth") < before - 20
    assert seen.page.evaluate("() => window.page.chosen") is None
    distance = seen.page.evaluate("() => window.page.camera.distance")
    seen.page.mouse.wheel(0, -300)
    seen.wait(f"window.page.camera.distance < {distance}")


def test_an_infeasible_lift_says_why_and_leads_to_what_blocks_it(seen):
    seen.page.click("#list tr.bad button")
    told = seen.text("#panel-part")
    assert "INFEASIBLE" in told
    assert "The obstruction stands on its place" in told
    picture = seen.picture()
    assert ((picture[..., 0] > 170) & (picture[..., 1] < 70) & (picture[..., 2] < 60)).sum() > 30  # red boxes
    seen.page.click("#panel-part .links button")
    assert seen.text("#panel-part h2") == "truck-7"
    assert "ColumnB" in seen.text("#panel-part")


def test_search_and_sort(seen):
    seen.page.keyboard.press("/")
    seen.page.keyboard.type("0globalidcol")
    rows = "#list tbody tr"
    assert seen.page.locator(rows).count() == 2
    assert seen.text("#count") == "2 of 3 parts"
    seen.page.keyboard.press("Escape")
    assert seen.page.locator(rows).count() == 3
    seen.page.click('[data-sort="utilisation"]')
    shares = seen.page.eval_on_selector_all(rows, "(rows) => rows.map((row) => row.cells[3].innerText)")
    assert shares[-1] == ""
    assert [float(share[:-2]) for share in shares[:2]] == sorted([float(s[:-2]) for s in shares[:2]], reverse=True)


def test_keys(seen):
    press = seen.page.keyboard.press
    log = tiny_log()
    press("ArrowRight")
    assert second(seen) == round(log.motions[1].start_ns / 1e9)
    press("ArrowLeft")
    assert second(seen) == 0
    press("Shift+ArrowRight")
    assert second(seen) == 10
    press("ArrowUp")
    assert seen.page.input_value("#speed") == "100"
    press("1")
    assert seen.page.evaluate("() => window.page.camera.elevation") > 89
    press("2")
    assert seen.page.evaluate("() => window.page.camera.elevation") < 10
    press("4")
    assert seen.page.get_attribute('[data-view="follow"]', "aria-pressed") == "true"
    press("3")
    assert seen.page.get_attribute('[data-view="follow"]', "aria-pressed") == "false"
    press("v")
    assert seen.page.evaluate("() => window.page.layers.voxels") is True
    press("p")
    assert seen.page.input_value("#paths") == "chosen"
    press("?")
    assert seen.page.is_visible("#help")
    press("Escape")
    assert not seen.page.is_visible("#help")
    press("End")
    assert second(seen) == round(log.motions[-1].end_ns / 1e9)
    press(" ")
    seen.wait("Number(document.getElementById('time').value) > 0")
    press(" ")
    assert seen.page.get_attribute("#play", "aria-label") == "Play"


def test_a_row_is_a_button_for_the_keyboard(seen):
    seen.page.focus("#list tbody tr:nth-child(3) button")
    seen.page.keyboard.press("Enter")
    assert seen.text("#panel-part h2") == "Beam"
    assert seen.page.get_attribute("#list tr.chosen button", "aria-current") == "true"


@pytest.mark.parametrize("layer", ["crane", "yard", "structure", "obstructions", "boxes", "voxels", "targets"])
def test_every_layer_changes_the_picture(seen, layer):
    seen.seek(tracks_of(tiny_log())[0].lifted_ns / 1e9 + 3)
    before = seen.picture()
    seen.page.click("#layers summary")
    seen.page.click(f'[data-layer="{layer}"]')
    seen.page.click("#layers summary")
    assert seen.shows_other(before, by=24, pixels=20)


def test_the_plan_says_how_it_was_proven_and_from_what(seen):
    seen.page.click("#plan-button")
    told, terms = seen.text("#panel-plan"), seen.terms("#panel-plan")
    assert "Proven again" in told
    assert "2 checks, 19 samples" in told
    assert "Provided that:" in told
    assert "there is no wind" in told
    assert terms["Planned"] == "2 of 3 lifts"
    assert terms["Model"] == "tiny.ifc"
    assert "cd" * 32 in told
    assert "ab" * 32 in told
    assert "nothing supports the far end of the beam" in told
    assert "at least 250.0 mm" in told


def test_a_plan_that_is_not_proven_says_so(browser, tmp_path):
    for proof, why in ((None, "no proof was made"), (failed_proof("0GlobalIdBeam"), "cells")):
        seen = show(browser, tmp_path, tiny_source(proof=proof))
        assert seen.text("#proof") == f"✕ NOT PROVEN: {why}"
        seen.page.click('#list tr[data-part="2"] button')
        assert "NOT PROVEN" in seen.text("#panel-part")
        seen.page.click("#plan-button")
        assert "NOT PROVEN" in seen.text("#panel-plan")
        if proof:
            assert "is in cells of truck-7" in seen.text("#panel-plan")
        seen.page.context.close()


def test_the_remarks_are_listed_and_lead_to_their_lifts(browser, tmp_path):
    log = tiny_log()
    source = tiny_source(proof=passed_proof(), remarks=some_remarks(floating=8))
    seen = show(browser, tmp_path, source, reduced_motion="reduce")
    assert (seen.text("#proof"), seen.text("#remarks-button")) == ("proven", "⚠\ufe0e 10 remarks (8 serious)")
    for chip in ("#proof", "#remarks-button"):
        assert "serious" in seen.page.get_attribute(chip, "class")
        paint = seen.page.evaluate("(at) => getComputedStyle(document.querySelector(at)).backgroundColor", chip)
        assert paint == "rgb(255, 181, 46)"
    seen.page.focus("#remarks-button")
    seen.page.keyboard.press("Enter")
    assert seen.page.evaluate("() => document.activeElement.id") == "panel-remarks"
    assert seen.page.locator("#panel-remarks h3").all_inner_texts() == [
        "⚠\ufe0e SERIOUS (8)",
        "! MINOR (2)",
        "NOTES (1)",
    ]
    # A long group is closed; its summary opens it, by the keyboard too.
    beam = "#panel-remarks .kind.serious"
    assert not seen.page.is_visible(f"{beam} li")
    seen.page.focus(f"{beam} summary")
    seen.page.keyboard.press("Enter")
    assert seen.page.locator(f"{beam} li").count() == 8
    seen.page.keyboard.press("Tab")
    seen.page.keyboard.press("Enter")
    motion = log.motions[1]
    assert seen.page.evaluate("() => window.page.chosen") == 2
    assert second(seen) == round(motion.start_ns / 1e9)
    assert seen.page.get_attribute("#list tr.chosen", "data-part") == "2"
    assert seen.page.is_visible("#panel-remarks")  # the list stays
    assert seen.page.locator("#panel-remarks [aria-current]").count() == 8
    seen.wait("document.getElementById('live').textContent === 'Lift 3: Beam, 8 remarks'")
    # An infeasible part has no lift to go to; what is about the whole plan is only text.
    seen.page.click("#panel-remarks >> text=a hand carries it")
    assert seen.page.evaluate("() => window.page.chosen") == 1
    assert second(seen) == round(motion.start_ns / 1e9)
    assert seen.page.locator("#panel-remarks .kind.minor button").count() == 1
    assert "no wind is considered" in seen.text("#panel-remarks")
    seen.page.click("#tab-part")
    assert "Remark, minor: a hand carries it" in seen.text("#panel-part")
    seen.page.keyboard.press("r")
    assert seen.page.is_visible("#panel-remarks")
    assert seen.complaints == []
    seen.page.context.close()


def test_arrow_keys_move_between_the_tabs(seen):
    seen.page.focus("#tab-part")
    for name, way in (("plan", "Right"), ("remarks", "Right"), ("part", "Right"), ("remarks", "Left")):
        seen.page.keyboard.press(f"Arrow{way}")
        assert seen.page.is_visible(f"#panel-{name}")
        assert seen.page.evaluate("() => document.activeElement.id") == f"tab-{name}"


def test_a_clean_plan_is_green_and_says_that_nothing_was_found(seen):
    assert (seen.text("#proof"), seen.text("#remarks-button")) == ("✓ proven", "no remarks")
    assert "clean" in seen.page.get_attribute("#proof", "class")
    seen.page.click("#remarks-button")
    assert "No rule of plausibility found anything" in seen.text("#panel-remarks")


def test_lifts_proven_against_earlier_obstructions_only_are_named(browser, tmp_path):
    proof = dataclasses.replace(passed_proof(), not_current=("0GlobalIdColumnA",))
    seen = show(browser, tmp_path, tiny_source(proof=proof), reduced_motion="reduce")
    assert seen.text("#proof") == "proven, 1 lift against earlier obstructions only"
    assert "remarked" in seen.page.get_attribute("#proof", "class")
    seen.page.click("#plan-button")
    seen.page.click("#panel-plan .aside button")
    assert seen.text("#panel-part h2") == "ColumnA"
    assert "not against the current ones" in seen.text("#panel-part")
    assert "✓ Proven" not in seen.text("#panel-part")
    seen.page.context.close()


@pytest.mark.parametrize(("width", "height"), [(1440, 900), (390, 844)])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_long_and_hostile_remarks_stay_in_the_window_and_can_be_read(browser, tmp_path, width, height, scheme):
    words = f"{EVIL}\x1b[31m\u202e" + "x" * 3000
    remarks = tuple(
        Remark(words, severity, words, component, words)
        for severity in Severity
        for component in ("0GlobalIdBeam", "no such part", None)
    )
    proof = dataclasses.replace(passed_proof(), not_current=("0GlobalIdColumnA",))
    source = PageSource((revision_of(evil_log(), proof, remarks),))
    seen = show(browser, tmp_path, source, reduced_motion="reduce", color_scheme=scheme)
    seen.page.set_viewport_size({"width": width, "height": height})
    seen.page.click("#remarks-button")
    for selector in ("body", "#panel-remarks"):
        assert seen.page.locator(selector).evaluate("(element) => element.scrollWidth <= element.clientWidth")
    for selector in ("#proof", "#remarks-button", "#plan-button", "#help-button", "#panel-remarks"):
        box = seen.page.locator(selector).bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= width
    assert f"{EVIL}\\x1b[31m\\u202e" in seen.text("#panel-remarks")
    assert seen.page.evaluate("() => window.hacked") is None
    assert seen.page.locator("img").count() == 1
    for chip in ("#proof", "#remarks-button", "#panel-remarks h3.serious", "#panel-remarks h3.minor"):
        assert contrast(seen, chip) >= 4.5
    assert seen.complaints == []
    seen.page.context.close()


def test_remarks_are_printed_even_of_closed_groups(browser, tmp_path):
    seen = show(browser, tmp_path, tiny_source(proof=passed_proof(), remarks=some_remarks(floating=9)))
    seen.page.evaluate("() => window.dispatchEvent(new Event('beforeprint'))")
    seen.page.emulate_media(media="print")
    assert seen.page.locator("#panel-remarks li:visible").count() == 12
    seen.page.emulate_media(media="screen")
    seen.page.evaluate("() => window.dispatchEvent(new Event('afterprint'))")
    seen.page.click("#remarks-button")
    assert not seen.page.is_visible("#panel-remarks .kind.serious li")
    seen.page.context.close()


def test_revisions_are_switched_and_say_what_changed(browser, tmp_path):
    before = tiny_log()
    beam = before.plan.lifts[2]
    blocked = dataclasses.replace(beam, path_vox=beam.path_vox[[0, *range(len(beam.path_vox))]])
    site = dataclasses.replace(before.plan.site, blockers=before.plan.site.blockers[:1])
    plan = dataclasses.replace(before.plan, site=site, lifts=(*before.plan.lifts[:2], blocked))
    after = dataclasses.replace(before, plan=plan, revision=4)
    revisions = (revision_of(before, passed_proof()), revision_of(after))
    seen = show(browser, tmp_path, PageSource(revisions), reduced_motion="reduce")
    seen.page.set_viewport_size({"width": 1700, "height": 720})  # no verdict wraps, so both pictures have one size
    assert seen.text("#proof") == "✕ NOT PROVEN: no proof was made"
    seen.page.click("#plan-button")
    terms = seen.terms("#panel-plan")
    assert (terms["Kept"], terms["Replanned"], terms["Infeasible"]) == ("1", "1", "1")
    picture = seen.picture()
    seen.page.click("#revision-earlier")
    assert seen.text("#proof") == "✓ proven"
    assert seen.shows_other(picture, by=50)  # the truck is present
    seen.page.keyboard.press("]")
    assert seen.page.input_value("#revision") == "1"
    assert seen.complaints == []
    seen.page.context.close()


@pytest.mark.parametrize("width", [1280, 900])
def test_a_long_heading_with_revisions_does_not_widen_the_page(browser, tmp_path, width):
    log = tiny_log()
    site = dataclasses.replace(log.plan.site, name="a site with a long name, " * 8)
    log = dataclasses.replace(log, plan=dataclasses.replace(log.plan, site=site))
    revisions = (revision_of(log, passed_proof()), revision_of(dataclasses.replace(log, revision=1)))
    seen = show(browser, tmp_path, PageSource(revisions), reduced_motion="reduce")
    seen.page.set_viewport_size({"width": width, "height": 700})
    assert seen.page.evaluate("document.documentElement.scrollWidth") <= width
    for name in ("#plan-button", "#help-button", "#panel-part"):
        box = seen.page.locator(name).bounding_box()
        assert box["x"] + box["width"] <= width
    seen.page.context.close()


def test_hostile_names_are_only_text(browser, tmp_path):
    seen = show(browser, tmp_path, PageSource((revision_of(evil_log(), passed_proof()),)))
    seen.page.click("#list tbody tr:nth-child(2) button")
    assert EVIL in seen.text("#panel-part h2")
    seen.page.click("#plan-button")
    assert EVIL in seen.text("#panel-plan")
    assert seen.page.evaluate("() => window.hacked") is None
    assert seen.page.locator("img").count() == 1  # the page's own code, for printing
    assert seen.complaints == []
    seen.page.context.close()


def test_control_characters_are_shown_not_obeyed(browser, tmp_path):
    bad = "a\x1b[2J\u202eb"
    log = tiny_log()
    site = log.plan.site
    parts = tuple(dataclasses.replace(part, name=bad, storey=bad, material=bad) for part in site.components)
    site = dataclasses.replace(site, name=bad, components=parts, notes=(bad,))
    lifts = tuple(dataclasses.replace(lift, reason=lift.reason and bad) for lift in log.plan.lifts)
    log = dataclasses.replace(log, plan=dataclasses.replace(log.plan, site=site, lifts=lifts))
    remark = Remark(bad, Severity.SERIOUS, bad, parts[1].id, bad)
    seen = show(browser, tmp_path, PageSource((revision_of(log, passed_proof(), (remark,)),)))
    seen.page.click("#list tr.bad button")
    said = seen.page.title()
    for tab in ("part", "plan", "remarks"):
        seen.page.click(f"#tab-{tab}")
        assert "a\\x1b[2J\\u202eb" in seen.text(f"#panel-{tab}")
        said += seen.text("body")
    assert "a\\x1b[2J\\u202eb" in seen.text("#title")
    assert not {"\x1b", "\u202e"} & set(said)
    seen.page.context.close()


def test_a_site_without_a_crane_plays_as_well(browser, tmp_path):
    seen = show(browser, tmp_path, tiny_source(crane=False, proof=passed_proof()), reduced_motion="reduce")
    assert "no crane" in seen.text("#facts")
    seen.seek(4)
    place = seen.page.evaluate(
        "() => { window.page._draw(); return window.page.scene.rows.placeOf(window.page.scene.partRow(0))[0]; }"
    )
    np.testing.assert_allclose(place, tracks_of(tiny_log(crane=False))[0].corner_m[4], atol=0.01)
    assert seen.complaints == []
    seen.page.context.close()


@pytest.mark.parametrize(("width", "height"), [(1280, 720), (1024, 768), (820, 1180)])
def test_nothing_is_out_of_the_window(seen, width, height):
    seen.page.set_viewport_size({"width": width, "height": height})
    seen.picture()
    out = seen.page.evaluate(
        """() => [...document.querySelectorAll("button, input, select, h1, canvas")].filter((e) => {
          const box = e.getBoundingClientRect();
          const out = box.left < -1 || box.right > innerWidth + 1 || box.top < -1 || box.bottom > innerHeight + 1;
          return box.width > 0 && !e.closest(".scroll, details:not([open])") && out;
        }).map((e) => e.id || e.outerHTML.slice(0, 60))"""
    )
    assert out == []
    assert seen.page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")


def test_it_prints_a_picture_and_all_lifts(seen):
    seen.page.evaluate("() => window.dispatchEvent(new Event('beforeprint'))")
    seen.page.emulate_media(media="print")
    assert seen.page.evaluate("() => document.getElementById('still').naturalWidth") > 100
    assert seen.page.is_visible("#still")
    assert not seen.page.is_visible("#play")
    assert seen.page.is_visible("#panel-plan")
    seen.page.emulate_media(media="screen")


def test_without_webgl_the_lists_work(browser, tmp_path):
    file = tmp_path / "plain.html"
    file.write_bytes(page_of(tiny_source(proof=passed_proof())))
    seen = Seen(browser.new_context().new_page())
    seen.page.add_init_script(
        """const own = HTMLCanvasElement.prototype.getContext;
        HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
          return kind === "webgl2" ? null : own.call(this, kind, ...more);
        };"""
    )
    seen.page.goto(file.as_uri())
    seen.page.wait_for_selector("#list tbody tr")
    assert "no WebGL 2" in seen.text("#failure")
    seen.page.click('#list tr[data-part="2"] button')
    assert seen.text("#panel-part h2") == "Beam"
    assert seen.complaints == []
    seen.page.context.close()


def test_a_page_of_two_cranes_moves_both(browser, tmp_path):
    plan, motions = two_crane_plan()
    log = PlanLog(plan=plan, motions=motions, attachments={}, metadata={})
    revision = Revision(0, "two.mcap", "0" * 64, plan, (), motions, tracks_of(log), passed_proof(), ())
    seen = show(browser, tmp_path, PageSource((revision,)), reduced_motion="reduce")
    places = []
    for seconds in (0.0, 95.0, 330.0, 700.0):
        seen.seek(seconds)
        seen.wait(f"Math.abs(window.page.time - {seconds}) < 1")
        poses = poses_at(plan.site, motions, int(seconds * 1e9))
        hook = seen.page.evaluate("() => window.page.scene.hook")
        hooks = [hook_of(crane, *dataclasses.astuple(poses[n])) for n, crane in enumerate(plan.site.cranes)]
        assert min(np.linalg.norm(np.array(hook) - own) for own in hooks) < 0.05
        places.append(seen.picture())
    assert all((one != other).any() for one, other in itertools.pairwise(places))
    seen.page.click("#tab-plan")
    terms = seen.terms("#panel-plan")
    assert terms["Crane west"].startswith("4 lifts, busy")
    assert terms["Crane east"].startswith("3 lifts, busy")
    assert seen.complaints == []
    seen.page.context.close()


def test_a_check_that_looked_at_nothing_has_not_passed(browser, tmp_path):
    proof = Verification((Check("cells", samples=12), Check("zones", samples=0)))
    seen = show(browser, tmp_path, tiny_source(proof=proof))
    seen.page.click("#plan-button")
    assert "1 check, 12 samples" in seen.text("#panel-plan")
    rows = seen.page.eval_on_selector_all("#panel-plan tr", "(rows) => rows.map((row) => row.textContent)")
    told = next(row for row in rows if row.startswith("zones"))
    assert "nothing to check" in told
    assert "passed" not in told


def test_a_list_is_one_stop_of_the_tab_key_and_arrows_move_in_it(seen):
    stops = "() => [...document.querySelectorAll('#list tbody button')].filter((one) => one.tabIndex === 0).length"
    assert seen.page.evaluate(stops) == 1
    seen.page.focus("#list tbody tr:nth-child(1) button")
    speed = seen.page.input_value("#speed")
    for key, row in (("ArrowDown", 2), ("End", 3), ("ArrowDown", 3), ("Home", 1), ("ArrowUp", 1), ("ArrowDown", 2)):
        seen.page.keyboard.press(key)
        assert seen.page.evaluate("() => document.activeElement.closest('tr').rowIndex") == row, key
    assert seen.page.input_value("#speed") == speed
    assert seen.page.evaluate(stops) == 1
    seen.page.keyboard.press("Shift+Tab")
    seen.page.keyboard.press("Tab")
    assert seen.page.evaluate("() => document.activeElement.closest('tr').rowIndex") == 2
    seen.page.keyboard.press("Enter")
    assert seen.page.get_attribute("#list tr.chosen button", "tabindex") == "0"
