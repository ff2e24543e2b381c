"""Define the task's row of each environment, `TASK_ROW`, which its kernels read and write."""

import numpy as np

from ..physics.contact import CONTACTS
from ..physics.model import JOINTS, SIDES
from .observation_entries import OBSERVATION, UNITS
from .scales import SCALES
from .worn import WORN

PUSH = np.dtype([("begin", float), ("force", float), ("ends", float)])
"""Next or present push of a body: its beginning [s], its force at the mass of the settings [N], and the end of its
interval [s]."""
GROUND_STATE = np.dtype(
    [
        ("height", float, len(SIDES)),  # below each foot above the mean ground [m]
        ("phase", float, len(SIDES)),  # stride phase of each leg one control window ago
    ]
)
TASK_ROW = np.dtype(
    [
        ("scales", SCALES),
        ("units", float, len(UNITS)),  # of the observation, in the order of `UNITS` [SI]
        ("height_ratio", float),  # height over 1.70 m
        ("steps", np.int64),  # since the episode began
        ("force", float, (len(SIDES), len(CONTACTS), 2)),  # (forward, up) on each contact, mean over the last step [N]
        ("worn", float, WORN),  # of the observation: the person's knowledge of body and feet
        ("mean_speed", float),  # of the CoM, over `HELD_SECONDS` before the last step [m/s]
        ("velocity", float, (len(SIDES), len(JOINTS))),  # of the joints at the last step's end [rad/s]
        ("left_phase", float),  # stride phase of the left leg at the last step's end
        ("landed", float),  # x of the ankle at the last touchdown [m], infinite before the first
        ("step_error", float),  # difference of the last step's length and the planned one, over that; 0 before a step
        ("push", PUSH),
        ("ground", GROUND_STATE),
        ("noise", float, len(OBSERVATION)),  # on the observation, in its own units
    ]
)
