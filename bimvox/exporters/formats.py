"""Every export format: its name, the suffix of its default file name, and what it is made from.

The one table that ``bimvox export``, its help and its messages use.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path


class Source(StrEnum):
    """What a format is made from."""

    LOG = "log"
    GRID = "grid"


@dataclass(frozen=True, slots=True)
class Format:
    """One format.

    Attributes:
        name: What ``--to`` takes.
        source: What it is made from.
        suffix: Of the default file name, after the source's stem.
        meaning: What the file holds, a few words.
        file_suffix: Suffix of ``--output`` that selects this format when ``--to`` is not given.
        is_dated: Whether the file holds calendar dates, so that ``--start`` applies.
        is_folder: Whether it is a folder.
    """

    name: str
    source: Source
    suffix: str
    meaning: str
    file_suffix: str = ""
    is_dated: bool = False
    is_folder: bool = False


FORMATS = (
    Format("mcap", Source.LOG, ".export.mcap", "the log itself, or some of its lifts", ".mcap"),
    Format("csv", Source.LOG, ".csv", "samples, and tables of lifts and deliveries", ".csv"),
    Format("json", Source.LOG, ".json", "paths, samples and deliveries", ".json"),
    Format("full-rate", Source.LOG, ".full.mcap", "the log with every sample for viewers"),
    Format("page", Source.LOG, ".page.json", "the data of the page, JSON"),
    Format("glb", Source.LOG, ".glb", "animated", ".glb"),
    Format("ros2", Source.LOG, ".ros2", "bag", ".ros2", is_folder=True),
    Format("mjcf", Source.LOG, ".mjcf.xml", "one lift for MuJoCo: crane, rope and load, and its motion"),
    Format("urdf", Source.LOG, ".urdf", "one lift as a robot with masses: crane, rope and load", ".urdf"),
    Format("layout", Source.LOG, ".layout.json", "panels for Foxglove-class viewers"),
    Format("ifc", Source.LOG, ".4d.ifc", "the building's own file with a 4D schedule", ".ifc", is_dated=True),
    Format("msproject", Source.LOG, ".project.xml", "XML", ".xml", is_dated=True),
    Format(
        "unloading",
        Source.LOG,
        ".unloading",
        "folder of site files, one a delivery: its truck is unloaded",
        is_folder=True,
    ),
    Format("vti", Source.GRID, ".vti", "the cells, for ParaView", ".vti"),
    Format("ply", Source.GRID, ".ply", "the faces of every part, for viewers", ".ply"),
    Format("glb", Source.GRID, ".glb", "the faces of every part, for viewers", ".glb"),
)


def formats_of(source: Source) -> tuple[Format, ...]:
    """Return the formats of a log or of a grid, the default first."""
    return tuple(one for one in FORMATS if one.source is source)


def format_for(source: Source, name: str | None, out: Path | None) -> Format | None:
    """Return the format to write.

    ``name`` is what was asked for; None takes the suffix of ``out``, or the default.

    Returns:
        The format; None if a log or grid has no format of that name.
    """
    known = formats_of(source)
    if name is not None:
        return next((one for one in known if one.name == name), None)
    suffix = out.suffix.lower() if out else ""
    return next((one for one in known if suffix and one.file_suffix == suffix), known[0])


def formats_in_words() -> str:
    """Return all formats as two sentences, for a help text."""
    said = []
    for source in Source:
        first, *others = (f"{one.name} ({one.meaning})" for one in formats_of(source))
        said.append(f"Of a {source.value}: {', '.join([first.replace('(', '(default; ', 1), *others])}.")
    return " ".join(said)
