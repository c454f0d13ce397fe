"""Positions and sizes that several cranes on one site may not have."""

import dataclasses

import pytest
from box_sites import test_crane

from bimvox.errors import ConfigError
from bimvox.site.checks import check_cranes, crane_key
from bimvox.site.config.file import parse_site_config

CONFIG = parse_site_config('[model]\npath = "m.ifc"\n', "s.toml")
LOW = dataclasses.replace(test_crane(height=20.0), name="low", jib_length_m=20.0)


def beside(x: float, height: float = 20.0, jib: float = 20.0):
    return dataclasses.replace(LOW, name="other", base_m=(x, 0.0, 0.0), jib_height_m=height, jib_length_m=jib)


def check(*cranes):
    check_cranes(CONFIG, cranes, 2.0)


def test_one_crane_and_cranes_far_apart_pass():
    check(LOW)
    check(LOW, beside(30.0))


def test_a_jib_that_would_meet_the_other_mast_is_refused_and_both_are_named():
    with pytest.raises(ConfigError) as caught:
        check(LOW, beside(23.0))
    assert caught.value.key == "crane[0].base_m"
    assert "low" in str(caught.value)
    assert "other" in str(caught.value)


def test_the_upper_jib_may_pass_over_the_lower_crane_but_not_the_lower_meet_the_upper_mast():
    check(LOW, beside(30.0, height=40.0, jib=60.0))
    with pytest.raises(ConfigError) as caught:
        check(LOW, beside(22.0, height=40.0, jib=60.0))
    assert caught.value.key == "crane[0].base_m"
    with pytest.raises(ConfigError) as caught:
        check(LOW, beside(30.0, height=24.0, jib=60.0))
    assert caught.value.key == "crane[1].base_m"


def test_masts_on_one_another_are_refused():
    with pytest.raises(ConfigError) as caught:
        check(LOW, beside(3.0))
    assert "masts of" in str(caught.value) and "low" in str(caught.value)


def test_the_key_of_a_crane_has_its_number_where_there_are_several():
    assert crane_key(0, 1) == "crane"
    assert crane_key(1, 2) == "crane[1]"
