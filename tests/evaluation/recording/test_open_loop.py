"""What of a policy follows the phase alone: its open-loop copy, the share that is feedback, and the copy's name."""

import dataclasses
from functools import cache
from typing import Any

import numpy as np
import pytest

from springfoot.agents.policies.baselines import BASELINES, and_copy, baseline
from springfoot.cli.evaluate import evaluate_main
from springfoot.cli.main import study_main
from springfoot.envs.control.constants import leg_constants
from springfoot.envs.control.equilibrium import fixed_stiffness
from springfoot.envs.control.phase_table import GRID
from springfoot.envs.settings.settings import body_of, settings_from
from springfoot.evaluation.numbers.metrics import measure
from springfoot.evaluation.recording.open_loop import (
    COPY_EPISODES,
    COPY_SECONDS,
    MEAN_KNOTS,
    decisions_of,
    feedback,
    mean_over_phase,
    open_loop_copy,
)
from springfoot.evaluation.recording.policies import policy_and_settings, policy_label
from springfoot.evaluation.recording.recording import record
from springfoot.gait import SpringfootError
from springfoot.studies.springs.agreement import criteria_table
from springfoot.studies.walks.bodies import pairs_table
from springfoot.studies.walks.comparison import Row, elsewhere_table

PUSHED = {"push_newton": 150.0, "push_interval": 2.0, "episode_seconds": 5.0}


@cache
def copied(**given):
    """The open-loop copy of pretrained, and its settings."""
    return policy_and_settings("frozen:pretrained", given, threads=1)


@cache
def walked(name, **given):
    policy, settings = policy_and_settings(name, {"episode_seconds": 6.0} | given)
    return record(policy, settings, name=name, episodes=4, threads=1)


@cache
def walked_copy(**given):
    """A walk of the copy that was made without what is `given`: it is the same one, as all are made undisturbed."""
    policy, settings = copied()
    return record(policy, dataclasses.replace(settings, **given), name="frozen:pretrained", episodes=4, threads=1)


def of_feedback(recording, joint, key) -> float:
    value = feedback(recording)[joint][key]
    assert value is not None
    return value


def course(recording, name):
    """Phase of every sample after 3 s in ascending order, and the series there, of both legs."""
    phase, values = (recording.series[each][:, 300:] for each in ("phase", name))
    order = np.argsort(phase.ravel())
    return phase.ravel()[order], values.reshape(-1, 2)[order]


def most_in_a_knot(settings):
    """The largest change of log K of the fixed schedule from one knot of a copy to the next."""
    stiffness = fixed_stiffness(leg_constants("planned", "people"), body_of(settings))
    return np.abs(np.log(np.roll(stiffness, -len(GRID) // MEAN_KNOTS, axis=0) / stiffness)).max()


def test_the_open_loop_copy_of_a_schedule_is_that_schedule_with_its_equilibrium():
    policy, settings = policy_and_settings("schedule", {"episode_seconds": 5.0})
    copy, same = open_loop_copy(policy, settings, name="schedule", threads=1)
    assert same == settings
    played, own = (record(each, settings, name="", episodes=3, threads=1) for each in (copy, policy))
    begun = np.isfinite(own.series["phase"]) & np.isfinite(played.series["phase"])
    off = np.abs(np.log(played.series["stiffness"][begun] / own.series["stiffness"][begun]))
    assert off.max() < 0.5 * most_in_a_knot(settings) and np.median(off, axis=0).max() < 1e-3  # most where a ramp ends
    assert played.series["equilibrium"][begun] == pytest.approx(own.series["equilibrium"][begun], abs=1e-3)
    assert played.returns == pytest.approx(own.returns, rel=1e-3)


@pytest.mark.slow
def test_a_copy_follows_speed_and_body_as_the_schedule_does():
    ranges: dict[str, Any] = {"speed_range": (1.1, 1.25), "height_range": (1.6, 1.75), "mass_range": (50.0, 80.0)}
    policy, settings = policy_and_settings("schedule", ranges)
    copy, same = open_loop_copy(policy, settings, name="schedule", threads=1)
    assert same == settings
    alone = settings_from(height=1.62, mass=55.0, speed=1.15, episode_seconds=1.0)
    observations = np.concatenate([_observed(alone), _observed(dataclasses.replace(alone, speed=1.2))])
    difference = np.abs(copy(observations) - policy(observations))
    low, high = settings.ankle_stiffness_range
    assert difference.max() < most_in_a_knot(settings) / np.log(high / low)  # half of it, as an action
    assert np.median(difference) < 1e-3


def _observed(settings):
    seen = []

    def policy(observation):
        seen.append(observation.copy())
        return baseline("schedule", settings)(observation)

    record(policy, settings, name="", episodes=1)
    return np.concatenate(seen)


@pytest.mark.slow
def test_a_copy_of_a_policy_has_its_mean_stiffness_and_equilibrium_and_follows_the_phase_alone():
    own, settings = policy_and_settings("pretrained", {})
    copy, absolute = copied()
    assert absolute == dataclasses.replace(settings, action_mode="absolute")
    policy, pushed = walked("pretrained"), walked("frozen:pretrained", **PUSHED | {"episode_seconds": 12.0})
    assert pushed.series["stiffness"].shape[-1] == 2 and own is not copy
    for joint in ("ankle", "toe"):
        assert of_feedback(pushed, joint, "spread") < 0.02 < of_feedback(policy, joint, "spread")
    alike = [dataclasses.replace(each, episode_seconds=COPY_SECONDS) for each in (settings, absolute)]
    walks = [
        record(act, of, name="", episodes=COPY_EPISODES, threads=1) for act, of in zip((own, copy), alike, strict=True)
    ]
    for leg in (0, 1):  # whose toes the policy treats differently
        decisions = [decisions_of(each, [leg]) for each in walks]
        mean, played = (np.clip(mean_over_phase(*each), each[1].min(0), each[1].max(0)) for each in decisions)
        assert played[1:31] == pytest.approx(mean[1:31], rel=0.1)  # in stance
    at = np.linspace(0.05, 0.95, 40)
    rest = [
        np.stack([np.interp(at, x, y) for y in angles.T])
        for x, angles in (course(each, "equilibrium") for each in (policy, pushed))
    ]
    assert rest[1] == pytest.approx(rest[0], abs=0.01)


@pytest.mark.slow
def test_a_copy_decides_when_it_is_told_and_keeps_the_stiffness_of_the_policys_own_decisions():
    (one, at_50), (other, at_100) = copied(decisions="50hz"), copied(decisions="100hz")
    assert (at_50.decisions, at_100.decisions) == ("50hz", "100hz")
    observation = _observed(settings_from(episode_seconds=1.0))
    assert np.array_equal(one(observation), other(observation))


def test_a_mean_over_phase_finds_a_curve_that_bends_at_its_knots_and_bridges_what_was_never_seen():
    random = np.random.default_rng(0)
    knots = random.uniform(50, 400, (MEAN_KNOTS, 2))
    phase = random.uniform(0, 1, 20_000)
    at = np.arange(MEAN_KNOTS) / MEAN_KNOTS
    values = np.stack([np.interp(phase, at, curve, period=1.0) for curve in knots.T], -1)
    assert mean_over_phase(phase, values) == pytest.approx(knots, rel=1e-2)
    noisy = values * np.exp(random.normal(0, 0.1, values.shape))
    assert mean_over_phase(phase, noisy) == pytest.approx(knots * np.exp(0.005), rel=0.05)
    level = np.full((len(phase), 1), 7.0)
    unseen = (phase > 0.1) & (phase < 0.95)
    assert mean_over_phase(phase[unseen], level[unseen]) == pytest.approx(np.full((MEAN_KNOTS, 1), 7.0))


@pytest.mark.parametrize("name", ["schedule", "constant", "thesis"])
def test_what_follows_the_phase_alone_has_no_feedback_pushed_or_not(name):
    for given in ({}, PUSHED):
        for joint in ("ankle", "toe"):
            assert of_feedback(walked(name, **given), joint, "share") < (
                0.03 if name == "thesis" else 0.001
            )  # steps count once each, in 4 short walks


def test_feedback_is_the_variance_that_was_put_in():
    policy, settings = policy_and_settings("constant", {"episode_seconds": 10.0})
    random = np.random.default_rng(1)

    def scattered(observation):  # actions are on a log scale
        return policy(observation) + random.normal(0, [0.05, 0.02] * 2, (len(observation), 4)).astype(np.float32)

    found = feedback(record(scattered, settings, name="", episodes=4, threads=1))
    half = [0.5 * np.log(high / low) for low, high in (settings.ankle_stiffness_range, settings.toe_stiffness_range)]
    assert [found[joint]["spread"] for joint in ("ankle", "toe")] == pytest.approx(
        [0.05 * half[0], 0.02 * half[1]], rel=0.1
    )
    assert found["ankle"]["share"] == pytest.approx(1.0, abs=0.1)


def test_a_walk_without_strides_has_no_number():
    metrics = measure(walked("schedule", episode_seconds=1.0)).metrics
    assert metrics["feedback"]["ankle"] == {"share": None, "spread": None}


def test_who_has_a_copy_and_what_it_is_called():
    assert and_copy("runs/walk") == ("runs/walk", "frozen:runs/walk")
    assert all(and_copy(name) == (name,) for name in (*BASELINES, "schedule:1.2", "frozen:pretrained"))
    assert policy_label("frozen:pretrained") == "frozen-pretrained"
    assert policy_label("frozen:runs/walk/best.safetensors") == "frozen-walk-best"
    assert policy_label("frozen:runs/five/seed-0") == "frozen-seed-0"


ERRORS = [
    ("frozen", "frozen is the copy of a policy, as in frozen:pretrained, got 'frozen'"),
    ("frozen:", "frozen is the copy of a policy, as in frozen:pretrained, got 'frozen:'"),
    (
        "frozen:frozen:pretrained",
        "a copy has no copy of its own: give frozen:pretrained, got 'frozen:frozen:pretrained'",
    ),
    (
        "frozen:schedule:1.2",
        "schedule:1.2 has no feedback to leave out, it is its own copy: give schedule:1.2, got 'frozen:schedule:1.2'",
    ),
    (
        "frozen:nobody",
        "no policy 'nobody': give a .safetensors or .onnx file, a run folder, a schedule in a .csv or .json file, "
        "module:function, frozen:POLICY, or one of pretrained, expert, medium, learned, learned-2, learned-3, "
        "learned-4, learned-5, predicted, "
        f"{', '.join(BASELINES)}",
    ),
]


@pytest.mark.parametrize(("name", "said"), ERRORS)
def test_a_copy_that_cannot_be_is_one_line_exit_code_2_and_nothing_written(name, said, tmp_path, monkeypatch, capsys):
    with pytest.raises(SpringfootError) as error:
        policy_and_settings(name, {})
    assert str(error.value) == said
    monkeypatch.chdir(tmp_path)
    assert evaluate_main([name]) == study_main(["compare", name]) == study_main(["bodies", name]) == 2
    assert capsys.readouterr().err.splitlines() == [
        f"{program}: error: {said}"
        for program in ("evaluate.py", "springfoot study compare", "springfoot study bodies")
    ]
    assert not list(tmp_path.iterdir())


def test_a_policy_that_walks_no_strides_has_no_copy():
    policy, settings = policy_and_settings("thesis_printed", {})
    with pytest.raises(
        SpringfootError, match=r"^nobody walks no strides after 3 s whose mean stiffness could be taken$"
    ):
        open_loop_copy(policy, settings, name="nobody", threads=1)


@pytest.mark.slow
def test_evaluate_names_the_command_of_the_copy_and_walks_it(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    told = []
    for name in ("pretrained", "frozen:pretrained"):  # of the schedule: test_report.py
        assert evaluate_main([name, "--episodes", "1", "--seconds", "1"]) == 0
        told.append("open loop: evaluate.py frozen:pretrained, with the same flags" in capsys.readouterr().out)
    assert told == [True, False]
    assert (tmp_path / "runs" / "eval-frozen-pretrained-1" / "metrics.json").is_file()


def row_of(name: str) -> Row:
    recording = walked_copy(episode_seconds=6.0) if name == "frozen:pretrained" else walked(name)
    fell = recording.fall_reason != ""
    return Row(name=name, metrics=measure(recording).metrics, returns=recording.returns, fell=fell)


def test_tables_have_the_copy_beside_and_none_where_there_is_none():
    own, copy = (row_of(name) for name in ("pretrained", "frozen:pretrained"))
    head, _, line = elsewhere_table("pretrained", [("", (own, copy))]).splitlines()
    assert head.count("|") == line.count("|") and "| open loop: falls | open loop: speed m/s |" in head
    assert f"| 0 of 4 | {copy.metrics['speed_m_s']['mean']:.3f} |" in line
    assert "open loop" not in elsewhere_table("pretrained", [("", (own,))])
    *_, falls, angles = criteria_table(["a", "b"], [own.metrics, copy.metrics], [copy.metrics, None]).splitlines()
    assert falls == "| open loop: falls |  |  | 0 of 4 | – |" and angles.endswith(" | – |")
    assert "open loop" not in criteria_table(["a"], [own.metrics], [None])


def test_bodies_have_the_copys_falls_speed_and_angles_beside():
    def row(error, fall=""):
        angles = {f"{joint}_rmse_deg": 2.0 for joint in ("thigh", "knee", "ankle")}
        body = {"height_m": 1.7, "mass_kg": 63.0, "speed_m_s": 1.2, "seconds": 3.0, "grf_vertical_r": 0.99}
        return body | angles | {"fall": fall, "speed_error_percent": error}

    own, copy = [row(1.0), row(-2.0)], [row(3.0), row(9.0, "fell: hip too low")]
    head, rule, falls, speed, *_, forces = pairs_table(own, copy).splitlines()
    assert {line.count("|") for line in (head, rule, falls, speed, forces)} == {9}
    assert falls == "| falls | 0 of 2 |  |  |  | 1 of 2 |  |  |"
    assert speed.endswith("1.70 m, 63 kg, 1.20 m/s | 3.0 | 3.0 | 3.0 |")
    assert "open loop" not in pairs_table(own)
