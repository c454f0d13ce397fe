"""An execution is that of the seed or of the tracks that its log names, and of those that one holds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from seeded_faults import Forge, carried_out_with, good_log, log_among_others

from bimvox.errors import FileError, InputError
from bimvox.library.attached_files import check_attached_files
from bimvox.library.claims import Given, check_user_files
from bimvox.library.compare import check_traffic
from bimvox.library.revise import carry_out
from bimvox.live.tracks import traffic_named
from bimvox.log.plan_log import PlanLog
from bimvox.planning.order_search import prepare
from bimvox.progress import SilentProgress
from bimvox.proof.carried_out import check_carried_out, tally_of
from bimvox.records.motion import CarriedOut, Other, OtherKind

BOB = "id,kind,time_s,x_m,y_m\nbob,person,0,2,2\nbob,person,600,2,2\nbob,person,700,-40,-40\n"


@pytest.fixture(scope="module")
def drawn() -> PlanLog:
    return log_among_others()


@pytest.fixture(scope="module")
def tracked(tmp_path_factory: pytest.TempPathFactory) -> PlanLog:
    file = tmp_path_factory.mktemp("tracks") / "bob.csv"
    file.write_text(BOB)
    log, named = good_log(), traffic_named(str(file))
    done, _, verdict = carry_out(log, prepare(log.plan.site), named.traffic, named.source, named.file, SilentProgress())
    assert verdict.verified
    return done


def failures(log: PlanLog) -> list[str]:
    assert log.carried_out is not None
    return check_traffic(log, log.carried_out).failures


def without(found: CarriedOut, *gone: int) -> Mapping[str, Any]:
    kept = [n for n in range(len(found.others)) if n not in gone]
    return {
        "others": tuple(found.others[n] for n in kept),
        "place_m": found.place_m[:, kept],
        "seen_m": found.seen_m[:, kept],
    }


def moved(found: CarriedOut, other: int, by_m: tuple[float, float]) -> Mapping[str, Any]:
    place_m, seen_m = found.place_m.copy(), found.seen_m.copy()
    place_m[:, other] += by_m
    seen_m[:, other] += by_m
    return {"place_m": place_m, "seen_m": seen_m}


def lorries(found: CarriedOut) -> Mapping[str, Any]:
    return {"others": tuple(Other(other.id, OtherKind.VEHICLE) for other in found.others)}


def begun_later(found: CarriedOut) -> Mapping[str, Any]:
    """The crane waits for a while before it begins; everything else is as it was, later."""
    more = 40
    names = ("plan_ns", "pace", "axes", "place_m", "seen_m")
    later = {one: np.concatenate([np.repeat(getattr(found, one)[:1], more, 0), getattr(found, one)]) for one in names}
    return {**later, "time_ns": np.arange(len(found.time_ns) + more, dtype=np.int64) * 500_000_000}


FORGED: dict[str, tuple[Forge, str]] = {
    "nobody there": (
        carried_out_with(lambda found: without(found, 0, 1, 2)),
        "in the log there move nobody; in the stated traffic (random, medium, seed 3) crew 1 (person), crew 2 (person)",
    ),
    "a person less": (
        carried_out_with(lambda found: without(found, 0)),
        "in the log there move crew 2 (person), lorry 1 (vehicle); in the stated traffic",
    ),
    "a person further away": (
        carried_out_with(lambda found: moved(found, 1, (-60.0, 0.0))),
        "at 0.0 s crew 2 is 60.00 m from where the stated traffic (random, medium, seed 3) has it",
    ),
    "all lorries": (carried_out_with(lorries), "in the log there move crew 1 (vehicle), crew 2 (vehicle), lorry 1"),
    "another seed": (
        carried_out_with(lambda found: {"source": "random, medium, seed 4"}),
        "where the stated traffic (random, medium, seed 4) has it",
    ),
    "no seed": (carried_out_with(lambda found: {"source": "a camera"}), "it says 'a camera'; that is neither a seed"),
    "somebody decided": (
        carried_out_with(lambda found: {"decider": "the foreman"}),
        "who decided is the foreman in the log, a rule chooses",
    ),
    "a longer wait": (carried_out_with(begun_later), "s from where it is on the plan's clock"),
}


def with_its_tally(log: PlanLog) -> PlanLog:
    found = log.carried_out
    assert found is not None
    return replace(log, carried_out=replace(found, tally=tally_of(log.plan, log.motions, found)))


def test_an_execution_is_that_of_its_seed_or_its_tracks(drawn: PlanLog, tracked: PlanLog):
    assert failures(drawn) == failures(tracked) == []


@pytest.mark.parametrize("name", FORGED)
def test_another_execution_than_that_of_its_seed_is_refused(drawn: PlanLog, name: str):
    forge, says = FORGED[name]
    found = failures(with_its_tally(forge(drawn)))
    assert any(says in failure for failure in found), found


def test_the_samples_alone_do_not_show_that_somebody_is_missing(drawn: PlanLog):
    """So the simulation is needed."""
    log = with_its_tally(FORGED["nobody there"][0](drawn))
    assert log.carried_out is not None
    assert all(check.passed for check in check_carried_out(log.plan, log.motions, log.carried_out))


def test_a_log_among_tracks_carries_them(tracked: PlanLog):
    (failure,) = failures(replace(tracked, attachments={}))
    assert failure.endswith("it says 'tracks of bob.csv'; that is neither a seed nor the attached file of tracks")
    (failure,) = failures(carried_out_with(lambda found: {"source": "random, medium, seed 3"})(tracked))
    assert failure.endswith("it says 'random, medium, seed 3', but a file of tracks is attached: tracks/bob.csv")


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (
            lambda text: text.replace("-40,-40", "-41,-40"),
            "tracks.bob.samples[2][1] is -40.0 in the log, -41.0 in",
        ),
        (lambda text: text.replace("person", "vehicle"), "tracks.bob.kind is person in the log, vehicle in your file"),
        (lambda text: text + "eve,person,0,1,1\n", "the tracks is ['bob'] in the log, ['bob', 'eve'] in your file"),
    ],
)
def test_tracks_are_compared_with_those_that_one_holds(
    tracked: PlanLog, tmp_path: Path, change: Callable[[str], str], says: str
):
    yours = tmp_path / "yours.csv"
    yours.write_text(BOB.replace(",2,", ",2.0,"))
    assert check_user_files(tracked, Given(traffic=str(yours)), SilentProgress()).passed
    yours.write_text(change(BOB))
    check = check_user_files(tracked, Given(traffic=str(yours)), SilentProgress())
    assert any(says in failure for failure in check.failures), check.failures


def test_a_seed_is_compared_with_the_one_that_one_holds(drawn: PlanLog, tracked: PlanLog):
    def bound(log: PlanLog, traffic: str) -> list[str]:
        return check_user_files(log, Given(traffic=traffic), SilentProgress()).failures

    assert bound(drawn, "medium:3") == bound(drawn, "3") == []
    (heavy,) = bound(drawn, "heavy:3")
    assert heavy == "the traffic is random, medium, seed 3 in the log, random, heavy, seed 3 in your wish"
    assert bound(tracked, "3") == ["the traffic is tracks of bob.csv in the log, random, medium, seed 3 in your wish"]
    assert bound(replace(drawn, carried_out=None), "3") == ["the log holds no execution among people and vehicles"]


def test_traffic_that_is_none_is_an_error(drawn: PlanLog, tmp_path: Path):
    with pytest.raises(InputError, match="--traffic much:7: it is not a seed, and there is no such file"):
        check_user_files(drawn, Given(traffic="much:7"), SilentProgress())
    bad = tmp_path / "bad.csv"
    bad.write_text("nothing")
    with pytest.raises(FileError, match="column id is missing"):
        check_user_files(drawn, Given(traffic=str(bad)), SilentProgress())


def test_an_extract_does_not_carry_tracks_of_an_execution_that_it_does_not_hold(tracked: PlanLog):
    assert any(name.startswith("tracks/") for name in tracked.attachments)
    part = tracked.extract([0, 1])
    assert part.carried_out is None
    assert part.attachments.keys() == {"site.toml"}
    assert not any("tracks/" in key for key in part.metadata)
    assert check_attached_files(part).passed
    forged = replace(part, attachments={**part.attachments, "tracks/bob.csv": b"approved by the city"})
    (failure,) = check_attached_files(forged).failures
    assert failure.startswith("attached tracks/bob.csv: it is not a file that bimvox attaches")
