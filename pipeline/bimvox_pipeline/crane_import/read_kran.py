"""Read KranXpert's published import format ``.kran``: XML in UTF-8, with decimal points.

The format is described at wiki.kranxpert.com (develop, "Import file format"), file version 2: a ``Crane`` with a
``Load`` for each case and its ``LoadData`` by boom length and radius, and with its hooks. Its example with ``Unit="0"``
is in metres and tonnes; the other codes are not known, so the units must be stated then.
"""

from __future__ import annotations

import re
from xml.etree import ElementTree

from bimvox.errors import InputError
from bimvox_pipeline.crane_import.read_text import TextOptions
from bimvox_pipeline.crane_import.sheet import Sheet, SheetTable, kilograms, metres

_METRIC = "0"
_FLY_JIB = ("AddOn", "ExtensionLength", "AddOnExtensionLength")
"""Attributes of a load that a boom alone does not have."""
_ALL_AROUND = re.compile(r"^\s*(?:360.*)?$")


def read_kran(data: bytes, options: TextOptions) -> Sheet:
    """Return the tables and hooks of a file.

    Raises:
        InputError: If it is not such a file, or if its units are not known.
    """
    root = _root(data)
    crane = root if root.tag == "Crane" else root.find("Crane")
    if root.tag not in ("CraneExportFile", "Crane") or crane is None:
        raise InputError(f"not a file of KranXpert: it begins with {root.tag!r}", hint="give its .kran export, or CSV")
    load_unit, length_unit = options.load_unit, options.length_unit
    if crane.get("Unit", _METRIC).strip() in ("", _METRIC):
        load_unit, length_unit = load_unit or "t", length_unit or "m"
    if load_unit is None or length_unit is None:
        raise InputError(
            f"its Unit is {crane.get('Unit')!r}: only 0, metres and tonnes, is known",
            hint="add --load-unit and --length-unit",
        )
    sheet = Sheet()
    name = " ".join(filter(None, (crane.get("Manufacturer", "").strip(), crane.get("Title", "").strip())))
    if name:
        sheet.facts["name"] = name
    if source := crane.get("Source", "").strip():
        sheet.facts["about"] = source
    for number, load in enumerate(crane.findall("Load"), start=1):
        _read_load(sheet, number, load, load_unit, length_unit)
    if not sheet.tables:
        raise InputError("it has no loads of a main boom", hint="; ".join(sheet.notes) or "export the load tables")
    _read_hooks(sheet, crane, load_unit)
    sheet.notes.append(f"read in {load_unit} and {length_unit}")
    return sheet


def _root(data: bytes) -> ElementTree.Element:
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"not UTF-8 text (byte {error.start})", hint="export it again as .kran") from None
    if "<!DOCTYPE" in text:
        raise InputError("it has a document type; a .kran file has none", hint="export it again as .kran")
    try:
        return ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise InputError(f"line {error.position[0]}: not XML: {error}", hint="export it again as .kran") from None


def _read_load(sheet: Sheet, number: int, load: ElementTree.Element, load_unit: str, length_unit: str) -> None:
    """Add the table of a ``Load``, or a note if it is of a fly jib."""
    beyond = [key for key in _FLY_JIB if _number(load.get(key)) not in (None, 0.0)]
    if beyond:
        sheet.notes.append(
            f"Load {number} is left out: {beyond[0]} is {load.get(beyond[0])!r}, and fly jibs are not read"
        )
        return
    cells: dict[float, dict[float, float]] = {}
    several = False
    for one in load.findall("LoadData"):
        length = _number(one.get("BoomLength")) or _number(load.get("MainBoomLength"))
        radius, mass = _number(one.get("Radius")), _number(one.get("Load"))
        if length is None or radius is None or mass is None or min(length, radius) <= 0.0:
            continue
        column = cells.setdefault(metres(radius, length_unit), {})
        at, kg = metres(length, length_unit), kilograms(mass, load_unit)
        several |= at in column
        column[at] = min(column.get(at, kg), kg)
    lengths = tuple(sorted({at for column in cells.values() for at in column}))
    if not lengths:
        sheet.notes.append(f"Load {number} is left out: no LoadData with BoomLength, Radius and Load")
        return
    if several:
        sheet.notes.append(f"Load {number}: a length is telescoped in several ways; the one that carries least is used")
    table = SheetTable(0, lengths)
    for radius in sorted(cells):
        table.rows.append((radius, tuple(cells[radius].get(length, 0.0) for length in lengths)))
        table.lines.append(0)
    weights = [
        _number(load.get(key)) or 0.0 for key in ("CounterWeight", "CentralCounterWeight", "SuspendCounterWeight")
    ]
    if load.get("CounterWeight", "").strip():
        table.counterweight_kg = kilograms(sum(weights), load_unit)
    table.outriggers = load.get("OutriggerBase", "").strip() or None
    area = load.get("WorkingArea", "").strip()
    table.sector = None if _ALL_AROUND.match(area) else area
    tipping = _number(load.get("TippingLoad"))
    if tipping is not None and 50.0 <= tipping <= 100.0:
        sheet.facts.setdefault("rated_percent", tipping)
    sheet.tables.append(table)


def _read_hooks(sheet: Sheet, crane: ElementTree.Element, load_unit: str) -> None:
    """Add the hook blocks as reevings: the lightest for each number of ropes."""
    hooks: dict[int, dict[str, float]] = {}
    for hook in crane.findall("Hook"):
        ropes, weight = _number(hook.get("Rope")), _number(hook.get("Weight"))
        if ropes is None or ropes < 1 or weight is None:
            continue
        block = {"falls": int(ropes), "hook_block_kg": kilograms(weight, load_unit)}
        if most := _number(hook.get("Load")):
            block["most_kg"] = kilograms(most, load_unit)
        known = hooks.get(int(ropes))
        if known is None or block["hook_block_kg"] < known["hook_block_kg"]:
            hooks[int(ropes)] = block
    if hooks:
        sheet.facts["reeving"] = [hooks[falls] for falls in sorted(hooks)]


def _number(text: str | None) -> float | None:
    """Return a number with a decimal point, with or without a unit behind it; None if there is none."""
    found = re.match(r"\s*([+-]?\d+(?:\.\d+)?)", text or "")
    return None if found is None else float(found[1])
