"""The sketches are what their program draws, and each is shown on a page."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET

import pytest
from doc_commands import DOCUMENTS

from docs.sketches.__main__ import IMAGES, sketches

NAMES = sorted(sketches())


def test_the_folder_has_the_sketches_of_the_program():
    assert sorted(file.name for file in IMAGES.glob("sketch-*.svg")) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_a_sketch_is_kept_as_drawn(name: str):
    assert (IMAGES / name).read_text("utf-8") == sketches()[name], "make sketches"


@pytest.mark.parametrize("name", NAMES)
def test_a_sketch_has_a_title_and_a_light_sheet_of_its_own(name: str):
    """Its words are dark, and can be read on a dark page only if it brings its ground with it."""
    title, sheet, *_ = ET.fromstring(sketches()[name])
    assert title.text
    assert sheet.attrib["fill"] == "#ffffff"


def test_each_sketch_is_shown_with_words_for_those_who_do_not_see_it():
    shown = {
        name: words
        for file in DOCUMENTS
        for words, name in re.findall(
            r"!\[([^\]]*)\]\((?:docs/|\.\./)?images/(sketch-[\w-]+\.svg)\)", file.read_text("utf-8")
        )
    }
    assert sorted(shown) == NAMES
    assert all(shown.values())
