"""The table of real files."""

from __future__ import annotations

from pathlib import Path

from benchmarks.real_files import SAMPLES, STAGES, measure, models_in, page, table


def test_a_file_is_planned_and_proven_and_its_processor_time_is_given_by_stage(tmp_path: Path):
    row = measure(SAMPLES / "paper.ifc", tmp_path)
    assert row["verified"] is True
    assert row["parts"] == sum(row["counts"].values()) == row["counts"]["planned"] == 1
    assert row["machine"]
    assert set(row["seconds"]) == {"init", *STAGES, "plan", "verify"}
    assert row["seconds"]["paths"] > 0.0
    text = table([row, {"model": "damaged.ifc", "error": "not an IFC file"}])
    assert f"| paper.ifc | 1 | 1 | 0 | 0 | 0 | 0 | 0 | {row['machine']} | yes |" in text
    assert "| damaged.ifc | not an IFC file |" in text
    assert {line.count("|") for line in text.splitlines()} == {11 + len(STAGES) + 2}


def test_the_page_has_the_time_of_the_plan_and_the_stages_of_the_longest():
    files = {"short.ifc": 0.5, "long.ifc": 2.0}
    rows = [
        {
            "model": name,
            "parts": 1,
            "counts": {"planned": 0, "by other means": 0, "in_situ": 1, "built": 0, "by_hand": 2, "refused": 0},
            "ground_m": -0.5,
            "kinds": {"concrete": 2, "steel": 1},
            "assumed": 1,
            "machine": "flat-top-75",
            "seconds": {"init": 1.0, **dict.fromkeys(STAGES, stage_s), "plan": len(STAGES) * stage_s, "verify": 3.0},
            "verified": True,
        }
        for name, stage_s in files.items()
    ]
    text = page([*rows, {"model": "damaged.ifc", "error": "not an IFC file"}])
    assert (
        "| short.ifc | -0.5 | 1 | 0 | 1 cast, 2 by hand | 2 concrete, 1 steel | 1 | flat-top-75 | 1.0 | 4.0 | 3.0 |"
        in text
    )
    assert "0 of 2 parts are planned, 2 of 3 plans verified." in text
    assert text.endswith("The plan of long.ifc by stage, s: " + ", ".join(f"{name} 2.0" for name in STAGES) + ".")
    assert "by stage" not in page([{"model": "damaged.ifc", "error": "not an IFC file"}])


def test_a_damaged_file_is_a_row_with_its_error(tmp_path: Path):
    file = tmp_path / "a.ifc"
    file.write_text("nothing")
    row = measure(file, tmp_path)
    assert row["model"] == "a.ifc"
    assert row["error"]
    assert "seconds" not in row


def test_folders_are_searched_for_building_files(tmp_path: Path):
    for name in ("b.IFC", "a.glb", "notes.md"):
        (tmp_path / name).touch()
    assert [file.name for file in models_in([tmp_path])] == ["a.glb", "b.IFC"]
