"""Fit the foot's constants at people's roll over the toe tip (`foot_style.py`) to people's curves, and print them.

    python -m springfoot.gait.plan.fit_feet

Each walk has the CoM that `plan_walk` gives to the shortest double support with the whole roll, as high as the
straightest knee allows; a swing foot in the floor costs too.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from springfoot.arrays import NDArray

from ..body.body import Body
from ..people.human import human_gait
from . import foot_style
from .com_plan import PEOPLES_SHARE
from .foot import feet_under_zmp
from .plan import LEAST_FULL_ROLL, WalkPlan, plan_walk
from .posture import POSTURE_SAMPLES, STRAIGHTEST_KNEE, full_reach, legs_under_com

SPEEDS = (0.8, 1.0, 1.2, 1.4, 1.7)
"""Speeds of the walks [m/s]; chosen."""
JOINT_WEIGHTS = {"thigh": 1.0, "knee": 1.0, "ankle": 0.5, "toe": 0.2}
"""Weights of the joints' errors; chosen."""
CLEARANCE = 0.017
"""Height of the foot in mid-swing below which it costs [m]; chosen: people's is 13 to 20 mm."""
PER_METRE = 2e4
"""Cost of a swing foot in the floor [deg/m]; chosen."""
STANDARD = Body()


@dataclass(frozen=True, kw_only=True, eq=False)
class Case:
    """Walk at one speed for the fit; the CoM follows the plan, except for the height."""

    plan: WalkPlan
    """Plan with the constants before the fit."""
    zmp_times: NDArray
    """(3,) times of the ZMP's corners over a step [s]."""
    zmp_points: NDArray
    """(3,) ZMP at its corners [m from the stance ankle]."""
    people: dict[str, NDArray]
    """Joint of `JOINT_WEIGHTS` -> people's curve (POSTURE_SAMPLES,) [rad]."""

    def errors(self) -> NDArray:
        """Return the residuals of the fit with the present constants of `foot_style`, one array [deg].

        Joints' weighted differences from people's at hundredths of the stride, then the cost of a foot in the floor.
        """
        path = feet_under_zmp(STANDARD, self.plan.step_length, self.zmp_times, self.zmp_points, self.plan.feet.roll)
        motion = self.plan.motion
        # Three rounds settle the CoM height at which the straightest knee has its least flexion.
        for _ in range(3):
            legs = legs_under_com(STANDARD, motion, path, self.plan.human)
            lacking = float(legs.reach.max()) - full_reach(STANDARD, STRAIGHTEST_KNEE)
            motion = replace(motion, height=motion.height - lacking)
        # Every sixth of the samples: hundredths of the stride.
        joints = [
            weight * np.degrees(getattr(legs, name) - self.people[name])[::6] for name, weight in JOINT_WEIGHTS.items()
        ]
        # The depth of ball and of heel in the floor, without the ends of swing, where the foot is on it.
        floor = np.minimum(path.swing_heights((0.005, 0.995)).min(axis=1), 0.0)
        return np.concatenate([*joints, PER_METRE * np.append(floor, min(path.clearance - CLEARANCE, 0.0))])


def case(speed: float) -> Case:
    """Plan the walk at a `speed` [m/s], with the shortest double support that has the whole roll."""
    people = human_gait(speed, STANDARD.height)
    support_ratio = max(PEOPLES_SHARE * (2 * people.toe_off - 1), LEAST_FULL_ROLL)
    plan = plan_walk(STANDARD, speed, double_support=support_ratio * people.stride_time / 2)
    times = np.array([0.0, plan.double_support, plan.step_time])
    phase = np.arange(POSTURE_SAMPLES) / POSTURE_SAMPLES
    return Case(
        plan=plan,
        zmp_times=times,
        # A hair before the step's end: phase 1 is phase 0 of the next step.
        zmp_points=plan.zmp(times / plan.step_time * [1, 1, 1 - 1e-15]),
        people={name: plan.human.mean(name, phase) for name in JOINT_WEIGHTS},
    )


def constants() -> NDArray:
    """Return the present constants of `foot_style` at a roll of 1 as one array, where the fit starts."""
    return np.array(
        [
            *(foot_style.TOE_ROCKER_POWER[1], foot_style.ROLL_POWER),
            *(*foot_style.VIA_FORWARD[1], *foot_style.VIA_UP[1], *foot_style.VIA_PITCH[1]),
        ]
    )


def use(values: NDArray) -> None:
    """Replace the constants at a roll of 1 in `foot_style` by `values`, in the order of `constants`."""
    toe_power, roll_power, *via = map(float, values)
    foot_style.TOE_ROCKER_POWER = (foot_style.TOE_ROCKER_POWER[0], toe_power)
    foot_style.ROLL_POWER = roll_power
    for name, pair in zip(("VIA_FORWARD", "VIA_UP", "VIA_PITCH"), np.reshape(via, (3, -1)), strict=True):
        setattr(foot_style, name, (getattr(foot_style, name)[0], tuple(pair.tolist())))


def main() -> None:
    """Fit the constants at a roll of 1 to people's curves, and print them with the error before and after."""
    cases = [case(speed) for speed in SPEEDS]

    def errors(values: NDArray) -> NDArray:
        use(values)
        return np.concatenate([walk.errors() for walk in cases])

    start = constants()
    least = np.full(start.shape, -np.inf)
    least[:2] = 2.0  # of the two powers; below, the pitch's rate would jump where the rocker begins
    fit = least_squares(
        errors, start, bounds=(least, np.inf), diff_step=1e-4, x_scale=np.maximum(np.abs(start), 0.1), ftol=1e-3
    )
    use(fit.x)
    for name in ("TOE_ROCKER_POWER", "VIA_FORWARD", "VIA_UP", "VIA_PITCH"):
        print(name, np.round(getattr(foot_style, name)[1], 3).tolist())
    print("ROLL_POWER", round(foot_style.ROLL_POWER, 2))
    print(f"rms {np.sqrt(np.mean(fit.fun**2)):.3f} deg from {np.sqrt(np.mean(errors(start) ** 2)):.3f}")


if __name__ == "__main__":
    main()
