"""The table of costs: what it refuses, and that it is written as it is read."""

import pytest

from bimvox.errors import ConfigError
from bimvox.site.config.calendar import CostsConfig
from bimvox.site.config.file import parse_site_config
from bimvox.site.config.template import site_toml

HEAD = '[model]\npath = "a.ifc"\n'
TEXT = 'currency = "CHF"\nperson_hour = 61.5\nmachine = [{ name = "a", month = 9000, set_up = 20000 }]\n'


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("person_hour = -1", "costs.person_hour"),
        ('machine = [{ name = "a" }]', r"costs.machine\[0\].*give one of day, week and month"),
        ('machine = [{ name = "a", day = 1, month = 2 }]', "give one of day, week and month"),
        ('machine = [{ name = "a", month = 1 }, { name = "a", month = 2 }]', "'a' is listed twice"),
    ],
)
def test_what_cannot_be_is_named(text: str, told: str) -> None:
    with pytest.raises(ConfigError, match=told):
        parse_site_config(f"{HEAD}[costs]\n{text}\n", "site.toml")


def test_costs_are_written_as_they_are_read_and_defaults_as_an_example() -> None:
    config = parse_site_config(f"{HEAD}[costs]\n{TEXT}", "site.toml")
    assert parse_site_config(site_toml(config), "site.toml").costs == config.costs != CostsConfig()
    text = site_toml(parse_site_config(HEAD, "site.toml"))
    assert "\n# [costs]\n" in text and "\n[costs]" not in text
