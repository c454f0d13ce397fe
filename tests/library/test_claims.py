"""What a log claims and a proof did not prove, by what was given to the proof."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import seeded_faults as faults
from weakened_rules import DEFAULT, EVERY
from xer_files import xer_text

import sample_models
from bimvox.bim.building import TriangleMesh
from bimvox.grid.frame import Label
from bimvox.library.claims import CLAIMS, Given, check_user_files, claims_of
from bimvox.library.compare import same_rules
from bimvox.library.plan import georeference_of
from bimvox.library.site import LoadedSite, load_obstructions, load_site, obstructed, survey_in
from bimvox.log.plan_log import GEOREFERENCE, PlanLog
from bimvox.progress import SilentProgress
from bimvox.records.lift import Epoch, LiftPlan
from bimvox.records.proof import Check, Claim
from bimvox.site.config.rules import RulesConfig
from bimvox.site.default_rules import FlipRules, TandemRules
from bimvox.site.site import HeadingRule, HookHeights, Rules, Site

EVERY_LOG = {"model", "site", "obstructions", "fewest_moves", "last_moves", "how_found"}


@pytest.fixture(scope="module")
def good() -> PlanLog:
    return faults.good_log()


def claims(log: PlanLog, *bound: str, checks: tuple[Check, ...] = ()) -> dict[str, Claim]:
    return {claim.name: claim for claim in claims_of(log, checks, bound)}


def with_rules(log: PlanLog, rules: Rules) -> PlanLog:
    site = dataclasses.replace(log.plan.site, rules=rules)
    return dataclasses.replace(log, plan=dataclasses.replace(log.plan, site=site))


def with_a_lift(log: PlanLog, **changes: object) -> PlanLog:
    first, *rest = log.plan.lifts
    lifts = (dataclasses.replace(first, **changes), *rest)
    return dataclasses.replace(log, plan=dataclasses.replace(log.plan, lifts=lifts))


def test_what_is_given_takes_its_claims_away(good):
    log = with_rules(good, RulesConfig().rules(has_crane=True))
    assert claims(log).keys() == EVERY_LOG
    assert claims(log, "--site").keys() == EVERY_LOG - {"model", "site"}
    assert claims(log, "--obstructions").keys() == EVERY_LOG - {"obstructions"}
    assert claims(log, "--search").keys() == EVERY_LOG - {"fewest_moves"}
    assert claims(log, "--site", "--obstructions", "--search").keys() == {"last_moves", "how_found"}


def test_rules_below_the_defaults_are_named_and_counted(good):
    rules = dataclasses.replace(RulesConfig().rules(has_crane=True), transit_clearance_m=0.5, highest_utilisation=1.0)
    found = claims(with_rules(good, dataclasses.replace(rules, support_gap_m=0.2)))["weaker_rules"]
    assert found.count == 3
    assert "highest_utilisation = 1 (default: 0.85)" in found.text
    assert "transit_clearance_m = 0.5 (default: 2)" in found.text
    assert "support_gap_m = 0.2 (default: 0.05)" in found.text


def test_a_lift_that_gives_way_is_named(good):
    found = claims(with_a_lift(good, clearance_m=0.5))["gives_way"]
    assert (found.count, found.bind_with) == (1, "--search")
    assert found.text.endswith(": left")
    assert "gives_way" not in claims(with_a_lift(good, clearance_m=0.5), "--search")


def test_a_load_that_keeps_its_heading_where_loads_turn_is_named(good):
    turning = with_rules(good, dataclasses.replace(good.plan.site.rules, heading=HeadingRule.WITH_JIB))
    assert claims(turning)["kept_heading"].count == 4
    assert claims(with_a_lift(turning, with_jib=True))["kept_heading"].count == 3
    assert "kept_heading" not in claims(good)


def test_what_the_search_could_not_decide_stays_a_claim(good):
    check = Check("search", undecided=["lift 2 (beam): the search takes other last moves"])
    assert claims(good, "--search", checks=(check,))["undecided"].count == 1


def test_extracts_watches_and_recovered_logs_claim_more(good):
    assert claims(good.extract([0, 1]))["extract"].count == 2
    assert "recovered" in claims(dataclasses.replace(good, recovered=True))
    assert "revisions" in claims(dataclasses.replace(good, metadata={**good.metadata, "first_plan": "0"}))


def test_a_claim_is_written_with_its_count_only_if_it_has_one(good):
    assert claims(good)["obstructions"].to_dict() == {
        "name": "obstructions",
        "text": "no obstruction is missing",
        "bind_with": "--obstructions",
    }
    assert claims(good.extract([0]))["extract"].to_dict()["count"] == 3


def test_options_that_bind_a_claim_are_options_of_verify():
    source = (Path(__file__).parents[2] / "cli" / "bimvox_cli" / "verify.py").read_text()
    for option in {row.bind_with for row in CLAIMS} - {None}:
        assert f'"{option}"' in source or f"    {option.removeprefix('--')}: Annotated" in source


SITE = """
name = "bound"
[model]
path = "frame_georeferenced.ifc"
select = "IfcColumn"
voxel_size_m = 0.25
[[zone]]
kind = "limiter"
lowest_hook_m = 1.0
polygon = [[-1, -1], [2, -1], [2, 2], [-1, 2]]
"""


@pytest.fixture(scope="module")
def loaded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, LoadedSite]:
    folder = tmp_path_factory.mktemp("bound")
    model = Path(sample_models.__file__).parent / "frame_georeferenced.ifc"
    (folder / model.name).write_bytes(model.read_bytes())
    (folder / "bound.site.toml").write_text(SITE)
    found = load_site(folder / "bound.site.toml")
    assert any(one.kind == "structure" for one in found.site.blockers)
    return folder / "bound.site.toml", found


def log_of(loaded: LoadedSite, site: Site, **metadata: str) -> PlanLog:
    return PlanLog(LiftPlan(site, ()), attachments=loaded.files, metadata={**georeference_of(loaded), **metadata})


def without_limits(site: Site) -> Site:
    return replace(site, hook_heights=None)


def with_higher_limits(site: Site) -> Site:
    assert site.hook_heights is not None
    return replace(site, hook_heights=HookHeights(site.hook_heights.low_m - 5.0, site.hook_heights.high_m))


def with_a_thinner_structure(site: Site) -> Site:
    at = next(n for n, one in enumerate(site.blockers) if one.kind == "structure")
    mesh = site.blockers[at].mesh
    assert mesh is not None
    thin = TriangleMesh(mesh.vertices_m + np.array([0.0, 0.0, 0.01]), mesh.faces)
    blockers = (*site.blockers[:at], replace(site.blockers[at], mesh=thin), *site.blockers[at + 1 :])
    return replace(site, blockers=blockers)


def named(site: Site, kind: str) -> Site:
    renamed = (replace(one, name="the city's") if one.kind == kind else one for one in site.blockers)
    return replace(site, blockers=tuple(renamed))


def with_a_larger_building_area(site: Site) -> Site:
    labels = site.labels.copy()
    labels[-1, -1, 0] = Label.CONSTRUCTION_AREA
    return replace(site, labels=labels)


FORGED: dict[str, tuple[Callable[[Site], Site], str]] = {
    "limits dropped": (without_limits, "zones: the hook's limits are not those of your files"),
    "limits changed": (with_higher_limits, "zones: the hook's limits are not those of your files"),
    "structure": (with_a_thinner_structure, "its surface is not that of your model"),
    "construction area": (with_a_larger_building_area, "areas.construction is not that of your files"),
    "name": (lambda site: replace(site, name="other"), "the name of the site is other in the log, bound in your files"),
    "unit": (
        lambda site: replace(site, source={**site.source, "unit": "inch"}),
        "the model's unit is inch in the log, m in your files",
    ),
    "notes": (
        lambda site: replace(site, notes=("the ground was tested",)),
        "notes is ('the ground was tested',)",
    ),
    "name of a structure": (
        lambda site: named(site, "structure"),
        "is the city's in the log, ",
    ),
    "name of the ground": (
        lambda site: named(site, "ground"),
        "the name of fixed object 'ground' is the city's",
    ),
    "name of a mast": (
        lambda site: named(site, "crane"),
        "the name of fixed object 'crane' is the city's",
    ),
    "clearances": (
        lambda site: replace(site, rules=replace(site.rules, transit_clearance_m=0.0, gives_way=())),
        "rules.transit_clearance_m is 0.0 in the log, 2.0 in your files",
    ),
}


def test_a_log_of_these_files_is_bound_to_them(loaded: tuple[Path, LoadedSite]):
    path, found = loaded
    check = check_user_files(log_of(found, found.site), Given(path), SilentProgress())
    assert check.passed, check.failures


@pytest.mark.parametrize("name", FORGED)
def test_what_differs_from_the_files_is_named(loaded: tuple[Path, LoadedSite], name: str):
    path, found = loaded
    forge, says = FORGED[name]
    check = check_user_files(log_of(found, forge(found.site)), Given(path), SilentProgress())
    assert any(says in failure for failure in check.failures), check.failures


@pytest.mark.parametrize("key", [key for key in EVERY if key.count(".") < 2])
def test_each_rule_that_asks_for_less_is_named(key: str):
    check = Check("bound")
    same_rules(check, EVERY[key], replace(DEFAULT, two_hooks=FlipRules(), tandem=TandemRules()), "your files")
    assert any(failure.startswith(f"rules.{key} is ") for failure in check.failures), check.failures


def test_a_georeference_called_none_is_not_none(tmp_path: Path):
    (tmp_path / "frame.ifc").write_bytes((Path(sample_models.__file__).parent / "frame.ifc").read_bytes())
    path = tmp_path / "plain.site.toml"
    path.write_text('[model]\npath = "frame.ifc"\nvoxel_size_m = 0.25\n')
    found = load_site(path)
    assert check_user_files(log_of(found, found.site), Given(path), SilentProgress()).passed
    for word in ("none", "nothing", ""):
        forged = log_of(found, found.site, **{GEOREFERENCE: word})
        (failure,) = check_user_files(forged, Given(path), SilentProgress()).failures
        assert failure == f"the model's georeference is {word} in the log, nothing in your files"


def test_notes_about_obstructions_are_those_of_your_file(tmp_path: Path):
    log, file = faults.good_log(), tmp_path / "obstructions.json"
    aside = {"id": "mast", "box": {"min": [900, 0, 0], "max": [901, 1, 9]}}
    file.write_text(json.dumps({"version": 1, "obstructions": [aside]}))
    site = obstructed(log.plan.site, load_obstructions(file, log.plan.site, survey_in(log)), SilentProgress())
    assert len(site.obstruction_notes) == 1
    bound = [
        check_user_files(
            replace(log, plan=replace(log.plan, site=replace(site, obstruction_notes=notes))),
            Given(obstructions=file),
            SilentProgress(),
        ).failures
        for notes in (site.obstruction_notes, (), (*site.obstruction_notes, "the city has checked mast"))
    ]
    assert not bound[0]
    assert bound[1] == [
        "note about obstructions that is in your files, but not in the log: " + site.obstruction_notes[0]
    ]
    assert bound[2] == ["note about obstructions that is in the log, but not in your files: the city has checked mast"]


def test_a_georeference_is_that_of_the_model(loaded: tuple[Path, LoadedSite]):
    path, found = loaded
    forged = log_of(found, found.site, **{GEOREFERENCE: '{"crs": "EPSG:25832"}'})
    (failure,) = check_user_files(forged, Given(path), SilentProgress()).failures
    assert failure.startswith('the model\'s georeference is {"crs": "EPSG:25832"} in the log, ')


def bound(log: PlanLog, path: Path, **files: bytes) -> Check:
    forged = replace(
        log, attachments={**log.attachments, **{name.replace("__", "."): data for name, data in files.items()}}
    )
    return check_user_files(forged, Given(path), SilentProgress())


@pytest.mark.parametrize(
    ("table", "says"),
    [
        ('[project]\napproved_by = "the city"\n', "project.approved_by is the city in the log, nothing in your files"),
        (
            '[project]\nrevisions = [{revision = "A", date = "now"}]\n',
            "project.revisions[0].revision is A in the log",
        ),
        (
            '[project]\napproved_by = "nothing"\n',
            "project.approved_by is nothing in the log, nothing in your files",
        ),
        ("[calendar]\nstart = 2031-03-02\n", "calendar.start is 2031-03-02 in the log, nothing in your files"),
        ('[calendar]\ndays = ["Sat"]\n', "calendar.days[0] is Sat in the log, Mon in your files"),
        ("[costs]\nperson_hour = 1.0\n", "costs.person_hour is 1.0 in the log, 30.0 in your files"),
        ("[policy]\nseed = 7\n", "policy.seed is 7 in the log, 0 in your files"),
        ("[means]\nheaviest_kg = 1.0\n", "means.heaviest_kg is 1.0 in the log"),
        ("[[support]]\npermitted_kpa = 500\n", "support[0].permitted_kpa is 500.0 in the log, nothing in your files"),
    ],
)
def test_every_table_of_the_site_file_in_the_log_is_that_of_yours(
    loaded: tuple[Path, LoadedSite], table: str, says: str
):
    path, found = loaded
    check = bound(log_of(found, found.site), path, site__toml=f"{SITE}{table}".encode())
    assert not check.passed
    assert any(says in failure for failure in check.failures), check.failures


def test_comments_and_the_order_of_keys_are_free(loaded: tuple[Path, LoadedSite]):
    path, found = loaded
    text = SITE.replace(
        'select = "IfcColumn"\nvoxel_size_m = 0.25', 'voxel_size_m = 0.250 # coarse\nselect = "IfcColumn"'
    )
    text = text.replace('"frame_georeferenced.ifc"', '"models/frame.ifc"') + "[policy]\nseed = 0\n"
    check = bound(log_of(found, found.site), path, site__toml=text.encode())
    assert check.passed, check.failures


def test_a_file_that_only_the_log_has_is_named(loaded: tuple[Path, LoadedSite]):
    path, found = loaded
    check = bound(log_of(found, found.site), path, programme__ours_xml=b"<Project/>")
    assert check.failures == ["programme.ours_xml is in the log, but not in your files"]


@pytest.mark.parametrize(("name", "refused"), [("slab", True), ("left", False)])
def test_what_meets_the_obstructions_and_is_not_done_before_is_refused(tmp_path: Path, name: str, refused: bool):
    """The history sets a box aside until 1 ns before the end: the last lift is not done by then, the others are."""
    log = faults.good_log()
    lift = faults.lift_of(log, name)
    middle = log.plan.site.frame.corner_of(lift.path_vox[len(lift.path_vox) // 2]).tolist()
    entry = {"id": "truck", "box": {"min": middle, "max": [n + 0.2 for n in middle]}}
    file = tmp_path / "obstructions.json"
    file.write_text(json.dumps({"version": 1, "unit": "m", "obstructions": [entry]}))
    site = obstructed(log.plan.site, load_obstructions(file, log.plan.site, survey_in(log)), SilentProgress())
    late = faults.carried_out_until(
        faults.with_site(log, blockers=site.blockers), Epoch(log.motions[-1].end_ns - 1, ())
    )
    failures = check_user_files(late, Given(obstructions=file), SilentProgress()).failures
    assert bool(failures) is refused
    if refused:
        assert "lift 4 (slab): it is not done before the obstructions become the current ones" in failures[0]


def test_dates_of_a_programme_are_those_of_yours(loaded: tuple[Path, LoadedSite], tmp_path: Path):
    path, _ = loaded
    ours = tmp_path / "ours.xer"
    ours.write_text(xer_text([("100", "11", "set columns", "2026-03-02 07:00", "2026-03-02 16:00")]))
    held = load_site(path, programme=ours)
    log, name = log_of(held, held.site), "programme.ours.xer"
    given = {"programme": ours}
    assert check_user_files(log, Given(path, **given), SilentProgress()).passed
    later = replace(log, attachments={**log.attachments, name: log.attachments[name].replace(b"2026-", b"2027-")})
    failures = check_user_files(later, Given(path, **given), SilentProgress()).failures
    assert any("rows[" in one and "2027-03-02 07:00:00 in the log, 2026-03-02 07:00:00" in one for one in failures), (
        failures
    )


TABLE = b"set_kind,set_means,select\nsteel,,IfcColumn\n"


@pytest.mark.parametrize(
    ("table", "says"),
    [
        (b"parts,select,set_kind,set_means\n8,IfcColumn,steel,\n,IfcBeam,,\n", []),
        (b"\xef\xbb\xbf" + TABLE.replace(b",", b";"), []),
        (TABLE.replace(b"steel", b"timber"), ["machine.kinds.csv[0].kind is timber in the log, steel in your files"]),
        (
            TABLE + b",built,IfcBeam\n",
            [
                f"machine.kinds.csv[1].{key} is {value} in the log, nothing in your files"
                for key, value in (("select", "IfcBeam"), ("kind", "None"), ("means", "built"))
            ],
        ),
        (b"no table", ["the attached machine.kinds.csv cannot be used: kinds.csv: line 1"]),
    ],
)
def test_a_table_of_kinds_in_the_log_says_what_yours_says(
    loaded: tuple[Path, LoadedSite], tmp_path: Path, table: bytes, says: list[str]
):
    model = loaded[0].with_name("frame_georeferenced.ifc")
    (tmp_path / "kinds.csv").write_bytes(TABLE)
    path = tmp_path / "bound.site.toml"
    path.write_text(SITE.replace("[model]", '[model]\nkinds = ["kinds.csv"]'))
    found = load_site(path, model=model)
    forged = replace(log_of(found, found.site), attachments={**found.files, "machine.kinds.csv": table})
    failures = check_user_files(forged, Given(path, model), SilentProgress()).failures
    assert len(failures) == len(says), failures
    assert all(map(str.startswith, failures, says)), failures
