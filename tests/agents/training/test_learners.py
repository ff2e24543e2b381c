"""Learners of other libraries: one learns here, and the judge of `make test-learners` is right about who did."""

import json
from importlib.util import module_from_spec, spec_from_file_location

import numpy as np
import pytest

from benchmarks import learners
from springfoot.agents import load_policy, read_policy
from springfoot.errors import SpringfootError


def trained_by(example, out, timesteps):
    """Return the policy that an example trains for the judge's task."""
    spec = spec_from_file_location(example, learners.EXAMPLES / f"{example}.py")
    assert spec is not None and spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    module.main(out=f"{out}.safetensors", timesteps=timesteps)
    policy = read_policy(f"{out}.safetensors")
    assert policy.settings == learners.TASK
    return policy


@pytest.mark.slow
def test_a_library_learns_to_walk_better(tmp_path):
    """CleanRL's PPO, with half of the steps that `make test-learners` gives."""
    policies = [trained_by("cleanrl_ppo", tmp_path / str(timesteps), timesteps) for timesteps in (0, 65_536)]
    result = learners.judge(*policies, must_learn=True)
    assert result["p"] < learners.SIGNIFICANT and result["after"] > 1.1 * result["before"], result


@pytest.mark.slow
def test_what_sb3_trains_is_a_policy_of_the_task(tmp_path):
    untrained, trained = (trained_by("sb3", tmp_path / str(timesteps), timesteps) for timesteps in (0, 2_048))
    assert all(not np.array_equal(*pair) for pair in zip(trained.weights, untrained.weights, strict=True))
    assert trained.observation_mean.any()  # of VecNormalize


@pytest.mark.slow
def test_who_did_not_get_better_has_not_learned():
    pretrained = load_policy("pretrained")
    alike = learners.judge(pretrained, pretrained, must_learn=True)
    assert alike["passed"] is False and alike["before"] == alike["after"]
    returns = np.full(learners.EPISODES, alike["before"])
    assert learners.compare(returns, returns, must_learn=False)["passed"] is True


def test_what_is_done_is_kept_until_its_example_changes(tmp_path, monkeypatch):
    learner = learners.LEARNERS[0]
    (tmp_path / "results").mkdir()
    kept = {"key": learners._key(learner), "passed": True}
    (tmp_path / "results" / "sb3.json").write_text(json.dumps(kept))
    assert learners.result_of(learner, tmp_path) == kept
    (tmp_path / "sb3.py").write_text("# another")
    monkeypatch.setattr(learners, "EXAMPLES", tmp_path)
    with pytest.raises(SpringfootError, match=r"no virtual environment .* make test-learners"):
        learners.result_of(learner, tmp_path)


def test_every_example_is_a_learner_short_and_in_the_page():
    examples = {path.stem: path.read_text(encoding="utf-8") for path in learners.EXAMPLES.glob("*.py")}
    assert set(examples) == {learner.example for learner in learners.LEARNERS}
    assert max(len(text.splitlines()) for text in examples.values()) <= 64  # four for imports that may be missing
    page = (learners.ROOT / "docs" / "how-to" / "learners.md").read_text(encoding="utf-8")
    assert all(f"`{name}.py`" in page for name in examples)
