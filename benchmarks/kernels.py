"""Compares our reading of IFC files with the default geometry kernel: time, and equality of the cells.

``python -m benchmarks.kernels FILES``: for each file, from its bytes to the grid in memory,

- ``ours``: the fast library, then the default one if it fails; shared shapes are meshed once, in separate processes,
  whose start counts;
- ``loop``: ``ifcopenshell.geom.create_shape`` with the default kernel for each product, in this process;
- ``iterator``: ``ifcopenshell.geom.iterator`` with the default kernel and one thread, which shares shapes too.

The rest (opening, properties, roles, voxelizing) is the same code each time. A part is ``different`` if its cells at
the default cell size are not exactly those of ``loop``. Modules and kernels are loaded before the clock starts. CPU
time counts all processes; unlike wall time, it does not depend on other load on the machine.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import multiprocessing
import resource
import statistics
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

_WARM_UP = Path(__file__).parents[1] / "sample_models" / "frame.ifc"
_PROCESSES = multiprocessing.get_context("forkserver")
WAYS = ("ours", "loop", "iterator")


class DefaultKernel:
    """Replaces our geometry processes: the default kernel, one thread, in this process.

    Args:
        path: The IFC file.
        way: ``loop`` or ``iterator``.
    """

    def __init__(self, path: Path, way: str) -> None:
        self._path = path
        self._way = way

    def mesh(self, groups: Sequence[tuple[int, ...]], on_done: Callable[[int], None], **_choices: object) -> Any:
        """Mesh all products."""
        import ifcopenshell.geom
        import numpy as np

        from bimvox.bim.ifc.answer import PlacedShape, clean_shape
        from bimvox.bim.ifc.geometry import Meshed
        from bimvox.bim.ifc.worker import geometry_settings

        file, settings = ifcopenshell.open(self._path), geometry_settings()
        products = [file.by_id(step_id) for group in groups for step_id in group]
        shapes, failures = {}, {}
        made: Iterable[Any]
        if self._way == "iterator":
            iterator = ifcopenshell.geom.iterator(settings, file, 1, include=products)
            made = ((shape.id, shape) for shape in iterator)
        else:
            made = ((product.id(), _created(settings, product)) for product in products)
        for step_id, shape in made:
            clean: Any = "no geometry"
            if shape is not None:
                faces = np.array(shape.geometry.faces, dtype=np.int32).reshape(-1, 3)
                clean = clean_shape(np.array(shape.geometry.verts, dtype=np.float64).reshape(-1, 3), faces)
            if isinstance(clean, str):
                failures[step_id] = clean
            else:
                placement = np.array(shape.transformation.matrix, dtype=np.float64).reshape(4, 4).T
                shapes[step_id] = PlacedShape(clean, placement)
        for product in products:
            if product.id() not in shapes:
                failures.setdefault(product.id(), "no geometry")
        return Meshed(shapes, failures, ())


def _created(settings: Any, product: Any) -> Any:
    import ifcopenshell.geom

    try:
        return ifcopenshell.geom.create_shape(settings, product)
    except RuntimeError:
        return None


def main() -> int:
    """Measure all files and print the table."""
    options = _options()
    _PROCESSES.set_forkserver_preload(["benchmarks.loaded"])
    files = [path for given in options.files for path in (sorted(given.glob("*.ifc")) if given.is_dir() else [given])]
    columns = ("file", "parts", "cell, m", *(f"{way}, s" for way in WAYS), "than loop", "than iterator")
    columns += ("CPU s of " + ", ".join(WAYS), "of it reading", "missing", "different parts (cells)")
    print("| " + " | ".join(columns) + " |\n|" + "---|" * len(columns))
    rows = []
    for path in files:
        row: dict[str, Any] = {"file": path.name}
        for way in WAYS:
            row[way] = _in_a_process(path, way, options)
        rows.append(row)
        print(_line(row), flush=True)
        if options.json:
            with options.json.open("a") as stream:
                stream.write(json.dumps(row) + "\n")
    print("\n" + summary(rows))
    return 0


def _in_a_process(path: Path, way: str, options: argparse.Namespace) -> dict[str, Any]:
    here, there = _PROCESSES.Pipe(duplex=False)
    process = _PROCESSES.Process(target=_measure, args=(path, way, options.processes, there))
    process.start()
    there.close()
    found: dict[str, Any] = {"why": f"not done after {options.timeout:g} s"}
    if here.poll(options.timeout):
        try:
            found = here.recv()
        except EOFError:
            found["why"] = "crashed"
    process.kill()
    process.join()
    return found


def _measure(path: Path, way: str, processes: int | None, there: Any) -> None:
    """Measure one file by one method and send the result, with a digest of the cells of each part."""
    import numpy as np

    from bimvox.errors import BimvoxError
    from bimvox.voxelization.building import voxelize_building
    from bimvox.voxelization.lattice import default_voxel_size_m
    from bimvox.voxelization.part import voxelize_mesh

    voxelize_building(_read(_WARM_UP, way, processes), 0.1)
    found: dict[str, Any] = {}
    try:
        wall_s, cpu_s = time.perf_counter(), _cpu_s()
        building = _read(path, way, processes)
        found["read_cpu_s"] = _cpu_s() - cpu_s
        size_m = default_voxel_size_m(building.bounds_m)
        voxelize_building(building, size_m)
        found["wall_s"], found["cpu_s"] = time.perf_counter() - wall_s, _cpu_s() - cpu_s
    except BimvoxError as error:
        there.send({"why": str(error).splitlines()[0]})
        return
    found["voxel_size_m"] = size_m
    found["cells"] = {}
    for element in building.elements:
        voxels = voxelize_mesh(element.mesh, size_m, np.zeros(3))
        cells = np.argwhere(voxels.cells) + voxels.low
        found["cells"][element.id] = (len(cells), hashlib.sha256(cells.astype(np.int64).tobytes()).hexdigest()[:16])
    there.send(found)


def _read(path: Path, way: str, processes: int | None) -> Any:
    """Read a building by one of the methods."""
    from bimvox.bim.ifc.reader import read_ifc
    from bimvox.bim.options import ReadOptions, default_processes
    from bimvox.bim.read import read_building

    options = ReadOptions(processes=processes or default_processes())
    if way == "ours":
        return read_building(path, options)
    return read_ifc(path, path.read_bytes(), "", options, lambda *_: None, DefaultKernel(path, way))  # type: ignore[arg-type]


def _cpu_s() -> float:
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def _line(row: dict[str, Any]) -> str:
    ours = row["ours"]
    if "wall_s" not in ours:
        return f"| {row['file']} | {ours['why']} |"
    times = [f"{row[way]['wall_s']:.2f}" if "wall_s" in row[way] else row[way]["why"] for way in WAYS]
    ratios = [f"{_ratio(row, way):.1f}x" if "wall_s" in row[way] else "-" for way in WAYS[1:]]
    cpu = [f"{row[way]['cpu_s']:.2f}" if "wall_s" in row[way] else "-" for way in WAYS]
    reading = [f"{row[way]['read_cpu_s']:.2f}" if "wall_s" in row[way] else "-" for way in WAYS]
    missing, different = differences(row)
    cells = sum(abs(one - other) or 1 for one, other in different)
    words = (row["file"], len(ours["cells"]), f"{ours['voxel_size_m']:g}", *times, *ratios, ", ".join(cpu))
    words += (", ".join(reading), missing, f"{len(different)} ({cells})")
    return "| " + " | ".join(map(str, words)) + " |"


def _ratio(row: dict[str, Any], way: str, key: str = "wall_s") -> float:
    return float(row[way][key] / row["ours"][key])


def differences(row: dict[str, Any]) -> tuple[int, list[tuple[int, int]]]:
    """Return the number of parts that we miss, and (our cells, their cells) of each different part."""
    ours, theirs = row["ours"]["cells"], row["loop"].get("cells", {})
    missing = len(set(theirs) - set(ours))
    return missing, [(ours[key][0], theirs[key][0]) for key in theirs if key in ours and ours[key] != theirs[key]]


def summary(rows: list[dict[str, Any]]) -> str:
    """Return, for each other way, how much longer it takes and how many parts have the same cells."""
    lines = []
    for way in WAYS[1:]:
        both = [row for row in rows if "wall_s" in row["ours"] and "wall_s" in row[way]]
        if not both:
            continue
        told = []
        for name, key in (("wall", "wall_s"), ("CPU", "cpu_s")):
            ratios = sorted(_ratio(row, way, key) for row in both)
            total = sum(row[way][key] for row in both) / sum(row["ours"][key] for row in both)
            told.append(f"{name} time median {statistics.median(ratios):.1f}x, of the sum {total:.1f}x")
            told[-1] += f" ({ratios[0]:.1f} to {ratios[-1]:.1f})"
        lines.append(f"Faster than the {way}, {len(both)} files: {'; '.join(told)}.")
    found = [differences(row) for row in rows if "cells" in row["ours"] and "cells" in row["loop"]]
    parts = sum(len(row["loop"]["cells"]) for row in rows if "cells" in row["ours"] and "cells" in row["loop"])
    different = sum(len(pairs) for _, pairs in found)
    missing = sum(count for count, _ in found)
    lines.append(f"Parts with exactly the same cells: {parts - different - missing:,} of {parts:,}; {missing} missing.")
    return "\n".join(lines)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", type=Path, nargs="+", help="IFC files, or folders of them")
    parser.add_argument("--processes", type=int, help="processes of ours; default: as `bimvox voxelize`")
    parser.add_argument("--timeout", type=float, default=600.0, metavar="S", help="seconds per file and method")
    parser.add_argument("--json", type=Path, metavar="OUT", help="append a JSON object per file, one a line")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
