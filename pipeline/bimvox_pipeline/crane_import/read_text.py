"""Read load charts from CSV, or from text as people paste it: radius by boom length."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from bimvox.errors import InputError
from bimvox_pipeline.crane_import.sheet import LENGTHS_M, LOADS_KG, Sheet, SheetTable, kilograms, metres

_BLANK = frozenset(("", "-", "--", "---", "\u2013", "\u2014", "\u2212", "x", "n/a", "na", "...", "\u2026", "."))
_MARK = r"(\*+|[\u2020\u2021\u00a7#]|[\u00b9\u00b2\u00b3\u2074-\u2079]+|\(?[0-9a-zA-Z]\))"
_NOTE = re.compile(rf"\s*{_MARK}$")
_NUMBER = re.compile(r"^\+?\d[\d.,'\u2019 ]*$")
_UNIT_AFTER = re.compile(r"^(.*?\d)\s*(m|ft|feet|'|\u2032|t|kg|lbs?|klb|kips?|kN)\.?$", re.IGNORECASE)
_FOOTNOTE_LINE = re.compile(rf"^\s*{_MARK}\s*[:.]?\s*(?=\D{{3}})(.+)$")
_LOAD_WORDS = (
    (re.compile(r"\b1[,.' ]?000\s*(?:lbs?|pounds)\b|(?<![a-z])(?:klbs?|kips?)\b", re.IGNORECASE), "klb"),
    (re.compile(r"(?<![a-z])(?:lbs?|pounds?)\b", re.IGNORECASE), "lb"),
    (re.compile(r"(?<![A-Za-z])kN\b"), "kN"),
    (re.compile(r"(?<![a-z])(?:kgs?|kilograms?)\b", re.IGNORECASE), "kg"),
    (re.compile(r"\bshort tons?\b|\bUS tons?\b", re.IGNORECASE), "short_ton"),
    (re.compile(r"(?<![A-Za-z])(?:t|tonnes?|metric tons?|Tonnen?)\b"), "t"),
)
_LENGTH_WORDS = (
    (re.compile(r"(?<![a-z])(?:ft|feet|foot)\b|\d\s*['\u2032]", re.IGNORECASE), "ft"),
    (re.compile(r"(?<![a-z])(?:m|met(?:re|er)s?)\b", re.IGNORECASE), "m"),
)
_META = re.compile(r"^\s*([A-Za-zÀ-ÿ][\wÀ-ÿ /-]*?)\s*[:=]\s*(\S.*?)\s*$")
_META_KEYS = {
    "name": ("name", "crane", "machine", "model", "kran", "type"),
    "about": ("about", "source", "edition", "data sheet", "quelle"),
    "standard": ("standard", "norm"),
    "rated_percent": ("rated", "rated at", "rating", "tipping"),
    "counterweight": ("counterweight", "counter weight", "ballast", "gegengewicht"),
    "outriggers": ("outriggers", "outrigger base", "outrigger", "base", "abstützung", "abstützbasis"),
    "sector": ("sector", "working area", "area", "arbeitsbereich"),
    "falls": ("falls", "reeving", "parts of line", "strands", "einscherung"),
    "load_unit": ("load unit", "loads in", "capacities in", "capacity in"),
    "length_unit": ("length unit", "lengths in", "radius in"),
}
_KEY_OF = {word: key for key, words in _META_KEYS.items() for word in words}
_ALL_AROUND = re.compile(r"360|all round|all around|ringsum", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class TextOptions:
    """How a text is read.

    Attributes:
        load_unit: Unit of loads; None: as the text says.
        length_unit: Unit of lengths; None: as the text says.
        decimal: Decimal mark, ``.`` or ``,``; None: as the numbers look.
        keep_footnoted: Whether capacities with a footnote are used.
    """

    load_unit: str | None = None
    length_unit: str | None = None
    decimal: str | None = None
    keep_footnoted: bool = False


@dataclass(slots=True)
class _Line:
    number: int
    text: str
    cells: list[str]
    ends: list[int]


def read_text(text: str, options: TextOptions) -> Sheet:
    """Return the tables of a text.

    Lengths stand in the row above each table, radii in its first column. Blanks are empty cells or dashes; a footnote
    is a mark behind a capacity. Lines such as ``counterweight: 12 t`` before a table say what it holds for.

    Raises:
        InputError: If there is no table, a unit is not known, or a row does not fit; it names the line.
    """
    lines = _lines(text)
    load_unit, length_unit = (
        options.load_unit or _unit(lines, _LOAD_WORDS),
        options.length_unit or _unit(lines, _LENGTH_WORDS),
    )
    missing = [
        f"--{key} ({', '.join(names)})"
        for key, unit, names in (("load-unit", load_unit, LOADS_KG), ("length-unit", length_unit, LENGTHS_M))
        if unit is None
    ]
    if missing:
        raise InputError(
            f"the table does not say its units: {' and '.join(missing)} missing",
            hint="add them, or write them into the text: 'loads in: t'",
        )
    assert load_unit is not None
    assert length_unit is not None
    return _Reader(lines, load_unit, length_unit, _decimal(lines, load_unit, options.decimal), options).read()


class _Reader:
    """Reads lines in turn: what a table holds for, its lengths, its rows."""

    def __init__(
        self, lines: Sequence[_Line], load_unit: str, length_unit: str, decimal: str, options: TextOptions
    ) -> None:
        self._lines, self._options = lines, options
        self._load, self._length, self._decimal = load_unit, length_unit, decimal
        self._sheet = Sheet()
        self._said: dict[str, str] = {}
        self._footnoted: dict[str, list[str]] = {}
        self._table: SheetTable | None = None
        self._ends: list[int] = []

    def read(self) -> Sheet:
        for line in self._lines:
            if not line.text.strip():
                if self._table is not None and self._table.rows:
                    self._table = None
            elif not self._is_row_of_numbers(line):
                self._words(line)
            elif self._table is None:
                self._header(line)
            else:
                self._row(line)
        self._sheet.tables = [table for table in self._sheet.tables if table.rows]
        if not self._sheet.tables:
            raise InputError(
                "there is no table of radius by boom length",
                hint="first a row with the lengths, then rows of radius and capacities: '10; 10.4; 9.4'",
            )
        self._tell_footnotes()
        self._turn_if_turned()
        self._sheet.notes.append(f"read in {self._load} and {self._length}, decimal mark '{self._decimal}'")
        return self._sheet

    def _is_row_of_numbers(self, line: _Line) -> bool:
        cells = [cell for cell in line.cells if cell.lower() not in _BLANK]
        if not cells or _META.match(line.text) or _FOOTNOTE_LINE.match(line.text):
            return False
        values = [cell for cell in cells if self._value(cell) is not None]
        words = [cell for cell in cells if self._value(cell) is None]
        if self._table is None:
            # The corner of a header has words.
            return bool(values) and all(self._value(cell) is not None for cell in cells[len(words) :])
        return not words and len(line.cells) > 1

    def _words(self, line: _Line) -> None:
        found = _META.match(line.text)
        key = _KEY_OF.get(found[1].strip().lower()) if found else None
        if found and key:
            self._table = None
            self._said[key] = found[2].strip("\t ;|")
            self._fact(key, found[2].strip("\t ;|"))
            return
        note = _FOOTNOTE_LINE.match(line.text)
        if note and note[1] in self._footnoted:
            self._footnoted[note[1]].append(f"{note[1]} {note[2].strip()}")
            return
        if not all(cell.lower() in _BLANK or _is_unit(cell) for cell in line.cells):
            self._sheet.notes.append(f"line {line.number}, not read: {line.text.strip()[:100]}")

    def _fact(self, key: str, value: str) -> None:
        if key in ("name", "about", "standard"):
            self._sheet.facts[key] = value
        elif key == "rated_percent" and (found := re.search(r"\d+(?:[.,]\d+)?", value)):
            self._sheet.facts[key] = float(found[0].replace(",", "."))

    def _header(self, line: _Line) -> None:
        values = [(n, self._value(cell)) for n, cell in enumerate(line.cells)]
        # In separated cells the first is the corner above the radii.
        numbers = [(n, value) for n, value in values if value is not None and (n > 0 or line.ends)]
        lengths = tuple(metres(value, self._length) for _, value in numbers)
        self._table = SheetTable(line.number, lengths)
        self._say_what_it_holds_for(self._table)
        self._ends = [line.ends[n] for n, _ in numbers] if line.ends else []
        self._sheet.tables.append(self._table)

    def _say_what_it_holds_for(self, table: SheetTable) -> None:
        said = self._said
        if "counterweight" in said:
            table.counterweight_kg = self._mass(said["counterweight"], table.line)
        table.outriggers = said.get("outriggers")
        if "sector" in said and not _ALL_AROUND.search(said["sector"]):
            table.sector = said["sector"]
        if "falls" in said and (found := re.search(r"\d+", said["falls"])):
            table.falls = int(found[0])

    def _mass(self, words: str, line: int) -> float:
        found = re.search(r"[\d.,' ]*\d", words)
        unit = next((unit for pattern, unit in _LOAD_WORDS if pattern.search(words)), self._load)
        value = None if found is None else _parsed(found[0].strip(), self._decimal)
        if value is None:
            raise InputError(f"before line {line}: counterweight {words!r} is not a mass", hint="write it as '12 t'")
        return kilograms(value, unit)

    def _row(self, line: _Line) -> None:
        table = self._table
        assert table is not None
        cells = self._aligned(line)
        if len(cells) != len(table.lengths_m) + 1:
            raise InputError(
                f"line {line.number}: {len(cells) - 1} capacities for {len(table.lengths_m)} lengths",
                hint="write a dash for a blank, or use tabs or semicolons between the cells",
            )
        radius = self._value(cells[0])
        if radius is None:
            raise InputError(f"line {line.number}: {cells[0]!r} is not a radius", hint="the first column has the radii")
        radius_m = metres(radius, self._length)
        capacities = tuple(
            self._capacity(cell, radius_m, length, line.number)
            for cell, length in zip(cells[1:], table.lengths_m, strict=True)
        )
        table.rows.append((radius_m, capacities))
        table.lines.append(line.number)

    def _aligned(self, line: _Line) -> list[str]:
        """Return radius and capacities; in text without separators, blanks by their place under the lengths."""
        table = self._table
        assert table is not None
        wanted = len(table.lengths_m) + 1
        if not line.ends:
            cells = line.cells[: max(wanted, _last_filled(line.cells))]
            return cells + [""] * (wanted - len(cells))
        if len(line.cells) == wanted or not self._ends:
            return line.cells
        result = [line.cells[0], *[""] * len(self._ends)]
        for cell, end in zip(line.cells[1:], line.ends[1:], strict=True):
            nearest = min(range(len(self._ends)), key=lambda n: abs(self._ends[n] - end))
            if result[1 + nearest]:
                return line.cells  # too many: the row does not fit
            result[1 + nearest] = cell
        return result

    def _capacity(self, cell: str, radius_m: float, length_m: float, line: int) -> float:
        bare = cell.strip()
        if bare.lower() in _BLANK:
            return 0.0
        mark = _NOTE.search(bare)
        value = self._value(bare)
        if value is None:
            raise InputError(f"line {line}: {cell!r} is not a capacity", hint="write a number, or a dash for a blank")
        kg = kilograms(value, self._load)
        if mark is None or _NUMBER.match(bare):
            return kg
        used = "used" if self._options.keep_footnoted else "left out"
        said = f"{kg / 1000:g} t at {radius_m:g} m, {length_m:g} m: {used}"
        self._footnoted.setdefault(mark[0].strip(), []).append(said)
        return kg if self._options.keep_footnoted else 0.0

    def _value(self, cell: str) -> float | None:
        bare = cell.strip()
        while (mark := _NOTE.search(bare)) and not _NUMBER.match(bare):
            bare = bare[: mark.start()]
        if (unit := _UNIT_AFTER.match(bare)) is not None:
            bare = unit[1]
        return _parsed(bare, self._decimal)

    def _tell_footnotes(self) -> None:
        for mark, said in self._footnoted.items():
            self._sheet.notes.append(f"footnote {mark}: {'; '.join(said)}")

    def _turn_if_turned(self) -> None:
        """Turn a table whose radii run along its rows: no hook reaches further than its boom is long."""
        for table in self._sheet.tables:
            filled = [
                (radius, length)
                for radius, capacities in table.rows
                for length, kg in zip(table.lengths_m, capacities, strict=True)
                if kg
            ]
            if all(radius <= _reach_m(length) for radius, length in filled) or any(
                length > _reach_m(radius) for radius, length in filled
            ):
                continue
            lengths = tuple(radius for radius, _ in table.rows)
            columns = list(zip(*(kg for _, kg in table.rows), strict=True))
            table.rows = list(zip(table.lengths_m, columns, strict=True))
            table.lines, table.lengths_m = [table.line] * len(table.rows), lengths
            self._sheet.notes.append(f"{table.name}: radii run along its rows; it was turned")


def _reach_m(length_m: float) -> float:
    """Return the largest radius that a boom could have: its length, and a pivot ahead of the slewing axis."""
    return length_m + 3.0


def _last_filled(cells: Sequence[str]) -> int:
    return max((n + 1 for n, cell in enumerate(cells) if cell.strip()), default=0)


def _is_unit(cell: str) -> bool:
    words = cell.strip("()[] ")
    return any(pattern.fullmatch(words) for pattern, _ in (*_LOAD_WORDS, *_LENGTH_WORDS))


def _unit(lines: Sequence[_Line], words: Sequence[tuple[re.Pattern[str], str]]) -> str | None:
    """Return the first unit that the text names; None if it names none."""
    counterweight = re.compile(r"^\s*(?:counter ?weight|ballast|gegengewicht)\b", re.IGNORECASE)
    for line in lines:
        if counterweight.match(line.text):
            continue
        for pattern, unit in words:
            if pattern.search(line.text):
                return unit
    return None


def _lines(text: str) -> list[_Line]:
    """Return the lines in cells: by tab, semicolon, bar or comma, whichever the text uses; otherwise by spaces."""
    raw = text.replace("\r\n", "\n").replace("\r", "\n").replace("\u00a0", " ").split("\n")
    # A unit or a footnote joins its number; the spaces go behind it, so that columns stay where they are.
    joined = [re.sub(r"(\d)( +)(m|ft|t|kg|lbs?|kN)\b(?!\w)", r"\1\3\2", line) for line in raw]
    joined = [re.sub(r"(\d)( +)(\(?[0-9a-zA-Z]\))(?=\s|$)", r"\1\3\2", line) for line in joined]
    mark = _separator(joined)
    result = []
    for number, line in enumerate(joined, start=1):
        if mark is None:
            found = list(re.finditer(r"\S+", line))
            result.append(_Line(number, line, [one[0] for one in found], [one.end() for one in found]))
            continue
        inside = line.strip().strip("|") if mark == "|" else line
        cells = [cell.strip().strip('"').strip() for cell in inside.split(mark)]
        # The ruled line of a table in Markdown is not the end of the table.
        is_rule = mark == "|" and all(set(cell) <= set("-: ") for cell in cells)
        result.append(_Line(number, line, [] if is_rule else cells, []))
    return [line for line in result if line.cells or not line.text.strip()]


def _separator(lines: Sequence[str]) -> str | None:
    numbers = [line for line in lines if len(re.findall(r"\d", line)) > 1 and not _META.match(line)]
    for mark in "\t;|":
        if numbers and sum(line.count(mark) > 0 for line in numbers) * 2 >= len(numbers):
            return mark
    spaced = [line for line in numbers if len(re.findall(r"\d[*)\w]*\s+[-\d]", line)) > 0]
    commas = [line for line in numbers if line.count(",") > 0 and not re.search(r"\d\s+[-\u2013\d]", line)]
    lists = [line for line in numbers if re.search(r"\d,\s", line)]
    if numbers and (len(commas) * 2 >= len(numbers) or len(lists) * 2 >= len(numbers)) and len(spaced) < len(numbers):
        return ","
    return None


def _decimal(lines: Sequence[_Line], load_unit: str, given: str | None) -> str:
    """Return the decimal mark of the numbers."""
    if given is not None:
        return given
    cells = [re.sub(r"[^\d.,]", "", cell) for line in lines if not _META.match(line.text) for cell in line.cells]
    both = [cell for cell in cells if "," in cell and "." in cell]
    if both:
        return "," if both[0].rfind(",") > both[0].rfind(".") else "."
    for mark, other in ((",", "."), (".", ",")):
        own = [cell.strip(".,") for cell in cells if mark in cell.strip(".,")]
        grouped = all(re.fullmatch(rf"\d{{1,3}}(\{mark}\d{{3}})+", cell) for cell in own)
        if own and grouped and (load_unit in ("kg", "lb") or any(other in cell.strip(".,") for cell in cells)):
            return other  # it separates thousands
        if own:
            return mark
    return "."


def _parsed(text: str, decimal: str) -> float | None:
    """Return a number; None if the text is not one."""
    bare = text.strip().removeprefix("+")
    if not bare or not _NUMBER.match(bare):
        return None
    thousands = "," if decimal == "." else "."
    bare = re.sub(r"['\u2019 ]", "", bare).replace(thousands, "").replace(decimal, ".")
    try:
        return float(bare)
    except ValueError:
        return None
