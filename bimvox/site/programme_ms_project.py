"""Reader of Microsoft Project's XML (schema http://schemas.microsoft.com/project)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from xml.etree import ElementTree

from bimvox.bim.task_ranks import Link
from bimvox.site.programme_table import ProgrammeTable, Row, date_of

_LINKS = {"0": Link.FINISH_FINISH, "1": Link.FINISH_START, "3": Link.START_START}


def read_ms_project(data: bytes) -> ProgrammeTable:
    """Return the tasks of a file.

    Raises:
        ValueError: If it is not Microsoft Project XML in UTF-8, was cut off, has a document type, or has no tasks.
    """
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"line {_line(data, error.start)}: not UTF-8 text") from None
    if "<!DOCTYPE" in text:
        at = text[: text.index("<!DOCTYPE")].count("\n") + 1
        raise ValueError(f"line {at}: it has a document type; a programme has none")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        line, _ = error.position
        cut = line >= text.count("\n") + 1 and "no element found" in str(error) and bool(text.strip())
        told = f"line {line}: it was cut off: the XML ends too early" if cut else f"line {line}: not XML: {error}"
        raise ValueError(told) from None
    except ValueError as error:
        raise ValueError(f"not XML: {error}") from None
    entries = [task for task in _all(root, "Tasks", "Task") if _text(task, "IsNull") != "1"]
    if not entries or _local(root.tag) != "Project":
        raise ValueError("it has no tasks of Microsoft Project")
    number = {_text(task, "UID"): n for n, task in enumerate(entries)}
    above = _above(entries)
    wholes = {one for own in above for one in own[-1:]}
    links = []
    for n, task in enumerate(entries):
        for link in _all(task, "PredecessorLink"):
            first, kind = number.get(_text(link, "PredecessorUID")), _LINKS.get(_text(link, "Type") or "1")
            if first is not None and kind is not None:
                links.append((first, n, kind))
    rows = []
    for n, task in enumerate(entries):
        name = _text(task, "Name") or f"task {_text(task, 'ID')}"
        start, finish = (date_of(_text(task, key), f"task {name!r}: {key}") for key in ("Start", "Finish"))
        is_summary = n in wholes or _text(task, "Summary") == "1"
        rows.append(Row(name, above[n], " ".join(task.itertext()), start, finish, is_summary))
    return ProgrammeTable(rows, links)


def _above(entries: Sequence[ElementTree.Element]) -> list[tuple[int, ...]]:
    """Return the tasks above each, from the outline levels."""
    above, open_ = [], list[tuple[int, int]]()
    for n, task in enumerate(entries):
        text = _text(task, "OutlineLevel")
        level = int(text) if text.isdecimal() and len(text) < 9 else 1
        open_ = [(own, m) for own, m in open_ if own < level]
        above.append(tuple(m for _, m in open_))
        open_.append((level, n))
    return above


def _line(data: bytes, at: int) -> int:
    return data[:at].count(b"\n") + 1


def _all(parent: ElementTree.Element, *names: str) -> Iterator[ElementTree.Element]:
    if not names:
        yield parent
        return
    for child in parent:
        if _local(child.tag) == names[0]:
            yield from _all(child, *names[1:])


def _text(parent: ElementTree.Element, name: str) -> str:
    return next(((child.text or "").strip() for child in parent if _local(child.tag) == name), "")


def _local(tag: str) -> str:
    return tag.rpartition("}")[2]
