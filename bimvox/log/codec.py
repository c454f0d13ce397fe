"""Dataclasses to plain JSON values and flat arrays, and back, by their type hints.

Every array is appended to one flat array of its dtype, and the JSON value keeps ``{"dtype", "start", "shape"}``. The
format follows the types: a new field with a default is written and read from then on, and older files still read.
"""

from __future__ import annotations

import dataclasses
import json
import math
import types
import typing
from collections.abc import Callable, Mapping, Sequence
from enum import Enum
from functools import cache
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import LogFileError
from bimvox.records.props import Props
from bimvox.records.steps import Steps
from bimvox.sparse import names_to_write

DTYPES = ("bool", "uint8", "int32", "int64", "float32", "float64")


_MOST = 2**63
_PLAIN = frozenset((str, int, float, bool, types.NoneType))


class DecodeError(ValueError):
    """A value does not fit its type; the message names the place."""


class ArrayWriter:
    """Collects arrays into one flat array per dtype."""

    def __init__(self) -> None:
        self._parts: dict[str, list[NDArray[Any]]] = {}
        self._length: dict[str, int] = {}

    def put(self, array: NDArray[Any]) -> dict[str, Any]:
        """Append an array and return a reference to it."""
        dtype = array.dtype.name
        if dtype not in DTYPES:
            raise TypeError(f"arrays of {dtype} are not stored")
        start = self.put_flat(np.ascontiguousarray(array).reshape(-1))
        return {"dtype": dtype, "start": start, "shape": list(array.shape)}

    def put_flat(self, array: NDArray[Any]) -> int:
        """Append a flat array and return where it starts."""
        dtype = array.dtype.name
        start = self._length.get(dtype, 0)
        self._parts.setdefault(dtype, []).append(array)
        self._length[dtype] = start + array.size
        return start

    def flat(self) -> dict[str, NDArray[Any]]:
        """Return the flat arrays by dtype, in the order of ``DTYPES``."""
        return {dtype: np.concatenate(self._parts[dtype]) for dtype in DTYPES if dtype in self._parts}


class ArrayReader:
    """Resolves references to arrays, as read-only views into the flat ones."""

    def __init__(self, flat: Mapping[str, NDArray[Any]]) -> None:
        self._flat = flat

    def get(self, place: Any, dtype: str, where: str) -> NDArray[Any]:
        """Return the array that ``place`` refers to; its dtype must be ``dtype``."""
        if not isinstance(place, dict) or set(place) != {"dtype", "start", "shape"} or place["dtype"] != dtype:
            raise DecodeError(f"{where}: not a reference to an array of {dtype}")
        shape, start = place["shape"], place["start"]
        if not isinstance(shape, list) or not all(_is_size(n) for n in [*shape, start]):
            raise DecodeError(f"{where}: the array has an impossible shape")
        size = math.prod(shape)
        flat = self._flat.get(dtype, np.zeros(0, dtype))
        if start + size > flat.size:
            raise DecodeError(f"{where}: the array reaches past the end of the stored data")
        view = flat[start : start + size].reshape(shape)
        view.flags.writeable = False
        return view


def encode(value: Any, arrays: ArrayWriter) -> Any:
    """Return a value as plain JSON values; its arrays go to ``arrays``."""
    kind = type(value)
    return value if kind in _PLAIN else _encoder_of(kind)(value, arrays)  # type: ignore[arg-type]  # a class is hashable


@cache
def _encoder_of(kind: type[Any]) -> Callable[[Any, ArrayWriter], Any]:
    """Return the encoder of a type; cached, because there are many more values than types."""
    if dataclasses.is_dataclass(kind):
        return lambda value, arrays: {name: encode(getattr(value, name), arrays) for name in names_to_write(value)}
    if issubclass(kind, np.ndarray):
        return lambda value, arrays: arrays.put(value)
    if issubclass(kind, Enum):
        return lambda value, arrays: value.value
    if issubclass(kind, np.generic):
        return lambda value, arrays: value.item()
    if issubclass(kind, Mapping):
        return lambda value, arrays: {str(key): encode(item, arrays) for key, item in value.items()}
    if issubclass(kind, Sequence) and not issubclass(kind, str):
        return lambda value, arrays: [encode(item, arrays) for item in value]
    if issubclass(kind, str | bool | int | float):
        return lambda value, arrays: value
    raise TypeError(f"values of {kind.__name__} are not stored")


def decode(hint: Any, value: Any, arrays: ArrayReader, where: str) -> Any:
    """Return a JSON value as the type ``hint``.

    Raises:
        DecodeError: If it does not fit; the message names the place.
    """
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if hasattr(origin, "__value__"):  # NDArray, an alias of its own kind from NumPy 2.5 on
        return decode(origin.__value__[arguments], value, arrays, where)
    if origin is np.ndarray:
        return arrays.get(value, np.dtype(typing.get_args(arguments[1])[0]).name, where)
    if origin in (typing.Union, types.UnionType):
        return _decode_union(arguments, value, arrays, where)
    if origin is tuple:
        return _decode_tuple(arguments, value, arrays, where)
    if origin is not None and issubclass(origin, Mapping):
        if not isinstance(value, dict):
            raise DecodeError(f"{where}: not a table")
        return {key: decode(arguments[1], item, arrays, f"{where}.{key}") for key, item in value.items()}
    if dataclasses.is_dataclass(hint):
        return _decode_dataclass(hint, value, arrays, where)
    if isinstance(hint, type) and issubclass(hint, Enum):
        try:
            return hint(value)
        except ValueError:
            raise DecodeError(f"{where}: {value!r} is not one of {', '.join(str(m.value) for m in hint)}") from None
    if hint is float and isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    if hint is int and type(value) is int and not -_MOST <= value < _MOST:
        raise DecodeError(f"{where}: the number has more than 64 bits")
    if type(value) is hint or (hint is types.NoneType and value is None):
        return value
    raise DecodeError(f"{where}: {value!r} is not {getattr(hint, '__name__', hint)}")


def _decode_union(options: tuple[Any, ...], value: Any, arrays: ArrayReader, where: str) -> Any:
    if value is None and types.NoneType in options:
        return None
    failure: DecodeError | None = None
    exact_first = sorted(options, key=lambda option: option is not type(value))
    for option in exact_first:
        if option is types.NoneType:
            continue
        try:
            return decode(option, value, arrays, where)
        except DecodeError as error:
            failure = failure or error
    raise failure or DecodeError(f"{where}: {value!r} fits none of the types allowed")


def _decode_tuple(arguments: tuple[Any, ...], value: Any, arrays: ArrayReader, where: str) -> tuple[Any, ...]:
    if not isinstance(value, list):
        raise DecodeError(f"{where}: not a list")
    if len(arguments) == 2 and arguments[1] is Ellipsis:
        hints = (arguments[0],) * len(value)
    elif len(arguments) == len(value):
        hints = arguments
    else:
        raise DecodeError(f"{where}: {len(value)} values instead of {len(arguments)}")
    return tuple(
        decode(hint, item, arrays, f"{where}[{n}]") for n, (hint, item) in enumerate(zip(hints, value, strict=True))
    )


def _decode_dataclass(hint: Any, value: Any, arrays: ArrayReader, where: str) -> Any:
    if not isinstance(value, dict):
        raise DecodeError(f"{where}: not a table")
    hints, fields = _fields_of(hint)
    if unknown := sorted(set(value) - set(fields)):
        raise DecodeError(f"{where}: unknown key {unknown[0]!r} (from a newer bimvox?)")
    for name, field in fields.items():
        if name not in value and field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING:
            raise DecodeError(f"{where}: {name!r} is missing")
    return hint(**{name: decode(hints[name], item, arrays, f"{where}.{name}") for name, item in value.items()})


@cache
def _fields_of(kind: Any) -> tuple[dict[str, Any], dict[str, dataclasses.Field[Any]]]:
    """Return the types and the fields of a dataclass, by name."""
    return typing.get_type_hints(kind), {field.name: field for field in dataclasses.fields(kind)}


def _is_size(value: Any) -> bool:
    return type(value) is int and 0 <= value < 2**48


# The steps of work that the crane does not do, and what holds parts, as JSON inside the log.

Derived = TypeVar("Derived", Steps, Props)


def derived_to_json(value: Steps | Props) -> bytes:
    """Return steps and pauses, or what holds the parts, as JSON."""
    return json.dumps(encode(value, ArrayWriter()), indent=1).encode()


def derived_from_json(kind: type[Derived], data: bytes, name: str) -> Derived:
    """Return what a log says of steps or of what holds its parts.

    ``name``: its source, for messages.

    Raises:
        LogFileError: If it is damaged.
    """
    try:
        result: Derived = decode(kind, json.loads(data), ArrayReader({}), kind.__name__.lower())
    except (ValueError, RecursionError) as error:
        raise LogFileError(name, f"the {kind.__name__.lower()} in it cannot be read: {error}") from error
    return result
