"""The walking task: observation, named reward terms and falls, on arrays over N environments.

Row i of every result depends on row i of the arguments alone, by the same operations for any N: a batch of N
gives the same bits as N batches of one.
"""

from math import cos, exp, pi, sin, sqrt
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from springfoot.gait.body import GRAVITY, Body
from springfoot.gait.human import ANGLES, HumanGait
from springfoot.gait.plan import WalkPlan

from .kernel import kernel
from .model import ACTIONS, ANKLE, CONTACTS, HIP, JOINTS, KNEE, LEFT, RIGHT, SIDES, TOE
from .phase import GRID, PhaseTable
from .settings import DEFAULT_WEIGHTS, STEP_SECONDS, BipedSettings

if TYPE_CHECKING:
    from .simulation import Measurement

MIN_HIP_HEIGHT = 0.65
"""A hip lower than this [m at 1.70 m, scaled with height] is a fall (design study)."""
MAX_PITCH = 0.8
"""A trunk tilted further than this, forward or backward, is a fall [rad] (design study)."""
TOO_LOW, TOO_TILTED = "fell: hip too low", "fell: trunk too tilted"

COM_X_TOLERANCE, COM_Z_TOLERANCE = 0.1, 0.03
"""Error of the CoM at which its reward is 1/e [m at 1.70 m, scaled with height] (design study)."""
SPEED_TOLERANCE = 0.15
"""Error of the CoM's forward speed at which its reward is 1/e [m/s at 1.70 m, scaled with its square root]."""
POSE_WEIGHTS = {HIP: 3.0, KNEE: 0.5, ANKLE: 2.0, TOE: 0.1}
"""Share of each joint in the pose error E; the toe counts little, its curve is of other people."""
POSE_TOLERANCE = 0.02
"""Pose error E at which its reward is 1/e [rad^2]: 3.4 deg at every joint (design study)."""
ANKLE_STIFFNESS_UNIT, TOE_STIFFNESS_UNIT = 300.0, 60.0
"""Stiffness whose cost is one unit [N m/rad at 1.70 m, 63 kg, scaled with mass x height] (design study)."""
TOE_SHARE = 0.25
"""Weight of the toe against the ankle in the cost of stiffness (design study)."""
MAX_FORCE = 1.2
"""Vertical force of one foot [body weights] beyond which it costs more; people's peaks are 1.05 and 1.13."""
EXCESS_SHARE = 4.0
"""Weight of that excess against the distance from people's range: a peak is short, and is what hurts."""
FORCE_TOLERANCE = 0.15
"""Body weights of force outside people's range, both feet together, at which its reward is 1/e."""


class Entry(NamedTuple):
    """One entry of the observation: name, unit it is divided by, bounds it is clipped to, and its meaning."""

    name: str
    unit: str
    low: float
    high: float
    meaning: str


def _entries() -> tuple[Entry, ...]:
    legs = [(side, joint) for side in SIDES for joint in JOINTS]
    sign: dict[str, str] = dict(zip(JOINTS, ("flexion", "flexion", "dorsiflexion", "toe up"), strict=True))
    return (
        Entry("hip_height", "leg length", 0.0, 2.0, "height of the hip"),
        Entry("pitch", "rad", -3.2, 3.2, "pitch of the trunk, forward positive"),
        *(Entry(f"{joint}_{side}", "rad", -3.2, 3.2, f"angle, {sign[joint]} positive") for side, joint in legs),
        Entry("hip_velocity_x", "sqrt(g l)", -5.0, 5.0, "velocity of the hip, forward positive"),
        Entry("hip_velocity_z", "sqrt(g l)", -5.0, 5.0, "velocity of the hip, up positive"),
        Entry("pitch_rate", "sqrt(g/l)", -15.0, 15.0, "rate of the pitch, forward positive"),
        *(
            Entry(f"{joint}_rate_{side}", "sqrt(g/l)", -15.0, 15.0, f"angular rate, {sign[joint]} positive")
            for side, joint in legs
        ),
        Entry("phase_sin", "1", -1.0, 1.0, "sine of 2 pi x left stride phase"),
        Entry("phase_cos", "1", -1.0, 1.0, "cosine of 2 pi x left stride phase"),
        Entry("phase_sin_2", "1", -1.0, 1.0, "sine of 4 pi x left stride phase"),
        Entry("phase_cos_2", "1", -1.0, 1.0, "cosine of 4 pi x left stride phase"),
        *(
            Entry(
                f"load_{contact}_{side}",
                "body weight",
                0.0,
                5.0,
                "vertical force, mean of the step",
            )
            for side in SIDES
            for contact in CONTACTS
        ),
        Entry("com_x_error", "leg length", -2.0, 2.0, "CoM minus plan, forward positive"),
        Entry("com_z_error", "leg length", -2.0, 2.0, "CoM minus plan, up positive"),
        Entry("speed_error", "sqrt(g l)", -5.0, 5.0, "forward speed of the CoM minus plan"),
        *(Entry(f"last_action_{name}", "1", -1.0, 1.0, "action of the step before") for name in ACTIONS),
        *(Entry(f"planned_ankle_{side}", "rad", -3.2, 3.2, "plan, dorsiflexion positive") for side in SIDES),
        Entry("leading_leg", "1", -1.0, 1.0, "stance that began last: +1 left, -1 right"),
        Entry("command_speed", "sqrt(g l)", 0.0, 2.0, "commanded speed (Froude speed)"),
        Entry("height_ratio", "1", 0.0, 2.0, "height / 1.70 m"),
        Entry("mass_ratio", "1", 0.0, 5.0, "body mass / 63 kg"),
    )


OBSERVATION = _entries()
"""Every entry of the observation, in order; l is the leg length (hip to floor when standing)."""


SEEN = np.dtype(
    [
        ("root", float, 2),
        ("angle", float, (len(SIDES), len(JOINTS))),
        ("root_velocity", float, 3),
        ("velocity", float, (len(SIDES), len(JOINTS))),
        ("cycle", float, 4),
        ("load", float, (len(SIDES), len(CONTACTS))),
        ("error", float, 3),
        ("last_action", float, len(ACTIONS)),
        ("planned_ankle", float, len(SIDES)),
        ("leading_leg", float),
        ("command", float, 3),
    ]
)
"""The observation of one body before it is made dimensionless: the entries of `OBSERVATION`, in order [SI]."""
TERMS = ("alive", "speed", "com_x", "com_z", "pose", "grf", "stiffness_rate", "stiffness")
"""The reward's terms, in the order in which they are summed."""
ALIVE, SPEED, COM_X, COM_Z, POSE, GRF, STIFFNESS_RATE, STIFFNESS = range(len(TERMS))
JUDGED = np.dtype(
    [
        ("min_hip_height", float),  # [m]
        ("tolerance", float, 3),  # of CoM x, z [m] and forward speed [m/s]
        ("pose_share", float, len(JOINTS)),
        ("stiffness_unit", float, 2),  # [N m/rad]
        ("stiffness_share", float, 2),
        ("weight", float),  # of the body [N]
    ]
)
"""What the terms of one body are measured by."""


class Task:
    """What is seen, what is rewarded and what counts as a fall, for one body and plan; holds no state."""

    def __init__(self, settings: BipedSettings, body: Body, plan: WalkPlan, human: HumanGait) -> None:
        length, leg = body.length_scale, body.leg_length
        self.names = tuple(entry.name for entry in OBSERVATION)
        self.low = np.array([entry.low for entry in OBSERVATION], np.float32)
        self.high = np.array([entry.high for entry in OBSERVATION], np.float32)
        self.weights = DEFAULT_WEIGHTS | settings.reward_weights

        unit = {
            "1": 1.0,
            "rad": 1.0,
            "leg length": leg,
            "sqrt(g l)": sqrt(GRAVITY * leg),
            "sqrt(g/l)": sqrt(GRAVITY / leg),
            "body weight": body.mass * GRAVITY,
        }
        self._units = np.array([unit[entry.unit] for entry in OBSERVATION])
        self._command = np.array([settings.speed, length, body.mass_scale])
        self._weights = np.array([self.weights[name] for name in TERMS])
        self._half_step = 0.5 * STEP_SECONDS / plan.stride_time
        self._judged = np.zeros(1, JUDGED)
        self._judged["min_hip_height"] = MIN_HIP_HEIGHT * length
        self._judged["tolerance"] = COM_X_TOLERANCE * length, COM_Z_TOLERANCE * length, SPEED_TOLERANCE * sqrt(length)
        self._judged["pose_share"] = [POSE_WEIGHTS[joint] for joint in range(len(JOINTS))]
        self._judged["stiffness_unit"] = np.array([ANKLE_STIFFNESS_UNIT, TOE_STIFFNESS_UNIT]) * body.stiffness_scale
        self._judged["stiffness_share"] = np.array([1.0, TOE_SHARE]) / (1.0 + TOE_SHARE)
        self._judged["weight"] = body.mass * GRAVITY

        self._step_length = plan.step_length
        self._plan = PhaseTable(_com_curves(plan))
        self._pose = PhaseTable(np.stack([human.mean(name, GRID) for name in ANGLES], -1))
        force = ("grf_forward", "grf_vertical")
        mean, sd = [human.mean(name, GRID) for name in force], [human.sd(name, GRID) for name in force]
        self._force = PhaseTable(np.stack(mean + sd, -1))

    def observe(
        self,
        m: "Measurement",
        leg_phase: NDArray,
        last_action: NDArray,
        planned_ankle: NDArray,
        force: NDArray,
    ) -> NDArray:
        """The observation, float32 (N, D) as `OBSERVATION`, clipped to its bounds.

        `leg_phase` (N, 2) stride phases [0, 1); `last_action` (N, 4); `planned_ankle` (N, 2) [rad]; `force`
        (N, 2, 3, 2) on the body [N], mean over the step. What is not a number reads as the upper bound.
        """
        error = self.tracking(m, leg_phase)
        seen = np.empty(len(leg_phase), SEEN)
        scaled = np.empty((len(leg_phase), len(OBSERVATION)), np.float32)
        _see_body(m.root, m.root_velocity, m.angle, m.velocity, force, seen)
        _see_task(leg_phase, error, last_action, planned_ankle, self._command, seen)
        _scale(seen.view(float).reshape(scaled.shape), self._units, self.low, self.high, scaled)
        return scaled

    def planned_com(self, m: "Measurement", leg_phase: NDArray) -> NDArray:
        """The plan's CoM (x in the world, z) [m], shape (N, 2)."""
        return self._reference(m, leg_phase)[:, :2]

    def tracking(self, m: "Measurement", leg_phase: NDArray) -> NDArray:
        """CoM minus plan: x [m], z [m] and forward speed [m/s], shape (N, 3)."""
        error = np.empty((len(leg_phase), 3))
        _subtract(m.com, m.com_velocity, self._reference(m, leg_phase), error)
        return error

    def _reference(self, m: "Measurement", leg_phase: NDArray) -> NDArray:
        """The plan's CoM x (in the world) [m], z [m] and forward speed [m/s], shape (N, 3).

        The plan counts x from the ankle of the leg whose stance began last, the one with a phase in [0, 0.5).
        """
        step_phase, origin = np.empty((2, len(leg_phase)))
        _lead(leg_phase, m.ankle, step_phase, origin)
        planned = self._plan.at(step_phase)
        planned[:, 0] += self._step_length * step_phase + origin
        return planned

    def terms(
        self,
        m: "Measurement",
        leg_phase: NDArray,
        action: NDArray,
        last_action: NDArray,
        stiffness: NDArray,
        force_windows: NDArray,
    ) -> dict[str, NDArray]:
        """The reward's terms, unweighted and dimensionless, each (N,).

        Rewards in [0, 1]: `alive`; `speed`, `com_x`, `com_z`, exp(-(error/tolerance)^2) of the CoM against
        the ZMP plan; `pose`, exp(-E/0.02) with E = 1/2 sum over legs of (3, 0.5, 2, 0.1) x squared distance
        [rad^2] of thigh (to the vertical), knee, ankle and toe from people's mean curves at the leg's phase.
        `grf`, exp(-D/0.15) with D the body weights by which the feet's forces leave people's range: vertical
        beyond 1.2 (fourfold), both components beyond mean +- SD at the leg's phase.
        Costs >= 0: `stiffness_rate`, squared change of the action; `stiffness`, mean over legs of
        [(K_ankle/300)^2 + (K_toe/60)^2/4]/1.25, K scaled to 1.70 m and 63 kg.

        `action`, `last_action` (N, 4); `stiffness` (N, 2, 2) as [side][ankle, toe] [N m/rad]; `force_windows`
        (W, N, 2, 3, 2) on the body [N] in the W control windows of the step.
        """
        error, well = self.tracking(m, leg_phase), m.diverged == ""
        people = self._force.at((leg_phase - self._half_step) % 1.0)  # the mean over the step belongs to its middle
        terms = np.empty((len(TERMS), len(leg_phase)))
        _judge_com(self._judged, m.root, well, error, terms)
        _judge_pose(self._judged, m.root, m.angle, self._pose.at(leg_phase), terms)
        _judge_force(self._judged, force_windows, people, terms)
        _judge_stiffness(self._judged, action, last_action, stiffness, terms)
        return dict(zip(TERMS, terms, strict=True))

    def reward(self, terms: dict[str, NDArray]) -> NDArray:
        """Weighted sum of the terms, (N,); 0 where `alive` is 0."""
        values = np.array([terms[name] for name in TERMS])
        total = np.empty(values.shape[1])
        _weigh(self._weights, values, total)
        return total

    def fallen(self, m: "Measurement") -> NDArray:
        """Why each environment has fallen, a string array (N,): empty while it has not."""
        tilted = np.where(np.abs(m.root[:, 2]) <= MAX_PITCH, "", TOO_TILTED)
        return np.where(m.root[:, 1] >= self._judged["min_hip_height"], tilted, TOO_LOW)


@kernel
def _see_body(root, root_velocity, angle, velocity, force, seen):
    for i in range(len(seen)):
        row = seen[i]
        row.root[0], row.root[1] = root[i, 1], root[i, 2]
        for k in range(3):
            row.root_velocity[k] = root_velocity[i, k]
        for side in range(2):
            for joint in range(4):
                row.angle[side, joint], row.velocity[side, joint] = angle[i, side, joint], velocity[i, side, joint]
            for contact in range(3):
                row.load[side, contact] = force[i, side, contact, 1]


@kernel
def _see_task(leg_phase, error, last_action, planned_ankle, command, seen):
    for i in range(len(seen)):
        row, left = seen[i], leg_phase[i, LEFT]
        s, c = sin(2 * pi * left), cos(2 * pi * left)
        row.cycle[0], row.cycle[1], row.cycle[2], row.cycle[3] = s, c, 2 * s * c, 1 - 2 * s * s
        row.leading_leg = 1.0 if left < 0.5 else -1.0
        for k in range(3):
            row.error[k], row.command[k] = error[i, k], command[k]
        for k in range(4):
            row.last_action[k] = last_action[i, k]
        for side in range(2):
            row.planned_ankle[side] = planned_ankle[i, side]


@kernel
def _scale(seen, units, low, high, scaled):
    for i in range(seen.shape[0]):
        for k in range(seen.shape[1]):
            value = seen[i, k] / units[k]
            if not value <= high[k]:  # nor is what is not a number
                value = high[k]
            scaled[i, k] = max(value, low[k])


@kernel
def _lead(leg_phase, ankle, step_phase, origin):
    """Phase of the step, and x [m] of the ankle of the leg whose stance began last."""
    for i in range(len(step_phase)):
        leader = LEFT if leg_phase[i, LEFT] < 0.5 else RIGHT
        step_phase[i] = 2 * (leg_phase[i, leader] % 0.5)
        origin[i] = ankle[i, leader, 0]


@kernel
def _subtract(com, com_velocity, planned, error):
    for i in range(len(error)):
        error[i, 0], error[i, 1] = com[i, 0] - planned[i, 0], com[i, 1] - planned[i, 1]
        error[i, 2] = com_velocity[i, 0] - planned[i, 2]


@kernel
def _judge_com(judged, root, well, error, terms):
    low, tolerance = judged[0].min_hip_height, judged[0].tolerance
    for i in range(len(root)):
        upright = root[i, 1] >= low and abs(root[i, 2]) <= MAX_PITCH  # what is not a number is not
        terms[ALIVE, i] = 1.0 if upright and well[i] else 0.0
        terms[COM_X, i] = exp(-((error[i, 0] / tolerance[0]) ** 2))
        terms[COM_Z, i] = exp(-((error[i, 1] / tolerance[1]) ** 2))
        terms[SPEED, i] = exp(-((error[i, 2] / tolerance[2]) ** 2))


@kernel
def _judge_pose(judged, root, angle, people, terms):
    share = judged[0].pose_share
    for i in range(len(root)):
        error = 0.0
        for side in range(2):
            for joint in range(4):
                lean = root[i, 2] if joint == HIP else 0.0  # thigh to the vertical = hip - pitch
                error += share[joint] * (angle[i, side, joint] - people[i, side, joint] - lean) ** 2
        terms[POSE, i] = exp(-0.5 * error / POSE_TOLERANCE)


@kernel
def _judge_force(judged, windows, people, terms):
    """Forces in body weights; `people` (N, side, 4) as mean forward, mean up, SD forward, SD up."""
    count, weight = windows.shape[0], judged[0].weight
    for i in range(windows.shape[1]):
        away = 0.0
        for side in range(2):
            forward = up = excess = 0.0
            for window in range(count):
                foot = windows[window, i, side]
                vertical = (foot[0, 1] + foot[1, 1] + foot[2, 1]) / weight
                forward += (foot[0, 0] + foot[1, 0] + foot[2, 0]) / weight
                up += vertical
                excess += max(vertical - MAX_FORCE, 0.0)
            away += EXCESS_SHARE / count * excess
            away += max(abs(forward / count - people[i, side, 0]) - people[i, side, 2], 0.0)
            away += max(abs(up / count - people[i, side, 1]) - people[i, side, 3], 0.0)
        terms[GRF, i] = exp(-away / FORCE_TOLERANCE)


@kernel
def _judge_stiffness(judged, action, last_action, stiffness, terms):
    unit, share = judged[0].stiffness_unit, judged[0].stiffness_share
    for i in range(len(action)):
        rate = cost = 0.0
        for k in range(4):
            rate += (action[i, k] - last_action[i, k]) ** 2
        for side in range(2):
            for joint in range(2):
                cost += share[joint] * (stiffness[i, side, joint] / unit[joint]) ** 2
        terms[STIFFNESS_RATE, i], terms[STIFFNESS, i] = rate, 0.5 * cost


@kernel
def _weigh(weights, terms, total):
    for i in range(len(total)):
        total[i] = 0.0
        for term in range(len(weights)):
            total[i] += weights[term] * terms[term, i]
        total[i] *= terms[ALIVE, i]


def _com_curves(plan: WalkPlan) -> NDArray:
    """The plan's CoM over one step: x [m] less its mean advance, z [m], forward speed [m/s]; all periodic."""
    x, z = plan.com(GRID)
    speed, _ = plan.com_velocity(GRID)
    return np.stack((x - plan.step_length * GRID, z, speed), -1)
