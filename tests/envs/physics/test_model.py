"""The compiled model against the body it was compiled from."""

import mujoco
import numpy as np
import pytest

from springfoot.envs.physics.contact import CONTACTS, contact_offsets, geom_name
from springfoot.envs.physics.foot import LOCK
from springfoot.envs.physics.model import (
    ANKLE,
    DAMPING_TIME,
    JOINTS,
    SIDES,
    build_model,
    build_spec,
    contact_material,
)
from springfoot.envs.physics.timing import PHYSICS_STEP
from springfoot.envs.settings.settings import BipedSettings
from springfoot.gait.body.body import GRAVITY, Body

BODIES = [Body(), Body(1.5, 45.0), Body(1.9, 100.0, 1.0, 1.0, 0.2, "waist"), Body(1.6, 70.0, 0.94, 1.07, 0.3)]


@pytest.mark.parametrize("body", BODIES)
def test_masses_and_lengths_are_the_bodys(body):
    model = build_model(body)
    assert model.body_mass.sum() == pytest.approx(body.total_mass, rel=1e-12)
    for side in SIDES:
        assert model.body(f"toe_{side}").mass[0] == pytest.approx(body.toe_mass, rel=1e-12)
        assert model.body(f"thigh_{side}").inertia[1] == pytest.approx(body.thigh_inertia, rel=1e-12)
        assert -model.body(f"foot_{side}").pos[2] == pytest.approx(body.shank_length, rel=1e-12)


@pytest.mark.parametrize("body", BODIES)
def test_a_load_is_seen_where_there_is_one(body):
    model = build_model(body, loaded=True)
    (load,) = np.flatnonzero(model.geom_bodyid == model.body("load").id)
    assert (model.geom_rgba[load, 3] > 0) == (body.carried_mass > 0)


@pytest.mark.parametrize("body", BODIES)
def test_standing_straight_the_com_is_the_bodys(body):
    model = build_model(body)
    data = mujoco.MjData(model)
    data.joint("z").qpos = body.leg_length
    mujoco.mj_forward(model, data)
    forward, below = body.foot_com
    leg = np.array(
        [
            [0.0, body.thigh_mass * (body.leg_length - body.thigh_com)],
            [0.0, body.shank_mass * (body.leg_length - body.thigh_length - body.shank_com)],
            [body.foot_mass * forward, body.foot_mass * (body.ankle_height - below)],
            np.array([body.ankle_to_toe_joint + body.toe_com, body.toe_joint_height]) * body.toe_mass,
        ]
    ).sum(0)
    trunk = body.trunk_mass * np.array([0.0, body.leg_length + body.trunk_com_above_hip])
    behind, above = body.carried_com
    load = body.carried_mass * np.array([behind, body.leg_length + above])
    expected = (2 * leg + trunk + load) / body.total_mass
    np.testing.assert_allclose(data.subtree_com[0][[0, 2]], expected, atol=1e-12)


def test_leaning_under_a_load_the_com_of_trunk_and_load_is_over_the_hip():
    body = Body(1.8, 75.0, carried_ratio=0.25)
    model = build_model(body)
    data = mujoco.MjData(model)
    data.joint("pitch").qpos = body.trunk_lean
    mujoco.mj_forward(model, data)
    upper = [data.body(name) for name in ("trunk", "load")]
    masses = np.array([body.trunk_mass, 0.25 * 75.0])
    moment = masses @ [segment.xipos for segment in upper]
    assert moment[0] == pytest.approx(0.0, abs=1e-12)
    assert moment[2] == pytest.approx(np.hypot(*body.upper_moment), rel=1e-12)
    assert 5 < np.degrees(body.trunk_lean) < 12 and Body().trunk_lean == 0


@pytest.mark.parametrize("body", BODIES)
def test_standing_straight_the_soles_touch_the_floor(body):
    model = build_model(body)
    data = mujoco.MjData(model)
    data.joint("z").qpos = body.leg_length
    mujoco.mj_forward(model, data)
    for side in SIDES:
        for contact in CONTACTS:
            geom = model.geom(geom_name(contact, side)).id
            assert data.geom_xpos[geom, 2] - model.geom_size[geom, 0] == pytest.approx(0.0, abs=1e-12)


def test_the_foot_is_as_long_as_the_bodys():
    body = Body()
    offsets = contact_offsets(body)
    heel, toe = offsets["heel"], offsets["toe"]
    back = heel[0] - heel[2]
    front = body.ankle_to_toe_joint + toe[0] + toe[2]
    assert front - back == pytest.approx(body.foot_length, rel=1e-12)


def test_heel_off_turns_the_foot_about_the_ball_and_leaves_ball_and_toe_where_they_are():
    model = build_model(Body())
    data = mujoco.MjData(model)
    data.joint("z").qpos = Body().leg_length
    mujoco.mj_forward(model, data)
    before = {name: data.geom(f"{name}_left").xpos.copy() for name in ("ball", "toe")}
    joint = data.body("toe_left").xpos.copy()
    data.joint("toe_left").qpos = 0.5  # toes up against the foot, as the heel rises
    data.joint("pitch").qpos = 0.5
    mujoco.mj_forward(model, data)
    data.joint("x").qpos, data.joint("z").qpos = data.qpos[:2] + (joint - data.body("toe_left").xpos)[[0, 2]]
    mujoco.mj_forward(model, data)
    for name, place in before.items():
        np.testing.assert_allclose(data.geom(f"{name}_left").xpos, place, atol=1e-12)


def test_a_sphere_that_rolls_carries_its_material_nowhere_and_one_that_slides_does():
    heel = contact_offsets(Body())["heel"][2]
    turn, slide = np.linspace(0.3, 0.0, 4), 0.01 * np.arange(4)
    angle, contact = np.zeros((4, 2, 4)), np.zeros((4, 2, 3, 2))
    angle[..., 0] = turn[:, None]  # a straight leg swings back and turns its foot with it
    contact[:, 0, 0, 0] = -heel * turn
    contact[:, 1, 0, 0] = -heel * turn + slide
    material = contact_material(Body(), contact, np.zeros((4, 3)), angle)[..., 0]
    np.testing.assert_allclose(material[:, 0], 0.0, atol=1e-12)
    np.testing.assert_allclose(material[:, 1], slide, atol=1e-12)


@pytest.mark.parametrize(
    ("joint", "segment", "direction"),
    [
        ("hip_left", "shank_left", (1, 0)),  # flexion swings the knee forward
        ("knee_left", "foot_left", (-1, 0)),  # flexion swings the ankle back
        ("ankle_left", "toe_left", (0, 1)),  # dorsiflexion lifts the toes
        ("pitch", "thigh_left", None),
    ],
)
def test_positive_angles_mean_what_their_names_say(joint, segment, direction):
    model = build_model(Body())
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    before = data.body(segment).xpos.copy()
    com = data.body("trunk").xipos.copy()
    data.joint(joint).qpos = 0.1
    mujoco.mj_forward(model, data)
    if direction is None:
        assert data.body("trunk").xipos[0] > com[0]  # the trunk leans forward
        return
    moved = (data.body(segment).xpos - before)[[0, 2]]
    assert moved @ np.array(direction) > 0.5 * np.abs(moved).max() > 0


def test_toe_up_lifts_the_toe_tip():
    model = build_model(Body())
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    before = data.geom("toe_left").xpos[2]
    data.joint("toe_left").qpos = 0.1
    mujoco.mj_forward(model, data)
    assert data.geom("toe_left").xpos[2] > before


@pytest.mark.parametrize("body", BODIES)
def test_at_rest_the_floor_carries_the_weight(body):
    spec = build_spec(body)
    for held in ("x", "pitch"):
        equality = spec.add_equality(type=mujoco.mjtEq.mjEQ_JOINT, name1=held)
        equality.objtype = mujoco.mjtObj.mjOBJ_JOINT
    model = spec.compile()
    data = mujoco.MjData(model)
    data.joint("z").qpos = body.leg_length
    scale = body.mass_scale * body.length_scale
    for side in SIDES:
        for joint in JOINTS:
            data.actuator(f"stiffness_{joint}_{side}").ctrl = 800.0 * scale
    for _ in range(10_000):
        mujoco.mj_step(model, data)
    assert np.abs(data.qacc).max() < 1e-3
    vertical = sum(data.sensor(f"force_{geom_name(contact, side)}").data[2] for side in SIDES for contact in CONTACTS)
    assert vertical == pytest.approx(body.mass * (1 + body.carried_ratio) * GRAVITY, rel=1e-3)


def test_damped_springs_have_half_the_inertia_that_contacts_do_not_feel():
    """Armature h K beta / 2 of devices, of a schedule's stiffest spring and of braces, but not of one-way ones."""
    own = build_model(Body()).joint("ankle_right").armature[0]
    share = 0.5 * PHYSICS_STEP
    feet = {
        "passive": ({"kind": "passive", "ankle_stiffness": 600.0}, share * 600.0 * DAMPING_TIME[ANKLE]),
        "schedule": (
            {"kind": "adaptive", "schedule": {"ankle": [[0.0, 300, 0], [0.5, 900, 0]], "toe": [[0.0, 50, 0]]}},
            share * 900.0 * DAMPING_TIME[ANKLE],
        ),
        "brace": (
            {"kind": "intact", "orthosis": {"ankle_stiffness": 500.0, "damping_time": 0.1}},
            share * 500.0 * 0.1,
        ),
        "one-way brace": (
            {"kind": "intact", "orthosis": {"ankle_stiffness": 500.0, "engages": "dorsiflexion"}},
            0.0,
        ),
        "lock": ("rigid", share * LOCK.stiffness * (LOCK.damping_time or 0.0)),
    }
    for name, (foot, added) in feet.items():
        settings = BipedSettings(right_foot=foot)
        model = build_model(Body(), feet=settings.feet)
        assert model.joint("ankle_right").armature[0] == pytest.approx(own + added, rel=1e-12), name
