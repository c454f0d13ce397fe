"""Very many obstructions, from the file to the proof: they share objects, and messages name only some of them."""

import json

import numpy as np
import pytest
from bimvox_pipeline.plan import plan
from bimvox_pipeline.verify import verify
from mesh_samples import box

from bimvox.errors import NoPlanError
from bimvox.library.arguments import PolicyWish
from bimvox.log.reader import read_log
from bimvox.progress import SilentProgress
from bimvox.site.obstructions import many


def boxes_in(low, high, count):
    corners = np.random.default_rng(0).uniform(low, np.array(high) - 0.2, (count, 3)).round(3)
    return [
        {"id": f"box-{n:02}", "box": {"min": c.tolist(), "max": (c + 0.15).tolist()}} for n, c in enumerate(corners)
    ]


def test_a_crowd_of_obstructions_is_planned_and_proven(site_folder, monkeypatch):
    monkeypatch.setattr(many, "MOST_SINGLE", 5)
    site = read_log(site_folder / "frame.mcap").plan.site
    part = site.components[0]
    low = site.frame.corner_of(part.target_vox)
    box((0.6, 1.0, 1.0), (-3.6, 6.0, 0.0)).export(site_folder / "crate.stl")
    entries = [*boxes_in(low, low + 0.5, 12), {"id": "box-05b", "mesh": "crate.stl"}]
    (site_folder / "o.json").write_text(json.dumps({"version": 1, "obstructions": entries}))
    out = site_folder / "with.mcap"
    toml = site_folder / "frame.site.toml"
    made = plan(toml, out, obstructions=site_folder / "o.json", wish=PolicyWish("default"), progress=SilentProgress())
    ids = [blocker.id for blocker in read_log(out).plan.site.blockers if blocker.kind == "obstruction"]
    assert ids[0] == "box-05b"
    assert "box-00 to box-02 (3 obstructions)" in ids
    assert len(ids) <= 6
    (first, *_) = made["infeasible"]
    assert set(first["blocked_by"]) <= set(ids)
    document = verify(out, site=toml, obstructions=site_folder / "o.json", progress=SilentProgress())
    assert document["verified"] is True, document["checks"]


def test_a_message_names_a_few_of_many_obstructions(site_folder):
    site = read_log(site_folder / "frame.mcap").plan.site
    high = site.frame.corner_of((*site.shape[:2], 8))
    (site_folder / "o.json").write_text(
        json.dumps({"version": 1, "obstructions": boxes_in((*site.frame.origin_m[:2], 0.0), high, 8000)})
    )
    with pytest.raises(NoPlanError, match=r"box-\d+, box-\d+.* and [0-9,]+ more\)") as caught:
        plan(site_folder / "frame.site.toml", obstructions=site_folder / "o.json", progress=SilentProgress())
    assert len(caught.value.message) < 1000
