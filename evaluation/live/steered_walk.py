"""Walk one step after another under wishes that may change at any time.

This module knows no browser and no clock: `LiveView` shows the walk in real time, tests drive it step by step. The body
is one `Biped`. Actions set K, and the K that acted in the simulation is read back.
"""

import sys
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from math import ceil, inf, sqrt
from typing import Any, Literal

import numpy as np

from springfoot.arrays import NDArray
from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.batch.step_result import Tick
from springfoot.envs.batch.walk import Walked, walked_steps
from springfoot.envs.control.equilibrium import foot_curves
from springfoot.envs.control.reference_walk import reference_walk_at, rows, tabulated_speeds
from springfoot.envs.control.stiffness_control import FEET, action_of, stiffness_of
from springfoot.envs.physics.model import ACTIONS, SIDES
from springfoot.envs.physics.simulation import MjData, MjModel
from springfoot.envs.settings.checks import LONGEST_EPISODE
from springfoot.envs.settings.settings import TUNED, BipedSettings, body_of
from springfoot.errors import SpringfootError, require_number
from springfoot.gait import GRAVITY
from springfoot.gait.body.body import Body
from springfoot.gait.springs.stiffness import SPRINGS

from ..recording.policies import policy_and_settings
from .foot_entries import PlainFoot, entry_of, with_entry
from .refused import LIVE_REFUSES, PUSH_SECONDS

Source = Literal["policy", "scaled", "by hand"]
"""Source of K: the policy, the policy times a factor, or a number that the user sets."""

LIVE_SPEEDS = (0.6, 1.8)
"""Commanded speeds [m/s]; chosen: the range in which the fixed schedule walks, and a little beyond."""
LIVE_HEIGHTS, LIVE_MASSES = (1.45, 2.0), (45.0, 110.0)
"""Heights [m] and masses [kg]; chosen, as adults are."""
LIVE_FACTORS = (0.25, 4.0)
"""Factors on the policy's K [-]; chosen."""
OFFSETS_DEG = (-15.0, 15.0)
"""Offsets of theta_eq [deg]; chosen, larger than the ankle's motion in stance."""
LIVE_PUSHES = (-400.0, 400.0)
"""Horizontal pushes on the trunk, forward positive [N]; chosen."""
ENDLESS = sys.maxsize
"""Steps of a walk that only a fall ends."""
LYING_SECONDS = 1.0
"""Time for which a fallen body is shown before the walk restarts [s]."""


@dataclass(frozen=True, kw_only=True)
class Wishes:
    """The user's wishes for a live walk. Slope, body and feet restart it; all others act while it runs.

    The name of a wish is its field, or for an entry of a foot its path (`foot_entries`), as in
    `left_foot.ankle_stiffness`.
    """

    ankle_source: Source = "policy"
    toe_source: Source = "policy"
    ankle_factor: float = 1.0
    """Factor on the policy's K with the source `scaled` [-]."""
    toe_factor: float = 1.0
    ankle_stiffness: float = 300.0
    """K with the source `by hand` [N m/rad], of this body."""
    toe_stiffness: float = 40.0
    ankle_offset_deg: float = 0.0
    """Offset of theta_eq at both ankles, dorsiflexion positive [deg]."""
    toe_offset_deg: float = 0.0
    """Offset of theta_eq at both toes, up positive [deg]."""
    speed: float = BipedSettings.speed
    """Commanded speed [m/s]; the walk approaches it at the setting `speed_rate`."""
    slope_deg: float = BipedSettings.slope_deg
    height: float = BipedSettings.height
    mass: float = BipedSettings.mass
    carried_ratio: float = BipedSettings.carried_ratio
    left_foot: PlainFoot = "intact"
    right_foot: PlainFoot = "intact"

    def named(self, name: str) -> Any:
        """Return the value of the wish `name`: of a field, or of a foot's entry at the path behind the first point."""
        setting, _, path = name.partition(".")
        wish = getattr(self, setting)
        return entry_of(wish, path) if path else wish

    def changed(self, wishes: dict[str, Any]) -> "Wishes":
        """Return a copy with other values, `wishes` as name -> value; they are not checked."""
        new_wishes = self
        for name, wish in wishes.items():
            setting, _, path = name.partition(".")
            value = with_entry(getattr(new_wishes, setting), path, wish) if path else wish
            new_wishes = replace(new_wishes, **{setting: value})
        return new_wishes


OFFSETS = ("ankle_offset_deg", "toe_offset_deg")
"""Wishes that move theta_eq."""
ANEW = ("slope_deg", "height", "mass", "carried_ratio", "left_foot", "right_foot")
"""Wishes that restart the walk."""
OF_BODY = ("height", "mass", "carried_ratio")
"""Wishes about the body."""
WISH_RANGES = {
    "ankle_factor": LIVE_FACTORS,
    "toe_factor": LIVE_FACTORS,
    "ankle_offset_deg": OFFSETS_DEG,
    "toe_offset_deg": OFFSETS_DEG,
    "speed": LIVE_SPEEDS,
    "height": LIVE_HEIGHTS,
    "mass": LIVE_MASSES,
}
"""Allowed values of wishes that no setting bounds."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Frame:
    """Numbers of one step; sides are left and right, joints ankle and toe."""

    time: float
    """Time since the start of the walk [s]."""
    stiffness: NDArray
    """(side, joint) K that acted in the simulation in the step's last control window [N m/rad]."""
    equilibrium: NDArray
    """(side, joint) theta_eq that acted in the same window [rad]."""
    force: NDArray
    """(side, 4) ground reaction force of each foot: its point of action, forward and up [m], and its components,
    forward and up [body weights]."""
    speed: float
    """Forward speed of the CoM [m/s]."""
    push: float
    """Push on the trunk in this step [N]."""
    fell: str
    """Reason of a fall, "" while the body walks."""


class LiveSession:
    """One walk, steered by `ask`, `push` and `restart`, and advanced by `step`.

    Args:
        policy: any name that `springfoot evaluate` takes.
        given: initial settings, without those of `LIVE_REFUSES`. Settings that are also `Wishes` can change later.
        seed: of the walk.

    Raises `SpringfootError` for an unknown policy or a bad setting.
    """

    def __init__(self, policy: str, given: dict[str, Any] | None = None, seed: int = 0):
        for name, instead in LIVE_REFUSES.items():
            if (given or {}).get(name):  # 0 and None ask for nothing
                raise SpringfootError(f"live takes no {name}: {instead}")
        fixed = {
            "speed_range": LIVE_SPEEDS,
            "height_range": LIVE_HEIGHTS,
            "mass_range": LIVE_MASSES,
            "push_newton": 0.0,
        }
        settings = (given or {}) | fixed | {"episode_seconds": LONGEST_EPISODE}
        self._policy, self._settings = policy_and_settings(policy, settings, seed)
        self.name = policy
        self._sets_stiffness = self._settings.acts != "person" and self._settings.stiffness_by == "action"
        self._seed = seed
        self._push_force = 0.0  # of the last push [N]
        self._push_steps = 0  # steps for which it still acts
        self._lying_steps = 0  # steps for which a fallen body still lies
        self.falls = 0
        """Falls so far."""
        names = {item.name for item in fields(Wishes)}
        self.wishes = Wishes(**{name: value for name, value in (given or {}).items() if name in names})
        """Present wishes."""
        self._check(self.wishes)
        self._biped = self._make_biped(self.wishes)
        self.frame: Frame
        """Numbers of the last step."""
        self.restart()

    @property
    def dt(self) -> float:
        """Time of one step [s]."""
        return self._biped.dt

    @property
    def body(self) -> Body:
        """The body of the walk."""
        return body_of(replace(self._settings, **{name: getattr(self.wishes, name) for name in OF_BODY}))

    @property
    def person(self) -> str:
        """The name of the walk's learned person: of the setting `person`, or the policy that is one; "" for none."""
        if self._settings.acts != "stiffness":
            return self.name
        return "" if self._settings.walker == TUNED else self._settings.walker

    @property
    def model(self) -> MjModel:
        """The compiled model; another object after every change of body or feet."""
        return self._biped.model_of(0)

    def data(self) -> MjData:
        """Return a copy of the simulation's state, for drawing."""
        return self._biped.data(0)

    def stiffness_ranges(self) -> NDArray:
        """Return K that actions can give to this body, (joint, (lowest, highest)) [N m/rad]; the legs may exceed it."""
        ends = np.array([-1.0, 1.0])[:, None]  # the softest and the stiffest action
        return stiffness_of(ends, self._settings, self.body).T

    def ask(self, **wishes: Any) -> None:
        """Change wishes, given by name, and the walk with them; raise `SpringfootError`, with nothing changed, for
        impossible ones."""
        new_wishes = self.wishes.changed(wishes)
        self._check(new_wishes)
        before = self.wishes
        biped = self._biped
        changed = {item.name for item in fields(Wishes) if getattr(new_wishes, item.name) != getattr(before, item.name)}
        self.wishes = new_wishes
        try:
            if changed & {*ANEW}:  # another model: the walk begins again
                self._biped = self._make_biped(new_wishes)
                self.restart()
            # Offsets of theta_eq act through new tables of rest angles, which are of one speed: a new batch that takes
            # over the state.
            elif changed & {*OFFSETS} or (_rest_angle_offset(new_wishes).any() and "speed" in changed):
                self._biped = self._make_biped(new_wishes)
                self._biped.restore(biped.state())
                self._walk = walked_steps(self._biped, self._action, ENDLESS)
            if "speed" in changed:
                self._biped.command(np.arange(1), np.array([new_wishes.speed]))
        except SpringfootError:  # a wish that no check found: back to the walk before
            self.wishes = before
            self._biped = biped
            self._walk = walked_steps(biped, self._action, ENDLESS)
            raise

    def push(self, newton: float) -> None:
        """Push the trunk horizontally, forward positive [N], for `PUSH_SECONDS` from the next step on."""
        self._push_force = require_number("push", newton, *LIVE_PUSHES, unit="N")
        self._push_steps = ceil(PUSH_SECONDS / self.dt)

    def restart(self) -> None:
        """Restart the walk from its beginning, with the present wishes."""
        walker = {name: np.array([getattr(self.wishes, name)]) for name in ("height", "mass", "speed")}
        self._biped.reset(np.arange(1), [self._seed], None, walker)
        self._walk: Iterator[Walked] = walked_steps(self._biped, self._action, ENDLESS)
        self._steps = 0
        self._push_steps = self._lying_steps = 0
        nothing_yet = np.zeros((len(SIDES), len(SPRINGS)))  # no spring has acted
        speed = float(self._biped.measurement.com_velocity[0, 0])
        self.frame = Frame(
            time=0.0,
            stiffness=nothing_yet,
            equilibrium=nothing_yet,
            force=np.zeros((len(SIDES), 4)),
            speed=speed,
            push=0.0,
            fell="",
        )

    def step(self) -> Frame:
        """Walk one step of the environment; return its numbers.

        A fallen body lies for `LYING_SECONDS`, in which the last numbers stay; then the walk restarts.
        """
        if self._lying_steps:
            self._lying_steps -= 1
            if not self._lying_steps:
                self.restart()
            return self.frame
        force = self._push_force if self._push_steps else 0.0
        self._push_steps = max(0, self._push_steps - 1)
        self._biped.push(np.array([force]))
        ticks: list[Tick] = []
        self._biped.on_tick = ticks.append
        _, result = next(self._walk)  # fills `ticks`, one for each control window
        self._steps += 1
        last = ticks[-1]
        fell = str(result.reasons[0])
        self.frame = Frame(
            time=self._steps * self.dt,
            stiffness=last.stiffness[0][:, FEET],
            equilibrium=last.equilibrium[0][:, FEET],
            force=self._force(last),
            speed=float(last.measurement.com_velocity[0, 0]),
            push=force,
            fell=fell,
        )
        if fell:
            self.falls = self.falls + 1
            self._lying_steps = ceil(LYING_SECONDS / self.dt)
        return self.frame

    def _force(self, tick: Tick) -> NDArray:
        """Return CoP (x, z) [m] and ground reaction force (forward, up) [body weights] of each foot, (side, 4).

        Both are means over the control window `tick`; without load the CoP is 0.
        """
        force = tick.measurement.force[0]
        contact = tick.measurement.contact[0]
        load = force[..., 1]
        total = np.maximum(load.sum(axis=-1, keepdims=True), 1e-6)  # [N]; no division by 0 without load
        cop = (load[..., None] * contact).sum(axis=1) / total
        return np.concatenate([cop, force.sum(axis=1) / (self.body.total_mass * GRAVITY)], axis=-1)

    def _action(self, observation: NDArray) -> NDArray:
        """Return the action (1, A) that gives the wished K, clipped to [-1, 1]; a joint with the source `policy`, and
        every action that sets no K, keeps the policy's."""
        whole = np.array(self._policy(observation), float).reshape(1, -1)
        settings = self._settings
        if settings.acts == "person":  # and sets no stiffness
            return whole
        action = whole[:, : len(ACTIONS)].reshape(len(SIDES), len(SPRINGS))  # a view; the actions of a person follow
        body = self.body
        wishes = self.wishes
        residual = settings.action_mode == "residual"
        schedule = self._biped.scheduled_stiffness()[0] if residual else np.ones_like(action)  # (side, joint)
        # A residual action is the logarithm of K over the schedule's; an absolute one maps to a range of K.
        stiffness = schedule * np.exp(action) if residual else stiffness_of(action, settings, body)
        for joint, name in enumerate(SPRINGS):
            match getattr(wishes, f"{name}_source"):
                case "policy":
                    continue
                case "scaled":
                    stiffness[:, joint] *= getattr(wishes, f"{name}_factor")
                case "by hand":
                    stiffness[:, joint] = getattr(wishes, f"{name}_stiffness")
            joint_action = np.log(stiffness / schedule) if residual else action_of(stiffness, settings, body)
            action[:, joint] = np.clip(joint_action[:, joint], -1.0, 1.0)
        return whole

    def _make_biped(self, wishes: Wishes) -> Biped:
        """Return a batch of one body with slope, load, feet and offsets of the rest angles as in `wishes`.

        Its reset decides on height, mass and speed.
        """
        offset = _rest_angle_offset(wishes)
        wished_settings = ("slope_deg", "carried_ratio", "left_foot", "right_foot")
        settings = replace(self._settings, **{name: getattr(wishes, name) for name in wished_settings})
        if not offset.any():
            return Biped(settings, 1)
        # The wished body's speed at the Froude number of the settings' body, within the tabulated speeds.
        speeds = tabulated_speeds(settings)
        froude_speed = float(np.clip(wishes.speed / sqrt(wishes.height / settings.height), speeds[0], speeds[-1]))
        ((constants, walk),) = rows([reference_walk_at(settings, froude_speed)])
        rest, _ = foot_curves(settings, constants, walk)  # (SAMPLES, joint) [rad]
        return Biped(settings, 1, rest=rest[None] + offset)  # one row, the same at all speeds

    def _check(self, wishes: Wishes) -> None:
        """Raise `SpringfootError` for wishes outside their ranges, and for a source of K that the policy has no actions
        for."""
        for name, (low, high) in WISH_RANGES.items():
            require_number(name, getattr(wishes, name), low, high)
        for joint in SPRINGS:
            name = f"{joint}_stiffness"
            require_number(name, getattr(wishes, name), 0.0, inf, "N m/rad", above=True)
            source = getattr(wishes, f"{joint}_source")
            if source != "policy" and not self._sets_stiffness:
                raise SpringfootError(f"{joint}_source must be 'policy': its actions set no K, got {source!r}")
        replace(self._settings, **{name: getattr(wishes, name) for name in ANEW})  # the settings check the rest


def _rest_angle_offset(wishes: Wishes) -> NDArray:
    """Return the offsets of theta_eq at ankle and toe in `wishes`, (joint,) [rad]; dorsiflexion and toe-up positive."""
    return np.radians([getattr(wishes, name) for name in OFFSETS])
