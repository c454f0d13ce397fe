"""Boxes that the studio draws, and obstruction files in other coordinates than the site's."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from bimvox_pipeline.studio.obstacles import boxes_of, file_of, write_boxes
from bimvox_pipeline.studio.opened import ChangedMeanwhileError

from bimvox.errors import ObstructionFileError

BOX = {"id": "truck", "min": [1.0, 2.0, 0.0], "max": [2.0, 3.0, 1.5]}


def test_new_files_state_that_they_are_of_the_site(tmp_path: Path) -> None:
    site = tmp_path / "a.site.toml"
    assert write_boxes(site, [BOX])["obstructions"] == [BOX]
    assert json.loads(file_of(site).read_bytes())["coordinates"] == "site"


@pytest.mark.parametrize("coordinates", ["map", "model"])
def test_boxes_on_the_map_are_not_drawn_and_not_edited(tmp_path: Path, coordinates: str) -> None:
    site = tmp_path / "a.site.toml"
    entry = {"id": "shed", "box": {"min": [155_000, 463_000, 3], "max": [155_001, 463_001, 4]}}
    content = json.dumps({"version": 1, "coordinates": coordinates, "obstructions": [entry]})
    file_of(site).write_text(content, encoding="utf-8")
    found = boxes_of(site)
    assert (found["obstructions"], found["others"]) == ([], 1)
    with pytest.raises(ObstructionFileError, match=f"coordinates of the {coordinates}"):
        write_boxes(site, [BOX], found["sha256"])
    assert file_of(site).read_text(encoding="utf-8") == content


def test_a_page_that_does_not_say_which_obstructions_it_saw_writes_no_others(tmp_path: Path) -> None:
    site = tmp_path / "a.site.toml"
    first = write_boxes(site, [BOX])["sha256"]
    for sha256 in (None, "", "0" * 64, 7, [], True):
        with pytest.raises(ChangedMeanwhileError):
            write_boxes(site, [], sha256)
    assert boxes_of(site)["obstructions"] == [BOX]
    assert write_boxes(site, [], first)["obstructions"] == []
