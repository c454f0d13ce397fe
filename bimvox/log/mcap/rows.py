"""Many messages of one topic at once, serialized.

A log holds about 3,000 messages a lift that differ in a time stamp and a few doubles: they are put into bytes by a
:class:`~bimvox.log.mcap.form.Form`, not one by one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.log.mcap.packed import Packed


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
