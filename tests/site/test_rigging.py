from pathlib import Path

import pytest

from bimvox.crane.gear import GearKind
from bimvox.errors import ConfigError
from bimvox.site.config.file import named_files, parse_site_config
from bimvox.site.config.gear_file import gear_by_crane, gear_of_site

OWN = b"""
name = "our chains"
kind = "chain_sling"
about = "tags of 2026"
lengths_m = [3, 5]
size = [{ name = "16 mm", wll_kg = 8000, kg_per_m = 5.6 }]
"""
HEAD = '[model]\npath = "a.ifc"\n[crane]\nmachine = "hammerhead-30"\nbase_m = [0, 0]\n'
RIGGING = '[rigging]\ngear = ["ours.toml"]\nspreader_from_m = 4\n'


def config_of(text: str, **files: bytes):
    return parse_site_config(text, Path("s.toml"), {name.replace("_", "."): data for name, data in files.items()})


def test_own_gear_replaces_that_of_the_catalogue_of_its_kind():
    config = config_of(HEAD + RIGGING, ours_toml=OWN)
    gear = gear_of_site(config)
    assert [family.name for family, _ in gear.of_kind(GearKind.CHAIN_SLING)] == ["our chains"]
    assert {family.kind for family in gear.families} == set(GearKind)
    assert gear.spreader_from_m == 4.0
    assert named_files(config) == {"ours.toml": "rigging.gear[0]"}


def test_a_file_of_gear_that_is_missing_or_takes_a_known_name_is_refused():
    with pytest.raises(ConfigError, match=r"'ours.toml' is not there") as caught:
        gear_of_site(config_of(HEAD + RIGGING))
    assert caught.value.key == "rigging.gear[0]"
    with pytest.raises(ConfigError, match="'bow shackle' is known already"):
        gear_of_site(config_of(HEAD + RIGGING, ours_toml=OWN.replace(b"our chains", b"bow shackle")))


@pytest.mark.parametrize(
    ("given", "chosen"), [("", True), ("sling_m = 3\n", False), ("rigging_mass_kg = 100\n", False)]
)
def test_gear_is_chosen_unless_the_crane_describes_its_rigging(given, chosen):
    (gear,) = gear_by_crane(config_of(HEAD + given), 1)
    assert (gear is not None) == chosen


def test_without_a_crane_no_gear_is_chosen():
    assert gear_by_crane(config_of('[model]\npath = "a.ifc"\n'), 0) == ()
