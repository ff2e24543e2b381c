"""Whether other libraries' learners work on the environment: each example of examples/learners, trained and judged.

    make test-learners

Every learner runs in a virtual environment outside the project's own and writes the policy of before and after its
training. Both walk the same 20 episodes here, in their own task: PPO has learned if the return after exceeds the return
before (paired Wilcoxon test, one-sided, p < .01); the others have to run and to give a policy with finite actions.
Finished work is kept, so that a stopped run goes on; a changed example or environment is done again.
"""

import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Annotated, Any

import numpy as np
import tyro
from numpy.typing import NDArray
from scipy.stats import wilcoxon

from springfoot.agents import PolicyFunction, baseline, load_policy
from springfoot.agents.policies.fingerprint import fingerprint
from springfoot.agents.training.returns import evaluate_returns
from springfoot.command_line import exit_code
from springfoot.envs import Biped, BipedSettings
from springfoot.errors import SpringfootError
from springfoot.files.markdown import table

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples" / "learners"
VENV = "many"
"""Folder of the virtual environment, which `make test-learners` makes."""
EPISODES = 20
SIGNIFICANT = 0.01
SHORT = 8192
"""Steps of a learner that only has to run."""
TASK = BipedSettings(episode_seconds=10.0, push_newton=150.0)
"""Task of every example."""


@dataclass(frozen=True, kw_only=True)
class Learner:
    """One example with its flags."""

    name: str
    packages: tuple[str, ...]
    """Packages told with their versions."""
    example: str
    flags: tuple[str, ...] = ()
    timesteps: int = 131_072
    must_learn: bool = True


def _runs(name: str, packages: tuple[str, ...], example: str, *flags: str) -> Learner:
    return Learner(name=name, packages=packages, example=example, flags=flags, timesteps=SHORT, must_learn=False)


SB3 = ("stable-baselines3",)
CONTRIB = ("sb3-contrib",)
TORCHRL = ("torchrl",)
LEARNERS = (
    Learner(name="stable-baselines3 PPO", packages=SB3, example="sb3"),
    Learner(name="CleanRL style PPO", packages=("gymnasium", "torch"), example="cleanrl_ppo"),
    Learner(name="TorchRL PPO, native batch", packages=TORCHRL, example="torchrl_ppo"),
    Learner(name="skrl PPO", packages=("skrl",), example="skrl_ppo"),
    Learner(name="Tianshou PPO", packages=("tianshou",), example="tianshou_ppo"),
    Learner(name="RSL-RL PPO", packages=("rsl-rl-lib",), example="rsl_rl_ppo"),
    _runs("stable-baselines3 SAC", SB3, "sb3", "--algorithm", "sac"),
    _runs("sb3-contrib TQC", CONTRIB, "sb3", "--algorithm", "tqc"),
    _runs("sb3-contrib RecurrentPPO", CONTRIB, "sb3_recurrent"),
    _runs("TorchRL PPO, GymEnv", TORCHRL, "torchrl_ppo", "--face", "GymEnv"),
    _runs("TorchRL PPO, GymWrapper", TORCHRL, "torchrl_ppo", "--face", "GymWrapper"),
)


@dataclass(frozen=True, kw_only=True)
class Flags:
    """Train with every library, and judge the policies; exits with 1 where one did not."""

    folder: Annotated[Path, tyro.conf.arg(metavar="FOLDER")] = Path("build/learners")
    """Where `make test-learners` makes the virtual environment, and where policies and results are kept."""
    only: tuple[str, ...] = ()
    """Examples to run, by file name without .py; all unless given."""


def main() -> int:
    """Run the trainings that are not done yet, and print the table."""
    flags = tyro.cli(Flags, prog="python -m benchmarks.learners")
    learners = [learner for learner in LEARNERS if not flags.only or learner.example in flags.only]
    results = [result_of(learner, flags.folder) for learner in learners]
    text = table(HEAD, [row_of(learner, result) for learner, result in zip(learners, results, strict=True)])
    (flags.folder / "table.md").write_text(f"{text}\n", encoding="utf-8")
    print(f"{text}\n\n{sum(result['seconds'] for result in results) / 60:.0f} minutes in all")
    failed = [learner.name for learner, result in zip(learners, results, strict=True) if not result["passed"]]
    if failed:
        print(f"failed: {', '.join(failed)}", file=sys.stderr)
    return 1 if failed else 0


def result_of(learner: Learner, folder: Path) -> dict[str, Any]:
    """Return the result of a learner: read, or else found out and written."""
    slug = "-".join([learner.example, *(flag for flag in learner.flags if not flag.startswith("--"))])
    path = folder / "results" / f"{slug}.json"
    key = _key(learner)
    if path.is_file() and (kept := json.loads(path.read_text(encoding="utf-8")))["key"] == key:
        return kept
    path.parent.mkdir(parents=True, exist_ok=True)
    print(f"{learner.name} …", flush=True)
    python = folder.resolve() / VENV / "bin" / "python"
    after = path.with_suffix(".after.safetensors").resolve()
    before = path.with_suffix(".before.safetensors").resolve()
    if not python.is_file():
        raise SpringfootError(f"no virtual environment {folder / VENV}; make test-learners makes it")
    began = perf_counter()
    result: dict[str, Any] = {"key": key, "versions": _versions(python, learner.packages)}
    if learner.example == "sb3_recurrent":
        result |= _judge_recurrent(learner, python, path.with_suffix(".safetensors").resolve())
    else:
        train(replace(learner, timesteps=0), python, before)
        train(learner, python, after)
        result |= judge(load_policy(before), load_policy(after), learner.must_learn)
    result |= {"seconds": perf_counter() - began}
    path.write_text(json.dumps(result, indent=1), encoding="utf-8")
    return result


def train(learner: Learner, python: Path, out: Path) -> None:
    """Run an example in its virtual environment; its output goes beside `out`."""
    words = [str(EXAMPLES / f"{learner.example}.py"), "--out", str(out), "--timesteps", str(learner.timesteps)]
    with out.with_suffix(".log").open("w") as log:
        done = subprocess.run([python, *words, *learner.flags], cwd=out.parent, stdout=log, stderr=log, env=_environ())
    if done.returncode:
        raise SpringfootError(f"{learner.name} ended with {done.returncode}; its output is in {log.name}")


def judge(before: PolicyFunction, after: PolicyFunction, must_learn: bool) -> dict[str, Any]:
    """Return `compare` of two policies over the same episodes of `TASK`."""
    return compare(_returns(before), _returns(after), must_learn)


def compare(before: NDArray, after: NDArray, must_learn: bool) -> dict[str, Any]:
    """Tell whether a learner passes by its returns (EPISODES,) before and after the training."""
    test: Any = wilcoxon(after, before, alternative="greater", zero_method="zsplit")
    means = {"before": float(before.mean()), "after": float(after.mean()), "better": int((after > before).sum())}
    passed = np.isfinite(after).all() and (test.pvalue < SIGNIFICANT or not must_learn)
    return means | {"p": float(test.pvalue), "passed": bool(passed)}


def row_of(learner: Learner, result: Mapping[str, Any]) -> list[str]:
    """Return a learner's row under `HEAD`."""
    versions = ", ".join(f"{name} {number}" for name, number in result["versions"].items())
    p = f"{result['p']:.1g}" if learner.must_learn else "not asked"
    numbers = [f"{result['before']:.0f}", f"{result['after']:.0f}", f"{result['better']} of {EPISODES}", p]
    verdict = ("learned" if learner.must_learn else "runs, finite, file") if result["passed"] else "**failed**"
    return [learner.name, versions, f"{learner.timesteps:,}", *numbers, verdict]


HEAD = ("learner", "tried with", "steps", "return before", "after", "better", "p", "verdict")


def _returns(policy: PolicyFunction) -> NDArray:
    return evaluate_returns(Biped(TASK, EPISODES), policy, 0)[0]


def _judge_recurrent(learner: Learner, python: Path, out: Path) -> dict[str, Any]:
    """Walk a policy with a memory by its function's name where its library is; before, its mean action was near 0."""
    train(learner, python, out)
    given = {"episode_seconds": TASK.episode_seconds, "push_newton": TASK.push_newton}
    code = f"""import json
from springfoot.evaluation import policy_and_settings, record
policy, settings = policy_and_settings("sb3_recurrent:act", {given})
print(json.dumps(record(policy, settings, name="recurrent", episodes={EPISODES}).returns.tolist()))"""
    own = _environ() | {"RECURRENT": str(out)}
    done = subprocess.run([python, "-c", code], cwd=EXAMPLES, env=own, capture_output=True, text=True)
    if done.returncode:
        raise SpringfootError(f"{learner.name} was trained, but does not walk: {done.stderr}")
    after = np.array(json.loads(done.stdout.splitlines()[-1]))
    return compare(_returns(baseline("untrained", TASK)), after, learner.must_learn)


def _key(learner: Learner) -> str:
    """Return the digest of a result's sources: example, flags, environment."""
    parts = [(EXAMPLES / f"{learner.example}.py").read_text(encoding="utf-8"), repr(learner)]
    return hashlib.sha256(json.dumps([*parts, fingerprint(Biped(TASK, 1))]).encode()).hexdigest()


def _versions(python: Path, packages: tuple[str, ...]) -> dict[str, str]:
    code = "import sys; from importlib.metadata import version; print(*map(version, sys.argv[1:]))"
    done = subprocess.run([python, "-c", code, *packages], check=True, capture_output=True, text=True)
    return dict(zip(packages, done.stdout.split(), strict=True))


def _environ() -> dict[str, str]:
    return os.environ | {"RAY_USAGE_STATS_ENABLED": "0", "OMP_NUM_THREADS": "1"}


if __name__ == "__main__":
    sys.exit(exit_code("make test-learners", main))
