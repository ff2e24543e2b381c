"""Submissions: a folder judged to the same bits, and refused when anything in it was changed."""

import json
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

from springfoot.agents import read_policy, save_policy
from springfoot.agents.policies.fingerprint import fingerprint
from springfoot.cli.judge import judge_main
from springfoot.cli.main import main
from springfoot.envs import Biped
from springfoot.errors import SpringfootError
from springfoot.evaluation.benchmark import submission as benchmark
from springfoot.evaluation.benchmark.leaderboard import judged_rows, leaderboard
from springfoot.evaluation.benchmark.task_walks import policy_on_task, walk_drawn_from, walk_publicly
from springfoot.files.json_file import object_with_digest, read_object

REPOSITORY = Path(__file__).parents[3]
TASK = "Walk-v0"


@pytest.fixture(scope="module")
def submitted(tmp_path_factory):
    """A submission of `pretrained`, and one of springs."""
    folder = tmp_path_factory.mktemp("submissions")
    return [
        benchmark.submit("pretrained", TASK, "ours", folder / "ours", threads=1),
        benchmark.submit("constant:400,20", TASK, "springs", folder / "springs", threads=1),
    ]


def copied(submission, folder):
    """A copy of a submission's files in a new folder."""
    folder.mkdir()
    for path in submission.folder.iterdir():
        if path.name != benchmark.JUDGED:
            (folder / path.name).write_bytes(path.read_bytes())
    return folder


@pytest.mark.slow
def test_a_submission_is_judged_to_the_same_bits_on_any_number_of_threads(submitted, tmp_path):
    folders = [copied(each, tmp_path / each.name) for each in submitted]
    assert main(["judge", *map(str, folders), "--threads", "2"]) == 0
    judged = {folder.name: read_object(folder / benchmark.JUDGED, "judgement") for folder in folders}
    assert [each["same_bits"] for each in judged.values()] == [True, True]
    rows = judged_rows(tmp_path)
    means = {each.name: each.walks.returns.mean() for each in submitted}
    assert [row.submission.name for row in rows] == sorted(means, key=lambda name: -means[name])
    for row in rows:
        told = judged[row.submission.name]
        assert row.return_mean == means[row.submission.name]
        assert (row.drawn_return_mean, row.drawn_falls) == (told["drawn_return_mean"], told["drawn_falls"])
        assert f"| {' | '.join(row.cells)} |" in leaderboard(tmp_path)
    assert main(["judge", str(folders[0])]) == 2  # judged before
    other = {**judged["ours"], "policy_digest": "0" * 64}
    (folders[0] / benchmark.JUDGED).write_bytes(object_with_digest(other))
    with pytest.raises(SpringfootError, match="judges another policy than"):
        judged_rows(tmp_path)


def test_the_task_decides_every_setting_but_the_action_mode(tmp_path):
    policy = read_policy("pretrained")
    bribed = replace(policy.settings, action_mode="residual", reward_weights={"alive": 100.0}, friction=1.0)
    save_policy(tmp_path / "bribed.safetensors", replace(policy, settings=bribed))
    _, plain = policy_on_task("pretrained", TASK)
    _, settings = policy_on_task(str(tmp_path / "bribed.safetensors"), TASK)
    assert settings == replace(plain, action_mode="residual")


@pytest.mark.parametrize(
    ("setting", "value"),
    [
        ("guide", "plan"),
        ("decisions", "event"),
        ("decisions", "100hz"),
        ("ankle_stiffness_range", (30.0, 500.0)),
        ("stiffness_joints", "toe"),
    ],
)
def test_a_policy_whose_action_means_something_else_is_refused(setting, value, tmp_path):
    policy = read_policy("pretrained")
    settings = replace(policy.settings, **{setting: value})
    path = tmp_path / "other.safetensors"
    save_policy(path, replace(policy, settings=settings, fingerprint=fingerprint(Biped(settings, 1))))
    with pytest.raises(SpringfootError, match=f"was trained with {setting} .*, {TASK} takes"):
        policy_on_task(str(path), TASK)


@pytest.mark.slow
@pytest.mark.parametrize("task", ["Slopes-v0", "Prosthesis-v0"])
def test_a_committed_submission_repeats(task):
    submission = benchmark.read_submission(REPOSITORY / "benchmarks" / "submissions" / task / "constant")
    repeated = walk_publicly(submission.policy, task, threads=1)
    assert repeated.returns.mean() == pytest.approx(submission.walks.returns.mean(), rel=benchmark.SAME)
    assert np.array_equal(repeated.fell, submission.walks.fell)


@pytest.mark.parametrize("forged", ["one return", "order", "falls"])
def test_numbers_that_do_not_repeat_fail(submitted, tmp_path, capsys, forged):
    folder = copied(submitted[1], tmp_path / "better")
    values = read_object(folder / benchmark.SUBMISSION, "submission")
    match forged:
        case "one return":
            values["returns"][7] *= 1 + 1e-5
        case "order":
            values["returns"].reverse()  # the same mean
        case "falls":
            values["fell"][3] = 1
    (folder / benchmark.SUBMISSION).write_bytes(object_with_digest(values))
    assert judge_main([str(folder)]) == 1
    assert "DOES NOT REPEAT" in capsys.readouterr().out
    assert not (folder / benchmark.JUDGED).exists()


def test_a_changed_policy_is_refused(submitted, tmp_path):
    folder = copied(submitted[0], tmp_path / "changed")
    path = folder / benchmark.POLICY
    content = bytearray(path.read_bytes())
    content[-1] ^= 1
    path.write_bytes(bytes(content))
    digest = sha256(content).hexdigest()
    with pytest.raises(SpringfootError, match=f"is not the policy that was submitted: its SHA-256 is {digest[:12]}"):
        benchmark.read_submission(folder)


def test_a_changed_number_is_refused(submitted, tmp_path):
    folder = copied(submitted[0], tmp_path / "edited")
    path = folder / benchmark.SUBMISSION
    path.write_text(path.read_text().replace('"falls": 0', '"falls": 1'))
    with pytest.raises(SpringfootError, match="is damaged or was changed"):
        benchmark.read_submission(folder)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"task": "Fly-v0"}, "task must be one of"),
        ({"returns": [1.0]}, "it needs 100 returns and falls"),
        ({"returns": [1e308] * 100}, "a return must be within"),
        ({"name": "<script>"}, "name must be 1 to 60 letters"),
        ({"returns": "many"}, "has no numbers where it should"),
        ({"policy": "../../somewhere.safetensors"}, "allowed are policy.safetensors and baselines"),
        ({"policy": "os:system"}, "allowed are policy.safetensors and baselines"),
        ({"policy": "constant:1,2"}, "is not the policy that was submitted"),
        ({"name": "a|b"}, "name must be 1 to 60 letters"),
    ],
)
def test_a_bad_submission_is_one_line(submitted, tmp_path, change, message):
    folder = copied(submitted[1], tmp_path / "bad")
    path = folder / benchmark.SUBMISSION
    path.write_bytes(object_with_digest({**json.loads(path.read_bytes()), **change}))
    with pytest.raises(SpringfootError, match=message) as caught:
        benchmark.read_submission(folder)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["learned", "--task", TASK], "learned was trained with acts 'both', Walk-v0 takes 'stiffness'"),
        (
            ["pretrained", "--task", "WalkBoth-v0"],
            "pretrained was trained with acts 'stiffness', WalkBoth-v0 takes 'both'",
        ),
        (["thesis", "--task", TASK], "thesis needs action_mode, equilibrium, schedule of its own"),
        (["nobody", "--task", TASK], "no policy nobody"),
        (["schedule", "--task", "Walk"], "task must be one of 'Walk-v0'"),
        (["schedule", "--task", TASK, "--out", "."], ". exists already: out must be a new folder"),
    ],
)
def test_a_policy_that_a_task_does_not_take_is_refused(words, message, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["submit", *words]) == 2
    assert message in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_the_drawn_episodes_follow_from_the_digest():
    one, again, other = (
        walk_drawn_from(digest * 8, "schedule", TASK, 1) for digest in ("0123abcd", "0123abcd", "f123abcd")
    )
    assert np.array_equal(one.returns, again.returns)
    assert not np.array_equal(one.returns, other.returns)
    same_body = walk_publicly("schedule", TASK, 1)
    assert one.returns.std() > 1.5 * same_body.returns.std()  # bodies differ, too
