"""Run one session of a training: PPO's callback, which logs, evaluates and saves between the updates."""

import json
import sys
from collections.abc import Sequence
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import TensorBoardOutputFormat, configure

from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.settings.settings import settings_to_json
from springfoot.errors import SpringfootError
from springfoot.files.provenance import versions_and_commit
from springfoot.files.tensor_file import MOST_TENSOR_BYTES
from springfoot.files.text_table import has_content, read_bytes
from springfoot.files.writing import write_atomically

from ..policies.fingerprint import fingerprint, require_same
from ..policies.policy import BEST, LAST, Policy, read_policy, save_policy
from .callbacks import SessionAndUserCallbacks, UserCallback, call_with_evaluation
from .checkpoint import KEPT_CHECKPOINTS, Checkpoint, checkpoints, write_checkpoint
from .config import TrainingConfig, config_to_json, processors
from .ppo import Learner
from .progress import Progress
from .resume_state import restore_learning, resume_state
from .returns import evaluation_of
from .run_record import best_of, cut_events, event_sizes, same_source, write_record
from .sb3_vec_env import SegmentedFootBipedVecEnv
from .signals import Stopping
from .training_log import log_configuration, without_writer_tracebacks

PACKAGES = ("springfoot", "mujoco", "gymnasium", "numpy", "scipy", "torch", "stable-baselines3")
"""Packages that decide the result of a training by their versions."""
CHECKPOINT_TIME_FRACTION = 0.02
"""Largest fraction of the wall time that checkpoints between two evaluations may take; chosen."""
LEARNED_ARRAYS = ("network.", "observation.", "return.")
"""First parts of the names of the arrays that a training may begin with: network and running statistics."""
BEST_FILE = "file.best"
"""Array of a checkpoint with the bytes of the best policy's file."""


class Session(BaseCallback):
    """Train the run in the folder `out`, from the beginning or from `checkpoint`.

    At the beginning the network is untrained, or that of `begin`, a checkpoint of another run or a policy.

    PPO alternates rollouts, which collect steps, and updates of the weights. At the start of each rollout the exact
    state is captured; logs, evaluations and checkpoints are made of the captured state.
    """

    def __init__(
        self,
        config: TrainingConfig,
        out: Path,
        record: dict[str, Any],
        checkpoint: Checkpoint | None = None,
        threads: int | None = None,
        callbacks: Sequence[UserCallback] = (),
        begin: Checkpoint | Policy | None = None,
    ) -> None:
        super().__init__()
        self._config = config
        self._out = out
        self._record = record
        self._start_from = checkpoint
        threads = threads or config.threads or processors()
        settings = settings_to_json(config.environment)
        self._environments = SegmentedFootBipedVecEnv(config.num_envs, num_threads=threads, **settings)
        self._evaluation = Biped(config.environment, config.eval_episodes, threads)
        self._fingerprint = fingerprint(self._evaluation)
        # A seed of 29 bits: the environments count on from it, and evaluations begin at 2^30.
        seed = int(np.random.SeedSequence([config.seed, 0]).generate_state(1)[0] >> 3)
        self.learner = Learner(config, self._environments, seed, threads)
        self._begun_from = {} if begin is None else {"begun_from": self._begin_with(begin)}
        self._stopping = Stopping()
        self._began = monotonic()
        self._written_at = 0.0  # time of the latest checkpoint
        self._write_seconds = 0.0  # time that writing it took
        header, arrays = checkpoint or ({"timesteps": 0, "seconds": 0.0}, {})
        self._first_timesteps = header["timesteps"]
        self._seconds_before = header["seconds"]
        self._trained = self._first_timesteps
        self._captured = checkpoint
        self._policy = None  # of the captured state
        self._best = arrays[BEST_FILE].tobytes() if BEST_FILE in arrays else b""  # the best policy's file
        self._user_callbacks = callbacks
        self._sums: dict[str, np.ndarray] = {}  # over the steps of a rollout, (N,) by name
        self._ended: list[dict[str, Any]] = []  # infos of the episodes that ended in a rollout
        self._rollout_complete = True

    def _begin_with(self, begin: Checkpoint | Policy) -> dict[str, Any]:
        """Give the learner network and running statistics of another run's checkpoint, or those of a policy; return
        its entry in the record.

        Raises `SpringfootError` if it has other observations, actions or layers.
        """
        of_policy = isinstance(begin, Policy)
        subject, spaces = ("policy", begin.fingerprint) if of_policy else ("run", begin[0]["fingerprint"])
        same_spaces = {name: self._fingerprint[name] for name in ("observation", "action")}
        require_same(f"the {subject} to begin from", spaces, same_spaces)
        if of_policy:
            self.learner.begin_with(begin)
        else:
            self.learner.restore(_learned(begin[1]))
        learned = _learned(self.learner.state())
        digest = sha256(b"".join(learned[name].tobytes() for name in sorted(learned))).hexdigest()
        return {"sha256": digest} if of_policy else {"timesteps": begin[0]["timesteps"], "sha256": digest}

    def learn(self) -> dict[str, Any]:
        """Train until the configured timesteps are done or a signal stops it; return the record."""
        with without_writer_tracebacks():
            self._learn()
        return self._record

    def _learn(self) -> None:
        """Run PPO from the beginning or the checkpoint, showing progress; save at the end, also after a signal."""
        ppo = self.learner.ppo
        session = {"from_timesteps": self._first_timesteps, **self._begun_from, **versions_and_commit(PACKAGES)}
        logged = self._restore(session)
        self._write_record("running")
        ppo.set_logger(configure(str(self._out), ["tensorboard"]))
        for name, (value, excluded) in logged.items():
            ppo.logger.record(name, value, exclude=tuple(excluded))
        if any(recorded is session for recorded in self._record["sessions"]):  # with the same code it is not recorded
            log_configuration(ppo.logger, self._config)
        ppo.num_timesteps = self._first_timesteps
        self._progress = Progress(self._config.timesteps, self._first_timesteps)
        try:
            with self._stopping:
                with suppress(KeyboardInterrupt), self._progress:  # the second signal: the captured state is saved
                    callbacks = SessionAndUserCallbacks(self, self._user_callbacks, self._stopping.ask)
                    steps = self._config.timesteps - self._first_timesteps
                    ppo.learn(steps, callbacks, reset_num_timesteps=False)
                self._save("finished" if self._is_finished else "interrupted")
        except OSError as error:
            written = checkpoints(self._out) if self._out.is_dir() else []
            saved = f"resume goes on from {written[0].name}" if written else "nothing of it was saved"
            raise SpringfootError(f"{self._out}: {error.strerror or error}; {saved}") from None
        except Exception:
            self._write_record("failed")
            raise
        finally:
            with suppress(OSError):
                ppo.logger.close()
            self.learner.normalized.close()

    def _restore(self, session: dict[str, Any]) -> dict[str, Any]:
        """Restore the checkpoint, if there is one; return the logger's unwritten values.

        `session` joins the record unless it only continues the last one: same code, settings and best return. A best
        policy with another return than the recorded one, as under another reward, is recorded in it anew. Random
        generators are restored last, so that nothing draws in between. Raises `SpringfootError` for a checkpoint of
        another version of the environment, or of another learner.
        """
        if self._start_from is None:
            self._record["sessions"].append(session)
            cut_events(self._out, {})  # of a training that was killed before its first checkpoint
            return {}
        header, arrays = self._start_from
        require_same(self._out, header["fingerprint"], self._fingerprint)
        # The checkpoint's best policy counts: a session that was killed may have written a later one.
        if self._best and not has_content(self._out / BEST, self._best):
            write_atomically(self._out / BEST, self._best)
        recorded = best_of(self._record)
        if recorded is not None:
            measured = recorded | evaluation_of(self._evaluation, read_policy(self._out / BEST))
            if measured["return_mean"] != recorded["return_mean"]:
                session["best"] = measured
                print(
                    f"The best policy returns {measured['return_mean']:.1f} in this task now",
                    file=sys.stderr,
                    flush=True,
                )
        config = json.loads(json.dumps(config_to_json(self._config)))  # as the header's: tuples are lists in JSON
        before = header["config"].get("environment", {})
        now = config["environment"]
        if changed := {name: value for name, value in before.items() if now.get(name) != value}:
            session["changed_from"] = changed
        same_config = {**header["config"], "threads": 0} == {**config, "threads": 0}  # threads change no bit
        if not (same_config and same_source(self._record["sessions"][-1], session) and "best" not in session):
            self._record["sessions"].append(session)
        learning = {name: values for name, values in arrays.items() if name != BEST_FILE}
        restore_learning(self.learner, self._environments, header["learning"], learning)
        cut_events(self._out, header["events"])
        return header["learning"]["logged"]

    @property
    def _is_finished(self) -> bool:
        """Return True if the configured timesteps are done, and the last evaluation is of the policy after them."""
        evaluations = self._record["evaluations"]
        return bool(evaluations) and evaluations[-1]["timesteps"] == self._trained >= self._config.timesteps

    def _on_rollout_start(self) -> None:
        """Capture the state between two updates; evaluate if that is due, else write a checkpoint now and then."""
        self._sums = {}
        self._ended = []
        self._rollout_complete = False
        self._capture()
        evaluations = self._record["evaluations"]
        due = not evaluations or self._trained - evaluations[-1]["timesteps"] >= self._config.eval_interval
        if due and not self._stopping.asked:
            self._evaluate()
        elif monotonic() - self._written_at > self._write_seconds / CHECKPOINT_TIME_FRACTION:
            self._write_checkpoint()  # the more seldom the longer it takes

    def _on_step(self) -> bool:
        """Sum rewards and stiffness, and collect the infos of ended episodes; return False to end the training."""
        for name, values in self._environments.step_info.items():
            if name.startswith(("reward/", "stiffness/")):
                self._sums[name] = self._sums.get(name, 0.0) + values
        self._ended += [self.locals["infos"][i] for i in np.flatnonzero(self.locals["dones"])]
        self._progress.advance(self._config.num_envs)
        return not self._stopping.asked

    def _on_rollout_end(self) -> None:
        """Log means over the rollout: rewards, stiffness, and return, length and falls of the ended episodes."""
        self._rollout_complete = True
        for name, sums in self._sums.items():
            self.logger.record(name, float(np.mean(sums)) / self.learner.rollout_steps)
        if self._ended:
            episodes = [info["episode"] for info in self._ended]
            self.logger.record("episode/return", np.mean([episode["r"] for episode in episodes]))
            self.logger.record("episode/seconds", np.mean([episode["l"] for episode in episodes]) * self._evaluation.dt)
            falls = [not info["TimeLimit.truncated"] for info in self._ended]
            self.logger.record("episode/falls_share", np.mean(falls))

    def _on_training_end(self) -> None:
        """Capture and evaluate the last state."""
        if not self._rollout_complete:
            return  # ended within a rollout: the state captured at its start is the last one between two updates
        self._capture()
        if not self._stopping.asked and not self._is_finished:
            self._evaluate()

    def _capture(self) -> None:
        """Hold a copy of the exact present state, between two updates, for the next checkpoint."""
        self._trained = self.learner.ppo.num_timesteps
        for form in self.logger.output_formats:
            if isinstance(form, TensorBoardOutputFormat):
                form.writer.flush()
        learning, arrays = resume_state(self.learner, self._environments)
        header = {
            "timesteps": self._trained,
            "config": config_to_json(self._config),
            "fingerprint": self._fingerprint,
            "record": {name: list(self._record[name]) for name in ("sessions", "evaluations")},
            "seconds": round(self._seconds(), 1),
            "events": event_sizes(self._out),
            "learning": learning,
        }
        if self._best:
            arrays[BEST_FILE] = np.frombuffer(self._best, np.uint8)
        self._captured = (header, arrays)
        self._policy = self.learner.policy(self._fingerprint)

    def _evaluate(self) -> None:
        """Evaluate the policy on the fixed seeds, keep it if it is the best so far, and save."""
        assert self._policy is not None
        entry = {"timesteps": self._trained, "seconds": round(self._seconds(), 1)} | evaluation_of(
            self._evaluation, self._policy
        )
        best = best_of(self._record)
        if best is None or entry["return_mean"] > best["return_mean"]:
            save_policy(self._out / BEST, self._policy)
            self._best = read_bytes(self._out / BEST, MOST_TENSOR_BYTES)
        self._record["evaluations"].append(entry)
        for name in ("return_mean", "falls", "seconds_mean"):
            self.logger.record(f"evaluation/{name}", entry[name])
        self.logger.dump(self._trained)
        self._progress.report(f"return {entry['return_mean']:.1f}, {entry['falls']} of {entry['episodes']} fell")
        self._capture()
        self._save("running")
        if not call_with_evaluation(self._user_callbacks, entry):
            self._stopping.ask()

    def _seconds(self) -> float:
        """Return the wall time of this session and the earlier ones [s]."""
        return self._seconds_before + monotonic() - self._began

    def _save(self, status: str) -> None:
        """Write the captured state as a checkpoint, the newest policy, and the record with this `status`."""
        self._write_checkpoint(1 if status == "finished" else KEPT_CHECKPOINTS)  # a finished run needs no older ones
        if self._policy is not None:
            save_policy(self._out / LAST, self._policy)
        self._write_record(status)

    def _write_checkpoint(self, kept: int = KEPT_CHECKPOINTS) -> None:
        """Write the captured state and remove all but the newest `kept` checkpoints; note the time that it took."""
        began = monotonic()
        if self._captured is not None:
            write_checkpoint(self._out, *self._captured, kept)
        self._written_at = monotonic()
        self._write_seconds = self._written_at - began

    def _write_record(self, status: str) -> None:
        """Write run.json: configuration, status, timesteps, wall time of all sessions, best evaluation, and all that
        the record already holds."""
        self._record |= {
            "config": config_to_json(self._config),
            "status": status,
            "timesteps": self._trained,
            "seconds": round(self._seconds(), 1),
            "best": best_of(self._record),
        }
        if status == "interrupted" and self._stopping.signal is not None:
            self._record["signal"] = self._stopping.signal.name
        write_record(self._out, self._record)


def _learned(arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return those of a learner's `arrays` that another training may begin with."""
    return {name: values for name, values in arrays.items() if name.startswith(LEARNED_ARRAYS)}
