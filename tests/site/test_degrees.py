"""Angles of site files are in degrees; the radians of earlier files are read as they were."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bimvox.errors import ConfigError
from bimvox.site.catalogue import machines_of
from bimvox.site.config.file import parse_site_config
from bimvox.site.config.rules import RulesConfig
from bimvox.site.config.site_config import SiteConfig
from bimvox.site.config.template import site_toml
from bimvox.site.site import Rules


def read(text):
    return parse_site_config(f"[model]\npath = 'a.ifc'\n{text}", "site.toml")


def test_degrees_of_a_site_file_are_radians_of_the_planner():
    config = read("yaw_deg = 90\n[rules]\nsling_angle_deg = 45\n[crane]\nworking_range = { slew_deg = [-170, 190] }")
    assert config.model.yaw_rad == math.pi / 2
    assert config.rules.rules().sling_angle_rad == math.pi / 4
    (crane,) = config.cranes
    assert crane.working_range.limiters().slew_rad == pytest.approx((-170 / 180 * math.pi, 190 / 180 * math.pi))


def test_the_default_angle_of_slings_is_exact():
    assert RulesConfig().sling_angle_deg == 60.0
    assert RulesConfig().rules().sling_angle_rad == Rules().sling_angle_rad == math.pi / 3


@given(angle_deg=st.integers(-36_000, 36_000).map(lambda n: n / 100))
def test_radians_of_an_earlier_file_are_the_same_angle(angle_deg):
    earlier = read(f"yaw_rad = {math.radians(angle_deg)!r}")
    assert earlier.model.yaw_deg == angle_deg
    assert earlier.model.yaw_rad == math.radians(angle_deg)


def test_an_earlier_file_is_read_key_by_key_and_written_in_degrees():
    config = read(
        "yaw_rad = 0.5\n[rules]\nsling_angle_rad = 1.0471975511965976\n"
        "[crane]\nworking_range = { slew_rad = [0.0, 6.283185307179586] }"
    )
    assert config.rules.sling_angle_deg == 60.0
    assert config.cranes[0].working_range.slew_deg == (0.0, 360.0)
    text = site_toml(config)
    assert "yaw_deg = 28.64788975654" in text
    assert "_rad =" not in text
    assert parse_site_config(text, "site.toml").model_dump() == config.model_dump()


@pytest.mark.parametrize(
    ("text", "key", "message"),
    [
        ("yaw_deg = 1\nyaw_rad = 1", "model", "yaw_deg and yaw_rad are the same angle: give yaw_deg alone"),
        ("yaw_rad = 'east'", "model.yaw_deg", "expected a number, got 'east'"),
        ("yaw_rad = nan", "model.yaw_deg", "finite"),
        ("yaw_deg = true", "model.yaw_deg", "expected a number"),
        ("[rules]\nsling_angle_deg = 121", "rules.sling_angle_deg", "less than or equal to 120, got 121"),
        ("[crane]\nworking_range = { slew_deg = [10, 400] }", "crane.working_range", "slew_deg goes counter-clockwise"),
        ("[rules]\nclearance_rad = 1", "rules.clearance_rad", "unknown key"),
    ],
)
def test_what_is_wrong_is_named_by_the_key_in_degrees(text, key, message):
    with pytest.raises(ConfigError, match=message) as caught:
        read(text)
    assert caught.value.key == key


def test_the_schema_knows_only_degrees():
    keys = {key for table in SiteConfig.file_schema()["$defs"].values() for key in table.get("properties", ())}
    assert {"yaw_deg", "slew_deg", "luff_deg", "sling_angle_deg"} <= keys
    assert not [key for key in keys if key.endswith("_rad")]


def test_machines_of_the_catalogue_state_their_luffing_range_in_degrees():
    (low, high) = machines_of("luffing")[0].usual.luffing.luff_rad
    assert (math.degrees(low), math.degrees(high)) == pytest.approx((20.0, 83.0))
