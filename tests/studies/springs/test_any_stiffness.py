"""Any stiffness with its rebuilt equilibrium gives the gait's torque, and walks."""

import json

import numpy as np
import pytest

from springfoot.cli.main import study_main
from springfoot.envs.control.stiffness_control import FEET
from springfoot.envs.physics.model import damping_times
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import record
from springfoot.gait import SpringfootError
from springfoot.studies.springs import any_stiffness as identified
from springfoot.studies.springs.any_stiffness import (
    PHASE_SEGMENTS,
    STARTS,
    mean_springs,
    rebuilt,
    stiffness_named,
)


@pytest.fixture(scope="module")
def walked():
    policy, settings = policy_and_settings("schedule", {"episode_seconds": 8.0})
    return record(policy, settings, name="schedule", episodes=4, threads=1)


def test_the_gaits_own_stiffness_has_the_equilibrium_it_walked_with(walked):
    springs = mean_springs(walked)
    rest = rebuilt(springs, springs.stiffness).at(STARTS)[1]
    phase = walked.series["phase"][:, 300:]
    for column in range(2):
        order = np.argsort(phase.ravel())
        known = np.interp(
            STARTS + 0.5 / PHASE_SEGMENTS,
            phase.ravel()[order],
            walked.series["equilibrium"][:, 300:, :, column].ravel()[order],
        )
        stance = (STARTS > 0.05) & (STARTS < 0.6)  # around heel strike phase leaps
        assert rest[stance, column] == pytest.approx(known[stance], abs=0.02)


@pytest.mark.parametrize("name", identified.STIFFNESSES)
def test_every_stiffness_gives_the_same_torque_on_the_gaits_course(walked, name):
    springs = mean_springs(walked)
    schedule = rebuilt(springs, stiffness_named(name, springs))
    stiffness, rest = schedule.at(STARTS)
    beta = np.array(damping_times(springs.body))[FEET]
    torque = stiffness * (rest - springs.angle - beta * springs.velocity)
    assert torque == pytest.approx(springs.torque, abs=1e-9)
    assert np.ptp(stiffness[:, 0]) == 0 if name.startswith("flat") else np.ptp(stiffness[:, 0]) > 50


def test_a_flat_stiffness_walks_the_same_gait_without_work_of_its_own(walked):
    rows, schedules = identified.any_stiffness(
        "schedule", {"episode_seconds": 8.0}, ["recorded", "flat:250"], episodes=4
    )
    own, again, flat = rows
    assert schedules["flat:250"].ankle[0].stiffness == 250.0
    assert flat.work["stiffness"] == 0.0 and own.work["stiffness"] != 0.0
    ours = own.metrics["undisturbed"]
    for row, rmse, speed in ((again, 0.1, 0.01), (flat, 0.5, 0.06)):
        theirs = row.metrics["undisturbed"]
        assert (ours["falls"], theirs["falls"]) == (0, 0)
        assert theirs["joints"]["ankle"]["rmse_deg"] == pytest.approx(ours["joints"]["ankle"]["rmse_deg"], abs=rmse)
        assert theirs["speed_m_s"]["mean"] == pytest.approx(ours["speed_m_s"]["mean"], abs=speed)


def test_the_command_writes_table_and_schedules(capsys, tmp_path):
    words = ["schedule", "--stiffness", "times:0.9", "--episodes", "1", "--seconds", "5", "--threads", "1"]
    words += ["--out", str(tmp_path / "springs")]
    assert study_main(["any-stiffness", *words]) == 0
    assert "| `times:0.9` | 0 of 1 |" in capsys.readouterr().out
    assert (tmp_path / "springs" / "report.md").read_text().startswith("| K |")
    numbers = (tmp_path / "springs" / "stiffness.csv").read_text().splitlines()
    assert numbers[0].startswith("stiffness,condition,work_by_stiffness_J_kg,") and len(numbers) == 1 + 2 * 3
    _, settings = policy_and_settings(
        "schedule",
        {"equilibrium": "phase", "schedule": json.loads((tmp_path / "springs/times-0.9.json").read_text())},
    )
    assert settings.schedule is not None and len(settings.schedule.ankle) == PHASE_SEGMENTS


@pytest.mark.parametrize("name", ["flat", "flat:0", "times:-1", "flat:inf", "times:x", "forwards"])
def test_unknown_stiffnesses_are_refused_with_one_line(walked, name):
    with pytest.raises(SpringfootError, match="stiffness must be one of recorded"):
        stiffness_named(name, mean_springs(walked))


def test_a_policy_that_falls_at_once_has_no_springs_to_rebuild():
    policy, settings = policy_and_settings("thesis", {"episode_seconds": 2.0})
    with pytest.raises(SpringfootError, match="thesis walks no strides"):
        mean_springs(record(policy, settings, name="thesis", episodes=1))
