"""Legs whose feet differ: each leg's numbers, how far they are apart, and which is which in table and pictures."""

import json
from dataclasses import replace

import numpy as np
import pytest
from drawn import has_line, kept_figures
from PIL import Image
from rich.console import Console

from springfoot.agents.policies.baselines import follow
from springfoot.envs.control.phase_table import GRID
from springfoot.envs.settings.settings import body_of, settings_from
from springfoot.evaluation import measure, policy_and_settings, record
from springfoot.evaluation.numbers.per_leg import asymmetry, leg_numbers
from springfoot.evaluation.recording.open_loop import deciding_legs, feedback, open_loop_copy
from springfoot.evaluation.report.animation import FAR, NEAR, save_animation
from springfoot.evaluation.report.gait_figure import save_gait_figure
from springfoot.evaluation.report.gait_table import print_table
from springfoot.evaluation.report.schedule_tables import finite_states, write_schedules
from springfoot.gait.people.gait_events import PERCENT


def walked(**feet):
    policy, settings = policy_and_settings("schedule", {"episode_seconds": 6.0, "person": "learned", **feet})
    return record(policy, settings, name="schedule", episodes=2, threads=1)


@pytest.fixture(scope="module")
def recordings():
    return walked(right_foot="passive"), walked(left_foot="passive"), walked()


def test_left_and_right_change_places_with_the_feet(recordings):
    right, left = (measure(recording).metrics for recording in recordings[:2])
    assert right["feet"] == {"left": "intact", "right": "passive"} and left["falls"] == right["falls"] == 0
    ranges = [metrics["per_leg"][side]["joint_range_deg"] for metrics, side in ((right, "right"), (left, "left"))]
    sound = [metrics["per_leg"][side]["joint_range_deg"] for metrics, side in ((right, "left"), (left, "right"))]
    for joint in ("thigh", "knee", "ankle", "toe"):  # of other starts, so not the same strides
        assert ranges[0][joint] == pytest.approx(ranges[1][joint], abs=5.0)
        assert sound[0][joint] == pytest.approx(sound[1][joint], abs=5.0)
    assert ranges[0]["ankle"] < 0.5 * sound[0]["ankle"]
    for name, value in right["asymmetry"].items():
        assert value == pytest.approx(-left["asymmetry"][name], abs=0.2) and abs(value) < 0.5
    for metrics, side in ((right, "right"), (left, "left")):
        assert metrics["per_leg"][side]["stiffness_Nm_rad"]["ankle"]["swing"] == pytest.approx(600.0)


def test_the_legs_together_are_the_whole(recordings):
    gait = measure(recordings[0])
    left, right = gait.metrics["per_leg"].values()
    count = gait.metrics["strides"]["count"]
    assert left["strides"] + right["strides"] == count
    for joint in ("hip", "knee", "ankle", "toe"):
        whole = gait.metrics["joint_work_J_kg"][joint]["positive"]
        parts = sum(leg["strides"] * leg["joint_work_J_kg"][joint]["positive"] for leg in (left, right))
        assert parts / count == pytest.approx(whole)
    assert gait.metrics["grf"]["vertical_max_bw"] > max(leg["vertical_max_mean_bw"] for leg in (left, right))
    steps = np.bincount(gait.tally.step_sides)
    mean = (steps * [left["step_length_m"], right["step_length_m"]]).sum() / steps.sum()
    assert mean == pytest.approx(gait.metrics["step_length_m"])
    for name, of_leg in (("push_off", steps), ("collision", steps[::-1])):  # the other leg lands as one pushes off
        mean = (of_leg * [leg["com_work_J_kg"][name] for leg in (left, right)]).sum() / steps.sum()
        assert mean == pytest.approx(gait.metrics["com_work_J_kg"][name])


def test_with_the_same_feet_there_are_no_legs_apart_and_they_are_alike(recordings):
    gait = measure(recordings[2])
    assert gait.metrics["per_leg"] is None and gait.metrics["asymmetry"] is None
    assert all(abs(value) < 0.1 for value in asymmetry(leg_numbers(gait.tally)).values() if value is not None)


def test_a_walk_without_strides_has_no_numbers():
    policy, settings = policy_and_settings("schedule", {"episode_seconds": 1.0, "right_foot": "rigid"})
    gait = measure(record(policy, settings, name="schedule", episodes=1, threads=1))
    left, right = gait.metrics["per_leg"].values()
    assert left == right and left["strides"] == 0 and left["joint_work_J_kg"]["ankle"]["positive"] is None
    assert set(gait.metrics["asymmetry"].values()) == {None}


@pytest.mark.slow
def test_table_and_pictures_tell_the_legs_apart(recordings, tmp_path):
    recording = recordings[0]
    gait = measure(recording)
    console = Console(record=True, width=120, force_terminal=False)
    print_table(gait.metrics, console)
    text = console.export_text()
    assert "feet: left intact, right passive" in text and "right: passive" in text and "ankle range" in text
    rows = [" ".join(line.split()) for line in text.splitlines()]
    stiffness = gait.metrics["per_leg"]["left"]["stiffness_Nm_rad"]["ankle"]["push_off"]
    assert (
        f"ankle stiffness, push-off N·m/rad {stiffness:.0f} 600" in rows and "stiffness is set by policy device" in rows
    )
    assert "both legs model people r in ±SD" in rows and any(row.startswith("both legs: ") for row in rows)
    narrow = Console(record=True, width=60, force_terminal=True, color_system=None)
    print_table(gait.metrics, narrow)
    lines = [" ".join(line.split()) for line in narrow.export_text().splitlines()]
    assert not [line for line in lines if "…" in line or len(line) > 60]
    for label in ("each leg", "vertical force, peak 1, BW", "vertical force, peak 2, BW", "ankle work, positive, J/kg"):
        assert any(line.startswith(f"{label} ") for line in lines)
    assert any(line.endswith("left: intact right: passive") for line in lines)
    with kept_figures() as figures:
        save_gait_figure(tmp_path / "gait.png", recording, gait)
    knee = next(ax for ax in figures["gait.png"].axes if ax.get_title(loc="left") == "Knee angle")
    for leg in gait.feet:
        assert has_line(knee, PERCENT, leg.mean("knee_flexion_deg"))
    save_animation(tmp_path / "walk.gif", recording)
    with Image.open(tmp_path / "walk.gif") as clip:
        seen = np.asarray(clip.convert("RGB")).reshape(-1, 3)
    assert all((seen == colour).all(axis=1).sum() > 200 for colour in (NEAR, FAR))  # both legs


def printed(metrics, width=80):
    console = Console(record=True, width=width, force_terminal=True, color_system=None)
    print_table(metrics, console)
    lines = console.export_text().splitlines()
    assert not [line for line in lines if "…" in line or len(line) > width]
    return [" ".join(line.split()) for line in lines]


@pytest.mark.parametrize(("foot", "joint"), [("rigid", "ankle"), ("rigid_toe", "toe")])
def test_a_lock_is_not_averaged_with_muscles(foot, joint):
    metrics = measure(walked(left_foot=foot)).metrics
    sound = metrics["per_leg"]["right"]["stiffness_Nm_rad"][joint]
    assert metrics["falls"] == 0 and max(sound.values()) < 1000.0
    assert metrics["stiffness_Nm_rad"][joint] == sound
    rows = printed(metrics)
    assert f"{joint} stiffness N·m/rad {'/'.join(f'{value:.0f}' for value in sound.values())}" in rows
    assert f"{joint} stiffness, swing N·m/rad locked {sound['swing']:.0f}" in rows
    assert "stiffness of both legs: without a joint that is locked" in rows


def test_two_locks_are_told_as_such():
    rows = printed(measure(walked(left_foot="rigid", right_foot="rigid")).metrics)
    assert any(row.startswith("ankle stiffness") and row.endswith("N·m/rad locked") for row in rows)


def test_a_walk_that_only_fell_has_the_rows_that_have_numbers_and_a_hint():
    policy, settings = policy_and_settings("schedule", {"episode_seconds": 6.0, "left_foot": "rigid"})
    metrics = measure(record(policy, settings, name="schedule", episodes=1, threads=1)).metrics
    rows = printed(metrics)
    assert "falls 1 of 1" in rows and f"an episode lasts s {metrics['seconds_mean']:.1f}" in rows
    assert rows[-1] == "Every episode fell: on these feet try --person learned"
    assert not any("–" in row for row in rows) and len(rows) < 16
    sound = metrics | {"environment": metrics["environment"] | {"left_foot": "intact"}}
    assert "Every episode fell: springfoot live shows how" in printed(sound)


def test_feedback_is_of_the_leg_that_decides(recordings):
    share = measure(recordings[0]).metrics["feedback"]["ankle"]["share"]
    alike = measure(recordings[2]).metrics["feedback"]["ankle"]["share"]
    assert np.isfinite(share) and share < alike + 0.2
    weak = measure(walked(right_foot="drop")).metrics["feedback"]["ankle"]
    assert weak["share"] is None or np.isfinite(weak["share"])
    assert settings_from(right_foot="drop").right_foot.kind == "drop"


@pytest.mark.parametrize(("which", "changed"), [(0, (True, False)), (1, (False, True)), (2, (True, True))])
def test_finite_states_are_of_the_legs_whose_stiffness_the_policy_sets(recordings, which, changed):
    recording = recordings[which]
    legs = deciding_legs(recording.settings)
    states = finite_states(recording, legs)["states"]
    for side in (0, 1):
        stiffness = recording.series["stiffness"].copy()
        stiffness[:, :, side] *= 1.5
        other = finite_states(replace(recording, series=recording.series | {"stiffness": stiffness}), legs)["states"]
        assert (states != other) == changed[side]


def test_without_a_leg_that_decides_there_is_no_table_of_finite_states(recordings, tmp_path):
    feet = {"left_foot": "rigid", "right_foot": "passive"}
    recording = replace(recordings[2], settings=replace(recordings[2].settings, **feet))
    write_schedules(tmp_path, recording)
    assert [path.name for path in tmp_path.iterdir()] == ["stiffness_schedule.csv"]


def test_the_table_has_a_row_for_each_of_two_legs_of_unlike_stiffness(recordings):
    recording = recordings[2]
    stiffness = np.ones_like(recording.series["stiffness"]) * [[200.0, 30.0], [200.0, 200.0]]
    unlike = measure(with_stiffness(recording, stiffness)).metrics
    rows = printed(unlike)
    assert "toe stiffness, left N·m/rad 30/30/30/30" in rows and "toe stiffness, right N·m/rad 200/200/200/200" in rows
    assert not any("115/" in row for row in rows)  # which no leg has
    alike = measure(recording).metrics
    assert alike["leg_stiffness_Nm_rad"] is None and any(
        row.startswith("toe stiffness N·m/rad") for row in printed(alike)
    )


def test_states_of_one_leg_are_named_after_it(recordings, tmp_path):
    write_schedules(tmp_path, recordings[0])
    assert [path.name for path in tmp_path.glob("*.json")] == ["finite_states_left.json"]


@pytest.mark.parametrize("foot", ["intact", "weak"])
def test_legs_with_different_feet_or_stiffness_have_states_and_feedback_of_their_own(recordings, tmp_path, foot):
    recording = recordings[2]
    stiffness = np.ones_like(recording.series["stiffness"]) * [[200.0, 30.0], [300.0, 60.0]]
    planted = with_stiffness(recording, stiffness, right_foot=foot)
    assert feedback(planted) == {joint: {"share": 0.0, "spread": 0.0} for joint in ("ankle", "toe")}
    write_schedules(tmp_path, planted)
    tables = sorted(path.name for path in tmp_path.glob("*.json"))
    assert tables == ["finite_states_left.json", "finite_states_right.json"]
    for name, toe in zip(tables, (30.0, 60.0), strict=True):
        states = json.loads((tmp_path / name).read_text(encoding="utf-8"))["states"]
        assert {state["toe"]["stiffness_Nm_per_rad"] for state in states} == {toe}
        assert policy_and_settings(str(tmp_path / name), {})[1].equilibrium == "phase"  # a policy again


@pytest.mark.parametrize(("apart", "tables"), [(0.09, 1), (0.11, 2)])
def test_legs_with_equal_feet_are_alike_within_a_tenth_of_their_stiffness(recordings, tmp_path, apart, tables):
    recording = recordings[2]
    stiffness = np.ones_like(recording.series["stiffness"]) * [[200.0, 30.0], [200.0, 30.0 * np.exp(apart)]]
    planted = with_stiffness(recording, stiffness)
    write_schedules(tmp_path, planted)
    assert len(list(tmp_path.glob("*.json"))) == tables
    spread = feedback(planted)["toe"]["spread"]
    assert spread is not None and (spread > 0.01) == (tables == 1)  # of both legs together they differ at equal phase


def with_stiffness(recording, stiffness, **feet):
    """The recording with other K, (episodes, ticks, legs, 2), and feet."""
    settings = replace(recording.settings, **feet)
    return replace(recording, settings=settings, series=recording.series | {"stiffness": stiffness})


def test_a_copy_open_loop_keeps_the_stiffness_of_legs_with_different_feet():
    settings = settings_from(right_foot="weak", episode_seconds=6.0)
    planted = np.array([[200.0, 30.0], [300.0, 60.0]])  # left and right, ankle and toe
    table = np.broadcast_to(planted, (1, len(GRID), 2, 2))
    body = body_of(settings)
    copy, absolute = open_loop_copy(follow(table, np.zeros(1), settings, body), settings, name="planted", threads=1)
    copied = record(copy, absolute, name="copy", episodes=1).series["stiffness"]
    assert copied[0, 100:300] == pytest.approx(np.broadcast_to(planted, (200, 2, 2)), rel=1e-5)
