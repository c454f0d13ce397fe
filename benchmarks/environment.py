"""Measures the steps per second of the paper's construction site through every interface, as a Markdown table.

    python benchmarks/environment.py
    python benchmarks/environment.py --peer-command "python measure_peer.py"

Random actions on 15 x 15 x 6 cells, with the paper's observation and reward; episodes restart automatically. A step is
one action of one site. Each figure is the best of several rounds, because other work on the machine only slows it down.
``VecEnv``, and ``VectorEnv`` with ``copy=False``, return arrays that the step after the next overwrites.

The peer is the environment that the paper's authors published (github.com/AiyuZhu/ConstructionSim-for-RL: 15 x 15 x 8,
columns and beams; pure Python). It cannot be shipped here. To measure it, clone it and let ``--peer-command`` run a
script that steps it and prints steps per second as the last word, for example, in its folder ``ConstructionSim_RL``::

    import time
    # It imports gym, pygame and PyOpenGL; empty modules suffice for the last two.
    from Construction3DEnv import Construct3DEnvObs
    env = Construct3DEnvObs()
    env.reset()
    steps, start = 0, time.perf_counter()
    while time.perf_counter() - start < 10:
        if env.step(env.action_space.sample())[2]:
            env.reset()
        steps += 1
    print(steps / (time.perf_counter() - start))
"""

from __future__ import annotations

import argparse
import os
import shlex
import subprocess
import time
from collections.abc import Callable

import numpy as np

PEER_STEPS_PER_S = 1200.0
"""Steps per second of CPU time of the authors' environment (commit 8a08b9d) on the machine of docs/measured.md,
with empty modules in place of pygame and PyOpenGL."""

SIZES = (1, 64, 1024, 4096)
_ROUNDS, _ROUND_S = 5, 0.4
_clock_s: Callable[[], float] = time.perf_counter


def steps_per_s(step: Callable[[int], object], sites: int) -> float:
    """Return the best rate of several rounds; ``step`` takes the number of the step."""
    best = 0.0
    for _ in range(_ROUNDS):
        count, start = 0, _clock_s()
        while (passed := _clock_s() - start) < _ROUND_S:
            step(count)
            count += 1
        best = max(best, count * sites / passed)
    return best


def single_rate(observation: str) -> float:
    """Return the rate of the single environment."""
    from bimvox.paper.env.site_env import PaperSiteEnv

    env = PaperSiteEnv(observation=observation)
    env.reset(seed=0)
    actions = np.random.default_rng(0).integers(6, size=1000)

    def step(n: int) -> None:
        _, _, terminated, truncated, _ = env.step(actions[n % 1000])
        if terminated or truncated:
            env.reset()

    return steps_per_s(step, 1)


def batched_rate(interface: str, sites: int, threads: int, observation: str = "paper") -> float:
    """Return the rate of one of the batched interfaces."""
    from bimvox.paper.env.batched import BatchedPaperSite
    from bimvox.paper.env.site_env import PaperVectorEnv
    from bimvox.paper.env.spec import PAPER
    from bimvox.policy.vec_env import BatchVecEnv

    actions = np.random.default_rng(0).integers(6, size=(100, sites))
    name, _, how = interface.partition(" ")
    copy = how != "copy=False"
    if name == "VectorEnv":
        vector = PaperVectorEnv(sites, observation=observation, threads=threads, copy=copy)
        vector.reset(seed=0)
        rate = steps_per_s(lambda n: vector.step(actions[n % 100]), sites)
        vector.close()
        return rate
    batch = BatchedPaperSite(PAPER, sites, observation=observation, threads=threads)
    if name == "VecEnv":
        vec = BatchVecEnv(batch)
        vec.reset()
        rate = steps_per_s(lambda n: vec.step(actions[n % 100]), sites)
    else:
        batch.reset()
        rate = steps_per_s(lambda n: batch.step(actions[n % 100]), sites)
    batch.close()
    return rate


def peer_rate(command: str | None) -> float:
    """Return the rate that the peer's command prints, otherwise the rate measured before."""
    if command is None:
        return PEER_STEPS_PER_S
    done = subprocess.run(shlex.split(command), check=True, capture_output=True, text=True)
    return float(done.stdout.split()[-1])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--peer-command", help="a command that prints the peer's steps per second as its last word")
    parser.add_argument(
        "--cpu-time", action="store_true", help="count CPU time, for a machine that is not idle; one thread only"
    )
    arguments = parser.parse_args()
    if arguments.cpu_time:
        global _clock_s
        _clock_s = time.process_time
    peer = peer_rate(arguments.peer_command)
    said = "measured now" if arguments.peer_command else "measured before; see the docstring of this file"
    clock = "CPU time" if arguments.cpu_time else "wall time"
    print(f"{os.cpu_count()} cores, {clock}. Peer: {peer:,.0f} steps/s ({said}).\n")
    print("| interface | observation | sites | threads | steps/s | times the peer |")
    print("|---|---|---|---|---|---|")

    def row(interface: str, observation: str, sites: int, threads: int, rate: float) -> None:
        print(f"| {interface} | {observation} | {sites:,} | {threads} | {rate:,.0f} | {rate / peer:,.0f} |", flush=True)

    row("Gymnasium `Env`", "paper", 1, 1, single_rate("paper"))
    for interface in ("kernel", "VectorEnv copy=False", "VectorEnv copy=True", "VecEnv"):
        for sites in SIZES:
            for threads in (1, 2) if sites > SIZES[1] and not arguments.cpu_time else (1,):
                row(f"`{interface}`", "paper", sites, threads, batched_rate(interface, sites, threads))
    for observation in ("egocentric", "window"):
        threads = 1 if arguments.cpu_time else 2
        row("`kernel`", observation, SIZES[2], threads, batched_rate("kernel", SIZES[2], threads, observation))


if __name__ == "__main__":
    main()
