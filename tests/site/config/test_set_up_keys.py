"""``[[crane.setup]]``: what a site file may say of a crane that moves."""

from pathlib import Path

import pytest
from moving_sites import PLACES, row, row_file

import bimvox
from bimvox.errors import ConfigError
from bimvox.remarks.remarks import remarks_of
from bimvox.site.config.file import load_site_config
from bimvox.site.config.template import site_toml
from bimvox.site.machine import cranes_of, moving_of


def test_each_set_up_is_the_crane_at_its_place(tmp_path: Path) -> None:
    site = row(tmp_path, setup="heading_deg = 30\nboom_m = 30\n").site
    assert [crane.base_m[:2] for crane in site.cranes] == list(PLACES.values())
    assert [crane.name for crane in site.cranes] == ["mobile-60t at west", "mobile-60t at east"]
    assert {crane.luffing.length_m for crane in site.cranes if crane.luffing} == {30.0}
    assert {round(crane.carrier.heading_rad, 4) for crane in site.cranes if crane.carrier} == {0.5236}
    assert not site.has_several_cranes
    assert site.moving is not None and site.moving.names == ("west", "east")


def test_a_crane_with_one_place_does_not_move(tmp_path: Path) -> None:
    one = row(tmp_path, crane='machine = "mobile-60t"\nbase_m = [4.5, -5.5]\nheading_deg = 0\n', places={})
    assert one.site.moving is None and len(one.site.cranes) == 1


@pytest.mark.parametrize(
    ("changes", "key", "says"),
    [
        ({"crane": 'machine = "flat-top-120"\njib_height_m = 20\n'}, "crane.setup", "stays where it is"),
        ({"crane": 'kind = "hammerhead"\n'}, "crane", "a hammerhead crane stays"),
        ({"crane": 'machine = "mobile-60t"\nbase_m = [0, 0]\n'}, "crane", "base_m is given per setup"),
        ({"places": {"west": (4.5, -5.5)}}, "crane", "there is one setup"),
        ({"setup": 'outriggers = "half"\n'}, "crane.setup[0].outriggers", "no chart for 'half'"),
        ({"setup": "boom_m = 90\n"}, "crane", ""),
        ({"more": '[[component]]\nglobal_id = "panel-1"\nsetup = "north"\n'}, "component[0].setup", "no setup called"),
        ({"more": '[[component]]\nglobal_id = "panel-1"\ncrane = "x"\n'}, "component[0].crane", "one crane that moves"),
    ],
)
def test_what_cannot_be_is_refused_by_its_key(tmp_path: Path, changes: dict, key: str, says: str) -> None:
    with pytest.raises(ConfigError) as error:
        row(tmp_path, **changes)
    assert (error.value.key or "").startswith(key), error.value
    assert says in str(error.value)


def test_times_of_moving_need_set_ups(tmp_path: Path) -> None:
    own = 'machine = "mobile-60t"\nbase_m = [4.5, -5.5]\nheading_deg = 0\nmoving = { rig_min = 5 }\n'
    with pytest.raises(ConfigError, match="moving is for a crane with several places"):
        load_site_config(row_file(tmp_path, crane=own, places={}))


def test_the_times_of_moving_follow_the_class_unless_they_are_given(tmp_path: Path) -> None:
    config = load_site_config(row_file(tmp_path))
    moving = moving_of(config, cranes_of(config))
    assert moving is not None and (moving.derig_s, moving.rig_s) == (1800.0, 2700.0)
    one, other = cranes_of(config)
    assert moving.drive_s(one, other) == pytest.approx(30.0 / (3.0 / 3.6))
    given = "[crane.moving]\nderig_min = 10\ndrive_km_h = 1.8\nrig_min = 5\n"
    config = load_site_config(row_file(tmp_path, more=given))
    moving = moving_of(config, cranes_of(config))
    assert moving is not None and (moving.derig_s, moving.drive_m_s, moving.rig_s) == (600.0, 0.5, 300.0)


def test_a_complete_site_file_keeps_the_set_ups(tmp_path: Path) -> None:
    loaded = row(tmp_path)
    again = tmp_path / "again.site.toml"
    again.write_text(site_toml(loaded.config))
    assert load_site_config(again).cranes == loaded.config.cranes


def test_a_crane_on_higher_ground_has_a_higher_pivot(tmp_path: Path) -> None:
    site = row(tmp_path, places={"low": (4.5, -5.5), "high": (34.5, -5.5, 1.5)}).site
    low, high = (crane.luffing for crane in site.cranes)
    assert low is not None and high is not None
    assert high.pivot_height_m - low.pivot_height_m == pytest.approx(1.5)
    assert high.tail_low_m - low.tail_low_m == pytest.approx(1.5)
    assert high.highest_tip_m - low.highest_tip_m == pytest.approx(1.5)


def test_a_crane_that_stays_has_its_pivot_as_high_above_its_foot_and_is_still_its_machine(tmp_path: Path) -> None:
    stays = 'machine = "mobile-60t"\nheading_deg = 0\nbase_m = [4.5, -5.5{}]\n'
    low, high = (
        row(tmp_path, places={}, panels=(0.0, 3.0), crane=stays.format(height)).site for height in ("", ", 1.5")
    )
    pivots = [site.cranes[0].luffing for site in (low, high)]
    assert pivots[0] is not None and pivots[1] is not None
    assert pivots[1].pivot_height_m - pivots[0].pivot_height_m == pytest.approx(1.5)
    assert pivots[1].tail_low_m - pivots[0].tail_low_m == pytest.approx(1.5)
    assert high.cranes[0].jib_height_m - low.cranes[0].jib_height_m == pytest.approx(1.5)
    made = bimvox.plan(bimvox.load_site(tmp_path / "row.site.toml"), policy="none", jobs=1)
    assert made.verdict is not None and made.verdict.verified
    kinds = {one.kind for one in remarks_of(made.record.plan, made.motions)}
    assert not kinds & {"crane_unknown", "crane_altered"}
