"""The act of ``bimvox crane import``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bimvox.errors import InputError
from bimvox.extras import require
from bimvox.files import read_input, write_atomically
from bimvox_pipeline.crane_import.read_text import TextOptions, read_text
from bimvox_pipeline.crane_import.sheet import Sheet, doubtful_in, wrong_in

if TYPE_CHECKING:
    from bimvox.crane.machine import Machine
    from bimvox.progress import Progress

Ask = Callable[[str, str, str], str | None]
"""Asks a person for a key: its name, what it is, and an example; returns TOML, None for the generic machine's value."""

_STANDARD_INPUT = "standard input"
_DRIVE_SHARE = 0.74
"""Share of the motor's power that lifts: 80 t at 12 m/min with 212 kW (Potain MCT 2205; see the catalogue)."""
_G = 9.80665


@dataclass(frozen=True, slots=True)
class ImportOptions:
    """What a person says about the import.

    Attributes:
        kind: ``mobile``, ``luffing`` or ``hammerhead``.
        like: Generic machine whose values stand in for missing keys; None: missing keys are asked for.
        stated: ``KEY=VALUE`` of the machine file.
        text: How a text is read.
    """

    kind: str = "mobile"
    like: str | None = None
    stated: tuple[str, ...] = ()
    text: TextOptions = field(default_factory=TextOptions)


def import_crane(
    source: Path | None,
    pasted: bytes | None,
    out: Path | None,
    options: ImportOptions,
    *,
    ask: Ask | None = None,
    progress: Progress,
) -> dict[str, Any]:
    """Write a machine file from load charts; return the document of ``bimvox crane import --json``.

    Args:
        source: File with the charts, ``.kran`` or a text; None: ``pasted``.
        pasted: Text of standard input.
        out: The machine file; None: by the machine's name, in the current folder.
        options: What a person says.
        ask: Asks for missing keys; None: they are an error.
        progress: Reports stages.

    Raises:
        InputError: If the source has no usable chart, or keys are missing; it names each.
        MissingPackageError: If matplotlib is not installed.
    """
    require("plots", "drawing load charts")
    from bimvox.rendering.report.chart_figure import draw_charts
    from bimvox.site.config.machine_file import MACHINE_FILES
    from bimvox_pipeline.crane_import.machine_text import machine_text

    progress.stage("read")
    where = _STANDARD_INPUT if source is None else str(source)
    sheet = _sheet(source, pasted, options.text, where)
    _refuse_wrong(sheet, where)
    values, comments, assumed = _values(sheet, options, ask, where)
    unknown = _unknown(values, sheet, assumed)
    origin = where if source is None else source.name
    head = [f"{values['name']}, from {origin}. Check it against the machine's own chart."]
    head += [f"Not known: {one}" for one in unknown]
    text = machine_text(values, sheet, comments, head)
    path = out or Path(f"{_file_name(values['name'])}.toml")
    machine = MACHINE_FILES.read(text.encode(), path)
    progress.stage("draw")
    picture = path.with_suffix(".svg")
    drawn = {suffix: draw_charts(machine, file_format=suffix) for suffix in ("svg", "png")}
    inputs = () if source is None else (source,)
    write_atomically(path, text.encode(), inputs=inputs)
    write_atomically(picture, drawn["svg"], inputs=inputs)
    write_atomically(path.with_suffix(".png"), drawn["png"], inputs=inputs)
    progress.finish()
    return {
        "out": str(path),
        "charts": [str(picture), str(path.with_suffix(".png"))],
        "machine": machine.name,
        "kind": machine.kind,
        "lengths_m": list(machine.lengths_m),
        "tables": [
            {
                "line": table.line,
                "lengths_m": list(table.lengths_m),
                "radii_m": [radius for radius, _ in table.rows],
                "counterweight_kg": table.counterweight_kg,
                "outriggers": table.outriggers,
                "sector": table.sector,
                "falls": table.falls,
            }
            for table in sheet.tables
        ],
        "load_moment_tm": round(machine.load_moment_tm, 1),
        "checks": _checks(machine, values, sheet),
        "assumed": assumed,
        "cannot_know": unknown,
        "notes": sheet.notes,
        "seconds": progress.seconds,
    }


def _sheet(source: Path | None, pasted: bytes | None, options: TextOptions, where: str) -> Sheet:
    from bimvox_pipeline.crane_import.read_kran import read_kran

    data = (pasted or b"") if source is None else read_input(source)
    if b"\x00" in data:
        raise InputError(f"{where}: it is not text", hint="give a .kran file (XML), CSV, or text with a table")
    is_xml = data.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<")
    try:
        return read_kran(data, options) if is_xml else read_text(_decoded(data), options)
    except InputError as error:
        raise InputError(f"{where}: {error.message}", hint=error.hint) from None


def _decoded(data: bytes) -> str:
    """Return text in UTF-8, or in the code page of spreadsheets on Windows."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", errors="replace")


def _refuse_wrong(sheet: Sheet, where: str) -> None:
    wrong = [one for table in sheet.tables for one in wrong_in(table)]
    if wrong:
        more = f"; and {len(wrong) - 3} more" if len(wrong) > 3 else ""
        raise InputError(
            f"{where}: {'; '.join(wrong[:3])}{more}",
            hint="compare these cells with the sheet; capacities with a footnote are blanks without --keep-footnoted",
        )


def _values(
    sheet: Sheet, options: ImportOptions, ask: Ask | None, where: str
) -> tuple[dict[str, Any], dict[str, str], list[str]]:
    """Return the keys of the machine file, where those come from that are not the sheet's, and what is assumed."""
    from bimvox_pipeline.crane_import.machine_text import (
        example_of,
        missing_keys,
        nearest_machine,
        stated_values,
        values_of_machine,
    )

    most_kg = max(mass for table in sheet.tables for _, kg in table.rows for mass in kg)
    nearest = options.like or nearest_machine(options.kind, most_kg)
    generic = values_of_machine(nearest, options.kind)
    values: dict[str, Any] = {"kind": options.kind, **sheet.facts}
    for key, value in stated_values(options.stated).items():
        known = values.get(key)
        values[key] = known | value if isinstance(value, dict) and isinstance(known, dict) else value
    values.setdefault("about", f"imported from {where}")
    missing, comments, assumed = missing_keys(values, sheet), {}, []
    for key in list(missing):
        answer = None if ask is None or options.like is not None else ask(key, missing[key], example_of(key, generic))
        if answer:
            values |= stated_values([f"{key}={answer}"])
        elif (options.like is not None or ask is not None) and key in generic:
            values[key] = generic[key]
            comments[key] = f"assumed, of {nearest}"
            assumed.append(f"{key}: of the generic {nearest}")
    if missing := missing_keys(values, sheet):
        told = "; ".join(f"{key} ({words})" for key, words in missing.items())
        example = next(iter(missing))
        rest = "" if options.like else f"; or --like {nearest} for what a generic machine of this size can stand in for"
        raise InputError(
            f"{where}: a machine file needs {len(missing)} more {'key' if len(missing) == 1 else 'keys'}: {told}",
            hint=f"--set '{example}={example_of(example, generic)}', and so on{rest}",
        )
    if "max_wind_m_s" not in values and "max_wind_m_s" in generic:
        values["max_wind_m_s"] = generic["max_wind_m_s"]
        comments["max_wind_m_s"] = f"assumed, of {nearest}"
        assumed.append(f"max_wind_m_s: of the generic {nearest}")
    return values, comments, assumed


def _unknown(values: dict[str, Any], sheet: Sheet, assumed: Sequence[str]) -> list[str]:
    """Return what neither sheet nor person says, in words."""
    unknown = [one.partition(":")[0] + ", assumed" for one in assumed]
    if "rated_percent" not in values or "standard" not in values:
        unknown.append("at which share of the tipping load the charts are rated, and by which standard")
    if values["kind"] == "mobile":
        if all(table.sector is None for table in sheet.tables):
            unknown.append("whether the charts hold in every direction: no sector is stated, so 360 degrees are taken")
        if all(table.counterweight_kg is None for table in sheet.tables) and "masses" not in values:
            unknown.append("counterweight for which the charts hold")
        if not values.get("outriggers"):
            unknown.append("outriggers: no loads on pads")
        if "masses" not in values:
            unknown.append("masses: no loads on outriggers by statics")
    elif "stand" not in values:
        unknown.append("base, ballast, free-standing height and loads on the foundation: stand")
    if "hoist_kw" not in values:
        unknown.append("power of the hoist motor: rates are not checked against it")
    if not values.get("deduction"):
        unknown.append("deductions from the charts, such as a stowed jib")
    return unknown


def _checks(machine: Machine, values: dict[str, Any], sheet: Sheet) -> list[dict[str, Any]]:
    """Return the checks of a machine: name, whether it passed, and what was found."""
    doubts = [one for table in sheet.tables for one in doubtful_in(table)]
    radii = sum(len(table.rows) * len(table.lengths_m) for table in sheet.tables)
    checks = [
        {"name": "monotone", "passed": True, "text": f"{radii} cells: no capacity grows with the radius, no gaps"},
        {
            "name": "moment",
            "passed": not doubts,
            "text": "; ".join(doubts)
            or f"largest load moment {machine.load_moment_tm:.0f} tm, no cell far below its neighbours",
        },
    ]
    power = values.get("hoist_kw")
    needed = max((_power_kw(crane) for crane in machine.cranes), default=0.0)
    if power is not None:
        least = needed / _DRIVE_SHARE
        checks.append(
            {
                "name": "rates",
                "passed": least <= power * 1.05,
                "text": f"hoisting takes {needed:.0f} kW at the rope, about {least:.0f} kW of motor, of {power:g} kW",
            }
        )
    return checks


def _power_kw(crane: Any) -> float:
    """Return the largest power at the rope over the gears, and at the largest load."""
    winch = crane.hoist if crane.luffing is None else crane.luffing.winch
    pairs = [*crane.gears, (crane.chart.capacity_kg[0], min([winch.rate, *(rate for _, rate in crane.gears)]))]
    return max(float(mass_kg * _G * rate) for mass_kg, rate in pairs) / 1e3


def _file_name(name: str) -> str:
    """Return a name as that of a file."""
    kept = "".join(one if one.isalnum() else "-" for one in name.lower())
    return "-".join(filter(None, kept.split("-"))) or "machine"
