"""Records of documents: a field is declared once, with its type, its meaning and where its value comes from.

The JSON of a document, its JSON Schema and the columns of a table all follow from the declaration.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Annotated, Any, NamedTuple

from pydantic import Field, create_model

from bimvox.site.config.validation import Table

Count = Annotated[int, Field(ge=0)]
Number = Annotated[int, Field(ge=1)]
LATER: Any = object()
"""As the source of a field: whoever makes the record adds its value."""


class _Key(NamedTuple):
    """A field.

    Attributes:
        name: Its name.
        type: Its type; a ``Record`` stands for its model.
        text: What it means.
        source: The name of an attribute of what the record is made from, or a function of it; None: of the same name.
            An attribute of None is None.
        default: What it is if it is left out, as it is where its source gives None; ``...``: it is never left out.
    """

    name: str
    type: Any
    text: str
    source: str | Callable[..., Any] | None = None
    default: Any = ...


class _Described(Table, use_attribute_docstrings=False):
    """A table whose fields have their meanings; to look for these in source code takes seconds in a large process."""


class Record:
    """A record of a document.

    Args:
        name: The name of its schema.
        about: What it is.
        keys: Its fields, each as the values of a ``_Key``.
    """

    def __init__(self, name: str, about: str, *keys: tuple[Any, ...]) -> None:
        self._name, self._about, self._keys = name, about, [_Key(*key) for key in keys]
        self._made = [(key, _source_of(key)) for key in self._keys if key.source is not LATER]

    @cached_property
    def model(self) -> type[Table]:
        """The model that checks it and makes its schema."""
        fields: dict[str, Any] = {
            key.name: (_type_of(key.type), Field(key.default, description=key.text)) for key in self._keys
        }
        return create_model(self._name, __base__=_Described, __doc__=self._about, **fields)

    def of(self, *sources: Any) -> dict[str, Any]:
        """Return the record of what its fields are functions of."""
        return {
            key.name: value
            for key, source in self._made
            if (value := source(*sources)) is not None or key.default is ...
        }

    def made(self, *values: Any) -> dict[str, Any]:
        """Return the record with these values, in the order of its fields."""
        return dict(zip((key.name for key in self._keys), values, strict=True))

    def keys(self, *names: str) -> list[tuple[Any, ...]]:
        """Return the declarations of some of its fields, for another record that has them too."""
        return [next(key for key in self._keys if key.name == name) for name in names]

    @property
    def meanings(self) -> dict[str, str]:
        """What its fields mean, by name."""
        return {key.name: key.text for key in self._keys}


class Several:
    """The type of a list of records.

    Args:
        of: Their type.
        least: How many there are at least.
    """

    def __init__(self, of: Any, least: int = 0) -> None:
        self.of, self.least = of, least


class Maybe(Several):
    """The type of a value that may be null.

    Args:
        of: Its type otherwise.
    """


def _type_of(declared: Any) -> Any:
    """Return the type of a field as pydantic takes it."""
    if isinstance(declared, Record):
        return declared.model
    if isinstance(declared, Several):
        inner = _type_of(declared.of)
        if isinstance(declared, Maybe):
            return inner | None
        return Annotated[_tuple_of(inner), Field(min_length=declared.least)] if declared.least else _tuple_of(inner)
    return declared


def _tuple_of(inner: Any) -> Any:
    return tuple[inner, ...]


def _source_of(key: _Key) -> Callable[..., Any]:
    """Return the function that gives the value of a field."""
    if callable(key.source):
        return key.source
    names = (key.source or key.name).split(".")

    def value(first: Any, *_: Any) -> Any:
        """Return the attribute; None if what should have it is None."""
        for name in names:
            first = None if first is None else getattr(first, name)
        return first

    return value
