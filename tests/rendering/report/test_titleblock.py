from __future__ import annotations

import dataclasses

from log_building import tiny_log
from opened_pages import EVIL, revision_of
from report_reading import ReadReport

from bimvox.library.attached_files import config_in
from bimvox.rendering.report.page import report_page
from bimvox.rendering.report.record import record_of
from bimvox.rendering.report.statement import NOT_STATED

PROJECT = """
[project]
name = "North quay"
number = "2026-014"
client = "Harbour board"
prepared_by = "A. Planner"
approved_by = "C. Chief"
revisions = [
  { revision = "A", date = "2026-11-01", changes = "first issue" },
  { revision = "B", date = "2026-11-23", changes = "crane moved" },
]
[model]
path = "tiny.ifc"
"""


def report_of(site_file: str | bytes) -> ReadReport:
    data = site_file if isinstance(site_file, bytes) else site_file.encode()
    log = dataclasses.replace(tiny_log(crane=True), attachments={"site.toml": data})
    revision = dataclasses.replace(revision_of(log), config=config_in(log))
    return ReadReport(report_page(record_of(revision), log.plan.site.cranes))


def test_the_title_block_states_what_the_attached_site_file_does():
    read = report_of(PROJECT)
    for words in ("North quay", "2026-014", "Harbour board"):
        assert words in read.text
    people = [row["words"].strip() for row in read.rows["signatures"][1:]]
    assert "Prepared by A. Planner" in people
    assert "Approved by C. Chief" in people
    assert len(people) == 7
    issues = [row["words"].split() for row in read.rows["revisions"][1:]]
    assert [one[0] for one in issues] == ["A", "B"]
    assert issues[1][1:] == ["2026-11-23", "crane", "moved"]
    assert read.record["project"]["issue"] == "B"
    assert NOT_STATED in read.text  # the address


def test_without_project_data_there_are_fields_to_fill_in():
    for site_file in ("[model]\npath = 'tiny.ifc'\n", b"\xff not a site file", "[nonsense]\n"):
        read = report_of(site_file)
        assert read.text.count(NOT_STATED) >= 5
        assert len(read.rows["signatures"]) == 8
        assert read.record["project"]["name"] is None
        assert "Project tiny Number" in " ".join(read.text.split())  # the site's name


def test_hostile_project_data_stay_text():
    hostile = EVIL.replace("'", "")
    read = report_of(PROJECT.replace('"North quay"', f"'{hostile}'").replace('"A. Planner"', f"'{hostile}'"))
    assert read.text.count("window.hacked") >= 2
    assert "img" not in read.tags


def test_emergency_and_communication_come_from_the_site_file_and_are_blank_otherwise():
    keys = {
        "communication": ("Communication", "channel 7"),
        "emergency": ("Emergency plan", "HSE-12"),
        "emergency_contact": ("Emergency contact", "555-0100"),
        "rescue_plan": ("Rescue from the crane", "rope team, 15 minutes"),
        "hospital": ("Nearest hospital", "Quay Clinic"),
        "assembly_point": ("Assembly point", "Gate 2"),
    }
    given = "".join(f"{key} = '{words}'\n" for key, (_, words) in keys.items())
    stated, blank = (
        " ".join(report_of(PROJECT.replace("[model]", more + "[model]")).text.split()) for more in (given, "")
    )
    for name, words in keys.values():
        assert f"{name} {words}" in stated
        assert f"{name} {NOT_STATED}" in blank
