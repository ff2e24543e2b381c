"""Environments to time: ours behind each of its faces, and others' for the order of magnitude."""

import multiprocessing
import subprocess
import sys
from functools import partial
from importlib.util import find_spec
from statistics import median
from time import perf_counter
from typing import Any

import gymnasium as gym
import numpy as np
from stable_baselines3.common.vec_env import DummyVecEnv, SubprocVecEnv, VecEnv

from springfoot.agents.training.sb3_vec_env import SegmentedFootBipedVecEnv

from .timing import Case
from .walking import SEED, STEP, Walk, vector

OURS = "springfoot.envs:SegmentedFootBiped-v0"
OTHERS = "Walker2d-v5"
FORK = "fork" if "fork" in multiprocessing.get_all_start_methods() else None


def batch(walk: Walk, num: int, threads: int) -> Case:
    """Our full step: observation, reward, termination, autoreset."""
    env = vector(num, threads)
    name = f"springfoot, N = {num}, {threads} thread{'s' * (threads > 1)}"
    return _vector_case(name, env, walk.actions[:, :num], STEP)


def adapter(walk: Walk, num: int, threads: int) -> Case:
    """Make the same for stable-baselines3."""
    return _sb3_case(
        f"SB3 adapter, N = {num}, {threads} threads", SegmentedFootBipedVecEnv(num, num_threads=threads), walk
    )


def single(walk: Walk) -> Case:
    """Return one environment by plain `gym.make`."""
    return _single_case("gym.make, one", gym.make(OURS), walk.actions[:, 0], STEP)


def dummy(walk: Walk, num: int) -> Case:
    """Make the same environment N times, one after the other in this process."""
    return _sb3_case(f"DummyVecEnv, N = {num}", DummyVecEnv([partial(gym.make, OURS)] * num), walk)


def subprocesses(num: int) -> SubprocVecEnv:
    """Make the same environment N times, each in a process of its own, before any thread pool: they are forked."""
    return SubprocVecEnv([partial(gym.make, OURS)] * num, start_method=FORK)


def subproc(walk: Walk, env: SubprocVecEnv) -> Case:
    """Return the environments of `subprocesses`."""
    workers = [process.pid or 0 for process in env.processes]
    return _sb3_case(f"SubprocVecEnv, N = {env.num_envs}", env, walk, workers)


def start_over_others(repeats: int) -> float | None:
    """Time from a new process to the first step over Gymnasium's walker's, kernels kept: median of pairs.

    None where Gymnasium's MuJoCo environments do not import, as in `walker_async`.
    """
    if not find_spec("imageio"):
        return None
    first_step = (
        "import gymnasium, sys; env = gymnasium.make(sys.argv[1]); env.reset(); env.step(env.action_space.sample())"
    )

    def seconds(name: str) -> float:
        begin = perf_counter()
        subprocess.run([sys.executable, "-c", first_step, name], check=True)
        return perf_counter() - begin

    pairs = [(seconds(OURS), seconds(OTHERS)) for _ in range(repeats + 1)][1:]  # the first keeps the kernels
    return median(ours / others for ours, others in pairs)


def walker_async(num: int) -> gym.vector.AsyncVectorEnv | None:
    """Return Gymnasium's walkers, each in a process of its own; before any thread pool, as `subprocesses`.

    None where imageio is missing, without which Gymnasium's MuJoCo environments do not import.
    """
    return gym.vector.AsyncVectorEnv([partial(gym.make, OTHERS)] * num, context=FORK) if find_spec("imageio") else None


def subjects(asynchronous: gym.vector.AsyncVectorEnv | None, num: int, threads: int, steps: int) -> list[Case]:
    """Return Gymnasium's walker under random actions: single, in turn, in processes, and in EnvPool if here."""
    if asynchronous is None:
        print(f"{OTHERS} is left out: it needs imageio (pip install imageio)")
        return []
    one = gym.make(OTHERS)
    one.action_space.seed(SEED)
    seconds = one.unwrapped.dt  # type: ignore[attr-defined]
    actions = np.stack([[one.action_space.sample() for _ in range(num)] for _ in range(steps)])
    serial = gym.vector.SyncVectorEnv([partial(gym.make, OTHERS)] * num)
    workers = [process.pid or 0 for process in asynchronous.processes]
    few = actions[:, : asynchronous.num_envs]
    cases = [
        _single_case(f"{OTHERS}, one", one, actions[:, 0], seconds),
        _vector_case(f"{OTHERS} Sync, N = {num}", serial, actions, seconds),
        _vector_case(f"{OTHERS} Async, N = {asynchronous.num_envs}", asynchronous, few, seconds, workers),
    ]
    if find_spec("envpool"):
        import envpool  # pyright: ignore[reportMissingImports]  # optional

        pool = envpool.make_gymnasium(OTHERS, num_envs=num, num_threads=threads, seed=SEED)
        name = f"{OTHERS} EnvPool, N = {num}, {threads} threads"
        cases.append(_vector_case(name, pool, actions, seconds, seed=None))
    return cases


def _vector_case(
    name: str, env: Any, actions: np.ndarray, seconds: float, workers: list[int] | None = None, seed: int | None = SEED
) -> Case:
    def run() -> None:
        for action in actions:
            env.step(action)

    def prepare() -> None:
        env.reset(**({} if seed is None else {"seed": seed}))

    samples = actions.shape[0] * actions.shape[1]
    return Case(
        name=name, samples=samples, seconds=seconds, prepare=prepare, run=run, close=env.close, workers=workers or ()
    )


def _sb3_case(name: str, env: VecEnv, walk: Walk, workers: list[int] | None = None) -> Case:
    actions = walk.actions[:, : env.num_envs]

    def run() -> None:
        for action in actions:
            env.step(action)

    def prepare() -> None:
        env.seed(SEED)
        env.reset()

    samples = actions.shape[0] * actions.shape[1]
    return Case(
        name=name, samples=samples, seconds=STEP, prepare=prepare, run=run, close=env.close, workers=workers or ()
    )


def _single_case(name: str, env: gym.Env, actions: np.ndarray, seconds: float) -> Case:
    def run() -> None:
        for action in actions:
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()

    return Case(
        name=name,
        samples=len(actions),
        seconds=seconds,
        prepare=lambda: env.reset(seed=SEED),
        run=run,
        close=env.close,
    )
