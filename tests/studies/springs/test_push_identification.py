"""The laboratory's experiment: known springs are found from pushes, and a policy that reacts is called so."""

from collections import deque
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from springfoot.cli.main import study_main
from springfoot.envs.control.constants import leg_constants
from springfoot.envs.control.stiffness_control import FEET
from springfoot.envs.physics.model import LEFT, RIGHT, damping_times
from springfoot.envs.settings.settings import body_of
from springfoot.envs.task import PERSON_OBSERVATION
from springfoot.evaluation.recording.open_loop import alike_legs
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import record
from springfoot.gait import SpringfootError
from springfoot.gait.springs.identification_by_pushes import REACTS, SPRING
from springfoot.studies.springs.push_experiment import Row, identified, prepare_pushed, samples

PUSHES = {"push_newton": 100.0, "push_interval": 2.0, "episode_seconds": 5.0}


@cache
def pushed(name, episodes=32, **given):
    policy, settings = prepare_pushed(name, PUSHES | given, threads=1)
    return record(policy, settings, name=name, episodes=episodes, threads=1)


def errors_of_springs(rows: list[Row]) -> dict[tuple[str, float], float]:
    """Joint and beginning of each loaded phase that is called a spring -> error of its K, as a share."""
    return {
        (row.joint, row.start): row.pushed.stiffness.value / row.applied[0] - 1.0
        for row in loaded(rows)
        if row.pushed.verdict == SPRING and row.pushed.stiffness
    }


def loaded(rows: list[Row]) -> list[Row]:
    return [row for row in rows if row.loaded]


def test_torque_is_recorded_at_the_same_instant_as_angle_and_velocity():
    recording = pushed("schedule")
    series, begun = recording.series, np.isfinite(recording.series["phase"])
    beta = damping_times(body_of(recording.settings))[FEET]
    torque, angle, velocity = (series[name][..., FEET] for name in ("torque", "angle", "velocity"))
    spring = series["stiffness"] * (series["equilibrium"] - angle - beta * velocity)
    assert torque[begun] == pytest.approx(spring[begun], abs=1e-3)


@pytest.mark.slow
def test_springs_are_found_in_every_loaded_phase_ramps_included():
    rows = loaded(identified(samples(pushed("schedule"))))
    assert {row.joint for row in rows} == {"ankle", "toe"} and len(rows) >= 8
    for leg in (LEFT, RIGHT):  # whose ramps are steeper, and toes unlike
        rows += loaded(identified(samples(pushed("frozen:pretrained", episodes=64), legs=[leg])))
    for row in rows:
        assert row.pushed.stiffness and row.pushed.damping_time
        assert row.pushed.stiffness.value == pytest.approx(row.applied[0], rel=0.01)
        assert row.pushed.damping_time.value == pytest.approx(0.02, rel=0.05)
        assert row.pushed.verdict == SPRING
    assert any(row.applied[2] > 3 * row.applied[1] for row in rows)


def test_legs_that_are_not_alike_are_no_spring_together():
    together = loaded(identified(samples(pushed("frozen:pretrained", episodes=64))))
    assert {row.pushed.verdict for row in together if row.joint == "toe"} == {REACTS}
    assert alike_legs(pushed("schedule")) == [[LEFT, RIGHT]]
    assert alike_legs(pushed("frozen:pretrained", episodes=64)) == [[LEFT], [RIGHT]]


def test_noise_on_the_torque_leaves_the_truth_within_intervals_and_the_undisturbed_estimator_is_blind():
    policy, settings = prepare_pushed("schedule", PUSHES | {"push_newton": 0.0})
    quiet = samples(record(policy, settings, name="schedule", episodes=4, threads=1))
    rows = loaded(identified(samples(pushed("schedule"), 1.0, seed=1), quiet))
    held = [
        row.pushed.stiffness.low <= row.applied[0] <= row.pushed.stiffness.high for row in rows if row.pushed.stiffness
    ]
    assert len(held) == len(rows) and sum(held) >= len(rows) - 2
    stance = next(row for row in rows if (row.joint, row.start) == ("ankle", 0.30))
    assert stance.undisturbed and stance.undisturbed.stiffness
    blind = stance.undisturbed.stiffness
    assert stance.applied[0] - blind.value > 5 * (blind.high - blind.value)  # and its interval knows nothing of it


def test_a_stiffness_scattered_between_trials_is_found_by_each_trials_own_course():
    policy, settings = prepare_pushed("schedule", PUSHES | {"episode_seconds": 8.0})
    factors = 1.0 + 0.03 * np.random.default_rng(0).standard_normal((32, 2))  # of ankle and toe in each episode
    ranges = np.array([settings.ankle_stiffness_range, settings.toe_stiffness_range])
    shift = 2.0 * np.log(factors) / np.log(ranges[:, 1] / ranges[:, 0])  # actions are on a log scale

    def scattered(observation):
        return np.clip(policy(observation) + np.tile(shift, (1, 2)), -1.0, 1.0)

    for row in loaded(identified(samples(record(scattered, settings, name="scattered", episodes=32, threads=1)))):
        assert row.pushed.stiffness
        assert row.pushed.stiffness.value == pytest.approx(row.applied[0], rel=0.05)
        assert row.pushed.verdict == SPRING


def test_the_pretrained_policy_reacts_in_every_loaded_phase():
    rows = loaded(identified(samples(pushed("pretrained"), 1.0)))
    assert len(rows) >= 8 and {row.pushed.verdict for row in rows} == {REACTS}


def test_a_stiffness_held_for_20_ms_is_no_function_of_the_phase_where_it_ramps():
    ankle = {
        row.start: row for row in identified(samples(pushed("schedule", decisions="50hz"))) if row.joint == "ankle"
    }
    assert ankle[0.22].pushed.verdict == REACTS


@pytest.mark.parametrize("delay", [0.02, 0.04])
def test_a_stiffness_that_acts_late_is_found_or_no_spring(delay):
    late = identified(samples(pushed("schedule", stiffness_delay_s=delay), 1.0))
    errors = errors_of_springs(late)
    assert max(map(abs, errors.values())) < 0.05 and len(errors) < len(loaded(late))


def test_a_stiffness_decided_7_percent_of_the_stride_before_it_acts_is_found_or_no_spring():
    policy, settings = prepare_pushed("schedule", PUSHES)
    decided = deque(maxlen=5)  # actions of this step and of the four before, 80 ms

    def late(observation):
        decided.append(policy(observation))
        return decided[0]

    rows = identified(samples(record(late, settings, name="late", episodes=64, threads=1), 1.0))
    errors = errors_of_springs(rows)
    assert max(map(abs, errors.values())) < 0.05 and len(errors) >= 6


def test_a_weak_reaction_to_the_body_is_no_spring():
    policy, settings = prepare_pushed("schedule", PUSHES)
    com_height = [entry.name for entry in PERSON_OBSERVATION].index("com_z_error")

    def reacting(observation):
        action = policy(observation).reshape(-1, 2, 2)
        low, high = settings.ankle_stiffness_range
        change = 0.05 * observation[:, com_height] / 0.02  # of ln K, 5 % at an error of 0.02
        action[..., 0] += 2.0 * change[:, None] / np.log(high / low)  # actions are on a log scale
        return action.reshape(len(observation), -1)

    rows = loaded(identified(samples(record(reacting, settings, name="reacting", episodes=64, threads=1), 1.0)))
    verdicts = {(row.joint, row.start): row.pushed.verdict for row in rows}
    assert verdicts["ankle", 0.44] == REACTS  # as a spring it would read a tenth off


def test_torque_of_another_clock_reads_wrong_as_a_spring():
    recording = pushed("schedule")
    late = recording.series | {"torque": np.roll(recording.series["torque"], 1, axis=1)}
    errors = errors_of_springs(identified(samples(replace(recording, series=late), 1.0)))
    assert 0.1 < max(map(abs, errors.values())) < 0.2  # the limit that docs/reference/metrics.md tells


def test_a_phase_without_samples_is_one_line():
    data = samples(pushed("schedule"))
    early = data.phase < 0.5
    columns = {name: getattr(data, name)[early] for name in ("trial", "phase", "torque", "angle", "velocity", "states")}
    half = replace(data, **columns, stiffness=data.stiffness[early])
    with pytest.raises(SpringfootError, match=r"^no sample lies in stride phases 0\.[5-9]\d* to .*: walk longer$"):
        identified(half)


def test_scrambled_torque_makes_no_spring():
    data = samples(pushed("schedule"))
    order = np.random.default_rng(0).permutation(len(data.torque))
    data.torque[:] = data.torque[order]
    assert all(row.pushed.verdict != SPRING for row in identified(data))


@pytest.mark.slow
def test_the_command_writes_table_and_numbers_and_the_same_seeds_the_same(capsys, tmp_path):
    numbers = []
    for threads in ("1", "2"):
        out = tmp_path / threads
        words = ["schedule", "--quick", "--threads", threads, "--out", str(out)]
        assert study_main(["identify", *words]) == 0
        numbers.append((out / "springs.csv").read_bytes())
    assert numbers[0] == numbers[1] and numbers[0].count(b"\n") == 1 + 2 * 10
    late_stance = leg_constants("planned", "people").ankle_schedule[2]
    assert f"| ankle | 30–44 | {late_stance:.1f} | " in capsys.readouterr().out
    assert "`schedule`: ankle a spring in " in (tmp_path / "1" / "report.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["nobody"], "no policy 'nobody'"),
        (["frozen"], "as in frozen:pretrained"),
        (["frozen:schedule"], "schedule has no feedback"),
        (["schedule", "--push-newton", "0"], "push_newton must be"),
        (["schedule", "--noise-percent", "-1"], "noise_percent must be"),
        (["schedule", "--repeats", "-1"], "repeats must be"),
    ],
)
def test_bad_input_gets_one_line(words, said, capsys, tmp_path):
    assert study_main(["identify", *words, "--out", str(tmp_path / "new")]) == 2
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1 and not (tmp_path / "new").exists()


def test_a_policy_that_falls_at_once_is_refused():
    policy, settings = policy_and_settings("thesis", {"episode_seconds": 2.0})
    with pytest.raises(SpringfootError, match="thesis walks no strides"):
        samples(record(policy, settings, name="thesis", episodes=2, threads=1))
