"""Policies that the caller brings: a function of the observation, or a model of stable-baselines3."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.env.actions import ACTION_COUNT
from bimvox.errors import PolicyError, cut, shown
from bimvox.planning.rollout import Values


def values_of(policy: Any) -> Values:
    """Return the values of the actions by a policy that the caller brought; wrong answers are errors when it is asked.

    Args:
        policy: A function of (N, VIEW_SIZE) float32 observations that returns (N, 6) values of the actions or (N,)
            actions; or a model with ``predict(observations, deterministic=True)``, as stable-baselines3 has.

    Raises:
        PolicyError: If it is neither.
    """
    predict = getattr(policy, "predict", None)
    if callable(predict):
        return checked(lambda observations: _of_actions(predict(observations, deterministic=True)[0]))
    if callable(policy):
        return checked(lambda observations: _of_actions(policy(observations)))
    raise PolicyError(
        f"policy is {shown(policy)}",
        hint="give the id of a stored policy, or none, greedy, nearest or default; a function of observations; or a "
        "model of stable-baselines3",
    )


def _of_actions(answer: Any) -> NDArray[Any]:
    """Return values of actions: 1 for the action that is chosen, if an answer has one for each row."""
    found: NDArray[Any] = np.asarray(answer)
    if found.ndim == 1 and found.dtype.kind in "iu" and not np.setdiff1d(found, np.arange(ACTION_COUNT)).size:
        found = np.eye(ACTION_COUNT, dtype=np.float32)[found]
    return found


def checked(values: Callable[[NDArray[np.float32]], Any]) -> Values:
    """Return a policy whose every answer is (N, 6) numbers, or an error that says what it gave."""

    def found(observations: NDArray[np.float32]) -> NDArray[np.float32]:
        try:
            answer = np.array(values(observations), np.float32)
        except Exception as error:  # of anyone's code
            raise PolicyError(f"the policy failed: {type(error).__name__}: {cut(str(error), 300)}") from error
        wanted = (len(observations), ACTION_COUNT)
        if answer.shape != wanted:
            raise PolicyError(
                f"the policy gave values of shape {answer.shape} for {wanted[0]} observations, not {wanted}"
            )
        if not np.isfinite(answer).all():
            raise PolicyError("the policy gave values that are NaN or infinite")
        return answer

    return found
