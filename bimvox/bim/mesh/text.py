"""Numbers and names from the text formats of meshes."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import MeshError


def text_of(data: bytes) -> str:
    """Return decoded text: UTF-8, with or without a byte order mark, otherwise Latin-1, which accepts every byte."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def numbers(path: Path, words: str, where: str) -> NDArray[np.float64]:
    """Return the numbers of a text, separated by white space.

    Args:
        path: Names the file in the message.
        words: The text.
        where: Names the text in the message.

    Raises:
        MeshError: If a word is not a number.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)
        try:
            return np.fromstring(words, dtype=np.float64, sep=" ")
        except (DeprecationWarning, ValueError):
            pass
    for word in words.split():
        try:
            float(word)
        except ValueError:
            raise MeshError(
                path, f"{where}: {word[:40]!r} is not a number", hint="the file is damaged: export it again"
            ) from None
    return np.array(words.split(), dtype=np.float64)


def rows_of_numbers(path: Path, rows: Sequence[str], columns: int, where: str) -> NDArray[np.float64]:
    """Return (len(rows), columns) numbers, the first ``columns`` of every row.

    Raises:
        MeshError: If a row has too few numbers, or a word that is not a number.
    """
    found = numbers(path, " ".join(rows), where)
    if rows and len(found) == len(rows) * columns:
        return found.reshape(-1, columns)
    cut = []
    for row in rows:
        words = row.split()[:columns]
        if len(words) < columns:
            raise MeshError(
                path,
                f"{where}: {row.strip()[:40]!r} has fewer than {columns} numbers",
                hint="the file is damaged or cut off: export it again",
            )
        cut += words
    return numbers(path, " ".join(cut), where).reshape(-1, columns)
