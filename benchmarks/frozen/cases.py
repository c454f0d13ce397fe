"""The cases: each runs the program and returns the record of the files that it wrote."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path

from benchmarks.frozen.digest import WHOLE, Digest, digest_of, digest_of_document, digest_of_text
from benchmarks.frozen.record import Recorded
from benchmarks.frozen.watched import simulated, watched
from benchmarks.frozen.workshop import MODELS, Workshop

Case = Callable[[Workshop], Recorded]


def cases() -> dict[str, Case]:
    """Return all cases by name, in the order of execution."""
    return {
        **{f"init-{name}": partial(_init, name=name) for name in MODELS},
        **{f"voxelize-{name}": partial(_voxelize, name=name) for name in MODELS},
        **{f"search-{name}": partial(_planned, name=name, search=True) for name in MODELS},
        **{f"policy-{name}": partial(_planned, name=name, search=False) for name in MODELS},
        "watch-frame": partial(watched, name="frame", search=True),
        "watch-hall": partial(watched, name="hall", search=True),
        "watch-yard-policy": partial(watched, name="yard", search=False),
        "simulated-frame": partial(simulated, name="frame"),
        "simulated-hall": partial(simulated, name="hall"),
        "experiment": _experiment,
        "export-log": _exported,
        "export-grid": _exported_grid,
        "render": _rendered,
        "report": _reported,
    }


def files_of(folder: Path, *names: str) -> Recorded:
    """Return the record of files in a folder."""
    return {name: digest_of(folder / name, name) for name in names}


def _init(workshop: Workshop, name: str) -> Recorded:
    return files_of(workshop.begun(name), f"{name}.site.toml")


def _voxelize(workshop: Workshop, name: str) -> Recorded:
    folder, grid = workshop.copy_of(workshop.site(name), f"voxelize-{name}"), f"{name}.zarr.zip"
    (document,) = workshop.documents(folder, "voxelize", MODELS[name], "-o", grid)
    return files_of(folder, grid) | {"--json": digest_of_document(document)}


def _planned(workshop: Workshop, name: str, search: bool) -> Recorded:
    folder = workshop.planned(name, search=search)
    document = json.loads((folder / f"{name}.plan.json").read_text())
    return files_of(folder, f"{name}.mcap") | {"--json": digest_of_document(document)}


def _experiment(workshop: Workshop) -> Recorded:
    """Run the experiment with tiny budgets, one seed and both modes. Times are omitted, see ``digest``."""
    folder = workshop.fresh("experiment")
    workshop.run(folder, "experiment", "paper", "--quick", "--seeds", "1", "--jobs", "2", "-o", "out", "-q")
    return {name: _of_experiment(folder / "out" / name) for name in _names_in(folder / "out")}


def _of_experiment(path: Path) -> Digest:
    if path.name == "report.md":
        return digest_of_text(path.read_text())
    if path.suffix == ".json":
        whole = digest_of_document(json.loads(path.read_text()))
        return {WHOLE: whole[WHOLE]} if path.parent.name == "jobs" else whole
    return digest_of(path, path.name)


def _exported(workshop: Workshop) -> Recorded:
    folder = workshop.copy_of(workshop.planned("frame", search=True), "export-log")
    out = workshop.fresh("export-log/out")
    start = ("--start", "2026-03-02T07:00")
    for file, options in {
        "one.mcap": ("mcap", "--lift", "4"),
        "all.csv": ("csv",),
        "all.json": ("json",),
        "all.glb": ("glb",),
        "all.ros2": ("ros2",),
        "all.layout.json": ("layout",),
        "all.ifc": ("ifc", "--model", "frame.ifc", *start),
        "all.xml": ("msproject", *start),
    }.items():
        workshop.run(folder, "export", "frame.mcap", "--to", *options, "-o", str(Path("out") / file), "-q")
    return files_of(out, *_names_in(out))


def _exported_grid(workshop: Workshop) -> Recorded:
    folder = workshop.copy_of(workshop.site("frame"), "export-grid")
    workshop.run(folder, "voxelize", "frame.ifc", "-o", "frame.zarr.zip", "-q")
    files = [f"frame.{form}" for form in ("vti", "ply", "glb")]
    for file in files:
        workshop.run(folder, "export", "frame.zarr.zip", "--to", Path(file).suffix[1:], "-o", file, "-q")
    return files_of(folder, *files)


def _rendered(workshop: Workshop) -> Recorded:
    """Render pictures, an animation and the page, also for two cranes."""
    frame = workshop.copy_of(workshop.planned("frame", search=True), "render-frame")
    hall = workshop.copy_of(workshop.planned("hall", search=True), "render-hall")
    for file, options in {
        "frame.png": (),
        "lift.png": ("--lift", "4", "--size", "640x400"),
        "frame.gif": ("--seconds", "2", "--size", "160x100"),
        "frame.html": (),
    }.items():
        workshop.run(frame, "render", "frame.mcap", "-o", file, *options, "-q")
    workshop.run(frame, "render", "frame.site.toml", "-o", "site.png", "-q")
    for file in ("hall.png", "hall.html"):
        workshop.run(hall, "render", "hall.mcap", "-o", file, "-q")
    found = files_of(frame, "frame.png", "lift.png", "frame.gif", "frame.html", "site.png")
    return found | files_of(hall, "hall.png", "hall.html")


def _reported(workshop: Workshop) -> Recorded:
    recorded: Recorded = {}
    for name in ("frame", "hall"):
        folder = workshop.copy_of(workshop.planned(name, search=True), f"report-{name}")
        out = workshop.fresh(f"report-{name}/out")
        workshop.run(folder, "report", f"{name}.mcap", "-o", f"out/{name}.html", "--figures", "out/figures", "-q")
        recorded |= {f"{name}: {file}": digest_of(out / file, file) for file in _names_in(out)}
    return recorded


def _names_in(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())
