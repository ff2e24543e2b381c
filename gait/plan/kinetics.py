"""Compute forces and joint moments of a walk: equations (2) and (3), the load on each foot, inverse dynamics of a plan.

Frame, signs and the mechanics of one leg are those of `leg.py`, which takes any trajectory.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError

from ..body.body import Body, gravity
from ..body.leg_dynamics import (
    JOINTS,
    FootLoad,
    LegMotion,
    inverse_dynamics,
    load_at,
    motion_of,
    projection_moments,
    segment_turns,
)
from ..people.fourier import PLAN_HARMONICS, fourier_jet
from ..people.scores import correlation
from .plan import WalkPlan
from .posture import POSTURE_SAMPLES

ZMP_TOLERANCE = 1e-6
"""A ZMP up to this far outside the two centres of pressure is due to rounding [m]; chosen."""


@dataclass(frozen=True, kw_only=True)
class ProjectionError:
    """Difference between GRF projection and inverse dynamics at one joint, in stance or in swing."""

    joint: str
    part: Literal["stance", "swing"]
    rms: float
    """Root mean square of the difference [N m/kg]."""
    peak: float
    """Largest difference [N m/kg], positive."""
    r: float | None
    """Pearson's r of projection and inverse dynamics; None where one is constant: the projection is 0 in swing."""


def ground_reaction(mass: float, x_acceleration: ArrayLike, z_acceleration: ArrayLike, slope: float = 0.0) -> NDArray:
    """Return the force (..., 2) forward, up [N] on a body of `mass` [kg] from its CoM acceleration.

    It is m (a - g), equation (2) of the thesis.

    On a `slope` [rad], uphill positive, forward is along the ground and up at right angles to it.
    """
    acceleration = np.stack(np.broadcast_arrays(x_acceleration, z_acceleration), -1)
    return mass * (acceleration - gravity(slope))


def share_forces(force: NDArray, com: NDArray, rear_cop: ArrayLike, front_cop: ArrayLike) -> tuple[NDArray, NDArray]:
    """Divide the total ground reaction between two feet: return forces (..., 2) [N] on the rear and front foot.

    `force` (..., 2) [N] acts through the CoM `com` (..., 2) [m], so that it meets the ground at the ZMP p. Each foot's
    force points from its centre of pressure, p1 and p2 [m], through the CoM; its upward part is (p2 - p)/(p2 - p1) of
    the total on the rear foot, the rest on the front foot. The two forces then add up to `force` at p exactly. In steps
    shorter than a foot p1 may lie ahead of p2. Raises `SpringfootError` if a foot would have to pull: for a ZMP that is
    not between p1 and p2, or a force that does not point up.
    """
    forward, up = np.moveaxis(force, -1, 0)
    com_x, com_z = np.moveaxis(com, -1, 0)
    if not np.all(up > 0):
        raise SpringfootError("the ground can only push: the upward force must be > 0 N")
    zmp = com_x - com_z * forward / up
    rear = np.asarray(rear_cop)
    front = np.asarray(front_cop)
    outside = float(np.max(np.maximum(np.minimum(rear, front) - zmp, zmp - np.maximum(rear, front)), initial=0.0))
    if not outside <= ZMP_TOLERANCE:
        raise SpringfootError(
            f"ZMP must lie between the centres of pressure of the feet, is outside by {outside:.4f} m"
        )
    # Where both centres coincide, a small distance avoids 0 / 0.
    cop_distance = np.where(front == rear, ZMP_TOLERANCE, front - rear)
    on_front = np.clip((zmp - rear) / cop_distance, 0.0, 1.0) * up  # upward part [N]

    def towards_com(upward: NDArray, cop: NDArray) -> NDArray:
        """Return the force with this upward part that points from `cop` to the CoM."""
        return np.stack([upward * (com_x - cop) / com_z, upward], -1)

    return towards_com(up - on_front, rear), towards_com(on_front, front)


def foot_force(plan: WalkPlan, stride_phase: ArrayLike) -> tuple[NDArray, NDArray]:
    """Return the ground reaction (..., 2) [N] on one foot of a plan, and its centre of pressure (...) [m], in that
    foot's frame.

    In single support the stance foot bears the whole force of equation (2) at the ZMP. In double support `share_forces`
    divides it. The front CoP waits at the heel until foot flat, and then moves to the ZMP's position at the other
    foot's toe-off. The rear CoP moves from the ZMP's position at heel strike to the tip of the toe, and waits there
    while the toe rolls over its tip. So the force of each foot starts and ends at zero. In swing the force is 0,
    and the CoP stays at the tip of the toe.

    In steps of about a foot's length the ZMP is ahead of the landed heel before the foot is flat. There the rear
    foot bears the whole force until foot flat, and both CoPs stand still while the load passes over.
    """
    phase = np.mod(np.asarray(stride_phase, float), 1.0)
    is_rear = phase >= 0.5  # in the second half of its stride this foot trails the other one
    step_phase = 2 * (phase - 0.5 * is_rear)
    pivot = np.stack(plan.pivot(step_phase), -1)
    force = ground_reaction(plan.body.total_mass, *plan.com_acceleration(step_phase), plan.slope)
    zmp = plan.zmp(step_phase)
    double_support = step_phase <= 2 * plan.feet.toe_off - 1  # up to the rear foot's toe-off, in phases of the step
    rear, front = _double_support_cops(plan, step_phase)
    # In single support the stance foot is the front foot and bears the whole force, at the ZMP; the rear foot, without
    # force, may then be anywhere, 1 m behind.
    front_cop = np.where(double_support, front, zmp)
    on_rear, on_front = share_forces(force, pivot, np.where(double_support, rear, zmp - 1.0), front_cop)
    # The rear foot swings after double support; its own frame is a step behind the front foot's.
    on_rear = np.where(double_support[..., None], on_rear, 0.0)
    tip = plan.body.ankle_to_toe_joint + plan.body.toe_length
    rear_cop = np.where(double_support, rear + plan.step_length, tip)
    return np.where(is_rear[..., None], on_rear, on_front), np.where(is_rear, rear_cop, front_cop)


def _double_support_cops(plan: WalkPlan, step_phase: NDArray) -> tuple[NDArray, NDArray]:
    """Return the centres of pressure [m] of the rear and the front foot in double support, in the front foot's
    frame."""
    body = plan.body
    # Events in step phases: foot flat, and the end of double support.
    flat = 2 * plan.feet.foot_flat
    end = 2 * plan.feet.toe_off - 1
    heel = plan.feet.flat_heel
    tip = body.ankle_to_toe_joint + body.toe_length - plan.step_length
    at_start, at_flat, at_end = (float(plan.zmp(event)) for event in (0.0, flat, end))
    if at_flat > heel or tip >= at_end:
        # A step of about a foot's length: the rear foot bears all until foot flat, then both centres stand still.
        return np.minimum(plan.zmp(step_phase), at_flat), np.where(step_phase < flat, heel, at_end)
    rolls = 2 * (plan.feet.toe_off - plan.feet.tip_off)  # duration of the rear toe's roll, in step phases
    rear = np.interp(step_phase, [0.0, end - rolls], [at_start, tip])
    landing, _ = plan.feet.on_ground(0.5 * np.minimum(step_phase, flat))  # before foot flat: the heel
    return rear, np.where(step_phase < flat, landing, np.interp(step_phase, [flat, end], [heel, at_end]))


def planned_leg(plan: WalkPlan, stride_phase: ArrayLike) -> tuple[LegMotion, FootLoad]:
    """Return motion and load of one leg of a plan over its stride, in the frame of its foot, for inverse dynamics.

    The plan is differentiated as a Fourier series of `PLAN_HARMONICS`; forces by `foot_force`.
    """
    phase = np.mod(np.asarray(stride_phase, float), 1.0)
    grid = np.arange(POSTURE_SAMPLES) / POSTURE_SAMPLES
    # The hip without its mean progress repeats every stride, so a Fourier series can differentiate it.
    progress = np.array([2 * plan.step_length, 0.0])  # (x, z) [m] a stride
    turns = segment_turns(plan.joint_angles(grid), plan.slope)
    hip = np.stack(plan.hip_position(grid), -1) - grid[:, None] * progress
    jet = fourier_jet(np.concatenate([turns, hip], -1), PLAN_HARMONICS, phase, plan.stride_time)
    # Columns 4 and 5 are the hip. The progress goes back into its place alone: `motion_of` takes no hip velocity.
    jet[0][..., 4:] += phase[..., None] * progress
    force, cop = foot_force(plan, phase)
    point = np.stack([cop, np.zeros(cop.shape)], -1)
    return motion_of(*jet), load_at(force, point, plan.toe_joint_position(phase)[0])


def planned_moments(plan: WalkPlan, stride_phase: ArrayLike) -> dict[str, NDArray]:
    """Return internal joint moments (...) [N m] of a plan at stride phases of any shape, by joint: inverse dynamics."""
    return inverse_dynamics(plan.body, *planned_leg(plan, stride_phase), plan.slope).moment


def projection_table(body: Body, motion: LegMotion, load: FootLoad, slope: float = 0.0) -> list[ProjectionError]:
    """Compare the GRF projection (Wells 1981) with inverse dynamics: per joint, in stance and in swing.

    Stance is where the ground bears on the foot. Give the leg of a plan as `planned_leg(plan, phase)`, and the plan's
    slope. Samples weigh alike, so take evenly spaced phases. A part without samples is left out.
    """
    projection = projection_moments(body, motion, load)
    dynamics = inverse_dynamics(body, motion, load, slope).moment
    stance = np.any(load.force != 0.0, axis=(-2, -1))
    rows = []
    parts: tuple[tuple[Literal["stance", "swing"], NDArray], ...] = (("stance", stance), ("swing", ~stance))
    for joint in JOINTS:
        for part, where in parts:
            projected = projection[joint][where] / body.mass
            exact = dynamics[joint][where] / body.mass
            if not len(projected):
                continue
            rows.append(
                ProjectionError(
                    joint=joint,
                    part=part,
                    rms=float(np.sqrt(np.mean((projected - exact) ** 2))),
                    peak=float(np.abs(projected - exact).max()),
                    r=correlation(projected, exact),
                )
            )
    return rows
