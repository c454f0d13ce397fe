import numpy as np
import pytest

from bimvox.env.observation import VIEW_SIZE
from bimvox.errors import PolicyError
from bimvox.policy.callables import values_of

SEEN = np.zeros((3, VIEW_SIZE), np.float32)


class Model:
    """As stable-baselines3's models."""

    def predict(self, observations, deterministic=False):
        assert deterministic
        return np.arange(len(observations)), None


def test_actions_are_values_and_values_stay_what_they_are():
    for policy in (Model(), lambda seen: np.arange(len(seen)), lambda seen: [0, 1, 2]):
        values = values_of(policy)(SEEN)
        np.testing.assert_array_equal(values, np.eye(6, dtype=np.float32)[:3])
    np.testing.assert_array_equal(values_of(lambda seen: np.full((len(seen), 6), 2.5))(SEEN), np.full((3, 6), 2.5))


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        ([6, 0, 0], r"shape \(3,\)"),
        ([0.5, 0.5, 0.5], r"shape \(3,\)"),
        (np.zeros((3, 5)), r"shape \(3, 5\)"),
        (np.full((3, 6), np.inf), "NaN or infinite"),
        (None, "shape|failed"),
    ],
)
def test_another_answer_is_an_error_when_it_is_asked(answer, said):
    with pytest.raises(PolicyError, match=said):
        values_of(lambda seen: answer)(SEEN)


def test_what_cannot_be_asked_is_refused():
    with pytest.raises(PolicyError, match="policy is 5"):
        values_of(5)
