"""Stand, set off and stop: springs hold a body while it does not walk.

Before a walk both feet stand side by side, and every joint is a stiff spring. The ankles' rest angle keeps the CoM in
place over the feet; the hips keep the trunk upright. To set off, that place moves ahead until the body falls forward at
`OFF_SPEED`; then the body walks, slowly at first. To stop, the commanded speed goes down to `SLOW_SPEED`; soon after
the next touchdown the same springs hold the body as it is, one foot ahead of the other. Ankle and toe stiffness are
those of these springs while the body stands, and those of the schedule while it sets off and slows down. A policy
acts in the steady walk between, the only part of an episode that it has learnt.

Lengths, times, speeds and gains are for 1.70 m and 63 kg and scale with the body (see `envs.physics.model`), but for
the time of standing. Unless a source is given they were chosen by trial: bodies set off, walk and come to rest with
them (`tests/envs/control/test_standing.py`).
"""

from collections.abc import Sequence
from functools import lru_cache
from math import inf, sin, sqrt

import numpy as np
from scipy.optimize import brentq

from springfoot.arrays import NDArray
from springfoot.gait.body.body import Body

from ..physics.kernel import kernel, part
from ..physics.measurement import Measurement
from ..physics.model import ANKLE, HIP, KNEE
from ..physics.simulation import Physics
from ..physics.timing import CONTROL_WINDOW
from ..settings.settings import BipedSettings, body_of
from .subjects import Subjects

STANDING_STIFFNESS = (1200.0, 800.0, 350.0, 60.0)
"""Stiffness of hip, knee, ankle and toe [N m/rad]: two ankles must outdo gravity, body weight x CoM height (600)."""
BALANCE = 2.0
"""Plantarflexion of the ankles' rest angle for each metre the CoM is ahead of its place [rad/m]."""
TRUNK_STIFFNESS, TRUNK_DAMPING = 750.0, 140.0
"""Torque of each hip against the pitch of the trunk [N m/rad] and against its rate [N m s/rad]."""
TRUNK_FREE = 0.8
"""Fraction of the trunk's pitch that the hips' rest angle follows [-]: 0 holds thighs to the trunk, 1 to the
vertical."""

STAND_SECONDS = (0.8, 1.2)
"""Time of standing before the body sets off, drawn from this range [s]."""
STAND_KNEE = (0.05, 0.12)
"""Flexion of both knees in standing, drawn from this range [rad]."""
STAND_COM = 0.04
"""Place of the CoM ahead of the ankles [m]: people's, about the middle of the foot."""
LEAN, LEAN_SECONDS = 0.30, 0.5
"""Distance by which the place of the CoM moves ahead to set off [m], and the time of that move [s]."""
OFF_SPEED, OFF_PHASE = 0.30, 0.16
"""Forward speed of the CoM at which the body begins to walk [m/s], and the stride phase of its stance leg then [-]."""
OFF_SECONDS, EARLY_SECONDS = 1.0, 2.0
"""Longest time from the start of the lean to the start of the walk [s]; least time of walking with the schedule's
stiffness, which lasts until the commanded speed is reached [s]."""
SLOW_SPEED = 0.9
"""Commanded speed at setting off, and at the end of slowing down before a stop [m/s]."""
LANDED = (0.015, 0.06)
"""Stride phases of the landed leg between which a body stops [-], some 20 ms after touchdown."""
STOP_COM, STOP_PITCH = -0.05, 0.05
"""Place of the CoM ahead of the middle between the ankles [m], and trunk pitch [rad], of a stopped body."""
STOP_KNEE = 0.12
"""Flexion by which both knees give way when a body stops [rad]: on stiff legs it would tip over its front foot."""
HIP_HEIGHT, DRAW_SECONDS = 0.8, 0.5
"""Height of the hips of a stopped body [m], and the time constant [s] with which they take over the force that pushes
its feet apart; otherwise the feet creep, as friction alone holds them."""

WALKING, STANDING, STARTING, STOPPING, STOPPED = range(5)
"""Modes of a body: see `Standing.mode`."""


@kernel
def _switch(rows, bodies, running, time, stop_at):
    """Change the modes of bodies where that is due, and move the place at which the CoM of leaning bodies is held.

    Args:
        rows: (N,) of `CONTROL_ROW`; `held` is changed.
        bodies: (N,) of `BODY_ROW`, as measured now.
        running: (N,) bool; other bodies stay as they are.
        time: (N,) time in the episode [s].
        stop_at: time in the episode from which a body stops [s].

    Returns True if a mode changed.
    """
    changed = False
    for i in range(len(rows)):
        held = rows[i].held
        subject = rows[i].subject
        phase = rows[i].legs.phase
        if not running[i]:
            continue
        before = held.mode
        slow = SLOW_SPEED * held.time
        if before == STANDING and time[i] >= held.begin:
            leaned = min((time[i] - held.begin) / (LEAN_SECONDS * held.time), 1.0)  # from 0 to 1
            held.place = held.length * (STAND_COM + LEAN * leaned)
            if bodies[i].measured.com_velocity[0] > OFF_SPEED * held.time:
                held.mode = STARTING
                held.begin = time[i]
        elif (
            before == STARTING and time[i] >= held.begin + EARLY_SECONDS * held.time and subject.speed == subject.target
        ):
            held.mode = WALKING
        elif before in (WALKING, STARTING) and time[i] >= stop_at:
            held.mode = STOPPING
        elif before == STOPPING and subject.speed <= slow * (1.0 + 1e-9):  # equal but for rounding
            for side in range(2):
                if LANDED[0] <= phase[side] <= LANDED[1]:
                    held.mode = STOPPED
        changed = changed or held.mode != before
    return changed


@part
def _take_over_push(held, m):
    """Move the rest angles of the hips (`held.draw`) by a window's part, until the hips' torque takes over the push of
    the feet against each other.

    `held` is of `HELD`, `m` of `MEASURED`.
    """
    front = 0 if m.ankle[0, 0] > m.ankle[1, 0] else 1
    push = 0.0  # [N], half the difference of the feet's horizontal forces, positive if they push each other apart
    for contact in range(3):
        push += 0.5 * (m.force[1 - front, contact, 0] - m.force[front, contact, 0])
    torque = push * HIP_HEIGHT * held.length
    held.draw += CONTROL_WINDOW / (DRAW_SECONDS * held.time) * torque / (STANDING_STIFFNESS[HIP] * held.torque)


@kernel
def _drive(rows, bodies, control, standing):
    """Put stiffness [N m/rad] and drive torque [N m] of all joints of bodies `standing` (N,) into the control.

    Args:
        rows: (N,) of `CONTROL_ROW`; `held` is changed.
        bodies: (N,) of `BODY_ROW`, as measured now.
        control: (N, side, joint, 2) for `envs.physics.simulation.Simulation.advance`, filled.
        standing: (N,) bool.
    """
    for i in range(len(rows)):
        if not standing[i]:
            continue
        held = rows[i].held  # the springs that hold the body
        m = bodies[i].measured
        if held.mode == STOPPED:
            _take_over_push(held, m)
        ahead = m.com[0] - 0.5 * (m.ankle[0, 0] + m.ankle[1, 0]) - held.place
        trunk_torque = TRUNK_STIFFNESS * (m.base[2] - held.pitch) + TRUNK_DAMPING * held.time * m.base_velocity[2]
        for side in range(2):
            front = 1.0 if m.ankle[side, 0] > m.ankle[1 - side, 0] else -1.0
            for joint in range(4):
                k = STANDING_STIFFNESS[joint]
                rest = held.rest[side, joint]
                if joint == ANKLE:
                    rest -= BALANCE * ahead / held.length
                if joint == HIP:
                    rest += TRUNK_FREE * m.base[2] - trunk_torque / k - front * held.draw
                control[i, side, joint, 0] = k * held.torque
                control[i, side, joint, 1] = k * held.torque * rest


class Standing:
    """Modes of N bodies, and the springs that hold those that stand.

    Args:
        settings: time of the stop.
        subjects: bodies and commanded speeds; setting off and stopping change these speeds.
    """

    def __init__(self, settings: BipedSettings, subjects: Subjects):
        self._stop_at = inf if settings.stop_at is None else settings.stop_at
        self._subjects = subjects
        self._held = subjects.rows["held"]

    @property
    def mode(self) -> NDArray:
        """Return (N,) the mode of each body: in their order in time `STANDING`, `STARTING`, `WALKING`, `STOPPING`,
        `STOPPED`.

        In the middle three it walks, in `WALKING` steadily.
        """
        return self._held["mode"]

    def reset(
        self, ids: NDArray, randoms: Sequence[np.random.Generator], slope: NDArray, standing: bool
    ) -> tuple[NDArray, NDArray, NDArray, NDArray] | None:
        """Begin episodes of bodies `ids` (K,), all `standing` or all walking, on ground of a slope (K,) [rad].

        Returns the posture to stand in: angles (K, side, joint) [rad] and their rates [rad/s], pitch of the trunk (K,)
        [rad] and forward speed (K,) [m/s]; None for bodies that walk.
        """
        held = self._held
        held["mode"][ids] = STANDING if standing else WALKING
        for index, random in zip(ids.tolist(), randoms, strict=True):
            body = self._subjects.bodies[index]
            held[["length", "time", "torque"]][index] = body.length_scale, sqrt(body.length_scale), body.stiffness_scale
            if standing:
                held["begin"][index] = random.uniform(*STAND_SECONDS)
                held["rest"][index] = standing_posture(body, random.uniform(*STAND_KNEE))
            held["pitch"][index] = body.trunk_lean
        held["draw"][ids] = 0.0
        held["place"][ids] = STAND_COM * held["length"][ids]
        if not standing:
            return None
        held["rest"][ids, :, ANKLE] += slope[:, None]  # feet on the slope below upright legs
        angle = held["rest"][ids]
        pitch = held["pitch"][ids]
        # `_drive` adds TRUNK_FREE x pitch: the hips' rest angle is then that of the thigh to the vertical plus the
        # pitch.
        held["rest"][ids, :, HIP] += (1.0 - TRUNK_FREE) * pitch[:, None]
        return angle, np.zeros_like(angle), pitch, np.zeros(len(ids))

    def switch(self, physics: Physics, time: NDArray, running: NDArray) -> tuple[NDArray, NDArray]:
        """Let `running` (N,) bodies set off or stop where that is due, before a step at `time` (N,) [s].

        Returns two masks (N,): running bodies that walk, and those of them that walk with the schedule's stiffness.
        """
        mode = self._held["mode"]
        before = self._held["mode"].copy()
        if _switch(self._subjects.rows, physics.bodies, running, time, self._stop_at):
            self._begin_modes(before, Measurement.of(physics.bodies["measured"]))
        scheduled = running & ((mode == STARTING) | (mode == STOPPING))
        return scheduled | (running & (mode == WALKING)), scheduled

    def _begin_modes(self, before: NDArray, m: Measurement) -> None:
        """Begin the new mode of each body with another mode `before` (N,).

        Bodies that set off or stop get their commanded speed; those that have stopped get springs that hold them as
        they are, `m` being measured now.
        """
        held = self._held
        subjects = self._subjects
        new = [np.flatnonzero((before != held["mode"]) & (held["mode"] == mode)) for mode in range(5)]
        for ids, command in ((new[STARTING], subjects.begin), (new[STOPPING], subjects.end)):
            command(ids, np.minimum(subjects.speed[ids], SLOW_SPEED * held["time"][ids]))
        ids = new[STOPPED]
        held["rest"][ids] = m.angle[ids]
        # `_drive` adds TRUNK_FREE x pitch to the hips' rest angle; taken off here, the hips hold their present angle.
        held["rest"][ids, :, HIP] -= TRUNK_FREE * m.base[ids, 2, None]  # base: x, z and pitch of the trunk
        held["draw"][ids] = 0.0
        held["rest"][ids, :, KNEE] += STOP_KNEE
        held["pitch"][ids] = [self._subjects.bodies[index].trunk_lean + STOP_PITCH for index in ids.tolist()]
        held["place"][ids] = STOP_COM * held["length"][ids]

    def drive(self, bodies: NDArray, control: NDArray, standing: NDArray) -> None:
        """Put stiffness [N m/rad] and drive torque [N m] of bodies `standing` (N,) into `control` (N, side, joint, 2).

        `bodies` is (N,) of `BODY_ROW`.
        """
        _drive(self._subjects.rows, bodies, control, standing)


def steady_walk(settings: BipedSettings) -> tuple[float, float]:
    """Return times [s] between which a body walks at the settings' speed, neither setting off nor stopping."""
    begin = 0.0
    end = inf if settings.stop_at is None else settings.stop_at
    if settings.start == "standing":
        time_scale = sqrt(body_of(settings).length_scale)  # of speeds, too
        speed_up = max(settings.speed - SLOW_SPEED * time_scale, 0.0) / settings.speed_rate
        begin = STAND_SECONDS[1] + OFF_SECONDS * time_scale + max(EARLY_SECONDS * time_scale, speed_up)
    return begin, end


def off_phase(drawn: float) -> float:
    """Return the stride phase of the left leg at which a body sets off.

    The stance leg is the left one if the `drawn` phase is below 0.5, else the right one.
    """
    return OFF_PHASE + (0.0 if drawn < 0.5 else 0.5)


@lru_cache(maxsize=1024)
def standing_posture(body: Body, knee: float) -> tuple[float, ...]:
    """Return angles of thigh (to the vertical), knee, ankle and toe [rad] of a standing body with `knee` flexion [rad].

    The feet are flat, and the CoM is `STAND_COM` ahead of the ankles. Cached.
    """

    def com(shank: float) -> float:
        """Return the distance of the CoM ahead of `STAND_COM` [m], with the shank leaning back by `shank` [rad]."""
        knee_x = -body.shank_length * sin(shank)
        hip_x = knee_x - body.thigh_length * sin(shank + knee)
        moment = (body.trunk_mass + body.carried_mass) * hip_x  # trunk and load balance over the hip
        moment += 2 * body.thigh_mass * (hip_x + body.thigh_com * sin(shank + knee))
        moment += 2 * body.shank_mass * (knee_x + body.shank_com * sin(shank))
        moment += 2 * body.foot_mass * body.foot_com[0] + 2 * body.toe_mass * (body.ankle_to_toe_joint + body.toe_com)
        return moment / body.total_mass - STAND_COM * body.length_scale

    shank = float(brentq(com, -0.5, 0.5))  # type: ignore[arg-type]
    return shank + knee, knee, -shank, 0.0
