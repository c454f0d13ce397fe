"""Writer of site files that people can read and edit: the keys, comments and examples are those of the schema."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from bimvox.bim.kinds.kind import WAYS, Kind
from bimvox.site.catalogue import FICTITIOUS
from bimvox.site.config.calendar import CalendarConfig, CostsConfig
from bimvox.site.config.crane import OverrideConfig
from bimvox.site.config.rules import (
    BuildingConfig,
    CastingConfig,
    CuringConfig,
    PropsConfig,
    RiggingConfig,
    TimesConfig,
)
from bimvox.site.config.site_config import KindConfig, ModelConfig, SiteConfig
from bimvox.site.config.validation import Table, model_in
from bimvox.site.default_rules import DEFAULT_RULES
from bimvox.site.yard_guess import access_away

if TYPE_CHECKING:
    from bimvox.site.kind_rows import KindRow

_HEAD = """\
# Site file of bimvox: parts to be lifted, yard, crane and rules. Units: m, degrees, kg, s (rates: rad/s).
# Coordinates are in the site frame: x and y as in the model (turned by yaw_deg), z = 0 at the top of the ground.
# Only the model's path is required. A key behind # is an example, or a default that gives way where a lift cannot keep
# it. `bimvox schema site` lists all keys.
# Temporary obstructions go into a separate file (plan --obstructions FILE, or watch FILE):
#   {"version": 1, "obstructions": [{"id": "truck", "box": {"min": [2, 11, 0], "max": [4.5, 19, 3.2]}}]}
"""
_SHORT_HEAD = """\
# Site file of bimvox. Units: m, degrees, kg, s. x and y as in the model (turned by yaw_deg), z = 0 at the top of the
# ground. Look at everything down to the line first: {look_at}.
"""
_LINE = """
# ---------- Down to here: look at it first. Below: change it where a guess is wrong. ----------
"""
_SHORT_FOOT = """
# Every other key has its default. All of them, with what they mean: bimvox init --full, or bimvox schema site.
# Often wanted: [project] for the report, [calendar] country and shifts, [[zone]], [rules] wind_speed_m_s, [costs].
"""
_FIRST_SHORT = ("calendar", "crane", "areas", "model")
"""Tables at the top of a short file. The model's is the last of them: TOML has a table's keys in one place, and its
``kinds`` are many lines, below."""
_FIRST_OF_MODEL = ("path", "unit", "up", "ground_m")
_SHORT_WORDS = {
    "crane.kind": "`hammerhead`, `luffing`, `mobile`, or `none`",
    "crane.machine": "Of `bimvox cranes`, or the file of your own next to this one",
    "calendar.start": "First day of work.",
    "model.ground_m": "Height in the model of the top of the ground.",
    "areas.yard": "Where parts are stored",
    "areas.access": "Where lorries stand",
    "rules.truckload_kg": "Payload of a lorry",
}
"""What keys at the top of a short file say of themselves, in place of the schema's words."""
_NO_START = "First day of work. The model states no date: without one, times are `day 1 07:00`"
_ALWAYS = ("model.path", "model.voxel_size_m", "model.ground_m", "calendar.start")
_WIDTH = 120
_AS_EXAMPLE = (CalendarConfig, CostsConfig, RiggingConfig)
"""Tables that are written behind # if they have no value of their own; all others say what their defaults are."""
_WITH_HEADING = (BuildingConfig, CastingConfig, CuringConfig, OverrideConfig, PropsConfig, TimesConfig)
"""Tables within tables that are written below a heading; all others are values."""


def site_toml(
    config: SiteConfig,
    *,
    example_ids: Sequence[str] = (),
    crane_notes: Sequence[str] = (),
    kinds: Sequence[KindRow] = (),
    ground_why: str = "",
    start_why: str = "",
    short: bool = False,
) -> str:
    """Return the text of a site file; :func:`bimvox.site.config.file.load_site_config` reads the same values back.

    Args:
        config: Its content, with the model's path as it is to be written.
        example_ids: Ids of components, used in the commented-out examples.
        crane_notes: Lines about the choice of the crane, written as comments.
        kinds: What the parts are, by type; each a comment to correct.
        ground_why: What the height of the ground was taken from, written as a comment.
        start_why: What the first day of work was taken from, written as a comment.
        short: Whether only values that differ from their defaults are written, what one must look at first at the top.
    """
    whys = {"model.ground_m": ground_why, "calendar.start": start_why}
    writer = _Writer({} if short else _examples(config, example_ids), crane_notes, kinds, whys, short=short)
    if short:
        return _short_toml(config, writer)
    values: list[str] = []
    tables: list[str] = []
    for name, field in SiteConfig.model_fields.items():
        given = getattr(config, name)
        if model_in(field.annotation) is None:
            values += writer.key(name, given, field)
        else:
            tables += writer.tables(name, given, field)
    return "\n".join([_HEAD, *values, *tables, ""])


def _short_toml(config: SiteConfig, writer: _Writer) -> str:
    """Return the text of a site file with the values that differ from their defaults."""
    fields = SiteConfig.model_fields
    single = [name for name, field in fields.items() if model_in(field.annotation) is None]
    first = [line for name in single for line in writer.key(name, getattr(config, name), fields[name])]
    if config.calendar.start is None:
        first += ["", "# [calendar]", *_line("# start", date(2026, 3, 9), _NO_START)]
    for name in _FIRST_SHORT:
        first += writer.tables(name, getattr(config, name), fields[name])
    rest = [*writer.rest_of_model(config.model), *writer.about_crane()]
    for name in fields:
        if name not in (*single, *_FIRST_SHORT):
            rest += writer.tables(name, getattr(config, name), fields[name])
    head = _SHORT_HEAD.format(look_at="start, crane, yard, model and ground")
    return "\n".join([head.rstrip("\n"), *first, _LINE.rstrip("\n"), *rest, _SHORT_FOOT])


def _examples(config: SiteConfig, ids: Sequence[str]) -> dict[str, Any]:
    """Return the examples that depend on the site, by their dotted keys; all others are in the schema."""
    first, second = (*ids, "1a2B3c4D5e6F7g8H9i0JkL", "0L1k2J3i4H5g6F7e8D9c0B")[:2]
    areas, rules = config.areas, config.rules_in_force
    x, y = areas.yard[0][0] if areas.yard else (0.0, 0.0)
    access = access_away(areas.yard, areas.construction) if areas.yard and areas.construction else None
    return {
        "areas.access": None if access is None else (access,),
        "component.global_id": first,
        "component.after": (second,),
        "sequence.first": (first,),
        "zone.polygon": ((x - 10, y - 10), (x - 5, y - 10), (x - 5, y - 5)),
        **{f"rules.{key}": getattr(rules, key) for key in DEFAULT_RULES},
    }


class _Writer:
    """Writes tables and keys.

    Args:
        examples: Examples by dotted key, in the place of the schema's.
        crane_notes: Comments about the choice of the crane.
        kinds: What the parts are.
        whys: What values were taken from, by dotted key.
        short: Whether values that are their defaults, and examples, are left out.
    """

    def __init__(
        self,
        examples: Mapping[str, Any],
        crane_notes: Sequence[str],
        kinds: Sequence[KindRow],
        whys: Mapping[str, str],
        *,
        short: bool = False,
    ) -> None:
        self._examples, self._crane_notes, self._kinds, self._whys = examples, crane_notes, kinds, whys
        self._short = short

    def rest_of_model(self, model: ModelConfig) -> list[str]:
        """Return the lines of a short file that end the table of the model, the kinds of parts last."""
        fields = ModelConfig.model_fields
        keys = (key for key in fields if key not in _FIRST_OF_MODEL)
        lines = [line for key in keys for line in self.key(key, getattr(model, key), fields[key], "model")]
        return [*lines, *_kind_lines(model.kinds, self._kinds)]

    def about_crane(self) -> Sequence[str]:
        """Return the lines about the choice of the crane."""
        return ["", *_comment("The crane.", *self._crane_notes)] if self._crane_notes else []

    def tables(self, name: str, given: Any, field: FieldInfo) -> Iterator[str]:
        """Yield the lines of a table, or of several of the same name; as an example if the file has none."""
        schema = model_in(field.annotation)
        assert schema is not None
        entries = given if isinstance(given, tuple) else () if given is None else (given,)
        if self._short and (not entries or given == field.default):
            return
        if not entries or (isinstance(given, _AS_EXAMPLE) and given == type(given)()):
            keys = list(self._example_keys(name, schema))
            heading = f"[[{name}]]" if field.default == () else f"[{name}]"
            if keys:
                yield from ["", *_comment(schema.__doc__ or ""), *(f"# {line}" for line in (heading, *keys))]
            return
        if self._short:
            yield from ["", *([] if name in _FIRST_SHORT else _comment((schema.__doc__ or "").partition("\n\n")[0]))]
        else:
            notes = self._crane_notes if name == "crane" else ()
            yield from ["", *_comment(schema.__doc__ or ""), *_comment(*notes)]
        for number, entry in enumerate(entries):
            several = len(entries) > 1 or field.default == ()
            yield f"[[{name}]]" if several else f"[{name}]"
            lines = self._keys(name, entry)
            yield from lines if not (self._short and number) else (one for one in lines if not one.startswith("# "))

    def key(self, name: str, value: Any, field: FieldInfo, table: str = "") -> Iterator[str]:
        """Yield the lines of a key; of one without a value those of its example, if it has one."""
        dotted, text = f"{table}.{name}", field.description or ""
        if self._short and (
            dotted == "model.kinds" or (value == field.default and (value is None or dotted not in _ALWAYS))
        ):
            return
        if self._short:
            text = _SHORT_WORDS.get(dotted, text)
        if dotted == "model.kinds":
            yield from _kind_lines(value, self._kinds)
        elif why := self._whys.get(dotted):
            yield from _line(name, value, f"{text} Here: {why}")
        elif not _is_left_out(value, field):
            yield from _line(name, value, text)
        elif (example := self._example(dotted, field)) is not None:
            yield from _line(f"# {name}", example, text)

    def _keys(self, name: str, table: Table) -> Iterator[str]:
        """Yield the lines of the keys of a table, those with a heading of their own last."""
        fields = type(table).model_fields
        first = [
            key for key in type(table).__annotations__ if key in fields
        ]  # those of a base class come after its own
        fields = {key: fields[key] for key in dict.fromkeys([*first, *fields])}
        headed = {key: field for key, field in fields.items() if model_in(field.annotation) in _WITH_HEADING}
        for key, field in fields.items():
            if key not in headed and not (self._short and name == "model" and key not in _FIRST_OF_MODEL):
                if (name, key) == ("crane", "name") and (getattr(table, key) or "").startswith(FICTITIOUS):
                    yield "# FICTITIOUS: this machine does not exist. Name a real one."
                yield from self.key(key, getattr(table, key), field, name)
        for key, field in headed.items():
            yield from self.tables(f"{name}.{key}", getattr(table, key), field)

    def _example_keys(self, name: str, schema: type[BaseModel]) -> Iterator[str]:
        """Yield the lines of the keys that have an example or a default that says something, without their #."""
        for key, field in schema.model_fields.items():
            example = self._example(f"{name}.{key}", field)
            if example is None and not field.is_required() and not _is_left_out(field.default, field):
                example = field.default
            if example is not None:
                yield from _line(key, example, field.description or "")

    def _example(self, dotted: str, field: FieldInfo) -> Any:
        return self._examples.get(dotted, (field.examples or [None])[0])


_KINDS_NOTE = f"""\
# What the parts are and how each gets to its place, by type, as bimvox sees it; the doubtful ones first. To correct a
# line, remove its first # and change the values. It wins over the model; nothing else has to be done again.
# kind: {", ".join(Kind)}
# means: {", ".join(WAYS)} (not in the plan); without it, kind, size and mass decide
# For a spreadsheet: bimvox inspect MODEL --csv kinds.csv, then kinds = ["kinds.csv"]."""
_MOST_KINDS = 60


def _kind_lines(given: Sequence[KindConfig | str], rows: Sequence[KindRow]) -> Sequence[str]:
    """Return the corrections, and what could be corrected as comments."""
    if not (given or rows):
        return ()
    lines = [f"  {_value(one)}," for one in given]
    lines += [f"  # {line}" for line in map(_kind_line, rows[:_MOST_KINDS])]
    if len(rows) > _MOST_KINDS:
        lines.append(f"  # ... and {len(rows) - _MOST_KINDS:,} more: bimvox inspect MODEL --csv FILE lists all")
    return (*([_KINDS_NOTE] if rows else []), "kinds = [", *lines, "]")


def _kind_line(row: KindRow) -> str:
    """Return the line that confirms what is assumed of a type, with what is known as its comment."""
    kind = Kind.CONCRETE if row.kind is Kind.OTHER and row.means in ("crane", "in_situ") else row.kind
    values = [f"select = {_literal(row.select)}", f"kind = {_value(kind.value)}"]
    if row.means in WAYS:
        values.append(f"means = {_value(row.means)}")
    masses_t = [f"{kg / 1000.0:.2g}" if kg < 995.0 else f"{kg / 1000.0:.1f}" for kg in row.mass_kg or ()]
    mass = f", {' to '.join(dict.fromkeys(masses_t))} t" if masses_t else ""
    unsure = "ASSUMED, " if row.is_kind_assumed else "WAY ASSUMED, " if row.is_way_assumed else ""
    others = f" (the line selects {row.selects - row.count:,} more)" if row.selects > row.count else ""
    said = f"{unsure}{row.count:,} part{'s' * (row.count != 1)}{others}{mass}: {row.why}"
    return f"{{ {', '.join(values)} }},  # {_one_line(said)}"


def precast_line(model: ModelConfig, rows: Sequence[KindRow]) -> str:
    """Return a site file in one line that lifts concrete of unknown make as precast; empty if there is none."""
    wanted = [row for row in rows if row.means == "crane" and row.kind in (Kind.CONCRETE, Kind.OTHER)]
    kinds = (f"{{ select = {_literal(row.select)}, kind = {_value(Kind.PRECAST.value)} }}" for row in wanted)
    given = model.model_dump(mode="json", exclude_defaults=True, exclude_none=True, exclude={"kinds"})
    given["path"] = model.path.as_posix()
    said = ", ".join(f"{key} = {_value(value)}" for key, value in given.items())
    return f"model = {{ {said}, kinds = [{', '.join(kinds)}] }}" if wanted else ""


def _literal(text: str) -> str:
    """Return a text as TOML, without escapes if possible: queries are full of quotes and backslashes."""
    return f"'{text}'" if text.isprintable() and "'" not in text else _value(text)


def _one_line(text: str) -> str:
    return "".join(letter if letter.isprintable() else " " for letter in text)


def _comment(*paragraphs: str) -> list[str]:
    """Return paragraphs of the schema as the lines of comments."""
    return [
        f"# {line}"
        for text in paragraphs
        for part in text.replace("``", "`").split("\n\n")
        for line in textwrap.wrap(" ".join(part.split()), _WIDTH - 4, break_long_words=False, break_on_hyphens=False)
    ]


def _is_left_out(value: Any, field: FieldInfo) -> bool:
    """Return whether a key without a value need not be written: an empty list may differ from the default."""
    return value is None or (value == field.default and (value is False or value == ()))


def _line(key: str, value: Any, text: str) -> list[str]:
    """Return the line of a key with its comment at its end, or above it if both do not fit."""
    written = _written(key, value)
    (*more, last) = _comment(text) or [""]
    whole = f"{written}  {last.removesuffix('.')}".rstrip()
    return [whole] if not more and len(whole) <= _WIDTH - 2 else [*more, last, written]


def _written(key: str, value: Any) -> str:
    """Return the line of a key without a comment; a list that is too long for it in a line for each entry."""
    line = f"{key} = {_value(value)}"
    if len(line) <= _WIDTH or isinstance(value, str) or not isinstance(value, Sequence) or key.startswith("#"):
        return line
    return "\n".join([f"{key} = [", *(f"  {_value(entry)}," for entry in value), "]"])


def _value(value: object) -> str:
    """Return a value as TOML, tables inline; a number is the shortest text that reads back the same value."""
    if isinstance(value, str):
        # A JSON string is a TOML basic string, except for the character DEL.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")
    if isinstance(value, Path):
        return _value(value.as_posix())
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return str(int(value)) if float(value).is_integer() and abs(value) < 1e15 else repr(float(value))
    if isinstance(value, date):
        return value.isoformat()
    if isinstance(value, Table):
        fields = sorted(type(value).model_fields.items(), key=lambda item: item[0] == "chart")  # the longest one last
        given = ((key, getattr(value, key)) for key, field in fields if not _is_left_out(getattr(value, key), field))
        return f"{{ {', '.join(f'{key} = {_value(one)}' for key, one in given)} }}"
    assert isinstance(value, Sequence)
    return f"[{', '.join(map(_value, value))}]"
