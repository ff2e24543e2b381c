"""gait.png, stiffness.png and walk.gif: what is drawn is the walk that was measured, over people."""

import numpy as np
import pytest
from drawn import has_line, kept_figures
from PIL import Image, ImageSequence

from springfoot.envs.env import SegmentedFootBiped
from springfoot.envs.physics.model import TOE
from springfoot.evaluation.numbers.metrics import measure
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import record
from springfoot.evaluation.report.animation import foot_points, save_animation
from springfoot.evaluation.report.gait_figure import save_gait_figure, save_stiffness_figure
from springfoot.gait import Body, human_gait
from springfoot.gait.people.gait_events import PERCENT


@pytest.fixture(scope="module")
def recording():
    policy, settings = policy_and_settings("schedule", {"episode_seconds": 6.0})
    return record(policy, settings, name="schedule", episodes=2, threads=1)


@pytest.mark.slow
def test_the_picture_draws_the_walk_over_people(recording, tmp_path):
    gait, human = measure(recording), human_gait(1.2)
    with kept_figures() as figures:
        save_gait_figure(tmp_path / "gait.png", recording, gait)
    of = {ax.get_title(loc="left"): ax for ax in figures["gait.png"].axes}
    assert has_line(of["Knee angle"], PERCENT, gait.both.mean("knee_flexion_deg"))
    assert has_line(of["Knee angle"], PERCENT, np.degrees(human.mean("knee", PERCENT / 100)))
    assert has_line(of["Ankle moment"], PERCENT, gait.both.mean("ankle_moment_Nm_per_kg"))
    assert has_line(of["Vertical force"], PERCENT, gait.both.mean("grf_vertical_bw"))


def test_the_picture_of_the_stiffness_draws_each_foot(recording, tmp_path):
    gait = measure(recording)
    with kept_figures() as figures:
        save_stiffness_figure(tmp_path / "stiffness.png", gait)
    of = {ax.get_title(loc="left"): ax for ax in figures["stiffness.png"].axes}
    for curves in gait.feet:
        assert has_line(of["Ankle stiffness K"], PERCENT, curves.mean("ankle_stiffness_Nm_per_rad"))
        assert has_line(of["Toe stiffness K"], PERCENT, curves.mean("toe_stiffness_Nm_per_rad"))


def test_the_animation_is_two_strides_below_a_megabyte(recording, tmp_path):
    save_animation(tmp_path / "walk.gif", recording)
    assert (tmp_path / "walk.gif").stat().st_size < 1_000_000
    with Image.open(tmp_path / "walk.gif") as clip:
        frames, delay = sum(1 for _ in ImageSequence.Iterator(clip)), clip.info["duration"]
    stride = 120 / measure(recording).metrics["cadence_steps_min"]
    assert frames * delay / 1000 == pytest.approx(2 * stride, abs=0.1)


def test_the_drawn_foot_is_that_of_the_physics():
    env = SegmentedFootBiped()
    env.reset(seed=0)
    for _ in range(10):
        env.step(np.zeros(4))
    data = env.data
    assert np.abs(env.biped.measurement.angle[0, :, TOE]).max() > 0.1
    for side in ("left", "right"):
        # The pitch of a segment is the direction of its x axis.
        foot, toe = (np.arctan2(*data.body(f"{name}_{side}").xmat.reshape(3, 3)[[2, 0], 0]) for name in ("foot", "toe"))
        toe_joint, spheres = foot_points(Body(), data.body(f"foot_{side}").xpos[[0, 2]], foot, toe)
        np.testing.assert_allclose(toe_joint, data.body(f"toe_{side}").xpos[[0, 2]], atol=1e-9)
        for name, sphere in zip(("heel", "ball", "toe"), spheres, strict=True):
            np.testing.assert_allclose(sphere, data.geom(f"{name}_{side}").xpos[[0, 2]], atol=1e-9)
