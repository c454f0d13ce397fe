"""Writes every sample model: ``python -m sample_models.write [--out DIR]``."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from pathlib import Path

from bimvox_pipeline import demo

from sample_models import frame, hall, paper, prefab, yard

FILES: Mapping[str, Callable[[], bytes]] = {
    "paper.ifc": paper.paper_ifc,
    "frame.ifc": frame.frame_ifc,
    "frame_ifc2x3_mm.ifc": frame.frame_ifc2x3_mm,
    "frame_georeferenced.ifc": frame.frame_georeferenced,
    "hall.ifc": hall.hall_ifc,
    "prefab.ifc": prefab.prefab_ifc,
    "yard.glb": yard.yard_glb,
    "yard.stl": yard.yard_stl,
}
"""File name to the function that returns its bytes."""


def write_all(out: Path) -> list[Path]:
    """Write every sample model into a folder, created if necessary, and return their paths."""
    out.mkdir(parents=True, exist_ok=True)
    paths = []
    for name, content in FILES.items():
        path = out / name
        path.write_bytes(content())
        paths.append(path)
    return paths


def main() -> None:
    """Write the files and print their paths."""
    parser = argparse.ArgumentParser(prog="python -m sample_models.write", description="Write the sample models.")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent, help="folder to write to (default: here)")
    out = parser.parse_args().out
    for path in write_all(out):
        print(f"{path.name}  {path.stat().st_size:,} bytes")
    if out == Path(__file__).parent:
        (Path(demo.__file__).parent / demo.SAMPLE).write_bytes(FILES[demo.SAMPLE]())


if __name__ == "__main__":
    main()
