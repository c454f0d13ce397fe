"""A watch that carries out its plan among people and vehicles."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import pytest
from bimvox_pipeline.verify import verify
from bimvox_pipeline.watch.plan import WatchWish
from bimvox_pipeline.watch.traffic import insist_on_one_crane, traffic_of
from bimvox_pipeline.watch.watch import watch
from planned_frame import copy_to

from bimvox.crane.kinematics import hook_of
from bimvox.errors import FileError, InputError
from bimvox.library.arguments import PolicyWish
from bimvox.library.plan import digests_of
from bimvox.library.plan_value import write_log_file
from bimvox.library.site import load_site
from bimvox.live.tracks import TRACKS
from bimvox.log.reader import read_log
from bimvox.progress import SilentProgress

FAST = 1e9
TRACK = "id,kind,time_s,x_m,y_m\nvan,vehicle,0,-60,-60\nbob,person,0,2,2\nbob,person,600,2,2\nbob,person,1000,-40,-40\n"


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return copy_to(tmp_path_factory.mktemp("frame")) / "frame.site.toml"


def carried_out(site: Path, traffic: str, **how: Any) -> list[dict[str, Any]]:
    return list(
        watch(
            site.with_name("none.json"),
            site=site,
            out=site.with_name("frame.mcap"),
            wish=PolicyWish("none"),
            how=WatchWish(speed=FAST, traffic=traffic, **how),
            progress=SilentProgress(),
        )
    )


@pytest.mark.slow
def test_a_plan_is_carried_out_among_random_traffic_and_its_log_proves_it(site: Path) -> None:
    before = site.with_name("frame.mcap").read_bytes()
    first, *states, whole = carried_out(site, "light:5")
    assert first["event"] == "unchanged"
    assert {one["event"] for one in states} == {"state"}
    assert [one["time_s"] for one in states] == sorted(one["time_s"] for one in states)
    assert whole["event"] == "traffic"
    assert whole["verified"]
    assert whole["traffic"] == "random, light, seed 5"
    assert whole["delivered"] == whole["lifts"] == len(states) / 3
    assert whole["violations"] == 0
    assert whole["least_distance_m"] > 0.0
    assert whole["time_s"] > states[-1]["time_s"] > 0.0
    assert site.with_name("frame.mcap").read_bytes() == before
    assert whole["log"] == str(site.with_name("frame.traffic.mcap"))
    document = verify(Path(whole["log"]), progress=SilentProgress())
    assert document["verified"]
    assert document["checks"]["others"]["samples"] > 1000
    tally = read_log(whole["log"]).carried_out.tally
    assert (whole["stops"], whole["waits"]) == (tally.stops, tally.waits)
    assert whole["time_lost_s"] == pytest.approx(tally.lost_s, abs=1e-3)
    assert carried_out(site, "light:5")[-1] == whole


@pytest.mark.slow
def test_recorded_tracks_are_followed_attached_and_proven(site: Path) -> None:
    tracks = site.with_name("tracks.csv")
    tracks.write_text(TRACK)
    whole = carried_out(site, str(tracks))[-1]
    assert whole["verified"]
    assert whole["traffic"] == "tracks of tracks.csv"
    log = read_log(whole["log"])
    assert log.attachments[TRACKS + "tracks.csv"] == TRACK.encode()
    assert [other.id for other in log.carried_out.others] == ["van", "bob"]
    other = TRACK.replace("0,2,2", "0,2,3", 1)
    for text, says in (
        (other, "at 0.0 s bob is 1.00 m from where the stated traffic (tracks of tracks.csv) has it"),
        (TRACK.replace("bob", "eve"), "there move van (vehicle), bob (person); in the stated traffic"),
        ("nothing", "column id is missing"),
    ):
        files = {TRACKS + "tracks.csv": text.encode()}
        forged = dataclasses.replace(
            log, attachments={**log.attachments, **files}, metadata={**log.metadata, **digests_of(files)}
        )
        path = site.with_name("forged.mcap")
        write_log_file(path, forged)
        document = verify(path, progress=SilentProgress())
        assert not document["verified"]
        assert any(says in failure for failure in document["checks"]["traffic"]["failures"])


def test_the_crane_waits_for_people_at_every_pick(site: Path) -> None:
    """Where every load is picked, somebody works for an hour: no load is raised before they leave."""
    plan = read_log(site.with_name("frame.mcap"))
    crane = plan.plan.site.cranes[0]
    picks_m = {tuple(hook_of(crane, *motion.raising.axes[:1].T)[0, :2].tolist()) for motion in plan.motions}
    rows = [
        f"p{n},person,{at_s},{x - away_m},{y}"
        for n, (x, y) in enumerate(sorted(picks_m))
        for at_s, away_m in ((0, 0.0), (3600, 0.0), (3700, 80.0))
    ]
    tracks = site.with_name("stands.csv")
    tracks.write_text("\n".join(["id,kind,time_s,x_m,y_m", *rows]))
    *states, whole = carried_out(site, str(tracks))[1:]
    assert whole["verified"]
    assert states[0]["time_s"] > 3600.0
    assert whole["waits"] > 0
    assert whole["time_lost_s"] > 3000.0


@pytest.mark.slow
def test_verify_says_the_same_as_watch_of_an_execution_that_takes_too_long(site: Path) -> None:
    """Somebody stays where the first load is picked, so nothing is lifted."""
    plan = read_log(site.with_name("frame.mcap"))
    picks_m = [hook_of(plan.plan.site.cranes[0], *one.raising.axes[:1].T)[0, :2].tolist() for one in plan.motions]
    rows = [f"p{n},person,0,{x},{y}" for n, (x, y) in enumerate(sorted(map(tuple, picks_m)))]
    tracks = site.with_name("stays.csv")
    tracks.write_text("\n".join(["id,kind,time_s,x_m,y_m", *rows]))
    whole = carried_out(site, str(tracks))[-1]
    document = verify(Path(whole["log"]), progress=SilentProgress())
    assert (whole["verified"], document["verified"]) == (False, False)
    told = "lifts are left: 0 of 8 were carried out before the samples end"
    assert whole["failures"] == [f"carried_out: {told}"]
    assert [said for check in document["checks"].values() for said in check["failures"]] == [told]


@pytest.mark.parametrize(
    ("how", "message"),
    [
        (WatchWish(traffic="7"), "--traffic needs --simulate"),
        (WatchWish(speed=1.0, traffic="7", serve="8765"), "--traffic does not go with --serve"),
        (WatchWish(speed=1.0, traffic="7", retrain=5), "--traffic does not go with --retrain"),
        (WatchWish(speed=1.0, traffic="much:7"), "--traffic much:7: it is not a seed, and there is no such file"),
        (WatchWish(speed=1.0, traffic="-7"), "--traffic -7: it is not a seed"),
        (WatchWish(speed=1.0, traffic=""), "--traffic : it is not a seed"),
    ],
)
def test_what_is_no_traffic_is_refused(how: WatchWish, message: str) -> None:
    with pytest.raises(InputError, match=message):
        traffic_of(how)


def test_bad_tracks_are_refused_before_anything_is_planned(tmp_path: Path) -> None:
    tracks = tmp_path / "bad.csv"
    tracks.write_text("id,kind,time_s,x_m,y_m\na,person,0,0,0\na,person,1,north,0\n")
    with pytest.raises(FileError, match=r"bad.csv: line 3: x_m 'north' is not a number"):
        carried_out(tmp_path / "missing.site.toml", str(tracks))


def test_a_site_with_several_cranes_is_refused(site: Path) -> None:
    one = load_site(site, SilentProgress()).site
    insist_on_one_crane(one)
    with pytest.raises(InputError, match="the site has 2 cranes"):
        insist_on_one_crane(dataclasses.replace(one, cranes=one.cranes * 2))
