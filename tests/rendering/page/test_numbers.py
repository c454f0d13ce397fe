"""Every number that a page shows is that of its log, to the digit shown."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from bimvox_pipeline.plan import plan
from bimvox_pipeline.render.render import render
from bimvox_pipeline.site import init
from logged_numbers import Logged
from number_words import fixed
from shown_numbers import differences, opened

from bimvox.library.arguments import PolicyWish
from bimvox.progress import SilentProgress

pytestmark = pytest.mark.browser

SAMPLES = Path(__file__).parents[3] / "sample_models"
QUIET = SilentProgress()
NOT_LIFTED = """
[[component]]
global_id = "2DCyp727nJGAwnDN3Ewetp"
means = "in_situ"

[[component]]
global_id = "3TX3rigLTRyACOSN8nvwEz"
means = "by_hand"
"""
WRONG = """() => {
  const { plan, header, details } = window.page;
  plan.timed[0].governs.load_kg += 10;
  plan.revision.ends_s += 60;
  header.render();
  details.renderPlan();
}"""
TRUCK = """{"version": 1, "obstructions": [{"id": "truck-7", "box": {"min": [-0.2, 2, 3], "max": [0.6, 4, 3.8]}}]}"""


def frame(folder: Path) -> Path:
    """Plan a frame with dates, deliveries that the crane unloads, an obstruction, and parts that are not lifted."""
    site = folder / "frame.site.toml"
    model = Path(shutil.copy(SAMPLES / "frame.ifc", folder))
    init(model, site, voxel_size_m=0.5, progress=QUIET)
    text = (
        site.read_text().replace("# access = ", "access = ", 1).replace("# [calendar]\n# start", "[calendar]\nstart", 1)
    )
    site.write_text(text + NOT_LIFTED)
    (folder / "truck.json").write_text(TRUCK)
    log = folder / "frame.mcap"
    plan(site, log, obstructions=folder / "truck.json", wish=PolicyWish("none"), progress=QUIET)
    return log


def hall(folder: Path) -> Path:
    """Plan a hall with two cranes."""
    shutil.copy(SAMPLES / "hall.ifc", folder)
    site = folder / "hall.site.toml"
    site.write_text((SAMPLES / "hall.site.toml").read_text().replace("voxel_size_m = 0.2", "voxel_size_m = 0.4"))
    plan(site, folder / "hall.mcap", wish=PolicyWish("none"), progress=QUIET)
    return folder / "hall.mcap"


def containers(folder: Path) -> Path:
    """Plan a mesh without a crane, at cells that are not whole centimetres."""
    shutil.copy(SAMPLES / "yard.glb", folder)
    site = folder / "yard.site.toml"
    text = (SAMPLES / "yard.site.toml").read_text().replace("voxel_size_m = 0.25", "voxel_size_m = 0.375")
    site.write_text(text + '\n[crane]\nkind = "none"\n')
    plan(site, folder / "yard.mcap", wish=PolicyWish("none"), progress=QUIET)
    return folder / "yard.mcap"


def page_of(log: Path) -> Path:
    page = log.with_suffix(".html")
    render(log, page, progress=QUIET)
    return page


@pytest.mark.parametrize("planned", [frame, hall, containers])
def test_every_number_is_that_of_the_log(browser, tmp_path, planned):
    log = planned(tmp_path)
    seen = opened(browser, page_of(log))
    found = differences(seen, Logged(log))
    assert found.found == []
    assert found.numbers > 200
    assert seen.complaints == []
    seen.page.context.close()


def test_a_number_that_differs_is_found(browser, tmp_path):
    log = frame(tmp_path)
    seen = opened(browser, page_of(log))
    seen.page.evaluate(
        "() => { window.page.plan.timed[0].governs.load_kg += 10; "
        "window.page.plan.revision.time.hours_in_words = '1.0 crane hours'; }"
    )
    seen.page.evaluate("() => { window.page.header.render(); window.page.details.renderPlan(); }")
    found = differences(seen, Logged(log))
    first = seen.page.evaluate("() => window.page.plan.timed[0].number")
    assert [line.split(":")[0] for line in found.found] == [
        "header",
        f"card of lift {first}, On the hook",
        "plan, Work",
    ]
    seen.page.context.close()


def test_halves_go_away_from_zero_and_zero_has_no_sign():
    assert [fixed(value, 1) for value in (0.25, 0.35, -0.04, 1234.5)] == ["0.3", "0.4", "0.0", "1,234.5"]
