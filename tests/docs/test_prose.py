"""Pages are written in short sentences and paragraphs; see CONTRIBUTING.md."""

from __future__ import annotations

import pytest
from doc_commands import DOCUMENTS, ROOT, name_of, text_of
from doc_prose import faults, prose_of


@pytest.mark.parametrize("name", [name_of(file) for file in DOCUMENTS])
def test_a_page_reads_easily(name: str):
    found = list(faults(text_of(name)))
    assert not found, "\n".join(found)


def test_the_changelog_has_one_line_a_change():
    text = (ROOT / "CHANGELOG.md").read_text("utf-8")
    entries = [line for line in text.split("\n## ")[1].splitlines()[1:] if line and not line.startswith("### ")]
    assert not [line for line in entries if not line.startswith("- ") or len(line) > 220]
    assert not list(faults(text))


def test_prose_is_what_a_reader_reads():
    page = "# A head\n\nOne `x, y; z`. Two (see\n[it](a.md)).\n\n- three\n- four\n"
    page += "\n```sh\nbimvox plan\n```\n\n| a | b |\n|---|---|\n"
    assert prose_of(page).paragraphs == ("One Code. Two (see it).", "three", "four")
    assert prose_of(page).sentences == ["One Code", "Two (see it).", "three", "four"]


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("word " * 26 + ".", "26 words"),
        ("word " * 15 + "and.", "16.0 words on average"),
        ("It is one; it is two; it is three.", "semicolons"),
        ("It is one — or two.", "dash"),
        ("A crane (tower, mobile, luffing) lifts.", "brackets"),
        ("It lifts a part. " * 40, "7 lines"),
    ],
)
def test_each_rule_finds_its_fault(text: str, fault: str):
    assert fault in "\n".join(faults(text))
