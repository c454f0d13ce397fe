from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import pytest

from bimvox.site.site import digest_of


@dataclass(frozen=True)
class Pair:
    a: object
    b: object


class Kind(StrEnum):
    ONE = "one"


def test_different_contents_have_different_digests():
    values = [
        None, 0, False, 0.0, "", b"", "0", (), (0,), ((0,),), ("ab", "c"), ("a", "bc"), ("a", "b", "c"), {"a": 1},
        np.zeros(2), np.zeros(2, np.int32), np.zeros((2, 1)), np.array([0.0, 1e-300]), Pair(1, 2), Pair(2, 1),
    ]  # fmt: skip
    assert len({digest_of(value) for value in values}) == len(values)


def test_equal_contents_have_equal_digests():
    array = np.arange(24).reshape(2, 3, 4)
    assert digest_of(array) == digest_of(np.asfortranarray(array))
    assert digest_of(array) == digest_of(array.astype(">i8"))
    assert digest_of({"a": 1, "b": 2}) == digest_of({"b": 2, "a": 1})
    assert digest_of(Kind.ONE) == digest_of("one")
    assert digest_of(np.float64(0.5)) == digest_of(0.5)


def test_what_has_no_content_is_refused():
    with pytest.raises(TypeError, match="function"):
        digest_of(lambda: None)
