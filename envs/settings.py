"""Everything that can be set about the walking task: plain JSON values, validated in one place."""

import json
from copy import deepcopy
from dataclasses import asdict, dataclass, field, fields
from difflib import get_close_matches
from math import isfinite
from numbers import Real
from typing import Any, Literal, get_args

from springfoot.gait.body import BMI_RANGE, HEIGHT_RANGE, MASS_RANGE, REFERENCE_HEIGHT, REFERENCE_MASS, Body
from springfoot.gait.errors import SpringfootError, as_float, require_number, require_within
from springfoot.gait.human import HumanGait, human_gait
from springfoot.gait.own_data import OwnGait
from springfoot.gait.plan import PLAN_SPEED_RANGE, Cadence
from springfoot.gait.stiffness import LOWEST_STIFFNESS, StiffnessSchedule

from .physics.foot_contact import FRICTION
from .timing import ACTION_STEP, CONTROL_WINDOW

Equilibrium = Literal["planned", "angle", "neutral", "phase"]
Feedforward = Literal["people", "plan"]
ActionMode = Literal["absolute", "residual"]
Decisions = Literal["100hz", "50hz", "25hz", "event"]
StiffnessJoints = Literal["both", "ankle", "toe"]


FRICTION_RANGE = (0.4, 1.2)
"""Of coefficients of friction, from wet floor to rough rubber."""
SLOPE_RANGE_DEG = (-5.0, 5.0)
"""Of slopes, uphill positive [deg]; ramps for wheelchairs have 4.8."""
MOST_UNEVENNESS = 0.03
"""Largest unevenness [m]; feet swing about this far above the ground."""
MOST_SENSOR_NOISE = 0.1
"""Largest standard deviation of sensor noise, in units of the observation."""
LONGEST_DELAY = 0.04
"""Of a stiffness behind its command [s]."""

DEFAULT_WEIGHTS = {
    "alive": 0.15,
    "speed": 0.50,
    "com_x": 0.15,
    "com_z": 0.10,
    "pose": 0.60,
    "grf": 0.70,
    "stiffness_rate": -0.05,
    "stiffness": -0.02,
}
"""Weight of each reward term (`springfoot.envs.task.reward`); a positive one rewards, a negative one is a cost."""


@dataclass(frozen=True, kw_only=True)
class BipedSettings:
    """The walking task of the biped with segmented feet; raises `SpringfootError` for a bad value."""

    height: float = REFERENCE_HEIGHT
    """Standing height of the body [m]."""
    mass: float = REFERENCE_MASS
    """Body mass [kg]."""
    leg_ratio: float = 1.0
    """Length of thigh and shank over the average at that height; the trunk takes the rest [-]."""
    foot_ratio: float = 1.0
    """Length of the foot over the average at that height [-]."""
    carried_ratio: float = 0.0
    """Mass of a load on the back over body mass [-]."""
    speed: float = 1.2
    """Commanded walking speed [m/s]."""
    height_range: tuple[float, float] | None = None
    """Heights drawn at each reset in place of `height` [m], evenly; with the mass anew if they make no body."""
    mass_range: tuple[float, float] | None = None
    """Body masses drawn at each reset in place of `mass` [kg], evenly and whatever the height."""
    speed_range: tuple[float, float] | None = None
    """Walking speeds drawn at each reset in place of `speed` [m/s], evenly."""
    speed_interval: float | None = None
    """Mean time between changes of the commanded speed within an episode, drawn from `speed_range` [s]."""
    speed_rate: float = 0.25
    """Rate at which the commanded speed goes to a new one [m/s^2]."""
    cadence: Cadence = "people"
    """Step length and time: as people choose them at this speed, or the thesis's 0.6 m and 0.5 s."""
    equilibrium: Equilibrium = "planned"
    """Equilibrium angle of ankle and toe: the planned angle with the planned moment fed forward, the planned
    angle alone, constant (neutral), or constant in each phase of `schedule` (phase)."""
    feedforward: Feedforward = "people"
    """Joint moments that are fed forward to hips, knees and ankles: those measured on people at this speed, or those
    that inverse dynamics give for the plan (a prediction: no force of people's is used)."""
    action_mode: ActionMode = "absolute"
    """Action to stiffness: log scale over the range, or a factor exp(action) on `schedule` (residual)."""
    decisions: Decisions = "50hz"
    """When stiffness is decided: in every step, of 10, 20 or 40 ms; or, in steps of 20 ms, of each leg at its heel
    strike and at people's foot flat, heel-off and toe-off, the action being held between them (event)."""
    stiffness_joints: StiffnessJoints = "both"
    """Joints whose stiffness the action decides; the other has the fixed schedule, and its actions are read as 0."""
    ankle_stiffness_range: tuple[float, float] = (LOWEST_STIFFNESS[0], 800.0)
    """Ankle stiffness at action -1 and +1 [N m/rad] for 1.70 m and 63 kg; scales with mass x height."""
    toe_stiffness_range: tuple[float, float] = (LOWEST_STIFFNESS[1], 200.0)
    """Toe stiffness at action -1 and +1 [N m/rad] for 1.70 m and 63 kg; scales with mass x height."""
    schedule: dict[str, Any] | None = None
    """Stiffness over the stride, JSON form of `springfoot.gait.stiffness.StiffnessSchedule`; needed by
    equilibrium `phase`; action mode `residual` without one takes the fixed schedule of the leg tuning."""
    human: dict[str, Any] | None = None
    """Someone's own walk in place of people's, JSON form of `springfoot.gait.own_data.OwnGait` (on the command line a
    CSV, OpenSim or C3D file): posture, forces, feed-forward, and at cadence `people` the step time follow it."""
    episode_seconds: float = 20.0
    """Time after which an episode is truncated [s]."""
    start: Literal["random", "standing"] | float = "random"
    """Start of an episode: walking at this stride phase of the left leg [0..1), at a random one within single support,
    or standing: the body sets off by itself within 3 s (`springfoot.envs.control.standing`)."""
    stop_at: float | None = None
    """Time in the episode from which the body slows down, then stops and stands [s]; not before 3 s if it starts
    standing."""
    start_noise: float = 0.0
    """Relative spread of the joint angles and velocities at the start [0..1]."""
    push_newton: float = 0.0
    """Size of each push on the trunk, forward or backward at random [N] for 63 kg; scales with mass; 0 for none."""
    push_seconds: float = 0.1
    """Duration of each push [s]."""
    push_interval: float = 4.0
    """One push at a random time in each interval of this length [s]."""
    friction: float = FRICTION
    """Coefficient of friction between feet and ground [0.4..1.2]."""
    slope_deg: float = 0.0
    """Slope of the ground [-5..5 deg], uphill positive."""
    slope_range_deg: tuple[float, float] | None = None
    """Slopes drawn at each reset in place of `slope_deg` [deg], evenly."""
    unevenness_m: float = 0.0
    """The ground of each footfall is up to this much higher or lower than the mean ground [0..0.03 m], evenly; a
    swinging foot gets that of its next footfall in mid-swing."""
    sensor_noise: float = 0.0
    """Standard deviation of Gaussian noise, new at every step, on all that is measured of the observation, in its own
    dimensionless units [0..0.1]: 0.01 is 0.6 deg, 9 mm of hip height, 2 deg/s, and 1 % of body weight."""
    stiffness_delay_s: float = 0.0
    """A commanded ankle or toe stiffness acts this much later (pure delay) [0..0.04 s, in steps of 0.01 s]."""
    stiffness_delay_range_s: tuple[float, float] | None = None
    """Delays drawn at each reset in place of `stiffness_delay_s`, evenly from the steps of 0.01 s [s]."""
    reward_weights: dict[str, float] = field(default_factory=dict)
    """Weights that differ from `DEFAULT_WEIGHTS`, by the name of the reward term [-]."""

    def __post_init__(self) -> None:
        body_of(self)  # refuses impossible ones
        require_within("speed", self.speed, PLAN_SPEED_RANGE, "m/s")
        self._check_draws()
        for name, choices in (
            ("cadence", Cadence),
            ("equilibrium", Equilibrium),
            ("feedforward", Feedforward),
            ("action_mode", ActionMode),
            ("decisions", Decisions),
            ("stiffness_joints", StiffnessJoints),
        ):
            _check_choice(name, getattr(self, name), get_args(choices))
        _check_range("ankle_stiffness_range", self.ankle_stiffness_range, "N m/rad")
        _check_range("toe_stiffness_range", self.toe_stiffness_range, "N m/rad")
        self._check_schedule()
        if self.human is not None:
            OwnGait.from_json(self.human)
        require_number("episode_seconds", self.episode_seconds, self.step_seconds, unit="s")
        check_start(self.start)
        if self.stop_at is not None:
            require_number("stop_at", self.stop_at, 3.0 if self.start == "standing" else 0.0, unit="s")
        require_number("start_noise", self.start_noise, 0.0, 1.0, "(relative)")
        require_number("push_newton", self.push_newton, 0.0, unit="N")
        require_number("push_interval", self.push_interval, 0.0, unit="s", above=True)
        require_number("push_seconds", self.push_seconds, 0.0, self.push_interval, "s (push_interval)", above=True)
        self._check_world()
        _check_weights(self.reward_weights)

    @property
    def step_seconds(self) -> float:
        """Time of one step of the environment [s]."""
        return {"100hz": 0.5, "25hz": 2.0}.get(self.decisions, 1.0) * ACTION_STEP

    def _check_draws(self) -> None:
        for name, allowed, unit in (
            ("height_range", HEIGHT_RANGE, "m"),
            ("mass_range", MASS_RANGE, "kg"),
            ("speed_range", PLAN_SPEED_RANGE, "m/s"),
        ):
            if getattr(self, name) is not None:
                _check_range(name, getattr(self, name), unit)
                for value in getattr(self, name):
                    require_within(name, value, allowed, unit)
        (short, tall), (light, heavy) = self.height_range or 2 * (self.height,), self.mass_range or 2 * (self.mass,)
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

    def _check_world(self) -> None:
        require_number("friction", self.friction, *FRICTION_RANGE)
        require_number("slope_deg", self.slope_deg, *SLOPE_RANGE_DEG, unit="deg")
        _check_span("slope_range_deg", self.slope_range_deg, SLOPE_RANGE_DEG, "deg")
        require_number("unevenness_m", self.unevenness_m, 0.0, MOST_UNEVENNESS, "m")
        require_number("sensor_noise", self.sensor_noise, 0.0, MOST_SENSOR_NOISE, "(observation units)")
        require_number("stiffness_delay_s", self.stiffness_delay_s, 0.0, LONGEST_DELAY, "s")
        _check_span("stiffness_delay_range_s", self.stiffness_delay_range_s, (0.0, LONGEST_DELAY), "s")
        for name, delays in (
            ("stiffness_delay_s", (self.stiffness_delay_s,)),
            ("stiffness_delay_range_s", self.stiffness_delay_range_s or ()),
        ):
            if any(abs(delay / CONTROL_WINDOW - round(delay / CONTROL_WINDOW)) > 1e-9 for delay in delays):
                raise SpringfootError(
                    f"{name} must be whole steps of {CONTROL_WINDOW:g} s, got {getattr(self, name)!r}"
                )

    def _check_schedule(self) -> None:
        if self.schedule is None:
            if self.equilibrium == "phase":
                raise SpringfootError(
                    "equilibrium 'phase' needs a schedule, which brings its own equilibrium angles, got None"
                )
        else:
            StiffnessSchedule.from_json(self.schedule)


def settings_from(**values: Any) -> BipedSettings:
    """Settings from keyword arguments or JSON: lists become tuples, numbers float; bad names are refused."""
    names = [setting.name for setting in fields(BipedSettings)]
    for name in values:
        if name not in names:
            likely = get_close_matches(name, names, n=3, cutoff=0.5) or names
            raise SpringfootError(f"unknown setting {name!r}; valid: {', '.join(likely)}")
    values = {name: _plain(value) for name, value in values.items()}
    if values.get("schedule") is not None:
        values["schedule"] = StiffnessSchedule.from_json(values["schedule"]).to_json()
    if values.get("human") is not None:
        values["human"] = OwnGait.from_json(values["human"]).to_json()
    return BipedSettings(**values)


def settings_to_json(settings: BipedSettings) -> dict[str, Any]:
    """Settings as a dictionary of plain JSON values; `settings_from(**settings_to_json(s)) == s`."""
    return json.loads(json.dumps(asdict(settings)))


def body_of(settings: BipedSettings) -> Body:
    """The settings' body."""
    return Body(settings.height, settings.mass, settings.leg_ratio, settings.foot_ratio, settings.carried_ratio)


def reference_gait(settings: BipedSettings) -> HumanGait:
    """Whose walk the settings hold the body to: people's at its speed and height, or that of `settings.human`."""
    if settings.human is None:
        return human_gait(settings.speed, settings.height)
    return OwnGait.from_json(settings.human).gait(settings.speed, settings.height)


def check_start(start: Any) -> None:
    """Refuses what is neither "random" nor "standing" nor a stride phase in [0, 1)."""
    if start not in ("random", "standing") and not (_is_number(start) and 0 <= start < 1):
        raise SpringfootError(f"start must be 'random', 'standing' or a stride phase in [0, 1), got {start!r}")


def _plain(value: Any) -> Any:
    """Python floats for numbers (also NumPy's), a tuple for a list, a copy of a dictionary."""
    if isinstance(value, Real) and not isinstance(value, bool):
        return as_float(value)
    if isinstance(value, (list, tuple)):
        return tuple(_plain(item) for item in value)
    return deepcopy(value)


def _is_number(value: Any) -> bool:
    return isfinite(as_float(value))


def _check_choice(name: str, value: Any, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise SpringfootError(f"{name} must be one of {', '.join(map(repr, choices))}, got {value!r}")


def _check_range(name: str, value: Any, unit: str) -> None:
    numbers = isinstance(value, tuple) and len(value) == 2 and all(map(_is_number, value))
    if not numbers or not 0 < value[0] < value[1]:
        raise SpringfootError(f"{name} must be (low, high) with 0 < low < high {unit}, got {value!r}")


def _check_span(name: str, value: Any, allowed: tuple[float, float], unit: str) -> None:
    numbers = isinstance(value, tuple) and len(value) == 2 and all(map(_is_number, value))
    if value is not None and not (numbers and allowed[0] <= value[0] < value[1] <= allowed[1]):
        raise SpringfootError(
            f"{name} must be (low, high) with low < high in [{allowed[0]:g}, {allowed[1]:g}] {unit}, got {value!r}"
        )


def _check_weights(weights: Any) -> None:
    if not isinstance(weights, dict):
        raise SpringfootError(f"reward_weights must map names of reward terms to numbers, got {weights!r}")
    for name, weight in weights.items():
        if name not in DEFAULT_WEIGHTS:
            raise SpringfootError(f"reward_weights has no term {name!r}; valid: {', '.join(DEFAULT_WEIGHTS)}")
        cost = DEFAULT_WEIGHTS[name] < 0
        if not _is_number(weight) or (weight > 0 if cost else weight < 0):
            allowed = "<= 0 (a cost)" if cost else ">= 0 (a reward)"
            raise SpringfootError(f"reward_weights[{name!r}] must be a finite number {allowed}, got {weight!r}")
