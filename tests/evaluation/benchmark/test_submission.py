"""Submissions: a folder judged to the same bits, and refused when anything in it was changed."""

import json
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

from springfoot.agents import read_policy, save_policy
from springfoot.agents.policies.fingerprint import fingerprint
from springfoot.agents.training.config import PRESETS, task_training
from springfoot.cli.judge import judge_main
from springfoot.cli.main import main
from springfoot.envs import Biped
from springfoot.envs.batch.learned_person import person_file
from springfoot.errors import SpringfootError
from springfoot.evaluation.benchmark import submission as benchmark
from springfoot.evaluation.benchmark.judged import judged_rows
from springfoot.evaluation.benchmark.leaderboard import leaderboard
from springfoot.evaluation.benchmark.task_walks import (
    TaskWalks,
    drawn_seed,
    policy_on_task,
    settings_of_task,
    walk_publicly,
    with_drawn_bodies,
)
from springfoot.files.json_file import object_with_digest, read_object
from springfoot.tasks import STIFFNESS_TASKS, VERSION

REPOSITORY = Path(__file__).parents[3]
TASK = "Walk-v0"
FEW = 25
"""Episodes of tests that walk submissions: every episode is one by itself, in a batch of any size."""


def walk_few(monkeypatch, episodes=FEW):
    """Let submissions have `episodes` from now on, the first of the 100."""
    for module in ("judged", "leaderboard", "submission", "task_walks"):
        monkeypatch.setattr(f"springfoot.evaluation.benchmark.{module}.EPISODES", episodes)


@pytest.fixture(scope="module")
def submitted(tmp_path_factory):
    """A submission of a policy's file, whose actions make it fall soon, and committed ones of springs and a learner."""
    folder = tmp_path_factory.mktemp("submissions")
    policy = read_policy("predicted")
    soft = replace(policy, biases=(*policy.biases[:-1], np.full_like(policy.biases[-1], -100.0)))
    save_policy(folder / "soft.safetensors", soft)
    return [
        benchmark.submit(str(folder / "soft.safetensors"), "FromThePlanBoth-v0", "ours", folder / "ours", threads=1),
        *(
            benchmark.read_submission(REPOSITORY / "benchmarks" / "submissions" / TASK / name)
            for name in ("constant", "ppo-500000-seed-0")
        ),
    ]


def copied(submission, folder):
    """A copy of a submission's files in a new folder."""
    folder.mkdir()
    for path in submission.folder.iterdir():
        if path.name != benchmark.JUDGED:
            (folder / path.name).write_bytes(path.read_bytes())
    return folder


@pytest.mark.slow
def test_a_submission_is_judged_to_the_same_bits_on_any_number_of_threads(submitted, tmp_path, monkeypatch):
    """Of one that walks to the end, and one that soon falls."""
    walk_few(monkeypatch)
    # Of two tasks, so no table has both; `test_a_table_is_in_the_order_of_returns` has several rows.
    both = [
        benchmark.submit(policy, task, name, tmp_path / name, threads=1)
        for policy, task, name in ((submitted[0].policy, submitted[0].task, "ours"), ("pretrained", TASK, "walks"))
    ]
    kept = tmp_path / "judged"
    kept.mkdir()
    folders = [copied(each, kept / each.name) for each in both]
    assert main(["judge", *map(str, folders), "--threads", "2"]) == 0
    judged = {folder.name: read_object(folder / benchmark.JUDGED, "judgement") for folder in folders}
    assert [each["same_bits"] for each in judged.values()] == [True, True]
    rows = judged_rows(kept)
    means = {each.name: each.walks.returns.mean() for each in both}
    assert [each.walks.fell.mean() for each in both] == pytest.approx([1.0, 0.0], abs=0.1)
    assert [row.submission.name for row in rows] == sorted(means, key=lambda name: -means[name])
    for row in rows:
        told = judged[row.submission.name]
        assert row.return_mean == means[row.submission.name]
        assert (row.drawn_return_mean, row.drawn_falls) == (told["drawn_return_mean"], told["drawn_falls"])
        cells = [row.submission.name, f"{row.return_mean:.0f}", f"{row.falls} of {FEW}"]
        cells += [f"{row.drawn_return_mean:.0f}", f"{row.drawn_falls} of {FEW}"]
        assert f"| {' | '.join(cells)} |" in leaderboard(kept)
    assert main(["judge", str(folders[0])]) == 2  # judged before
    other = {**judged["ours"], "policy_digest": "0" * 64}
    (folders[0] / benchmark.JUDGED).write_bytes(object_with_digest(other))
    with pytest.raises(SpringfootError, match="judges another policy or task than"):
        judged_rows(kept)


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
        ("toe_stiffness_range", (5.0, 100.0)),
        ("person_range_deg", 20.0),
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
@pytest.mark.parametrize("task", [f"{name}-{VERSION}" for name in STIFFNESS_TASKS])
def test_committed_springs_repeat(monkeypatch, task):
    submission = benchmark.read_submission(REPOSITORY / "benchmarks" / "submissions" / task / "constant")
    falls = submission.walks.fell.any()
    walk_few(monkeypatch, episodes := max(5, 1 + int(submission.walks.fell.argmax())))  # the first fall, too
    repeated = walk_publicly(submission.policy, submission.task, threads=1)
    assert repeated.returns == pytest.approx(submission.walks.returns[:episodes], rel=benchmark.SAME)
    assert np.array_equal(repeated.fell, submission.walks.fell[:episodes]) and repeated.fell.any() == falls


def test_every_committed_judgement_is_of_its_submission_and_of_a_commit():
    rows = judged_rows(REPOSITORY / "benchmarks" / "submissions")
    assert len(rows) >= 21
    for row in rows:
        judged = read_object(row.submission.folder / benchmark.JUDGED, "judgement")
        assert row.return_mean == pytest.approx(row.submission.walks.returns.mean(), rel=benchmark.SAME)
        assert row.falls == row.submission.walks.fell.sum()
        assert judged["made_with"]["modified"] is False


def test_a_policy_with_a_file_of_its_own_is_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "me.safetensors").write_bytes(person_file("learned-2").read_bytes())
    policy = read_policy("pretrained")
    settings = replace(policy.settings, person="me.safetensors")
    save_policy(
        tmp_path / "policy.safetensors", replace(policy, settings=settings, fingerprint=fingerprint(Biped(settings, 1)))
    )
    with pytest.raises(SpringfootError, match="needs a file, its person, which a submission does not hold"):
        policy_on_task("policy.safetensors", TASK)


def test_numbers_repeat_one_by_one():
    told = TaskWalks(returns=np.linspace(-5.0, 2000.0, 100), fell=np.arange(100) == 7)
    assert benchmark.repeats(told, told, 0.0)
    moved = told.returns * (1 + 0.9e-6)
    assert benchmark.repeats(replace(told, returns=moved), told, benchmark.SAME)
    assert not benchmark.repeats(replace(told, returns=moved), told, 0.0)
    one, order, falls = told.returns.copy(), told.returns[::-1], told.fell[::-1]
    one[7] *= 1 + 1e-5
    for other in (replace(told, returns=one), replace(told, returns=order), replace(told, fell=falls)):
        assert not benchmark.repeats(other, told, benchmark.SAME)


@pytest.mark.slow
def test_a_submission_that_does_not_repeat_is_not_judged(submitted, tmp_path, capsys):
    folder = copied(submitted[0], tmp_path / "better")
    values = read_object(folder / benchmark.SUBMISSION, "submission")
    values["returns"].reverse()  # the same mean
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
    text, falls = path.read_text(), int(submitted[0].walks.fell.sum())
    assert f'"falls": {falls}' in text and falls > 0
    path.write_text(text.replace(f'"falls": {falls}', f'"falls": {falls - 1}'))
    with pytest.raises(SpringfootError, match="is damaged or was changed"):
        benchmark.read_submission(folder)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"task": "Fly-v0"}, "bad/submission.json is no submission: task must be one of"),
        ({"returns": [1.0]}, "it needs 100 returns, and falls of 0 or 1"),
        ({"returns": [1e308] * 100}, "a return must be within"),
        ({"name": "<script>"}, "name must be 1 to 60 letters"),
        ({"returns": "many"}, "has no numbers where it should"),
        ({"policy": "../../somewhere.safetensors", "name": "ours"}, "allowed are policy.safetensors and baselines"),
        ({"policy": "os:system", "name": "ours"}, "allowed are policy.safetensors and baselines"),
        ({"policy": "constant:1,2"}, "is not the policy that was submitted"),
        ({"name": "a|b"}, "name must be 1 to 60 letters"),
        ({"name": "*a*"}, "bad/submission.json is no submission: name must be 1 to 60 letters"),
        ({"name": "_a_"}, "name must be 1 to 60 letters"),
        ({"name": "best \N{CYRILLIC SMALL LETTER ES}onstant"}, "name must be 1 to 60 letters a to z"),
        ({"fell": ["a"] * 100}, "it needs 100 returns, and falls of 0 or 1"),
        ({"return_mean": 9e9}, "return_mean and falls must be those of its episodes"),
        ({"falls": 77}, "return_mean and falls must be those of its episodes"),
        ({"falls": None}, "has no numbers where it should"),
    ],
)
def test_a_bad_submission_is_one_line(submitted, tmp_path, change, message):
    folder = copied(submitted[1], tmp_path / "bad")
    path = folder / benchmark.SUBMISSION
    path.write_bytes(object_with_digest({**json.loads(path.read_bytes()), **change}))
    with pytest.raises(SpringfootError, match=message) as caught:
        benchmark.read_submission(folder)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["random", "best constant:400,40", "Schedule, seed 7"])
def test_a_baseline_s_name_is_a_baseline_s(submitted, tmp_path, name):
    folder = copied(submitted[0], tmp_path / "named")
    path = folder / benchmark.SUBMISSION
    path.write_bytes(object_with_digest({**json.loads(path.read_bytes()), "name": name}))
    with pytest.raises(SpringfootError, match="name must not begin with a baseline's, untrained, random, constant, "):
        benchmark.read_submission(folder)


@pytest.mark.parametrize("name", ["Deep RL, seed 0", "random springs", "best schedule"])
def test_a_baseline_has_its_own_name(submitted, tmp_path, name):
    with pytest.raises(SpringfootError, match=r"^name of the baseline constant must begin with constant, got '"):
        benchmark.submit("constant:300,40", TASK, name, tmp_path / "named", threads=1)
    assert not (tmp_path / "named").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["learned", "--task", TASK], "learned was trained with acts 'both', Walk-v0 takes 'stiffness'"),
        (
            ["pretrained", "--task", "WalkBoth-v0"],
            "pretrained was trained with acts 'stiffness', WalkBoth-v0 takes 'both'",
        ),
        (["thesis", "--task", TASK], "thesis needs action_mode, equilibrium, schedule of its own"),
        (
            ["nobody", "--task", TASK],
            "no policy nobody: a submission is a .safetensors file, a run folder, one of pretrained",
        ),
        (["schedule", "--task", "Walk"], "task must be one of 'Walk-v0'"),
        (["schedule", "--task", TASK, "--out", "."], ". exists already: out must be a new folder"),
    ],
)
def test_a_policy_that_a_task_does_not_take_is_refused(words, message, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["submit", *words]) == 2
    assert message in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_bodies_are_drawn_unless_the_task_draws_its_own():
    assert with_drawn_bodies(settings_of_task("AnyBody-v0")) == settings_of_task("AnyBody-v0")
    drawn = with_drawn_bodies(settings_of_task(TASK))
    assert (drawn.height_range, drawn.mass_range) == ((1.55, 1.85), (50.0, 85.0))
    assert replace(drawn, height_range=None, mass_range=None) == settings_of_task(TASK)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"falls": 101}, "its returns or falls are missing or impossible"),
        ({"drawn_falls": -1}, "its returns or falls are missing or impossible"),
        ({"drawn_return_mean": None}, "its returns or falls are missing or impossible"),
        ({"task": "FromThePlan-v0"}, "judges another policy or task than"),
    ],
)
def test_a_judgement_that_cannot_be_is_refused(submitted, tmp_path, change, message):
    folder = copied(submitted[1], tmp_path / "judged")
    (folder / benchmark.JUDGED).write_bytes(object_with_digest(a_judgement(submitted[1]) | change))
    with pytest.raises(SpringfootError, match=message):
        judged_rows(tmp_path)


def a_judgement(submission):
    """The values of a judgement that repeats a submission."""
    numbers = {"return_mean": 1.0, "falls": 0, "drawn_return_mean": 2.0, "drawn_falls": 0}
    return {"task": submission.task, "policy_digest": submission.digest, **numbers}


def entered(submission, folder, *, factor, mean=1.0, drawn=2.0):
    """Copy a submission into a new folder under the folder's name, judged, with returns times a factor."""
    values = read_object(copied(submission, folder) / benchmark.SUBMISSION, "submission")
    returns = [factor * value for value in values["returns"]]
    values |= {"name": folder.name, "returns": returns, "return_mean": float(np.mean(returns))}
    (folder / benchmark.SUBMISSION).write_bytes(object_with_digest(values))
    means = {"return_mean": mean, "drawn_return_mean": drawn}
    (folder / benchmark.JUDGED).write_bytes(object_with_digest(a_judgement(submission) | means))


def entered_baseline(submission, folder, policy, **numbers):
    """Enter the submission of springs in a new folder as a baseline under its own name."""
    entered(submission, folder, **numbers)
    own = {"policy": policy, "policy_digest": sha256(policy.encode()).hexdigest()}
    submitted, judged = folder / benchmark.SUBMISSION, folder / benchmark.JUDGED
    submitted.write_bytes(object_with_digest(read_object(submitted, "submission") | own | {"name": policy}))
    judged.write_bytes(object_with_digest(read_object(judged, "judgement") | own))


def test_a_table_has_eight_rows_and_says_how_many_more_there_are(submitted, tmp_path):
    for place, name in enumerate("abcdefghij"):
        entered(submitted[2], tmp_path / name, factor=1.0 + 0.001 * place)
    board = leaderboard(tmp_path)
    assert "\n| h |" in board
    assert "\n| i |" not in board
    assert board.endswith("2 more are not shown.")


def test_the_ends_of_the_score_are_always_in_the_table(submitted, tmp_path):
    for place, name in enumerate("abcdefghij"):
        entered(submitted[2], tmp_path / name, factor=1.0 + 0.001 * place)
    for place, policy in enumerate(("constant:300,40", "random", "constant:200,40")):
        entered_baseline(submitted[1], tmp_path / policy, policy, factor=0.5 + 0.1 * place, mean=-1.0 - place)
    board = leaderboard(tmp_path)
    rows = [line.split(" | ")[0] for line in board.splitlines() if line.startswith("| ")][2:]
    assert rows == ["| a", "| b", "| c", "| d", "| e", "| f", "| constant:300,40", "| random"]
    assert board.endswith("5 more are not shown.")


@pytest.mark.parametrize(
    ("seeds", "springs_drawn", "score", "drawn", "better"),
    [
        (5, 4.0, "2.50 (1.67 to 3.33)", "3.00 (2.17 to 3.83)", f"{TASK}."),
        (5, 12.0, "2.50 (1.67 to 3.33)", "1.00 (0.72 to 1.28)", f"no task. Not better: {TASK}."),
        (2, 4.0, "1.75 (1.50 to 2.00), 2 seeds", "2.25 (2.00 to 2.50), 2 seeds", f"no task. Not better: {TASK}."),
    ],
)
def test_trainings_of_one_learner_are_one_entry(submitted, tmp_path, seeds, springs_drawn, score, drawn, better):
    for policy, mean, drawn_mean in (("random", 1.0, 0.0), ("constant:300,40", 3.0, springs_drawn)):
        entered_baseline(submitted[1], tmp_path / policy, policy, factor=mean, mean=mean, drawn=drawn_mean)
    for seed in range(seeds):
        folder = tmp_path / f"ours, seed {seed}"
        entered(submitted[2], folder, factor=4.0 + seed, mean=4.0 + seed, drawn=8.0 + 2.0 * seed)
        folder.rename(tmp_path / f"sac-800-seed-{seed}")
    board = leaderboard(tmp_path)
    assert f"| {TASK} | {score} |" in board  # 4, 5, ... where random returns 1 and springs 3
    assert f"| {TASK} | {drawn} |" in board
    assert f"with all of both intervals, on: {better}\n" in board
    tasks = [f"{name}-{VERSION}" for name in STIFFNESS_TASKS]
    left = " ".join(task for task in tasks if task != TASK or seeds < 5)
    assert f'- ours: `make benchmark BENCHMARK="--learners sac --timesteps 800 --tasks {left}"`' in board
    assert f"| ours ({seeds} seeds) |" in board and "seed 0" not in board


def test_a_table_is_in_the_order_of_returns(submitted, tmp_path):
    for name, mean in (("low", 1.0), ("high", 3.0), ("between", 2.0)):
        entered(submitted[2], tmp_path / name, factor=mean, mean=mean)
    for seed, mean in enumerate((-30.0, 2.5, 2.5, 2.5, 2.6)):  # the outer quarters do not count, as in the cell
        entered(submitted[2], tmp_path / f"seeds, seed {seed}", factor=4.0 + seed, mean=mean)
    rows = [line for line in leaderboard(tmp_path).splitlines() if line.startswith("| ")][2:]
    assert [row.split(" | ")[0] for row in rows] == ["| high", "| seeds (5 seeds)", "| between", "| low"]


def test_an_entry_that_returns_nearly_as_another_does_is_refused(submitted, tmp_path):
    for name, factor in (("copy", 1.0 + 1e-5), ("first", 1.0)):
        entered(submitted[2], tmp_path / name, factor=factor)
    with pytest.raises(SpringfootError) as caught:
        leaderboard(tmp_path)
    told = f"{tmp_path / 'first'} returns nearly the same as {tmp_path / 'copy'}: keep one of them"
    assert str(caught.value) == told


def test_judge_refuses_before_it_walks(submitted, tmp_path, capsys):
    good, bad = copied(submitted[1], tmp_path / "good"), copied(submitted[0], tmp_path / "bad")
    (bad / benchmark.POLICY).write_bytes(b"no policy")
    digest = sha256(b"no policy").hexdigest()
    values = read_object(bad / benchmark.SUBMISSION, "submission") | {"policy_digest": digest}
    (bad / benchmark.SUBMISSION).write_bytes(object_with_digest(values))
    (tmp_path / "loop").symlink_to("loop")
    for words, message in (
        ([good, bad], "policy.safetensors"),
        ([good, tmp_path / "." / "good"], "name each folder once"),
        ([tmp_path / "loop"], "loop"),
    ):
        assert judge_main([str(word) for word in words]) == 2
        error = capsys.readouterr().err
        assert message in error
        assert error.count("\n") == 1
    assert not (good / benchmark.JUDGED).exists()


def test_the_seed_of_the_drawn_episodes_follows_from_the_digest():
    assert drawn_seed("0123abcd" * 8) == 0x0123ABCD
    assert drawn_seed("0123abce" + "0123abcd" * 7) == 0x0123ABCE


def test_a_task_s_training_is_on_its_settings_and_with_a_person_s_network_where_the_person_acts():
    stiffness, both = task_training(TASK), task_training("WalkBoth-v0")
    assert stiffness == replace(PRESETS["walk"], environment=settings_of_task(TASK))
    person = PRESETS["person"]
    assert both.environment == replace(settings_of_task("WalkBoth-v0"), action_mode=person.environment.action_mode)
    assert (both.mirrored, both.hidden, both.log_std) == (True, person.hidden, person.log_std)
