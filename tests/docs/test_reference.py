"""The pages that follow from the code describe every command and key, and no link is dead."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from bimvox_pipeline.schema import schema
from doc_commands import DOCUMENTS

from docs.reference.__main__ import FOLDERS, pages, write

ROOT = Path(__file__).parents[2]


def test_writing_changes_stale_and_missing_pages_and_removes_left_over_ones(tmp_path: Path):
    assert write(tmp_path) == sorted(pages())
    assert write(tmp_path) == []
    plan, site = tmp_path / "commands" / "plan.md", tmp_path / "formats" / "site.md"
    plan.write_text(plan.read_text() + "\nmore\n")
    site.unlink()
    (tmp_path / "commands" / "gone.md").write_text("# bimvox gone\n")
    assert write(tmp_path) == ["commands/gone.md", "commands/plan.md", "formats/site.md"]
    assert {f"{file.parent.name}/{file.name}": file.read_text() for file in tmp_path.rglob("*.md")} == pages()


def test_git_ignores_what_the_site_writes():
    ignored = (ROOT / ".gitignore").read_text().splitlines()
    assert {f"docs/{folder}/" for folder in FOLDERS} <= set(ignored)
    assert {path.split("/")[0] for path in pages()} == set(FOLDERS)


def test_a_page_names_every_option_of_its_command():
    page, every = pages()["commands/plan.md"], pages()["commands/README.md"]
    assert re.search(r"^\| `--obstructions FILE` \| .+ \| `BIMVOX_OBSTRUCTIONS` \|$", page, re.M)
    assert "[options of every command](README.md)" in page
    for shared in ("--json", "-q, --quiet", "-v, --verbose", "-h, --help"):
        assert f"| `{shared}" not in page
        assert f"`{shared}`" in every


@pytest.mark.parametrize("name", ["site", "crane", "gear", "obstructions", "sweep", "grid"])
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


LINK = re.compile(r"\]\((?!https?:)([^)#]+)(?:#[^)]*)?\)")


def test_a_written_page_is_linked_from_the_site_only():
    """A link into a page that git does not hold is dead in the repository's web view."""
    for file in [*DOCUMENTS, ROOT / "CHANGELOG.md", ROOT / "CONTRIBUTING.md"]:
        for target in LINK.findall(file.read_text("utf-8")):
            found = (file.parent / target).resolve()
            assert found.exists(), f"{file.relative_to(ROOT)}: {target}"
            assert not found.is_relative_to(ROOT / "docs") or found.parent.name not in FOLDERS, f"{file}: {target}"


def test_every_link_of_a_written_page_has_a_target():
    for path, text in pages().items():
        for target in LINK.findall(text):
            found = ((ROOT / "docs" / path).parent / target).resolve().relative_to(ROOT / "docs").as_posix()
            assert found in pages() or (ROOT / "docs" / found).exists(), f"{path}: {target}"
