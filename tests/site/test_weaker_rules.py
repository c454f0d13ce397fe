"""Rules that ask for less than the defaults are named; no rule and no value in one is left out."""

from __future__ import annotations

import dataclasses

import pytest
from weakened_rules import DEFAULT, EVERY

from bimvox.site.casting import FIELD_CURING, Curing
from bimvox.site.config.rules import MORE_IS_WEAKER, NONE_IS_WEAKER, RulesConfig, weaker_rules
from bimvox.site.crew_times import FIELD_TIMES
from bimvox.site.default_rules import FlipRules
from bimvox.site.props import FIELD_PROPS
from bimvox.site.site import Rules


def test_the_defaults_are_not_weaker_than_themselves() -> None:
    assert weaker_rules(DEFAULT, has_crane=True) == []
    assert weaker_rules(RulesConfig().rules(), has_crane=False) == []


@pytest.mark.parametrize("key", sorted(EVERY))
def test_each_value_that_asks_for_less_is_named(key: str) -> None:
    (told,) = weaker_rules(EVERY[key], has_crane=True)
    assert told.startswith(f"{key} = ")


def test_values_that_ask_for_more_are_not_named() -> None:
    more = dataclasses.replace(
        DEFAULT,
        transit_clearance_m=3.0,
        highest_utilisation=0.85,
        curing=dataclasses.replace(FIELD_CURING, slab_h=24.0),
        bracing_s=900.0,
    )
    assert weaker_rules(more, has_crane=True) == []


def test_shorter_times_of_all_classes_are_weaker() -> None:
    (told,) = weaker_rules(dataclasses.replace(DEFAULT, bracing_s=60.0), has_crane=True)
    assert told == "bracing_s = 60 (default: by class of work, up to 900)"


def test_lists_of_weaker_rules_name_only_keys_that_exist() -> None:
    tables = (DEFAULT, DEFAULT.casting, Curing(), FIELD_PROPS, FlipRules())
    keys = {field.name for table in tables for field in dataclasses.fields(table)}
    assert keys >= MORE_IS_WEAKER | NONE_IS_WEAKER
    assert FIELD_TIMES.wall.brace_s == 900.0
    assert isinstance(DEFAULT, Rules)
