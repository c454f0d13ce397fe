"""JSON values as the types that they are read as."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
import pytest
from numpy.typing import NDArray
from typing_extensions import TypeAliasType

from bimvox.log.codec import decode

S = TypeVar("S", bound=np.generic)
NEWER = TypeAliasType("NEWER", np.ndarray[Any, np.dtype[S]], type_params=(S,))


class Arrays:
    """Says which array is asked for."""

    def get(self, value, kind, where):
        return value, kind, where


@pytest.mark.parametrize("alias", [NDArray, NEWER])
def test_arrays_are_known_by_their_alias_of_every_numpy(alias):
    """From NumPy 2.5 on, ``NDArray`` is no longer the type that it stands for."""
    assert decode(alias[np.int32], "cells", Arrays(), "part") == ("cells", "int32", "part")
    assert decode(tuple[alias[np.float64], ...], ["a"], Arrays(), "ways") == (("a", "float64", "ways[0]"),)
