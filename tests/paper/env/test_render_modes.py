from __future__ import annotations

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from stable_baselines3.common.env_checker import check_env as check_env_sb3

from bimvox.env.gym import PAPER_ENV_IDS
from bimvox.paper import rendering as paper_picture
from bimvox.paper.env.layout import PaperLayout
from bimvox.paper.env.observation import OBSERVATIONS
from bimvox.paper.env.picture import LOOK_RGB, Look
from bimvox.paper.env.site_env import PaperSiteEnv, PaperVectorEnv
from bimvox.paper.env.spec import YardPose
from bimvox.paper.rendering import paper_site_pixels
from bimvox.rendering.colours import START_BOX, TARGET_BOX

LAYOUT = PaperLayout((YardPose(4, 7, "y"),), ((7, 7, 1),), (((12, 2, 1), (13, 5, 3)),))


@pytest.mark.parametrize("env_id", sorted(PAPER_ENV_IDS))
@pytest.mark.parametrize("observation", sorted(OBSERVATIONS))
def test_gymnasium_and_sb3_find_nothing_to_warn_about(env_id, observation, monkeypatch):
    monkeypatch.setattr(paper_picture, "RENDER_SIZE_PX", (64, 48))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gymnasium.make(env_id, observation=observation)
        # Pictures do not depend on the observation: one is enough.
        check_env(env.unwrapped, skip_render_check=observation != "paper_flat")
        # stable-baselines3 warns that three-dimensional boxes other than images should be flattened; they are.
        map_like = len(env.observation_space.shape) == 3
        check_env_sb3(gymnasium.wrappers.FlattenObservation(env) if map_like else env.unwrapped, skip_render_check=True)


def test_without_arguments_the_papers_site_passes_both_checkers():
    env = gymnasium.make("bimvox/PrefabSite-v0").unwrapped
    assert env.site_spec.shape == (15, 15, 6)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env_sb3(env)


def test_make_vec_gives_the_batched_sites():
    env = gymnasium.make_vec("bimvox/PrefabFrame-v0", num_envs=3, render_mode="rgb_array", observation="paper")
    assert isinstance(env, PaperVectorEnv)
    assert env.reset(seed=0)[0].shape == (3, 15, 15, 6)
    frames = env.render()
    assert [frame.shape for frame in frames] == [(480, 640, 3)] * 3
    assert not np.array_equal(frames[0], frames[1])


def painted(pixels, rgb):
    """Return the number of pixels with the hue of a colour, in light or shade."""
    colour = np.array(rgb, float) / np.linalg.norm(rgb)
    vectors = pixels.reshape(-1, 3).astype(float)
    cosine = (vectors @ colour) / np.maximum(np.linalg.norm(vectors, axis=1), 1.0)
    return int((cosine > 0.999).sum())


def test_pictures_have_the_papers_colours():
    env = PaperSiteEnv(PAPER_ENV_IDS["bimvox/PrefabSiteObstructed-v0"], render_mode="rgb_array")
    env.reset(options={"layout": LAYOUT})
    first = env.render()
    assert first.shape == (480, 640, 3)
    assert first.dtype == np.uint8
    assert painted(first, LOOK_RGB[Look.IN_TRANSIT]) > 300
    assert painted(first, START_BOX) > 20
    assert painted(first, TARGET_BOX) > 20
    np.testing.assert_array_equal(first, env.render())
    for action in (3, 3, 3, 5):
        env.step(np.int64(action))
    last = env.render()
    assert painted(last, LOOK_RGB[Look.IN_TRANSIT]) == 0
    assert painted(last, LOOK_RGB[Look.ARRIVED]) > 300
    assert painted(last, TARGET_BOX) < 20


def test_unbuilt_and_assembled_components():
    env = PaperSiteEnv(PAPER_ENV_IDS["bimvox/PrefabFrame-v0"])
    env.reset(seed=0)
    for _ in range(60):  # down the field until the first column stands and the second has moved
        field, (_, x, y, z, *_) = env.distance_field(), env.state
        moves = [((0, 1, 0), 0), ((0, -1, 0), 1), ((-1, 0, 0), 2), ((1, 0, 0), 3), ((0, 0, 1), 4), ((0, 0, -1), 5)]
        nearer = [a for (i, j, k), a in moves if 0 <= x + i < 15 and 0 <= y + j < 15 and 0 <= z + k < 8
                  and 0 <= field[x + i, y + j, z + k] < field[x, y, z]]  # fmt: skip
        env.step(np.int64(nearer[0]))
        if env.state.component == 1 and env.state.steps == 1:
            break
    pixels = paper_site_pixels(env.picture())
    assert painted(pixels, LOOK_RGB[Look.UNBUILT]) > 1000
    assert painted(pixels, LOOK_RGB[Look.ASSEMBLED]) > 100


def test_human_prints(capsys):
    env = gymnasium.make("bimvox/PrefabSite-v0", render_mode="human")
    env.reset(seed=0)
    env.step(np.int64(4))
    assert env.render() is None
    out = capsys.readouterr().out
    assert out.count("step 1 of 36") == 2
    assert "\x1b" not in out
    env.close()
