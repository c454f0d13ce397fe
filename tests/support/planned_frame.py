"""The sample frame at coarse cells, planned: the site file and log that tests read when any good plan will do.

They are checked in, so that no test waits for them. When the bytes of logs or site files change, make them again::

    python -m tests.support.planned_frame
"""

from __future__ import annotations

import shutil
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from bimvox_pipeline.plan import plan
from bimvox_pipeline.site import init

from bimvox.library.policy_wish import PolicyWish
from bimvox.progress import SilentProgress

MODEL = Path(__file__).parents[2] / "sample_models" / "frame.ifc"
FOLDER = Path(__file__).parents[1] / "planned_frame"
FILES = ("frame.site.toml", "frame.mcap")


def write_site(folder: Path) -> Path:
    """Write the model and its site file to a folder, and return the site file."""
    model, site = folder / MODEL.name, folder / FILES[0]
    shutil.copy(MODEL, model)
    init(model, site, voxel_size_m=0.5, crane="hammerhead-30", progress=SilentProgress())
    # Its longest jib, and 1 m more rope: the tests of stops look for loads that swing.
    text = site.read_text(encoding="utf-8").replace("jib_length_m = 18", "jib_length_m = 30")
    site.write_text(text.replace("jib_height_m = 15", "jib_height_m = 16"), encoding="utf-8")
    return site


def plan_it(site: Path, wish: PolicyWish) -> dict[str, Any]:
    """Plan the site next to its file, and return the document of the plan."""
    return plan(site, site.with_name(FILES[1]), wish=wish, progress=SilentProgress())


def copy_to(folder: Path) -> Path:
    """Copy the model and the checked-in files to a folder, and return it."""
    for file in (MODEL, *(FOLDER / name for name in FILES)):
        shutil.copy(file, folder / file.name)
    return folder


def make(folder: Path) -> None:
    """Make the checked-in files in an empty folder, with the policy that ships."""
    plan_it(write_site(folder), PolicyWish("default"))


if __name__ == "__main__":
    with TemporaryDirectory() as scratch:
        make(Path(scratch))
        for name in FILES:
            shutil.copy(Path(scratch, name), FOLDER / name)
