"""The exact samples of a motion in one message: bit for bit, and readable with what the schema says."""

from __future__ import annotations

import re

import numpy as np
import pytest
from log_building import tiny_log

from bimvox.log.motion_message import LiftMotionMessage, Samples, add_samples, column_of, motion_message, motion_text


def test_samples_are_the_same_bit_for_bit() -> None:
    log = tiny_log()
    found: dict[int, dict[str, Samples]] = {}
    for motion in log.motions:
        add_samples(found, motion_message(log.plan.site, motion).SerializeToString())
    assert sorted(found) == [motion.order for motion in log.motions]
    for motion in log.motions:
        time_ns, axes = motion.samples()
        ((read_ns, read),) = found[motion.order].values()
        assert (read_ns + motion.start_ns).tobytes() == time_ns.tobytes()
        assert read.tobytes() == axes.tobytes()


@pytest.mark.parametrize(
    "values",
    [
        np.array([0.0, -0.0, np.inf, -np.inf, np.nan, 5e-324, 1.7e308, -1.0]),
        np.array([-(2**63), 2**63 - 1, 0, -1, 7], np.int64),
        np.zeros(0),
    ],
    ids=["double", "int64", "empty"],
)
def test_any_values_come_back_by_the_code_in_the_schema(values: np.ndarray) -> None:
    column = column_of(values)
    assert len(column) == 8 * len(values)
    code = "\n".join(re.findall(r"^//   (.*)$", motion_text(), re.MULTILINE))
    names = {"numpy": np, "column": column}
    exec(code, names)  # what the schema tells other readers
    assert np.asarray(names["values"]).tobytes() == values.tobytes()


def test_two_motions_of_a_lift_and_damaged_columns_are_refused() -> None:
    log = tiny_log()
    message = motion_message(log.plan.site, log.motions[0])
    found: dict[int, dict[str, Samples]] = {}
    add_samples(found, message.SerializeToString())
    with pytest.raises(ValueError, match="lift 1 has two motions"):
        add_samples(found, message.SerializeToString())
    for change in ({"slew_rad": message.slew_rad[:-8]}, {"time_ns": b"1234567"}):
        parts = {"time_ns": message.time_ns, "slew_rad": message.slew_rad, "radius_m": message.radius_m}
        damaged = LiftMotionMessage(**parts | {"height_m": message.height_m} | change)
        with pytest.raises(ValueError, match="of lift 1 differ in length"):
            add_samples({}, damaged.SerializeToString())
