"""What `plan` does with an obstruction file is what `verify` finds when it reads the file again, or the log's copy."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from planned_frame import planned

from bimvox.errors import ObstructionFileError
from bimvox.library.attached_files import check_attached_files
from bimvox.library.claims import Given, check_user_files
from bimvox.library.plan import obstructions_of
from bimvox.library.site import obstructed, survey_in
from bimvox.log.plan_log import GEOREFERENCE, PlanLog
from bimvox.log.reader import read_log
from bimvox.progress import SilentProgress

SAMPLES = Path(__file__).parents[2] / "sample_models"
Write = Callable[[Path], Path]
TALL = np.c_[np.tile([3.0, 7.0], (90, 1)), np.linspace(0.0, 60.0, 90)]
ASIDE = TALL + np.array([900.0, 0.0, 0.0])
SMALL = [[1.0, -8.0, 0.0], [1.6, -7.0, 1.2]]
CUBE = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
QUADS = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


def xyz(points: object, name: str = "mast.xyz") -> Write:
    """A scan."""

    def write(folder: Path) -> Path:
        np.savetxt(folder / name, points)  # type: ignore[arg-type]
        return folder / name

    return write


def obj(low: list[float], high: list[float], name: str = "shed.obj") -> Write:
    """A box as a mesh."""

    def write(folder: Path) -> Path:
        corners = np.array(low) + CUBE * (np.array(high) - low)
        lines = [f"v {x} {y} {z}" for x, y, z in corners]
        lines += ["f " + " ".join(str(n + 1) for n in quad) for quad in QUADS]
        (folder / name).write_text("\n".join(lines) + "\n")
        return folder / name

    return write


def listed(*entries: dict[str, object], unit: str = "m", also: Write | None = None) -> Write:
    """An obstruction file, with a file that it names."""

    def write(folder: Path) -> Path:
        if also is not None:
            also(folder)
        file = folder / "mine.json"
        file.write_text(json.dumps({"version": 1, "unit": unit, "obstructions": entries}))
        return file

    return write


def toml(folder: Path) -> Path:
    text = 'version = 1\n[[obstructions]]\nid = "truck"\nbox = { min = [1, -8, 0], max = [2, -7, 3] }\n'
    (folder / "mine.toml").write_text(text)
    return folder / "mine.toml"


def ifc(folder: Path) -> Path:
    (folder / "neighbour.ifc").write_bytes((SAMPLES / "paper.ifc").read_bytes())
    return folder / "neighbour.ifc"


def part_id() -> str:
    return read_log(planned() / "frame.mcap").plan.site.components[0].id


def box(low: list[float], high: list[float], name: str = "truck") -> dict[str, object]:
    return {"id": name, "box": {"min": low, "max": high}}


SILO: dict[str, object] = {"id": "silo", "cylinder": {"base": [1000, -8000, 0], "radius": 400, "height": 9e4}}
FILES = {
    "a list in TOML": toml,
    "a scan above": xyz(TALL),
    "a scan below": xyz(TALL - [0, 0, 30]),
    "a scan that crosses the side": xyz(np.c_[np.linspace(-90, 90, 200), np.full(200, -8.0), np.full(200, 0.3)]),
    "a scan aside": xyz(ASIDE),
    "a scan with many dots in its name": xyz(TALL, "mast.2027.02.xyz"),
    "a scan with the id of a part": lambda folder: xyz(TALL, f"{part_id()}.xyz")(folder),
    "a scan with points twice": xyz(np.repeat(TALL, 3, axis=0)),
    "a scan of one point": xyz(TALL[:1]),
    "a scan inside": xyz(SMALL),
    "points above": listed({"id": "mast", "points": "mast.xyz"}, also=xyz(TALL)),
    "points aside": listed({"id": "mast", "points": "mast.xyz"}, also=xyz(ASIDE)),
    "points with the id of a part": lambda folder: listed(
        {"id": part_id(), "points": "mast.xyz"}, box([1, -8, 0], [2, -7, 99]), also=xyz(TALL)
    )(folder),
    "points in mm, and a box aside": listed(
        {"id": "mast", "points": "mast.xyz"},
        box([9e6, 0, 0], [9.1e6, 10, 10]),
        unit="mm",
        also=xyz(TALL * 1000),
    ),
    "a mesh above": obj([1, -8, 0], [2, -7, 90]),
    "a mesh aside": obj([900, -8, 0], [902, -7, 9]),
    "a mesh that is named, aside": listed(
        {"id": "shed", "mesh": "shed.obj"}, also=obj([900, -8, 0], [902, -7, 9])
    ),
    "a mesh that is named, above, in ft": listed(
        {"id": "shed", "mesh": "shed.obj"},
        box([3, -26, 0], [6, -22, 900]),
        unit="ft",
        also=obj([3, -26, 0], [6, -22, 300]),
    ),
    "a box above": listed(box([1, -8, 0], [2, -7, 90])),
    "a box below": listed(box([1, -8, -90], [2, -7, 0.5])),
    "a box aside": listed(box([900, 0, 0], [901, 1, 1])),
    "a box with the id of a part": lambda folder: listed(box([1, -8, 0], [2, -7, 90], part_id()))(folder),
    "a cylinder above, in mm": listed(SILO, unit="mm"),
    "voxels aside": listed({"id": "pile", "voxels": [[1, 1, 1], [-5, 1, 1], [1, 1, 900], [1, 1, 1]]}),
    "voxels outside": listed({"id": "pile", "voxels": [[9000, 1, 1]]}),
    "an IFC file": ifc,
    "nothing": listed(),
    "boxes aside and above, more than have a note each": listed(
        *(box([900, n, 0], [901, n + 1, 1], f"far {n}") for n in range(120)),
        *(box([1, -8, n], [2, -7, 90], f"tall {n}") for n in range(3)),
    ),
    "cylinders aside, more than have a note each, and points": listed(
        *({"id": f"m{n}", "cylinder": {"base": [900, n, 0], "radius": 1, "height": 2}} for n in range(120)),
        {"id": "aside", "points": "mast.xyz"},
        {"id": "zone", "points": "mast.xyz"},
        also=xyz(ASIDE),
    ),
    "voxels outside, more than have a note each, and a mesh above": listed(
        *({"id": f"pile {n}", "voxels": [[9000, n, 1]]} for n in range(120)),
        {"id": "shed", "mesh": "shed.obj"},
        also=obj([1, -8, 0], [2, -7, 90]),
    ),
}  # fmt: skip


def gltf(folder: Path) -> Path:
    """A mesh whose coordinates are in a file of their own."""
    (folder / "shed.bin").write_bytes(np.array([[1, 0, -8], [2, 0, -8], [1, 9, -8]], "<f4").tobytes())
    document = {
        "asset": {"version": "2.0"},
        "buffers": [{"uri": "shed.bin", "byteLength": 36}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
    }
    (folder / "shed.gltf").write_text(json.dumps(document))
    return folder / "shed.gltf"


def test_a_mesh_that_a_log_cannot_carry_is_refused_with_a_way_out(record: PlanLog, tmp_path: Path) -> None:
    with pytest.raises(ObstructionFileError, match="in other files") as refused:
        with_file(record, gltf(tmp_path))
    assert "GLB" in str(refused.value.hint)
    assert with_file(record, listed({"id": "shed", "mesh": "shed.gltf"})(tmp_path)).plan.site.blockers


@pytest.mark.parametrize("name", ["obstructions.mast./x", "obstructions.../../../x.xyz", "obstructions.py"])
def test_a_name_in_a_log_leads_nowhere(record: PlanLog, name: str) -> None:
    forged = replace(record, attachments={**record.attachments, name: b"1 2 3"})
    assert any(name in said for said in check_attached_files(forged).failures)


def with_file(record: PlanLog, file: Path) -> PlanLog:
    """Return the record as `plan --obstructions FILE` writes it; its lifts are not looked at here."""
    obstructions, attached = obstructions_of(file, record.plan.site, survey_in(record))
    site = obstructed(record.plan.site, obstructions, SilentProgress())
    return replace(record, plan=replace(record.plan, site=site), attachments={**record.attachments, **attached})


@pytest.fixture(scope="module")
def record() -> PlanLog:
    return read_log(planned() / "frame.mcap")


@pytest.mark.parametrize("name", FILES)
def test_a_log_agrees_with_the_file_that_it_was_planned_with(record: PlanLog, tmp_path: Path, name: str) -> None:
    file = FILES[name](tmp_path)
    made = with_file(record, file)
    assert check_attached_files(made).failures == []
    assert check_user_files(made, Given(obstructions=file), SilentProgress()).failures == []


@pytest.mark.parametrize(
    ("name", "named", "counted"),
    [
        ("boxes aside and above", 99, "3 clipped to the site, 21 outside the site"),
        ("cylinders aside", 99 + 2, "21 outside the site"),
        ("voxels outside", 99 + 1, "21 outside the site"),
    ],
)
def test_from_the_hundredth_note_on_obstructions_are_counted_but_for_those_of_other_files(
    record: PlanLog, tmp_path: Path, name: str, named: int, counted: str
) -> None:
    write = next(FILES[one] for one in FILES if one.startswith(f"{name}, more"))
    *notes, last = with_file(record, write(tmp_path)).plan.site.obstruction_notes
    assert len({note for note in notes if note.startswith("obstruction ")}) == len(notes) == named
    assert last == f"more obstructions: {counted}"


def test_the_count_is_shown_where_not_all_notes_are(record: PlanLog, tmp_path: Path) -> None:
    shown: list[str] = []
    progress = SilentProgress()
    progress.note = shown.append  # type: ignore[method-assign]
    file = FILES["cylinders aside, more than have a note each, and points"](tmp_path)
    obstructions, _ = obstructions_of(file, record.plan.site, survey_in(record))
    obstructed(record.plan.site, obstructions, progress)
    assert len(shown) == 101
    assert shown[-2:] == [
        "more obstructions: 21 outside the site",
        "the log has 2 more notes about obstructions",
    ]


def test_a_forged_count_of_obstructions_is_refused(record: PlanLog, tmp_path: Path) -> None:
    made = with_file(record, FILES["boxes aside and above, more than have a note each"](tmp_path))
    *notes, last = made.plan.site.obstruction_notes
    site = replace(made.plan.site, obstruction_notes=(*notes, last.replace("21", "22")))
    forged = replace(made, plan=replace(made.plan, site=site))
    assert any("obstruction_notes" in said for said in check_attached_files(forged).failures)


EAST_NORTH_UP = np.array([155_000.0, 463_000.0, 3.2])
MAP = {"eastings_m": 155_000.0, "northings_m": 463_000.0, "height_m": 3.2, "x_axis_yaw_rad": 0.0, "scale": 1.0}
ON_MAP = {
    "a scan": xyz(SMALL + EAST_NORTH_UP),
    "a mesh": obj([155_001, 462_992, 3.2], [155_002, 462_993, 9.2]),
    "boxes, one of them outside": listed(
        box([155_001, 462_992, 3.2], [155_002, 462_993, 9.2]), box([155_901, 462_992, 3], [155_902, 462_993, 9], "x")
    ),
    "boxes, most of them outside": listed(
        box([155_001, 462_992, 3.2], [155_002, 462_993, 9.2], "in"),
        *(box([155_901, 462_992 + n, 3], [155_902, 462_993 + n, 9], f"x{n}") for n in range(120)),
    ),
    "points, and a box in site coordinates": listed(
        {"id": "mast", "points": "mast.xyz"}, box([1, -8, 0], [2, -7, 9]), also=xyz(TALL + EAST_NORTH_UP)
    ),
    "points in site coordinates, and a box": listed(
        {"id": "mast", "points": "mast.xyz"}, box([155_001, 462_992, 3.2], [155_002, 462_993, 9.2]), also=xyz(TALL)
    ),
}  # fmt: skip


@pytest.mark.parametrize("stated", [False, True])
@pytest.mark.parametrize("name", ON_MAP)
def test_a_log_agrees_with_a_file_in_map_coordinates(
    record: PlanLog, tmp_path: Path, name: str, *, stated: bool
) -> None:
    site_file = (b'coordinates = "map"\n' if stated else b"") + record.attachments["site.toml"]
    on_map = replace(
        record,
        metadata={**record.metadata, GEOREFERENCE: json.dumps(MAP)},
        attachments={**record.attachments, "site.toml": site_file},
    )
    file = ON_MAP[name](tmp_path)
    made = with_file(on_map, file)
    assert any(blocker.kind == "obstruction" for blocker in made.plan.site.blockers)
    assert [said for said in check_attached_files(made).failures if "obstruction" in said or "fixed" in said] == []
    assert check_user_files(made, Given(obstructions=file), SilentProgress()).failures == []
