import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from bimvox_pipeline.verify import verify
from bimvox_pipeline.watch.file_watch import changes, state_of
from bimvox_pipeline.watch.log import segment_file
from bimvox_pipeline.watch.plan import WatchWish
from bimvox_pipeline.watch.watch import watch

from bimvox.library.arguments import PolicyWish
from bimvox.log.reader import read_log
from bimvox.progress import SilentProgress
from bimvox.proof.plan import verify_plan


def write(file: Path, *boxes: tuple) -> None:
    obstructions = [{"id": name, "box": {"min": list(low), "max": list(high)}} for name, low, high in boxes]
    file.write_text(json.dumps({"version": 1, "unit": "m", "obstructions": obstructions}))


def once(folder: Path, file: Path) -> list[dict]:
    return list(
        watch(
            file,
            site=folder / "frame.site.toml",
            out=folder / "frame.mcap",
            wish=PolicyWish("default"),
            how=WatchWish(once=True),
            progress=SilentProgress(),
        )
    )


def box_on_path(folder: Path, number: int) -> tuple:
    """Return a box of one cell at two thirds of a lift's path."""
    plan = read_log(folder / "frame.mcap").plan
    lift = plan.lifts[number]
    low = plan.site.frame.corner_of(lift.path_vox[2 * len(lift.path_vox) // 3]) + 0.1
    return ("box", low.tolist(), (low + 0.2).tolist())


def test_the_log_is_of_the_site_file_as_it_is_now(site_folder):
    """What does not change the plan, such as who approves it, is renewed in the log: it is compared with the file."""
    file, site = site_folder / "obstructions.json", site_folder / "frame.site.toml"
    write(file)
    site.write_text(f'{site.read_text()}\n[project]\napproved_by = "the city"\n')
    given = {"site": site, "obstructions": file, "progress": SilentProgress()}
    (failure,) = verify(site_folder / "frame.mcap", **given)["checks"]["bound"]["failures"]
    assert failure == "project.approved_by is nothing in the log, the city in your files"
    assert [event["event"] for event in once(site_folder, file)] == ["unchanged"]
    assert verify(site_folder / "frame.mcap", **given)["verified"]


def test_a_change_keeps_what_is_not_affected_and_replans_the_rest(site_folder):
    file = site_folder / "obstructions.json"
    before = read_log(site_folder / "frame.mcap").plan
    write(file, box_on_path(site_folder, 5))
    (event,) = once(site_folder, file)
    assert event["event"] == "replanned"
    assert event["changed_cells"] > 0
    assert before.site.components[before.lifts[5].component].id in event["replanned"]
    assert event["kept"]
    after = read_log(site_folder / "frame.mcap").plan
    assert verify_plan(after).verified
    for old, new in zip(before.lifts, after.lifts, strict=True):
        if before.site.components[old.component].id in event["kept"]:
            assert (old.path_vox == new.path_vox).all()
    assert read_log(segment_file(site_folder / "frame.mcap", event["revision"])).revision == event["revision"]


def test_the_same_content_changes_nothing(site_folder):
    file = site_folder / "obstructions.json"
    write(file)
    before = (site_folder / "frame.mcap").read_bytes()
    (event,) = once(site_folder, file)
    assert event["event"] == "unchanged"
    assert (site_folder / "frame.mcap").read_bytes() == before


@pytest.mark.parametrize("content", ["", "{", '{"version": 1, "unit": "m", "obstructions": [{"id": "a"}]}', "\0\0"])
def test_content_that_cannot_be_used_changes_nothing(site_folder, content):
    file = site_folder / "obstructions.json"
    file.write_text(content)
    before = (site_folder / "frame.mcap").read_bytes()
    (event,) = once(site_folder, file)
    assert event["event"] == "rejected"
    assert event["message"]
    assert (site_folder / "frame.mcap").read_bytes() == before


def test_revisions_are_never_overwritten(site_folder):
    file = site_folder / "obstructions.json"
    write(file, box_on_path(site_folder, 5))
    first = once(site_folder, file)[0]
    kept = segment_file(site_folder / "frame.mcap", first["revision"]).read_bytes()
    write(file)
    second = once(site_folder, file)[0]
    assert second["revision"] == first["revision"] + 1
    assert segment_file(site_folder / "frame.mcap", first["revision"]).read_bytes() == kept


def collect(file: Path, stop: threading.Event, seen: list) -> threading.Thread:
    def run() -> None:
        seen.extend(state.digest for state in changes(file, tuple, stop, start))

    start = state_of(file)
    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    return thread


def wait_for(seen: list, count: int, limit_s: float = 20.0) -> None:
    deadline = time.monotonic() + limit_s
    while len(seen) < count and time.monotonic() < deadline:
        time.sleep(0.02)
    assert len(seen) >= count


def test_every_way_of_writing_is_noticed_and_a_touch_is_not(tmp_path):
    file = tmp_path / "o.json"
    file.write_text("one")
    stop, seen = threading.Event(), []
    thread = collect(file, stop, seen)
    time.sleep(0.5)
    os.utime(file)
    file.write_text("two")
    wait_for(seen, 1)
    (tmp_path / "new").write_text("three")
    (tmp_path / "new").replace(file)
    wait_for(seen, 2)
    file.unlink()
    wait_for(seen, 3)
    assert seen[2] is None
    file.write_text("four")
    wait_for(seen, 4)
    stop.set()
    thread.join(timeout=10)
    assert not thread.is_alive()
    assert len(set(seen)) == len(seen) == 4


def test_a_link_to_a_file_elsewhere_is_followed(tmp_path):
    (tmp_path / "real").mkdir()
    (tmp_path / "links").mkdir()
    real = tmp_path / "real" / "o.json"
    real.write_text("one")
    link = tmp_path / "links" / "o.json"
    link.symlink_to(real)
    stop, seen = threading.Event(), []
    thread = collect(link, stop, seen)
    time.sleep(0.5)
    real.write_text("two")
    wait_for(seen, 1)
    stop.set()
    thread.join(timeout=10)


def test_a_link_that_leads_to_itself_is_a_missing_file_and_ends_nothing(tmp_path):
    file = tmp_path / "o.json"
    file.write_text("one")
    stop, seen = threading.Event(), []
    thread = collect(file, stop, seen)
    time.sleep(0.5)
    file.unlink()
    file.symlink_to(file)
    wait_for(seen, 1)
    file.unlink()
    file.write_text("two")
    wait_for(seen, 2)
    stop.set()
    thread.join(timeout=10)
    assert (seen[0], seen[-1] is None) == (None, False)


_WATCH = """
import signal, sys
# What a shell starts in the background inherits a deaf ear for Ctrl-C; a terminal's child does not.
signal.signal(signal.SIGINT, signal.default_int_handler)
from bimvox_cli.main import run

sys.exit(run(["watch", *sys.argv[1:]]))
"""


@pytest.mark.slow
@pytest.mark.parametrize("more", [(), pytest.param(("--simulate", "1000", "--retrain", "100"), marks=pytest.mark.slow)])
def test_ctrl_c_ends_a_watch_well(site_folder, more):
    (site_folder / "obstructions.json").write_text('{"version": 1, "unit": "m", "obstructions": []}')
    options = ["--site", "frame.site.toml", "-o", "frame.mcap", "--policy", "default", "--poll", "0.1", "--json", *more]
    process = subprocess.Popen(
        [sys.executable, "-c", _WATCH, "obstructions.json", *options],
        cwd=site_folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert process.stdout is not None
    first = json.loads(process.stdout.readline())
    assert first["event"] == "unchanged"
    write(site_folder / "obstructions.json", box_on_path(site_folder, 5))
    told = first
    while told["event"] not in ("replanned", "continued") or told.get("pending"):
        told = json.loads(process.stdout.readline())
    os.killpg(process.pid, signal.SIGINT)
    rest, said = process.communicate(timeout=120)
    assert process.returncode == 0, said
    assert "Traceback" not in said
    assert all(json.loads(line) for line in rest.splitlines())
    assert read_log(site_folder / "frame.mcap").revision == told["revision"]
    assert verify(site_folder / "frame.mcap", progress=SilentProgress())["verified"]
    assert not list(site_folder.glob(".bimvox-*.part"))
