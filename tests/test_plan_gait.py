"""A plan as a gait, its effort, and the committed style of least effort."""

from dataclasses import replace
from math import sqrt

import numpy as np
import pytest

from springfoot.gait import Body, plan_walk, planned_moments
from springfoot.gait.plan_effort import MOTION_RANGE_DEG, effort_of
from springfoot.gait.plan_gait import gait_of
from springfoot.gait.walk_style import least_work, style_from
from springfoot.studies.command import main
from springfoot.studies.plan_tuning import CHOICES, price, style_at

PHASE = np.arange(200) / 200
BODY = Body()
PLAN = plan_walk(BODY, 1.2, style=least_work(1.2))


def test_a_plans_gait_has_its_angles_moments_and_forces():
    gait, half = gait_of(PLAN), len(PHASE) // 2
    for name, curve in PLAN.joint_angles(PHASE).items():
        off = np.degrees(gait.mean(name, PHASE) - curve)
        assert np.sqrt(np.mean(off**2)) < (0.5 if name != "toe" else 2.0), name
    for joint, moment in planned_moments(PLAN, PHASE).items():
        own = gait.mean(f"{joint}_moment", PHASE) * BODY.total_mass * BODY.length_scale
        assert np.corrcoef(own, moment)[0, 1] > 0.97, joint
    vertical, forward = (gait.mean(f"grf_{name}", PHASE) for name in ("vertical", "forward"))
    assert np.mean(vertical + np.roll(vertical, half)) == pytest.approx(1.0, abs=0.01)
    assert np.mean(forward) == pytest.approx(0.0, abs=0.005)
    assert gait.stride_time == PLAN.stride_time and gait.toe_off == PLAN.feet.toe_off
    assert not gait.sd("knee", PHASE).any() and gait.foot.ankle_quasi_stiffness is None
    assert np.all(np.diff(gait.foot.plateaus) > 0)


def test_effort_is_the_same_for_froude_equal_bodies():
    tall = Body(2.0, 63.0 * (2.0 / 1.7) ** 3)
    other = effort_of(plan_walk(tall, 1.2 * sqrt(tall.height / BODY.height), style=least_work(1.2)))
    own = effort_of(PLAN)
    # Strength scales with mass x height; the toe's tissue likewise.
    assert (other.work, other.activation) == pytest.approx((own.work, own.activation), rel=0.01)


def test_effort_counts_energy_and_joints_beyond_their_range():
    own = effort_of(PLAN)
    assert own.beyond_range < 0.5 and own.total == own.work + own.activation + own.rate
    # Over a stride joints do no net work, so that energy per weight and distance is cost of transport x (4 + 1/1.2).
    assert own.work / (4 + 1 / 1.2) == pytest.approx(0.14, abs=0.03)
    foot = replace(least_work(1.2).foot, toe_swing=1.4)
    bent = effort_of(plan_walk(BODY, 1.2, style=replace(least_work(1.2), foot=foot)))
    assert bent.beyond_range > 5.0 and MOTION_RANGE_DEG["toe"][1] == 70.0


def test_styles_are_linear_between_speeds_and_their_json_is_exact():
    style = least_work(1.2)
    assert style_from(style.to_json()) == style
    assert least_work(0.5) == least_work(1.0) == style  # one speed is committed


def test_no_small_step_from_the_committed_style_costs_much_less():
    style, paid = least_work(1.2), price(BODY, 1.2, _vector(least_work(1.2)))[0]
    assert style_at(_vector(style)) == style
    random = np.random.default_rng(0)
    tried = [price(BODY, 1.2, _vector(style) + 0.05 * random.standard_normal(len(CHOICES)))[0] for _ in range(12)]
    assert min(tried) > paid - 0.05 and paid < 0.5 * price(BODY, 1.2, np.zeros(len(CHOICES)))[0]


def test_the_search_runs_and_leaves_the_file_alone_with_quick(tmp_path, capsys):
    styles = tmp_path / "styles.json"
    assert main(["study", "plan-tuning", "--quick", "--styles", str(styles), "--out", str(tmp_path / "out")]) == 0
    assert "paid" in capsys.readouterr().out and not styles.exists()
    assert (tmp_path / "out" / "generations.csv").is_file()


def _vector(style):
    values = style.to_json()
    foot = values.pop("foot")
    values["zmp_from"], values["zmp_to"] = values.pop("zmp_travel")
    for name in ("via_forward", "via_up", "via_pitch"):
        foot[f"{name}_1"], foot[f"{name}_2"] = foot.pop(name)
    values |= foot
    return np.array([(values[name] - start) / unit for name, (start, unit, _) in CHOICES.items()])
