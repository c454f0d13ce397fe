"""Three trainings with stock tools, 10 s of processor time each: stable-baselines3 twice, and torch alone."""

import gymnasium
import numpy as np
import torch
from stable_baselines3 import DQN

from bimvox.env.observation import FRAME_ACTIONS, FRAME_COUNT

STEPS = 8_000


def success(env, policy, episodes=50):
    """Share of episodes that end at the target."""
    arrived = 0
    for n in range(episodes):
        (seen, info), over = env.reset(seed=1_000 + n), False
        while not over:
            seen, _, terminated, truncated, info = env.step(policy(seen))
            over = terminated or truncated
        arrived += info["is_success"]
    return arrived / episodes


env = gymnasium.make("bimvox:bimvox/PrefabSite-v0", observation="egocentric", reward="shaped")
model = DQN(
    "MlpPolicy",
    env,
    learning_rate=5e-4,
    buffer_size=50_000,
    learning_starts=500,
    gamma=0.95,
    exploration_fraction=0.5,
    target_update_interval=500,
    seed=0,
)
model.learn(STEPS)
print("paper's site", success(env, lambda seen: model.predict(seen, deterministic=True)[0]))


# Lift-v0 observes in a frame turned towards the target; a plain network learns it if its actions are in that frame too.
class InFrame(gymnasium.Wrapper):
    """A lift whose actions are those of the observation's frame."""

    def reset(self, **chosen):
        """Remember the frame of the first observation."""
        seen, info = self.env.reset(**chosen)
        self.frame = round(seen[-1] * (FRAME_COUNT - 1))
        return seen, info

    def step(self, action):
        """Turn the action into the site's frame."""
        seen, *rest = self.env.step(np.argsort(FRAME_ACTIONS[self.frame])[action])
        self.frame = round(seen[-1] * (FRAME_COUNT - 1))
        return seen, *rest


lift = InFrame(gymnasium.make("bimvox/Lift-v0"))
model = DQN(
    "MlpPolicy",
    lift,
    learning_rate=5e-4,
    buffer_size=20_000,
    learning_starts=500,
    gamma=0.9,
    exploration_fraction=0.5,
    target_update_interval=500,
    policy_kwargs={"net_arch": [128, 64]},
    seed=0,
)
model.learn(STEPS)
print("lift", success(lift, lambda seen: model.predict(seen, deterministic=True)[0]))


# Gymnasium and torch alone, on the paper's site.
torch.manual_seed(0)
rng = np.random.default_rng(0)
values, target = (
    torch.nn.Sequential(torch.nn.Linear(env.observation_space.shape[0], 128), torch.nn.ReLU(), torch.nn.Linear(128, 6))
    for _ in range(2)
)
adam, memory = torch.optim.Adam(values.parameters(), lr=5e-4), []


def best(seen):
    """Return the move of the highest value."""
    with torch.no_grad():
        return int(values(torch.as_tensor(seen)).argmax())


seen, _ = env.reset(seed=0)
for step in range(STEPS):
    action = int(rng.integers(6)) if rng.random() < max(0.05, 1 - 2 * step / STEPS) else best(seen)
    after, reward, terminated, truncated, _ = env.step(action)
    memory.append((seen, action, np.float32(reward), after, terminated))
    seen = env.reset()[0] if terminated or truncated else after
    if step % 250 == 0:
        target.load_state_dict(values.state_dict())
    if step >= 500 and step % 4 == 0:
        drawn = [memory[n] for n in rng.integers(len(memory), size=64)]
        before, taken, earned, later, ended = (torch.as_tensor(np.array(column)) for column in zip(*drawn, strict=True))
        with torch.no_grad():
            wanted = earned + 0.9 * target(later).max(dim=1).values * ~ended
        loss = torch.nn.functional.smooth_l1_loss(values(before).gather(1, taken[:, None])[:, 0], wanted)
        adam.zero_grad()
        loss.backward()
        adam.step()
print("paper's site, torch alone", success(env, best))
