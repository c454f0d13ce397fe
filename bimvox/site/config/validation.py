"""Findings of pydantic in the words of the file, by key; for the site file and the obstruction file."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from math import degrees, radians
from pathlib import Path
from types import UnionType
from typing import TYPE_CHECKING, Annotated, Any, Generic, Literal, TypeVar, Union, cast, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from bimvox.errors import ConfigError, InputError, shown
from bimvox.site.nested import UTF8_HINT, WHERE_HINT, toml_values

if TYPE_CHECKING:
    from bimvox.site.config.site_config import SiteConfig

S = TypeVar("S", bound=BaseModel)
V = TypeVar("V")


class Table(BaseModel):
    """A table of a file: no unknown keys, no NaN; with the types below, no silent conversion either."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, use_attribute_docstrings=True)

    @model_validator(mode="before")
    @classmethod
    def _in_degrees(cls, values: Any) -> Any:
        """Return the values with angles in degrees: files of earlier versions have radians, in keys with ``_rad``."""
        if not isinstance(values, dict):
            return values
        earlier = {key: f"{key[:-4]}_deg" for key in values if isinstance(key, str) and key.endswith("_rad")}
        earlier = {key: now for key, now in earlier.items() if now in cls.model_fields}
        for key, now in earlier.items():
            if now in values:
                raise ValueError(f"{now} and {key} are the same angle: give {now} alone")
        return {earlier.get(key, key): _degrees(value) if key in earlier else value for key, value in values.items()}

    @classmethod
    def file_schema(cls) -> dict[str, Any]:
        """Return the JSON Schema (draft 2020-12) of a file of this table."""
        return {"$schema": "https://json-schema.org/draft/2020-12/schema", **cls.model_json_schema()}


def _degrees(value: Any) -> Any:
    """Return radians, or a list of them, in degrees, without the noise of the conversion; anything else as it is."""
    if isinstance(value, list | tuple):
        return tuple(_degrees(one) for one in value)
    return round(degrees(value), 12) if isinstance(value, int | float) and not isinstance(value, bool) else value


MOST = 1e9
"""The largest number of a site file: nothing on a site is so long, heavy or slow, and sums of it stay exact."""
Number = Annotated[float, Field(strict=True, ge=-MOST, le=MOST)]
Positive = Annotated[float, Field(strict=True, gt=0.0, le=MOST)]
NotNegative = Annotated[float, Field(strict=True, ge=0.0, le=MOST)]
Whole = Annotated[int, Field(strict=True)]
Flag = Annotated[bool, Field(strict=True)]
Text = Annotated[str, Field(min_length=1, max_length=1_000_000)]
Point2 = tuple[Number, Number]
Point2or3 = Annotated[tuple[Number, ...], Field(min_length=2, max_length=3)]
Point3 = tuple[Number, Number, Number]

ONE = "one table"
SEVERAL = "an array of tables"
A_FILE = "the name of a file"
"""Tags of a key that takes one table, several, or a file; they do not occur in it, so they are not part of a key."""

_EXPECTED = {
    "string_type": "a text in quotes",
    "path_type": "a text in quotes",
    "float_type": "a number",
    "int_type": "a whole number",
    "bool_type": "true or false",
    "list_type": "a list",
    "tuple_type": "a list",
    "model_type": "a table",
    "model_attributes_type": "a table",
    "dict_type": "a table",
    "date_type": "a date such as 2026-03-09, without quotes",
    "finite_number": "a finite number",
}


@dataclass(frozen=True, slots=True)
class Finding:
    """One error in a file.

    Attributes:
        key: Dotted key, list positions in brackets, counted from 0: ``component[2].start``. Empty for the whole file.
        message: What is wrong there and what was expected.
        available: The known keys, if the key is unknown.
        hint: What to do about it, if that is not obvious.
    """

    key: str
    message: str
    available: tuple[str, ...] = ()
    hint: str | None = None


def first_finding(error: ValidationError, schema: type[BaseModel]) -> Finding:
    """Return the first error, unknown keys first: a misspelt key often causes the other errors."""
    details = error.errors(include_url=False)
    chosen = next((d for d in details if d["type"] == "extra_forbidden"), details[0])
    more = f" (and {len(details) - 1} more)" if len(details) > 1 else ""
    loc = tuple(step for step in chosen["loc"] if step not in (ONE, SEVERAL, A_FILE))
    if chosen["type"] == "extra_forbidden":
        known = _known_keys(schema, loc[:-1])
        near = nearest(str(loc[-1]), known)
        where = f"did you mean {near!r}? " if near else ""
        return Finding(dotted(loc), f"unknown key{more}", known, f"{where}known here: {', '.join(known)}")
    if chosen["type"] == "missing":
        only = _only_values(schema, loc)
        return Finding(dotted(loc), f"is missing{more}", hint=f"add it: {only}" if only else "add it")
    if chosen["type"] in _EXPECTED:
        return Finding(dotted(loc), f"expected {_EXPECTED[chosen['type']]}, got {shown(chosen['input'])}{more}")
    if chosen["type"] in ("too_short", "too_long"):
        context = chosen["ctx"]
        limit = f"at least {context['min_length']}" if "min_length" in context else f"at most {context['max_length']}"
        return Finding(dotted(loc), f"expected {limit} values, got {context['actual_length']}{more}")
    message = chosen["msg"].removeprefix("Value error, ")
    if chosen["type"] != "value_error":
        message = f"{message[0].lower()}{message[1:]}, got {shown(chosen['input'])}"
    return Finding(dotted(loc), f"{message}{more}")


def table_of(text: bytes, path: Path, schema: type[S]) -> S:
    """Return the content of a TOML file.

    ``schema``: what it may hold.

    Raises:
        ConfigError: If it is not TOML, a key is unknown or missing, or a value is not allowed; names file and key.
    """
    try:
        return schema.model_validate(toml_values(text.decode("utf-8-sig")))
    except UnicodeDecodeError as error:
        raise ConfigError(path, None, f"not UTF-8 text (byte {error.start})", hint=UTF8_HINT) from None
    except ValidationError as error:
        found = first_finding(error, schema)
        raise ConfigError(path, found.key or None, found.message, available=found.available, hint=found.hint) from None
    except ValueError as error:
        raise ConfigError(path, None, str(error), hint=WHERE_HINT) from None


@dataclass(frozen=True, slots=True, eq=False)
class TableFiles(Generic[S, V]):
    """The files of one kind of table: those of a catalogue in the package, and a person's own next to a site file.

    Attributes:
        schema: What they may hold.
        value: What a file describes.
        folder: That of the catalogue, in ``bimvox/crane``.
        what: What they describe, for messages.
    """

    schema: type[S]
    value: Callable[[S], V]
    folder: str
    what: str

    def read(self, text: bytes, path: Path) -> V:
        """Return what a file describes.

        Args:
            text: The file's content, TOML.
            path: Its name, for messages.

        Raises:
            ConfigError: If it is not TOML, a key is unknown or missing, or a value is not allowed; names file and key.
        """
        return cast("V", _read_once(self, text, path))

    def catalogue(self) -> tuple[V, ...]:
        """Return what the files of the catalogue describe, by their names."""
        folder = resources.files("bimvox") / "crane" / self.folder
        files = sorted((file for file in folder.iterdir() if file.name.endswith(".toml")), key=lambda file: file.name)
        return tuple(self.read(file.read_bytes(), Path(file.name)) for file in files)

    def named(self, config: SiteConfig, key: str, name: str, taken: Collection[str]) -> V:
        """Return what a file next to a site file describes, which names it in a key.

        Raises:
            ConfigError: As ``read``, if the file is not there, or if what it describes has a name that is taken.
        """
        text, path = config.machine_files.get(name), config.file.parent / name
        if text is None:
            raise config.error(key, f"the file of {self.what} {name!r} is not there")
        value = self.read(text, path)
        if (called := getattr(value, "name", None)) in taken:
            raise ConfigError(path, "name", f"{called!r} is known already", hint=f"give your {self.what} its own name")
        return value


@lru_cache(maxsize=64)
def _read_once(files: TableFiles[Any, Any], text: bytes, path: Path) -> Any:
    given = table_of(text, path, files.schema)
    try:
        return files.value(given)
    except InputError as error:
        raise ConfigError(path, None, error.message, hint=error.hint) from None


def nearest(word: str, known: Sequence[str]) -> str | None:
    """Return the known word that is most similar to ``word``; None if none is similar."""
    found = difflib.get_close_matches(word, known, n=1, cutoff=0.5)
    return found[0] if found else None


def dotted(loc: Sequence[int | str]) -> str:
    """Return a location as a dotted key: ``component[2].start``."""
    text = ""
    for step in loc:
        text += f"[{step}]" if isinstance(step, int) else f".{step}" if text else step
    return text


def _known_keys(schema: type[BaseModel], loc: Sequence[int | str]) -> tuple[str, ...]:
    """Return the names that the schema allows at a location."""
    model = model_in(_annotation(schema, loc))
    return tuple(model.model_fields) if model else ()


def _only_values(schema: type[BaseModel], loc: Sequence[int | str]) -> str:
    """Return the values that the schema allows at a location if it names them one by one; else nothing."""
    annotation = _annotation(schema, loc)
    return " or ".join(map(repr, get_args(annotation))) if get_origin(annotation) is Literal else ""


def _annotation(schema: type[BaseModel], loc: Sequence[int | str]) -> Any:
    """Return what the schema says of a location; None if it knows none."""
    here: Any = schema
    for step in loc:
        if isinstance(step, str):
            model = model_in(here)
            if model is None or step not in model.model_fields:
                return None
            here = model.model_fields[step].annotation
    return here


def model_in(annotation: Any) -> type[BaseModel] | None:
    """Return the schema inside ``X``, ``X | None`` or ``tuple[X, ...]``."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    if get_origin(annotation) is Annotated:
        return model_in(get_args(annotation)[0])
    if get_origin(annotation) in (Union, UnionType, tuple, list):
        return next((m for m in map(model_in, get_args(annotation)) if m), None)
    return None


def in_radians(pair_deg: tuple[float, float]) -> tuple[float, float]:
    """Return a pair of angles in radians."""
    first, second = map(radians, pair_deg)
    return first, second


def not_below(least: float, value: float) -> float:
    """Return the value of a key, unless it is below ``least``."""
    if value < least:
        raise ValueError(f"{value:g} is too small: at least {least:g}")
    return value
