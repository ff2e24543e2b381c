"""A training run, new or resumed: a folder that holds its policies, its state and its results.

`best.safetensors` and `last.safetensors` are policies, `state.safetensors` is what `resume` needs, `run.json` holds
what is needed to repeat the run, and its results; beside them are TensorBoard's event files, and pictures
(`agents.run_pictures`). Each file is written whole or not at all.
"""

import dataclasses
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import configure

from springfoot.envs.biped_batch import Biped
from springfoot.envs.settings import settings_to_json
from springfoot.gait.errors import SpringfootError, require_number
from springfoot.gait.json_file import read_object, sealed_object

from .config import TrainingConfig, config_from_json, config_to_json
from .files import make_folder, require_new, write_atomically
from .fingerprint import fingerprint
from .policy import BEST, LAST, RUN, Policy, read_policy, save_policy
from .ppo import Learner
from .progress import Progress
from .run_pictures import Gallery, draw_run
from .sb3_vec_env import SegmentedFootBipedVecEnv
from .source import source
from .tensor_file import read_tensors, write_tensors
from .training_callbacks import Onlooker, Onlookers, tell
from .training_log import log_configuration

STATE, STATE_KEY = "state.safetensors", "springfoot-training"
"""Name of a run folder's training state, and of its header's entry."""
EVALUATION_SEED = 2**30
"""Seed of the first episode of every periodic evaluation, the next ones following."""
PACKAGES = ("springfoot", "mujoco", "gymnasium", "numpy", "scipy", "torch", "stable-baselines3")
"""Packages whose versions decide the result of a training."""


def train(config: TrainingConfig, out: str | Path, callbacks: Sequence[Onlooker] = ()) -> dict[str, Any]:
    """Train a new policy into the new folder `out`; return what `run.json` holds.

    `callbacks` look on: stable-baselines3's, and functions of each periodic evaluation, a dictionary as in `run.json`.
    One that returns False ends the training, with status `interrupted`.
    The training ends early, with status `interrupted` and usable policies, at the first SIGINT or SIGTERM. Raises
    `SpringfootError`, with nothing written, if `out` exists and is not an empty folder.
    """
    out = require_new(out)
    run = _Run(config, out, {"sessions": [], "evaluations": []}, callbacks=callbacks)
    make_folder(out)
    return run.learn()


def resume(out: str | Path, timesteps: int | None = None, callbacks: Sequence[Onlooker] = ()) -> dict[str, Any]:
    """Continue the run in `out` with its saved settings; return what `run.json` holds.

    Args:
        out: the run's folder.
        timesteps: how many more to train after those already done, the step size falling linearly to the new end;
            None finishes an interrupted run.
        callbacks: as for `train`.

    Environments start new episodes and noise is drawn again, both seeded by the run's seed and the steps done. Raises
    `SpringfootError` for a folder without a run, and for a run that this version cannot continue.
    """
    out = Path(out)
    for name in (RUN, STATE, LAST):
        if not (out / name).is_file():
            raise SpringfootError(f"{out} holds no run to continue: no {name} in it")
    record = read_object(out / RUN, "record of a run")
    try:
        config = config_from_json(record["config"])
        for name in ("sessions", "evaluations"):
            if not isinstance(record[name], list) or not all(isinstance(entry, dict) for entry in record[name]):
                raise ValueError(f"{name} must be a list of objects")
        if not isinstance(record["config"], dict):
            raise ValueError("config must be an object")
        require_number("seconds", record.get("seconds", 0.0), 0.0, unit="s")
    except (KeyError, TypeError, ValueError) as error:
        raise SpringfootError(f"{out / RUN} is not the record of a run: {error!r}") from None
    header, arrays = read_tensors(out / STATE, STATE_KEY, "training state", {"timesteps"})
    done = header.get("timesteps")
    if type(done) is not int or done < 0:
        raise SpringfootError(f"{out / STATE} does not say how many timesteps it has done")
    read_policy(out / LAST)  # raises for a policy of another version of the environment
    total = config.timesteps if timesteps is None else done + timesteps
    if total <= done:
        raise SpringfootError(f"{out} has done its {done:,} timesteps; timesteps must say how many more to train")
    run = _Run(dataclasses.replace(config, timesteps=total), out, record, done, callbacks)
    run.learner.restore(arrays)
    return run.learn()


def evaluate_returns(
    biped: Biped, policy: Callable[[np.ndarray], np.ndarray], seed: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Run one episode in each environment of `biped`, seeded `seed`, `seed` + 1, …

    Returns: (N,) return [-], length [s], and whether the episode ended in a fall.
    """
    episodes = biped.num_envs
    returns, seconds, fell = np.zeros(episodes), np.zeros(episodes), np.zeros(episodes, bool)
    active = np.ones(episodes, bool)
    biped.reset(np.arange(episodes), [seed + k for k in range(episodes)])
    observation = biped.observe()
    while active.any():
        result = biped.step(policy(observation), active=active)
        returns += np.where(active, result.reward, 0.0)
        seconds += np.where(active, biped.dt, 0.0)
        fell |= active & result.terminated
        active &= ~(result.terminated | result.truncated)
        observation = result.observation
    return returns, seconds, fell


class _Run(BaseCallback):
    """One session of a run: PPO's callback, which logs, evaluates and saves between the updates."""

    def __init__(
        self,
        config: TrainingConfig,
        out: Path,
        record: dict[str, Any],
        done: int = 0,
        callbacks: Sequence[Onlooker] = (),
    ) -> None:
        super().__init__()
        self._onlookers, self._gallery = callbacks, Gallery(out, done, config.timesteps)
        self._config, self._out, self._record = config, out, record
        threads = config.threads or processors()
        settings = settings_to_json(config.environment)
        self._environments = SegmentedFootBipedVecEnv(config.num_envs, num_threads=threads, **settings)
        self._evaluation = Biped(config.environment, config.eval_episodes, threads)
        self._fingerprint = fingerprint(self._evaluation)
        seed = int(np.random.SeedSequence([config.seed, done]).generate_state(1)[0] >> 3)  # below EVALUATION_SEED
        self.learner = Learner(config, self._environments, seed)
        self._first = self._trained = done
        self._stopping, self._began, self._seconds_before = False, monotonic(), record.get("seconds", 0.0)
        self._sums: dict[str, np.ndarray] = {}
        self._ended: list[dict[str, Any]] = []

    def learn(self) -> dict[str, Any]:
        """Train until the configured timesteps are done or a signal stops it; return the record."""
        ppo, status = self.learner.ppo, "failed"
        self._progress = Progress(self._config.timesteps, self._first)
        self._record |= {"config": config_to_json(self._config), "status": "running"}
        self._record["sessions"].append({"from_timesteps": self._first, **source(PACKAGES)})
        ppo.set_logger(configure(str(self._out), ["tensorboard"]))
        log_configuration(ppo.logger, self._config)
        ppo.num_timesteps = self._first
        onlookers = Onlookers(self, self._onlookers, self._stop)
        try:
            with self._progress, self._signals():
                ppo.learn(self._config.timesteps - self._first, onlookers, reset_num_timesteps=False)
            status = "interrupted" if self._stopping else "finished"
        finally:
            self._record["status"] = status
            self._save(policies=status != "failed")
            ppo.logger.close()
            self.learner.normalized.close()
        draw_run(self._out, self._record, self._evaluation, EVALUATION_SEED)
        return self._record

    def _stop(self) -> None:
        self._stopping = True

    @contextmanager
    def _signals(self) -> Iterator[None]:
        """Let the first SIGINT or SIGTERM end the training after saving a usable policy, and the second at once."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return

        def stop(number: int, _frame: Any) -> None:
            self._stopping = True
            signal.signal(number, before[number])

        before: dict[int, Any] = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
        for number in before:
            signal.signal(number, stop)
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    def _on_rollout_start(self) -> None:
        self._trained = self.learner.ppo.num_timesteps
        self._sums, self._ended = {}, []
        self._gallery.keep(self._trained, self._policy)
        past = self._record["evaluations"]
        due = not past or self._trained - past[-1]["timesteps"] >= self._config.eval_interval
        if due and not self._stopping:
            self._evaluate()

    def _on_step(self) -> bool:
        for name, values in self._environments.step_info.items():
            if name.startswith(("reward/", "stiffness/")):
                self._sums[name] = self._sums.get(name, 0.0) + values
        self._ended += [self.locals["infos"][i] for i in np.flatnonzero(self.locals["dones"])]
        self._progress.advance(self._config.num_envs)
        return not self._stopping

    def _on_rollout_end(self) -> None:
        for name, sums in self._sums.items():
            self.logger.record(name, float(np.mean(sums)) / self.learner.rollout_steps)
        if self._ended:
            episodes = [info["episode"] for info in self._ended]
            self.logger.record("episode/return", np.mean([episode["r"] for episode in episodes]))
            self.logger.record("episode/seconds", np.mean([episode["l"] for episode in episodes]) * self._evaluation.dt)
            falls = [not info["TimeLimit.truncated"] for info in self._ended]
            self.logger.record("episode/falls_share", np.mean(falls))

    def _on_training_end(self) -> None:
        if not self._stopping:
            self._trained = self.learner.ppo.num_timesteps
            self._gallery.keep(self._trained, self._policy)
            self._evaluate()
            self._stopping = False  # whatever an onlooker says, all is done

    def _evaluate(self) -> None:
        """Evaluate the policy on the fixed seeds, keep it if it is the best so far, and save."""
        policy = self._policy()
        returns, seconds, fell = evaluate_returns(self._evaluation, policy, EVALUATION_SEED)
        entry = {
            "timesteps": self._trained,
            "seconds": round(self._seconds(), 1),
            "return_mean": float(returns.mean()),
            "return_sd": float(returns.std()),
            "episodes": len(returns),
            "falls": int(fell.sum()),
            "seconds_mean": float(seconds.mean()),
        }
        past = self._record["evaluations"]
        if not past or entry["return_mean"] > max(earlier["return_mean"] for earlier in past):
            save_policy(self._out / BEST, policy)
        past.append(entry)
        for name in ("return_mean", "falls", "seconds_mean"):
            self.logger.record(f"evaluation/{name}", entry[name])
        self.logger.dump(self._trained)
        self._progress.report(f"return {entry['return_mean']:.1f}, {entry['falls']} of {len(returns)} fell")
        self._save()
        self._stopping |= not tell(self._onlookers, entry)

    def _policy(self) -> Policy:
        return self.learner.policy(self._fingerprint)

    def _seconds(self) -> float:
        """Wall time of this session and the earlier ones [s]."""
        return self._seconds_before + monotonic() - self._began

    def _save(self, policies: bool = True) -> None:
        """Write the newest policy, the state and the record; without `policies` only the record."""
        best = max(self._record["evaluations"], key=lambda entry: entry["return_mean"], default=None)
        self._record |= {"timesteps": self._trained, "seconds": round(self._seconds(), 1), "best": best}
        if policies:
            save_policy(self._out / LAST, self._policy())
            write_tensors(self._out / STATE, STATE_KEY, {"timesteps": self._trained}, self.learner.state())
        write_atomically(self._out / RUN, sealed_object(self._record))


def processors() -> int:
    """Processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
