"""What is printed, and where: results on stdout, progress and notes on stderr."""

from __future__ import annotations

import json
import math
import os
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any

from bimvox.rendering.words import plain
from bimvox_cli.failure import exit_code_of, report_runs

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from bimvox.progress import Progress

ROWS_SHOWN = 20
_WIDTH_OFF_TERMINAL = 160
_IDS = frozenset({"id", "component", "global id", "sha256"})
_UNITS = dict.fromkeys(("m", "m2", "m3", "s", "ms", "kg", "t", "h")) | {
    "m_s": "m/s",
    "deg": "degrees",
    "rad": "degrees",
}
_UNIT = re.compile(rf"(?P<name>(?!hours_).+?)_(?P<unit>{'|'.join(sorted(_UNITS, key=len, reverse=True))})")
_LEAST_WIDTH = 40
_LEAST_CUT = 12
_MOST_INDENTED = 10_000
_WRITTEN_AT_ONCE = 1 << 20


class Output:
    """The output of one run of a command, with the progress that the pipeline reports to."""

    def __init__(self, *, as_json: bool, quiet: bool, progress: Progress, verbose: bool = False) -> None:
        self.as_json = as_json
        self.quiet = quiet
        self.verbose = verbose and not quiet
        self.progress = progress

    def result(self, document: Mapping[str, Any], show: Callable[[Console, Mapping[str, Any]], None]) -> int:
        """Print the result of a command: as JSON, otherwise as text unless quiet. Return the exit code."""
        self.progress.finish()
        if self.as_json:
            print_json(document)
        elif not self.quiet:
            show(console_on(sys.stdout), document)
        report_runs(document)
        return exit_code_of(document)

    def answer(self, document: Mapping[str, Any], show: Callable[[Console, Mapping[str, Any]], None]) -> int:
        """Print an answer: as JSON, otherwise as text, also if quiet. Return the exit code."""
        self.progress.finish()
        if self.as_json:
            print_json(document)
        else:
            show(console_on(sys.stdout), document)
        return exit_code_of(document)

    def line(self, document: Mapping[str, Any], text: str) -> None:
        """Print one of a stream of documents: a JSON object a line, otherwise a line of text."""
        if self.as_json:
            print(_dumped(document, indent=None), flush=True)
        elif not self.quiet:
            print(plain(text), flush=True)

    @contextmanager
    def notes_held(self) -> Iterator[None]:
        """Print no notes in the block, unless verbose or it fails; whoever shows the result says how many there are."""
        from bimvox_cli.live import LiveProgress

        live = self.progress
        if self.verbose or not isinstance(live, LiveProgress):
            yield
            return
        live.held = []
        try:
            yield
        except BaseException:
            live.released()
            raise

    def next_step(self, text: str) -> None:
        """Suggest what to do next, on stderr."""
        if not (self.quiet or self.as_json):
            print(plain(text), file=sys.stderr)


@contextmanager
def open_output(*, as_json: bool, quiet: bool, verbose: bool = False) -> Iterator[Output]:
    """Open the output of one run; the progress bar disappears however the run ends. ``quiet`` outdoes ``verbose``."""
    from bimvox.progress import SilentProgress, told

    progress: Progress
    with ExitStack() as stack:
        if quiet:
            progress = SilentProgress()
        else:
            from bimvox_cli.live import LiveProgress

            progress = live = LiveProgress(console_on(sys.stderr), verbose=verbose)
            stack.enter_context(told(live.compiling))
        stack.callback(progress.finish)
        yield Output(as_json=as_json, quiet=quiet, progress=progress, verbose=verbose)


def console_on(stream: Any) -> Console:
    """Return a console that prints texts unchanged (names hold brackets) and honours NO_COLOR."""
    from rich.console import Console

    width = None if stream.isatty() or "COLUMNS" in os.environ else _WIDTH_OFF_TERMINAL
    console = Console(file=stream, markup=False, highlight=False, emoji=False, width=width)
    if console.width < _LEAST_WIDTH:  # a terminal that does not know its width says 0, and nothing would be printed
        console.width = _LEAST_WIDTH
    return console


def print_json(document: Mapping[str, Any]) -> None:
    """Print one JSON document on stdout; one with a long list in one line, which takes a quarter of the time."""
    long = any(isinstance(value, list) and len(value) > _MOST_INDENTED for value in document.values())
    text = _dumped(document, indent=None if long else 2)
    for start in range(0, len(text), _WRITTEN_AT_ONCE):  # encoded whole, a long one would take its size again
        sys.stdout.write(text[start : start + _WRITTEN_AT_ONCE])
    sys.stdout.write("\n")


def _dumped(document: Mapping[str, Any], indent: int | None) -> str:
    utf8 = (sys.stdout.encoding or "").lower().replace("-", "") == "utf8"
    return json.dumps(document, indent=indent, ensure_ascii=not utf8, allow_nan=False)


def fields(console: Console, pairs: Iterable[tuple[str, object]]) -> None:
    """Print names and values in two columns, without those that are None or empty; a ``Text`` keeps its colour."""
    from rich.table import Table
    from rich.text import Text

    table = Table.grid(padding=(0, 2))
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    for name, value in pairs:
        if value is not None and value != "":
            table.add_row(plain(name), value if isinstance(value, Text) else plain(str(value)))
    _print_trimmed(console, table)


def lines_of(console: Console, show: Callable[[], None]) -> int:
    """Return how many lines something would print."""
    printed, stream = console.file, _Counted()
    console.file = stream  # type: ignore[assignment]
    try:
        show()
    finally:
        console.file = printed
    return stream.lines


class _Counted:
    """A stream that counts lines."""

    lines = 0

    def write(self, text: str) -> int:
        self.lines += text.count("\n")
        return len(text)

    def flush(self) -> None:
        """Do nothing."""


def in_lines(console: Console, pairs: Sequence[tuple[str, str | None]]) -> None:
    """Print names and values, a line each."""
    width = console.width - max(len(name) for name, _ in pairs) - 2
    fields(console, [(name, value and shortened(value, width)) for name, value in pairs])


def rows(
    console: Console,
    columns: Sequence[str],
    values: Sequence[Sequence[object]],
    *,
    title: str = "",
    limit: int | None = ROWS_SHOWN,
    count: int | None = None,
    cut: str | None = None,
) -> None:
    """Print a table, numbers right-aligned; report the number of rows beyond ``limit``, of ``count`` in all.

    ``cut`` names a column whose texts are shortened so that every row fits in one line.
    """
    from rich.cells import cell_len
    from rich.table import Table

    if not values:
        return
    shown = values if limit is None else values[:limit]
    if title:
        console.print(plain(title), style="bold")
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="dim")
    for column, heading in enumerate(columns):
        numeric = all(isinstance(row[column], int | float) or row[column] is None for row in shown)
        whole = heading in _IDS  # an id in two pieces cannot be copied
        table.add_column(heading, justify="right" if numeric else "left", overflow="fold", no_wrap=whole)
    texts = [_aligned([row[column] for row in shown]) for column in range(len(columns))]
    if cut is not None:
        at = columns.index(cut)
        wide = [max(map(cell_len, (name, *own))) for name, own in zip(columns, texts, strict=True)]
        left = max(_LEAST_CUT, console.width - sum(wide) + wide[at] - 2 * (len(columns) - 1))
        texts[at] = [shortened(text, left) for text in texts[at]]
    for cells in zip(*texts, strict=True):
        table.add_row(*cells)
    _print_trimmed(console, table)
    more = (len(values) if count is None else count) - len(shown)
    if more > 0:
        console.print(f"... and {more:,} more (--json lists all)", style="dim")


def shortened(text: str, width: int) -> str:
    """Return a text on one line of at most ``width`` characters on a terminal; dots show that it was longer."""
    from rich.cells import cell_len, set_cell_size

    line = " ".join(text.split())
    return line if cell_len(line) <= width else f"{set_cell_size(line, width - 3).rstrip()}..."


Column = str | Callable[[Any], object]
"""A column of a table: the key of its values, or a function of an item."""


def rounded(key: str, digits: int | None = None, *, per: float = 1.0) -> Column:
    """Return a column of the numbers of a key, rounded, in units of ``per``; empty where there is none."""
    return lambda one: None if one[key] is None else round(one[key] / per, digits)


def table(
    console: Console,
    columns: Mapping[str, Column],
    items: Iterable[Any],
    *,
    title: str = "",
    limit: int | None = ROWS_SHOWN,
    cut: str | None = None,
) -> None:
    """Print a table of items, a row each, with columns by their headings; ``limit`` and ``cut`` as in ``rows``."""
    cells = [cells_of(columns.values(), one) for one in items]
    rows(console, list(columns), cells, title=title, limit=limit, cut=cut)


def width_of(columns: Mapping[str, Column], items: Sequence[Any]) -> int:
    """Return how wide a table of items is, in characters, the gap before a further column included."""
    from rich.cells import cell_len

    texts = zip(*(map(written, cells_of(columns.values(), one)) for one in items), strict=True)
    return sum(max(map(cell_len, (name, *own))) + 2 for name, own in zip(columns, texts, strict=True))


def cells_of(columns: Iterable[Column], item: Any) -> list[object]:
    """Return the row of an item."""
    return [of(item) if callable(of) else item[of] for of in columns]


def _print_trimmed(console: Console, table: Table) -> None:
    """Print a table without trailing spaces."""
    with console.capture() as capture:
        console.print(table)
    for line in capture.get().splitlines():
        print(line.rstrip(), file=console.file)


def _aligned(values: Sequence[object]) -> list[str]:
    """Return a column as texts; numbers are padded with blanks so that their decimal points align."""
    texts = [written(value) for value in values]
    numbers = all(value is None or (isinstance(value, int | float) and not isinstance(value, bool)) for value in values)
    if not numbers or any("e" in text for text in texts):
        return texts
    after = [len(text) - text.index(".") if "." in text else 0 for text in texts]
    return [text + " " * (max(after) - count) for text, count in zip(texts, after, strict=True)]


def written(value: object) -> str:
    """Return a value as text: thousands separated, few digits, empty for None."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}"
    if isinstance(value, float):
        digits = 4 if abs(value) < 10 else 3
        text = f"{value:,.{digits}f}".rstrip("0").rstrip(".")
        return f"{value:.2g}" if value and text in ("0", "-0") else text
    return plain(str(value))


def spent(seconds: Mapping[str, float]) -> str:
    """Return stage times as text: the sum, and the stages in brackets."""
    shown = {name: round(value, 1) for name, value in seconds.items()}  # the sum is that of the numbers that are shown
    stages = ", ".join(f"{name} {value:.1f}" for name, value in shown.items() if value)
    return f"{sum(shown.values()):.1f} s" + (f" ({stages})" if stages else "")


def facts(console: Console, document: Mapping[str, Any]) -> None:
    """Print any document: plain values as fields, then lists of objects as tables."""
    tables = {key: value for key, value in document.items() if _is_table(value)}
    plain = {key: value for key, value in document.items() if key not in tables}
    times = plain.pop("seconds", None)
    pairs: list[tuple[str, object]] = [_with_unit(key, value, _in_lines) for key, value in plain.items()]
    fields(console, [*pairs, ("took", spent(times) if isinstance(times, Mapping) else _in_lines(times))])
    for key, items in tables.items():
        columns = list(dict.fromkeys(column for item in items for column in item))
        if "number" in columns and "order" in columns:  # people count from 1, programs from 0
            columns.remove("order")
        values = [[_cell(_sensible(column, item.get(column))) for column in columns] for item in items[:ROWS_SHOWN]]
        console.print()
        rows(console, [_spoken(column) for column in columns], values, title=_spoken(key), count=len(items))


def _with_unit(key: str, value: object, other: Callable[[object], str]) -> tuple[str, str]:
    """Return a name and a value as people write them: ``voxel_size_m: 0.2`` is ``voxel size`` and ``0.2 m``."""
    found = _UNIT.fullmatch(key)
    numbers = value if isinstance(value, list) else [value]
    if found is None or not all(isinstance(one, int | float) and not isinstance(one, bool) for one in numbers):
        return _spoken(key), other(value)
    return _spoken(found["name"]), f"{_in_a_line(_sensible(key, value))} {_UNITS[found['unit']] or found['unit']}"


def _sensible(key: str, value: object) -> object:
    """Return a time in seconds with one digit, tonnes with two, an angle in degrees; anything else as it is."""
    found = _UNIT.fullmatch(key)
    if found is None or not isinstance(value, float):
        return value
    if found["unit"] == "rad":
        return round(math.degrees(value), 1)
    digits = {"s": 1, "ms": 1, "t": 2}.get(found["unit"])
    return value if digits is None else round(value, digits)


def _is_table(value: object) -> bool:
    return isinstance(value, list) and bool(value) and isinstance(value[0], Mapping)


def _spoken(key: str) -> str:
    """Return a key as words: ``bounds_m`` is ``bounds m``."""
    return key.replace("_", " ")


def _cell(value: object) -> object:
    return value if value is None or isinstance(value, int | float | str) else _in_a_line(value)


def _in_lines(value: object) -> str:
    """Return any value as text, one line per key of an object, row of a matrix, or sentence of a list."""
    if isinstance(value, Mapping):
        return "\n".join(
            " ".join(_with_unit(str(key), item, _in_a_line)) for key, item in value.items() if item is not None
        )
    if isinstance(value, list) and any(isinstance(item, list) or " " in str(item) for item in value):
        return "\n".join(_in_a_line(item) for item in value)
    return _in_a_line(value)


def _in_brackets(value: object) -> str:
    return _in_a_line(value, True)


def _in_a_line(value: object, inside: bool = False) -> str:
    """Return any value as one line; nested values in brackets."""
    if isinstance(value, Mapping):
        text = ", ".join(
            " ".join(_with_unit(str(key), item, _in_brackets)) for key, item in value.items() if item is not None
        )
    elif isinstance(value, list):
        text = ", ".join(_in_a_line(item, True) for item in value)
    else:
        return written(value)
    return f"({text})" if inside else text
