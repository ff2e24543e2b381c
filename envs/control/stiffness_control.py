"""Turn actions into stiffness, and stiffness into control of ankle and toe: tau = K (theta_eq - theta - beta
dtheta/dt).

The springs of muscles have the K of the actions or of the schedule; a device in their place, such as a passive
prosthetic foot, has its own, always: `foot_rows` has these springs, `envs.settings.feet` their numbers. Arrays (side,
2) have ankle and toe along the last axis; flattened, they are in the order of `ACTIONS`. Other axes: N bodies; a
`PhaseTable` (R, SAMPLES, 2, C) has R rows, phases, value and rise to the next phase, and C curves.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from springfoot.arrays import NDArray
from springfoot.gait.body.body import Body
from springfoot.gait.body.tissue import TENDON_SHARE

from ..physics.kernel import kernel, part
from ..physics.model import ANKLE, HIP, KNEE, TOE
from ..physics.muscles import muscleless_moments, tissue_stiffness
from ..physics.timing import CONTROL_WINDOW
from ..settings.settings import BipedSettings
from .foot_rows import device, foot_lines, foot_rows, has_lines_of
from .phase_table import PhaseTable, read
from .state import PLACE
from .subjects import Subjects
from .worn_feet import WornFeet

FEET = slice(ANKLE, None)
"""Ankle and toe along the joint axis: the joints with stiffness set by an action."""


def stiffness_ranges(settings: BipedSettings, body: Body) -> tuple[NDArray, NDArray]:
    """Return the stiffness at an action of -1 and of 1 for this body [N m/rad], each (2,) for ankle and toe."""
    low, high = np.array([settings.ankle_stiffness_range, settings.toe_stiffness_range]).T
    return low * body.stiffness_scale, high * body.stiffness_scale


def stiffness_of(action: NDArray, settings: BipedSettings, body: Body) -> NDArray:
    """Return stiffness (..., 2) of ankle and toe [N m/rad] for actions in [-1, 1] in absolute mode, on a log scale."""
    middle, factor = _log_scale(settings, body)
    return middle * factor**action


def _log_scale(settings: BipedSettings, body: Body) -> tuple[NDArray, NDArray]:
    """Return stiffness at action 0 [N m/rad], and the factor from there to the stiffness at action 1 [-], each (2,) for
    ankle and toe."""
    low, high = stiffness_ranges(settings, body)
    return np.sqrt(low * high), np.sqrt(high / low)


def action_of(stiffness: ArrayLike, settings: BipedSettings, body: Body) -> NDArray:
    """Return the action in [-1, 1] that gives a stiffness (..., 2) [N m/rad]; outside the range, the nearer end."""
    low, high = stiffness_ranges(settings, body)
    value = np.clip(np.asarray(stiffness, float), low, high)
    return 2.0 * np.log(value / low) / np.log(high / low) - 1.0


def draw_delay(settings: BipedSettings, random: np.random.Generator) -> int:
    """Return the number of control windows from the request of a stiffness until it acts, for one episode: the setting,
    or drawn from its range."""
    if settings.stiffness_delay_range_s is None:
        return round(settings.stiffness_delay_s / CONTROL_WINDOW)
    shortest, longest = (round(delay / CONTROL_WINDOW) for delay in settings.stiffness_delay_range_s)
    return int(random.integers(shortest, longest + 1))


SPRING_OPTIONS = np.dtype(
    [
        ("middle", float, 2),  # stiffness of ankle and toe at action 0 [N m/rad] where no schedule sets it
        ("tendon", float),  # largest stiffness of the calf with its tendon [N m/rad]; infinite without a bound
        ("tissue", float),  # factor on the stiffness of the ankle's passive tissue beside it [-]
        ("scheduled", np.int64, 2),  # 1 where an action is a factor on the schedule of ankle, of toe
        ("follows", np.int64),  # 1 if the rest angles change with the slope; constant ones do not
        ("held", np.int64),  # 1 if the rest angles are those of the phases at which K was set
    ]
)
"""Settings of the springs of one environment; stiffness is that of the tables' body."""


@part
def stiffen(rows, bodies, schedule, options, factor, walking, on_schedule) -> None:
    """Request new stiffness of the muscles at ankles and toes, to act after the delay.

    A body's first stiffness in an episode (`springs.fresh`) takes effect at once and does no work. Changing K to K'
    under a deflection x puts 1/2 (K' - K) x^2 into the spring.

    Args:
        rows: (N,) of `CONTROL_ROW`; `springs` is changed.
        bodies: (N,) of `BODY_ROW`, as measured now.
        schedule: (R, SAMPLES, 2, 2) the schedule's stiffness of ankle and toe [N m/rad], of a `PhaseTable`.
        options: (N,) of `SPRING_OPTIONS`.
        factor: (N, 4) factors of the actions on the stiffness [-].
        walking: (N,) bool; the springs of other bodies do not change.
        on_schedule: (N,) bool, the bodies that take the schedule's stiffness in place of the action's.
    """
    scheduled = np.empty(2)
    for i in range(len(rows)):
        option = options[i]
        springs = rows[i].springs
        subject = rows[i].subject
        angle = bodies[i].measured.angle
        for side in range(2):
            read(schedule, subject.place, rows[i].legs.phase[side], scheduled)
            springs.rest_phase[side] = rows[i].legs.phase[side]
            for joint in range(2):
                springs.work_stiffness[side, joint] = springs.work_equilibrium[side, joint] = 0.0
                if not walking[i]:
                    continue
                of_source = rows[i].source.scheduled if rows[i].source.not_action else option.scheduled[joint]
                base = scheduled[joint] if on_schedule[i] or of_source else option.middle[joint]
                ratio = 1.0 if on_schedule[i] else factor[i, 2 * side + joint]
                if not rows[i].feet.muscles[side, joint]:
                    ratio = 0.0  # a device is in their place
                before = springs.stiffness[side, joint]
                after = base * subject.scale.torque * ratio
                deflection = springs.equilibrium[side, joint] - angle[side, ANKLE + joint]
                springs.requests[0, side, joint] = after  # [0]: of the present window
                if springs.fresh:
                    springs.requests[:, side, joint] = after  # as if requested long before
                if springs.fresh or springs.delay == 0:
                    springs.stiffness[side, joint] = after
                if not springs.fresh and springs.delay == 0:
                    work = springs.taut[side, joint] * 0.5 * (after - before) * deflection**2
                    springs.work_stiffness[side, joint] = work


@part
def _act_on_request(springs, angle):
    """Set the muscles' stiffness to the one that was requested `delay` windows ago, and count the work of the change.

    The requests then shift by one window. `springs` is of `SPRING_STATE`, `angle` (side, joint) [rad].
    """
    for side in range(2):
        for joint in range(2):
            before = springs.stiffness[side, joint]
            after = springs.requests[springs.delay, side, joint]
            deflection = springs.equilibrium[side, joint] - angle[side, ANKLE + joint]
            springs.stiffness[side, joint] = after
            springs.work_stiffness[side, joint] += springs.taut[side, joint] * 0.5 * (after - before) * deflection**2
            for past in range(len(springs.requests) - 1, 0, -1):
                springs.requests[past, side, joint] = springs.requests[past - 1, side, joint]


@part
def _bound_by_tendon(row, option, angle):
    """Lower the K of calves to that of tendon and tissue at the joint angles `angle` (side, joint) [rad], and count the
    work of the change; an adaptive prosthesis has no tendon.

    `row` is of `CONTROL_ROW`, `option` of `SPRING_OPTIONS`. Index 0 of the springs' arrays is the ankle.
    """
    springs = row.springs
    for side in range(2):
        tissue = option.tissue * tissue_stiffness(angle[side, KNEE], angle[side, ANKLE])
        most = row.subject.scale.torque * (option.tendon + tissue)
        if springs.stiffness[side, 0] > most and not row.feet.rests[side, 0]:
            deflection = springs.equilibrium[side, 0] - angle[side, ANKLE]
            change = most - springs.stiffness[side, 0]
            springs.stiffness[side, 0] = most
            if not springs.fresh:
                springs.work_stiffness[side, 0] += springs.taut[side, 0] * 0.5 * change * deflection**2


@part
def _swings(row, force, side):
    """Return True if the leg of `side` swings: past mid-stride and unloaded.

    `row` is of `CONTROL_ROW`; `force` (side, contact, 2) the contact forces, forward and up [N].
    """
    load = force[side, 0, 1] + force[side, 1, 1] + force[side, 2, 1]  # upward, on heel, ball and toe
    return row.legs.phase[side] > 0.5 and load < row.legs.gains.touchdown


@part
def muscle_stiffness(springs, side, joint) -> float:
    """Return the acting K of the muscles at one joint [N m/rad], 0 while they are slack or a device replaces them.

    `springs` is of `SPRING_STATE`. The reward charges this K alone, of an ankle behind a tendon that of its muscle; the
    control and `info` hold the muscles' and the device's together.
    """
    return springs.taut[side, joint] * springs.stiffness[side, joint]


@part
def _put_into_control(row, control, feet, theta, side, joint):
    """Put K and K theta_eq of one joint, muscles and device together, into `control` (side, joint, 2) of one body.

    The other arguments are as for `envs.control.foot_rows.device`.
    """
    springs = row.springs
    muscles = muscle_stiffness(springs, side, joint)
    stiffness, drive = device(row, feet, theta, side, joint)
    springs.device[side, joint] = stiffness
    if stiffness > 0.0:
        springs.equilibrium[side, joint] = drive / stiffness  # no muscles act beside a device
    control[side, ANKLE + joint, 0] = muscles + stiffness
    control[side, ANKLE + joint, 1] = muscles * springs.equilibrium[side, joint] + drive


@part
def _leave_tissue(control, angle, scale):
    """Put the passive tissue of an ankle with slack muscles into `control` (joint, 2) of its leg: the tangent of its
    moment at the angles `angle` (joint,) [rad], for a body of that `Body.strength_scale`.

    Where muscles act, the moment of the tissue is a part of theirs.
    """
    moment = muscleless_moments(angle[HIP], angle[KNEE], angle[ANKLE], angle[TOE])[ANKLE]  # plantarflexion positive
    control[ANKLE, 0] = scale * tissue_stiffness(angle[KNEE], angle[ANKLE])
    control[ANKLE, 1] = control[ANKLE, 0] * angle[ANKLE] - scale * moment


@part
def move(rows, bodies, control, rest, incline, feet, options, walking) -> None:
    """Begin a control window: put K and K theta_eq of ankles and toes into the control.

    K is the requested stiffness of `delay` windows ago, bounded by an ankle's tendon at the present angles if the
    setting asks for it; theta_eq is the rest angle at the legs' phases, or that of the foot's setting. Moving the rest
    angle, so that the deflection goes from x to x', puts 1/2 K (x'^2 - x^2) into the spring. Muscles that go slack as
    the leg begins to swing lose their stored energy; passive tissue remains. A device has K and theta_eq of its own.

    Args:
        rows: (N,) of `CONTROL_ROW`; `springs` is changed.
        bodies: (N,) of `BODY_ROW`, as measured now; `muscles.slack` is set.
        control: (N, side, joint, 2) for `envs.physics.simulation.Simulation.advance`, filled.
        rest: (R, SAMPLES, 2, 2 or 4) rest angles of ankle and toe [rad], of a `PhaseTable`; with 4, the last two are
            torques [N m] that act beside the springs: each shifts the rest angle by torque / K.
        incline: (1, SAMPLES, 2, 4) their change on a slope, per radian (`envs.control.legs.slope_table`).
        feet: `envs.control.foot_rows.FootLines`, as a plain tuple.
        options: (N,) of `SPRING_OPTIONS`.
        walking: (N,) bool; the springs of other bodies do not change.
    """
    planned = np.empty(rest.shape[-1])
    inclined = np.empty(4)
    feeds = rest.shape[-1] > 2  # torques beside the springs
    first_row = np.zeros(1, PLACE)[0]
    for i in range(len(rows)):
        option = options[i]
        springs = rows[i].springs
        foot = rows[i].feet
        subject = rows[i].subject
        angle = bodies[i].measured.angle
        if walking[i] and springs.delay > 0:
            _act_on_request(springs, angle)
        if walking[i] and option.tendon < np.inf:
            _bound_by_tendon(rows[i], option, angle)
        for side in range(2):
            if not option.held:
                springs.rest_phase[side] = rows[i].legs.phase[side]
            read(rest, subject.place, springs.rest_phase[side], planned)
            if option.follows and subject.slope != 0.0:
                read(incline, first_row, springs.rest_phase[side], inclined)
                planned[0] += subject.slope * inclined[ANKLE]
            for joint in range(2):
                k = springs.stiffness[side, joint]
                theta = angle[side, ANKLE + joint]
                if walking[i]:
                    taut_before = taut = springs.taut[side, joint]
                    if not foot.in_swing[side, joint]:
                        taut = 0.0 if _swings(rows[i], bodies[i].measured.force, side) else 1.0
                        springs.taut[side, joint] = taut
                    new_rest = foot.rest[side, joint] if foot.rests[side, joint] else planned[joint]
                    if joint == 0 and not foot.rests[side, joint]:
                        new_rest += rows[i].person.offset[side, ANKLE]  # which lies there as among the joints
                    # A torque beside the spring of muscles shifts their rest angle by torque / K.
                    if feeds and foot.muscles[side, joint] and not foot.rests[side, joint]:
                        new_rest += subject.scale.torque * planned[2 + joint] / k
                    before = springs.equilibrium[side, joint] - theta  # deflections
                    after = new_rest - theta
                    springs.equilibrium[side, joint] = new_rest
                    if not springs.fresh:
                        springs.work_stiffness[side, joint] += 0.5 * (taut - taut_before) * k * before * before
                        springs.work_equilibrium[side, joint] += taut * 0.5 * k * (after * after - before * before)
                _put_into_control(rows[i], control[i], feet, theta, side, joint)
            slack = springs.taut[side, 0] == 0.0
            bodies[i].muscles.slack[side] = 1 if slack else 0
            if slack:
                _leave_tissue(control[i, side], angle[side], bodies[i].muscles.muscles.tissue)
        if walking[i]:
            springs.fresh = 0


@kernel
def _begin_devices(rows, feet, ids) -> None:
    """Set the K of devices in the bodies `ids` (K,) as an episode begins: constant, or of the schedule at the leg's
    phase; 0 of a torque-angle line, as no angle is known yet. `rows` and `feet` are as for `device`."""
    for i in ids:
        for side in range(2):
            for joint in range(2):
                stiffness = 0.0
                if rows[i].feet.line[side, joint] < 0:
                    stiffness, _ = device(rows[i], feet, 0.0, side, joint)
                rows[i].springs.device[side, joint] = stiffness


@kernel
def _hold(rows, bodies, control, feet, standing):
    """Let the muscles of standing bodies take over the K and K theta_eq that `envs.control.standing` has set.

    They act without delay, and the work of both changes is counted as in `stiffen` and `move`. A device, and a rest
    angle that the foot's setting gives, stay.

    Args:
        rows: (N,) of `CONTROL_ROW`; `springs` is changed.
        bodies: (N,) of `BODY_ROW`, as measured now.
        control: (N, side, joint, 2), which is read, and then has the devices as well.
        feet: `FootLines`, as a plain tuple.
        standing: (N,) bool.
    """
    for i in range(len(rows)):
        if not standing[i]:
            continue
        springs = rows[i].springs
        foot = rows[i].feet
        angle = bodies[i].measured.angle
        for side in range(2):
            for joint in range(2):
                k = control[i, side, ANKLE + joint, 0]
                drive = control[i, side, ANKLE + joint, 1]
                rest = foot.rest[side, joint] if foot.rests[side, joint] else drive / k
                k = k if foot.muscles[side, joint] else 0.0
                theta = angle[side, ANKLE + joint]
                k_before = springs.taut[side, joint] * springs.stiffness[side, joint]
                before = springs.equilibrium[side, joint] - theta
                after = rest - theta
                springs.stiffness[side, joint] = k
                springs.equilibrium[side, joint] = rest
                springs.taut[side, joint] = 1.0
                springs.requests[:, side, joint] = k
                if not springs.fresh:
                    springs.work_stiffness[side, joint] += 0.5 * (k - k_before) * before * before
                    springs.work_equilibrium[side, joint] += 0.5 * k * (after * after - before * before)
                _put_into_control(rows[i], control[i], feet, theta, side, joint)
            bodies[i].muscles.slack[side] = 0
        springs.fresh = 0


class FootSprings:
    """Ankle and toe springs of N bodies, and the work of changing them; the kernels `stiffen` and `move` act on them.

    Args:
        settings: ranges of stiffness, action mode, equilibrium.
        equilibrium: (R, SAMPLES, 2) rest angles over the stride [rad], one for each row of the tables; or (R, SAMPLES,
            4), torques beside the springs [N m] behind them.
        schedule: (R, SAMPLES, 2) the schedule's stiffness [N m/rad], which a residual action multiplies.
        subjects: bodies and commanded speeds.
        worn: the feet; the settings' if None.
    """

    def __init__(
        self,
        settings: BipedSettings,
        equilibrium: NDArray,
        schedule: NDArray,
        subjects: Subjects,
        worn: WornFeet | None = None,
    ):
        num = len(subjects.rows)
        self._settings = settings
        self._subjects = subjects
        self._worn = worn or WornFeet(settings, [settings.feet] * num)
        self._tabulated = self._worn.known
        self.feet = tuple(foot_lines(self._tabulated))
        """`FootLines`, as a plain tuple for kernels."""
        self._residual = settings.action_mode == "residual"
        _, factor = _log_scale(settings, subjects.bodies[0])
        self.factor_at_one = np.tile(factor, (1, 2))
        """(1, 4) factor of an action of 1 on the stiffness at action 0, where no schedule sets it [-]; of as many
        dimensions as the actions, without which NumPy's power of one body's takes twice as long."""
        self.options = np.zeros(num, SPRING_OPTIONS)
        """(N,) of `SPRING_OPTIONS`."""
        scheduled = [self._residual or settings.stiffness_joints not in ("both", joint) for joint in ("ankle", "toe")]
        self.options["scheduled"] = scheduled
        self.options["follows"] = settings.equilibrium in ("planned", "angle")
        self.options["held"] = settings.equilibrium == "phase"
        self.fit(range(num))
        self.rest = PhaseTable(equilibrium)
        self.schedule = PhaseTable(schedule)
        self._springs = subjects.rows["springs"]
        self._springs["fresh"] = 1
        self._springs["taut"] = 1.0

    def fit(self, ids: Sequence[int]) -> bool:
        """Compute options and rows anew for the feet and proportions that environments `ids` (K,) have now.

        Returns True if their feet needed new tables, `feet`.
        """
        tendon = np.inf if self._settings.ankle_tendon is None else TENDON_SHARE * self._settings.ankle_tendon
        for index in ids:
            body = self._subjects.table_body(index)
            middle, _ = _log_scale(self._settings, body)
            scale = body.strength_scale  # a load makes neither tendon nor tissue stiffer
            self.options[["middle", "tendon", "tissue"]][index] = middle, tendon * scale, scale
        pairs = self._worn.pairs
        new_lines = not has_lines_of(self._tabulated, [pairs[index] for index in ids])
        if new_lines:  # of feet that the options of a reset set
            self._tabulated = [*self._worn.known, *pairs]
            self.feet = tuple(foot_lines(self._tabulated))
            ids = range(len(pairs))
        feet = foot_rows(self._settings, [pairs[index] for index in ids], self._tabulated)
        self._subjects.rows["feet"][list(ids)] = feet
        return new_lines

    def reset(self, ids: NDArray, delay: ArrayLike = 0) -> None:
        """Begin an episode of springs `ids` (K,), with taut muscles.

        Their next stiffness does no work and has no delay, as if it had been requested long before. Later ones take
        effect `delay` (K,) control windows after their request.
        """
        self._springs["fresh"][ids] = 1
        self._springs["delay"][ids] = delay
        self._springs["taut"][ids] = 1.0
        _begin_devices(self._subjects.rows, self.feet, np.asarray(ids))

    def scheduled(self, leg_phase: NDArray) -> NDArray:
        """Return the schedule's K of ankle and toe (N, side, 2) [N m/rad] at the phases `leg_phase` (N, side)."""
        curves = self.schedule.at(leg_phase, self._subjects.place)
        return curves * self._subjects.scale["torque"][:, None, None]

    def factor(self, action: NDArray) -> NDArray:
        """Return the factors (N, 4) of actions (N, 4) on the stiffness at action 0, or on the schedule.

        Actions are in [-1, 1], in the order of `ACTIONS`. Computed by NumPy: powers in a kernel would have other last
        bits.
        """
        return np.exp(action) if self._residual else self.factor_at_one**action

    def hold(self, bodies: NDArray, control: NDArray, standing: NDArray) -> None:
        """Let the springs of the bodies `standing` (N,) take over the K and K theta_eq in `control`.

        `bodies` is (N,) of `BODY_ROW`, `control` (N, side, joint, 2).
        """
        _hold(self._subjects.rows, bodies, control, self.feet, standing)
