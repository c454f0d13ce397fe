"""A plan carried out among others, as a log: its verdict is that of ``verify``."""

from __future__ import annotations

from pathlib import Path

from bimvox_pipeline.verify import verify
from seeded_faults import good_log

from bimvox.crane.kinematics import hook_of
from bimvox.library.plan_value import write_log_file
from bimvox.library.revise import carry_out
from bimvox.live.execution import Traffic
from bimvox.live.tracks import Track
from bimvox.live.traffic import Density
from bimvox.planning.order_search import prepare
from bimvox.progress import SilentProgress
from bimvox.records.motion import OtherKind


def test_an_execution_that_takes_too_long_is_refused_by_both(tmp_path: Path):
    """Somebody stays at every pick, so nothing is lifted."""
    log = good_log()
    crane = log.plan.site.cranes[0]
    picks_m = [hook_of(crane, *motion.raising.axes[:1].T)[0, :2].tolist() for motion in log.motions]
    tracks = tuple(Track(f"p{n}", OtherKind.PERSON, [(0.0, x, y)]) for n, (x, y) in enumerate(picks_m))
    traffic = Traffic(Density(0, 0), 0, tracks)
    rows = [f"{one.name},person,0,{one.samples[0][1]!r},{one.samples[0][2]!r}" for one in tracks]
    file = tmp_path / "stays.csv"
    file.write_text("\n".join(["id,kind,time_s,x_m,y_m", *rows]))
    done, _, verdict = carry_out(log, prepare(log.plan.site), traffic, f"tracks of {file.name}", file, SilentProgress())
    told = "carried_out: lifts are left: 0 of 4 were carried out before the samples end"
    assert verdict.failures == (told,)
    write_log_file(tmp_path / "log.mcap", done)
    checks = verify(tmp_path / "log.mcap", progress=SilentProgress())["checks"]
    assert [f"{name}: {said}" for name, check in checks.items() for said in check["failures"]] == [told]
