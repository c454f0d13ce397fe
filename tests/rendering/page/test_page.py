from __future__ import annotations

import base64
import hashlib
import re
import shutil
import subprocess
from collections import Counter

import pytest
from opened_pages import EVIL, Opened, evil_log, passed_proof, revision_of, some_remarks, tiny_source

from bimvox.rendering.page.page import MODULES, page_of, script, text_of
from bimvox.rendering.page.source import PageSource

NODE = shutil.which("node")


@pytest.fixture(scope="module")
def page() -> bytes:
    return page_of(tiny_source(proof=passed_proof()))


def test_the_same_plan_gives_the_same_bytes(page):
    assert page_of(tiny_source(proof=passed_proof())) == page


def test_a_small_plan_makes_a_small_page(page):
    assert len(page) < 250_000


def test_nothing_is_fetched_from_anywhere(page):
    text = page.decode()
    assert not re.search(r"https?:|//[a-z]+\.[a-z]|@import|url\(|\bsrc=|XMLHttpRequest|WebSocket|\bfetch\(", text)
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', text).group(1)
    assert policy.startswith("default-src 'none'; ")
    assert "unsafe" not in policy
    for tag, source in (("style", "style-src"), ("script", "script-src")):
        (body,) = re.findall(rf"<{tag}>(.*?)</{tag}>", text, re.DOTALL)
        digest = base64.b64encode(hashlib.sha256(body.encode()).digest()).decode()
        assert f"{source} 'sha256-{digest}'" in policy


def test_names_cannot_leave_the_data(page):
    hostile = page_of(PageSource((revision_of(evil_log(), passed_proof()),)))
    text = hostile.decode()
    assert EVIL not in text
    assert 'onerror="' not in text
    # Except for data and title, the page is the same, whatever the names.
    tags = [re.findall(r"<[a-z/!][^>]*>", source.decode()) for source in (page, hostile)]
    assert len(tags[0]) == len(tags[1])
    assert Opened(hostile).document["parts"][0]["name"] == EVIL


def test_the_program_never_makes_markup_from_text():
    program = script()
    assert not re.search(r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\(|new Function", program)
    assert "</script" not in program


def test_the_summary_for_readers_without_scripts_says_not_proven():
    assert "NOT PROVEN" in page_of(tiny_source()).decode().split("<noscript>")[1].split("</noscript>")[0]
    proven = page_of(tiny_source(proof=passed_proof())).decode().split("<noscript>")[1].split("</noscript>")[0]
    assert "proven" in proven
    assert "NOT PROVEN" not in proven
    assert "2 lifts planned, 1 refused" in proven
    assert "no remarks" in proven
    remarked = page_of(tiny_source(proof=passed_proof(), remarks=some_remarks())).decode()
    assert "3 remarks (1 serious)" in remarked.split("<noscript>")[1].split("</noscript>")[0]


def test_modules_come_after_what_they_import_and_share_no_name():
    names: Counter[str] = Counter()
    for n, name in enumerate(MODULES):
        text = text_of(f"{name}.mjs")
        imported = re.findall(r"""^import \{[^}]*\} from "\./(\w+)\.mjs";\n""", text, re.MULTILINE)
        assert set(imported) <= set(MODULES[:n]), name
        names.update(re.findall(r"^(?:export )?(?:async )?(?:function|const|class|let) (\w+)", text, re.MULTILINE))
        for group in re.findall(r"^(?:export )?const \[([^\]]*)\]", text, re.MULTILINE):
            names.update(part.strip() for part in group.split(","))
        assert text.startswith("// "), f"{name}.mjs does not say what it is"
    assert [name for name, count in names.items() if count > 1] == []
    assert not re.search(r"^(import|export) ", script(), re.MULTILINE)


@pytest.mark.skipif(NODE is None, reason="Node.js is not here")
def test_the_program_is_sound_to_node(tmp_path):
    file = tmp_path / "page.js"
    file.write_text(script(), encoding="utf-8")
    subprocess.run([NODE, "--check", file], check=True)
