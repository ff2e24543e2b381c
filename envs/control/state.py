"""Define the control's row of each environment, `CONTROL_ROW`, which its kernels read and write."""

import numpy as np

from ..physics.model import ACTIONS, JOINTS, MOVED, SIDES
from ..physics.timing import CONTROL_WINDOW
from ..settings.settings import LONGEST_DELAY

FEET = (len(SIDES), 2)
"""Shape of values of each ankle and toe; flattened, they are in the order of `ACTIONS`."""

PLACE = np.dtype([("row", np.int64), ("weight", float)])
"""Position of an environment in a table of several rows: between `row` and the next one, which has `weight` in [0,
1)."""
SCALE = np.dtype([("length", float), ("time", float), ("mass", float), ("torque", float)])
"""Ratios of a body to the settings' body: of heights; its square root, that of times and speeds; of masses; and of mass
x height, that of torque and stiffness."""
SUBJECT = np.dtype(
    [
        ("height", float),  # of the body [m]
        ("mass", float),  # [kg]
        ("place", PLACE),
        ("scale", SCALE),
        ("speed", float),  # commanded now [m/s]
        ("target", float),  # to which the commanded speed goes [m/s]
        ("change", float),  # time in the episode at which the next target is drawn [s]
        ("slope", float),  # of the ground [rad], uphill positive
    ]
)
"""Body, speed and slope of one environment (`envs.control.subjects`)."""
DECISION = np.dtype(
    [
        ("stage", np.int64, len(SIDES)),  # number of events since heel strike when each leg decided last, -1 for none
        ("action", float, len(ACTIONS)),  # that takes effect, in [-1, 1]
        ("last_action", float, len(ACTIONS)),  # that of the step before
    ]
)
"""The actions of one environment (`envs.control.decision_times`)."""
STIFFNESS_SOURCE = np.dtype(
    [
        ("not_action", np.int64),  # 1 where others than the action set the stiffness
        ("scheduled", np.int64),  # then: 1 for a factor on the schedule, 0 for a stiffness within the ranges
        ("anew", np.int64),  # 1 if it is drawn anew in every step
        ("drawn", float, len(ACTIONS)),  # in place of the action, as the action mode of `scheduled` reads it
    ]
)
"""Source of the stiffness of one environment (`envs.control.stiffness_source`)."""
PERSON = np.dtype(
    [
        ("offset", float, (len(SIDES), len(MOVED))),  # of the rest angles of hip, knee and ankle [rad]
        ("last_offset", float, (len(SIDES), len(MOVED))),  # that of the step before [rad]
        ("aim", float),  # speed that it aims at beyond the commanded one [m/s]
        ("aim_rate", float),  # at which it aims beyond it while it walks too slowly [1/s]
    ]
)
"""The person of one environment (`envs.control.person_actions`)."""
FOOT = np.dtype(
    [
        ("controlled", np.int64, FEET),  # 1 where actions set the stiffness; others are read as 0
        ("muscles", np.int64, FEET),  # 1 where the body itself sets the stiffness, 0 where a device is in its place
        ("in_swing", np.int64, FEET),  # 1 where muscles act in swing too
        ("rests", np.int64, FEET),  # 1 where the rest angle is the foot's own, whatever is planned
        ("rest", float, FEET),  # that angle, a device's as well [rad]
        ("stiffness", float, FEET),  # of a device [N m/rad], 0 where there is none
        ("line", np.int64, FEET),  # number of the device's torque-angle line in `FootLines`, -1 for none
        ("curve", np.int64, len(SIDES)),  # number of the devices' schedule there, -1 for none
        ("locked", np.int64, FEET),  # 1 where a device lets the joint not move
    ]
)
"""The ankles and toes of one environment: muscles and devices (`envs.control.stiffness_control`)."""
SPRING_STATE = np.dtype(
    [
        ("stiffness", float, FEET),  # K of the muscles [N m/rad]
        ("taut", float, FEET),  # 1 while they act, 0 while they are slack
        ("device", float, FEET),  # K of a device in their place [N m/rad]
        ("equilibrium", float, FEET),  # rest angle [rad]
        ("work_stiffness", float, FEET),  # done by the last change of stiffness [J]
        ("work_equilibrium", float, FEET),  # done by moving the rest angle since that change [J]
        ("rest_phase", float, len(SIDES)),  # stride phases of the rest angles that hold
        ("fresh", np.int64),  # 1 until the first window of an episode: setting the springs then does no work
        ("delay", np.int64),  # control windows from the request of a stiffness until it acts
        ("requests", float, (1 + round(LONGEST_DELAY / CONTROL_WINDOW), *FEET)),  # in the last windows, newest first
    ]
)
"""The ankle and toe springs of one environment (`envs.control.stiffness_control`)."""
GAINS = np.dtype(
    [
        ("touchdown", float),  # vertical force of a foot that has landed [N]
        ("rate", float),  # advance of the phase in one window
        ("rate_gain", float),  # share by which it rises for each m/s too fast [s/m]
        ("pitch", float),  # held trunk pitch [rad]
        ("trunk_stiffness", float),  # [N m/rad]
        ("trunk_damping", float),  # [N m s/rad]
        ("speed_torque", float),  # [N s]
        ("swing_gain", float),  # [rad s/m]
    ]
)
"""Constants of one body's legs, scaled to it."""
LEGS = np.dtype(
    [
        ("gains", GAINS),
        ("phase", float, len(SIDES)),  # of each leg's stride in [0, 1), 0 at its heel strike
        ("planned_speed", float),  # the planned CoM's forward speed over its mean, as the window began [-]
    ]
)
"""The legs of one environment (`envs.control.legs`)."""
HELD = np.dtype(
    [
        ("mode", np.int64),  # see `Standing.mode`
        ("begin", float),  # time at which the body begins to lean; once it walks, time at which it began to [s]
        ("place", float),  # where the CoM is held, ahead of mid-way between the ankles [m]
        ("pitch", float),  # pitch at which the trunk is held [rad]
        ("draw", float),  # shift of the hips' rest angles that brings the legs together [rad]
        ("rest", float, (len(SIDES), len(JOINTS))),  # rest angles [rad], those of the hips for an upright trunk
        ("length", float),  # ratio of the height to 1.70 m
        ("time", float),  # square root of that
        ("torque", float),  # ratio of mass x height to that of 63 kg and 1.70 m
    ]
)
"""Springs of one body that hold it while it stands (`envs.control.standing`)."""
CONTROL_ROW = np.dtype(
    [
        ("subject", SUBJECT),
        ("decision", DECISION),
        ("source", STIFFNESS_SOURCE),
        ("person", PERSON),
        ("feet", FOOT),
        ("springs", SPRING_STATE),
        ("legs", LEGS),
        ("held", HELD),
    ]
)
