"""The planned path of a lift as a message: the poses of its load."""

from __future__ import annotations

from functools import cache

import numpy as np
from foxglove_schemas_protobuf.PosesInFrame_pb2 import PosesInFrame

from bimvox.log import schema as topics
from bimvox.log.mcap.form import Form
from bimvox.log.mcap.messages import pose, stamp
from bimvox.log.mcap.rows import Timed
from bimvox.records.lift import Lift
from bimvox.site.site import Site


def path_message(site: Site, lift: Lift, time_ns: int) -> Timed:
    """Return the message of a planned lift's path.

    Args:
        site: The site.
        lift: The lift.
        time_ns: Its time.
    """
    assert lift.path_vox is not None
    corners_m = site.frame.corner_of(lift.path_vox)
    poses = _poses_form().serialized(np.zeros(len(corners_m), np.int64), corners_m)
    head = PosesInFrame(timestamp=stamp(time_ns), frame_id="site").SerializeToString()
    # Protobuf merges concatenated messages into one with all fields.
    message = PosesInFrame.FromString(b"".join([head, *poses]))
    return time_ns, topics.of_crane(topics.PLANNED, site.components[lift.component].crane), message


@cache
def _poses_form() -> Form:
    return Form(lambda _, corner_m: PosesInFrame(poses=[pose(corner_m)]), 3)
