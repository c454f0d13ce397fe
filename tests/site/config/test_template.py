import tomllib
from datetime import date
from pathlib import Path

from box_buildings import frame_house
from named_cranes import LUFFING_CRANES, MOBILE_CRANES

from bimvox.bim.kinds.kind import Confidence, Kind
from bimvox.site.component import StoredPose
from bimvox.site.config.calendar import CalendarConfig
from bimvox.site.config.crane import CraneConfig, OverrideConfig, ReevingConfig, WorkingRangeConfig
from bimvox.site.config.file import load_site_config, parse_site_config
from bimvox.site.config.project import ProjectConfig, RevisionConfig
from bimvox.site.config.rules import RulesConfig, YardConfig
from bimvox.site.config.site_config import (
    ComponentConfig,
    GridConfig,
    KindConfig,
    ModelConfig,
    PolicyConfig,
    SiteConfig,
    ZoneConfig,
)
from bimvox.site.config.template import site_toml
from bimvox.site.guess import guess_site
from bimvox.site.kind_rows import KindRow
from bimvox.site.machine import crane_config

TRIANGLE = ((0.0, 0.0), (10.5, 0.0), (0.1, 1e-7))


def full() -> SiteConfig:
    return SiteConfig(
        name='A "quoted" \\ name, é\x7f\n',
        project=ProjectConfig(
            number="14 é", prepared_by="A. Person", revisions=(RevisionConfig(revision="A", date="2026-11-23"),)
        ),
        model=ModelConfig(
            path=Path("my models/a.ifc"), select="IfcColumn, IfcBeam", unit="ft", voxel_size_m=0.1 + 0.2,
            yaw_deg=-7.1234567890123, ground_m=-0.0, assemblies="parts",
        ),
        grid=GridConfig(low_m=(-1.0, 2.0, -0.3), high_m=(15.0, 16.5, 5.0)),
        component=(
            ComponentConfig(global_id="a", start=(1.0, 2.0), pose=StoredPose.LYING_Y, before=("b", "c"), after=("d",)),
            ComponentConfig(global_id="b", pinned=True),
        ),
        zone=(
            ZoneConfig(polygon=TRIANGLE, name="street"), ZoneConfig(polygon=TRIANGLE),
            ZoneConfig(kind="slow", polygon=TRIANGLE, share=0.3), ZoneConfig(kind="public", polygon=TRIANGLE),
            ZoneConfig(kind="limiter", polygon=TRIANGLE, lowest_hook_m=3.0, highest_hook_m=9.5),
        ),
        rules=RulesConfig(clearance_m=0.5, rope=False, sample_period_s=0.2),
        calendar=CalendarConfig(
            start=date(2026, 3, 9), days=("Mon", "Sun"), shifts=("06:00-14:00",), breaks=(), country="DE", region="BY",
            holidays=(date(2026, 12, 24),), setup_h=8.0, unloading_s=0.0,
        ),
        policy=PolicyConfig(id="p-1", steps=20_000, seed=7, required_success=0.9),
        crane=CraneConfig(
            name="hammerhead-30", base_m=(1.0, 2.0), falls=4, max_wind_m_s=15.0,
            working_range=WorkingRangeConfig(slew_deg=(30.0, 200.5), radius_m=(4.0, 20.0), highest_hook_m=18.0),
            override=OverrideConfig(jib_length_m=28.0, max_wind_m_s=12.0, gears=((500.0, 1.0),), chart=((9.0, 800.0),)),
            reeving=(
                ReevingConfig(falls=2, chart=((10.0, 3000.0), (20.0, 1500.0)), hook_block_kg=9.0, gears=((50.0, 2.0),)),
                ReevingConfig(falls=4, chart=((10.0, 6000.0),), trolley_rate_m_s=0.5),
            ),
        ),
    )  # fmt: skip


def test_every_value_reads_back_the_same():
    guessed = guess_site(frame_house(), ModelConfig(path="house.ifc", select="IfcBeam", unit="mm"))
    for config in (full(), guessed, SiteConfig(model=ModelConfig(path="a.ifc"), crane=CraneConfig(kind="none"))):
        text = site_toml(config)
        assert parse_site_config(text, "site.toml").model_dump() == config.model_dump()
        assert site_toml(parse_site_config(text, "site.toml")) == text


def test_a_short_file_reads_back_the_same_with_what_comes_first_at_the_top():
    guessed = guess_site(frame_house(), ModelConfig(path="house.ifc", select="IfcBeam", unit="mm"))
    dated = guessed.model_copy(update={"calendar": CalendarConfig(start=date(2026, 3, 9))})
    for config in (full(), guessed, dated, SiteConfig(model=ModelConfig(path="a.ifc"))):
        text = site_toml(config, short=True, kinds=ROWS, crane_notes=("a crane",), start_why="so", ground_why="so")
        assert parse_site_config(text, "site.toml").model_dump() == config.model_dump()
    text = site_toml(dated, short=True, kinds=ROWS, crane_notes=("a crane",), start_why="so", ground_why="so")
    top, _, rest = text.partition("# -----")
    assert len(top.strip().splitlines()) <= 25
    assert {"calendar", "crane", "areas", "model"} == {key for key in tomllib.loads(top) if key != "name"}
    assert set(tomllib.loads(top)["model"]) == {"path", "unit", "ground_m"}
    assert "start = 2026-03-09  # First day of work. Here: so" in top
    assert "kinds = [" in rest
    assert "[rules.times]" not in rest
    assert "day 1 07:00" in site_toml(guessed, short=True), "without a start, it says what that means"


def test_in_a_short_file_only_the_first_of_several_tables_is_explained():
    parts = tuple(ComponentConfig(global_id=name, means="in_situ") for name in "abc")
    text = site_toml(SiteConfig(model=ModelConfig(path=Path("m.ifc")), component=parts), short=True)
    assert text.count("Lifted by `crane`") == 1
    assert text.count("means = ") == 3


def test_cranes_that_luff_read_back_the_same():
    for crane in (LUFFING_CRANES[0], MOBILE_CRANES[-1]):
        config = SiteConfig(model=ModelConfig(path="a.ifc"), crane=crane_config(crane))
        assert parse_site_config(site_toml(config), "site.toml").model_dump() == config.model_dump()


def test_a_written_file_loads(tmp_path):
    (tmp_path / "house.ifc").touch()
    config = guess_site(frame_house(), ModelConfig(path="house.ifc"))
    (tmp_path / "site.toml").write_text(site_toml(config), encoding="utf-8")
    loaded = load_site_config(tmp_path / "site.toml")
    assert loaded.model.path == tmp_path / "house.ifc"
    assert loaded.crane == config.crane


def test_the_examples_work_without_their_comment_marks():
    text = site_toml(SiteConfig(model=ModelConfig(path="house.ifc")), example_ids=["slab", "beam-0"])
    blocks = [block.splitlines() for block in text.split("\n\n")]
    marked = {
        line: "\n".join(one.removeprefix("# ") for one in block[number:])
        for block in blocks
        for number, line in enumerate(block)
        if line.startswith(("# [", "# [["))
    }
    assert {"# [project]", "# [grid]", "# [rigging]", "# [[component]]", "# [[zone]]"} < set(marked)
    assert {"# [rules.curing]", "# [yard]", "# [calendar]", "# [costs]"} < set(marked)
    for title, example in marked.items():
        assert parse_site_config(f"{text}\n{example}", "site.toml"), title
    parsed = parse_site_config(f"{text}\n{marked['# [[component]]']}", "site.toml")
    assert parsed.component[0].global_id == "slab"
    assert parsed.component[0].after == ("beam-0",)


def test_each_key_has_the_comment_of_the_schema_beside_or_above_it():
    lines = site_toml(guess_site(frame_house(), ModelConfig(path="house.ifc"))).splitlines()
    for name in ("model", "areas", "sequence", "means", "rules", "yard", "policy"):
        start = lines.index(f"[{name}]")
        for key, field in type(getattr(full(), name) or YardConfig()).model_fields.items():
            rest = [number for number, line in enumerate(lines) if line.removeprefix("# ").startswith(f"{key} = ")]
            number = next((number for number in rest if number > start), None)
            if number is not None and key != "kinds":
                comment = " ".join(lines[number - 3 : number + 1]).replace("# ", "")
                assert field.description.replace("``", "`").split()[-1].removesuffix(".") in comment, key


def test_it_says_when_a_crane_is_out_of_the_ordinary():
    config = guess_site(frame_house(), ModelConfig(path="house.ifc"))
    text = site_toml(config)
    assert "FICTITIOUS" not in text
    larger = config.crane.model_copy(update={"name": "fictitious hammerhead-75 scaled 1 x 5"})
    assert "FICTITIOUS: this machine does not exist" in site_toml(config.model_copy(update={"crane": larger}))


def test_a_machine_of_the_catalogue_is_its_name_jib_and_falls_and_why_no_smaller_one():
    config = guess_site(frame_house(), ModelConfig(path="house.ifc"))
    text = site_toml(config, crane_notes=("flat-top-1 does not serve this site: it is too small",))
    crane = tomllib.loads(text)["crane"]
    assert set(crane) == {"kind", "machine", "base_m", "jib_height_m", "jib_length_m", "falls"}
    assert "# flat-top-1 does not serve this site: it is too small\n[crane]\n" in text


OTHER, ASSUMED, NAMED = Kind.OTHER, Confidence.ASSUMED, Confidence.NAMED
ROWS = (
    KindRow(
        "IfcWall", "it's", None, OTHER, "crane", 2, (20.0, 1340.0), "so\nit is", ASSUMED, "IfcWall, Name=/it's/", 3
    ),
    KindRow("IfcBeam", "B", None, Kind.STEEL, "by_hand", 1, (20.0, 20.0), "so", NAMED, 'IfcBeam, type="B"', 1),
    KindRow("IfcFooting", "F", None, Kind.CONCRETE, "pinned", 1, (20.0, 20.0), "so", NAMED, "IfcFooting", 1),
)


def test_each_type_is_a_line_to_uncomment_that_confirms_what_is_assumed():
    config = SiteConfig(model=ModelConfig(path=Path("m.ifc")))
    text = site_toml(config, kinds=ROWS)
    assert not parse_site_config(text, "a.toml").model.kinds
    lines = [line for line in text.splitlines() if line.startswith("  # {")]
    assert lines[0].endswith("# ASSUMED, 2 parts (the line selects 1 more), 0.02 to 1.3 t: so it is")
    assert lines[1].endswith("# 1 part, 0.02 t: so")
    found = parse_site_config(text.replace("  # {", "  {"), "a.toml").model.kinds
    assert found == (
        KindConfig(select="IfcWall, Name=/it's/", kind="concrete", means="crane"),
        KindConfig(select='IfcBeam, type="B"', kind="steel", means="by_hand"),
        KindConfig(select="IfcFooting", kind="concrete"),
    )


def test_kinds_are_written_as_they_were_read():
    kinds = ("kinds.csv", KindConfig(select="IfcWall", kind="timber"))
    config = SiteConfig(model=ModelConfig(path=Path("m.ifc"), kinds=kinds))
    assert parse_site_config(site_toml(config), "a.toml").model.kinds == kinds
    assert parse_site_config('[model]\npath = "m.ifc"\nkinds = "kinds.csv"', "a.toml").model.kinds == kinds[:1]


def test_a_long_list_of_types_is_counted():
    config = SiteConfig(model=ModelConfig(path=Path("m.ifc")))
    text = site_toml(config, kinds=ROWS[1:2] * 75)
    assert "# ... and 15 more: bimvox inspect MODEL --csv FILE lists all" in text
