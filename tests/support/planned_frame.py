"""The sample frame at coarse cells, planned: the site file and log that tests read when any good plan will do.

It is planned when a process of the tests first needs it, in 0.3 s of processor time.
"""

from __future__ import annotations

import re
import shutil
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from bimvox_pipeline.plan import plan
from bimvox_pipeline.site import init

from bimvox.library.arguments import PolicyWish
from bimvox.progress import SilentProgress

MODEL = Path(__file__).parents[2] / "sample_models" / "frame.ifc"
FILES = ("frame.site.toml", "frame.mcap")
_SCRATCH = TemporaryDirectory(prefix="bimvox-planned-frame-")  # removed when the process ends


def write_site(folder: Path) -> Path:
    """Write the model and its site file to a folder, and return the site file."""
    model, site = folder / MODEL.name, folder / FILES[0]
    shutil.copy(MODEL, model)
    init(model, site, voxel_size_m=0.5, crane="hammerhead-30", full=True, progress=SilentProgress())
    # Its longest jib, and 1 m more rope: the tests of stops look for loads that swing.
    text = site.read_text(encoding="utf-8").replace("jib_length_m = 18", "jib_length_m = 30")
    text = text.replace("jib_height_m = 15", "jib_height_m = 16")
    # Where those tests know its loads: without gaps and stacks, for one delivery, in the greedy order.
    text = re.sub(r"(?m)^\[yard\]\n(?:.+\n)+", "", text).replace("truckload_kg = 24000", "truckload_kg = 0")
    text = re.sub(r"(?m)^yard = .*$", "yard = [[[-1.5, -11], [8, -11], [8, -2], [-1.5, -2]]]", text)
    text = re.sub(r"(?m)^access = .*$", "access = [[[-6, -5], [-2, -5], [-2, 11.5], [-6, 11.5]]]", text)
    text = re.sub(r"(?m)^base_m = \[.*?\]", "base_m = [-4, -4, 0]", text)
    text = text.replace("search = true", "search = false")
    text = re.sub(r"(?m)^start = 2024-.*$", "", text)  # on the plan's own clock
    site.write_text(text, encoding="utf-8")
    return site


def plan_it(site: Path, wish: PolicyWish) -> dict[str, Any]:
    """Plan the site next to its file, and return the document of the plan."""
    return plan(site, site.with_name(FILES[1]), wish=wish, progress=SilentProgress())


@cache
def planned() -> Path:
    """Return a folder with the model, its site file and its log, planned with the policy that ships."""
    folder = Path(_SCRATCH.name)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("BIMVOX_POLICIES", str(folder / "policies"))
        plan_it(write_site(folder), PolicyWish("default"))
    return folder


def copy_to(folder: Path) -> Path:
    """Copy the model, its site file and its log to a folder, and return it."""
    for name in (MODEL.name, *FILES):
        shutil.copy(planned() / name, folder / name)
    return folder
