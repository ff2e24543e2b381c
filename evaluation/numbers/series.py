"""Find the strides of one recorded episode, and compute their curves over percent of the stride.

Human-facing edge: angles in degrees, forces in body weights (BW), moments in N m/kg.
"""

import numpy as np

from springfoot.arrays import NDArray
from springfoot.envs.physics.model import ANKLE, HIP, KNEE, SIDES, TOE
from springfoot.gait import GRAVITY, Body
from springfoot.gait.people.gait_events import CONTACT_THRESHOLD_BW, Contacts, find_contacts, on_percent

from ..recording.recording import TICK

GAIT_CYCLE_COLUMNS = (
    "hip_flexion_deg",
    "knee_flexion_deg",
    "ankle_dorsiflexion_deg",
    "pelvis_anterior_tilt_deg",
    "thigh_flexion_deg",
    "shank_pitch_deg",
    "foot_pitch_deg",
    "hip_moment_Nm_per_kg",
    "knee_moment_Nm_per_kg",
    "ankle_moment_Nm_per_kg",
    "hip_power_W_per_kg",
    "knee_power_W_per_kg",
    "ankle_power_W_per_kg",
    "grf_vertical_bw",
    "grf_forward_bw",
    "mtp_dorsiflexion_deg",
    "mtp_moment_Nm_per_kg",
    "ankle_stiffness_Nm_per_rad",
    "toe_stiffness_Nm_per_rad",
    "ankle_equilibrium_deg",
    "mtp_equilibrium_deg",
)
"""Columns of gait_cycle.csv. Hip: thigh to trunk; shank pitch: foot ahead; foot pitch: toes up. Moments are internal
(actuator and joint damping), hip and knee extension, ankle and toe (mtp) plantarflexion positive; power: generation."""


def foot_contacts(vertical: NDArray, body: Body) -> list[Contacts]:
    """Return heel strikes and toe-offs of the left and of the right foot [s], from their vertical force (T, side)
    [N]."""
    threshold = CONTACT_THRESHOLD_BW * body.mass * GRAVITY
    # Forces and moments are means over a tick, so they belong to its middle; states to its end.
    return [find_contacts(vertical[:, side], TICK, threshold, first=TICK / 2) for side in range(len(SIDES))]


def mean_speed(com: NDArray, first: int, last: int) -> float:
    """Return the mean forward speed of the CoM (T, 2) in the ticks from `first` up to `last` [m/s]."""
    return distance_walked(com, first, last) / ((last - first) * TICK)


def distance_walked(com: NDArray, first: int, last: int) -> float:
    """Return the forward distance of the CoM (T, 2) in the ticks from `first`, 1 or later, up to `last` [m]."""
    return float(com[last - 1, 0] - com[first - 1, 0])


def strides_within(foot: Contacts, steady: tuple[float, float]) -> NDArray:
    """Return (S, 3) heel strike, toe-off and next heel strike [s] of a foot's complete strides in the time `steady`,
    from and to [s]."""
    begin, end = steady
    strides = foot.strides(after=begin)
    next_heel_strike = strides[:, 2]
    return strides[next_heel_strike <= end]


def stride_curves(series: dict[str, NDArray], side: int, body: Body, strides: NDArray) -> NDArray:
    """Return one leg's curves over percent of its strides, (S, 101, C) in the order of `GAIT_CYCLE_COLUMNS`.

    `series` are those of one episode, `side` is 0 left, 1 right, `strides` (S, 3) as in `strides_within`. Curves are
    interpolated between the 100 Hz samples.
    """
    begin, _, end = strides.T
    return np.concatenate(
        [
            on_percent(_state_curves(series, side), begin, end, TICK, first=TICK),
            on_percent(_mean_curves(series, side, body), begin, end, TICK, first=TICK / 2),
        ],
        axis=-1,
    )[..., _ORDER]


def mid_tick(state: NDArray) -> NDArray:
    """Return a state at the middles of ticks, from its values at their ends (T, ...); the first stays as it is."""
    return np.concatenate([state[:1], 0.5 * (state[1:] + state[:-1])])


def _state_curves(series: dict[str, NDArray], side: int) -> NDArray:
    """Return the curves of the leg `side` that are states at the end of each of T ticks, (T, C) in the order of
    `_STATES`."""
    angle = np.degrees(series["angle"][:, side])
    pitch = np.degrees(series["base"][:, 2])  # of the trunk
    thigh = angle[:, HIP] - pitch
    shank = thigh - angle[:, KNEE]
    equilibrium = np.degrees(series["equilibrium"][:, side])
    return np.column_stack(
        [
            *(angle[:, joint] for joint in (HIP, KNEE, ANKLE)),
            pitch,
            thigh,
            shank,
            shank + angle[:, ANKLE],  # pitch of the foot
            angle[:, TOE],
            series["stiffness"][:, side],
            equilibrium,
        ]
    )


def _mean_curves(series: dict[str, NDArray], side: int, body: Body) -> NDArray:
    """Return the curves of the leg `side` that are means over each of T ticks, (T, C) in the order of `_MEANS`."""
    forward, vertical = series["force"][:, side].sum(axis=1).T / (body.mass * GRAVITY)
    moment = -series["joint_torque"][:, side] / body.mass  # internal: extension and plantarflexion positive
    power = series["joint_work"][:, side].sum(axis=-1) / TICK / body.mass  # positive and negative work together
    return np.column_stack([vertical, forward, moment, power[:, :TOE]])  # no power of the toe


# Columns by the function that computes them, and the order that brings them into that of `GAIT_CYCLE_COLUMNS`.
_MEANS = (
    *("grf_vertical_bw", "grf_forward_bw"),
    *(f"{joint}_moment_Nm_per_kg" for joint in ("hip", "knee", "ankle", "mtp")),
    *(f"{joint}_power_W_per_kg" for joint in ("hip", "knee", "ankle")),
)
_STATES = tuple(name for name in GAIT_CYCLE_COLUMNS if name not in _MEANS)
_ORDER = [(_STATES + _MEANS).index(name) for name in GAIT_CYCLE_COLUMNS]
