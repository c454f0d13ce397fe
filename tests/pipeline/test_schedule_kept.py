"""The plan follows the schedule in the model's file as far as geometry permits."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

import pytest
from bimvox_pipeline.plan import plan
from bimvox_pipeline.site import init
from bimvox_pipeline.verify import verify
from bimvox_pipeline.watch.plan import WatchWish
from bimvox_pipeline.watch.watch import watch
from xer_files import xer_text

from bimvox.bim.building import Role
from bimvox.bim.read import read_building
from bimvox.errors import ConfigError, FileError, InputError
from bimvox.exporters.ifc import with_schedule
from bimvox.exporters.lift_schedule import LiftSchedule, LiftTask
from bimvox.exporters.ms_project import to_ms_project
from bimvox.library.arguments import PolicyWish
from bimvox.library.attached_files import compare_config
from bimvox.library.site import load_site
from bimvox.log.reader import read_log
from bimvox.planning.order_search import prepare
from bimvox.progress import SilentProgress
from bimvox.records.proof import Check
from bimvox.site.config.file import parse_site_config

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
    document = init(model, site_file, progress=SilentProgress())
    assert (document["start"], document["start_why"]) == ("2026-03-02", "the first day of the schedule in the model")
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


def test_a_programme_next_to_the_site_file_is_kept_and_goes_with_the_log(tmp_path):
    """The tasks of a programme decide instead of the model's, and the proof sees them."""
    building = read_building(SAMPLES / "frame.ifc")
    parts = [element for element in building.elements if element.role is Role.COMPONENT]
    columns = [part for part in parts if part.ifc_class == "IfcColumn"][::-1]
    wished = [*columns, next(part for part in parts if part not in columns)]
    tasks = tuple(
        LiftTask(n, part.id, part.global_id, f"set {n}", "", 600.0 * n, 600.0 * (n + 1))
        for n, part in enumerate(wished)
    )
    (tmp_path / "ours.xml").write_bytes(to_ms_project(LiftSchedule("frame", "0" * 64, datetime(2026, 3, 2, 8), tasks)))
    site_file = tmp_path / "frame.site.toml"
    init(SAMPLES / "frame.ifc", site_file, progress=SilentProgress())
    text = site_file.read_text()
    site_file.write_text(f'{text}\n[sequence]\nprogramme = "ours.xml"\n')
    loaded = load_site(site_file, SilentProgress())
    site = loaded.site
    assert any(f"{len(wished)} of {len(site.components)} parts have one of its tasks" in note for note in site.notes)
    sequence = prepare(site).sequence
    order = [site.components[i].id for i in sequence.order]
    ids = [part.id for part in wished]
    assert [name for name in order if name in ids] == ids
    attached = loaded.files["programme.ours.xml"]
    assert attached == (tmp_path / "ours.xml").read_bytes()

    def differences(programme: bytes | None) -> list[str]:
        given = None if programme is None else ("ours.xml", programme)
        config = parse_site_config(loaded.files["site.toml"].decode(), "site.toml", {}, given)
        check = Check("own_files")
        compare_config(check, site, config, "the attached site.toml")
        return list(check.failures)

    assert differences(attached) == []
    assert any("hints.task" in told for told in differences(attached.replace(columns[0].global_id.encode(), b"other")))
    with pytest.raises(ConfigError, match=r"no such file: ours\.xml"):
        differences(None)


@pytest.mark.slow
def test_a_programme_given_to_plan_is_recorded_and_proven(tmp_path):
    """It takes the place of the site file's, goes with the log, and is asked for where files are compared."""
    parts = [part for part in read_building(SAMPLES / "frame.ifc").elements if part.role is Role.COMPONENT]
    columns = [part for part in parts if part.ifc_class == "IfcColumn"][::-1]
    tasks = [
        (str(100 + n), "11", f"set {part.global_id}", f"2026-03-{n + 2:02d} 07:00", f"2026-03-{n + 2:02d} 16:00")
        for n, part in enumerate(columns)
    ]
    given, site_file, log = (tmp_path / name for name in ("ours.xer", "frame.site.toml", "frame.mcap"))
    given.write_text(xer_text(tasks))
    init(SAMPLES / "frame.ifc", site_file, progress=SilentProgress())
    told = SilentProgress()
    made = plan(site_file, log, programme=given, wish=PolicyWish("none"), progress=told)
    assert [lift["global_id"] for lift in made["lifts"]][: len(columns)] == [part.global_id for part in columns]
    assert read_log(log).attachments["programme.ours.xer"] == given.read_bytes()
    assert verify(log, progress=told)["verified"]
    assert verify(log, site=site_file, programme=given, progress=told)["verified"]
    failed = verify(log, site=site_file, progress=told)["checks"]["bound"]
    assert any("hints" in sentence for sentence in failed["failures"])
    other, once = tmp_path / "other.mcap", WatchWish(once=True)
    other.write_bytes(log.read_bytes())
    for out, theirs, event in ((log, given, "unchanged"), (other, None, "planned")):  # the log is not of the site alone
        watched = watch(tmp_path / "none.json", site=site_file, out=out, programme=theirs, how=once, progress=told)
        assert next(watched)["event"] == event
    with pytest.raises(FileError, match="overwrite its own input"):
        next(watch(tmp_path / "none.json", site=site_file, out=given, programme=given, progress=told))
    with pytest.raises(InputError, match="--programme needs --site"):
        verify(log, programme=given, progress=told)
    with pytest.raises(FileError, match="overwrite its own input"):
        plan(site_file, given, programme=given, wish=PolicyWish("none"), progress=told)
