"""Repeat the thesis as printed, faults included: trajectories, forces, ZMP and joint torques of its appendix.

D. W. Nam, Numerical analysis of ZMP based biped walking model with different stiffness of ankle and toe joint, DGIST
2016. `ThesisWalk` gives its Figures 6 (`com`), 7 (`ankle`), 8 (`toe_joint`), 9 (`ground_reaction`) and 10 (`zmp`). The
corrected walk is `plan_walk`. Its program does not run as printed; `READINGS` says how each name was read.

Faults, and the methods that have them:
 CoM knots      ask for mean speeds of 1.67, 0.66 and 1.50 m/s within a step: a body weight fore and aft (`com_knots`).
 CoM height     is half a step out of phase: highest in double support (`com_height`).
 Toe joint      at heel strike lies 8 mm too near the ankle; its spline leaves the floor in stance (`toe_joint`).
 Ground force   is that of both feet: never shared, never 0 (`ground_reaction`), and turns the swing foot's joints too.
 ZMP            MATLAB's / between two rows is a least-squares quotient, one number, not a division (`zmp`).
 Joint torque   takes the sine of a sum of directions on top of r x F, and sin(1) of the height (`joint_torque`).
 Time axis      divides by 0.75 s, which it calls a cycle; the stride lasts 1.0 s (`normalised_time`).
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from math import cos, pi, sin
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError, require_count

from ..body.body import Body

Interpolation = Literal["line and sine", "not-a-knot", "least-squares cubic"]
Division = Literal["elementwise", "matrix"]
Joint = Literal["ankle", "toe"]

GRAVITY = 9.8
"""The thesis's acceleration of gravity g [m/s^2]; `springfoot.gait.GRAVITY` is 9.81."""

READINGS = {
    "x_CoM_s, z_CoM_s": "the curves fitted to x_CoM, z_CoM, at t_CoM",
    "xtt, ztt": "their second derivatives at t_CoM, columns as cftool's differentiate gives them",
    "p_x_vec": "p_x_vec_mod",
    "grf_horz": "grf_horz_mod",
    "grf_vert": "grf_vert_mod",
    "l_ft (appendix)": "ankle to toe joint, 0.1037 m; in Table 1 the same symbol is heel to toe joint, 0.1904 m",
    "l_ff (section 2.3, toe joint)": "the appendix's l_ft; in Table 1 it is ankle to toe tip, 0.1717 m",
    "l_ab (section 2.3)": "l_bf; where x at heel strike differs (no l_an sin q_f there), the appendix holds",
}
"""Name in the thesis -> its reading here."""


def table_1(body: Body | None = None) -> dict[str, float]:
    """Return Table 1: symbol -> length [m] for `body`, 1.70 m unless given. Printed: shank and thigh 0.417 for
    0.4165."""
    body = body or Body()
    return {
        "l_foot": body.foot_length,
        "l_toe": body.toe_length,
        "l_bf": body.heel_to_ankle,
        "l_ff": body.ankle_to_toe_joint + body.toe_length,
        "l_ft": body.heel_to_ankle + body.ankle_to_toe_joint,
        "l_ankle": body.ankle_height,
        "l_shank": body.shank_length,
        "l_thigh": body.thigh_length,
    }


class _Course(NamedTuple):
    """A course along x as functions of time [s]."""

    position: Callable[[Any], Any]
    """[m]."""
    acceleration: Callable[[Any], Any]
    """[m/s^2]."""


@dataclass(frozen=True, kw_only=True)
class ThesisWalk:
    """One and a half steps as the appendix computes them, of one foot and the CoM; times absolute [s].

    x [m] forward from the ankle's place at step 0, z [m] up from the floor. From k T_c to k T_c + T_d this foot ends
    its stance at k D_s beside the other one at (k+1) D_s; at (k+1) T_c its heel strikes near (k+2) D_s. Times of any
    shape within [k T_c, (k+1) T_c + T_m]. Raises `SpringfootError` for times outside and for unknown choices.
    """

    k: int = 1
    """Number of the step; the appendix computes k = 1."""
    interpolation: Interpolation = "line and sine"
    """Curve through the CoM's knots in x: Figure 6's line and sine, MATLAB's cubic spline, or a cubic polynomial."""
    division: Division = "elementwise"
    """ZMP by equation (1) as meant, or with the one quotient that the appendix's / yields ("matrix")."""
    body: Body = field(default_factory=Body)
    """Lengths and mass m; the thesis's unless given."""
    step_time: float = 0.5
    """T_c [s]: the walking period, heel strike to heel strike of the other foot."""
    double_support: float = 0.06
    """T_d [s]. With it stance is 56 % of the stride, against the thesis's own 62 %."""
    highest_ankle_time: float = 0.25
    """T_m [s]: time of the highest ankle."""
    step_length: float = 0.6
    """D_s [m]: length of a step."""
    com_ahead_at_end: float = 0.25
    """x_ed [m]: CoM ahead of the support ankle as single support ends."""
    com_behind_at_start: float = 0.25
    """x_sd [m]: CoM behind the support ankle as single support starts. Huang et al. 2001 search for both."""
    highest_ankle_forward: float = 0.4654
    """L_a0 [m]: distance of the highest ankle ahead of the ankle's last place."""
    highest_ankle_height: float = 0.14
    """H_a0 [m]: height of the highest ankle."""
    toe_off_pitch: float = 0.4
    """q_b [rad]: foot to ground at toe-off, heel up."""
    heel_strike_pitch: float = 0.13
    """q_f [rad]: foot to ground at heel strike, toes up."""

    def __post_init__(self) -> None:
        require_count("k", self.k, least=0)
        for name, choices in (("interpolation", Interpolation), ("division", Division)):
            if (choice := getattr(self, name)) not in get_args(choices):
                raise SpringfootError(f"{name} must be one of {', '.join(get_args(choices))}, got {choice!r}")

    # Knots, at k T_c, + T_d, + T_m, (k+1) T_c, + T_d, + T_m ---------------------------------------------------

    @property
    def knot_times(self) -> NDArray:
        """Times of all knots (6,) [s]: the thesis's t_CoM, t_foot, t_toe."""
        within = np.array([0.0, self.double_support, self.highest_ankle_time])
        return np.concatenate([self.k * self.step_time + within, (self.k + 1) * self.step_time + within])

    @property
    def com_knots(self) -> tuple[NDArray, NDArray]:
        """Knots of the CoM's path, x_CoM and z_CoM (6,) [m]; fault: mean speeds of 1.67, 0.66, 1.50 m/s between."""
        ahead = self.com_ahead_at_end
        behind = self.com_behind_at_start
        steps = self.step_length * (self.k + np.array([0, 1, 1, 1, 2, 2]))
        return steps + np.array([ahead, -behind, -0.5 * behind] * 2), self.com_height(self.knot_times)

    @property
    def ankle_knots(self) -> tuple[NDArray, NDArray]:
        """Knots of the ankle's path, x_foot_mod and z_foot_mod (6,) [m]; local names are the thesis's."""
        l_an = self.body.ankle_height
        l_bf = self.body.heel_to_ankle
        l_ft = self.body.ankle_to_toe_joint
        q_b = self.toe_off_pitch
        q_f = self.heel_strike_pitch
        steps = self.step_length * (self.k + np.array([0, 0, 0, 2, 2, 2]))
        toe_off = l_an * sin(q_b) + l_ft * (1 - cos(q_b))
        heel_strike = -l_an * sin(q_f) - l_bf * (1 - cos(q_f))
        return (
            steps + np.array([0, toe_off, self.highest_ankle_forward, heel_strike, 0, 0]),
            np.array(
                [
                    l_an,
                    l_ft * sin(q_b) + l_an * cos(q_b),
                    self.highest_ankle_height,
                    l_bf * sin(q_f) + l_an * cos(q_f),
                    l_an,
                    l_an,
                ]
            ),
        )

    @property
    def toe_joint_knots(self) -> tuple[NDArray, NDArray]:
        """Knots of the toe joint's path, x_toe_mod and z_toe_mod (6,) [m].

        Fault: l_an sin q_f belongs in the ankle's x at heel strike alone; the toe joint's is 8 mm short by it.
        """
        l_an = self.body.ankle_height
        l_bf = self.body.heel_to_ankle
        l_ft = self.body.ankle_to_toe_joint
        q_f = self.heel_strike_pitch
        steps = self.step_length * (self.k + np.array([0, 0, 0, 2, 2, 2]))
        heel_strike = -l_an * sin(q_f) - l_bf * (1 - cos(q_f)) + l_ft * cos(q_f)
        return (
            steps + np.array([l_ft, l_ft, self.highest_ankle_forward + l_ft, heel_strike, l_ft, l_ft]),
            np.array([0, 0, self.highest_ankle_height - l_an, (l_bf + l_ft) * sin(q_f), 0, 0]),
        )

    # Figures 6 to 10 -----------------------------------------------------------------------------------------

    def normalised_time(self, time: ArrayLike) -> NDArray:
        """Return t_nor_cyc, the figures' time axis. Fault: 1 is 0.75 s at k = 1, a step and a half, not a stride."""
        return (self._checked_time(time) - self.step_time) / (self.k * self.step_time + self.highest_ankle_time)

    def com_height(self, time: ArrayLike, derivative: int = 0) -> NDArray:
        """Return Z = 0.89 - 0.012 sin(4 pi (t - 2.62)) [m] or its rate. Fault: highest as double support begins."""
        rate = 4 * pi
        # Each derivative of a sine leads it by a quarter turn.
        wave = -0.012 * rate**derivative * np.sin(rate * (np.asarray(time) - 2.62) + derivative * pi / 2)
        return wave + 0.89 if derivative == 0 else wave

    def com(self, time: ArrayLike) -> tuple[NDArray, NDArray]:
        """Return Figure 6: CoM (x, z) [m]; passes its knots but for the least-squares cubic (by up to 46 mm)."""
        time = self._checked_time(time)
        return self._com_forward.position(time), self.com_height(time)

    def com_acceleration(self, time: ArrayLike) -> tuple[NDArray, NDArray]:
        """Return the acceleration of the CoM, xtt and ztt [m/s^2].

        Fault: the thesis calls the vertical one too small to matter in 2.2, and uses it in the appendix.
        """
        time = self._checked_time(time)
        return self._com_forward.acceleration(time), self.com_height(time, 2)

    def ankle(self, time: ArrayLike) -> tuple[NDArray, NDArray]:
        """Return Figure 7: ankle (x, z) [m], a not-a-knot cubic spline. Fault: sinks by 6 mm in stance."""
        x, z = np.moveaxis(self._splines["ankle"](self._checked_time(time)), -1, 0)
        return x, z

    def toe_joint(self, time: ArrayLike) -> tuple[NDArray, NDArray]:
        """Return Figure 8: toe joint (x, z) [m], splined likewise. Fault: 23 mm in the floor in stance."""
        x, z = np.moveaxis(self._splines["toe"](self._checked_time(time)), -1, 0)
        return x, z

    def ground_reaction(self, time: ArrayLike) -> tuple[NDArray, NDArray]:
        """Return Figure 9, equation (2): (grf_horz_mod, grf_vert_mod) [N]. Fault: of both feet, as one."""
        forward, up = self.com_acceleration(time)
        return self.body.mass * forward, self.body.mass * (GRAVITY + up)

    def zmp(self, time: ArrayLike) -> NDArray:
        """Return Figure 10, equation (1): p_x = x - z x'' / (z'' + g) [m], garbled in print.

        Fault: with `division="matrix"` the quotient is MATLAB's, sum(a b) / sum(b b) over the knots, a = z x'' and
        b = z'' + g. The ZMP is then the CoM shifted, which is why the thesis saw it follow the CoM.
        """
        x, _ = self.com(time)
        quotient_times = self.knot_times if self.division == "matrix" else time
        forward, up = self.com_acceleration(quotient_times)
        height = self.com_height(quotient_times)
        if self.division == "matrix":
            return x - (height * forward) @ (up + GRAVITY) / np.sum((up + GRAVITY) ** 2)
        return x - height * forward / (up + GRAVITY)

    # Joint torque --------------------------------------------------------------------------------------------

    def joint_torque(self, joint: Joint, time: ArrayLike) -> NDArray:
        """Return the joint torque as printed [N m], torque_ankle_mod or torque_toe_mod; plantarflexion positive.

        Faults: r x F is multiplied by the sine of the sum of the directions of r and F, though it holds the sine of
        their difference already. Its term with z is multiplied by sin(1), as the sine is taken of a row of ones too.
        The whole force turns this foot's joints even while the foot is in the air.
        """
        x, z = self._arm(joint, time)
        forward, up = self.ground_reaction(time)
        turn = (pi / 2 - np.arctan2(z, x)) + (pi / 2 - np.arctan2(up, forward))
        return sin(1) * z * forward - np.sin(turn) * x * up

    def cross_product(self, joint: Joint, time: ArrayLike) -> NDArray:
        """Return equation (3) as meant, r x F with r from ZMP to joint [N m]; plantarflexion positive."""
        x, z = self._arm(joint, time)
        forward, up = self.ground_reaction(time)
        return z * forward - x * up

    # Where the ZMP leaves the feet ---------------------------------------------------------------------------

    def support(self, time: ArrayLike) -> tuple[NDArray, NDArray]:
        """Rear and front end (x, x) [m] of the hull of the feet on the ground, each whole from heel to toe tip."""
        time = self._checked_time(time)
        heel_strike = (self.k + 1) * self.step_time
        trailing = time < heel_strike
        since = time - np.where(trailing, self.k * self.step_time, heel_strike)
        both = since <= self.double_support
        front = self.step_length * np.where(trailing, self.k + 1, self.k + 2)
        rear = front - np.where(both, self.step_length, 0.0)
        lengths = table_1(self.body)
        return rear - lengths["l_bf"], front + lengths["l_ff"]

    def zmp_outside(self, time: ArrayLike) -> NDArray:
        """Return the distance of the ZMP ahead of the feet on the ground (positive) or behind them [m], else 0."""
        zmp = self.zmp(time)
        rear, front = self.support(time)
        return np.maximum(zmp - front, 0.0) + np.minimum(zmp - rear, 0.0)

    def _arm(self, joint: Joint, time: ArrayLike) -> tuple[NDArray, NDArray]:
        """Return the vector (x, z) [m] from the ZMP to a joint."""
        if joint not in get_args(Joint):
            raise SpringfootError(f"joint must be one of {', '.join(get_args(Joint))}, got {joint!r}")
        x, z = self.ankle(time) if joint == "ankle" else self.toe_joint(time)
        return x - self.zmp(time), z

    @cached_property
    def _com_forward(self) -> _Course:
        """Forward position and acceleration of the CoM over time, through its knots by `interpolation`; cached."""
        t = self.knot_times
        x, _ = self.com_knots
        if self.interpolation == "not-a-knot":
            spline = CubicSpline(t, x)
            return _Course(spline, spline.derivative(2))
        if self.interpolation == "least-squares cubic":
            cubic = Polynomial.fit(t, x, 3)
            return _Course(cubic, cubic.deriv(2))
        rate = 2 * pi / self.step_time

        def waves(t: NDArray) -> NDArray:
            return np.stack([np.sin(rate * t), np.cos(rate * t)], -1)

        # Four unknowns go through six knots: the last three repeat the first three a step further on.
        line_and_waves = np.column_stack([np.ones(6), t, waves(t)])
        start, speed, *amplitudes = np.linalg.lstsq(line_and_waves, x, rcond=None)[0]
        return _Course(
            position=lambda t: start + speed * t + waves(t) @ amplitudes,
            acceleration=lambda t: -(rate**2) * waves(t) @ amplitudes,
        )

    @cached_property
    def _splines(self) -> dict[str, CubicSpline]:
        """Joint (ankle, toe) -> not-a-knot spline of its path (x, z) [m] over time [s]; cached."""
        knots = {"ankle": self.ankle_knots, "toe": self.toe_joint_knots}
        return {joint: CubicSpline(self.knot_times, np.stack(xz, -1)) for joint, xz in knots.items()}

    def _checked_time(self, time: ArrayLike) -> NDArray:
        """Return the times as an array; raise `SpringfootError` for times outside the knots, which span a step
        and a half."""
        time = np.asarray(time, float)
        ends = self.knot_times[[0, -1]]
        # Half a nanosecond: `linspace` may end a rounding error late.
        if not np.all((time >= ends[0] - 5e-10) & (time <= ends[1] + 5e-10)):
            raise SpringfootError(f"time must be in [{ends[0]:g}, {ends[1]:g}] s, step {self.k} of the thesis's walk")
        return time
