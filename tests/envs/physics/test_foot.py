"""The segments of a leg: where their masses are, and what a prosthesis changes of them."""

import pytest

from springfoot.envs.physics.foot import INTACT, Foot, leg_segments, total_mass
from springfoot.gait import Body


def test_masses_hang_below_their_joints_and_the_foots_lie_ahead():
    """Winter's fractions of length, from the upper joint of thigh and shank downward."""
    body = Body()
    thigh, shank, foot, toe = leg_segments(body, INTACT).com
    assert thigh == (0.0, pytest.approx(-0.433 * body.thigh_length))
    assert shank == (0.0, pytest.approx(-0.433 * body.shank_length))
    assert foot == (
        pytest.approx((body.ankle_to_toe_joint - body.heel_to_ankle) / 2),
        pytest.approx(-body.ankle_height / 2),
    )
    assert toe == (pytest.approx(body.toe_length / 2), 0.0)


def test_a_prosthesis_moves_and_lightens_shank_and_foot_alone():
    body = Body()
    light = Foot(
        shank_mass_ratio=0.5,
        shank_com_ratio=0.8,
        shank_inertia_ratio=0.4,
        foot_mass_ratio=0.7,
        foot_inertia_ratio=0.6,
    )
    ours, intact = leg_segments(body, light), leg_segments(body, INTACT)
    ratios = [mine / theirs for mine, theirs in zip(ours.mass, intact.mass, strict=True)]
    assert ratios == pytest.approx([1.0, 0.5, 0.7, 0.7])
    ratios = [mine / theirs for mine, theirs in zip(ours.inertia, intact.inertia, strict=True)]
    assert ratios == pytest.approx([1.0, 0.4, 0.6, 0.6])
    assert ours.com[1] == (0.0, pytest.approx(-0.8 * 0.433 * body.shank_length))
    assert (ours.com[0], *ours.com[2:]) == (intact.com[0], *intact.com[2:])
    lost = 0.5 * body.shank_mass + 0.3 * (body.foot_mass + body.toe_mass)
    assert total_mass(body, (INTACT, light)) == pytest.approx(body.mass - lost)
