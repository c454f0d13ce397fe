import pytest

from bimvox import progress as module
from bimvox.progress import Progress, SilentProgress


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    now = [0.0]
    monkeypatch.setattr(module.time, "perf_counter", lambda: now[0])
    return now


def test_stages_are_timed_one_after_the_other_and_summed_by_name(clock: list[float]) -> None:
    progress: Progress = SilentProgress()
    with progress.stage("read"):
        clock[0] += 2.0
    clock[0] += 100.0
    progress.stage("plan", total=3)
    clock[0] += 1.0
    progress.stage("prove")
    clock[0] += 0.25
    progress.stage("plan")
    clock[0] += 0.5
    assert progress.seconds == {"read": 2.0, "plan": 1.5, "prove": 0.25}
    progress.finish()
    progress.finish()
    assert progress.seconds == {"read": 2.0, "plan": 1.5, "prove": 0.25}


def test_a_library_callback_starts_stages_by_name(clock: list[float]) -> None:
    progress = SilentProgress()
    with progress.stage("read"):
        clock[0] += 1.0
        progress.report("geometry", 0, 4)
        clock[0] += 3.0
        progress.report("geometry", 2, 4)
        assert (progress.done, progress.total) == (2, 4)
    assert progress.name is None
    assert progress.seconds == {"read": 1.0, "geometry": 3.0}


def test_advance_counts_within_the_stage() -> None:
    progress = SilentProgress()
    progress.stage("lifts", total=5)
    progress.advance()
    progress.advance(2)
    assert (progress.done, progress.total) == (3, 5)
    progress.stage("next")
    assert (progress.done, progress.total) == (0, None)


def test_a_failing_stage_ends_too() -> None:
    progress = SilentProgress()
    with pytest.raises(ValueError, match="bad"), progress.stage("read"):
        raise ValueError("bad")
    assert progress.name is None
    assert list(progress.seconds) == ["read"]


def test_notes_are_kept_once() -> None:
    progress = SilentProgress()
    progress.note("no unit: metres assumed")
    progress.note("no unit: metres assumed")
    assert progress.notes == ["no unit: metres assumed"]
