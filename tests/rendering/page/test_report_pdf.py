"""The report printed by a real browser."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest
from bimvox_pipeline.report import report
from log_building import tiny_log

from bimvox.log.recorder import write_log
from bimvox.progress import SilentProgress

pytestmark = pytest.mark.browser


def test_a_report_is_printed_and_the_same_log_gives_the_same_bytes(tmp_path: Path):
    log, out = tmp_path / "tiny.mcap", tmp_path / "x.pdf"
    with log.open("wb") as stream:
        write_log(stream, tiny_log(crane=True))
    report(log, out, proven=False, progress=SilentProgress())
    first = out.read_bytes()
    assert first.startswith(b"%PDF-")
    assert len(re.findall(rb"/Type\s*/Page\b", first)) >= 2
    report(log, out, proven=False, progress=SilentProgress())
    assert out.read_bytes() == first
    assert os.environ["HOME"].encode() not in first or os.environ["HOME"] == "/"
