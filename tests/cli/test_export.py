import pytest
from bimvox_cli.main import run
from planned_frame import planned


@pytest.mark.parametrize(("to", "has_messages"), [("csv", True), ("msproject", False)])
def test_messages_are_counted_where_a_format_has_any(to, has_messages, tmp_path, capsys):
    assert run(["export", str(planned() / "frame.mcap"), "--to", to, "-o", str(tmp_path / "out.x")]) == 0
    facts = [line.split()[0] for line in capsys.readouterr().out.splitlines() if line.strip()]
    assert "lifts" in facts
    assert ("messages" in facts) == has_messages
