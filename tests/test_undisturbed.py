"""Ctrl-C at any instruction leaves no lock held that the end of a watch waits for."""

from __future__ import annotations

import signal
import sys
import threading
from contextlib import contextmanager

import numpy as np
import pytest
from bimvox_pipeline.watch.live import LiveView
from bimvox_pipeline.watch.log import WholeLog
from bimvox_pipeline.watch.simulate import PlanClock

from bimvox.compiled import kernel
from bimvox.progress import SilentProgress
from bimvox.undisturbed import interruptible, undisturbed


class Interruption:
    """Sends Ctrl-C to this process at the given instruction of the watch's code or of Python's locks."""

    def __init__(self, at: int) -> None:
        self.at, self.passed = at, 0

    def __call__(self, frame, event, _):
        if not frame.f_code.co_filename.endswith(("threading.py", "watch/log.py", "watch/live.py")):
            return None
        frame.f_trace_opcodes = True
        if event == "opcode":
            self.passed += 1
            if self.passed == self.at:
                signal.raise_signal(signal.SIGINT)
        return self


@pytest.fixture(autouse=True)
def _ctrl_c_raises():
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a background job ignores it
    yield
    signal.signal(signal.SIGINT, before)


def interrupted_at(at, act):
    """Return the number of instructions of an act that is interrupted at one of them."""
    trace, usual = Interruption(at), sys.gettrace()
    try:
        sys.settrace(trace)
        act()
    except KeyboardInterrupt:
        pass
    finally:
        sys.settrace(usual)
    return trace.passed


def new_whole_log(tmp_path, monkeypatch):
    whole = WholeLog(tmp_path / "whole.mcap", SilentProgress())
    monkeypatch.setattr(whole, "_write", lambda *_: None)
    whole.offer("a plan")
    return whole, {"hold": whole.hold, "resume": whole.resume, "offer": lambda: whole.offer("another")}


def new_view(tmp_path, monkeypatch):
    view = LiveView([], PlanClock(1.0))
    monkeypatch.setattr("bimvox_pipeline.watch.live.standing_messages", lambda *_: [])
    monkeypatch.setattr("bimvox_pipeline.watch.live.Moving", lambda _: type("Still", (), {"at": lambda *_: ()}))
    return view, {"show": lambda: view.show("a plan")}


@pytest.mark.parametrize(
    ("make", "act"),
    [(new_whole_log, "hold"), (new_whole_log, "resume"), (new_whole_log, "offer"), (new_view, "show")],
)
def test_a_watch_ends_wherever_ctrl_c_interrupts_it(make, act, tmp_path, monkeypatch):
    held, acts = make(tmp_path, monkeypatch)
    instructions = interrupted_at(0, acts[act])
    held.close()
    assert instructions > 20
    for at in range(1, instructions + 1):
        held, acts = make(tmp_path, monkeypatch)
        interrupted_at(at, acts[act])
        closing = threading.Thread(target=held.close, daemon=True)
        closing.start()
        closing.join(timeout=20)
        assert not closing.is_alive(), f"instruction {at} of {instructions}"


def test_ctrl_c_takes_effect_at_the_end():
    done = []
    with pytest.raises(KeyboardInterrupt), undisturbed():
        signal.raise_signal(signal.SIGINT)
        done.append("all of it")
    assert done == ["all of it"]
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)


def test_a_process_that_ignores_ctrl_c_still_ignores_it():
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with undisturbed():
        signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN


def test_an_interrupt_while_a_kernel_is_compiled_takes_effect_after_it(monkeypatch):
    @kernel
    def doubled(number: int) -> int:
        return 2 * number

    @contextmanager
    def interrupted():
        signal.raise_signal(signal.SIGINT)
        yield

    monkeypatch.setattr(doubled._cache, "turn", interrupted)
    with pytest.raises(KeyboardInterrupt):
        doubled(4)
    assert len(doubled.signatures) == 1  # it was compiled to the end
    assert doubled(4) == 8


@kernel
def _two(count: int) -> tuple[np.ndarray, np.ndarray]:
    return np.ones(count), np.zeros(count)


def test_ctrl_c_while_a_kernel_returns_its_result_is_ctrl_c():
    _two(1)  # compiled
    came = []

    def interrupt(frame, event, _):
        if frame.f_code.co_filename.endswith("serialize.py") and not came:
            came.append(frame.f_code.co_name)
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt), interruptible():
        sys.settrace(interrupt)
        try:
            _two(2)
        finally:
            sys.settrace(None)
    assert came


def test_another_fault_of_a_function_stays_one():
    with pytest.raises(SystemError, match="another"), interruptible():
        raise SystemError("another")
