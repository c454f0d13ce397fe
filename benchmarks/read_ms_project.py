"""Reads a programme with MPXJ, a third-party Java library, and prints its tasks as JSON.

``python benchmarks/read_ms_project.py FILE [OUT.xer]``; with ``OUT.xer``, MPXJ also writes it for Primavera. Needs
Java and a Python with ``mpxj`` and ``jpype1``, which ``make check-log`` installs; it does not import bimvox.
"""

from __future__ import annotations

import json
import sys
from typing import Any


def tasks_in(path: str, xer: str | None = None) -> list[dict[str, Any]]:
    """Return the tasks of a project file as MPXJ understands them; write them to ``xer``, if given."""
    import jpype
    import mpxj  # noqa: F401 - puts its jars on the class path

    jpype.startJVM("-Xmx512m")
    from org.mpxj import TimeUnit  # type: ignore[import-not-found]
    from org.mpxj.reader import UniversalProjectReader  # type: ignore[import-not-found]

    project = UniversalProjectReader().read(path)
    errors = [str(error) for error in project.getIgnoredErrors()]
    if errors:
        raise SystemExit("\n".join(errors))
    if xer is not None:
        from org.mpxj.primavera import PrimaveraXERFileWriter  # type: ignore[import-not-found]

        for task in project.getTasks():
            task.setPlannedStart(task.getStart())  # XER has planned dates; Microsoft Project's are plain ones
            task.setPlannedFinish(task.getFinish())
        PrimaveraXERFileWriter().write(project, xer)
    properties = project.getProjectProperties()
    return [
        {
            "id": int(task.getID()),
            "name": str(task.getName()),
            "start": str(task.getStart()),
            "finish": str(task.getFinish()),
            "duration_s": 60.0 * float(length.convertUnits(TimeUnit.ELAPSED_MINUTES, properties).getDuration()),
            "is_elapsed": bool(length.getUnits().isElapsed()),
            "text1": None if task.getText(1) is None else str(task.getText(1)),
            "after": [[int(one.getPredecessorTask().getID()), str(one.getType())] for one in task.getPredecessors()],
            "resources": [str(one.getResource().getName()) for one in task.getResourceAssignments()],
            "is_summary": bool(task.getSummary()),
        }
        for task in project.getTasks()
        if (length := task.getDuration()) is not None  # Primavera's summaries have none
    ]


if __name__ == "__main__":
    print(json.dumps(tasks_in(*sys.argv[1:])))
