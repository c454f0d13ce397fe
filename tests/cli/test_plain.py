"""Names with control characters on a terminal, and Ctrl-C while the program starts."""

import io

import pytest
from bimvox_cli.failure import report
from bimvox_cli.output import console_on, facts, rows

from bimvox.errors import InputError
from bimvox.rendering.words import plain

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
