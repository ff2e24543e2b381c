"""Train with RLlib's PPO where one machine is not enough: runners on a Ray cluster collect, this process learns.

A run has the folder of any other training: policies, `run.json`, TensorBoard's events. Its checkpoints `ray-N` after N
steps are Ray's own, and hold pickles: continue only runs of your own. A runner that dies is started again by RLlib;
`healthy_runners` and `restarted_runners` of a session in `run.json` tell how many collect now and were started again.
"""

import dataclasses
import shutil
import warnings
from collections.abc import Mapping
from contextlib import ExitStack, suppress
from pathlib import Path
from time import monotonic
from typing import Any

import gymnasium as gym
import numpy as np
import ray  # pyright: ignore[reportMissingImports]
import torch
from ray.rllib.algorithms.ppo import PPOConfig  # pyright: ignore[reportMissingImports]
from ray.rllib.core import DEFAULT_MODULE_ID  # pyright: ignore[reportMissingImports]
from ray.rllib.core.rl_module import RLModuleSpec  # pyright: ignore[reportMissingImports]
from ray.tune.registry import register_env  # pyright: ignore[reportMissingImports]
from tensorboardX import SummaryWriter  # pyright: ignore[reportMissingImports]

from springfoot.agents.policies.conversion import ignoring_unvaried
from springfoot.agents.policies.fingerprint import fingerprint
from springfoot.agents.policies.policy import BEST, LAST, Policy, save_policy
from springfoot.arrays import NDArray
from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.physics.timing import ACTION_STEP
from springfoot.envs.settings.settings import settings_to_json
from springfoot.envs.task.mirror import Mirror, mirror_of
from springfoot.envs.vector_env import SegmentedFootBipedVector
from springfoot.errors import SpringfootError, require_count
from springfoot.files.json_file import object_with_digest, read_object
from springfoot.files.locks import owned
from springfoot.files.provenance import versions_and_commit
from springfoot.files.writing import remove_temporary, require_new, write_atomically

from ..config import TrainingConfig, config_from_json, config_to_json, processors, require_of_rllib
from ..mirrored_network import MirroredMeanStd
from ..progress import Progress
from ..returns import evaluation_of
from ..run_record import RLLIB, best_of, is_of_rllib, read_record, require_past, write_record
from ..signals import Stopping
from .nodes import ending_waits, joined, tell_of_wait
from .rllib_network import OBSERVATION_CLIP, ActorCritic, actor_layers

PACKAGES = ("springfoot", "mujoco", "gymnasium", "numpy", "scipy", "torch", "ray")
"""Packages that decide the result of a training by their versions."""
CHECKPOINT = "ray-"
"""First part of a checkpoint's folder name; the timesteps follow."""
_RECORD = "springfoot.json"
"""File of a checkpoint: the run's sessions, evaluations, timesteps and seconds at its time."""
_VALUE_WEIGHT, _GRADIENT_NORM = 0.5, 0.5
"""Weight of the critic's loss, and largest norm of a gradient, as in stable-baselines3's PPO."""
_ENVIRONMENT = "springfoot-batch"
"""Name under which RLlib finds our environments."""


class _ScaledRewards(gym.vector.VectorWrapper):
    """Multiply the rewards of a vector environment by `scale`, and drop its infos, of which RLlib would make N
    dictionaries a step."""

    def __init__(self, env: gym.vector.VectorEnv, scale: float) -> None:
        super().__init__(env)
        self._scale = scale

    def reset(self, **arguments: Any) -> tuple[NDArray, dict[str, Any]]:
        """Reset as the environment does; return the observations (N, D) and an empty info."""
        return self.env.reset(**arguments)[0], {}

    def step(self, actions: NDArray) -> tuple[NDArray, NDArray, NDArray, NDArray, dict[str, Any]]:
        """Step as the environment does; return observations (N, D), scaled rewards, terminated and truncated (N,), and
        an empty info."""
        observation, reward, terminated, truncated, _ = self.env.step(actions)
        return observation, reward * self._scale, terminated, truncated, {}


def _runner_environments(context: Mapping[str, Any]) -> gym.vector.VectorEnv:
    """Return the environments of one runner as a batch, made from RLlib's `context`: their number, their settings, the
    reward's scale."""
    return _ScaledRewards(SegmentedFootBipedVector(context["num_envs"], **context["settings"]), context["scale"])


def train(config: TrainingConfig, out: str | Path, num_env_runners: int | None = None) -> dict[str, Any]:
    """Train a new policy in the new folder `out` on a Ray cluster; return the content of `run.json`.

    Args:
        config: as for `springfoot.agents.train`; `num_envs` and `update_steps` are those of all runners together.
        out: new folder, on this machine.
        num_env_runners: number of processes that collect, each on one processor of the cluster; 0 collects in this
            process, None takes one for each processor but one, or the next smaller number that divides `num_envs`.

    The cluster is that of the variable RAY_ADDRESS, else the one this process is connected to, else this machine alone.
    Signals, status and errors are those of `springfoot.agents.train`; the bits depend on the order in which samples
    arrive.
    """
    out = require_new(out)
    with owned(out):
        remove_temporary(require_new(out))
        record = {"sessions": [], "evaluations": []}
        return _Run(config, out, record, num_env_runners).learn()


def resume(
    out: str | Path, timesteps: int | None = None, threads: int | None = None, num_env_runners: int | None = None
) -> dict[str, Any]:
    """Continue the run in `out` from its newest checkpoint, which is a pickle; return the content of `run.json`.

    Args:
        out: the run's folder.
        timesteps: how many more to train; None finishes an interrupted run.
        threads: threads of the physics of periodic evaluations; None for as many as before.
        num_env_runners: see `train`; None for as many as before.

    Raises `SpringfootError` for a run that is finished, or that another engine trained.
    """
    out = Path(out)
    with owned(out):
        remove_temporary(out)
        record = read_record(out)
        if not is_of_rllib(record):
            raise SpringfootError(f"{out} was trained by another engine")
        checkpoint = _newest_checkpoint(out)
        past = {"sessions": [], "evaluations": []}
        past = read_object(checkpoint / _RECORD, "record of a checkpoint") if checkpoint else past
        try:
            require_past(past)
            done = require_count("timesteps", past.get("timesteps", 0), 0)
            runners = record["engine"]["num_env_runners"] if num_env_runners is None else num_env_runners
        except (KeyError, TypeError, ValueError) as error:
            raise SpringfootError(f"{checkpoint or out} is not a checkpoint of ours: {error}") from None
        config = config_from_json(record["config"])
        total = config.timesteps if timesteps is None else done + timesteps
        if total <= done and record.get("status") == "finished":
            raise SpringfootError(f"{out} has done its {done:,} timesteps; timesteps must say how many more to train")
        config = dataclasses.replace(config, timesteps=total, threads=threads or config.threads)
        return _Run(config, out, past, runners, checkpoint).learn()


def _newest_checkpoint(out: Path) -> Path | None:
    """Return the folder of the whole checkpoint with the most timesteps in the run's folder `out`; None without one."""
    numbers = [path.name.removeprefix(CHECKPOINT) for path in out.glob(f"{CHECKPOINT}*") if (path / _RECORD).is_file()]
    numbers = [number for number in numbers if number.isdecimal()]
    return out / f"{CHECKPOINT}{max(map(int, numbers))}" if numbers else None


class _Run:
    """Train the run in the folder `out`, from the beginning or from the folder `checkpoint` in it."""

    def __init__(
        self,
        config: TrainingConfig,
        out: Path,
        record: dict[str, Any],
        num_env_runners: int | None,
        checkpoint: Path | None = None,
    ) -> None:
        require_of_rllib(config)
        threads = config.threads or processors()
        self._evaluation = Biped(config.environment, config.eval_episodes, threads)  # first: raises for bad settings
        self._fingerprint = fingerprint(self._evaluation)
        names = self._evaluation.observation_names, self._evaluation.action_names
        self._mirror = mirror_of(*names) if config.mirrored else None
        self._config = config
        self._out = out
        self._checkpoint = checkpoint
        self._runners = num_env_runners  # None until a cluster is joined
        self._trained = record.get("timesteps", 0)
        self._seconds_before = float(record.get("seconds", 0.0))
        self._record = {name: record[name] for name in ("sessions", "evaluations")}
        self._stopping = Stopping()
        self._began = monotonic()

    def learn(self) -> dict[str, Any]:
        """Train until the configured timesteps are done or a signal stops it; return the record."""
        with ExitStack() as stack:
            self._connect(stack)
            with ending_waits():
                assert self._runners is not None
                tell_of_wait(self._runners, "RLlib's runners")
                self._algorithm = self._build()
            stack.callback(shutil.rmtree, self._algorithm.logdir, ignore_errors=True)  # Ray's, empty
            stack.callback(self._algorithm.stop)
            if self._checkpoint is not None:
                self._algorithm.restore_from_path(str(self._checkpoint.absolute()))
                if (self._checkpoint / BEST).is_file():
                    shutil.copyfile(self._checkpoint / BEST, self._out / BEST)
            self._record["sessions"].append({"from_timesteps": self._trained, **versions_and_commit(PACKAGES)})
            self._write_record("running")
            self._writer = stack.enter_context(SummaryWriter(str(self._out), purge_step=self._trained or None))
            self._progress = Progress(self._config.timesteps, self._trained)
            stack.enter_context(self._stopping)  # after Ray, which has handlers of its own
            try:
                with suppress(KeyboardInterrupt), self._progress:  # the second signal: the last checkpoint counts
                    self._learn()
            except Exception:
                self._write_record("failed")
                raise
            self._write_record("finished" if self._is_finished else "interrupted")
        return self._record

    def _connect(self, stack: ExitStack) -> None:
        """Join or start a Ray cluster until `stack` is closed, and decide the number of runners."""
        # A cluster of our own has a processor for each runner, and one for this process, which learns.
        stack.enter_context(joined(None if self._runners is None else max(self._runners + 1, processors())))
        available = int(ray.cluster_resources().get("CPU", 0))
        if self._runners is None:
            runners = range(1, max(1, available - 1) + 1)
            self._runners = max(count for count in runners if self._config.num_envs % count == 0)
        require_count("num_env_runners", self._runners, 0)
        if self._runners > available:  # RLlib would wait for them without an end
            raise SpringfootError(
                f"the Ray cluster has {available} processors, and each runner needs one; "
                f"num_env_runners must be <= {available}, got {self._runners}"
            )
        if self._config.num_envs % max(1, self._runners):  # 0 runners: this process collects
            raise SpringfootError(
                f"num_envs must be a multiple of the {self._runners} runners, got {self._config.num_envs}"
            )

    def _build(self) -> Any:
        """Build RLlib's PPO with the configuration's numbers, and return it; its runners start with it."""
        config = self._config
        assert self._runners is not None
        torch.set_num_threads(1)  # more compete with the threads of the physics
        register_env(_ENVIRONMENT, _runner_environments)
        steps_of_20ms = config.environment.step_seconds / ACTION_STEP  # gamma and lambda are per 20 ms
        gamma = config.gamma**steps_of_20ms
        rollout_steps = max(1, config.update_steps // config.num_envs)
        samples = rollout_steps * config.num_envs
        mean, variance = observation_moments(config, self._mirror)
        network: dict[str, Any] = {
            "hidden": list(config.hidden),
            "log_std": config.log_std,
            "mean": mean.tolist(),
            "variance": variance.tolist(),
        }
        if self._mirror is not None:
            network["mirror"] = {name: getattr(self._mirror, name).tolist() for name in ("index", "sign", "legs_order")}
        rate = config.learning_rate
        ppo = (
            PPOConfig()
            .environment(
                _ENVIRONMENT,
                # 1 - gamma: returns are then of the size of one step's reward
                env_config={"settings": settings_to_json(config.environment), "scale": 1.0 - gamma},
                disable_env_checking=True,
            )
            .env_runners(
                num_env_runners=self._runners,
                num_envs_per_env_runner=config.num_envs // max(1, self._runners),
                gym_env_vectorize_mode="vector_entry_point",
                rollout_fragment_length=rollout_steps,
                explore=True,
            )
            .learners(num_learners=0)
            .rl_module(rl_module_spec=RLModuleSpec(module_class=ActorCritic, model_config=network))
            .training(
                train_batch_size_per_learner=samples,
                minibatch_size=-(-samples // config.minibatches),  # rounded up
                num_epochs=config.epochs,
                lr=[[0, rate], [config.timesteps, rate * config.learning_rate_end]],
                gamma=gamma,
                lambda_=config.gae_lambda**steps_of_20ms,
                clip_param=config.clip_range,
                use_kl_loss=False,
                entropy_coeff=0.0,
                vf_loss_coeff=_VALUE_WEIGHT,
                vf_clip_param=float("inf"),
                grad_clip=_GRADIENT_NORM,
                grad_clip_by="global_norm",
            )
            .fault_tolerance(restart_failed_env_runners=True)
            .debugging(seed=config.seed)
        )
        with warnings.catch_warnings():  # of Ray's own parts
            warnings.simplefilter("ignore")
            return ppo.build_algo()

    def _learn(self) -> None:
        """Train, evaluate and keep checkpoints until the end or a signal."""
        while self._trained < self._config.timesteps and not self._stopping.asked:
            evaluations = self._record["evaluations"]
            if not evaluations or self._trained - evaluations[-1]["timesteps"] >= self._config.eval_interval:
                self._evaluate()
            result = self._algorithm.train()
            collected = result["env_runners"]
            before = self._trained
            self._trained = int(collected["num_env_steps_sampled_lifetime"])
            self._progress.advance(self._trained - before)
            runners = result["fault_tolerance"]
            progress_numbers = {
                "episode_return_mean": collected.get("episode_return_mean", np.nan),
                "healthy_runners": runners["num_healthy_workers"],
                "restarted_runners": runners["num_remote_worker_restarts"],
            }
            for name, value in progress_numbers.items():
                if np.isfinite(value):
                    self._writer.add_scalar(f"rllib/{name}", float(value), self._trained)
            session = self._record["sessions"][-1]
            session |= {name: int(progress_numbers[name]) for name in ("healthy_runners", "restarted_runners")}
        if not self._stopping.asked and not self._is_finished:
            self._evaluate()
        self._save()

    @property
    def _is_finished(self) -> bool:
        """Return True if the configured timesteps are done, and the last evaluation is of the policy after them."""
        evaluations = self._record["evaluations"]
        return bool(evaluations) and evaluations[-1]["timesteps"] == self._trained >= self._config.timesteps

    def _policy(self) -> Policy:
        """Return a copy of the actor as a policy that acts by its mean action.

        Entries of the observation that never varied in training are left out of the action.
        """
        state = self._algorithm.learner_group.get_weights()[DEFAULT_MODULE_ID]
        layers = actor_layers(state)
        return ignoring_unvaried(
            Policy(
                settings=self._config.environment,
                fingerprint=self._fingerprint,
                weights=tuple(weight for weight, _ in layers),
                biases=tuple(bias for _, bias in layers),
                observation_mean=np.array(state["mean"], float),
                observation_variance=np.array(state["variance"], float),
                observation_clip=OBSERVATION_CLIP,
                mirror=self._mirror,
            )
        )

    def _evaluate(self) -> None:
        """Evaluate the policy on the fixed seeds, keep it if it is the best so far, and save."""
        policy = self._policy()
        entry = {"timesteps": self._trained, "seconds": self._seconds(), **evaluation_of(self._evaluation, policy)}
        best = best_of(self._record)
        if best is None or entry["return_mean"] > best["return_mean"]:
            save_policy(self._out / BEST, policy)
        self._record["evaluations"].append(entry)
        for name in ("return_mean", "falls", "seconds_mean"):
            self._writer.add_scalar(f"evaluation/{name}", entry[name], self._trained)
        self._writer.flush()
        self._progress.report(f"return {entry['return_mean']:.1f}, {entry['falls']} of {entry['episodes']} fell")
        self._save()

    def _save(self) -> None:
        """Write the newest policy, a checkpoint of Ray's and the record; remove older checkpoints."""
        save_policy(self._out / LAST, self._policy())
        checkpoint = self._out / f"{CHECKPOINT}{self._trained}"
        unfinished = self._out / f".{checkpoint.name}"  # gets the final name when it is whole
        for leftover in self._out.glob(f".{CHECKPOINT}*"):  # of a run that was killed while it saved
            shutil.rmtree(leftover, ignore_errors=True)
        self._algorithm.save_to_path(str(unfinished.absolute()))
        past = {name: self._record[name] for name in ("sessions", "evaluations")}
        past |= {"timesteps": self._trained, "seconds": self._seconds()}
        write_atomically(unfinished / _RECORD, object_with_digest(past))
        if (self._out / BEST).is_file():
            shutil.copyfile(self._out / BEST, unfinished / BEST)
        shutil.rmtree(checkpoint, ignore_errors=True)  # most often there is none of the same timesteps
        unfinished.rename(checkpoint)
        for path in self._out.glob(f"{CHECKPOINT}*"):
            if path != checkpoint:
                shutil.rmtree(path, ignore_errors=True)  # leftovers cost no more than space
        self._write_record("running")

    def _seconds(self) -> float:
        """Return the wall time of this session and the earlier ones [s]."""
        return round(self._seconds_before + monotonic() - self._began, 1)

    def _write_record(self, status: str) -> None:
        """Write run.json: engine, configuration, status, timesteps, wall time of all sessions, best evaluation, and all
        that the record already holds."""
        self._record |= {
            "engine": {"name": RLLIB, "num_env_runners": self._runners},
            "config": config_to_json(self._config),
            "status": status,
            "timesteps": self._trained,
            "seconds": self._seconds(),
            "best": best_of(self._record),
        }
        if status == "interrupted" and self._stopping.signal is not None:
            self._record["signal"] = self._stopping.signal.name
        write_record(self._out, self._record)


def observation_moments(config: TrainingConfig, mirror: Mirror | None = None) -> tuple[NDArray, NDArray]:
    """Return mean and variance (D,) of the observations, from one update's steps with random actions around 0.

    The whole training normalises by them: statistics that moved would have to be the same on every runner at every
    step. With a `mirror` they are of the observations and their images.
    """
    environments = SegmentedFootBipedVector(config.num_envs, **dict[str, Any](settings_to_json(config.environment)))
    random = np.random.default_rng([config.seed, 1])
    shape = environments.action_space.shape
    observation, _ = environments.reset(seed=config.seed)
    batches = [observation.astype(float)]
    for _ in range(max(1, config.update_steps // config.num_envs)):
        observation, *_ = environments.step(random.normal(0.0, np.exp(config.log_std), shape).clip(-1.0, 1.0))
        batches.append(observation.astype(float))
    environments.close()
    observations = np.concatenate(batches)
    if mirror is not None:
        both = MirroredMeanStd(mirror)
        both.update(observations)
        return both.mean, both.var
    return observations.mean(axis=0), observations.var(axis=0)
