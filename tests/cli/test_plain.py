"""Names with control characters on a terminal, and Ctrl-C while the program starts."""

import io
import signal
import subprocess
import sys
import time

import pytest
from bimvox_cli.failure import report
from bimvox_cli.output import console_on, facts, rows

from bimvox.errors import InputError
from bimvox.rendering.plain import plain

_NAME = "beam\x1b[31m\x07\x9b2J\u202e"
_SHOWN = "beam\\x1b[31m\\x07\\x9b2J\\u202e"


def test_control_characters_are_written_out() -> None:
    assert plain(_NAME) == _SHOWN
    assert plain("Stütze [1]\nzwei") == "Stütze [1]\nzwei"


def test_no_name_reaches_the_terminal_raw(capsys: pytest.CaptureFixture[str]) -> None:
    stream = io.StringIO()
    facts(console_on(stream), {"name": _NAME, "parts": [{"name": _NAME}], "list": [_NAME, [_NAME]]})
    rows(console_on(stream), ("name",), [(_NAME,)], title=_NAME)
    assert stream.getvalue().count(_SHOWN) == 6
    report(InputError(_NAME, hint=_NAME), as_json=False)
    said = stream.getvalue() + capsys.readouterr().err
    assert said.count(_SHOWN) == 8
    assert not {"\x1b", "\x07", "\x9b", "\u202e"} & set(said)


@pytest.mark.parametrize("after_s", [0.1, 0.2, 0.3, 0.4, 0.6, 0.8])
def test_ctrl_c_while_it_starts_is_quiet(after_s: float) -> None:
    # The interpreter takes 0.05 s to start, before any code of bimvox.
    code = (
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); "
        "from bimvox_cli.start import main; print('on', flush=True); main()"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code, "policy", "list"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "on\n"
    time.sleep(after_s)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert "Traceback" not in said
    assert process.returncode in ((130,) if after_s < 0.15 else (0, 130))


@pytest.mark.parametrize(("error", "handled"), [("KeyboardInterrupt", "SIGINT"), ("SystemExit", "SIGTERM")])
def test_an_interruption_that_a_callback_swallows_comes_back_without_a_traceback(error: str, handled: str) -> None:
    code = (
        "import signal, sys, time; from bimvox_cli import start\n"
        "def end(*_): raise KeyboardInterrupt\n"
        f"signal.signal(signal.{handled}, end); sys.unraisablehook = start._raise_again\n"
        "class Callback:\n"
        f"    def __del__(self): raise {error}\n"
        "try: Callback(); time.sleep(60)\n"
        "except KeyboardInterrupt: print('interrupted')"
    )
    process = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert (process.stdout, process.stderr) == ("interrupted\n", "")
