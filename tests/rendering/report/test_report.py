from __future__ import annotations

import dataclasses
import json
import re
from typing import Any

import numpy as np
import pytest
from log_building import tiny_log
from opened_pages import EVIL, evil_log, failed_proof, passed_proof, revision_of
from report_reading import ReadReport

from bimvox.crane.kinematics import hook_of
from bimvox.crane.load_chart import capacity_kg
from bimvox.rendering.report.gantt import LIFTS_A_CHART, ROWS, gantt_chart
from bimvox.rendering.report.page import ANNEXES, REPORT, Figure, Figures, letters, only, report_page
from bimvox.rendering.report.record import record_of
from bimvox.rendering.report.sections import not_lifted


def page_of(log, proof=None, *, critical_share: float = 0.75, figures: Figures | None = None) -> bytes:
    record = record_of(revision_of(log, proof), critical_share=critical_share)
    return report_page(record, log.plan.site.cranes, figures)


def test_every_number_of_a_lift_is_that_of_the_log():
    log = tiny_log(crane=True)
    site, crane = log.plan.site, log.plan.site.cranes[0]
    rows = {int(row["order"]): row for row in ReadReport(page_of(log, passed_proof())).rows["lifts"] if "order" in row}
    assert sorted(rows) == [lift.order for lift in log.plan.lifts]
    for motion in log.motions:
        row = rows[motion.order]
        component = site.components[motion.component]
        load_kg = component.mass_kg + crane.rigging_mass_kg
        radius_m = np.concatenate([motion.raising.radius_m, motion.loaded.radius_m])
        share = load_kg / capacity_kg(crane.chart, radius_m)
        worst = int(np.argmax(np.where(share == share.max(), radius_m, -1.0)))
        assert row["mass_kg"] == component.mass_kg
        assert row["load_kg"] == load_kg
        assert row["radius_m"] == radius_m[worst]
        assert row["utilisation"] == pytest.approx(share[worst], rel=1e-12)
        assert row["capacity_kg"] == pytest.approx(capacity_kg(crane.chart, float(radius_m[worst])), rel=1e-12)
        assert not {"moves", "shortest_moves", "bound_s", "method"} & set(row), "these are for -v and JSON"
        assert row["begins_s"] == motion.start_ns / 1e9
        assert row["length_s"] == pytest.approx((motion.end_ns - motion.start_ns) / 1e9, abs=1e-9)
        for which, part, n in (("pick", motion.raising, 0), ("set", motion.loaded, -1)):
            wanted = hook_of(crane, part.slew_rad[n], part.radius_m[n], part.height_m[n])
            assert [row[f"{which}_{axis}_m"] for axis in "xyz"] == pytest.approx(wanted.tolist(), abs=1e-6)
            assert row[f"{which}_radius_m"] == part.radius_m[n]
        # The governing sample is a sample of the motion at that radius.
        at_ns = round(row["governing_time_s"] * 1e9) - motion.start_ns
        times = np.concatenate([motion.raising.time_ns, motion.loaded.time_ns])
        assert radius_m[int(np.flatnonzero(times == at_ns)[0])] == row["radius_m"]
        # People read the same value, rounded.
        assert f"{100 * row['utilisation']:.1f}" in row["words"]
        assert f"{row['radius_m']:.2f}" in row["words"]


def test_totals_and_shares_are_those_of_the_log():
    log = tiny_log(crane=True)
    read = ReadReport(page_of(log, passed_proof()))
    totals = read.totals
    assert (totals["lifts"], totals["planned"], totals["infeasible"]) == (3, 2, 1)
    clock_ns = log.motions[-1].end_ns - log.motions[0].start_ns
    assert totals["crane_hours"] == pytest.approx(clock_ns / 3.6e12, abs=1e-6)


def test_the_page_carries_the_record_itself():
    log = tiny_log(crane=True)
    record = record_of(revision_of(log, passed_proof()))
    read = ReadReport(report_page(record, log.plan.site.cranes))
    assert read.record == json.loads(json.dumps(record))


def test_critical_lifts_come_first_the_most_used_capacity_first():
    log = tiny_log(crane=True)
    shares = {
        lift["order"]: lift["governs"]["utilisation"]
        for lift in record_of(revision_of(log))["lifts"]
        if lift["governs"]
    }
    worst = max(shares, key=lambda order: shares[order])
    read = ReadReport(page_of(log, critical_share=0.999 * shares[worst]))
    rows = [row for row in read.rows["lifts"] if "order" in row]
    assert int(rows[0]["order"]) == worst
    assert [row["class"] for row in rows].count("critical") == 1
    assert "▲" in rows[0]["words"]
    assert read.totals["critical"] == 1
    everything = ReadReport(page_of(log, critical_share=1e-9)).record["critical"]
    assert everything == sorted(shares, key=lambda order: -shares[order])


def test_a_lift_takes_two_lines_and_its_words_are_explained_once():
    page = page_of(tiny_log(crane=True), passed_proof()).decode()
    table = page[page.index('id="lifts"') :].split("</table>")[0]
    cells = re.findall(r"<t[dh][^>]*>(.*?)</t[dh]>", table)
    assert cells
    assert max(cell.count("<br>") for cell in cells) == 1
    after = page[page.index('id="lifts"') :].split("</table>")[1].split("</section>")[0]
    for words in ("Heading kept: tag lines", "Wind:", "governing sample"):
        assert page.count(words) == 1 or words == "governing sample"
        assert words in after
    assert "with jib" not in after  # no load turns with it


def test_an_infeasible_part_says_why_and_what_blocks_it():
    log = tiny_log(crane=True)
    figure = Figure(b"picture", "image/png", "what is in the way", (1,))
    read = ReadReport(page_of(log, figures=Figures(blocked=(figure,))))
    (row,) = [row for row in read.rows["infeasible"] if "order" in row]
    assert row["order"] == 1
    assert log.plan.lifts[1].reason in row["words"]
    assert "truck-7" in row["words"]
    assert "img" in read.tags
    assert "without a picture" not in read.text
    assert "without a picture" in ReadReport(page_of(log)).text


def test_work_without_a_lift_is_told_in_words_and_of_an_extract_on_the_clock():
    times = {"needed_by_s": 60.0, "begins_s": -7200.0, "ends_s": -3600.0, "carries_s": 0.0, "material_lift_s": None}
    group = {"means": "in_situ", "storey": "0", "kind": "Footing", "parts": 2, "mass_kg": 900.0, "reason": "so"}
    group["numbers"] = [1, 2]
    assert "-2:00:00" in not_lifted({"not_lifted": [group | times]})
    words = {"begins_in_words": "day 1 07:00", "carries_in_words": "day 1 09:00", "needed_by_in_words": "day 1 10:01"}
    html = not_lifted({"not_lifted": [group | times | words]})
    assert all(one in html for one in words.values())
    assert "-2:00:00" not in html
    assert not_lifted({"not_lifted": []}) == ""


def test_what_was_proven_and_what_failed():
    log = tiny_log(crane=True)
    proof = passed_proof()
    read = ReadReport(page_of(log, proof))
    rows = {row["data-check"]: row for row in read.rows["checks"] if "data-check" in row}
    assert {name: row["samples"] for name, row in rows.items()} == {c.name: c.samples for c in proof.checks}
    assert "NOT PROVEN" not in read.text
    assert "NOT PROVEN" in ReadReport(page_of(log)).text
    failed = ReadReport(page_of(log, failed_proof(log.plan.site.components[0].id)))
    assert "NOT PROVEN" in failed.text
    assert "is in cells of truck-7" in failed.text
    assert "PROOF FAILED" in failed.text


def test_every_input_has_its_hash():
    log = tiny_log(crane=True)
    text = ReadReport(page_of(log)).text
    for digest in ("cd" * 32, "ef" * 32, "ab" * 32, log.plan.site.digest, log.plan.site.geometry_digest):
        assert digest in text


def test_nothing_comes_from_elsewhere_and_names_are_only_text():
    log = evil_log()
    record = record_of(revision_of(log))
    page = report_page(record, log.plan.site.cranes)
    text = page.decode()
    # Every number except sizes of the drawing is text; nothing is fetched and no script runs.
    assert re.findall(r'(?:src|href)="(?!data:)', text) == []
    assert "default-src 'none'" in text
    assert "script-src" not in text
    read = ReadReport(page)
    assert read.tags.count("script") == 1
    assert "img" not in read.tags
    assert read.record["lifts"][0]["name"] == EVIL
    assert EVIL in read.text


def test_without_a_crane_times_are_nominal_and_nothing_is_critical():
    log = tiny_log(crane=False)
    read = ReadReport(page_of(log))
    assert "nominal" in read.text
    assert read.record["crane"] is None
    assert read.record["critical"] == []
    assert read.totals["total_s"] > 0


def test_the_same_plan_gives_the_same_bytes():
    assert page_of(tiny_log(crane=True), passed_proof()) == page_of(tiny_log(crane=True), passed_proof())


def test_gantt_bars_begin_and_end_with_the_phases_of_the_log():
    log = tiny_log(crane=True)
    lifts = record_of(revision_of(log))["lifts"]
    chart = gantt_chart(lifts)
    bars = re.findall(r'<rect x="([\d.]+)" y="[\d.]+" width="([\d.]+)" height="[\d.]+" class="(\w+)"', chart)
    ends = [(float(x), float(x) + float(width)) for x, width, _ in bars]
    timed = [lift for lift in lifts if lift["begins_s"] is not None]
    low, high = timed[0]["begins_s"], timed[-1]["ends_s"]
    scale = (ends[-1][1] - ends[0][0]) / (high - low)
    carrying = [(x, x + float(w)) for (x, _), (_, w, kind) in zip(ends, bars, strict=True) if kind == "carrying"]
    for lift, (first, last) in zip(timed, carrying, strict=True):
        held = [(start, end) for name, start, end in lift["phases"] if name in ("hoist", "traverse", "lower")]
        assert first == pytest.approx(ends[0][0] + (held[0][0] - low) * scale, abs=0.02)
        assert last == pytest.approx(ends[0][0] + (held[-1][1] - low) * scale, abs=0.02)


def test_the_gantt_chart_fits_a_page_whatever_the_number_of_lifts():
    lift = record_of(revision_of(tiny_log(crane=True)))["lifts"][0]

    def many(count: int, storeys: int) -> list[dict[str, Any]]:
        return [
            {
                **lift,
                "order": n,
                "number": n + 1,
                "storey": f"Level {n * storeys // count}",
                "ifc_class": ("IfcWall", "IfcSlab")[n % 2],
                "begins_s": 100.0 * n,
                "ends_s": 100.0 * n + 90.0,
                "phases": [],
            }
            for n in range(count)
        ]

    assert gantt_chart(many(LIFTS_A_CHART, 3)).count("data-order=") == LIFTS_A_CHART
    for count, storeys, rows in ((LIFTS_A_CHART + 1, 3, 6), (5000, 30, 30), (5000, 100, 34)):
        chart = gantt_chart(many(count, storeys))
        assert chart.count("data-lifts=") == rows <= ROWS
        assert sum(int(own) for own in re.findall(r'data-lifts="(\d+)"', chart)) == count
        assert float(re.search(r'viewBox="0 0 \S+ (\S+)"', chart)[1]) < 1040.0 * 186.0 / 275.0  # a page in landscape


def test_a_lift_beyond_the_chart_is_critical_above_all():
    log = tiny_log(crane=True)
    crane = dataclasses.replace(
        log.plan.site.cranes[0], chart=dataclasses.replace(log.plan.site.cranes[0].chart, radius_m=(2.0, 2.5, 3.0))
    )
    plan = dataclasses.replace(log.plan, site=dataclasses.replace(log.plan.site, cranes=(crane,)))
    log = dataclasses.replace(log, plan=plan)
    read = ReadReport(page_of(log))
    assert len(read.record["critical"]) == len(log.motions)
    assert "beyond" in read.text


def test_it_is_what_is_signed_and_then_annexes_with_letters_which_print_apart():
    page = page_of(tiny_log(crane=True), passed_proof())
    text = page.decode()
    own, annexes = text.split('<div id="annexes">')
    places = [own.index(name) for name in ('id="remarks"', 'id="not-covered"', 'id="critical-lifts"', 'id="gantt"')]
    assert places == sorted(places), "what must be signed comes first"
    assert "<h2>Annex A: Lifts: " in annexes
    assert 'id="lifts"' not in own
    assert 'id="checks"' not in own
    titles = re.findall(r"<h2>(Annex \w+: .*?)</h2>", annexes)
    assert len(titles) > 3
    assert all(title in own for title in titles), "the report lists its annexes"
    for part in (REPORT, ANNEXES):
        assert f'<body class="only-{part}">' in only(page, part).decode()
        assert f".only-{part} #" in text


def test_letters_go_on_after_z():
    assert [letters(n) for n in (0, 25, 26, 27, 52)] == ["A", "Z", "AA", "AB", "BA"]
