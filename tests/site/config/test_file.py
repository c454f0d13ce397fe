import time

import pytest

from bimvox.errors import ConfigError
from bimvox.site.config.file import load_site_config, parse_site_config

MODEL = '[model]\npath = "house.ifc"\n'


def error_of(text: str) -> ConfigError:
    with pytest.raises(ConfigError) as caught:
        parse_site_config(text, "site.toml")
    return caught.value


@pytest.mark.parametrize(
    ("text", "key", "near"),
    [
        (MODEL + "voxelsize_m = 1\n", "model.voxelsize_m", "voxel_size_m"),
        (MODEL + "[aeras]\n", "aeras", "areas"),
        (MODEL + "[crane]\njib_lenght_m = 40\n", "crane.jib_lenght_m", "jib_length_m"),
        (MODEL + "[crane]\nhoist = {rate = 1}\n", "crane.hoist.rate", "rate_m_s"),
        (MODEL + '[[component]]\nglobal_id = "a"\n[[component]]\nglobal_id = "b"\nstrat = [1, 2]\n',
         "component[1].strat", "start"),
        (MODEL + "[rules]\nclearence_m = 1\n", "rules.clearence_m", "clearance_m"),
    ],
)  # fmt: skip
def test_an_unknown_key_is_named_with_the_nearest_known_one(text, key, near):
    error = error_of(text)
    assert error.key == key
    assert near in error.available
    assert f"did you mean {near!r}" in str(error)


CRANES = MODEL + '[[crane]]\nname = "a"\nbase_m = [0, 0]\n[[crane]]\n'


@pytest.mark.parametrize(
    ("text", "key", "said"),
    [
        (CRANES + "base_m = [9, 9]\n", None, "crane[1].name is missing"),
        (CRANES + 'name = "b"\n', None, "crane[1].base_m is missing: give the position of b"),
        (CRANES + 'name = "a"\nbase_m = [9, 9]\n', None, "'a' is also crane[0]'s name"),
        (CRANES + 'kind = "none"\n', None, 'crane[1].kind: "none"'),
        (CRANES + 'name = "b"\nbase_m = [9, 9]\njib_lenght_m = 3\n', "crane[1].jib_lenght_m", "did you mean"),
        (CRANES + 'name = "b"\nbase_m = [9, 9]\njib_length_m = "x"\n', "crane[1].jib_length_m", "expected a number"),
        ("crane = []\n" + MODEL, "crane", "at least 1"),
        (MODEL + '[[component]]\nglobal_id = "p"\npinned = true\ncrane = "a"\n', "component[0]", "not lifted"),
    ],
)
def test_several_cranes_say_what_is_wrong_by_their_number(text, key, said):
    error = error_of(text)
    assert error.key == key
    assert said in f"{error} {error.hint}"


def test_one_crane_in_an_array_is_the_same_as_one_table():
    one, array = (
        parse_site_config(MODEL + head + "\nbase_m = [1, 2]\n", "s.toml") for head in ("[crane]", "[[crane]]")
    )
    assert one.cranes == array.cranes
    assert one.one_crane == array.one_crane


def test_a_misspelt_required_key_is_reported_as_such_not_as_missing():
    assert error_of('[model]\npth = "house.ifc"\n').key == "model.pth"


@pytest.mark.parametrize(
    ("text", "key", "said"),
    [
        ("", "model", "missing"),
        ("[model]\npath = 3\n", "model.path", "text"),
        (MODEL + 'voxel_size_m = "0.2"\n', "model.voxel_size_m", "number"),
        (MODEL + "voxel_size_m = true\n", "model.voxel_size_m", "number"),
        (MODEL + "voxel_size_m = -1\n", "model.voxel_size_m", "greater than 0"),
        (MODEL + "ground_m = nan\n", "model.ground_m", "finite"),
        (MODEL + 'assemblies = "some"\n', "model.assemblies", "'whole' or 'parts'"),
        (MODEL + "[areas]\nyard = [[[0, 0], [1, 1]]]\n", "areas.yard[0]", "at least 3"),
        (MODEL + "[areas]\nyard = [[[0, 0], [2, 2], [2, 0], [0, 2]]]\n", "areas.yard[0]", "Self-intersection"),
        (MODEL + "[areas]\nyard = [[[0, 0], [1, 1], [2, 2]]]\n", "areas.yard[0]", "polygon"),
        (MODEL + "[areas]\nyard = []\n", "areas.yard", "at least 1"),
        (MODEL + "[grid]\nlow_m = [0]\nhigh_m = [1, 1, 1]\n", "grid.low_m", "at least 2"),
        (MODEL + "[grid]\nlow_m = [0, 0]\nhigh_m = [1, -1, 1]\n", "grid", "above low_m"),
        (MODEL + '[crane]\nkind = "derrick"\n', "crane.kind", "'hammerhead', 'luffing', 'mobile' or 'none'"),
        (MODEL + '[crane]\nkind = "none"\nsling_m = 1\n', "crane", "no other key"),
        (MODEL + "[crane]\nchart = [[10, 100], [5, 50]]\n", "crane.chart", "ascending"),
        (MODEL + '[[component]]\nglobal_id = "a"\npose = "up"\n', "component[0].pose", "lying_x"),
        (MODEL + '[[component]]\nglobal_id = "a"\npinned = true\nstart = [1, 2]\n', "component[0]", "pinned"),
        (MODEL + '[[component]]\nglobal_id = "a"\n[[component]]\nglobal_id = "a"\n', None, "component[1].global_id"),
        (MODEL + '[[zone]]\nkind = "wet"\npolygon = [[0, 0], [1, 0], [1, 1]]\n', "zone[0].kind", "prohibited"),
        (MODEL + "[policy]\nsteps = 1.5\n", "policy.steps", "whole number"),
        (MODEL + "[policy]\nrequired_success = 2\n", "policy.required_success", "1"),
    ],
)
def test_a_wrong_value_is_named_by_its_key(text, key, said):
    error = error_of(text)
    assert error.key == key
    assert said in str(error)
    assert "site.toml" in str(error)


@pytest.mark.parametrize("text", [MODEL + "voxel_size_m = = 1\n", "[model]\n\npath = house\n"])
def test_broken_toml_says_line_and_column(text):
    assert "line 3, column" in str(error_of(text))


@pytest.mark.parametrize("name", ["house.ifc", "HOUSE.GLB"])
def test_a_model_in_place_of_a_site_file_leads_to_init(tmp_path, name):
    (tmp_path / name).write_bytes(b"\xff\xfe")
    with pytest.raises(ConfigError, match="a model, not a site file") as refused:
        load_site_config(tmp_path / name)
    assert refused.value.hint == f"bimvox init {tmp_path / name} writes its site file"


def test_what_is_left_out_is_left_open(tmp_path):
    (tmp_path / "house.ifc").touch()
    file = tmp_path / "plot.toml"
    file.write_text("\ufeff" + MODEL, encoding="utf-8")
    config = load_site_config(file)
    assert config.name == "plot"
    assert config.model.path == tmp_path / "house.ifc"
    assert config.model.voxel_size_m is None
    assert config.crane is None
    assert config.areas.yard is None
    assert config.file == file


def test_the_model_path_starts_at_the_site_files_folder(tmp_path, monkeypatch):
    (tmp_path / "models").mkdir()
    (tmp_path / "models" / "house.ifc").touch()
    (tmp_path / "sites").mkdir()
    (tmp_path / "sites" / "a.toml").write_text('[model]\npath = "../models/house.ifc"\n')
    monkeypatch.chdir("/")
    assert load_site_config(tmp_path / "sites" / "a.toml").model.path == tmp_path / "models" / "house.ifc"


def test_files_that_cannot_be_used(tmp_path):
    with pytest.raises(ConfigError, match="cannot be read"):
        load_site_config(tmp_path / "none.toml")
    with pytest.raises(ConfigError, match="cannot be read"):
        load_site_config(tmp_path)
    (tmp_path / "latin.toml").write_bytes(b'name = "\xe9"\n')
    with pytest.raises(ConfigError, match="not UTF-8"):
        load_site_config(tmp_path / "latin.toml")
    (tmp_path / "a.toml").write_text(MODEL)
    with pytest.raises(ConfigError, match=r"house\.ifc") as caught:
        load_site_config(tmp_path / "a.toml")
    assert caught.value.key == "model.path"


def test_many_components_are_checked_in_seconds() -> None:
    entries = "".join(f'[[component]]\nglobal_id = "part {n}"\n' for n in range(20_000))
    started_s = time.process_time()
    said = error_of(MODEL + entries + '[[component]]\nglobal_id = "part 7"\n')
    assert time.process_time() - started_s < 10.0
    assert "component[20000].global_id: 'part 7' is listed twice" in str(said)


ZONE = '[[zone]]\nkind = "no_load"\npolygon = [[0, 0], [1, 0], [1, 1]]\n'
CORNERS = ", ".join(f"[{n}, {n * n}]" for n in range(10_001))


@pytest.mark.parametrize(
    ("text", "key", "said"),
    [
        (ZONE * 1001, "zone", "at most 1000 values, got 1001"),
        (f"[[zone]]\npolygon = [{CORNERS}]\n", "zone[0].polygon", "at most 10000 values, got 10001"),
        (f"[areas]\nconstruction = [{CORNERS}]\n", "areas.construction", "at most 10000 values, got 10001"),
        (f"[areas]\nyard = [{', '.join(['[[0, 0], [1, 0], [1, 1]]'] * 1001)}]\n", "areas.yard", "at most 1000 values"),
    ],
)
def test_more_areas_and_corners_than_a_site_has_are_refused(text: str, key: str, said: str) -> None:
    error = error_of(MODEL + text)
    assert error.key == key
    assert said in str(error)
