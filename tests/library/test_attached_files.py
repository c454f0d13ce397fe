"""A site against the site file that its log carries, also where the file leaves something to be chosen."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from named_cranes import BUILT_IN

import bimvox
from bimvox.grid.frame import Label
from bimvox.library.attached_files import check_attached_files
from bimvox.log.plan_log import PlanLog
from bimvox.records.lift import LiftPlan
from bimvox.site.build import labels_of, left_out
from bimvox.site.component import Component, StoredPose
from bimvox.site.site import Blocker, Site

SAMPLES = Path(__file__).parents[2] / "sample_models"
MODELS = ("frame.ifc", "frame_ifc2x3_mm.ifc", "paper.ifc", "yard.glb")
SITE_FILES = ("hall.site.toml", "paper.site.toml", "yard.site.toml")
COLUMN = "169127r8vPYA2dqtb0EhfM"
Forge = Callable[[Site], Site]


def written(folder: Path, text: str, model: str = "frame.ifc") -> Path:
    file = folder / "a.site.toml"
    file.write_text(f'[model]\npath = "{(SAMPLES / model).as_posix()}"\n{text}')
    return file


def compared(loaded: bimvox.LoadedSite, forge: Forge = lambda site: site) -> list[str]:
    """What the check says of a site that was forged after it had been loaded; the site file stays."""
    site = forge(loaded.site)
    return check_attached_files(PlanLog(LiftPlan(site, ()), attachments=loaded.files)).failures


def with_part(name: str | None = None, **changes: object) -> Forge:
    """Return the forgery of one part: the first, or the one with this id."""

    def forge(site: Site) -> Site:
        at = 0 if name is None else next(n for n, part in enumerate(site.components) if part.id == name)
        part = dataclasses.replace(site.components[at], **changes)  # type: ignore[arg-type]
        return dataclasses.replace(site, components=(*site.components[:at], part, *site.components[at + 1 :]))

    return forge


def with_crane(**changes: object) -> Forge:
    return lambda site: dataclasses.replace(
        site,
        cranes=(dataclasses.replace(site.cranes[0], **changes),),  # type: ignore[arg-type]
    )


def with_labels(site: Site, **changes: object) -> Site:
    site = dataclasses.replace(site, **changes)  # type: ignore[arg-type]
    return dataclasses.replace(site, labels=labels_of(site))


def a_crane_from_nowhere(site: Site) -> Site:
    """The largest built-in machine at the place of the chosen one."""
    return dataclasses.replace(site, cranes=(dataclasses.replace(BUILT_IN[-1], base_m=site.cranes[0].base_m),))


def a_yard_everywhere(site: Site) -> Site:
    return with_labels(site, yard=np.ones_like(site.yard))


def a_wider_construction_area(site: Site) -> Site:
    labels = site.labels.copy()
    labels[:, :, 0] = Label.CONSTRUCTION_AREA
    return dataclasses.replace(site, labels=labels, yard=np.zeros_like(site.yard))


def a_lower_ground(site: Site) -> Site:
    moved = site.site_to_ifc.copy()
    moved[2, 3] -= 0.07
    return dataclasses.replace(site, site_to_ifc=moved)


@pytest.mark.parametrize("name", SITE_FILES)
def test_the_site_of_a_sample_is_that_of_its_file(name: str):
    assert compared(bimvox.load_site(SAMPLES / name)) == []


@pytest.mark.parametrize("model", MODELS)
def test_what_a_file_leaves_open_is_chosen_again_from_the_parts(tmp_path: Path, model: str):
    loaded = bimvox.load_site(written(tmp_path, "voxel_size_m = 0.3\n", model))
    assert loaded.cranes
    assert compared(loaded) == []


@pytest.fixture(scope="module")
def chosen(tmp_path_factory: pytest.TempPathFactory) -> bimvox.LoadedSite:
    """The site of a file that gives the model, and leaves everything else to be chosen."""
    return bimvox.load_site(written(tmp_path_factory.mktemp("chosen"), ""))


def test_another_ground_than_the_files_is_refused_and_one_that_it_leaves_open_is_the_logs_claim(tmp_path: Path):
    given = bimvox.load_site(written(tmp_path, "ground_m = 0.0\n", MODELS[0]))
    assert any(
        "model.ground_m is -0.07 in the log, 0 in the attached" in one for one in compared(given, a_lower_ground)
    )
    left_open = bimvox.load_site(written(tmp_path, "", MODELS[0]))
    assert compared(left_open, a_lower_ground) == [], "storeys and terrain, which decide, are in the model only"


@pytest.mark.parametrize(
    ("forge", "says"),
    [
        (a_crane_from_nowhere, r"the list of cranes is .* in the log, .* in the attached site.toml, which leaves it"),
        (with_crane(base_m=(1.0, 2.0, 0.0)), r"crane '.*': base_m is \(1.0, 2.0, 0.0\) in the log"),
        (with_crane(jib_height_m=99.0), r"crane '.*': jib_height_m is 99.0 in the log"),
        (lambda site: dataclasses.replace(site, cranes=()), r"the list of cranes is \[\] in the log"),
        (a_yard_everywhere, "areas.yard is not that of the attached site.toml, which leaves it to be chosen"),
        (a_wider_construction_area, "areas.construction is not that of the attached site.toml, which leaves it"),
        (
            lambda site: dataclasses.replace(site, frame=dataclasses.replace(site.frame, voxel_size_m=0.5)),
            r"model.voxel_size_m is 0.5 in the log, .* in the attached site.toml, which leaves it",
        ),
        (
            lambda site: dataclasses.replace(site, labels=np.pad(site.labels, ((0, 0), (0, 0), (0, 5)))),
            r"the site is \(\d+, \d+, \d+\) cells from .* in the log, \(\d+, \d+, \d+\) cells from",
        ),
    ],
)
def test_a_choice_that_does_not_follow_from_the_parts_is_refused(chosen: bimvox.LoadedSite, forge: Forge, says: str):
    told = compared(chosen, forge)
    assert any(re.search(says, one) for one in told), told


def test_an_access_that_the_file_does_not_give_is_refused(chosen: bimvox.LoadedSite):
    told = compared(chosen, lambda site: dataclasses.replace(site, access=site.yard))
    assert told == ["areas.access is not that of the attached site.toml"]


def test_an_access_of_the_file_is_in_the_site(tmp_path: Path):
    loaded = bimvox.load_site(written(tmp_path, "[areas]\naccess = [[[0, -30], [20, -30], [20, -26], [0, -26]]]\n"))
    assert loaded.site.access is not None
    assert loaded.site.access.any()
    assert compared(loaded) == []
    assert compared(loaded, lambda site: dataclasses.replace(site, access=None))


def parts_of(tmp_path: Path) -> tuple[bimvox.LoadedSite, list[Component]]:
    parts = list(bimvox.load_site(written(tmp_path, "")).components)
    table = "\n".join(
        [
            "[areas]",
            "construction = [[-1, -1], [13, -1], [13, 7], [-1, 7]]",
            "yard = [[[-1, -9], [30, -9], [30, -2], [-1, -2]]]",
            "[[component]]",
            f'global_id = "{parts[0].global_id}"',
            "start = [3.0, -6.0]",
            'pose = "lying_x"',
            f'before = ["{parts[1].global_id}"]',
            "[[component]]",
            f'global_id = "{parts[2].global_id}"',
            "turn = 1",
            "[[component]]",
            f'global_id = "{parts[-1].global_id}"',
            "pinned = true",
            "[[zone]]",
            'kind = "assembly"',
            'name = "west"',
            "polygon = [[-1, -1], [3, -1], [3, 7], [-1, 7]]",
            "[sequence]",
            f'first = ["{parts[1].global_id}"]',
            "storeys = false",
        ]
    )
    return bimvox.load_site(written(tmp_path, table)), parts


def test_what_the_file_asks_of_a_part_is_compared(tmp_path: Path):
    loaded, parts = parts_of(tmp_path)
    pinned, others = parts[-1], [part.id for part in loaded.components]
    assert pinned.id not in others
    assert compared(loaded) == []
    first, second = loaded.components[0], loaded.components[1]
    name = re.escape(first.label)
    unwanted = dataclasses.replace(second.hints, first=False, storey_rank=3)

    def lifted_again(site: Site) -> Site:
        again = dataclasses.replace(pinned, index=len(others), start_vox=None)
        return dataclasses.replace(site, components=(*site.components, again))

    def without(site: Site) -> Site:
        kept = tuple(blocker for blocker in site.blockers if blocker.id != pinned.id)
        return with_labels(site, blockers=kept)

    for forge, says in (
        (with_part(start_vox=(40, 2, 1)), rf"{name}: start_vox is \(40, 2, 1\) in the log, \(.*\) in the attached"),
        (with_part(start_vox=None), rf"{name}: start_vox is None in the log"),
        (with_part(stored_pose=StoredPose.AS_BUILT), rf"{name}: stored_pose is as_built in the log, lying_x in"),
        (with_part(erected=False), rf"{name}: erected is False in the log"),
        (with_part(before=()), rf"{name}: before is \(\) in the log"),
        (with_part(after=(second.id,)), rf"{name}: after is .* in the log, \(\) in the attached"),
        (with_part(crane=1), rf"{name}: crane is 1 in the log, 0 in what follows from"),
        (with_part(others[2], stored_turn=0), r": stored_turn is 0 in the log, 1 in the attached"),
        (with_part(second.id, hints=unwanted), r": hints.first is False in the log, True in"),
        (with_part(second.id, hints=unwanted), r": hints.storey_rank is 3 in the log, None in"),
        (
            with_part(hints=dataclasses.replace(first.hints, zone=4, zone_name="east")),
            rf"{name}: hints.zone_name is east",
        ),
        (lifted_again, rf"{re.escape(pinned.label)}: it is lifted, but the attached site.toml pins it"),
        (without, f"{pinned.id}: the attached site.toml pins it, but it is not a fixed object of the log"),
    ):
        told = compared(loaded, forge)
        assert any(re.search(says, one) for one in told), (says, told)


def test_a_part_that_the_file_names_and_the_log_lacks_is_named(tmp_path: Path):
    loaded, _ = parts_of(tmp_path)
    told = compared(loaded, lambda site: dataclasses.replace(site, components=site.components[1:]))
    assert any("no component has the id" in one for one in told), told


def test_a_pinned_part_outside_the_site_is_left_out_with_a_note(tmp_path: Path):
    loaded, parts = parts_of(tmp_path)

    def outside(site: Site) -> Site:
        kept = tuple(blocker for blocker in site.blockers if blocker.id != parts[-1].id)
        return with_labels(site, blockers=kept, notes=(left_out(parts[-1].id),))

    assert not any("not a fixed object" in one for one in compared(loaded, outside))


def test_the_crane_that_the_file_names_for_a_part_lifts_it(tmp_path: Path):
    text = (SAMPLES / "hall.site.toml").read_text().replace("hall.ifc", (SAMPLES / "hall.ifc").as_posix())
    part = bimvox.load_site(SAMPLES / "hall.site.toml").components[0]
    file = tmp_path / "hall.site.toml"
    file.write_text(f'{text}\n[[component]]\nglobal_id = "{part.global_id}"\ncrane = "east"\n')
    loaded = bimvox.load_site(file)
    assert compared(loaded) == []
    told = compared(loaded, with_part(part.id, crane=0))
    assert f"{part.label}: crane is 0 in the log, 1 in what follows from the attached site.toml" in told


def test_a_structure_without_a_surface_is_no_reason_to_stop(chosen: bimvox.LoadedSite):
    bare = Blocker("shed", "structure", np.array([[0, 0, 1]], np.int32))
    told = compared(chosen, lambda site: with_labels(site, blockers=(*site.blockers, bare)))
    assert told == []


def test_that_a_part_is_turned_over_between_two_hooks_is_the_files(tmp_path: Path):
    part = bimvox.load_site(written(tmp_path, "")).components[0]
    loaded = bimvox.load_site(written(tmp_path, f'[[component]]\nglobal_id = "{part.global_id}"\nflip = "two_hooks"'))
    assert compared(loaded) == []
    (told,) = compared(loaded, with_part(flip_rise_vox=0))
    assert re.search(r"flip_rise_vox is 0 in the log, \d+ in the attached", told)
    assert any("two_hooks" in one for one in compared(loaded, lambda site: with_rules(site, two_hooks=None)))


def with_rules(site: Site, **changes: object) -> Site:
    return dataclasses.replace(site, rules=dataclasses.replace(site.rules, **changes))
