"""Run one session of a training: PPO's callback, which logs, evaluates and saves between the updates."""

import json
import sys
from collections.abc import Sequence
from contextlib import suppress
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
from ..policies.policy import BEST, LAST, read_policy, save_policy
from .callbacks import Onlooker, Onlookers, tell
from .checkpoint import KEPT_CHECKPOINTS, Checkpoint, checkpoints, write_checkpoint
from .config import TrainingConfig, config_to_json, processors
from .learning_state import learning_state, restore_learning
from .ppo import Learner
from .progress import Progress
from .returns import evaluation_of
from .run_record import best_of, cut_events, event_sizes, same_source, write_record
from .sb3_vec_env import SegmentedFootBipedVecEnv
from .stopping import Stopping
from .training_log import log_configuration, no_word_of_writers

PACKAGES = ("springfoot", "mujoco", "gymnasium", "numpy", "scipy", "torch", "stable-baselines3")
"""Packages whose versions decide the result of a training."""
SHARE = 0.02
"""Largest fraction of the time between two evaluations that checkpoints may take; chosen."""
BEST_FILE = "file.best"
"""Array of a checkpoint with the bytes of the best policy's file."""


class Session(BaseCallback):
    """Train the run in the folder `out`, from the beginning or from the checkpoint `found`."""

    def __init__(
        self,
        config: TrainingConfig,
        out: Path,
        record: dict[str, Any],
        found: Checkpoint | None = None,
        threads: int | None = None,
        callbacks: Sequence[Onlooker] = (),
    ) -> None:
        super().__init__()
        self._config = config
        self._out = out
        self._record = record
        self._found = found
        threads = threads or config.threads or processors()
        settings = settings_to_json(config.environment)
        self._environments = SegmentedFootBipedVecEnv(config.num_envs, num_threads=threads, **settings)
        self._evaluation = Biped(config.environment, config.eval_episodes, threads)
        self._fingerprint = fingerprint(self._evaluation)
        seed = int(np.random.SeedSequence([config.seed, 0]).generate_state(1)[0] >> 3)  # below that of evaluations
        self.learner = Learner(config, self._environments, seed)
        self._stopping = Stopping()
        self._began = monotonic()
        self._written = (0.0, 0.0)
        self._first, self._seconds_before = (found[0]["timesteps"], found[0]["seconds"]) if found else (0, 0.0)
        self._trained = self._first
        self._kept = found
        self._policy = None
        self._best = found[1][BEST_FILE].tobytes() if found and BEST_FILE in found[1] else b""
        self._onlookers = callbacks
        self._sums: dict[str, np.ndarray] = {}
        self._ended: list[dict[str, Any]] = []
        self._whole = True

    def learn(self) -> dict[str, Any]:
        """Train until the configured timesteps are done or a signal stops it; return the record."""
        with no_word_of_writers():
            self._learn()
        return self._record

    def _learn(self) -> None:
        """Run PPO from the beginning or the checkpoint, with progress and signals handled."""
        ppo = self.learner.ppo
        session = {"from_timesteps": self._first, **versions_and_commit(PACKAGES)}
        logged = self._go_on(session)
        self._write_record("running")
        ppo.set_logger(configure(str(self._out), ["tensorboard"]))
        for name, (value, excluded) in logged.items():
            ppo.logger.record(name, value, exclude=tuple(excluded))
        if any(each is session for each in self._record["sessions"]):  # not one that goes on by the same code
            log_configuration(ppo.logger, self._config)
        ppo.num_timesteps = self._first
        self._progress = Progress(self._config.timesteps, self._first)
        try:
            with self._stopping:
                with suppress(KeyboardInterrupt), self._progress:  # at the second signal: what is kept stands
                    onlookers = Onlookers(self, self._onlookers, self._stopping.ask)
                    ppo.learn(self._config.timesteps - self._first, onlookers, reset_num_timesteps=False)
                self._save("finished" if self._finished else "interrupted")
        except OSError as error:
            found = checkpoints(self._out) if self._out.is_dir() else []
            saved = f"resume goes on from {found[0].name}" if found else "nothing of it was saved"
            raise SpringfootError(f"{self._out}: {error.strerror or error}; {saved}") from None
        except Exception:
            self._write_record("failed")
            raise
        finally:
            with suppress(OSError):
                ppo.logger.close()
            self.learner.normalized.close()

    def _go_on(self, session: dict[str, Any]) -> dict[str, Any]:
        """Restore the checkpoint, if there is one, into a new session; return the unwritten values of the logger.

        Random generators come last, so that nothing draws in between.
        """
        if self._found is None:
            self._record["sessions"].append(session)
            cut_events(self._out, {})  # of a training that was killed before it had a checkpoint
            return {}
        header, arrays = self._found
        require_same(self._out, header["fingerprint"], self._fingerprint)
        if self._best and not has_content(self._out / BEST, self._best):
            write_atomically(self._out / BEST, self._best)
        told = best_of(self._record)
        if told is not None:
            again = told | evaluation_of(self._evaluation, read_policy(self._out / BEST))
            if again["return_mean"] != told["return_mean"]:
                session["best"] = again
                print(
                    f"The best policy returns {again['return_mean']:.1f} in this task now", file=sys.stderr, flush=True
                )
        settings = json.loads(json.dumps(config_to_json(self._config)))
        before = header["config"].get("environment", {})
        now = settings["environment"]
        if changed := {name: value for name, value in before.items() if now.get(name) != value}:
            session["changed_from"] = changed
        same = {**header["config"], "threads": 0} == {**settings, "threads": 0}
        if not (same and same_source(self._record["sessions"][-1], session) and "best" not in session):
            self._record["sessions"].append(session)
        learning = {name: values for name, values in arrays.items() if name != BEST_FILE}
        restore_learning(self.learner, self._environments, header["learning"], learning)
        cut_events(self._out, header["events"])
        return header["learning"]["logged"]

    @property
    def _finished(self) -> bool:
        """Return True if all timesteps are done, and evaluated."""
        past = self._record["evaluations"]
        return bool(past) and past[-1]["timesteps"] == self._trained >= self._config.timesteps

    def _on_rollout_start(self) -> None:
        self._sums = {}
        self._ended = []
        self._whole = False
        self._keep()
        past = self._record["evaluations"]
        due = not past or self._trained - past[-1]["timesteps"] >= self._config.eval_interval
        if due and not self._stopping.asked:
            self._evaluate()
        elif monotonic() - self._written[0] > self._written[1] / SHARE:
            self._write_checkpoint()

    def _on_step(self) -> bool:
        for name, values in self._environments.step_info.items():
            if name.startswith(("reward/", "stiffness/")):
                self._sums[name] = self._sums.get(name, 0.0) + values
        self._ended += [self.locals["infos"][i] for i in np.flatnonzero(self.locals["dones"])]
        self._progress.advance(self._config.num_envs)
        return not self._stopping.asked

    def _on_rollout_end(self) -> None:
        self._whole = True
        for name, sums in self._sums.items():
            self.logger.record(name, float(np.mean(sums)) / self.learner.rollout_steps)
        if self._ended:
            episodes = [info["episode"] for info in self._ended]
            self.logger.record("episode/return", np.mean([episode["r"] for episode in episodes]))
            self.logger.record("episode/seconds", np.mean([episode["l"] for episode in episodes]) * self._evaluation.dt)
            falls = [not info["TimeLimit.truncated"] for info in self._ended]
            self.logger.record("episode/falls_share", np.mean(falls))

    def _on_training_end(self) -> None:
        if not self._whole:
            return  # it was ended within a rollout, and what is kept is from before
        self._keep()
        if not self._stopping.asked and not self._finished:
            self._evaluate()

    def _keep(self) -> None:
        """Keep the exact present state, between two updates, for the next checkpoint."""
        self._trained = self.learner.ppo.num_timesteps
        for form in self.logger.output_formats:
            if isinstance(form, TensorBoardOutputFormat):
                form.writer.flush()
        learning, arrays = learning_state(self.learner, self._environments)
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
        self._kept = (header, arrays)
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
        self._keep()
        self._save("running")
        if not tell(self._onlookers, entry):
            self._stopping.ask()

    def _seconds(self) -> float:
        """Wall time of this session and the earlier ones [s]."""
        return self._seconds_before + monotonic() - self._began

    def _save(self, status: str) -> None:
        """Write the kept checkpoint, the newest policy and the record."""
        self._write_checkpoint(1 if status == "finished" else KEPT_CHECKPOINTS)
        if self._policy is not None:
            save_policy(self._out / LAST, self._policy)
        self._write_record(status)

    def _write_checkpoint(self, kept: int = KEPT_CHECKPOINTS) -> None:
        began = monotonic()
        if self._kept is not None:
            write_checkpoint(self._out, *self._kept, kept)
        self._written = monotonic(), monotonic() - began

    def _write_record(self, status: str) -> None:
        """Write run.json with this session's status, time and evaluations."""
        self._record |= {"config": config_to_json(self._config), "status": status, "timesteps": self._trained}
        self._record |= {"seconds": round(self._seconds(), 1), "best": best_of(self._record)}
        if status == "interrupted" and self._stopping.signal is not None:
            self._record["signal"] = self._stopping.signal.name
        write_record(self._out, self._record)
