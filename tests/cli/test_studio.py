"""``bimvox studio`` as a process: it answers at the printed address, and Ctrl-C ends it and its plans."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
import sys
import urllib.error
import urllib.request
from pathlib import Path

import pytest
from bimvox_cli import main

SAMPLES = Path(__file__).parents[2] / "sample_models"


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="sends signals")
def test_it_answers_at_the_printed_address_until_it_is_interrupted(tmp_path: Path) -> None:
    shutil.copy(SAMPLES / "frame.ifc", tmp_path)
    command = [sys.executable, "-m", "bimvox_cli", "studio", str(tmp_path / "frame.ifc"), "--no-browser", "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        url = json.loads(process.stdout.readline())["url"]
        assert url.startswith("http://127.0.0.1:")
        assert url.endswith("&open=frame.ifc")
        with urllib.request.urlopen(url, timeout=30) as answer:
            assert b"/web/studio/main.mjs" in answer.read()
        with pytest.raises(urllib.error.HTTPError) as refused:
            urllib.request.urlopen(url.partition("?")[0], timeout=30)
        assert refused.value.code == 403
        process.send_signal(signal.SIGINT)
        assert process.wait(30) == 0
        assert process.stderr is not None
        assert "Traceback" not in process.stderr.read()


def test_what_is_not_there_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main.run(["studio", str(tmp_path / "none.ifc"), "--no-browser"]) == 2
    assert "none.ifc" in capsys.readouterr().err
