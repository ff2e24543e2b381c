"""What feet are worth: the numbers of a walk on feet that differ, and what adaptive stiffness recovers."""

import csv
import json
import re

import numpy as np
import pytest
from scipy.stats import ttest_1samp

from springfoot.cli.main import study_main
from springfoot.envs.physics.model import JOINT_RANGE_DEG, KNEE, RIGHT
from springfoot.envs.settings.adapted import ADAPTED, committed_feet
from springfoot.evaluation.numbers.metrics import measure
from springfoot.evaluation.numbers.per_leg import leg_numbers
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import TICK, WARM_UP, record, record_feet
from springfoot.studies.base.intervals import t_interval
from springfoot.studies.base.kept import Kept
from springfoot.studies.feet.adapt import kept_name
from springfoot.studies.feet.foot_walks import NAMES, SCHEDULE, beyond_stop, for_body, numbers_of, walked
from springfoot.studies.feet.prosthesis import (
    ADAPTED_ALONE,
    NOT_ADAPTED,
    SEARCHES,
    TOE_HELD,
    WHERE,
    WITH_POLICY,
    config_of,
    sections,
    share_rows,
)

SHORT = {"episode_seconds": 6.0}


def test_numbers_are_those_of_the_evaluation():
    acting, settings = policy_and_settings("pretrained", {**SHORT, "right_foot": "passive"})
    gait = measure(record(acting, settings, name="pretrained", episodes=2))
    own, legs = numbers_of(gait), gait.metrics["per_leg"]
    assert own["sound_peak_bw"] == legs["left"]["vertical_max_mean_bw"]
    work = legs["right"]["joint_work_J_kg"]
    assert own["push_off_J_kg"] == work["ankle"]["positive"] + work["toe"]["positive"]
    assert own["step_asymmetry"] == abs(gait.metrics["asymmetry"]["step_length"])
    assert own["falls"] == gait.metrics["falls"] / 2
    stride = 2 * gait.metrics["step_length_m"]
    hips = sum(leg["joint_work_J_kg"]["hip"]["positive"] for leg in leg_numbers(gait.tally).values())
    assert own["hip_work_J_kg_m"] == pytest.approx(hips / stride)


def test_feet_side_by_side_walk_as_alone_and_the_same_episodes():
    feet = ["intact", {"kind": "weak", "strength": 0.3}]
    acting, settings = policy_and_settings("pretrained", {**SHORT, "unevenness_m": 0.01})
    together = record_feet(acting, settings, feet, name="x", episodes=2, seed=5)
    for foot, recording in zip(feet, together, strict=True):
        acting, settings = policy_and_settings("pretrained", {**SHORT, "unevenness_m": 0.01, "right_foot": foot})
        alone = record(acting, settings, name="x", episodes=2, seed=5)
        assert recording.settings == alone.settings
        assert recording.returns.tobytes() == alone.returns.tobytes()
        assert recording.series["angle"].tobytes() == alone.series["angle"].tobytes()


def test_a_walk_that_falls_has_its_falls_and_no_other_numbers():
    own = walked("thesis_printed", SHORT, episodes=1)
    assert own["falls"] == own["falls_pushed"] == 1.0
    assert own["fibre_J_kg_m"] is None or own["push_off_J_kg"] is None


@pytest.mark.parametrize(("name", "least", "most"), [("rigid", 0.0, 0.0), (TOE_HELD, 0.05, 0.15)])
def test_who_holds_the_toe_leans_on_the_stop_of_a_knee(name, least, most):
    right = {"kind": "rigid", ADAPTED: name}
    given = {**SHORT, **SCHEDULE[1], "right_foot": right, "speed": 1.05 if name == TOE_HELD else 1.2}
    acting, settings = policy_and_settings(SCHEDULE[0], given)
    recording = record(acting, settings, name=name, episodes=1, seed=500)
    share = beyond_stop(recording)
    assert share is not None and least <= share <= most
    knee = recording.series["angle"][0, round(WARM_UP / TICK) :, RIGHT, KNEE]
    assert np.mean(knee < np.deg2rad(JOINT_RANGE_DEG[KNEE][0])) == pytest.approx(share)


def test_springs_of_a_foot_scale_with_the_body_and_angles_do_not():
    foot = {"kind": "passive", "ankle_stiffness": 600.0, "ankle_deg": 4.0, "toe_stiffness": 50.0}
    assert for_body(foot, 1.70, 63.0) == foot
    assert for_body(foot, 1.70, 126.0) == foot | {"ankle_stiffness": 1200.0, "toe_stiffness": 100.0}
    assert for_body({"kind": "rigid"}, 1.5, 50.0) == {"kind": "rigid"}


def test_students_interval_is_that_of_the_t_test():
    values = np.array([0.1, 0.4, 0.35, 0.2, 0.6])
    theirs = ttest_1samp(values, 0.0).confidence_interval(0.95)
    assert t_interval(values) == pytest.approx((theirs.low, theirs.high))
    assert t_interval(values[:1]) == (-np.inf, np.inf)


def rows_of(passive, adaptive, intact) -> list[dict]:
    where = dict(zip(WHERE, (1.7, 63.0, 1.2), strict=True))
    shown = dict.fromkeys(NAMES)
    own = [
        {"foot": "intact", "person": NOT_ADAPTED, "search": "", "seed": "", **where, **shown, "sound_peak_bw": intact}
    ]
    for kind, values in (("passive", passive), ("adaptive", adaptive)):
        base = {"foot": kind, "search": 1, **where, **shown}
        own += [
            {**base, "person": person, "seed": seed, "sound_peak_bw": value}
            for person in (ADAPTED_ALONE, WITH_POLICY)
            for seed, value in enumerate(values)
        ]
    return own


def test_the_share_is_of_the_gap_between_the_best_spring_and_the_intact_foot():
    def share_of(*values):
        found = [row for row in share_rows(rows_of(*values)) if row["number"] == "sound_peak_bw"]
        assert [row["person"] for row in found] == [ADAPTED_ALONE, WITH_POLICY]
        assert {**found[0], "person": ""} == {**found[1], "person": ""}
        return found[1]

    share = share_of([1.5, 1.52, 1.48], [1.4, 1.41, 1.39], 1.3)
    assert share["pairs"] == 3
    assert share["change"] == pytest.approx(-0.1)
    assert share["share"] == pytest.approx(0.5)
    assert share["share_low"] < 0.5 < share["share_high"]
    assert share_of([1.5, 1.52, 1.48], [1.6, 1.61, 1.62], 1.3)["share"] < 0
    better = share_of([1.2, 1.21, 1.19], [1.4, 1.41, 1.39], 1.3)  # than the intact foot: no gap to close
    assert better["share"] is None
    assert share_of([1.2, 1.4, 1.3], [1.4, 1.41, 1.39], 1.3)["share"] is None


@pytest.mark.parametrize(
    ("rigid", "word"),
    [([1.6, 1.63, 1.59], "better"), ([1.3, 1.33, 1.31], "worse"), ([1.5, 1.55, 1.45], "not told apart")],
)
def test_the_passive_foot_is_better_than_the_rigid_one_by_an_interval(rigid, word, tmp_path):
    rows = rows_of([1.5, 1.52, 1.48], [1.4, 1.41, 1.39], 1.3)
    worn = [row for row in rows if (row["foot"], row["person"]) == ("passive", ADAPTED_ALONE)]
    rows += [{**row, "foot": "rigid", "sound_peak_bw": peak} for row, peak in zip(worn, rigid, strict=True)]
    text = sections(rows, [], ("3 episodes", "2 episodes", "9 steps"))["PROSTHESIS"]
    assert re.search(f"search 1: .*{word} in [0-9] \\([^)]*sound-side peak BW", text)


def test_the_page_tells_every_row_and_what_is_missing(tmp_path):
    rows = rows_of([1.5, 1.52, 1.48], [1.4, 1.41, 1.39], 1.3)
    text = sections(rows, share_rows(rows), ("3 episodes", "2 episodes", "9 steps"))
    assert "| passive | adapted, trained | 1 | 3 | – | – | – | 1.50 ± 0.02 |" in text["PROSTHESIS"]
    assert "trained on it for 9 steps" in text["PROSTHESIS"]
    assert "50% [" in text["RECOVERED"]
    assert "| push-off work J/kg | adapted, trained | 1 | 0 | – | – | – | – | no gap |" in text["RECOVERED"]


def test_what_was_measured_is_kept(tmp_path):
    path, made = tmp_path / "runs" / "kept.json", []

    def make() -> dict:
        made.append(1)
        return {"falls": 0.5}

    for _ in range(2):
        assert Kept(path).get(["a", 1], make) == {"falls": 0.5}
    assert len(made) == 1
    Kept(path).get(["a", 2], make)
    assert len(made) == 2
    assert len(json.loads(path.read_text())) == 2


def test_trainings_are_of_the_committed_people():
    config = config_of("passive", 3, 1000)
    worn = config.environment.right_foot
    assert worn.adapted == "passive"
    assert worn.numbers["ankle_stiffness"] == committed_feet()["passive"]["ankle_stiffness"]
    assert (config.seed, config.timesteps, config.environment.action_mode) == (3, 1000, "residual")


def test_both_searches_of_every_kind_are_committed():
    for kind in ("rigid", "passive", "adaptive"):
        for search in SEARCHES:
            assert kept_name(kind, search) in committed_feet()


@pytest.mark.slow
def test_quick_walks_and_the_same_command_writes_the_same_numbers(tmp_path):
    for name in ("one", "two"):
        words = ["prosthesis", "--quick", "--out", str(tmp_path / name), "--policies", str(tmp_path)]
        assert study_main(words) == 0
    files = [(tmp_path / name / "prosthesis.csv").read_bytes() for name in ("one", "two")]
    assert files[0] == files[1]
    lines = list(csv.DictReader(files[0].decode().splitlines()))
    assert lines[0]["foot"] == "intact"
    assert {line["foot"] for line in lines} == {"intact", "rigid", "passive", "adaptive", TOE_HELD}
