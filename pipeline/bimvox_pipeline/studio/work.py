"""What takes long, in a process of its own: ``python -m bimvox_pipeline.studio.work plan|watch|document ...``.

The further arguments are folder of the studio, site, log, obstruction file and, of a watch, its speed, of a document,
its suffix. The process reads and writes the files of a user in that folder alone.

A line of JSON on stdout for each step: ``{"stage", "done", "of"}``. A plan or a document ends with the ``document`` of
its command with ``--json``; a watch says each ``event`` of ``bimvox watch --json``, and ``clock`` when the site's clock
starts. Each may end with an ``error``.
"""

from __future__ import annotations

import json
import os
import sys
import time
from contextlib import closing, suppress
from pathlib import Path
from typing import Any

from bimvox.errors import BimvoxError
from bimvox.files import keep_process_to
from bimvox.progress import SilentProgress
from bimvox_pipeline.studio.documents import make

_EVERY_S = 0.1


class _Lines(SilentProgress):
    """Says how far a plan is, a few times a second."""

    def __init__(self) -> None:
        super().__init__()
        self._said: tuple[str | None, float] = (None, 0.0)

    def shown(self) -> None:
        now_s = time.monotonic()
        if self._said[0] != self.name or now_s - self._said[1] > _EVERY_S:
            self._said = (self.name, now_s)
            say({"stage": self.name, "done": self.done, "of": self.total})


def say(document: dict[str, Any]) -> None:
    """Print a line of JSON."""
    print(json.dumps(document, allow_nan=False, default=str), flush=True)


def main() -> int:
    """Plan or watch a site, or make a document of its plan, and say how it goes."""
    kind, folder, *files, how = sys.argv[1:]
    site, log, obstructions = map(Path, files)
    keep_process_to(Path(folder))
    try:
        if kind == "watch":
            _watch(site, log, obstructions, how)
        elif kind == "document":
            say({"document": make(log, site, how, _Lines())})
        else:
            from bimvox_pipeline.plan import plan

            given = obstructions if os.path.lexists(obstructions) else None
            say({"document": plan(site, log, obstructions=given, progress=_Lines())})
    except BimvoxError as error:
        say({"error": {"error": error.message, "where": getattr(error, "key", None), "hint": error.hint}})
        return 1
    return 0


def _watch(site: Path, log: Path, obstructions: Path, speed: str) -> None:
    from bimvox_pipeline.watch.plan import WatchWish
    from bimvox_pipeline.watch.watch import watch

    def started(time_s: float) -> None:
        say({"event": {"event": "clock", "time_s": time_s, "speed": float(speed or 0.0)}})

    wish = WatchWish(speed=float(speed) if speed else None, clock_started=started)
    changes = watch(obstructions, site=site, out=log, how=wish, progress=_Lines())
    with suppress(KeyboardInterrupt), closing(changes):
        for change in changes:
            say({"event": change})


if __name__ == "__main__":
    sys.exit(main())
