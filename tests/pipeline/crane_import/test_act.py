"""The act of ``bimvox crane import``: a machine file that plans, what is missing, what is checked."""

from __future__ import annotations

from pathlib import Path

import pytest
from bimvox_pipeline.crane_import.act import ImportOptions, import_crane
from bimvox_pipeline.crane_import.read_text import TextOptions

from bimvox.errors import InputError
from bimvox.progress import SilentProgress
from bimvox.site.config.machine_file import MACHINE_FILES

CSV = """name: LTX 1060
counterweight: 12 t
Radius m;18 m;30 m;36 m
6;20,4 t;14,4;-
10;10,4;10,4;9,4
16;;5,4;4,9
"""
KRAN = """<?xml version="1.0" encoding="UTF-8"?>
<CraneExportFile>
  <FileVersion>2</FileVersion>
  <Crane Unit="0" Manufacturer="Maker" Title="LTX 1060" Source="table 12" LoadCapacity="60.0" MaxMainBoom="36.0">
    <Load BoomType="0" CounterWeight="12.0" WorkingArea="360" OutriggerBase="full" TippingLoad="75">
      <LoadData CellX="0" CellY="0" Load="20.4" BoomLength="18.0" Radius="6.0"/>
      <LoadData CellX="0" CellY="1" Load="10.4" BoomLength="18.0" Radius="10.0"/>
      <LoadData CellX="1" CellY="0" Load="14.4" BoomLength="30.0" Radius="6.0"/>
      <LoadData CellX="1" CellY="1" Load="10.4" BoomLength="30.0" Radius="10.0"/>
      <LoadData CellX="2" CellY="1" Load="9.4" BoomLength="30.0" Radius="10.0"/>
    </Load>
    <Load BoomType="0" CounterWeight="12.0" WorkingArea="rear" OutriggerBase="full">
      <LoadData Load="16.4" BoomLength="30.0" Radius="6.0"/>
    </Load>
    <Load BoomType="0" AddOn="1" ExtensionLength="9.0" CounterWeight="12.0">
      <LoadData Load="3.0" BoomLength="30.0" Radius="10.0"/>
    </Load>
    <Hook Title="block" Rope="4" Load="16.0" Weight="0.25" Height="1.5"/>
    <Hook Title="ball" Rope="4" Load="16.0" Weight="0.35"/>
    <Hook Title="block" Rope="8" Load="32.0" Weight="0.45"/>
  </Crane>
</CraneExportFile>
"""
BASE = 'outriggers=[{ name = "full", front_m = 3.6, rear_m = 3.2, left_m = 3.3, right_m = 3.3 }]'
REAR = 'sector=[{ name = "rear", deg = [150, 210] }]'


def imported(text: str, folder: Path, **more):
    source = folder / ("sheet.kran" if text.startswith("<") else "sheet.csv")
    source.write_text(text, encoding="utf-8")
    ask = more.pop("ask", None)
    out = more.pop("out", folder / "machine.toml")
    return import_crane(source, None, out, ImportOptions(**more), ask=ask, progress=SilentProgress())


def test_what_is_missing_is_an_error_that_names_every_key(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="7 more keys") as caught:
        imported(CSV, tmp_path)
    for key in ("mast_size_m", "sling_m", "rigging_mass_kg", "slewing", "hoist", "luffing", "reeving"):
        assert f"{key} (" in str(caught.value)
    assert "--like mobile-35t" in caught.value.hint
    assert not list(tmp_path.glob("machine*"))


def test_a_generic_machine_stands_in_and_the_file_says_so(tmp_path: Path) -> None:
    document = imported(CSV, tmp_path, like="mobile-60t")
    text = (tmp_path / "machine.toml").read_text()
    machine = MACHINE_FILES.read(text.encode(), Path("machine.toml"))
    assert (machine.name, machine.lengths_m) == ("LTX 1060", (18.0, 30.0, 36.0))
    long = machine.with_jib(36.0)[0]
    assert (long.chart.radius_m, long.chart.capacity_kg) == ((10.0, 16.0), (9_400.0, 4_900.0))
    assert long.carrier.counterweight_kg == 12_000.0
    assert "mast_size_m = 7  # assumed, of mobile-60t" in text
    assert "# Not known: luffing, assumed" in text
    assert len(document["assumed"]) == 8
    assert [check["passed"] for check in document["checks"]] == [True, True]
    assert {Path(one).suffix for one in document["charts"]} == {".svg", ".png"}
    assert all(Path(one).stat().st_size > 1_000 for one in document["charts"])


def test_the_same_source_gives_the_same_bytes(tmp_path: Path) -> None:
    files = ("machine.toml", "machine.svg", "machine.png")
    made = []
    for _ in range(2):
        imported(CSV, tmp_path, like="mobile-60t")
        made.append([(tmp_path / name).read_bytes() for name in files])
    assert made[0] == made[1]


def test_stated_keys_are_the_persons_and_the_rates_are_checked(tmp_path: Path) -> None:
    stated = (
        "mast_size_m=6.5",
        "hoist.rate_m_s=0.5",
        "hoist.acceleration_m_s2=0.3",
        "hoist.jerk_m_s3=0.3",
        "hoist_kw=40",
    )
    document = imported(CSV, tmp_path, like="mobile-60t", stated=stated)
    text = (tmp_path / "machine.toml").read_text()
    assert "mast_size_m = 6.5\n" in text
    rates = document["checks"][2]
    # 14 t at 0.5 m/s are 69 kW at the rope.
    assert (rates["name"], rates["passed"]) == ("rates", False)
    assert imported(CSV, tmp_path, like="mobile-60t", stated=(*stated[:4], "hoist_kw=200"))["checks"][2]["passed"]
    for wrong, said in (("mast_size_m", "has no '='"), ("mast_sise_m=7", "no such key"), ("table=[]", "no such key")):
        with pytest.raises(InputError, match=said):
            imported(CSV, tmp_path, like="mobile-60t", stated=(wrong,))
    with pytest.raises(InputError, match=r"no such machine of kind .mobile."):
        imported(CSV, tmp_path, like="flat-top-75")


def test_a_person_is_asked_for_each_missing_key(tmp_path: Path) -> None:
    asked = []

    def ask(key: str, what: str, example: str) -> str | None:
        assert what
        assert example
        asked.append(key)
        return "7.2" if key == "mast_size_m" else None

    document = imported(CSV, tmp_path, ask=ask)
    assert asked == ["mast_size_m", "sling_m", "rigging_mass_kg", "slewing", "hoist", "luffing", "reeving"]
    assert "mast_size_m = 7.2\n" in (tmp_path / "machine.toml").read_text()
    assert "mast_size_m: of the generic mobile-35t" not in document["assumed"]


def test_kranxperts_file_is_read_with_sectors_outriggers_and_hooks(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"outriggers .*'full'.*sector .*'rear'"):
        imported(KRAN, tmp_path, like="mobile-60t")
    document = imported(KRAN, tmp_path, like="mobile-60t", stated=(BASE, REAR))
    machine = MACHINE_FILES.read((tmp_path / "machine.toml").read_bytes(), Path("machine.toml"))
    assert (machine.name, machine.lengths_m) == ("Maker LTX 1060", (18.0, 30.0))
    assert sorted({crane.falls for crane in machine.cranes}) == [4, 8]
    crane = next(crane for crane in machine.with_jib(30.0) if crane.falls == 8)
    # Of two telescopings the one that carries less counts.
    assert (crane.chart.capacity_kg, crane.hook_block_kg) == ((14_400.0, 9_400.0), 450.0)
    assert crane.carrier.sectors[0].chart.capacity_kg == (16_400.0,)
    assert crane.carrier.rating.startswith("75 %")
    notes = " ".join(document["notes"])
    assert "telescoped in several ways" in notes
    assert "Load 3 is left out" in notes


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (KRAN.replace('Unit="0"', 'Unit="1"'), "only 0, metres and tonnes, is known"),
        (KRAN.replace("CraneExportFile", "Other"), "not a file of KranXpert"),
        (KRAN[:400], "not XML"),
        (KRAN.replace("<Crane ", "<!DOCTYPE x><Crane "), "document type"),
        (CSV.replace("10,4;9,4", "30,4;9,4"), "line 5: with 30 m the capacity grows"),
    ],
)
def test_a_wrong_source_is_refused_with_its_place(text: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=said):
        imported(text, tmp_path, like="mobile-60t")
    assert not list(tmp_path.glob("machine*"))


def test_a_tower_crane_is_imported_too(tmp_path: Path) -> None:
    text = "name: FX 200\nR m;40 m;50 m\n15;10 t;9,5\n30;5,0;4,6\n40;3,6;3,3\n50;-;2,4\n"
    imported(text, tmp_path, kind="hammerhead", like="flat-top-155")
    machine = MACHINE_FILES.read((tmp_path / "machine.toml").read_bytes(), Path("machine.toml"))
    assert (machine.kind, machine.lengths_m) == ("hammerhead", (40.0, 50.0))
    assert machine.usual.chart.capacity_kg[-1] == 2_400.0


def test_pasted_text_has_no_file_and_input_is_never_overwritten(tmp_path: Path) -> None:
    out = tmp_path / "pasted.toml"
    options = ImportOptions(like="mobile-60t", stated=('name="P 1"',), text=TextOptions(load_unit="t"))
    pasted = b"R m 18 30\n6 20,4 14,4\n10 10,4 10,4\n"
    document = import_crane(None, pasted, out, options, progress=SilentProgress())
    assert document["machine"] == "P 1"
    assert "imported from standard input" in out.read_text()
    source = tmp_path / "same.toml"
    source.write_bytes(pasted)
    with pytest.raises(InputError):
        import_crane(source, None, source, options, progress=SilentProgress())
    assert source.read_bytes() == pasted
