"""What the geometry workers and their parent say to each other."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.ifc.processor_time import processor_time_limit
from bimvox.bim.ifc.shape import Shape
from bimvox.errors import SelectionError

READY = "ready"
"""The first message: the file is loaded."""
Answer = tuple[Shape, list[NDArray[np.float64]]] | str
"""A shape and the placement of each product, (4, 4) float64, metres; or the reason why there is no shape."""
Selected = frozenset[int] | SelectionError
"""Step ids, or the error about the query."""
Selector = Callable[[str], Selected]
"""Finds the products that a query matches."""
Mesher = Callable[[tuple[int, ...], str], Answer]
"""Meshes products that share one shape, with the named library."""


def no_selector(query: str) -> Selected:
    """Refuse queries, in a worker that gets none."""
    raise NotImplementedError(query)


def answer_requests(channel: Connection, mesher: Mesher, selector: Selector = no_selector) -> None:
    """Answer requests until the parent closes the connection: a query or (step ids, library), each with its limit.

    The limit is in seconds of processor time; the process ends there.
    """
    with suppress(EOFError, OSError):
        while True:
            request, limit_s = channel.recv()
            with processor_time_limit(limit_s):
                answer = selector(request) if isinstance(request, str) else mesher(*request)
            channel.send(answer)
