"""Many messages of one topic at once, serialized.

A log has about 3,000 messages per lift, which differ in a time stamp and a few doubles. A
:class:`~bimvox.log.mcap.form.Form` serializes them together.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.log.mcap.packed import Packed, packed

Timed = tuple[int, str, Any]
"""Time on the site's clock (ns), topic, message."""


class Rows(NamedTuple):
    """Serialized messages of one topic.

    Attributes:
        time_ns: (N,) int64, ascending.
        topic: Its name.
        data: N messages.
    """

    time_ns: NDArray[np.int64]
    topic: str
    data: Packed


def rows_of(messages: Sequence[Timed]) -> Rows:
    """Return messages of one topic as rows."""
    times_ns, topics, contents = zip(*messages, strict=True)
    data = packed([content.SerializeToString(deterministic=True) for content in contents])
    return Rows(np.array(times_ns, np.int64), topics[0], data)
