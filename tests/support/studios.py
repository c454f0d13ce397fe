"""A studio that serves a folder, in a process of its own."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

ENVIRONMENT = os.environ | {"PYTHONUNBUFFERED": "1"}


@contextmanager
def served(folder: Path, errors: IO[str] | None = None) -> Iterator[str]:
    """Yield the address of `bimvox studio` in a folder; it ends with the block. What it says goes to ``errors``."""
    command = [sys.executable, "-m", "bimvox_cli", "studio", str(folder), "--no-browser", "--json"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors, text=True, env=ENVIRONMENT)
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        assert line, "the studio ended before it was ready"
        yield json.loads(line)["url"]
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(30)
