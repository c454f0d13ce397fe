"""What stops a command takes effect once, after an import, and is never lost."""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from bimvox_cli.stop import stoppable

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="sends signals")


@pytest.fixture(autouse=True)
def _signals_are_heard() -> Iterator[None]:
    """What started the tests may ignore a signal."""
    before = {
        number: signal.signal(number, signal.SIG_DFL) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    }
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


def _send(number: int) -> None:
    os.kill(os.getpid(), number)


@pytest.mark.parametrize(
    ("number", "error", "code"),
    [(signal.SIGINT, KeyboardInterrupt, None), (signal.SIGTERM, SystemExit, 143), (signal.SIGHUP, SystemExit, 129)],
)
def test_each_signal_stops_the_command(number: int, error: type[BaseException], code: int | None) -> None:
    with pytest.raises(error) as caught, stoppable() as stop:
        _send(number)
        time.sleep(60)
    assert stop.raised is caught.value
    assert getattr(caught.value, "code", None) == code
    assert signal.getsignal(number) is signal.SIG_DFL


def test_a_module_is_imported_to_its_end_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "swallows.py").write_text(
        "import os, signal, time\n"
        "try:\n"
        "    os.kill(os.getpid(), signal.SIGINT)\n"
        "    time.sleep(0.05)\n"
        "except BaseException:\n"
        "    half = True\n"
        "whole = True\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(KeyboardInterrupt), stoppable():
        import swallows  # type: ignore[import-not-found]

        time.sleep(60)
    assert swallows.whole
    assert not hasattr(swallows, "half")


def test_a_signal_at_the_last_import_of_a_command_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "last_one.py").write_text("import os, signal\nos.kill(os.getpid(), signal.SIGINT)\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr("bimvox_cli.stop._AGAIN_S", 60.0)  # longer than the rest of the command
    monkeypatch.delitem(sys.modules, "last_one", raising=False)
    with stoppable() as stop:
        import last_one  # type: ignore[import-not-found]  # noqa: F401

        with pytest.raises(KeyboardInterrupt) as caught:
            stop.overdue()
    assert stop.raised is caught.value


def test_an_import_that_does_not_end_is_interrupted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "never_done.py").write_text(
        "import os, signal, time\nos.kill(os.getpid(), signal.SIGINT)\ntime.sleep(60)\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr("bimvox_cli.stop._LONGEST_IMPORT_S", 0.1)
    monkeypatch.setattr("bimvox_cli.stop._ONE_STOP_S", 0.1)
    monkeypatch.delitem(sys.modules, "never_done", raising=False)
    with pytest.raises(KeyboardInterrupt), stoppable():
        import never_done  # type: ignore[import-not-found]  # noqa: F401


def test_a_signal_sent_twice_does_not_interrupt_the_tidying_up() -> None:
    tidied = []
    with pytest.raises(SystemExit), stoppable():
        try:
            _send(signal.SIGTERM)
            time.sleep(60)
        finally:
            _send(signal.SIGTERM)
            _send(signal.SIGINT)
            tidied.append(True)
    assert tidied


@pytest.mark.parametrize(
    ("number", "error", "code"),
    [(signal.SIGINT, KeyboardInterrupt, None), (signal.SIGTERM, SystemExit, 143), (signal.SIGHUP, SystemExit, 129)],
)
def test_what_a_callback_swallows_comes_back_without_a_traceback(
    number: int, error: type[BaseException], code: int | None, capfd: pytest.CaptureFixture[str]
) -> None:
    class Callback:
        def __del__(self) -> None:
            _send(number)
            time.sleep(60)

    with pytest.raises(error) as caught, stoppable():
        Callback()
        time.sleep(60)
    assert getattr(caught.value, "code", None) == code
    assert capfd.readouterr().err == ""


def test_a_signal_that_the_process_ignores_stays_ignored() -> None:
    signal.signal(signal.SIGHUP, signal.SIG_IGN)  # nohup
    with stoppable() as stop:
        _send(signal.SIGHUP)
        time.sleep(0.01)
    assert stop.raised is None
    assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN


def test_an_import_that_swallows_it_is_not_the_end_of_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "swallower.py").write_text(
        "import os, signal, time\n"
        "try:\n"
        "    os.kill(os.getpid(), signal.SIGINT)\n"
        "    time.sleep(60)\n"
        "except BaseException:\n"
        "    pass\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr("bimvox_cli.stop._LONGEST_IMPORT_S", 0.05)
    monkeypatch.setattr("bimvox_cli.stop._ONE_STOP_S", 0.1)
    with pytest.raises(KeyboardInterrupt), stoppable():
        import swallower  # type: ignore[import-not-found]  # noqa: F401

        time.sleep(60)


def test_nothing_is_sent_after_the_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    test_an_import_that_does_not_end_is_interrupted(tmp_path, monkeypatch)
    came: list[int] = []
    signal.signal(signal.SIGINT, lambda number, _frame: came.append(number))
    time.sleep(0.3)
    assert came == []
