from dataclasses import MISSING, fields, replace
from math import cos, radians, sin

import pytest
from box_sites import test_crane as some_crane
from named_cranes import HAMMERHEADS, LUFFING_CRANES, MOBILE_CRANES, default_crane, default_luffing_crane
from own_machine import SHEET, machine_text

from bimvox.crane.tower_crane import TowerCrane
from bimvox.errors import ConfigError
from bimvox.site.config.crane import CraneConfig, LuffingConfig, OverrideConfig, ReevingConfig
from bimvox.site.config.file import parse_site_config
from bimvox.site.config.project import SupportConfig
from bimvox.site.config.site_config import ModelConfig, SiteConfig
from bimvox.site.machine import crane_config, crane_of, cranes_of


def site(**crane) -> SiteConfig:
    return SiteConfig(model=ModelConfig(path="a.ifc"), crane=CraneConfig(**crane) if crane else None)


def test_none_is_none():
    assert crane_of(site()) is None
    assert crane_of(site(kind="none")) is None
    assert crane_config(None) == CraneConfig(kind="none")


@pytest.mark.parametrize(
    "crane", [some_crane(), *HAMMERHEADS, *LUFFING_CRANES, *MOBILE_CRANES], ids=lambda crane: crane.name
)
def test_a_crane_goes_through_the_file_unchanged(crane):
    config = SiteConfig(model=ModelConfig(path="a.ifc"), crane=crane_config(crane))
    assert crane_of(config) == replace(crane, auxiliary=None)  # fitted only where a part is turned over with it


def test_a_built_in_machine_fills_in_what_is_left_out():
    crane = crane_of(site(name="hammerhead-45", base_m=(3.0, 4.0), sling_m=1.5))
    assert crane == replace(default_crane("hammerhead-45", (3.0, 4.0, 0.0)), sling_m=1.5)


def test_a_custom_machine_needs_every_key():
    complete = crane_config(some_crane()).model_dump()
    for field in fields(TowerCrane):
        if field.name == "name" or field.default is not MISSING:
            continue
        with pytest.raises(ConfigError, match="is missing") as caught:
            crane_of(site(**{key: value for key, value in complete.items() if key != field.name}))
        assert caught.value.key == f"crane.{field.name}"
        assert "hammerhead-30" in caught.value.available


def test_the_nearest_built_in_machine_is_named():
    with pytest.raises(ConfigError, match="hammerhead-65"):
        crane_of(site(name="hamerhead-65", base_m=(0.0, 0.0)))


@pytest.mark.parametrize(
    ("values", "key"),
    [
        ({"name": "hammerhead-30"}, "crane.base_m"),
        ({"name": "hammerhead-30", "base_m": (0.0, 0.0), "override": {"jib_length_m": 2.0}}, "crane.min_radius_m"),
        ({"name": "hammerhead-30", "base_m": (0.0, 0.0, 30.0)}, "crane.jib_height_m"),
    ],
)
def test_an_invalid_machine_is_refused(values, key):
    with pytest.raises(ConfigError) as caught:
        crane_of(site(**values))
    assert caught.value.key == key


REEVINGS = (
    ReevingConfig(falls=2, chart=((10.0, 3000.0), (30.0, 900.0)), hook_block_kg=90.0, trolley_rate_m_s=1.2),
    ReevingConfig(falls=4, chart=((10.0, 6000.0), (30.0, 800.0)), hook_block_kg=200.0, gears=((2000.0, 0.8),)),
)


def test_the_requested_reeving_is_used_otherwise_the_one_that_carries_most():
    two = crane_of(site(name="hammerhead-30", base_m=(0.0, 0.0), override=OverrideConfig(reeving=REEVINGS), falls=2))
    assert (two.falls, two.hook_block_kg, two.gears, two.trolley.rate) == (2, 90.0, (), 1.2)
    four = crane_of(site(name="hammerhead-30", base_m=(0.0, 0.0), override=OverrideConfig(reeving=REEVINGS)))
    assert (four.falls, four.chart.capacity_kg, four.gears) == (4, (6000.0, 800.0), ((2000.0, 0.8),))
    built_in = crane_of(site(name="hammerhead-65", base_m=(0.0, 0.0), falls=2))
    assert (built_in.falls, built_in.chart.capacity_kg[0]) == (2, 5000.0)


@pytest.mark.parametrize("name", ["hammerhead-45", "hammerhead-65", "flat-top-120"])
@pytest.mark.parametrize("falls", [2, 4])
def test_the_full_table_of_another_machine_contradicts_a_name(name, falls):
    """``init`` of earlier versions wrote every key; changing the name or the falls alone is an error, not ignored."""
    full = crane_config(default_crane("hammerhead-75", (1.0, 2.0, 0.0))).model_dump(exclude_none=True)
    with pytest.raises(ConfigError, match=f"contradicts the machine {name}") as caught:
        crane_of(site(**(full | {"name": name, "falls": falls}) if name != "hammerhead-45" else full | {"name": name}))
    assert "chart 20.0 t instead of" in caught.value.message
    assert "[crane.override]" in str(caught.value.hint)
    with pytest.raises(ConfigError, match="contradicts the machine hammerhead-75") as caught:
        crane_of(site(**(full | {"falls": 2})))
    assert "chart" in caught.value.message


def test_the_full_table_of_the_machine_itself_is_no_contradiction():
    for name in ("hammerhead-65", "luffing-55", "mobile-60t"):
        crane = default_luffing_crane(name)
        found = crane_of(site(**crane_config(crane).model_dump(exclude_none=True)))
        assert (found, found.overrides) == (crane, ())


def test_what_differs_on_purpose_is_an_override_that_is_listed():
    changed = OverrideConfig(jib_length_m=27.0, hook_block_kg=90.0, chart=((10.0, 3000.0), (27.0, 2000.0)))
    crane = crane_of(site(machine="hammerhead-30", base_m=(0.0, 0.0), override=changed))
    assert (crane.jib_length_m, crane.hook_block_kg, crane.chart.capacity_kg) == (27.0, 90.0, (3000.0, 2000.0))
    assert crane.gears == default_crane("hammerhead-30").gears
    listed = {one.key: (one.catalogue, one.site) for one in crane.overrides}
    assert listed["jib_length_m"] == ("30 m", "27 m")
    assert listed["hook_block_kg"] == ("150 kg", "90 kg")
    assert set(listed) == {"jib_length_m", "hook_block_kg", "chart"}
    assert crane_of(site(machine="hammerhead-30", base_m=(0.0, 0.0), override=OverrideConfig())).overrides == ()


def test_a_crane_with_a_name_of_its_own_keeps_its_machines_name():
    crane = crane_of(site(name="west", machine="hammerhead-30", base_m=(0.0, 0.0), jib_length_m=18.0))
    assert (crane.name, crane.machine, crane.jib_length_m) == ("west", "hammerhead-30", 18.0)
    with pytest.raises(ConfigError, match=r"not a machine of the catalogue") as caught:
        crane_of(site(name="west", machine="hammerhead-31", base_m=(0.0, 0.0)))
    assert 'machine = "hammerhead-30"' in str(caught.value.hint)


def test_an_override_needs_a_machine():
    with pytest.raises(ConfigError, match="names no machine") as caught:
        crane_of(site(name="mine", base_m=(0.0, 0.0), override=OverrideConfig(jib_length_m=20.0)))
    assert caught.value.key == "crane.override"


def test_a_jib_that_the_machine_does_not_have_is_refused_with_those_that_it_has():
    with pytest.raises(ConfigError, match="jib 22 m instead of 30 m") as caught:
        crane_of(site(machine="hammerhead-30", base_m=(0.0, 0.0), jib_length_m=22.0))
    assert caught.value.key == "crane.jib_length_m"
    assert "18, 24, 30 m" in str(caught.value.hint)


OWN = machine_text("LX 280", "hammerhead-45")


def test_ones_own_machine_is_a_file_next_to_the_site_file():
    text = '[model]\npath = "a.ifc"\n[crane]\nmachine = "lx.toml"\nbase_m = [1, 2]\njib_length_m = 40\n'
    config = parse_site_config(text, "s.toml", {"lx.toml": OWN})
    crane = crane_of(config)
    assert (crane.name, crane.jib_length_m) == ("LX 280", 40.0)
    with pytest.raises(ConfigError, match=r"'lx\.toml' is not there"):
        crane_of(parse_site_config(text, "s.toml"))
    with pytest.raises(ConfigError, match="contradicts the machine LX 280"):
        crane_of(parse_site_config(text + "hook_block_kg = 1\n", "s.toml", {"lx.toml": OWN}))
    with pytest.raises(ConfigError, match="is known already") as caught:
        crane_of(parse_site_config(text, "s.toml", {"lx.toml": machine_text("flat-top-75", "hammerhead-45")}))
    assert (caught.value.path.name, caught.value.key) == ("lx.toml", "name")


def mobile(more: str = "heading_deg = 90\n") -> TowerCrane:
    text = f'[model]\npath = "a.ifc"\n[crane]\nmachine = "mx.toml"\nbase_m = [1, 2]\n{more}'
    return crane_of(parse_site_config(text, "s.toml", {"mx.toml": SHEET.encode()}))


def test_a_mobile_crane_has_the_counterweight_the_outriggers_and_the_heading_of_the_site():
    crane = mobile()
    assert (crane.luffing.length_m, crane.falls, crane.carrier.counterweight_kg) == (36.0, 8, 12_000.0)
    assert (crane.carrier.outriggers.name, crane.carrier.heading_rad) == ("full", pytest.approx(radians(90)))
    less = mobile("heading_deg = 0\ncounterweight_kg = 4000\njib = { length_m = 18 }\n")
    assert (less.carrier.outriggers.name, less.chart.capacity_kg[0]) == ("half", 15_000)


def test_a_boom_between_two_listed_lengths_carries_what_the_next_longer_one_does():
    crane, longer = (mobile(f"heading_deg = 0\njib = {{ length_m = {length} }}\n") for length in (24, 30))
    assert crane.luffing.length_m == 24.0
    assert (crane.chart, crane.carrier.sectors) == (longer.chart, longer.carrier.sectors)
    with pytest.raises(ConfigError, match="jib 40 m instead of 36 m"):
        mobile("heading_deg = 0\njib = { length_m = 40 }\n")


@pytest.mark.parametrize(
    ("more", "key", "said"),
    [
        ("jib = { length_m = 30 }\n", "heading_deg", "is missing: MX 60 carries more in some sectors"),
        ("counterweight_kg = 9000\n", "counterweight_kg", "no chart for 9000 kg"),
        ('heading_deg = 0\noutriggers = "half"\n', "outriggers", "no chart for 'half' with 12000 kg"),
    ],
)
def test_a_set_up_that_the_machine_has_no_chart_for_is_refused(more, key, said):
    with pytest.raises(ConfigError, match=said) as caught:
        mobile(more)
    assert caught.value.key == f"crane.{key}"


def test_only_a_machine_that_describes_them_has_heading_counterweight_and_outriggers():
    with pytest.raises(ConfigError, match="describes neither") as caught:
        crane_of(site(machine="luffing-40", base_m=(0.0, 0.0), heading_deg=10.0))
    assert caught.value.key == "crane.heading_deg"


def test_a_chart_of_the_sites_own_holds_in_every_direction():
    crane = mobile("heading_deg = 0\njib = { length_m = 30 }\n[crane.override]\nchart = [[6, 9000], [20, 1000]]\n")
    assert (crane.carrier.sectors, crane.carrier.rating) == ((), "")
    assert crane.chart.capacity_kg == (9000.0, 1000.0)


def test_a_reeving_that_a_built_in_machine_lacks_is_refused():
    with pytest.raises(ConfigError, match="no reeving of 4 falls") as caught:
        crane_of(site(name="hammerhead-30", base_m=(0.0, 0.0), falls=4))
    assert caught.value.key == "crane.falls"


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"reeving": REEVINGS, "chart": ((10.0, 1.0),)}, "given per reeving"),
        ({"reeving": REEVINGS, "falls": 3}, "no reeving has 3 falls"),
        ({"reeving": (*REEVINGS, REEVINGS[0])}, "the same falls"),
    ],
)
def test_reevings_that_contradict_each_other_are_refused(values, said):
    with pytest.raises(ValueError, match=said):
        CraneConfig(**values)


def test_a_luffing_crane_follows_from_its_jib():
    crane = crane_of(site(kind="luffing", base_m=(1.0, 2.0), jib=LuffingConfig(length_m=30.0, pivot_height_m=20.0)))
    assert crane.kind == "luffing" and crane.name == "luffing-40"
    assert crane == crane_of(
        site(machine="luffing-40", base_m=(1.0, 2.0), jib=LuffingConfig(length_m=30.0, pivot_height_m=20.0))
    )
    with pytest.raises(ConfigError, match="jib 42 m instead of 40 m") as caught:
        crane_of(site(machine="luffing-40", base_m=(1.0, 2.0), jib=LuffingConfig(length_m=42.0)))
    assert caught.value.key == "crane.jib.length_m"
    override = OverrideConfig(jib=LuffingConfig(length_m=42.0))
    longer = crane_of(site(machine="luffing-40", base_m=(1.0, 2.0), override=override))
    assert [one.key for one in longer.overrides] == ["jib.length_m"]
    assert crane.jib_length_m == pytest.approx(1.5 + 30.0 * cos(radians(20.0)))
    assert crane.jib_height_m == pytest.approx(20.0 + 30.0 * sin(radians(83.0)))
    mobile = crane_of(site(kind="mobile", name="mobile-100t", base_m=(1.0, 2.0)))
    assert mobile == replace(default_luffing_crane("mobile-100t"), base_m=(1.0, 2.0, 0.0))


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"kind": "luffing", "jib_length_m": 30.0}, "follows from the jib"),
        ({"kind": "hammerhead", "jib": LuffingConfig()}, "jib is for kind"),
    ],
)
def test_keys_of_another_kind_are_refused(values, said):
    with pytest.raises(ValueError, match=said):
        CraneConfig(**values)


def test_a_luffing_machine_that_is_not_known_needs_every_key():
    with pytest.raises(ConfigError, match="not a machine of kind") as caught:
        crane_of(site(kind="mobile", name="luffing-40", base_m=(0.0, 0.0)))
    assert caught.value.key == "crane.name"
    with pytest.raises(ConfigError, match="luffing range of"):
        override = OverrideConfig(jib=LuffingConfig(luff_deg=(28.0, 92.0)))
        crane_of(site(kind="mobile", base_m=(0.0, 0.0), override=override))


@pytest.mark.parametrize(("name", "key"), [("west", "machine"), ("hammerhed-30", "name")])
def test_a_crane_with_its_own_name_must_name_its_machine_too(name, key):
    config = SiteConfig(model=ModelConfig(path="a.ifc"), crane=CraneConfig(name=name, base_m=(0.0, 0.0)))
    with pytest.raises(ConfigError, match="is missing") as caught:
        crane_of(config)
    wanted = {"machine": "flat-top-75", "name": "hammerhead-30"}[key]
    assert str(caught.value.hint).startswith(f'{key} = "{wanted}"')


def test_the_stated_foundation_of_a_tower_crane_is_part_of_it():
    first, second = (
        crane_config(replace(default_crane("hammerhead-45", (x, 0.0, 0.0)), name=f"crane {x:g}")) for x in (0.0, 99.0)
    )
    mobile = crane_config(MOBILE_CRANES[0])
    unnamed, named = SupportConfig(mat_m2=25.0), SupportConfig(crane="crane 99", mat_m2=36.0)

    def stated(cranes, support):
        config = SiteConfig(model=ModelConfig(path="a.ifc"), crane=cranes, support=support)
        return [crane.foundation_m2 for crane in cranes_of(config)]

    assert stated(first, ()) == [None]
    assert stated(first, (unnamed,)) == [25.0]
    assert stated(mobile, (unnamed,)) == [None], "the mat of an outrigger"
    assert stated((first, second), (unnamed,)) == [25.0, None]
    assert stated((first, second), (unnamed, named)) == [25.0, 36.0]
    assert stated((first, second), (named,)) == [None, 36.0]
