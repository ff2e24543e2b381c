"""Build the MuJoCo model of a body, and name its elements.

The planar body of the thesis (trunk, thighs, shanks, feet, toes), compiled from `Body` with `MjSpec`. World x is
forward and z up. Joint signs: hip and knee flexion, ankle dorsiflexion, toe-up and trunk-forward pitch positive.

Scaling: a body of height ratio l and mass ratio m (against 1.70 m, 63 kg) has lengths ~ l, stiffness and torque ~ m*l,
joint damping ~ m*l*sqrt(l), armature ~ m*l^2, contact time ~ sqrt(l); its gait at equal Froude speed is then the same
(Hof 1996, "Scaling gait data to body size").
"""

from math import sqrt

import mujoco
import numpy as np

from springfoot.arrays import NDArray
from springfoot.gait.body.body import GRAVITY, Body
from springfoot.gait.body.leg_dynamics import JOINTS

from .contact import CONTACTS, FRICTION, add_sphere, add_touch, contact_offsets, geom_name, ground_name
from .foot import INTACT, SOUND, Feet, Foot, FootJoint, Spring, act_one_way, leg_segments, torque_range
from .scene import DEVICE, FLESH, add_scene, bone, box
from .timing import PHYSICS_STEP

SIDES = ("left", "right")
BASE = ("x", "z", "pitch")
LEFT, RIGHT = range(2)
HIP, KNEE, ANKLE, TOE = range(4)
ACTIONS = tuple(f"{joint}_{side}" for side in SIDES for joint in ("ankle", "toe"))
"""Actions that set stiffness."""
MOVED = ("hip", "knee", "ankle")
"""Joints with rest angles that a person moves, the first of `JOINTS`."""
PERSON_ACTIONS = tuple(f"rest_{joint}_{side}" for side in SIDES for joint in MOVED)
"""Actions of a person: how far the rest angles are moved from those of the constants."""

DAMPING_TIME = (0.031, 0.0377, 0.02, 0.02)
"""beta [s] of tau = K (theta_eq - theta - beta dtheta/dt), in the order of `JOINTS`; scaled with sqrt(l).

Chosen, of the order of damping over stiffness in people's ankles in stance, 14 ms (0.016/1.14, 0.080/5.43: J. Medical
Devices 12 (2018) 011010, abstract), and in a powered prosthesis, 8-20 ms (Sup et al. 2009, Table III). Like the next
three constants it is varied in docs/results/cost.md.
"""
TORQUE_LIMIT = (200.0, 200.0, 200.0, 60.0)
"""Largest actuator torque [N m] at 1.70 m and 63 kg, in the order of `JOINTS`.

Chosen above the torques of walking: `pretrained` reaches 57, 43, 83 and 24 N m in 20 episodes of 20 s.
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
"""Stops of the joints [deg], in the order of `JOINTS`; chosen: walking on sound feet never reaches them
(docs/results/cost.md)."""

_SIGN_AXIS = {"hip": -1.0, "knee": 1.0, "ankle": -1.0, "toe": -1.0}  # about +y a vector turns from z to x


def actions_of(acts: str) -> tuple[str, ...]:
    """Return the names of the actions with the setting `acts`, those of the stiffness first."""
    return ACTIONS * (acts != "person") + PERSON_ACTIONS * (acts != "stiffness")


def damping_times(body: Body) -> np.ndarray:
    """Return beta [s] of each joint in the order of `JOINTS`, shape (4,)."""
    return np.array(DAMPING_TIME) * sqrt(body.length_scale)


def torque_limits(body: Body) -> np.ndarray:
    """Return the largest actuator torque [N m] of each joint in the order of `JOINTS`, shape (4,)."""
    return np.array(TORQUE_LIMIT) * body.strength_scale


def joints_of(foot: Foot) -> tuple[FootJoint, ...]:
    """Return the four joints of the leg that ends in `foot`, in the order of `JOINTS`; hip and knee have muscles as a
    sound ankle has."""
    return INTACT.ankle, INTACT.ankle, *foot.joints


def damping_times_of(body: Body, feet: Feet) -> NDArray:
    """Return beta [s] of the actuators of both legs, (side, joint): a device's own, else that of muscles."""
    of_muscles = damping_times(body)
    times = []
    for foot in feet:
        of_devices = [joint.device and joint.device.damping_time for joint in joints_of(foot)]  # None for muscles
        times.append([usual if time is None else time for usual, time in zip(of_muscles, of_devices, strict=True)])
    return np.array(times, float)


def torque_ranges(body: Body, feet: Feet) -> NDArray:
    """Return the lowest and highest torque [N m] of the actuators of both legs, (side, joint, 2)."""
    limits = torque_limits(body).tolist()
    return np.array(
        [[torque_range(limit, joint) for limit, joint in zip(limits, joints_of(foot), strict=True)] for foot in feet]
    )


def springs_of(model: mujoco.MjModel) -> tuple[NDArray, NDArray]:
    """Return two arrays for the actuators of a compiled model: beta [s], (side, joint), and lowest and highest torque
    [N m], (side, joint, 2), infinite for a joint without limits."""
    legs = (len(SIDES), len(JOINTS))
    names = [f"{joint}_{side}" for side in SIDES for joint in JOINTS]
    beta = [-model.actuator(f"stiffness_{name}").gainprm[2] for name in names]
    joints = [model.joint(name).id for name in names]
    limited = model.jnt_actfrclimited[joints].astype(bool)
    limits = np.where(limited[:, None], model.jnt_actfrcrange[joints], [-np.inf, np.inf])
    return np.reshape(beta, legs), limits.reshape(*legs, 2)


def armatures_of(body: Body, feet: Feet) -> NDArray:
    """Return the armature of the joints of both legs [kg m^2], (side, joint): the sum of that of muscles, of a device
    and of an orthosis.

    Damped springs without an armature of their own have h K beta / 2, h the physics step: contacts would else give the
    body energy, as with `envs.physics.foot.LOCK`.
    """
    armature = np.array(ARMATURE) * body.mass_scale * body.length_scale**2 + np.zeros((len(SIDES), len(JOINTS)))
    usual = damping_times(body)
    for side, foot in enumerate(feet):
        for joint, described in enumerate(joints_of(foot)):
            if device := described.device:
                stiffest = device.steepest
                if foot.schedule and joint >= ANKLE:  # the device's stiffness is the schedule's
                    stiffest = max(
                        segment.stiffness for segment in (foot.schedule.ankle, foot.schedule.toe)[joint - ANKLE]
                    )
                own = device.armature
                armature[side, joint] += _inertia_for(device, stiffest, usual[joint]) if own is None else own
            orthosis = described.orthosis
            if orthosis and not orthosis.engages:  # one-way springs have no damping
                armature[side, joint] += _inertia_for(orthosis, orthosis.steepest, usual[joint])
    return armature


def _inertia_for(spring: Spring, stiffness: float, usual_time: float) -> float:
    """Return the armature h K beta / 2 [kg m^2] of a spring: h is the physics step, K its `stiffness` [N m/rad].

    beta is the spring's damping time, or `usual_time` [s] without one.
    """
    beta = usual_time if spring.damping_time is None else spring.damping_time
    return 0.5 * PHYSICS_STEP * stiffness * beta


def passive_damping(body: Body) -> np.ndarray:
    """Return joint damping [N m s/rad] in the order of `JOINTS`, shape (4,)."""
    return np.array(PASSIVE_DAMPING) * body.strength_scale * sqrt(body.length_scale)


def contact_material(body: Body, contact: NDArray, base: NDArray, angle: NDArray) -> NDArray:
    """Return the forward coordinate [m] of the sole's material at the contact points at T times, up to a constant:
    (T, side, contact).

    The coordinate changes when a foot slides and stays when its spheres roll: it is the contact point's own plus radius
    times the angle by which the sphere has turned back.

    Args:
        body: the body, for the radii of the spheres.
        contact: (T, side, contact, 2) lowest points of the spheres (x, z) [m].
        base: (T, 3) hip x, z [m] and trunk pitch [rad].
        angle: (T, side, joint) joint angles [rad].
    """
    foot = angle[..., HIP] - base[..., None, 2] - angle[..., KNEE] + angle[..., ANKLE]  # toes up; base[2] is the pitch
    toe = foot + angle[..., TOE]
    turn = np.stack([foot, toe, toe], axis=-1)  # the heel turns with the foot, ball and tip with the toe
    return contact[..., 0] + turn * [radius for *_, radius in contact_offsets(body).values()]


def build_spec(
    body: Body, friction: float = FRICTION, feet: Feet = SOUND, *, one_way: bool = False, loaded: bool = False
) -> mujoco.MjSpec:
    """Return the model's specification: 11 degrees of freedom, 16 actuators (stiffness, drive per joint), 6 force
    sensors.

    Either foot has a ground of its own, a plane that is moved from outside (mocap). With `one_way`, or an orthosis that
    acts one way, ankles and toes have a tendon each, slack where there is no such spring; with `loaded`, or a load, the
    trunk has a box, without mass and unseen where there is no load: in a batch all models have them, or none.
    """
    length = body.length_scale
    mass = body.mass_scale
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
    add_scene(spec)

    world = spec.worldbody
    trunk = _segment(world, "trunk", (0, 0, 0), body.trunk_mass, (0, body.trunk_com_above_hip), body.trunk_inertia)
    slide = mujoco.mjtJoint.mjJNT_SLIDE
    hinge = mujoco.mjtJoint.mjJNT_HINGE
    for name, kind, axis in zip(BASE, (slide, slide, hinge), ((1, 0, 0), (0, 0, 1), (0, 1, 0)), strict=True):
        trunk.add_joint(name=name, type=kind, axis=axis)
    trunk.add_camera(
        name="track",
        pos=(0, -2.6 * length, -0.1 * length),
        xyaxes=(1, 0, 0, 0, 0, 1),
        mode=mujoco.mjtCamLight.mjCAMLIGHT_TRACKCOM,
    )
    bone(trunk, (0, 0.0), (0, body.trunk_length), 0.07 * length, 0.0)
    if loaded or body.carried_ratio:
        _load(trunk, body)
    for index, side in enumerate(SIDES):
        _leg(trunk, body, side, feet, hip_y=(0.09 if index == LEFT else -0.09) * length)
    for side, foot in zip(SIDES, feet, strict=True):
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
            if contact != "ball" or not foot.one_piece:
                add_touch(spec, contact, side, body, friction)
    for side, times in zip(SIDES, damping_times_of(body, feet), strict=True):
        for joint, beta in zip(JOINTS, times, strict=True):
            _add_spring(spec, f"{joint}_{side}", float(beta))
    if one_way or act_one_way(feet):
        for side, foot in zip(SIDES, feet, strict=True):
            for name, joint in zip(JOINTS[ANKLE:], foot.joints, strict=True):
                _add_tendon(spec, f"{name}_{side}", joint.orthosis)
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


def build_model(
    body: Body, friction: float = FRICTION, feet: Feet = SOUND, *, one_way: bool = False, loaded: bool = False
) -> mujoco.MjModel:
    """Return the compiled model of `body` with these feet, as `build_spec` says."""
    spec = build_spec(body, friction, feet, one_way=one_way, loaded=loaded)
    spec.compiler.usethread = False  # on busy cores threads start ten times later than this compiles
    return spec.compile()


def _load(trunk: "mujoco.MjsBody", body: Body) -> None:
    """Add the body's load, fixed to the trunk: a box on the back, or a belt around the waist."""
    forward, up = body.carried_com
    load = _segment(trunk, "load", (forward, 0, up), body.carried_mass, (0, 0), body.carried_inertia)
    half_lengths = {"back": (0.075, 0.15, 0.25), "waist": (0.13, 0.17, 0.05)}  # forward, sideways, up
    size = np.array(half_lengths[body.carried_at]) * body.length_scale
    box(load, size, visible=body.carried_ratio > 0.0)


def _leg(trunk: "mujoco.MjsBody", body: Body, side: str, feet: Feet, hip_y: float) -> None:
    """Add the leg of `side` below the trunk; its lateral offset `hip_y` [m] is for the eye alone (the body is
    planar)."""
    shade = 0.15 if side == "left" else 0.0
    thin = 0.035 * body.length_scale
    drop = body.ankle_height - body.toe_joint_height
    positions = (
        (0, hip_y, 0),
        (0, 0, -body.thigh_length),
        (0, 0, -body.shank_length),
        (body.ankle_to_toe_joint, 0, -drop),
    )
    worn = feet[SIDES.index(side)]
    leg = leg_segments(body, worn)
    segments = []
    parent = trunk
    colour = FLESH if worn.kind == "intact" else DEVICE
    for index, (name, position) in enumerate(zip(("thigh", "shank", "foot", "toe"), positions, strict=True)):
        parent = _segment(parent, f"{name}_{side}", position, leg.mass[index], leg.com[index], leg.inertia[index])
        _hinge(parent, side, index, body, feet)
        segments.append(parent)
    thigh, shank, foot, toe = segments
    bone(thigh, (0, 0), (0, -body.thigh_length), 1.4 * thin, shade)
    bone(shank, (0, 0), (0, -body.shank_length), thin, shade)
    offsets = contact_offsets(body)
    add_sphere(foot, geom_name("heel", side), offsets["heel"])
    add_sphere(toe, geom_name("ball", side), offsets["ball"])
    add_sphere(toe, geom_name("toe", side), offsets["toe"])
    bone(foot, offsets["heel"][:2], (body.ankle_to_toe_joint, -drop), 0.6 * thin, shade, colour)
    bone(foot, (0, 0), (body.ankle_to_toe_joint, -drop), 0.6 * thin, shade, colour)
    bone(toe, (0, 0), offsets["toe"][:2], 0.5 * thin, shade, colour)


def _segment(
    parent: "mujoco.MjsBody",
    name: str,
    pos: tuple[float, float, float],
    mass: float,
    com: tuple[float, float],
    inertia: float,
) -> "mujoco.MjsBody":
    """Add a rigid segment to `parent` at `pos` (3,) [m], and return it.

    `mass` [kg]; `com` forward and up in its own frame [m]; `inertia` about the CoM [kg m^2].
    """
    segment = parent.add_body(name=name, pos=pos)
    segment.explicitinertial = True
    segment.mass = mass
    segment.ipos = (com[0], 0.0, com[1])
    segment.inertia = (inertia, inertia, inertia)  # only the sagittal one acts
    return segment


def _hinge(segment: "mujoco.MjsBody", side: str, index: int, body: Body, feet: Feet) -> None:
    """Hang a segment of a leg on its joint, number `index` of `JOINTS`.

    The joint has the torque limits, damping, armature and stops of that leg, and its orthosis, if that acts both ways.
    """
    which = SIDES.index(side)
    low, high = torque_ranges(body, feet)[which, index].tolist()
    joint = JOINTS[index]
    damping = float(passive_damping(body)[index])
    hinge = segment.add_joint(
        name=f"{joint}_{side}",
        type=mujoco.mjtJoint.mjJNT_HINGE,
        axis=(0, _SIGN_AXIS[joint], 0),
        armature=float(armatures_of(body, feet)[which, index]),
        damping=damping,
        limited=True,
        range=tuple(np.deg2rad(JOINT_RANGE_DEG[index])),
        actfrclimited=np.isfinite(high),
        actfrcrange=(low, high) if np.isfinite(high) else (0.0, 0.0),
    )
    if (orthosis := joints_of(feet[which])[index].orthosis) and not orthosis.engages:
        time = orthosis.damping_time
        beta = float(damping_times(body)[index]) if time is None else time
        hinge.springref = orthosis.rest
        hinge.stiffness[0] = orthosis.stiffness
        hinge.damping[0] = damping + beta * orthosis.stiffness  # no higher powers


def _add_tendon(spec: mujoco.MjSpec, joint: str, orthosis: Spring | None) -> None:
    """Add a tendon with the joint's angle as its length [rad], taut where an orthosis that acts one way engages.

    Without such an orthosis it is slack at any angle.
    """
    tendon = spec.add_tendon(name=f"orthosis_{joint}")
    tendon.wrap_joint(joint, 1.0)
    if orthosis and orthosis.engages:
        tendon.stiffness[0] = orthosis.stiffness  # no higher powers
        tendon.springlength = orthosis.slack


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
