"""An existing programme: its tasks by part, their order, and what is wrong with it."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from xml.sax.saxutils import escape

import pytest
from box_sites import box_mesh

from bimvox.bim.building import TriangleMesh
from bimvox.errors import ConfigError
from bimvox.site.programme import Programme, read_programme

CUBE = box_mesh((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
WALL_ID = "0aaaaaaaaaaaaaaaaaaaaa"


@dataclass(frozen=True)
class Part:
    global_id: str
    name: str
    storey: str | None
    ifc_class: str
    mesh: TriangleMesh = CUBE
    predefined_type: str | None = None
    material: str | None = None


def task(number: int, name: str, *, level: int = 2, start: str = "", after: str = "", more: str = "") -> str:
    link = f"<PredecessorLink><PredecessorUID>{after}</PredecessorUID><Type>1</Type></PredecessorLink>" if after else ""
    begins = f"<Start>{start}</Start>" if start else ""
    return (
        f"<Task><UID>{number}</UID><ID>{number}</ID><Name>{escape(name)}</Name><OutlineLevel>{level}</OutlineLevel>"
        f"{begins}{link}{more}</Task>"
    )


def project(*tasks: str) -> bytes:
    inside = "".join(tasks)
    return f'<Project xmlns="http://schemas.microsoft.com/project"><Tasks>{inside}</Tasks></Project>'.encode()


def read(*tasks: str) -> Programme:
    return read_programme(project(*tasks), "site.xml", Path("a.site.toml"))


def test_a_part_has_the_task_of_its_id_then_of_its_name_then_of_its_storey_and_class():
    notes = f"<Notes>the wall {WALL_ID}, cast elsewhere</Notes>"
    programme = read(
        task(1, "Level 1", level=1),
        task(2, "Walls", start="2026-03-09T07:00:00"),
        task(3, "Column A", start="2026-03-10T07:00:00"),
        task(4, "special", start="2026-03-11T07:00:00", more=notes),
        task(5, "Level 10", level=1),
        task(6, "Walls", start="2026-03-12T07:00:00"),
    )
    storey, id_ = "Level 1", "1" * 22
    assert programme.task_of(Part(WALL_ID, "W1", storey, "IfcWall")).name == "special"
    assert programme.task_of(Part(id_, "column a", storey, "IfcColumn")).name == "Column A"
    assert programme.task_of(Part(id_, "W2", storey, "IfcWallStandardCase")).rank < programme.tasks[-1].rank
    assert programme.task_of(Part(id_, "W3", "Level 10", "IfcWall")) == programme.tasks[-1]
    assert programme.task_of(Part(id_, "S1", storey, "IfcSlab")) is None
    assert [one.name for one in programme.tasks] == ["Walls", "Column A", "special", "Walls"]
    told = programme.notes_about([Part(WALL_ID, "W1", storey, "IfcWall"), Part(id_, "S1", storey, "IfcSlab")])
    assert told[0].startswith("programme site.xml: 1 of 2 parts have one of its tasks")
    assert (
        told[1] == "programme site.xml: tasks that match no part: Level 1 / Walls, Level 1 / Column A, Level 10 / Walls"
    )


def test_links_go_before_dates_and_circles_are_named():
    late = read(task(1, "a", start="2026-03-12", after="2"), task(2, "b", start="2026-03-20"))
    assert [one.rank for one in late.tasks] == [1, 0]
    circle = read(task(1, "a", after="2"), task(2, "b", after="1"))
    assert len(circle.notes) == 1
    assert circle.notes[0].endswith("tasks that wait for each other in a circle, treated as parallel: a, b")


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"PK\x03\x04",
        b"<Project/>",
        b"<html><Tasks><Task/></Tasks></html>",
        "é".encode("latin-1"),
        b'<!DOCTYPE p [<!ENTITY a "b">]>' + project(task(1, "&a;")),
    ],
)
def test_what_is_not_a_programme_is_refused_by_name(data):
    with pytest.raises(ConfigError, match=r"sequence\.programme: site\.xml: ") as caught:
        read_programme(data, "site.xml", Path("a.site.toml"))
    assert "Microsoft Project XML" in caught.value.hint


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (project(task(1, "a"), "\n", task(2, "b"))[:-40], "line 2: it was cut off"),
        (b"<Project>\n<Tasks>\n<Task></Tasks></Project>", "line 3: not XML"),
        (b"<Project>\n\xff</Project>", "line 2: not UTF-8"),
        (project(task(1, "a", start="soon")), r"task 'a': Start: 'soon' is not a date"),
    ],
)
def test_a_damaged_file_is_refused_with_its_line(data, told):
    with pytest.raises(ConfigError, match=rf"^site\.xml: {told}"):
        read_programme(data, "site.xml", None)


def test_tasks_have_their_dates():
    (found,) = read(task(1, "a", start="2026-03-12T07:00:00", more="<Finish>2026-03-12T16:00:00</Finish>")).tasks
    assert (found.start, found.finish) == (datetime(2026, 3, 12, 7), datetime(2026, 3, 12, 16))
