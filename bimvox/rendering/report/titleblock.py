"""The title block of a lift plan: project, revision, and who prepares, checks, approves and carries it out."""

from __future__ import annotations

from typing import Any

from bimvox.rendering.plain import escape
from bimvox.rendering.report.html import row, section, table, tag, terms

_FIELDS = {
    "name": "Project",
    "number": "Number",
    "address": "Address",
    "client": "Client",
    "contractor": "Contractor",
}
_PEOPLE = {
    "prepared_by": "Prepared by",
    "checked_by": "Checked by",
    "approved_by": "Approved by",
    "appointed_person": "Appointed person",
    "lifting_supervisor": "Lifting supervisor",
    "crane_operator": "Crane operator",
    "slinger": "Slinger, signaller",
}
NOT_STATED = "not stated: fill in"
BLANK = f'<span class="blank">{NOT_STATED}</span>'
"""A field that the log cannot fill."""


def title_block(record: dict[str, Any]) -> str:
    """Return the title block; what the site file does not state is left to be filled in by hand."""
    project = record["project"]
    project = {**project, "name": project["name"] or record["site"]["name"]}
    given = [(words, stated(project[key])) for key, words in _FIELDS.items()]
    given += [("Revision", stated(project["issue"])), ("Plan", tag("code", escape(record["log"]["sha256"][:16])))]
    people = [row([words, escape(project[key] or ""), "", ""]) for key, words in _PEOPLE.items()]
    issues = [
        row([escape(one["revision"]), escape(one["date"]), escape(one["changes"] or "")])
        for one in project["revisions"]
    ] or [row([escape(project["issue"] or ""), "", ""])]
    return section(
        "Project and approval",
        terms(given),
        tag(
            "div",
            table(("Role", "Name", "Signature", "Date"), people, class_="words signed", id_="signatures")
            + table(("Revision", "Date", "Changes"), issues, class_="words", id_="revisions"),
            "titleblock",
        ),
        id="title-block",
    )


def stated(words: str | None) -> str:
    """Return words as HTML, or that they are to be filled in."""
    return escape(words) if words else BLANK
