"""The plan follows the schedule in the model's file as far as geometry permits."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

import pytest
from bimvox_pipeline.site import init

from bimvox.bim.building import Role
from bimvox.bim.read import read_building
from bimvox.exporters.ifc import with_schedule
from bimvox.exporters.lift_schedule import LiftSchedule, LiftTask
from bimvox.library.site import load_site
from bimvox.planning.assembly import prepare
from bimvox.progress import SilentProgress

SAMPLES = Path(__file__).parents[2] / "sample_models"


@pytest.mark.parametrize("sample", ["frame.ifc", "frame_ifc2x3_mm.ifc"])
def test_parts_come_as_the_tasks_of_the_file_say(tmp_path, sample):
    source = SAMPLES / sample
    building = read_building(source)
    parts = [element for element in building.elements if element.role is Role.COMPONENT]
    columns = [part for part in parts if part.ifc_class == "IfcColumn"][::-1]
    others = [part for part in parts if part.ifc_class != "IfcColumn"][::-1]
    wished = [others[0], *columns, *others[1:]]  # the first of them is not supported yet
    tasks = tuple(
        LiftTask(n, part.id, part.global_id, f"set {n}", "", 600.0 * n, 600.0 * (n + 1))
        for n, part in enumerate(wished)
    )
    schedule = LiftSchedule("frame", "0" * 64, datetime(2026, 3, 2, 8, 0), tasks)
    model = tmp_path / "frame.ifc"
    model.write_bytes(with_schedule(source, source.read_bytes(), schedule))
    site_file = tmp_path / "frame.site.toml"
    init(model, site_file, progress=SilentProgress())
    site = load_site(site_file, SilentProgress()).site
    sequence = prepare(site).sequence
    order = [site.components[i].id for i in sequence.order]
    ranks = [[part.id for part in wished].index(name) for name in order]
    moved = ranks.index(0)
    assert moved > 0
    told = [note for note in sequence.notes if "against the schedule" in note]
    assert len(told) == len(set(told)) == moved
    rest = ranks[moved + 1 :]
    assert rest == sorted(rest)
