from __future__ import annotations

import dataclasses
import re

import pytest
from log_building import tiny_log
from opened_pages import EVIL, evil_log, passed_proof, revision_of
from report_reading import ReadReport

from bimvox.rendering.report.card import cards_page
from bimvox.rendering.report.record import record_of


def cards(log, orders, proof=None) -> str:
    revision = revision_of(log, proof)
    return cards_page(revision, record_of(revision), orders).decode()


def test_a_card_has_the_figures_of_its_lift_and_of_no_other():
    log = tiny_log(crane=True)
    page = cards(log, [0, 2], passed_proof())
    first, last = re.findall(r'<section class="card".*?</section>', page, re.DOTALL)
    record = ReadReport(page.encode()).record
    for card, order in ((first, 0), (last, 2)):
        lift = record["lifts"][order]
        assert f"Lift {order + 1}: " in card
        assert f'value="{lift["mass_kg"]!r}"' in card
        assert f'value="{lift["governs"]["load_kg"]!r}"' in card
        assert f'value="{lift["governs"]["utilisation"]!r}"' in card
        assert f"{lift['lifting']['permitted_wind_m_s']:.1f} m/s" in card
        assert card.count("☐") >= 6
        for role in ("Lifting supervisor", "Crane operator", "Slinger"):
            assert role in card
    assert record["lifts"][2]["global_id"] not in first


def test_a_part_that_is_upended_or_braced_has_its_own_boxes():
    log = tiny_log(crane=True)
    page = cards(log, [0])
    (lift, *_) = ReadReport(page.encode()).record["lifts"]
    assert ("Foot bedded" in page) == (lift["stored"] != "as_built")


def test_names_of_a_hostile_model_stay_text():
    log = evil_log()
    planned = [motion.order for motion in log.motions]
    page = cards(log, planned[:1])
    read = ReadReport(page.encode())
    assert "img" not in read.tags
    assert EVIL not in page.split('<script type="application/json"')[0]


def test_the_foot_of_a_page_is_project_number_revision_and_plan_and_cannot_leave_its_string():
    log = tiny_log(crane=True)
    record = record_of(revision_of(log))
    record["project"] |= {"name": 'a"} body { display: none } </style>', "number": "2026-014", "issue": "B"}
    from bimvox.rendering.report.page import report_page

    page = report_page(record, log.plan.site.cranes).decode()
    (foot,) = re.findall(r'@bottom-left \{ content: "([^"]*)"', page)
    assert not set(foot) - set("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789 \\")
    said = re.sub(r"\\([0-9a-f]{6}) ", lambda found: chr(int(found[1], 16)), foot)
    assert (
        said == f'a"}} body {{ display: none }} </style> · 2026-014 · revision B · plan {record["log"]["sha256"][:16]}'
    )
    assert page.count("</style>") == 1


@pytest.mark.parametrize("critical", [True, False])
def test_the_category_of_a_lift_follows_from_its_features(critical: bool):
    log = tiny_log(crane=True)
    record = record_of(revision_of(log), critical_share=0.001 if critical else 1.0)
    planned = [lift for lift in record["lifts"] if lift["status"] == "planned"]
    others = [lift for lift in record["lifts"] if lift["status"] != "planned"]
    assert planned
    assert all(lift["category"] is None for lift in others)
    if critical:
        assert {lift["category"] for lift in planned} == {"complex"}
    for lift in planned:
        assert lift["category"] == "basic" if not lift["category_why"] else lift["category"] != "basic"
        assert ("upended" in lift["category_why"]) == (lift["stored"] not in (None, "as_built"))
        assert ("mass not stated" in lift["category_why"]) == (lift["mass_source"] != "quantity")


def test_risks_name_the_lifts_that_they_are_about():
    log = tiny_log(crane=True)
    from bimvox.rendering.report.risks import risks

    record = record_of(revision_of(log), critical_share=0.001)
    html = risks(record)
    assert f"{sum(lift['status'] == 'planned' for lift in record['lifts'])} lifts" in html
    assert "Trapped by the counterweight" in html
    assert risks(record_of(revision_of(tiny_log(crane=False)))) == ""


def test_a_note_that_is_a_remark_stands_once():
    log = tiny_log(crane=True)
    site = dataclasses.replace(log.plan.site, notes=("nobody knows why",))
    log = dataclasses.replace(log, plan=dataclasses.replace(log.plan, site=site))
    from bimvox.remarks.remarks import remarks_of
    from bimvox.rendering.report.page import report_page

    revision = revision_of(log, remarks=remarks_of(log.plan, log.motions))
    page = report_page(record_of(revision), log.plan.site.cranes).decode()
    assert page.split('<script type="application/json"')[0].count("nobody knows why") == 1
