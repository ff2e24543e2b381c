"""The segments of a leg: where their masses are, and what a prosthesis changes of them."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from springfoot.envs.physics.energy import parts_of
from springfoot.envs.physics.foot import INTACT, LOCK, Foot, leg_segments, total_mass
from springfoot.envs.physics.model import ARMATURE, DAMPING_TIME, TOE, build_model
from springfoot.envs.physics.timing import PHYSICS_STEP
from springfoot.envs.settings.feet import RIGID_TOE_STIFFNESS
from springfoot.envs.settings.settings import settings_from
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


@pytest.mark.parametrize(("kind", "joint"), [("rigid", "ankle"), ("rigid_toe", "toe"), ("no_toe", "toe")])
def test_a_contact_meets_a_locked_joint_as_if_it_were_welded(kind, joint):
    """Mass 1/(J M^-1 J^T) of the toe tip upwards: with M of all joints, and without the row and column of the locked
    one."""
    worn = settings_from(right_foot=kind).feet[1]
    bare = replace(worn, **{joint: replace(getattr(worn, joint), device=replace(LOCK, armature=0.0))})

    def masses(foot):
        model = build_model(Body(), feet=(INTACT, foot))
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        inertia = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, inertia)
        up = np.zeros((3, model.nv))
        mujoco.mj_jacGeom(model, data, up, None, model.geom("toe_right").id)
        every = np.arange(model.nv)
        welded = np.delete(every, model.joint(f"{joint}_right").dofadr[0])
        return [
            1 / (up[2, dofs] @ np.linalg.solve(inertia[np.ix_(dofs, dofs)], up[2, dofs])) for dofs in (every, welded)
        ]

    met, welded = masses(worn)
    assert met == pytest.approx(welded, rel=0.06)
    assert masses(bare)[0] < 0.75 * welded


def test_the_ledger_knows_the_armature_of_a_lock():
    model = build_model(Body(), feet=(feet := settings_from(left_foot="no_toe", right_foot="rigid").feet))
    armature = parts_of(Body(), feet)["armature"][0]
    np.testing.assert_array_equal(armature, model.dof_armature[3:].reshape(2, 4))
    added = armature - ARMATURE
    share = 0.5 * PHYSICS_STEP
    lock = share * LOCK.stiffness * (LOCK.damping_time or 0.0)
    toe = share * RIGID_TOE_STIFFNESS * DAMPING_TIME[TOE]  # of the rigid foot's toe, a spring
    np.testing.assert_allclose(added, [[0, 0, 0, lock], [0, 0, lock, toe]], rtol=1e-12, atol=1e-15)
