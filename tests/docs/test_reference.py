"""The generated pages are up to date and describe every command and key."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from bimvox_pipeline.schema import schema

from docs.reference.__main__ import pages, stale, write

ROOT = Path(__file__).parents[2]


def test_the_generated_pages_are_up_to_date():
    assert stale() == [], "run `make docs`"


def test_changed_missing_and_left_over_pages_are_stale(tmp_path: Path):
    assert write(tmp_path) == sorted(pages())
    assert stale(tmp_path) == []
    plan, site = tmp_path / "commands" / "plan.md", tmp_path / "formats" / "site.md"
    plan.write_text(plan.read_text() + "\nmore\n")
    site.unlink()
    (tmp_path / "commands" / "gone.md").write_text("# bimvox gone\n")
    assert stale(tmp_path) == ["commands/gone.md", "commands/plan.md", "formats/site.md"]
    write(tmp_path)
    assert stale(tmp_path) == []
    assert not (tmp_path / "commands" / "gone.md").exists()


def test_a_page_names_every_option_of_its_command():
    page, every = pages()["commands/plan.md"], pages()["commands/README.md"]
    assert re.search(r"^\| `--obstructions FILE` \| .+ \| `BIMVOX_OBSTRUCTIONS` \|$", page, re.M)
    assert "[options of every command](README.md)" in page
    for shared in ("--json", "-q, --quiet", "-v, --verbose", "-h, --help"):
        assert f"| `{shared}" not in page
        assert f"`{shared}`" in every


@pytest.mark.parametrize("name", ["site", "obstructions", "sweep", "grid"])
def test_a_format_has_every_key_of_its_schema(name: str):
    document = schema(name)
    assert isinstance(document, dict)
    tables = [document, *(one for one in document["$defs"].values() if "properties" in one)]
    page = pages()[f"formats/{name}.md"]
    for table in tables:
        for key in table["properties"]:
            assert f"\n| `{key}` |" in page
    assert "| None" not in page


def test_the_keys_of_a_part_have_their_meaning():
    document = schema("grid")
    assert isinstance(document, dict)
    for key, value in document["$defs"]["Part"]["properties"].items():
        assert value.get("description"), key


def test_every_link_between_the_docs_has_a_target():
    files = [ROOT / "README.md", ROOT / "ARCHITECTURE.md", *(ROOT / "docs").rglob("*.md")]
    for file in files:
        for target in re.findall(r"\]\((?!https?:)([^)#]+)(?:#[^)]*)?\)", file.read_text("utf-8")):
            assert (file.parent / target).exists(), f"{file.relative_to(ROOT)}: {target}"
