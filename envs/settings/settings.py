"""Define every setting of the walking task: read from plain JSON values once, validated in one place.

Settings are flat, as `gym.make` takes them. Feet, `schedule` and `human` are held as objects; `settings_to_json` writes
them plain. Each setting also names its theme, for the groups of `--help`, the environment's table, and the standard
conditions of an evaluation.
"""

import json
from dataclasses import dataclass, field, fields, replace
from math import ceil
from pathlib import Path
from typing import Any, Literal, get_args

from springfoot.errors import SpringfootError, quoted, require_choice, require_number, require_within
from springfoot.gait.body.body import (
    BMI_RANGE,
    HEIGHT_RANGE,
    MASS_RANGE,
    REFERENCE_HEIGHT,
    REFERENCE_MASS,
    Body,
    CarriedAt,
)
from springfoot.gait.people.human import PEOPLE_FILE, STEP_TIME_RATIO_RANGE, HumanGait, human_gait
from springfoot.gait.people.own_data import OwnGait
from springfoot.gait.plan.plan import PLAN_SPEED_RANGE, Cadence
from springfoot.gait.springs.stiffness import LOWEST_STIFFNESS, StiffnessSchedule

from ..physics.contact import FRICTION
from ..physics.foot import Feet
from ..physics.timing import ACTION_STEP
from .checks import (
    check_bounds,
    check_guide,
    check_people_file,
    check_range,
    check_span,
    check_start,
    check_weights,
    check_windows,
    refusing_unknown,
    with_python_types,
)
from .drawn import DrawnBody, DrawnFoot, drawn_bodies_setting, drawn_feet_setting
from .feet import FOOT_SETTINGS, INTACT_FOOT, FootSetting, foot_setting

Equilibrium = Literal["planned", "angle", "neutral", "phase"]
Feedforward = Literal["people", "plan"]
Guide = Literal["people", "plan"]
ActionMode = Literal["absolute", "residual"]
Decisions = Literal["100hz", "50hz", "25hz", "event"]
Acts = Literal["stiffness", "person", "both"]
StiffnessBy = Literal["action", "schedule", "scaled", "constant", "random", "drawn"]
StiffnessJoints = Literal["both", "ankle", "toe"]

THEMES = {
    "body": "Whose body walks.",
    "feet": "What its feet are: intact, prosthetic, weak.",
    "speed": "How fast it is commanded to walk.",
    "reference": "Human data, or the plan, that the body follows.",
    "springs": "What its ankle and toe springs do, and which part of that the action decides.",
    "person": "Who moves the rest angles of hips, knees and ankles.",
    "episode": "How an episode starts and ends.",
    "ground": "What it walks on.",
    "disturbance": "What disturbs it: pushes, noise of the sensors, delay of the actuators.",
    "reward": "What it is rewarded for.",
}
"""Theme of settings -> its sentence, for the groups of `--help` and of the table of `SegmentedFootBiped`."""
CONDITION_THEMES = ("body", "speed", "episode", "ground", "disturbance")
"""Themes of an evaluation's conditions, which replace the settings of a policy's training."""

FRICTION_RANGE = (0.4, 1.2)
"""Allowed coefficients of friction, from a wet floor to rough rubber [-]; chosen."""
SLOPE_RANGE_DEG = (-5.0, 5.0)
"""Allowed slopes, uphill positive [deg]; ramps for wheelchairs have up to 4.8 (1:12, ADA Standards 2010, 405.2)."""
MOST_UNEVENNESS = 0.03
"""Largest unevenness [m]; chosen, as swinging feet clear the ground by about this much."""
MOST_SENSOR_NOISE = 0.1
"""Largest standard deviation of sensor noise, in units of the observation [-]; chosen."""
LONGEST_DELAY = 0.04
"""Longest delay of a stiffness behind its command [s]; chosen, two steps of 20 ms."""

FARTHEST_OFFSET_DEG = 30.0
"""Largest offset of a rest angle that the setting `person_range_deg` takes [deg]; chosen."""
FASTEST_AIM = 5.0
"""Largest setting `aim_rate` [1/s]; chosen: a fifth of a second, a third of a step."""
TENDON_RANGE = (100.0, 2000.0)
"""Stiffness of a tendon that the setting `ankle_tendon` takes [N m/rad]; chosen: a fourth and five times people's."""
TUNED = "tuned"
"""Name of the person without a network: the rest angles of the leg constants alone, tuned to people's walk."""
OWN_PERSON: dict[Guide, str] = {"people": TUNED, "plan": "predicted"}
"""Guide -> its own person, the walker where the setting `person` is None."""
DEFAULT_WEIGHTS = {
    "alive": 0.15,
    "speed": 0.40,
    "com_x": 0.20,
    "com_z": 0.10,
    "zmp": 0.50,
    "pose": 2.00,
    "grf": 5.00,
    "stiffness_rate": -0.10,
    "stiffness": -0.02,
    "effort": 0.0,
    "fibre_work": 0.0,
    "activation": 0.0,
    "impact": 0.0,
    "speed_held": 0.0,
    "person_rate": 0.0,
    "acceleration": 0.0,
    "step_length": 0.0,
    "activation_rate": 0.0,
}
"""Weight of each reward term (`springfoot.envs.task.reward`); a positive one rewards, the others are costs."""

_BODY, _FEET, _SPEED, _REFERENCE, _SPRINGS, _PERSON, _EPISODE, _GROUND, _DISTURBANCE, _REWARD = (
    {"theme": t} for t in THEMES
)
_DRAWN = {"drawn": True}  # the setting makes something differ between episodes, or change within one, by chance
_KEPT = {"kept": True}  # an evaluation keeps the policy's value, although it sets others of the theme anew
_REPLACED = {"replaced": True}  # an evaluation sets it anew, although it keeps others of the theme


@refusing_unknown
@dataclass(frozen=True, kw_only=True)
class BipedSettings:
    """The walking task of the biped with segmented feet; raises `SpringfootError` for a bad value.

    Feet, `schedule` and `human` may be given in plain JSON values as well, and are held as objects.
    """

    height: float = field(default=REFERENCE_HEIGHT, metadata=_BODY)
    """Standing height of the body [m]."""
    mass: float = field(default=REFERENCE_MASS, metadata=_BODY)
    """Body mass [kg]."""
    leg_ratio: float = field(default=1.0, metadata=_BODY)
    """Length of thigh and shank over the average at that height; the trunk takes the rest [-]."""
    foot_ratio: float = field(default=1.0, metadata=_BODY)
    """Length of the foot over the average at that height [-]."""
    carried_ratio: float = field(default=0.0, metadata=_BODY)
    """Mass of a load over body mass [-]."""
    carried_at: CarriedAt = field(default="back", metadata=_BODY)
    """Place of the load: on the back, or around the waist."""
    left_foot: FootSetting = field(default=INTACT_FOOT, metadata=_FEET)
    """The left foot, a kind of `springfoot.envs.settings.feet` (intact, rigid, rigid_toe, no_toe, passive, adaptive,
    weak, drop), a dictionary of a `kind` and its numbers, `{"kind": "passive", "ankle_stiffness": 600}`, or, on the
    command line, a file (`springfoot.gait.springs.foot_file`)."""
    right_foot: FootSetting = field(default=INTACT_FOOT, metadata=_FEET)
    """The right foot, likewise."""
    drawn_feet: tuple[DrawnFoot, ...] | None = field(default=None, metadata=_FEET | _DRAWN | _REPLACED)
    """Feet of which each reset draws one, in place of `left_foot` or `right_foot`: a list of dictionaries of `foot`, as
    for `left_foot`, `on` (one, either side with equal chance; both; left; right) and `weight`, the relative chance.
    Every number of a foot, and of its orthosis, may be a pair [low, high]: stiffness and damping are drawn evenly on
    the log scale, all else evenly. An evaluation is of `left_foot` and `right_foot`, whatever the policy was trained
    on."""
    speed: float = field(default=1.2, metadata=_SPEED)
    """Commanded walking speed [m/s]."""
    height_range: tuple[float, float] | None = field(default=None, metadata=_BODY | _DRAWN)
    """Heights drawn at each reset in place of `height` [m], evenly. Height and mass are drawn again if such a body
    cannot be."""
    mass_range: tuple[float, float] | None = field(default=None, metadata=_BODY | _DRAWN)
    """Body masses drawn at each reset in place of `mass` [kg], evenly and whatever the height."""
    drawn_bodies: tuple[DrawnBody, ...] | None = field(default=None, metadata=_BODY | _DRAWN)
    """Proportions, loads and step times of which each reset draws one: a list of dictionaries of `leg_ratio`,
    `foot_ratio`, `carried_ratio`, `step_time_ratio` (the settings' where left out) and `weight`, the relative chance.
    All are tabulated in the beginning."""
    speed_range: tuple[float, float] | None = field(default=None, metadata=_SPEED | _DRAWN)
    """Walking speeds drawn at each reset in place of `speed` [m/s], evenly."""
    speed_interval: float | None = field(default=None, metadata=_SPEED | _DRAWN)
    """Mean time between changes of the commanded speed within an episode, drawn from `speed_range` [s]."""
    speed_rate: float = field(default=0.25, metadata=_SPEED | _KEPT)
    """Rate at which the commanded speed goes to a new one [m/s^2]."""
    step_time_ratio: float = field(default=1.0, metadata=_SPEED)
    """Step time over people's at the same speed [0.8..1.2]; the step length changes likewise. Legs are too short for
    long steps at high speeds. It needs the cadence `people`."""
    cadence: Cadence = field(default="people", metadata=_REFERENCE)
    """Step length and time: as people choose them at this speed, the thesis's 0.6 m and 0.5 s, or those of the styles
    in `plan_file` (effort)."""
    guide: Guide = field(default="people", metadata=_REFERENCE)
    """Target of controller, feed-forward, start and reward: people's walk (people); or the plan's own (plan), with
    people's step length and time alone, or the plan's (`docs/results/prediction.md`)."""
    people_file: str | None = field(default=None, metadata=_REFERENCE)
    """File of people's data in place of `human_harmonics.json` of `springfoot.gait`, in the same form."""
    plan_file: str | None = field(default=None, metadata=_REFERENCE)
    """With guide `plan`: file of the plan's styles (`springfoot study predict`), not the package's."""
    equilibrium: Equilibrium = field(default="planned", metadata=_SPRINGS)
    """Rest angle of ankle and toe: the target's ankle angle with the moment of `feedforward` fed forward (planned),
    that angle alone, constant (neutral), or constant in each phase of `schedule` (phase)."""
    feedforward: Feedforward = field(default="people", metadata=_SPRINGS)
    """Joint moments that are fed forward to hips, knees and ankles: those measured on people at this speed, or those
    that inverse dynamics give for the plan. The constants of both were tuned on people's walk."""
    action_mode: ActionMode = field(default="absolute", metadata=_SPRINGS)
    """Action to stiffness: log scale over the range, or a factor exp(action) on `schedule` (residual)."""
    decisions: Decisions = field(default="50hz", metadata=_SPRINGS)
    """Times of decisions on stiffness: every step, of 10, 20 or 40 ms; or, in steps of 20 ms, of each leg at its heel
    strike and at the foot flat, heel-off and toe-off of the guide, the action being held between them (event)."""
    stiffness_joints: StiffnessJoints = field(default="both", metadata=_SPRINGS)
    """Joints with stiffness decided by the action; the other has the fixed schedule, and its actions are read as 0."""
    ankle_stiffness_range: tuple[float, float] = field(default=(LOWEST_STIFFNESS[0], 800.0), metadata=_SPRINGS)
    """Ankle stiffness at action -1 and +1 [N m/rad] for 1.70 m and 63 kg; scales with mass x height."""
    toe_stiffness_range: tuple[float, float] = field(default=(LOWEST_STIFFNESS[1], 200.0), metadata=_SPRINGS)
    """Toe stiffness at action -1 and +1 [N m/rad] for 1.70 m and 63 kg; scales with mass x height."""
    ankle_tendon: float | None = field(default=None, metadata=_SPRINGS)
    """Stiffness of the Achilles tendon about the ankle, for 1.70 m and 63 kg, [100..2000 N m/rad], such as 400. In
    walking a calf's K then is at most that of tendon and passive tissue as each 10 ms begin, and the term `stiffness`
    charges the calf's own K beyond the part that its torque brings. By default there is no bound."""
    schedule: StiffnessSchedule | None = field(default=None, metadata=_SPRINGS)
    """Stiffness over the stride, JSON form of `springfoot.gait.springs.stiffness.StiffnessSchedule`; needed by
    equilibrium `phase`; action mode `residual` without one takes the fixed schedule of the leg tuning."""
    acts: Acts = field(default="stiffness", metadata=_PERSON)
    """Part that the action sets: the stiffness of ankles and toes; the person, that is, offsets to the rest angles of
    hips, knees and ankles, every 20 ms; or both (`springfoot.envs.control.person_actions`)."""
    person: str | None = field(default=None, metadata=_PERSON)
    """Walker where the action sets stiffness alone: by default the guide's own, the tuned rest angles (tuned) or
    the person trained on the plan (predicted); one trained on other feet, bodies and slopes (learned, learned-2 to
    learned-5); or another one trained on the same guide, a policy file of `springfoot train --preset person`,
    or `predict`. On the plan nothing is tuned, so that `tuned` falls there."""
    person_range_deg: float = field(default=14.0, metadata=_PERSON)
    """Largest offset of a rest angle, that of an action of 1 [0..30 deg]."""
    aim_rate: float = field(default=0.0, metadata=_PERSON)
    """Rate at which a person that walks too slowly aims at more than the commanded speed, one too fast at less [0..5
    1/s]; the person observes by how much, at most 0.2 m/s."""
    stiffness_by: StiffnessBy = field(default="action", metadata=_PERSON | _REPLACED)
    """Source of the stiffness where the action moves the person: the action, with `acts` `person` the fixed schedule;
    that schedule always (schedule); the schedule times a
    factor drawn at each reset (scaled); one drawn stiffness of the ankles and one of the toes (constant); one drawn
    anew in every step (random); or a drawn one of these, mostly the action (drawn). Devices keep their own."""
    human: OwnGait | None = field(default=None, metadata=_REFERENCE)
    """One person's own walk in place of people's, JSON form of `springfoot.gait.people.own_data.OwnGait` (on the
    command line a CSV, OpenSim or C3D file): posture, forces, feed-forward, and at cadence `people` the step time
    follow it."""
    episode_seconds: float = field(default=20.0, metadata=_EPISODE | _KEPT)
    """Time after which an episode is truncated [s]."""
    start: Literal["random", "standing"] | float = field(default="random", metadata=_EPISODE)
    """Start of an episode: walking at this stride phase of the left leg [0..1), at a random one within single support,
    or standing: the body sets off by itself within 3 s (`springfoot.envs.control.standing`)."""
    stop_at: float | None = field(default=None, metadata=_EPISODE)
    """Time in the episode from which the body slows down, then stops and stands [s]; not before 3 s if it starts
    standing."""
    start_noise: float = field(default=0.0, metadata=_EPISODE)
    """Relative spread of the joint angles and velocities at the start [0..1]."""
    push_newton: float = field(default=0.0, metadata=_DISTURBANCE)
    """Size of each push on the trunk, forward or backward at random [N] for 63 kg; scales with mass; 0 for none."""
    push_seconds: float = field(default=0.1, metadata=_DISTURBANCE | _KEPT)
    """Duration of each push [s]."""
    push_interval: float = field(default=4.0, metadata=_DISTURBANCE | _KEPT)
    """One push at a random time in each interval of this length [s]."""
    friction: float = field(default=FRICTION, metadata=_GROUND)
    """Coefficient of friction between feet and ground [0.4..1.2]."""
    slope_deg: float = field(default=0.0, metadata=_GROUND)
    """Slope of the ground [-5..5 deg], uphill positive."""
    slope_range_deg: tuple[float, float] | None = field(default=None, metadata=_GROUND | _DRAWN)
    """Slopes drawn at each reset in place of `slope_deg` [deg], evenly."""
    unevenness_m: float = field(default=0.0, metadata=_GROUND)
    """Largest height of a footfall's ground above or below the mean ground [0..0.03 m], drawn evenly; a swinging foot
    gets the ground of its next footfall in mid-swing."""
    sensor_noise: float = field(default=0.0, metadata=_DISTURBANCE)
    """Standard deviation of Gaussian noise, new at every step, on all measured entries of the observation, in their
    dimensionless units [0..0.1]: 0.01 is 0.6 deg, 9 mm of hip height, 2 deg/s, and 1 % of body weight."""
    stiffness_delay_s: float = field(default=0.0, metadata=_DISTURBANCE)
    """Delay with which a new ankle or toe stiffness acts [0..0.04 s, in steps of 0.01 s]."""
    stiffness_delay_range_s: tuple[float, float] | None = field(default=None, metadata=_DISTURBANCE | _DRAWN)
    """Delays drawn at each reset in place of `stiffness_delay_s`, evenly from the steps of 0.01 s [s]."""
    reward_weights: dict[str, float] = field(default_factory=dict, metadata=_REWARD)
    """Weights that differ from `DEFAULT_WEIGHTS`, by the name of the reward term [-]."""
    forward_force_weight: float = field(default=1.0, metadata=_REWARD)
    """Weight of the forward force against the vertical one in the term `grf` [0..10]: people's is a fifth as large."""
    knee_weight: float = field(default=2.5, metadata=_REWARD)
    """Weight of the knee's squared error in the term `pose` [0..20], where thigh and ankle weigh 3."""

    def __post_init__(self) -> None:
        """Check all settings, and turn plain JSON values into objects before the checks that read these."""
        body_of(self)  # raises for an impossible one
        require_within("speed", self.speed, PLAN_SPEED_RANGE, "m/s")
        self._check_draws()
        for name, choices in (
            *(("cadence", Cadence), ("guide", Guide), ("equilibrium", Equilibrium), ("feedforward", Feedforward)),
            *(("action_mode", ActionMode), ("decisions", Decisions), ("stiffness_joints", StiffnessJoints)),
            *(("acts", Acts), ("stiffness_by", StiffnessBy)),
        ):
            require_choice(name, getattr(self, name), get_args(choices))
        for name in FOOT_SETTINGS:
            object.__setattr__(self, name, foot_setting(name, getattr(self, name)))
        object.__setattr__(self, "drawn_feet", drawn_feet_setting(self.drawn_feet))
        object.__setattr__(self, "drawn_bodies", drawn_bodies_setting(self.drawn_bodies, body_of(self)))
        check_range("ankle_stiffness_range", self.ankle_stiffness_range, "N m/rad")
        check_range("toe_stiffness_range", self.toe_stiffness_range, "N m/rad")
        if self.schedule is not None and not isinstance(self.schedule, StiffnessSchedule):
            object.__setattr__(self, "schedule", StiffnessSchedule.from_json(self.schedule))
        if self.schedule is None and self.equilibrium == "phase":
            raise SpringfootError("equilibrium 'phase' needs a schedule, which brings its own rest angles, got None")
        if self.human is not None and not isinstance(self.human, OwnGait):
            object.__setattr__(self, "human", OwnGait.from_json(self.human))
        require_number("step_time_ratio", self.step_time_ratio, *STEP_TIME_RATIO_RANGE)
        drawn_ratios = [body.step_time_ratio or 1.0 for body in self.drawn_bodies or ()]
        if self.cadence != "people" and {self.step_time_ratio, *drawn_ratios} != {1.0}:
            raise SpringfootError(f"step_time_ratio needs cadence 'people', got {self.cadence!r}")
        check_people_file(self.people_file)
        check_guide(self.follows_plan, self.human, self.plan_file, self.cadence)
        require_number("episode_seconds", self.episode_seconds, self.step_seconds, unit="s")
        check_start(self.start)
        if self.stop_at is not None:
            require_number("stop_at", self.stop_at, 3.0 if self.start == "standing" else 0.0, unit="s")
        require_number("start_noise", self.start_noise, 0.0, 1.0, "(relative)")
        require_number("push_newton", self.push_newton, 0.0, unit="N")
        require_number("push_interval", self.push_interval, 0.0, unit="s", above=True)
        require_number("push_seconds", self.push_seconds, 0.0, self.push_interval, "s (push_interval)", above=True)
        self._check_world()
        self._check_person()
        check_weights(self.reward_weights, DEFAULT_WEIGHTS)
        require_number("forward_force_weight", self.forward_force_weight, 0.0, 10.0)
        require_number("knee_weight", self.knee_weight, 0.0, 20.0)
        check_bounds(self)

    @property
    def feet(self) -> Feet:
        """Return the left and the right foot, for the physics."""
        return self.left_foot.foot, self.right_foot.foot

    @property
    def follows_plan(self) -> bool:
        """Return True with guide `plan`: the target is then the plan's own gait, else that of people."""
        return self.guide == "plan"

    @property
    def walker(self) -> str:
        """Return the walker where the action sets stiffness alone: the setting `person`, or the guide's own; `TUNED`
        where the policy itself moves the legs."""
        return TUNED if self.acts != "stiffness" else self.person or OWN_PERSON[self.guide]

    @property
    def step_seconds(self) -> float:
        """Return the time of one step of the environment [s]."""
        return {"100hz": 0.5, "25hz": 2.0}.get(self.decisions, 1.0) * ACTION_STEP  # 20 ms in all other cases

    @property
    def max_episode_steps(self) -> int:
        """Return the steps after which an episode is truncated: `episode_seconds`, to the nearest step, half a step
        down."""
        return ceil(self.episode_seconds / self.step_seconds - 0.5)

    def _check_draws(self) -> None:
        """Raise `SpringfootError` for bad ranges of drawn bodies and speeds, and for bad changes of speed."""
        for name, allowed, unit in (
            *(("height_range", HEIGHT_RANGE, "m"), ("mass_range", MASS_RANGE, "kg")),
            ("speed_range", PLAN_SPEED_RANGE, "m/s"),
        ):
            if getattr(self, name) is not None:
                check_range(name, getattr(self, name), unit)
                for value in getattr(self, name):
                    require_within(name, value, allowed, unit)
        short, tall = self.height_range or (self.height, self.height)
        light, heavy = self.mass_range or (self.mass, self.mass)
        # Not all pairs of height and mass have to make a body: bodies are drawn until one is possible.
        if light / tall**2 > BMI_RANGE[1] or heavy / short**2 < BMI_RANGE[0]:
            raise SpringfootError(
                "height_range and mass_range must have a body with a body-mass index in "
                f"[{BMI_RANGE[0]:g}, {BMI_RANGE[1]:g}] kg/m^2, got {light / tall**2:.3g} to {heavy / short**2:.3g}"
            )
        if self.speed_interval is not None:
            require_number("speed_interval", self.speed_interval, self.step_seconds, unit="s")
            if self.speed_range is None:
                raise SpringfootError("speed_interval needs a speed_range to draw from, got None")
        require_number("speed_rate", self.speed_rate, 0.0, unit="m/s^2", above=True)

    def _check_person(self) -> None:
        """Raise `SpringfootError` for `person`, `acts`, `stiffness_by` and `decisions` that do not go together."""
        require_number("person_range_deg", self.person_range_deg, 0.0, FARTHEST_OFFSET_DEG, unit="deg")
        require_number("aim_rate", self.aim_rate, 0.0, FASTEST_AIM, unit="1/s")
        if self.person is not None and (not isinstance(self.person, str) or not self.person):
            raise SpringfootError(
                f"person must be None, 'tuned' or the name of a policy file, got {quoted(self.person)}"
            )
        if self.person == OWN_PERSON[self.guide]:
            object.__setattr__(self, "person", None)  # one value for one walk: settings with it are equal
        if self.acts == "stiffness":
            if self.stiffness_by != "action":
                raise SpringfootError(f"stiffness_by {self.stiffness_by!r} needs acts 'person' or 'both'")
            return
        if self.person not in (None, TUNED):
            raise SpringfootError(
                f"acts {self.acts!r}: the policy itself moves the legs, so that person must be 'tuned'"
            )
        if self.decisions not in ("50hz", "event"):
            raise SpringfootError(f"acts {self.acts!r} needs steps of 20 ms, decisions '50hz' or 'event'")

    def _check_world(self) -> None:
        """Raise `SpringfootError` for bad ground, noise or delays."""
        require_number("friction", self.friction, *FRICTION_RANGE)
        require_number("slope_deg", self.slope_deg, *SLOPE_RANGE_DEG, unit="deg")
        check_span("slope_range_deg", self.slope_range_deg, SLOPE_RANGE_DEG, "deg")
        require_number("unevenness_m", self.unevenness_m, 0.0, MOST_UNEVENNESS, "m")
        require_number("sensor_noise", self.sensor_noise, 0.0, MOST_SENSOR_NOISE, "(observation units)")
        if self.ankle_tendon is not None:
            require_number("ankle_tendon", self.ankle_tendon, *TENDON_RANGE, "N m/rad")
        require_number("stiffness_delay_s", self.stiffness_delay_s, 0.0, LONGEST_DELAY, "s")
        check_span("stiffness_delay_range_s", self.stiffness_delay_range_s, (0.0, LONGEST_DELAY), "s")
        check_windows("stiffness_delay_s", self.stiffness_delay_s)
        check_windows("stiffness_delay_range_s", self.stiffness_delay_range_s)


THEME_OF: dict[str, str] = {item.name: item.metadata["theme"] for item in fields(BipedSettings)}
"""Theme of each setting, by its name."""
DRAWN_SETTINGS = tuple(item.name for item in fields(BipedSettings) if item.metadata.get("drawn"))
"""Settings by which something differs between episodes, or changes within one, by chance."""
CONDITION_SETTINGS = tuple(
    item.name
    for item in fields(BipedSettings)
    if (item.metadata["theme"] in CONDITION_THEMES and not item.metadata.get("kept")) or item.metadata.get("replaced")
)
"""Settings that every evaluation replaces; a trained policy brings the others with it."""


def settings_from(**values: Any) -> BipedSettings:
    """Return settings from plain JSON values by name: lists become tuples, numbers become floats.

    Raises `SpringfootError` for a bad value, and for an unknown name one that is a `TypeError` too.
    """
    converted = {
        name: value if name in FOOT_SETTINGS else with_python_types(value)  # a foot's lists stay lists
        for name, value in values.items()
    }
    return BipedSettings(**converted)


def settings_to_json(settings: BipedSettings) -> dict[str, Any]:
    """Return settings as a dictionary of plain JSON values; `settings_from(**settings_to_json(s)) == s`."""
    values = {item.name: getattr(settings, item.name) for item in fields(settings)}
    return json.loads(json.dumps(values, default=lambda value: value.to_json()))


def body_of(settings: BipedSettings) -> Body:
    """Return the settings' body; raise `SpringfootError` for an impossible one."""
    return Body(**{item.name: getattr(settings, item.name) for item in fields(Body)})


def with_bodies_of_model(settings: BipedSettings) -> BipedSettings:
    """Return the settings with only the drawn bodies on which the compiled model depends: the first, and the first with
    a load, which adds a part to the model."""
    bodies = settings.drawn_bodies
    if bodies is None:
        return settings
    loaded = [] if bodies[0].carried_ratio else [body for body in bodies[1:] if body.carried_ratio]
    return replace(settings, drawn_bodies=(bodies[0], *loaded[:1]))


def settings_of_bodies(settings: BipedSettings) -> tuple[BipedSettings, ...]:
    """Return a copy of the settings for each of `drawn_bodies`, with it as the body; the settings alone without any."""
    if settings.drawn_bodies is None:
        return (settings,)
    return tuple(replace(settings, drawn_bodies=None, **drawn.ratios) for drawn in settings.drawn_bodies)


def plan_file_of(settings: BipedSettings) -> Path | None:
    """Return the path of the setting `plan_file`, with the plan's style and leg constants; None for the package's."""
    return None if settings.plan_file is None else Path(settings.plan_file)


def reference_gait(settings: BipedSettings, speed: float | None = None) -> HumanGait:
    """Return people's gait, or that of `settings.human`, for the body's height at `speed` [m/s], the settings' if None.

    People's data come from the setting `people_file`, or from the package; its step time and length are
    multiplied by the setting `step_time_ratio`.
    """
    people = PEOPLE_FILE if settings.people_file is None else Path(settings.people_file)
    speed = settings.speed if speed is None else speed
    if settings.human is None:
        gait = human_gait(speed, settings.height, people)
    else:
        gait = settings.human.gait(speed, settings.height, people)
    return gait if settings.step_time_ratio == 1.0 else gait.paced(settings.step_time_ratio)
