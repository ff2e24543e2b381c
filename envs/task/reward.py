"""Compute the named reward terms, over N environments.

Row i of every result depends on row i of the arguments alone, by the same operations for any N: a batch of N gives the
same bits as N batches of one. Axes: N bodies; W control windows of a step; side, 0 left and 1 right; contact heel, ball
and toe tip; a `PhaseTable` (R, SAMPLES, 2, C) has R rows, phases, value and rise to the next phase, and C curves.
"""

from collections.abc import Iterable, Sequence
from math import exp

import numpy as np

from springfoot.arrays import NDArray
from springfoot.gait.body.tissue import charged_calf_stiffness
from springfoot.gait.plan.effort import ACTIVATION_TIME

from ..control.constants import LegConstants
from ..control.phase_table import GRID, PhaseTable
from ..control.reference_walk import ReferenceWalk
from ..control.stiffness_control import muscle_stiffness
from ..control.subjects import Subjects
from ..physics.foot import Feet
from ..physics.kernel import part
from ..physics.model import ANKLE, HIP, KNEE, LEFT, RIGHT
from ..physics.muscles import tissue_stiffness
from ..physics.timing import ACTION_STEP
from ..settings.settings import DEFAULT_WEIGHTS, BipedSettings
from .episode_end import is_alive
from .observation import HIGH, LOW, observe, units_of
from .observation_entries import entries_of
from .scales import body_scales
from .state import TASK_ROW
from .target import error_of, target_curves, targets_at, track
from .worn import worn_entries

POSE_TOLERANCE = 0.02
"""Pose error E at which its reward is 1/e [rad^2]; chosen: 2.8 deg at every joint."""
MAX_FORCE = 1.2
"""Vertical force of one foot beyond which it costs more [body weights]; chosen: people's peaks are 1.05 and 1.13."""
EXCESS_SHARE = 4.0
"""Weight of force beyond `MAX_FORCE` against the distance from the target's range [-]; chosen high, as a peak is
short."""
FORCE_TOLERANCE = 0.4
"""Force outside the target's range, both feet together, at which its reward is 1/e [body weights]; chosen: at 0.15 a
push-off far too strong costs hardly more than one a little too strong."""


HELD_SECONDS = 0.7
"""Time constant of the mean speed that `speed_held` judges [s]; chosen: within a step the speed varies."""
OFFSET_UNIT = 0.25
"""Change of an offset of a rest angle in 20 ms that costs one unit [rad]; chosen, 14 deg."""


TERMS: tuple[str, ...] = (
    *("alive", "speed", "com_x", "com_z", "zmp", "pose", "grf"),
    *("stiffness_rate", "stiffness", "effort", "fibre_work", "activation", "impact"),
    *("speed_held", "person_rate", "acceleration", "step_length", "activation_rate"),
)
"""Reward terms in the order of their sum: rewards, then costs."""
ALIVE, SPEED, COM_X, COM_Z, ZMP, POSE, GRF, STIFFNESS_RATE, STIFFNESS, *_ = range(len(TERMS))
EFFORT, FIBRE_WORK, ACTIVATION, IMPACT, SPEED_HELD, PERSON_RATE, SMOOTHNESS, STEP, ACTIVATION_RATE = range(
    STIFFNESS + 1, len(TERMS)
)
TASK_OPTIONS = np.dtype(
    [
        ("weights", float, len(TERMS)),  # of the reward's terms
        ("seconds", float),  # time of one step [s]
        ("share", float),  # of it in `ACTION_STEP`
        ("most_steps", float),  # beyond which an episode is truncated
        ("tendon", float),  # stiffness of the Achilles tendon at 1.70 m and 63 kg [N m/rad], 0 for no bound
        ("forward", float),  # weight of the forward force in the term `grf`
    ]
)
"""Numbers of the settings that rewards need."""


@part
def _near_zmp(scale, control, targets, m, forces, i):
    """Return exp(-(d / tolerance)^2) of the distance d from the planned ZMP, forward, of the CoP; 0 in flight.

    The CoP is that of both feet, mean over the step. Of body number `i`: `scale` is of `SCALES`, `control` of
    `CONTROL_ROW`, `targets` (side,) of `TARGET`, `m` of `MEASURED`; `forces` are those of all bodies, as of `judge`.
    """
    load = moment = 0.0
    for window in range(len(forces)):
        for side in range(2):
            for point in range(3):
                load += forces[window, i, side, point, 1]
                moment += forces[window, i, side, point, 1] * m.contact[side, point, 0]
    if load <= 0.0:
        return 0.0
    phase = control.legs.phase
    leader = LEFT if phase[LEFT] < 0.5 else RIGHT  # the leg that began its stance last
    target = targets[leader]
    # From the leader's ankle: the CoM's mean advance so far, and the ZMP less that advance (`TARGET`).
    ahead = control.subject.scale.length * (target.stride_length * phase[leader] + target.zmp)
    return exp(-(((moment / load - m.ankle[leader, 0] - ahead) / scale.tolerance[3]) ** 2))


@part
def _pose_error(scale, pitch, angle, target):
    """Return the weighted squared distance [rad^2] between the joint angles of a leg and the target's pose.

    `angle` (4,) [rad] begins with the hip, `target.pose` with the thigh to the vertical: the hip less the trunk's
    `pitch` [rad]. `scale` is of `SCALES`, `target` of `TARGET`.
    """
    error = 0.0
    for joint in range(4):
        lean = pitch if joint == HIP else 0.0  # thigh to the vertical = hip - pitch
        error += scale.pose_share[joint] * (angle[joint] - target.pose[joint] - lean) ** 2
    return error


@part
def _force_distance(scale, forces, i, side, target, weight):
    """Return how far one foot's mean force in a step is outside the target's range, `weight` times forward and up
    added, and `EXCESS_SHARE` of the mean vertical force beyond `MAX_FORCE` [body weights].

    `forces` (W, N, side, contact, 2) [N], forward and up, are those of the step's windows; the body is number `i`.
    `scale` is of `SCALES`, `target` of `TARGET`.
    """
    count = len(forces)
    forward = up = excess = 0.0
    for window in range(count):
        contacts = forces[window, i, side]
        vertical = (contacts[0, 1] + contacts[1, 1] + contacts[2, 1]) / scale.weight
        forward += (contacts[0, 0] + contacts[1, 0] + contacts[2, 0]) / scale.weight / count
        up += vertical / count
        excess += max(vertical - MAX_FORCE, 0.0) / count
    beyond_forward = max(abs(forward - target.force[0]) - target.force_band[0], 0.0)
    beyond_up = max(abs(up - target.force[1]) - target.force_band[1], 0.0)
    return EXCESS_SHARE * excess + weight * beyond_forward + beyond_up


@part
def _impact(row, forces, i, seconds):
    """Return the term `impact` of body `i` [-]: the squared change of each foot's mean force since the last step.

    The sum over feet, forward and up, of (change [body weights] x `ACTIVATION_TIME` / `seconds`)^2; 0 in an episode's
    first step. The time makes it a number without unit, as in the term `acceleration`.

    `row` is of `TASK_ROW`, `forces` (W, N, side, contact, 2) [N] in the step's windows, `seconds` the time of the step.
    """
    if row.steps == 0:
        return 0.0
    impact = 0.0
    for side in range(2):
        for axis in range(2):
            change = 0.0
            for contact in range(3):
                change -= row.force[side, contact, axis]
                for window in range(len(forces)):
                    change += forces[window, i, side, contact, axis] / len(forces)
            impact += (change / row.scales.weight * ACTIVATION_TIME / seconds) ** 2
    return impact


@part
def _mean_speed(row, m, seconds):
    """Return the CoM's forward speed [m/s] after a low-pass of time constant `HELD_SECONDS`, with one step more.

    `row`, of `TASK_ROW`, has its value before the step of `seconds`; `m` is of `MEASURED`.
    """
    return row.mean_speed + seconds / HELD_SECONDS * (m.com_velocity[0] - row.mean_speed)


@part
def _acceleration(row, m, seconds):
    """Return the term `acceleration` of one body: the sum over joints of (mean acceleration x `ACTIVATION_TIME`^2)^2.

    The mean is over a step of `seconds`, from the joint velocities before it, in `row`, of `TASK_ROW`, and after it, in
    `m`, of `MEASURED`.
    """
    total = 0.0
    for side in range(2):
        for joint in range(4):
            change = m.velocity[side, joint] - row.velocity[side, joint]
            total += (change / seconds * ACTIVATION_TIME**2) ** 2
    return total


@part
def _step_error(control, target, length):
    """Return the difference of a step's `length` [m] and the planned one, over that, without sign.

    `control` is of `CONTROL_ROW`, `target` of `TARGET`.
    """
    planned = 0.5 * control.subject.scale.length * target.stride_length
    return abs(length - planned) / planned


@part
def remember(rows, controls, bodies, table, options, running) -> None:
    """Write mean speed, joint velocities, phase and step length of the bodies `running` (N,) into `rows`, for the next
    step's reward; the other arguments are as of `judge`."""
    curves = np.empty((2, table.shape[-1]))
    for i in range(len(rows)):
        if running[i]:
            m = bodies[i].measured
            rows[i].mean_speed = _mean_speed(rows[i], m, options[0].seconds)
            rows[i].velocity[:] = m.velocity
            phase = controls[i].legs.phase[LEFT]
            if (phase < 0.5) != (rows[i].left_phase < 0.5):  # another leg leads: it has touched down
                leader = LEFT if phase < 0.5 else RIGHT
                if rows[i].landed < np.inf:
                    target = targets_at(table, controls[i], curves)[leader]
                    rows[i].step_error = _step_error(controls[i], target, m.ankle[leader, 0] - rows[i].landed)
                rows[i].landed = m.ankle[leader, 0]
            rows[i].left_phase = phase


_charged_calf_stiffness = part(charged_calf_stiffness)


@part
def _charged_stiffness(scale, control, body, tendon, side, joint):
    """Return the K at one ankle or toe that the term `stiffness` charges [N m/rad].

    It is the whole K of muscles or of an adaptive device; with a `tendon` [N m/rad], 0 for none, at a calf's ankle only
    the part of `charged_calf_stiffness`. `scale` is of `SCALES`, `control` of `CONTROL_ROW`, `body` of `BODY_ROW`.
    """
    stiffness = muscle_stiffness(control.springs, side, joint)
    if joint > 0 or tendon == 0.0 or stiffness == 0.0 or control.feet.rests[side, joint]:
        return stiffness
    angle = body.measured.angle[side]
    unit = scale.strength_scale
    tissue = unit * tissue_stiffness(angle[KNEE], angle[ANKLE])
    return _charged_calf_stiffness(stiffness, tissue, body.muscles.moment[0, side, ANKLE], tendon, unit)


@part
def judge(rows, controls, bodies, table, options, forces, terms) -> None:
    """Fill `terms` (N, len(TERMS)): the reward's terms, unweighted and dimensionless, in the order of `TERMS`.

    Rewards in [0, 1]: `alive`; `speed`, `com_x`, `com_z`, exp(-(error/tolerance)^2) of the CoM against the ZMP plan;
    `zmp`, the same of the CoP of both feet against the planned ZMP, 0 in flight;
    `pose`, exp(-E/0.02) with E = 1/2 sum over legs of (3, `knee_weight`, 3, 0.1) x squared distance [rad^2] of thigh
    (to the vertical), knee, ankle and toe from the target at the leg's phase.
    `grf`, exp(-D/0.4) with D the body weights by which the feet's forces leave the target's range: vertical beyond 1.2
    (fourfold), both components beyond mean +- 0.5 SD at the leg's phase, forward times `forward_force_weight`.
    Costs >= 0: `stiffness_rate`, squared change of the action in 20 ms; `stiffness`, mean over legs of
    [(K_ankle/300)^2 + (K_toe/60)^2/4]/1.25, K of muscles and of an adaptive device (other devices and slack
    muscles cost nothing; with a tendon see `charged_calf_stiffness`), scaled to 1.70 m and 63 kg; `effort`, positive
    work of hips, knees, ankles and toes in the step over body weight times commanded way: its cost of transport. The
    cost of the muscles (`springfoot.gait.plan.effort`), one control window late: `fibre_work`, metabolic energy of
    their fibres over body weight times commanded way; `activation`, mean over the step of the squared activation by
    volume, all joints together; `activation_rate`, the same of `ACTIVATION_TIME` times the rate of the activation.
    `impact`, sum over feet and directions of the squared change of the force since the last step [body weights] x
    `ACTIVATION_TIME` over the time of a step. `speed_held`, distance of the CoM's mean speed
    (`HELD_SECONDS`) from the commanded one, over that; it does not saturate. `person_rate`, squared change of the
    offsets of rest angles in 20 ms, over `OFFSET_UNIT`, all six together. `acceleration`, sum over joints of the
    squared mean acceleration in the step x `ACTIVATION_TIME` squared [rad^2]. `step_length`, difference of the
    last step's length, between the ankles as each foot touched down, and the planned one, over that.

    Args:
        rows: (N,) of `TASK_ROW`.
        controls: (N,) of `CONTROL_ROW`.
        bodies: (N,) of `BODY_ROW`, as measured at the step's end.
        table: (R, SAMPLES, 2, C) of `TARGET`, of a `PhaseTable`.
        options: (1,) of `TASK_OPTIONS`.
        forces: (W, N, side, contact, 2) on the body [N] in the W control windows of the step.
        terms: as above.
    """
    curves = np.empty((2, table.shape[-1]))
    share = options[0].share
    for i in range(len(rows)):
        scale = rows[i].scales
        control = controls[i]
        m = bodies[i].measured
        targets = targets_at(table, control, curves)
        terms[i, ALIVE] = 1.0 if is_alive(m, scale.min_hip_height) else 0.0
        x, z, speed = error_of(control, targets, m)
        terms[i, COM_X] = exp(-((x / scale.tolerance[0]) ** 2))
        terms[i, COM_Z] = exp(-((z / scale.tolerance[1]) ** 2))
        terms[i, ZMP] = _near_zmp(scale, control, targets, m, forces, i)
        terms[i, SPEED] = exp(-((speed / scale.tolerance[2]) ** 2))
        pose_error = force_distance = stiffness_cost = stiffness_rate = 0.0
        for side in range(2):
            pose_error += 0.5 * _pose_error(scale, m.base[2], m.angle[side], targets[side])
            force_distance += _force_distance(scale, forces, i, side, targets[side], options[0].forward)
            for joint in range(2):
                k = _charged_stiffness(scale, control, bodies[i], options[0].tendon, side, joint)
                k /= scale.stiffness_unit[joint]
                stiffness_cost += 0.5 * scale.stiffness_share[joint] * k**2
        for k in range(4):
            stiffness_rate += ((control.decision.action[k] - control.decision.last_action[k]) / share) ** 2
        terms[i, POSE] = exp(-pose_error / POSE_TOLERANCE)
        terms[i, GRF] = exp(-force_distance / FORCE_TOLERANCE)
        terms[i, STIFFNESS] = stiffness_cost
        terms[i, STIFFNESS_RATE] = stiffness_rate
        muscles = bodies[i].muscles
        way = control.subject.speed * options[0].seconds
        terms[i, EFFORT] = muscles.positive_work / (scale.weight * way)
        terms[i, FIBRE_WORK] = muscles.energy.sum() / (scale.weight * way)
        terms[i, ACTIVATION] = muscles.activation / options[0].seconds
        terms[i, ACTIVATION_RATE] = muscles.activation_rate / options[0].seconds
        terms[i, IMPACT] = _impact(rows[i], forces, i, options[0].seconds)
        terms[i, STEP] = rows[i].step_error
        terms[i, SPEED_HELD] = terms[i, PERSON_RATE] = terms[i, SMOOTHNESS] = 0.0
        if terms[i, ALIVE] > 0.0:  # a body that diverged has no speeds
            held_speed = _mean_speed(rows[i], m, options[0].seconds)
            terms[i, SPEED_HELD] = abs(held_speed - control.subject.speed) / control.subject.speed
            terms[i, SMOOTHNESS] = _acceleration(rows[i], m, options[0].seconds)
            person = control.person
            for side in range(2):
                for joint in range(3):
                    change = person.offset[side, joint] - person.last_offset[side, joint]
                    terms[i, PERSON_RATE] += (change / share / OFFSET_UNIT) ** 2


@part
def total(terms, options, reward) -> None:
    """Fill `reward` (N,): weighted sum of `terms` (N, len(TERMS)), in proportion to the time of a step, 1 for 20 ms; 0
    where `alive` is 0. `options` (1,) of `TASK_OPTIONS`."""
    weights = options[0].weights
    share = options[0].share
    for i in range(len(reward)):
        reward[i] = 0.0
        for term in range(len(weights)):
            reward[i] += weights[term] * terms[i, term]
        reward[i] *= share * terms[i, ALIVE]


class Task:
    """Observation and reward of N bodies.

    Args:
        settings: the weights of the reward, and the time of a step.
        rows: leg constants and walk of each row of the tables (`envs.control.reference_walk.rows`).
        subjects: bodies and commanded speeds.
        feet: N pairs, the feet that each body has now; the simulation changes the list.
    """

    def __init__(
        self,
        settings: BipedSettings,
        rows: Sequence[tuple[LegConstants, ReferenceWalk]],
        subjects: Subjects,
        feet: Sequence[Feet],
    ) -> None:
        entries = entries_of(settings.acts)
        self.names = tuple(entry.name for entry in entries)
        self.low = LOW[: len(entries)]
        self.high = HIGH[: len(entries)]
        self.weights = DEFAULT_WEIGHTS | settings.reward_weights
        self.rows = np.zeros(len(subjects.bodies), TASK_ROW)
        """(N,) of `TASK_ROW`: all numbers that the task remembers of each environment."""
        weights = [self.weights[name] for name in TERMS]
        seconds = settings.step_seconds
        share = seconds / ACTION_STEP
        limit = settings.max_episode_steps
        tendon = settings.ankle_tendon or 0.0
        forward = settings.forward_force_weight
        self.options = np.array([(weights, seconds, share, limit, tendon, forward)], TASK_OPTIONS)
        """(1,) of `TASK_OPTIONS`."""
        curves = {walk: target_curves(walk.target, walk.plan, seconds) for _, walk in rows}
        self.table = PhaseTable(np.stack([curves[walk].view(float).reshape(len(GRID), -1) for _, walk in rows])).table
        """(R, SAMPLES, 2, C) of `TARGET`."""
        self._subjects = subjects
        self._feet = feet
        self._knee_weight = settings.knee_weight
        self.fit(range(len(self.rows)))

    def fit(self, ids: Iterable[int]) -> None:
        """Compute scales, units and entries of the feet anew for the present bodies and feet of environments `ids`."""
        for index in ids:
            body = self._subjects.bodies[index]
            self.rows["scales"][index] = body_scales(body, self._knee_weight)[0]
            self.rows["units"][index] = units_of(body)
            self.rows["height_ratio"][index] = body.length_scale
            self.rows["worn"][index] = worn_entries(body, self._feet[index])

    def reset(self, ids: NDArray, velocity: NDArray) -> None:
        """Begin an episode of bodies `ids` (K,), with the commanded speed for a mean.

        `velocity` (N, side, joint) is that of the joints of all bodies [rad/s]; rows `ids` are read.
        """
        self.rows["steps"][ids] = 0
        self.rows["force"][ids] = 0.0
        self.rows["mean_speed"][ids] = self._subjects.speed[ids]
        self.rows["velocity"][ids] = velocity[ids]
        self.rows["left_phase"][ids] = self._subjects.rows["legs"]["phase"][ids, LEFT]
        self.rows["landed"][ids] = np.inf
        self.rows["step_error"][ids] = 0.0

    def observe(self, bodies: NDArray, entries: int | None = None) -> NDArray:
        """Return the observation, float32 (N, D), clipped to its bounds: the settings' entries, or the first `entries`
        of `PERSON_OBSERVATION`.

        `bodies` (N,) of `BODY_ROW`.
        """
        observation = np.empty((len(self.rows), entries or len(self.names)), np.float32)
        observe(self.rows, self._subjects.rows, bodies, self.table, observation)
        return observation

    def tracking(self, bodies: NDArray) -> NDArray:
        """Return CoM minus target: x [m], z [m] and forward speed [m/s], shape (N, 3); `bodies` (N,) of `BODY_ROW`."""
        error = np.empty((len(self.rows), 3))
        track(self._subjects.rows, bodies, self.table, error)
        return error

    def planned_com(self, bodies: NDArray) -> NDArray:
        """Return the plan's CoM (x in the world, z) [m], shape (N, 2); `bodies` (N,) of `BODY_ROW`."""
        return bodies["measured"]["com"] - self.tracking(bodies)[:, :2]
