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


@pytest.mark.parametrize("name", ["site", "crane", "obstructions", "sweep", "grid"])
def test_a_format_has_every_key_of_its_schema(name: str):
    """A table that the crane file has too is on its page alone, and linked."""
    document = schema(name)
    assert isinstance(document, dict)
    tables = {key: one for key, one in document["$defs"].items() if "properties" in one}
    page, of_the_crane = pages()[f"formats/{name}.md"], pages()["formats/crane.md"]
    for title, table in {"": document, **tables}.items():
        anchor = title.removesuffix("Config").removesuffix("Entry")
        linked = f"(crane.md#{anchor.lower()})" in page
        assert linked or not title or f"\n## {anchor}\n" in page
        for key in table["properties"]:
            assert re.search(rf"^(- `{key}`(?: \(|: |$)|\| `{key}` \|)", of_the_crane if linked else page, re.M)
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
