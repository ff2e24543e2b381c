"""The body's proportions against the thesis's Table 1 and Winter's tables."""

import math

import pytest

from springfoot.gait import Body, SpringfootError


def test_lengths_at_reference_height_are_those_of_thesis_table_1():
    body = Body()
    assert body.foot_length == pytest.approx(0.2584, abs=5e-5)
    assert body.toe_length == pytest.approx(0.068, abs=5e-5)
    assert body.heel_to_ankle == pytest.approx(0.0867, abs=5e-5)
    assert body.ankle_to_toe_joint == pytest.approx(0.1037, abs=5e-5)
    assert body.ankle_height == pytest.approx(0.068, abs=5e-5)
    assert body.thigh_length == body.shank_length == pytest.approx(0.417, abs=6e-4)
    assert body.trunk_com_above_hip == pytest.approx(0.307, abs=6e-4)


@pytest.mark.parametrize("body", [Body(), Body(1.5, 45.0), Body(height=1.9, mass=100.0)])
def test_masses_sum_to_body_mass(body):
    leg = body.thigh_mass + body.shank_mass + body.foot_mass + body.toe_mass
    assert body.trunk_mass + 2 * leg == pytest.approx(body.mass, rel=1e-12)


def test_lengths_scale_with_height_and_inertias_with_mass_times_height_squared():
    small, large = Body(1.5, 50.0), Body(1.8, 75.0)
    for name in ("foot_length", "leg_length", "thigh_com", "toe_com", "toe_joint_height", "trunk_length"):
        assert getattr(large, name) / getattr(small, name) == pytest.approx(1.2)
    for name in ("trunk_inertia", "thigh_inertia", "shank_inertia", "foot_inertia", "toe_inertia"):
        assert getattr(large, name) / getattr(small, name) == pytest.approx(1.5 * 1.2**2)


def test_a_load_leans_the_trunk_on_the_back_and_leaves_it_upright_around_the_waist():
    back = Body(1.8, 75.0, carried_ratio=0.25)
    waist = Body(1.8, 75.0, carried_ratio=0.25, carried_at="waist")
    assert waist.trunk_lean == 0.0 < back.trunk_lean
    assert waist.total_mass == back.total_mass and waist.carried_inertia < back.carried_inertia
    assert waist.carried_com == pytest.approx((0.0, 0.1 * 1.8 / 1.7))
    ring = 0.5 * waist.carried_mass * (0.16 * 1.8 / 1.7) ** 2  # about a diameter
    assert waist.carried_inertia == pytest.approx(ring, rel=0.06)
    with pytest.raises(SpringfootError, match=r"^carried_at must be one of 'back', 'waist', got 'head'$"):
        Body(carried_at="head")  # pyright: ignore[reportArgumentType]


def test_equal_froude_speed_means_speed_scales_with_root_of_length():
    assert Body(1.9).froude_speed(1.2 * math.sqrt(1.9 / 1.7)) == pytest.approx(Body().froude_speed(1.2))


def test_proportions_move_lengths_and_all_of_them_add_up_to_the_height():
    average = Body(1.8, 75.0)
    head = 1.8 - average.leg_length - average.trunk_length  # above the shoulder, 0.182 of height (Winter)
    for ratio in (0.94, 1.06):
        legs, feet = Body(1.8, 75.0, leg_ratio=ratio), Body(1.8, 75.0, foot_ratio=ratio)
        assert legs.leg_length + legs.trunk_length + head == pytest.approx(1.8, rel=1e-12)
        assert legs.thigh_length / average.thigh_length == pytest.approx(ratio)
        assert legs.foot_length == average.foot_length
        assert feet.foot_length / average.foot_length == pytest.approx(ratio)
        assert feet.leg_length == average.leg_length
    assert Body(1.8, 75.0, carried_ratio=0.2).total_mass == pytest.approx(90.0)


@pytest.mark.parametrize(
    ("proportion", "value", "allowed"),
    [
        ("leg_ratio", 0.93, r"\[0.94, 1.06\]"),
        ("foot_ratio", 1.08, r"\[0.93, 1.07\]"),
        ("carried_ratio", -0.1, r"\[0, 0.4\]"),
        ("carried_ratio", 0.41, r"\[0, 0.4\]"),
        ("leg_ratio", float("nan"), "leg_ratio"),
    ],
)
def test_impossible_proportions_are_refused_with_one_line(proportion, value, allowed):
    with pytest.raises(SpringfootError, match=f"{proportion}.*{allowed}" if "[" in allowed else allowed) as caught:
        Body(**{proportion: value})
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("height", "mass", "word"),
    [
        (0.99, 63.0, "height"),
        (2.31, 63.0, "height"),
        (1.7, -1.0, "mass"),
        (1.7, 251.0, "mass"),
        (2.2, 21.0, "index"),
        (1.1, 240.0, "index"),
        (float("nan"), 63.0, "height"),
        (1.7, float("inf"), "mass"),
        ("1.7", 63.0, "height"),
        (True, 63.0, "height"),
    ],
)
def test_impossible_bodies_are_refused_with_one_line(height, mass, word):
    with pytest.raises(SpringfootError, match=word) as caught:
        Body(height, mass)
    assert "\n" not in str(caught.value)
