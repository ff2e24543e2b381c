"""The walking task: observation, named reward terms and falls, as NumPy on arrays over N environments.

Row i of every result depends on row i of the arguments alone, by the same operations for any N: a batch of N
gives the same bits as N batches of one. Hence sums only over a few elements, and no matrix products.
"""

from math import sqrt
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from springfoot.gait.body import GRAVITY, Body
from springfoot.gait.human import ANGLES, HumanGait
from springfoot.gait.plan import WalkPlan

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


class Task:
    """What is seen, what is rewarded and what counts as a fall, for one body and plan; holds no state."""

    def __init__(self, settings: BipedSettings, body: Body, plan: WalkPlan, human: HumanGait) -> None:
        length, leg = body.length_scale, body.leg_length
        self.names = tuple(entry.name for entry in OBSERVATION)
        self.low = np.array([entry.low for entry in OBSERVATION], np.float32)
        self.high = np.array([entry.high for entry in OBSERVATION], np.float32)
        self.weights = DEFAULT_WEIGHTS | settings.reward_weights

        self._weight = body.mass * GRAVITY
        unit = {
            "1": 1.0,
            "rad": 1.0,
            "leg length": leg,
            "sqrt(g l)": sqrt(GRAVITY * leg),
            "sqrt(g/l)": sqrt(GRAVITY / leg),
            "body weight": self._weight,
        }
        self._units = np.array([unit[entry.unit] for entry in OBSERVATION])
        self._command = np.array([settings.speed, length, body.mass_scale])
        self._min_hip_height = MIN_HIP_HEIGHT * length
        self._tracking_tolerance = np.array(
            [COM_X_TOLERANCE * length, COM_Z_TOLERANCE * length, SPEED_TOLERANCE * sqrt(length)]
        )
        self._stiffness_unit = np.array([ANKLE_STIFFNESS_UNIT, TOE_STIFFNESS_UNIT]) * body.stiffness_scale
        self._stiffness_share = np.array([1.0, TOE_SHARE]) / (1.0 + TOE_SHARE)
        self._pose_share = np.array([POSE_WEIGHTS[joint] for joint in range(len(JOINTS))])
        self._half_step = 0.5 * STEP_SECONDS / plan.stride_time

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
        n = len(leg_phase)
        left_leads = leg_phase[:, LEFT] < 0.5
        angle = 2 * np.pi * leg_phase[:, LEFT]
        sin, cos = np.sin(angle), np.cos(angle)
        cycle = np.stack((sin, cos, 2 * sin * cos, 1 - 2 * sin * sin), -1)
        seen = np.concatenate(
            (
                m.root[:, 1:],
                m.angle.reshape(n, -1),
                m.root_velocity,
                m.velocity.reshape(n, -1),
                cycle,
                force[..., 1].reshape(n, -1),
                self.tracking(m, leg_phase),
                last_action,
                planned_ankle,
                np.where(left_leads, 1.0, -1.0)[:, None],
                np.broadcast_to(self._command, (n, len(self._command))),
            ),
            axis=1,
        )
        seen /= self._units
        return np.fmax(np.fmin(seen, self.high), self.low).astype(np.float32)

    def planned_com(self, m: "Measurement", leg_phase: NDArray) -> NDArray:
        """The plan's CoM (x in the world, z) [m], shape (N, 2)."""
        return self._reference(m, leg_phase)[:, :2]

    def tracking(self, m: "Measurement", leg_phase: NDArray) -> NDArray:
        """CoM minus plan: x [m], z [m] and forward speed [m/s], shape (N, 3)."""
        return np.concatenate((m.com, m.com_velocity[:, :1]), axis=1) - self._reference(m, leg_phase)

    def _reference(self, m: "Measurement", leg_phase: NDArray) -> NDArray:
        """The plan's CoM x (in the world) [m], z [m] and forward speed [m/s], shape (N, 3).

        The plan counts x from the ankle of the leg whose stance began last, the one with a phase in [0, 0.5).
        """
        left_leads = leg_phase[:, LEFT] < 0.5
        step_phase = 2 * np.where(left_leads, leg_phase[:, LEFT], leg_phase[:, RIGHT] % 0.5)
        planned = self._plan.at(step_phase)
        planned[:, 0] += self._step_length * step_phase
        planned[:, 0] += np.where(left_leads, m.ankle[:, LEFT, 0], m.ankle[:, RIGHT, 0])
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
        close = np.exp(-np.square(self.tracking(m, leg_phase) / self._tracking_tolerance))
        return {
            "alive": self._upright(m).astype(float),
            "speed": close[:, 2],
            "com_x": close[:, 0],
            "com_z": close[:, 1],
            "pose": np.exp(-self._pose_error(m, leg_phase) / POSE_TOLERANCE),
            "stiffness_rate": np.square(action - last_action).sum(-1),
            "stiffness": self._stiffness_cost(stiffness),
            "grf": np.exp(-self._force_distance(leg_phase, force_windows) / FORCE_TOLERANCE),
        }

    def reward(self, terms: dict[str, NDArray]) -> NDArray:
        """Weighted sum of the terms, (N,); 0 where `alive` is 0."""
        total = np.zeros_like(terms["alive"])
        for name, weight in self.weights.items():
            total += weight * terms[name]
        return total * terms["alive"]

    def fallen(self, m: "Measurement") -> NDArray:
        """Why each environment has fallen, a string array (N,): empty while it has not."""
        tilted = np.where(np.abs(m.root[:, 2]) <= MAX_PITCH, "", TOO_TILTED)
        return np.where(m.root[:, 1] >= self._min_hip_height, tilted, TOO_LOW)

    def _upright(self, m: "Measurement") -> NDArray:
        """Neither fallen nor diverged; what is not a number is not upright."""
        high = m.root[:, 1] >= self._min_hip_height
        return high & (np.abs(m.root[:, 2]) <= MAX_PITCH) & (m.diverged == "")

    def _pose_error(self, m: "Measurement", leg_phase: NDArray) -> NDArray:
        error = m.angle - self._pose.at(leg_phase)
        error[:, :, HIP] -= m.root[:, 2:]  # thigh to the vertical = hip - pitch
        share = (self._pose_share * np.square(error)).sum(-1)
        return 0.5 * (share[:, LEFT] + share[:, RIGHT])

    def _stiffness_cost(self, stiffness: NDArray) -> NDArray:
        cost = (self._stiffness_share * np.square(stiffness / self._stiffness_unit)).sum(-1)
        return 0.5 * (cost[:, LEFT] + cost[:, RIGHT])

    def _force_distance(self, leg_phase: NDArray, force_windows: NDArray) -> NDArray:
        foot = force_windows.sum(3) / self._weight  # (W, N, side, forward/up) in body weights
        excess = EXCESS_SHARE / len(foot) * np.maximum(foot[..., 1] - MAX_FORCE, 0.0).sum(0)
        # the mean over the step belongs to its middle
        people = self._force.at((leg_phase - self._half_step) % 1.0)
        distance = np.abs(foot.sum(0) / len(foot) - people[..., :2]) - people[..., 2:]
        away = excess + np.maximum(distance, 0.0).sum(-1)
        return away[:, LEFT] + away[:, RIGHT]


def _com_curves(plan: WalkPlan) -> NDArray:
    """The plan's CoM over one step: x [m] less its mean advance, z [m], forward speed [m/s]; all periodic."""
    x, z = plan.com(GRID)
    speed, _ = plan.com_velocity(GRID)
    return np.stack((x - plan.step_length * GRID, z, speed), -1)
