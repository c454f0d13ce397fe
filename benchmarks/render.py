"""Measures pictures and animations of a large plan, as a Markdown table.

    python benchmarks/render.py
    python benchmarks/render.py --log LOG.mcap

With ``--log`` also the size of its page, and the time from opening the page to its first frame in a headless Chromium
that renders in software (``BIMVOX_BROWSER`` names another browser; ``make test-page`` installs its driver).

500 parts on 200 x 200 x 60 cells of 0.25 m: columns, beams and slabs of a building, a yard, an obstruction and a crane.
The first picture is measured in a new process, with imports and kernels from the cache (compiled if it is empty); the
others are the best of three. CPU time counts all threads; wall time is that of this machine.
"""

from __future__ import annotations

import argparse
import io
import os
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from bimvox.records.lift import Lift
    from bimvox.records.motion import LiftMotion
    from bimvox.records.track import LoadTrack
    from bimvox.site.component import IntVec
    from bimvox.site.site import Site

BOUND_S = 5.0
"""Time limit for one picture."""
PAGE_BYTES, FIRST_FRAME_S = 4_000_000, 6.0
"""Limits for a page of 500 parts: its size, and the time to its first frame."""
SHAPE, PARTS, CELL_M = (200, 200, 60), 500, 0.25
_ROUNDS = 3
_FRAMES = 20


def large_plan() -> tuple[Site, list[Lift], tuple[LiftMotion, ...], list[LoadTrack]]:
    """Return site, lifts and tracks of ``PARTS`` parts: bays of four columns, beams and a slab, five storeys."""
    from bimvox.bim.building import TriangleMesh
    from bimvox.crane.load_chart import LoadChart
    from bimvox.crane.tower_crane import AxisLimits, TowerCrane
    from bimvox.grid.frame import GridFrame, Label
    from bimvox.log.track import nominal_track
    from bimvox.records.lift import Lift, Method, Status, YardPlace
    from bimvox.site.component import Component, StoredPose, shape_of
    from bimvox.site.site import Blocker, Rules, Site

    frame = GridFrame((0.0, 0.0, -CELL_M), CELL_M)
    labels = np.zeros(SHAPE, np.uint8)
    labels[:, :, 0] = Label.GROUND
    labels[60:190, 60:190, 0] = Label.CONSTRUCTION_AREA
    yard = np.zeros(SHAPE[:2], np.bool_)
    yard[5:55, 5:195] = True
    silo = _box((100, 30, 1), (112, 42, 25))
    labels[tuple(silo.T)] = Label.OBSTRUCTION
    corner = TriangleMesh(np.eye(4, 3), np.array([[2, 1, 0], [0, 1, 3], [1, 2, 3], [2, 0, 3]], np.int32))
    components, lifts, tracks, clock_ns = [], [], [], 0
    for n, (low, high) in enumerate(_parts()):
        shape, target = shape_of(_box(low, high))
        components.append(
            Component(n, f"part-{n}", f"part-{n}", "IfcSlab", f"part {n}", shape, target, corner, 2000.0, (0, 0, 1))
        )
        start = (8 + 14 * (n % 3), 8 + 13 * (n % 14), 1)
        place = YardPlace(n // 40, StoredPose.AS_BUILT, shape, start)
        path = _over(place.transit_start_vox, target, 55)
        lifts.append(Lift(n, n, place, Status.PLANNED, Method.SEARCH, path, len(path) - 1))
    crane = TowerCrane(
        "bench", (14.0, 30.0, 0.0), 2.0, 24.0, 55.0, 3.0, 3.0, 400.0,
        AxisLimits(0.08, 0.005, 0.01), AxisLimits(1.0, 0.3, 0.4), AxisLimits(1.0, 0.4, 0.5),
        LoadChart((3.0, 55.0), (8000.0, 2000.0)),
    )  # fmt: skip
    site = Site(
        name="500 parts",
        frame=frame,
        labels=labels,
        blockers=(Blocker("ground", "ground", _box((0, 0, 0), (200, 200, 1))), Blocker("silo", "obstruction", silo)),
        components=tuple(components),
        cranes=(crane,),
        rules=Rules(),
        yard=yard,
        site_to_ifc=np.eye(4),
    )
    for lift in lifts:
        tracks.append(nominal_track(site, lift, clock_ns))
        clock_ns = tracks[-1].end_ns
    return site, lifts, (), tracks


def plan_of_log(file: Path) -> tuple[Site, Sequence[Lift], Sequence[LiftMotion], Sequence[LoadTrack]]:
    """Return site, lifts, motions and tracks of a log."""
    from bimvox.log.moving import tracks_of
    from bimvox.log.reader import read_log

    log = read_log(file)
    return log.plan.site, log.all_lifts, log.motions, tracks_of(log)


def _parts() -> Iterator[tuple[IntVec, IntVec]]:
    """Return half-open boxes of cells by storey: 25 bays per storey, each with one column, two beams and a slab."""
    for storey in range(5):
        z = 1 + 11 * storey
        for x in range(5):
            for y in range(5):
                at = (62 + 25 * x, 62 + 25 * y)
                yield (*at, z), (at[0] + 2, at[1] + 2, z + 9)
                yield (at[0] + 2, at[1], z + 7), (at[0] + 25, at[1] + 2, z + 9)
                yield (at[0], at[1] + 2, z + 7), (at[0] + 2, at[1] + 25, z + 9)
                yield (*at, z + 9), (at[0] + 25, at[1] + 25, z + 10)


def _box(low: IntVec, high: IntVec) -> NDArray[np.int32]:
    axes = [np.arange(a, b) for a, b in zip(low, high, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3).astype(np.int32)


def _over(start: IntVec, target: IntVec, height: int) -> NDArray[np.int32]:
    at, cells = list(start), [tuple(start)]
    for axis, goal in ((2, height), (1, target[1]), (0, target[0]), (2, target[2])):
        while at[axis] != goal:
            at[axis] += 1 if goal > at[axis] else -1
            cells.append(tuple(at))
    return np.array(cells, np.int32)


def page_of_log(log: Path) -> tuple[int, float]:
    """Return the bytes of a log's page and the seconds to its first frame."""
    import shutil
    import tempfile

    from bimvox_pipeline.render.render import render
    from playwright.sync_api import sync_playwright

    from bimvox.progress import SilentProgress

    browser = os.environ.get("BIMVOX_BROWSER") or shutil.which("chromium") or shutil.which("google-chrome")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        page = Path(folder) / "page.html"
        render(log, page, proven=False, progress=SilentProgress())
        software = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
        chromium = playwright.chromium.launch(executable_path=browser, args=software)
        opened = chromium.new_page(viewport={"width": 1280, "height": 800})
        started = time.perf_counter()
        opened.goto(page.as_uri())
        opened.wait_for_function("document.documentElement.dataset.drawn > 0", timeout=120_000)
        first_s = time.perf_counter() - started
        chromium.close()
        return page.stat().st_size, first_s


def measured(work: Callable[[], object], rounds: int = _ROUNDS) -> tuple[float, float]:
    """Return wall and CPU seconds of the best round."""
    best = (float("inf"), float("inf"))
    for _ in range(rounds):
        wall, cpu = time.perf_counter(), time.process_time()
        work()
        best = min(best, (time.perf_counter() - wall, time.process_time() - cpu))
    return best


def main() -> None:
    """Print the table; the exit code is 1 if a picture exceeds its time limit."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--log", type=Path, help="measure this log instead")
    arguments = parser.parse_args()
    wall, cpu = time.perf_counter(), time.process_time()
    from bimvox.rendering.pictures.film import FilmOptions, frame_times_ns, write_film
    from bimvox.rendering.pictures.film_scene import Film
    from bimvox.rendering.pictures.picture import PictureOptions, png_of
    from bimvox.rendering.pictures.plan import scene_of_plan
    from bimvox.rendering.pictures.site import view_of_site

    site, lifts, motions, tracks = plan_of_log(arguments.log) if arguments.log else large_plan()
    made = (time.perf_counter() - wall, time.process_time() - cpu)
    print(f"{len(lifts)} parts on {' x '.join(map(str, site.shape))} cells, {os.cpu_count()} cores.\n")
    print("| what | wall s | CPU s |\n|---|---|---|")
    view = view_of_site(site)
    options = PictureOptions(view=view)
    film = Film(site, lifts, motions, tracks)
    times = frame_times_ns(tracks, motions, _FRAMES)
    rows = {"imports and the plan": made}

    def picture() -> None:
        png_of(scene_of_plan(site, lifts, motions), options)

    rows["first picture, 1280 x 800"] = measured(picture, 1)
    rows["picture, 1280 x 800"] = measured(picture)
    rows["picture at a time, 1280 x 800"] = measured(lambda: png_of(film.scene(times[_FRAMES // 2]), options))
    for kind in ("gif", "webp"):
        spent = measured(partial(write_film, io.BytesIO(), film, times, FilmOptions(view=view), kind), 1)
        rows[f"frame of a {kind.upper()}, 640 x 400"] = (spent[0] / _FRAMES, spent[1] / _FRAMES)
    for name, spent in rows.items():
        print(f"| {name} | {spent[0]:.2f} | {spent[1]:.2f} |")
    # CPU time is an upper bound for an idle machine; wall time may include other processes.
    slow = [name for name, spent in rows.items() if "picture" in name and spent[1] > BOUND_S]
    print(f"\nA picture may take {BOUND_S:g} s: {'too slow: ' + ', '.join(slow) if slow else 'met'}.")
    if arguments.log:
        size, first_s = page_of_log(arguments.log)
        kept = size <= PAGE_BYTES and first_s <= FIRST_FRAME_S
        print(f"Its page: {size / 1e6:.2f} MB, first frame after {first_s:.1f} s: {'met' if kept else 'not met'}.")
        slow += [] if kept else ["page"]
    raise SystemExit(bool(slow))


if __name__ == "__main__":
    main()
