"""What differs between two states of a site, in words."""

from __future__ import annotations

from pathlib import Path

import pytest
from bimvox_pipeline.studio.changes import changes_between, state_of_site

from bimvox.site.config.file import parse_site_config
from bimvox.site.config.site_config import SiteConfig

SITE = """
[model]
path = "a.ifc"
ground_m = 0.0

[areas]
yard = [[[0, 0], [9, 0], [9, 9]]]

[[crane]]
name = "west"
machine = "flat-top-75"
base_m = [0, 0]

[[crane]]
name = "east"
machine = "flat-top-75"
base_m = [40, 0]

[[component]]
global_id = "one"
means = "by_hand"
"""


def site(text: str = SITE) -> SiteConfig:
    return parse_site_config(text, Path("a.site.toml"))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('path = "a.ifc"', 'path = "b.ifc"', []),
        ("ground_m = 0.0", "ground_m = -1.5", ["the ground (-1.50 m)"]),
        ("ground_m = 0.0", 'ground_m = 0.0\nselect = "IfcBeam"', ["[model] select IfcBeam, was not set"]),
        ("[9, 9]", "[9, 9.0004]", []),
        ("[9, 9]", "[9, 8]", ["the yard"]),
        ("base_m = [0, 0]", "base_m = [3, 4]", ["crane west (moved 5.00 m)"]),
        ("base_m = [40, 0]", "base_m = [40, 0]\njib_length_m = 30", ["crane east (jib_length_m 30.0, was not set)"]),
        ('75"\nbase_m = [40', '120"\nbase_m = [41', ["crane east (moved 1.00 m, flat-top-120, was flat-top-75)"]),
        ('name = "east"', 'name = "north"', ["crane north (new)", "crane east (removed)"]),
        ('"by_hand"', '"in_situ"', ["how parts are set (1)"]),
        (
            "[[component]]",
            '[[zone]]\nname = "school"\nkind = "prohibited"\npolygon = [[0, 0], [1, 0], [1, 1]]\n[[component]]',
            ["zone school"],
        ),
        ("[[component]]", "[rules]\nclearance_m = 0.4\n[[component]]", ["[rules] clearance_m 0.4, was 0.0"]),
    ],
)
def test_one_change_is_named(old: str, new: str, words: list[str]):
    assert SITE.count(old) == 1
    states = [state_of_site(one, "hash") for one in (site(), site(SITE.replace(old, new)))]
    found = changes_between(*states)
    assert sorted(found) == sorted(words)
    assert bool(changes_between(*reversed(states))) is bool(words)


def test_set_ups_of_a_crane_that_moves_are_named():
    text = """
[model]
path = "a.ifc"
[crane]
machine = "mobile-100t"
[[crane.setup]]
name = "south"
base_m = [0, -20]
[[crane.setup]]
name = "north"
base_m = [0, 40]
"""
    states = [state_of_site(site(one), "hash") for one in (text, text.replace("[0, 40]", "[3, 44]"))]
    assert changes_between(*states) == ["the crane (set-up north moved 5.00 m)"]
    other = state_of_site(site(text.replace("north", "east")), "hash")
    assert changes_between(states[0], other) == ["the crane (set-up north removed, set-up east new)"]


def test_files_are_compared_by_their_hashes():
    was = state_of_site(site(), "one hash")
    assert changes_between(was, state_of_site(site(), "one hash")) == []
    assert changes_between(was, state_of_site(site(), "another")) == ["the model"]
    machine = state_of_site(site().with_machine_files({"mine.toml": b"a"}), "one hash")
    assert changes_between(was, machine) == ["file mine.toml"]
