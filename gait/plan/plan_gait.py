"""Describe a plan as a gait: the plan's angles, moments and forces replace people's, as a target to follow."""

import numpy as np

from springfoot.arrays import NDArray

from ..body.body import ANGLES, GRAVITY
from ..body.leg_dynamics import JOINTS, LEG_SEGMENTS, inverse_dynamics
from ..people.human import HARMONICS, FootHabits, HumanGait, stance_coefficients
from .kinetics import foot_force, planned_leg
from .plan import WalkPlan

SERIES_SAMPLES = 400
"""Samples of the stride for series; chosen."""
RAMP = 0.06
"""Stride phase over which the schedule of K goes from one phase of stance to the next; chosen."""
FLAT_SHARE = 0.5
"""End of early stance, as a fraction of the time from foot flat to heel-off; chosen."""
SWING_END = 0.95
"""Stride phase at which K of swing starts to become that of loading; chosen, as in `fit_human.SPRING_HABITS`."""


def gait_of(plan: WalkPlan) -> HumanGait:
    """Return the gait of a plan, computed from body, plan and inverse dynamics alone.

    Curves are Fourier series with as many terms as people's. Moments [N m/kg at 1.70 m] and powers are normalised as
    people's. The spread is 0: a plan has none.
    """
    body = plan.body
    phase = np.arange(SERIES_SAMPLES) / SERIES_SAMPLES
    motion, load = planned_leg(plan, phase)
    dynamics = inverse_dynamics(body, motion, load, plan.slope)
    angles = plan.joint_angles(phase)
    thigh, shank, foot, toe = np.moveaxis(motion.rate, -1, 0)
    rates = {"hip": thigh, "knee": thigh - shank, "ankle": foot - shank, "toe": toe - foot}  # of the joints
    mean = {name: _fourier_coefficients(angles[name]) for name in ANGLES} | {
        "hip": _fourier_coefficients(motion.turn[:, LEG_SEGMENTS.index("thigh")])  # the pelvis does not turn
    }
    unit = body.total_mass * body.length_scale  # [N m] of 1 N m/kg at 1.70 m
    for joint in JOINTS:
        mean[f"{joint}_moment"] = _fourier_coefficients(dynamics.moment[joint] / unit)
        mean[f"{joint}_power"] = _fourier_coefficients(-dynamics.moment[joint] * rates[joint] / body.total_mass)
    force, _ = foot_force(plan, phase)
    force = force / (body.total_mass * GRAVITY)
    toe_off = plan.feet.toe_off
    mean["grf_forward"], mean["grf_vertical"] = (
        stance_coefficients(force[:, axis], phase, toe_off) for axis in range(2)
    )
    return HumanGait(
        speed=plan.speed,
        condition="plan",
        clamped=False,
        stride_time=plan.stride_time,
        step_length=plan.step_length,
        toe_off=toe_off,
        mean_series=mean,
        sd_series={name: np.zeros_like(series) for name, series in mean.items()},
        foot=_foot_habits(plan),
    )


def _foot_habits(plan: WalkPlan) -> FootHabits:
    """Return the phases at which rest angles and scheduled K change, set by the plan's events of the foot.

    People's quasi-stiffness has no part in a plan (None).
    """
    feet = plan.feet
    flat = feet.foot_flat
    heel_off = feet.heel_off
    toe_off = feet.toe_off
    mid_stance = flat + FLAT_SHARE * (heel_off - flat)
    # Late stance must not end before it starts, however early the heel rises.
    push_off = max(heel_off, mid_stance + 2 * RAMP)
    plateaus = (
        *(0.0, flat),  # start and end of loading
        *(flat + RAMP, mid_stance),  # of early stance
        *(mid_stance + RAMP, push_off),  # of late stance
        *(push_off + RAMP, toe_off),  # of push-off
        *(toe_off + RAMP, SWING_END),  # of swing
    )
    toe_swing_deg = 0.0 if feet.style.toe_swing is None else float(np.degrees(feet.style.toe_swing))
    return FootHabits(
        plateaus=plateaus,
        ankle_quasi_stiffness=None,
        toe_flat=(0.0, flat),
        toe_off=(toe_off, toe_off + RAMP),
        toe_swing_deg=toe_swing_deg,
    )


def _fourier_coefficients(values: NDArray) -> NDArray:
    """Return (HARMONICS + 1,) complex Fourier coefficients of evenly spaced samples of a stride."""
    series = np.fft.rfft(values)[: HARMONICS + 1] / len(values)
    series[1:] *= 2  # each term stands for its negative frequency too, the mean for itself
    return series
