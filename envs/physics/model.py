"""The MuJoCo model of a body, and the names of its elements.

The planar body of the thesis (trunk, thighs, shanks, feet, toes), compiled from `Body` with `MjSpec`. World x is
forward and z up. Joint signs: hip and knee flexion, ankle dorsiflexion, toe-up and trunk-forward pitch positive.

Scaling: a body of height ratio l and mass ratio m (against 1.70 m, 63 kg) has lengths ~ l, stiffness and torque
~ m*l, joint damping ~ m*l*sqrt(l), armature ~ m*l^2, contact time ~ sqrt(l); its gait at equal Froude speed is then
the same (Hof 1996, "Scaling gait data to body size").
"""

from math import sqrt

import mujoco
import numpy as np

from springfoot.gait.arrays import NDArray
from springfoot.gait.body import GRAVITY, Body
from springfoot.gait.leg import JOINTS

from ..timing import PHYSICS_STEP
from .foot_contact import CONTACTS, FRICTION, add_sphere, add_touch, contact_offsets, geom_name, ground_name

SIDES = ("left", "right")
BASE = ("x", "z", "pitch")
LEFT, RIGHT = range(2)
HIP, KNEE, ANKLE, TOE = range(4)
ACTIONS = tuple(f"{joint}_{side}" for side in SIDES for joint in ("ankle", "toe"))

DAMPING_TIME = (0.031, 0.0377, 0.02, 0.02)
"""beta [s] of tau = K (theta_eq - theta - beta dtheta/dt), in the order of `JOINTS`; scaled with sqrt(l).

Chosen, of the order of damping over stiffness in people's ankles in stance, 14 ms (0.016/1.14, 0.080/5.43: J. Medical
Devices 12 (2018) 011010, abstract), and in a powered prosthesis, 8-20 ms (Sup et al. 2009, Table III). Like the next
three constants it is varied in docs/physics.md.
"""
TORQUE_LIMIT = (200.0, 200.0, 200.0, 60.0)
"""Largest actuator torque [N m] at 1.70 m and 63 kg, in the order of `JOINTS`.

Chosen above what walking takes: `pretrained` reaches 57, 43, 83 and 24 N m in 20 episodes of 20 s.
"""
ARMATURE = (0.02, 0.01, 0.005, 0.002)
"""Inertia added to each joint's own [kg m^2] at 1.70 m and 63 kg, in the order of `JOINTS`.

Chosen, people have none: light segments on stiff springs are fast (the toe has 0.0003 kg m^2 about its joint).
"""
PASSIVE_DAMPING = (0.1, 0.1, 0.1, 0.1)
"""Damping of each joint beside its spring's [N m s/rad] at 1.70 m and 63 kg, in the order of `JOINTS`.

That of all joints in predictive simulations of human gait (Falisse et al. 2019, J. R. Soc. Interface 16:20190402; the
default of their code, PredSim, `damping_coefficient_all_dofs`).
"""
JOINT_RANGE_DEG = ((-60.0, 120.0), (-10.0, 150.0), (-60.0, 45.0), (-45.0, 90.0))
"""Stops of the joints [deg], in the order of `JOINTS`; chosen, as walking never reaches them (docs/physics.md)."""

_SIGN_AXIS = {"hip": -1.0, "knee": 1.0, "ankle": -1.0, "toe": -1.0}  # about +y a vector turns from z to x


def damping_times(body: Body) -> np.ndarray:
    """Beta [s] of each joint in the order of `JOINTS`, shape (4,)."""
    return np.array(DAMPING_TIME) * sqrt(body.length_scale)


def torque_limits(body: Body) -> np.ndarray:
    """Largest actuator torque [N m] of each joint in the order of `JOINTS`, shape (4,)."""
    return np.array(TORQUE_LIMIT) * body.strength_scale


def passive_damping(body: Body) -> np.ndarray:
    """Joint damping [N m s/rad] in the order of `JOINTS`, shape (4,)."""
    return np.array(PASSIVE_DAMPING) * body.strength_scale * sqrt(body.length_scale)


def contact_material(body: Body, contact: NDArray, base: NDArray, angle: NDArray) -> NDArray:
    """Forward coordinate [m] of the sole's material at the contact points, up to a constant: (T, side, contact).

    It changes when a foot slides and stays when its spheres roll. From lowest points `contact` (T, side, contact, 2)
    [m], `base` (T, 3) and joint angles (T, side, joint) as in `envs.physics.simulation.Measurement`.
    """
    foot = angle[..., HIP] - base[..., None, 2] - angle[..., KNEE] + angle[..., ANKLE]  # toes up
    turn = np.stack([foot, foot + angle[..., TOE], foot + angle[..., TOE]], axis=-1)
    return contact[..., 0] + turn * [radius for *_, radius in contact_offsets(body).values()]


def build_spec(body: Body, friction: float = FRICTION) -> mujoco.MjSpec:
    """The model's specification: 11 degrees of freedom, 16 actuators (stiffness, drive per joint), 6 force sensors.

    Either foot has a ground of its own, a plane that is moved from outside (mocap).
    """
    length, mass = body.length_scale, body.mass_scale
    spec = mujoco.MjSpec()
    spec.modelname = "springfoot"
    spec.option.timestep = PHYSICS_STEP
    spec.option.gravity = (0.0, 0.0, -GRAVITY)
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    # Looking for islands of constraints, and for boxes around few spheres, costs 11 % of a step and finds nothing.
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ISLAND | mujoco.mjtDisableBit.mjDSBL_MIDPHASE)
    spec.compiler.degree = False
    spec.visual.global_.offwidth, spec.visual.global_.offheight = 960, 720
    spec.add_texture(
        name="tiles",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        rgb1=(0.86, 0.88, 0.90),
        rgb2=(0.78, 0.81, 0.84),
        width=256,
        height=256,
    )
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=(0.95, 0.97, 1.0),
        rgb2=(0.75, 0.83, 0.92),
        width=64,
        height=384,
    )
    tiles = spec.add_material(name="tiles", texrepeat=(1.0, 1.0), texuniform=True)
    tiles.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "tiles"

    world = spec.worldbody
    world.add_light(pos=(0, -2, 4), dir=(0, 0.4, -1), type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL)
    trunk = _segment(world, "trunk", (0, 0, 0), body.trunk_mass, (0, body.trunk_com_above_hip), body.trunk_inertia)
    slide, hinge = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
    for name, kind, axis in zip(BASE, (slide, slide, hinge), ((1, 0, 0), (0, 0, 1), (0, 1, 0)), strict=True):
        trunk.add_joint(name=name, type=kind, axis=axis)
    trunk.add_camera(
        name="track",
        pos=(0, -2.6 * length, -0.1 * length),
        xyaxes=(1, 0, 0, 0, 0, 1),
        mode=mujoco.mjtCamLight.mjCAMLIGHT_TRACKCOM,
    )
    _bone(trunk, (0, 0.0), (0, body.trunk_length), 0.07 * length, 0.0)
    if body.carried_ratio:
        _load(trunk, body)
    for index, side in enumerate(SIDES):
        _leg(spec, trunk, body, side, hip_y=(0.09 if index == LEFT else -0.09) * length)
    for side in SIDES:
        ground = world.add_body(name=ground_name(side), mocap=True)
        ground.add_geom(
            name=ground_name(side),
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            size=(0, 0, 1),
            material="tiles",
            contype=0,
            conaffinity=0,
        )
        for contact in CONTACTS:
            add_touch(spec, contact, side, body, friction)
    for side in SIDES:
        for index, joint in enumerate(JOINTS):
            _add_spring(spec, f"{joint}_{side}", float(damping_times(body)[index]))
    for side in SIDES:
        for contact in CONTACTS:
            spec.add_sensor(
                name=f"force_{geom_name(contact, side)}",
                type=mujoco.mjtSensor.mjSENS_CONTACT,
                objtype=mujoco.mjtObj.mjOBJ_GEOM,
                objname=ground_name(side),
                reftype=mujoco.mjtObj.mjOBJ_GEOM,
                refname=geom_name(contact, side),
                intprm=(1 << mujoco.mjtConDataField.mjCONDATA_FORCE.value, 3, 1),  # force only, net force, one slot
            )
    spec.stat.extent = 2.0 * length
    spec.stat.meanmass = mass
    return spec


def build_model(body: Body, friction: float = FRICTION) -> mujoco.MjModel:
    """The compiled model of `body`."""
    return build_spec(body, friction).compile()


def _load(trunk, body: Body) -> None:
    """Add a box on the back, fixed to the trunk."""
    forward, up = body.carried_com
    load = _segment(trunk, "load", (forward, 0, up), body.carried_mass, (0, 0), body.carried_inertia)
    load.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=np.array([0.075, 0.15, 0.25]) * body.length_scale,
        contype=0,
        conaffinity=0,
        rgba=(0.45, 0.50, 0.35, 1.0),
    )


def _leg(spec: mujoco.MjSpec, trunk, body: Body, side: str, hip_y: float) -> None:
    """Add one leg below the trunk; its lateral offset is for the eye alone (the body is planar)."""
    rgb = 0.15 if side == "left" else 0.0
    thin = 0.035 * body.length_scale
    thigh = _segment(
        trunk,
        f"thigh_{side}",
        (0, hip_y, 0),
        body.thigh_mass,
        (0, -body.thigh_com),
        body.thigh_inertia,
        "hip",
        body,
    )
    _bone(thigh, (0, 0), (0, -body.thigh_length), 1.4 * thin, rgb)
    shank = _segment(
        thigh,
        f"shank_{side}",
        (0, 0, -body.thigh_length),
        body.shank_mass,
        (0, -body.shank_com),
        body.shank_inertia,
        "knee",
        body,
    )
    _bone(shank, (0, 0), (0, -body.shank_length), thin, rgb)
    forward, below = body.foot_com
    foot = _segment(
        shank,
        f"foot_{side}",
        (0, 0, -body.shank_length),
        body.foot_mass,
        (forward, -below),
        body.foot_inertia,
        "ankle",
        body,
    )
    drop = body.ankle_height - body.toe_joint_height
    toe = _segment(
        foot,
        f"toe_{side}",
        (body.ankle_to_toe_joint, 0, -drop),
        body.toe_mass,
        (body.toe_com, 0),
        body.toe_inertia,
        "toe",
        body,
    )
    offsets = contact_offsets(body)
    add_sphere(foot, geom_name("heel", side), offsets["heel"])
    add_sphere(toe, geom_name("ball", side), offsets["ball"])
    add_sphere(toe, geom_name("toe", side), offsets["toe"])
    _bone(foot, offsets["heel"][:2], (body.ankle_to_toe_joint, -drop), 0.6 * thin, rgb)
    _bone(foot, (0, 0), (body.ankle_to_toe_joint, -drop), 0.6 * thin, rgb)
    _bone(toe, (0, 0), offsets["toe"][:2], 0.5 * thin, rgb)


def _segment(parent, name, pos, mass, com, inertia, joint: str = "", body: Body | None = None):
    """Add a rigid segment with an explicit inertia; its hinge, if any, is named after the joint and its side."""
    segment = parent.add_body(name=name, pos=pos)
    segment.explicitinertial = True
    segment.mass = mass
    segment.ipos = (com[0], 0.0, com[1])
    segment.inertia = (inertia, inertia, inertia)  # only the sagittal one acts
    if body is not None:
        index = JOINTS.index(joint)
        length, scale = body.length_scale, body.mass_scale
        limit = float(torque_limits(body)[index])
        segment.add_joint(
            name=f"{joint}_{name.rsplit('_', 1)[1]}",
            type=mujoco.mjtJoint.mjJNT_HINGE,
            axis=(0, _SIGN_AXIS[joint], 0),
            armature=ARMATURE[index] * scale * length**2,
            damping=float(passive_damping(body)[index]),
            limited=True,
            range=tuple(np.deg2rad(JOINT_RANGE_DEG[index])),
            actfrclimited=True,
            actfrcrange=(-limit, limit),
        )
    return segment


def _bone(segment, start, end, radius: float, shade: float) -> None:
    """Add a capsule to look at; it has no mass and no contact."""
    segment.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CAPSULE,
        fromto=(start[0], 0, start[1], end[0], 0, end[1]),
        size=(radius, 0, 0),
        contype=0,
        conaffinity=0,
        rgba=(0.25 + shade, 0.45 + shade, 0.70 + shade, 1.0),
    )


def _add_spring(spec: mujoco.MjSpec, joint: str, beta: float) -> None:
    """Add two actuators that make tau = K (theta_eq - theta - beta dtheta/dt) at one joint in every physics step.

    `stiffness_<joint>`: ctrl = K, gain = -theta - beta dtheta/dt. `drive_<joint>`: ctrl = K theta_eq (+ feed-forward).
    The torque limit is set on the joint, not on the actuators: both may be large where their sum is small.
    """
    spring = spec.add_actuator(
        name=f"stiffness_{joint}",
        target=joint,
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        gaintype=mujoco.mjtGain.mjGAIN_AFFINE,
        biastype=mujoco.mjtBias.mjBIAS_NONE,
    )
    spring.gainprm[:3] = (0.0, -1.0, -beta)
    drive = spec.add_actuator(name=f"drive_{joint}", target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    drive.set_to_motor()
