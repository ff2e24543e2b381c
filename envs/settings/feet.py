"""Read the settings `left_foot` and `right_foot`: kinds of feet, sound or prosthetic, and their numbers, once, into a
`FootSetting`; its `foot` is that of the physics (`envs.physics.foot`).

In plain JSON values a foot is a word, its kind, or a dictionary with a `kind` and any of the numbers of that kind.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import radians
from typing import Any, NamedTuple

from springfoot.errors import SpringfootError, perhaps, require_within
from springfoot.gait.springs.stiffness import SPRINGS, StiffnessSchedule

from ..physics.foot import LOCK, WAYS, Feet, Foot, FootJoint, Spring

FOOT_SETTINGS = ("left_foot", "right_foot")
"""Settings that are feet."""
RIGID_TOE_STIFFNESS = 110.0
"""Stiffness of the toe of a rigid foot [N m/rad]: the bend of a forefoot; chosen, for a foot like the thesis's Figure
1-b, which gives small motions of ankle and toe, and no stiffness."""


class Number(NamedTuple):
    """Default and allowed range of a number of a foot."""

    usual: float | None
    """Default value; None leaves it to the body."""
    low: float
    """Least allowed value."""
    high: float
    """Largest allowed value."""
    unit: str
    """Unit of all three."""


TABLE_ANGLE, TABLE_TORQUE = Number(None, -60.0, 90.0, "deg"), Number(None, -1000.0, 1000.0, "N m")
"""Angle and torque of a point of a torque-angle line."""
TABLE_SLOPE = Number(None, 1.0, 3000.0, "N m/rad")
"""Fall of a torque-angle line's torque with the angle."""
MOST_POINTS = 1000
"""Most points of a torque-angle line; chosen."""
TABLES = ("ankle_table", "toe_table")
"""Torque-angle lines of a passive foot, lists of [deg, N m], in place of stiffness and rest angle of that joint."""
SPRING_NUMBERS = {
    "ankle_stiffness": Number(600.0, 0.0, 3000.0, "N m/rad"),
    "ankle_deg": Number(2.0, -30.0, 30.0, "deg"),
    "toe_stiffness": Number(60.0, 0.0, 1000.0, "N m/rad"),
    "toe_deg": Number(0.0, -30.0, 45.0, "deg"),
    "damping_time": Number(None, 0.0, 0.1, "s"),
}
"""Numbers of a spring at ankle and toe: stiffness, angle without torque (dorsiflexion, toe-up positive), and damping
over stiffness. The defaults are of a foot on which the committed controller walks unchanged."""
ORTHOSIS_NUMBERS = SPRING_NUMBERS | {
    "ankle_stiffness": Number(0.0, 0.0, 1000.0, "N m/rad"),
    "ankle_deg": Number(0.0, -30.0, 30.0, "deg"),
    "toe_stiffness": Number(0.0, 0.0, 1000.0, "N m/rad"),
}
"""Numbers of an orthosis, a spring beside the joint; 0.9 to 8.7 N m/deg at the ankle (Waterval et al. 2019) are 52 to
498 N m/rad."""
ENGAGES = "engages"
"""Way beyond the rest angles in which alone the springs of an orthosis act, one of `envs.physics.foot.WAYS`, without
damping: a stop, or an exoskeleton such as that of Nuckols & Sawicki 2020 (J. Neuroeng. Rehabil. 17:75). Without it they
act both ways, with damping."""
SEGMENT_RATIOS = {
    f"{part}_ratio": Number(1.0, 0.1, most, "(of the intact one)")
    for part, most in (
        *(("shank_mass", 3.0), ("shank_com", 3.0), ("shank_inertia", 3.0)),
        *(("foot_mass", 6.0), ("foot_inertia", 6.0)),
    )
}
"""Shank and foot of a prosthesis over intact ones: masses, distance of the shank's CoM from the knee, inertias about
the CoMs. Prosthetic legs below the knee are about 1.95 kg lighter (Smith & Martin 2011, J. Prosthet. Orthot. 23:114),
0.6 of shank and foot at 80 kg; people walked with 8 kg on their feet, 5.4 times their mass (Browning et al. 2007)."""
KINDS: dict[str, dict[str, Number]] = {
    "intact": {},
    "rigid": {},
    "rigid_toe": {},
    "no_toe": {},
    "passive": SPRING_NUMBERS,
    "adaptive": {name: SPRING_NUMBERS[name] for name in ("ankle_deg", "toe_deg", "damping_time")},
    "weak": {"strength": Number(0.3, 0.1, 0.6, "(of the sound leg)")},
    "drop": {},
}
"""The kinds of feet and the numbers of their own.

`rigid`: ankle locked, toe a spring of 110 N m/rad. `rigid_toe`: toe locked. `no_toe`: the same length in one piece,
which touches the ground with heel and tip alone. `passive`: a spring of fixed stiffness and rest angle at ankle and
toe, or a torque-angle line (`ankle_table`, `toe_table`). `adaptive`: the policy sets their stiffness, the rest angle is
fixed; or both are as a `schedule` says, a `StiffnessSchedule` in JSON form. `weak`: the plantarflexor moment is limited
to a share of `envs.physics.model.TORQUE_LIMIT`. `drop`: the ankle's muscles are slack while the leg swings, and its
passive tissue alone holds it (`springfoot.gait.body.tissue`).
"""
PLACES = {
    "orthosis": '; an orthosis is a key of a foot: {"kind": "intact", "orthosis": {"ankle_stiffness": 200}}',
    "prosthesis": "; a prosthesis is 'passive', or 'adaptive' if the policy sets its stiffness",
}
"""Word that is no kind -> the end of a message, which says where it belongs."""


@dataclass(frozen=True, repr=False)
class FootSetting:
    """A foot of the settings; `foot_setting` makes and checks it."""

    plain: str | dict[str, Any]
    """The foot in plain JSON values: floats for numbers, a word where the kind says all."""

    def __repr__(self) -> str:
        return repr(self.plain)

    def __str__(self) -> str:
        return str(self.plain)

    def to_json(self) -> str | dict[str, Any]:
        """Return the plain JSON values; `foot_setting` is the inverse."""
        return self.plain

    @property
    def kind(self) -> str:
        """Return the kind of foot, one of `KINDS`."""
        return self.plain if isinstance(self.plain, str) else self.plain["kind"]

    @property
    def numbers(self) -> dict[str, Any]:
        """Return name -> value of the numbers, lines, schedule and orthosis that the setting gives."""
        given = {} if isinstance(self.plain, str) else self.plain
        return {name: value for name, value in given.items() if name != "kind"}

    @cached_property
    def foot(self) -> Foot:
        """Return the foot for the physics."""
        return _foot_of(self.kind, self.numbers)


INTACT_FOOT = FootSetting("intact")
"""The setting of a sound leg's foot."""


def foot_setting(name: str, value: Any) -> FootSetting:
    """Return the foot of a setting from a `FootSetting` or plain JSON values.

    Raises `SpringfootError` for any other value; `name` is that of the setting.
    """
    return value if isinstance(value, FootSetting) else FootSetting(_checked_foot(name, value))


def _checked_foot(name: str, value: Any) -> str | dict[str, Any]:
    """Return a checked foot in plain JSON values: its kind alone, or a dictionary of kind and given numbers.

    Raises `SpringfootError`, in which `name` is the setting, for a `value` that is no foot.
    """
    if isinstance(value, Mapping) and "kind" not in value:
        raise SpringfootError(f"{name}: a dictionary needs a 'kind', one of {', '.join(map(repr, KINDS))}")
    kind = value.get("kind") if isinstance(value, Mapping) else value
    if not isinstance(kind, str) or kind not in KINDS:
        form = "" if isinstance(value, (str, Mapping)) else ", or a dictionary with one of them as its 'kind'"
        hint = PLACES.get(kind) or perhaps(kind, KINDS) if isinstance(kind, str) else ""
        raise SpringfootError(f"{name} must be one of {', '.join(map(repr, KINDS))}{form}, got {kind!r:.60}{hint}")
    if not isinstance(value, Mapping):
        return kind
    if "adapted" in value:  # of files of before
        raise SpringfootError(f'{name}: adapted people are gone; the setting person="learned" walks on every foot')
    plain: dict[str, Any] = {"kind": kind}
    # Beside numbers a kind may have torque-angle lines or a schedule, each in place of the numbers of its joint.
    replacements = {"passive": TABLES, "adaptive": ("schedule",)}.get(kind, ())
    further = *replacements, "orthosis"
    given = {key: number for key, number in value.items() if key not in ("kind", *further)}
    plain |= _checked_numbers(name, f"a foot of kind {kind!r}", given, KINDS[kind] | SEGMENT_RATIOS, further)
    for key in replacements:
        if value.get(key) is not None:
            joints = SPRINGS if key == "schedule" else (key.partition("_")[0],)  # of "ankle_table"
            if both := [other for other in plain if other in KINDS[kind] and other.startswith(joints)]:
                raise SpringfootError(f"{name}: give {key} or {both[0]}, not both")
            if key == "schedule":
                plain[key] = _checked_schedule(name, value[key])
            else:
                plain[key] = _checked_table(f"{name}: {key}", value[key])
    if kind == "adaptive" and "damping_time" in plain and "schedule" not in plain:
        raise SpringfootError(f"{name}: damping_time of an adaptive foot needs its schedule; else it is the muscles'")
    if (orthosis := value.get("orthosis")) is not None:
        plain["orthosis"] = _checked_orthosis(f"{name}: orthosis", orthosis)
    return kind if len(plain) == 1 else plain  # a word where the kind says all


def _checked_orthosis(name: str, value: Any) -> dict[str, Any]:
    """Return a checked orthosis in plain JSON values: the given numbers, and `engages` if it acts one way.

    Raises `SpringfootError`, in which `name` is the setting, for a `value` that is no orthosis.
    """
    if not isinstance(value, Mapping):
        raise SpringfootError(
            f"{name} must be a dictionary of {', '.join([*ORTHOSIS_NUMBERS, ENGAGES])}, got {value!r:.60}"
        )
    given = {key: number for key, number in value.items() if key != ENGAGES}
    plain: dict[str, Any] = _checked_numbers(name, "an orthosis", given, ORTHOSIS_NUMBERS, (ENGAGES,))
    if (way := value.get(ENGAGES)) is not None:
        if not isinstance(way, str) or way not in WAYS:
            raise SpringfootError(f"{name}: {ENGAGES} must be one of {', '.join(map(repr, WAYS))}, got {way!r:.60}")
        if "damping_time" in plain:
            raise SpringfootError(f"{name}: give {ENGAGES} or damping_time, not both")
        plain[ENGAGES] = way
    return plain


def _checked_schedule(name: str, value: Any) -> dict[str, list[list[float]]]:
    """Return a foot's checked stiffness schedule in plain JSON values.

    Raises `SpringfootError`, in which `name` is the setting, for other values and for stiffness out of range.
    """
    try:
        schedule = StiffnessSchedule.from_json(value)
    except SpringfootError as error:
        raise SpringfootError(f"{name}: schedule: {error}") from None
    for joint in SPRINGS:
        allowed = SPRING_NUMBERS[f"{joint}_stiffness"]
        for segment in getattr(schedule, joint):
            require_within(f"{name}: schedule: {joint} K", segment.stiffness, (allowed.low, allowed.high), allowed.unit)
    return schedule.to_json()


def _checked_table(name: str, value: Any) -> list[list[float]]:
    """Return the checked points [deg, N m] of a torque-angle line: two or more, of ascending angle and falling torque.

    Raises `SpringfootError`, in which `name` is the setting, for any other value.
    """
    points = [list(_sequence_or_empty(point)) for point in _sequence_or_empty(value)]
    if not 2 <= len(points) <= MOST_POINTS or any(len(point) != 2 for point in points):
        raise SpringfootError(f"{name} must be a list of 2 to {MOST_POINTS} pairs [deg, N m], got {value!r:.60}")
    plain = [
        [
            require_within(f"{name}: {quantity}", number, (allowed.low, allowed.high), allowed.unit)
            for quantity, number, allowed in zip(("angle", "torque"), point, (TABLE_ANGLE, TABLE_TORQUE), strict=True)
        ]
        for point in points
    ]
    for (angle, torque), (next_angle, next_torque) in pairwise(plain):
        if next_angle <= angle:
            raise SpringfootError(f"{name}: angles must ascend, got {next_angle:g} deg after {angle:g} deg")
        fall = (torque - next_torque) / radians(next_angle - angle)
        if not TABLE_SLOPE.low <= fall <= TABLE_SLOPE.high:
            signs = (
                "; angle and torque are positive in dorsiflexion (toe up): a foot bent that way pushes back, below 0"
            )
            raise SpringfootError(
                f"{name}: the torque must fall by {TABLE_SLOPE.low:g} to {TABLE_SLOPE.high:g} {TABLE_SLOPE.unit}, "
                f"got {fall:.4g} between {angle:g} and {next_angle:g} deg{signs if fall < 0 else ''}"
            )
    return plain


def _sequence_or_empty(value: Any) -> Sequence[Any]:
    """Return a list or tuple as it is, and for any other value an empty tuple."""
    return value if isinstance(value, (list, tuple)) else ()


def _checked_numbers(
    name: str, owner: str, given: Mapping[Any, Any], known: Mapping[str, Number], further: tuple[str, ...] = ()
) -> dict[str, float]:
    """Return the given numbers, checked, as floats in the order of `known`.

    Args:
        name: the setting, for errors.
        owner: the thing with the numbers in words, for errors, such as "an orthosis".
        given: name -> number.
        known: name -> allowed range of all numbers of that thing.
        further: other keys that an error lists as valid.

    Raises `SpringfootError` for a number out of its range and for an unknown key.
    """
    for key in given:
        if key not in known:
            valid = (*known, *further)
            raise SpringfootError(
                f"{name}: {owner} has no {key!r:.40}; valid: {', '.join(valid)}{perhaps(str(key), valid)}"
            )
    return {
        key: require_within(f"{name}: {key}", given[key], (allowed.low, allowed.high), allowed.unit)
        for key, allowed in known.items()
        if key in given
    }


def _foot_of(kind: str, given: Mapping[str, Any]) -> Foot:
    """Return the foot of a kind for the physics, from its `given` numbers, lines, schedule and orthosis, all checked.

    Numbers that are not given have their defaults.
    """
    value: dict[str, Any] = {**_defaults(KINDS[kind]), **given}
    of_ankle: Spring | None = None  # springs of the orthosis
    of_toe: Spring | None = None
    if "orthosis" in given:
        of_ankle, of_toe = _springs(_defaults(ORTHOSIS_NUMBERS) | given["orthosis"])
    ankle = FootJoint(orthosis=of_ankle)
    toe = FootJoint(orthosis=of_toe)
    match kind:
        case "rigid":
            ankle = FootJoint(device=LOCK, orthosis=of_ankle)
            toe = FootJoint(device=Spring(stiffness=RIGID_TOE_STIFFNESS), orthosis=of_toe)
        case "rigid_toe" | "no_toe":
            toe = FootJoint(device=LOCK, orthosis=of_toe)
        case "passive":
            ankle_spring, toe_spring = _springs(value)
            ankle = FootJoint(device=ankle_spring, orthosis=of_ankle)
            toe = FootJoint(device=toe_spring, orthosis=of_toe)
        case "adaptive" if "schedule" in given:  # its K and rest angles replace those of these springs
            spring = Spring(damping_time=value["damping_time"])
            ankle = FootJoint(device=spring, orthosis=of_ankle)
            toe = FootJoint(device=spring, orthosis=of_toe)
        case "adaptive":
            ankle = FootJoint(rest=radians(value["ankle_deg"]), orthosis=of_ankle)
            toe = FootJoint(rest=radians(value["toe_deg"]), orthosis=of_toe)
        case "weak":
            ankle = FootJoint(strength=value["strength"], orthosis=of_ankle)
        case "drop":
            ankle = FootJoint(acts_in_swing=False, orthosis=of_ankle)
    segments = {name: number for name, number in given.items() if name in SEGMENT_RATIOS}
    schedule = StiffnessSchedule.from_json(given["schedule"]) if "schedule" in given else None
    return Foot(kind=kind, ankle=ankle, toe=toe, schedule=schedule, one_piece=kind == "no_toe", **segments)


def foot_pairs(settings: Mapping[str, Any], num: int) -> tuple[dict[str, Any], list[Feet] | None]:
    """Return settings for all environments, and the pair of feet of each, from settings with lists of feet.

    In `settings` `left_foot` and `right_foot` may be lists, a foot for each of `num` environments. The returned
    settings have the first foot of each list; the pairs are None without lists. Raises `SpringfootError` for a list of
    another length.
    """
    listed = {name: settings[name] for name in FOOT_SETTINGS if isinstance(settings.get(name), (list, tuple))}
    for name, feet in listed.items():
        if len(feet) != num:
            raise SpringfootError(f"{name} must be one foot or a list of {num}, got {len(feet)} feet")
    all_feet = {
        name: [foot_setting(name, foot) for foot in listed.get(name, [settings.get(name, INTACT_FOOT)] * num)]
        for name in FOOT_SETTINGS
    }
    first = {name: all_feet[name][0] for name in listed}
    pairs = [(left.foot, right.foot) for left, right in zip(*all_feet.values(), strict=True)]
    return {**settings, **first}, pairs if listed else None


def _defaults(numbers: Mapping[str, Number]) -> dict[str, float | None]:
    """Return name -> default value of each number; None for one that is left to the body."""
    return {name: number.usual for name, number in numbers.items()}


def _springs(value: Mapping[str, Any]) -> tuple[Spring, Spring]:
    """Return the springs at ankle and toe; `value` is name of `SPRING_NUMBERS`, `TABLES` or `ENGAGES` -> value."""

    def spring(joint: str) -> Spring:
        """Return the spring of one joint: by its torque-angle line if there is one, else by its numbers."""
        rest = radians(value[f"{joint}_deg"])
        table = value.get(f"{joint}_table", ())
        points = tuple((radians(angle), torque) for angle, torque in table)
        time = value["damping_time"]
        if points:
            return Spring(table=points, damping_time=time)
        return Spring(stiffness=value[f"{joint}_stiffness"], rest=rest, damping_time=time, engages=value.get(ENGAGES))

    return spring("ankle"), spring("toe")
