"""Words of materials from open dictionaries."""

from __future__ import annotations

import tomllib
from importlib.resources import files
from pathlib import Path

import pytest

from bimvox.bim.kinds.kind import Kind
from bimvox.bim.kinds.words import meaning_of
from supply.words import renewed

CONCRETE, STEEL, WOOD, OTHER = "14820180-n", "14802450-n", "15098161-n", "00000001-n"


def table(folder: Path, language: str, words: dict[str, list[str]], licence: str = "CC BY 3.0") -> None:
    lines = [f"# Some Wordnet\t{language}\thttp://example.org/\t{licence}"]
    lines += [f"{synset}\t{language}:lemma\t{word}" for synset, some in words.items() for word in some]
    (folder / f"wn-data-{language}.tab").write_text("\n".join(lines) + "\n", encoding="utf-8")


def made(folder: Path) -> dict:
    return tomllib.loads(renewed(folder))


def test_words_come_with_their_language_meaning_and_source(tmp_path: Path) -> None:
    table(tmp_path, "zzz", {CONCRETE: ["Mabeto"], STEEL: ["Mavuma"]})
    found = made(tmp_path)
    assert found["sources"] == {"zzz": "Some Wordnet, CC BY 3.0, http://example.org/"}
    by_name = {entry["name"]: entry for entry in found["material"]}
    assert by_name["concrete"] == {"name": "concrete", "zzz": "mabeto"}
    assert by_name["steel"]["zzz"] == "mavuma"


def test_words_that_would_mislead_are_left_out(tmp_path: Path) -> None:
    wrong = [
        "beton",  # words.toml has it
        "ab",  # too short
        "made of stones and water",  # too long
        "b40",  # not a word
        "window",  # something else in English
        "mavuma",  # steel in the next language
    ]
    table(tmp_path, "zzz", {CONCRETE: ["mabeto", *wrong], WOOD: ["mahuto"]})
    table(tmp_path, "zzy", {STEEL: ["mavuma"], WOOD: ["mahutu"]})
    table(tmp_path, "eng", {OTHER: ["window"], CONCRETE: ["sandcast"]})
    words = {
        word
        for entry in made(tmp_path)["material"]
        for key, value in entry.items()
        if key != "name"
        for word in value.split(", ")
    }
    assert words == {"mabeto", "mahuto", "mahutu"}


def test_a_table_that_may_not_be_passed_on_is_left_out(tmp_path: Path) -> None:
    table(tmp_path, "zzz", {CONCRETE: ["mabeto"], WOOD: ["mahuto"]}, licence="all rights reserved")
    assert made(tmp_path)["sources"] == {}


OPEN = tomllib.loads(files("bimvox.bim.kinds").joinpath("open_words.toml").read_text(encoding="utf-8"))


def test_every_word_of_the_file_has_a_source_and_says_something() -> None:
    assert len(OPEN["sources"]) > 50
    for entry in OPEN["material"]:
        for language, words in entry.items():
            if language != "name":
                assert language in OPEN["sources"]
                assert all(meaning_of(word) is not None for word in words.split(", "))


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("bê tông cốt thép", Kind.CONCRETE),
        ("Konkrit bertetulang", Kind.CONCRETE),
        ("բետոն", Kind.CONCRETE),
        ("kayu jati", Kind.TIMBER),
        ("gạch", Kind.MASONRY),
        ("ფოლადი", Kind.STEEL),
        ("kaca 10 mm", Kind.GLAZING),
        ("Cigla", Kind.MASONRY),
    ],
)
def test_languages_that_the_table_by_hand_lacks(name: str, kind: Kind) -> None:
    found = meaning_of(name)
    assert found is not None
    assert (found.kind, found.open) == (kind, True)


def test_a_word_of_the_table_by_hand_decides_however_short() -> None:
    found = meaning_of("konkrit steel")
    assert found is not None
    assert (found.kind, found.open) == (Kind.STEEL, False)
