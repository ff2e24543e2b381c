"""Cut measured walks into strides: common time, heel strikes and toe-offs, curves over percent of each stride."""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError

from ..body.body import GRAVITY, Body
from ..body.leg_dynamics import FOOT_SEGMENT, joint_positions, segment_turns
from ..body.rockers import turned
from .gait_events import CONTACT_THRESHOLD_BW, Contacts, find_contacts, next_after, on_percent, sample
from .human import COLUMNS, FORCES
from .motion_files import FILE_SIDES, PARAMETERS, TIME_COLUMNS, Series, Trial, refuse_impossible_angles

FINE_PERCENT = np.linspace(0.0, 100.0, 1001)
"""Percents of the stride at which torque-angle curves are read; chosen: phases of stance begin between whole percents,
and slopes of short ones differ by up to a third if they are read at these alone."""
TORQUE_ANGLE_CURVES = ("ankle", "toe", "ankle_moment", "toe_moment")
EVENT_METHODS = ("the vertical force", "the events of the files", "the legs' motion and the end of the ankle's moment")
"""Methods that find heel strikes and toe-offs, in the order in which they are tried."""
ANGLE_CURVES = ("thigh", "hip", "knee", "ankle", "toe")
"""Curves that need no force plate."""
FEWEST_STRIDES = 2
"""Fewest strides, of both feet together, for a mean and its spread."""
LONGEST_TICK = 1 / 30
"""Longest time between samples [s]; chosen: a coarser sampling misses the time of a landing."""
SHORTEST_TICK = 1e-3
"""Shortest time between samples [s]; chosen: finer sampling is thinned out to it."""
SHORTEST_MISTAKEN_TICK = 0.25
"""Time between samples from which on times are taken to be in ms, or numbers of frames [s]; chosen: nobody samples a
walk so coarsely, and 0.25 ms are those of 4,000 Hz."""
LONGEST_GAP = 0.1
"""Longest gap between samples that a straight line bridges [s]; chosen."""
UNEVEN_STRIDE = 0.25
"""Largest difference of a stride's duration from the median, over the median; other strides are left out, as a missed
event or a turn; chosen."""
HEEL_STRIKE_AFTER, TOE_OFF_AFTER = 0.032, 0.006
"""Time from the farthest heel to heel strike, and from the hindmost toe to toe-off, in people's curves [strides]: 0.030
to 0.036 and 0.004 to 0.009 at 0.85 to 1.96 m/s."""
USUAL_DELAY = -0.02
"""Time from toe-off by motion to toe-off by force [s]; chosen: some -0.005 in people's curves, and in walks here on
sound, weak, passive and rigid feet -0.024 to -0.047, the mean of both legs."""
UNLOADED = 0.06
"""Moment of an ankle at toe-off over its peak in the stride [-]; chosen: so found, toe-offs of walks here are 10 ms off
those by force at most, by motion 15 to 67."""
CUTOFF = 6.0
"""Low-pass frequency of angles for events and rates [Hz]: usual for walking (Winter 2009, ch. 3)."""
FILTER = f"second-order Butterworth low-pass at {CUTOFF:g} Hz, forward and back"
"""The filter of `_smooth` in words."""
STILL = 1e-6
"""Largest excursion of a coordinate that was not measured, [rad] or the moment's unit; chosen."""
WEIGHT_BEARING = (15, 45)
"""Percents of the stride between which a foot bears weight; chosen. A foot without load there was not on a plate."""
ABRUPT_UNLOADING = 0.7
"""Fall of the vertical force within 2 % of the stride that no foot shows [body weights]; chosen: adults' mean force
falls by 0.21 to 0.30 at 0.85 to 1.96 m/s (Bovi et al. 2011), walks here on constant springs by more than 0.45, and a
foot that rolls off a plate loses all of it."""
LEAST_PEAK = 0.9
"""Least peak of the vertical force of a foot that stands wholly on its plate [body weights]; chosen: alone on the
ground it bears about the body. Adults' mean force peaks at 1.06 to 1.32 at 0.85 to 1.96 m/s, walks here at 1.08 and
more."""
EARLY_END = 0.06
"""Most by which the force of a whole stance ends before the motion of the foot tells its toe-off [strides]; chosen: it
does by 0.01 to 0.044 in walks here, on sound, weak, passive and rigid feet and slopes of 5 deg."""
WEIGHT_OFF = 0.1
"""Largest difference of the mean vertical force of both feet over a step from the body's weight, over it; chosen. More
than that would change the body's vertical velocity by 0.1 g times the step's 0.55 s, 0.5 m/s. Steps here differ by 0.04
at most, those on a soft passive foot by 0.06, those of 200 N pushes by 0.08."""


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredWalk:
    """Trials of one walk on common, even samples."""

    name: str
    """Names of the files."""
    first: float
    """Time of the first sample [s]."""
    tick: float
    """Time between samples [s]."""
    legs: dict[str, Series]
    """Side -> curve -> its T samples, (T,)."""
    unscaled: set[tuple[str, str]]
    """(side, curve) of the curves in N, N m or W."""
    contacts: dict[str, Contacts]
    """Side -> events in a file."""
    speed: float | None
    """Walking speed [m/s]; None if no file has it."""
    speed_column: str = PARAMETERS["speed"]
    """Column that tells the speed."""
    columns: Mapping[tuple[str, str], str] = field(default_factory=dict)
    """(side, curve) -> its column in a file, where that is not the one of `COLUMNS`."""
    trusted: bool = False
    """True to count all strides on a plate, though a part of the force may be missing, as of walkers with a cane."""
    notes: tuple[str, ...] = ()
    """Sentences on guesses and omissions."""

    @property
    def last(self) -> float:
        """Return the time of the last sample [s]."""
        return self.first + self.tick * (min(len(c) for leg in self.legs.values() for c in leg.values()) - 1)

    def without_start(self, seconds: float) -> "MeasuredWalk":
        """Return the walk without its first seconds; raise `SpringfootError` if nothing is left of it."""
        ticks = round(seconds / self.tick)
        if self.first + ticks * self.tick >= self.last:
            raise SpringfootError(f"{self.name} lasts {self.last - self.first:.2f} s, and {seconds:g} s are left out")
        legs = {side: {curve: values[ticks:] for curve, values in leg.items()} for side, leg in self.legs.items()}
        return replace(self, first=self.first + ticks * self.tick, legs=legs)


@dataclass(frozen=True, kw_only=True, eq=False)
class LegStrides:
    """The strides of one leg."""

    times: NDArray
    """(S, 3) heel strike, toe-off, next heel strike [s]."""
    curves: Series
    """Curve -> (S, 101) over percent of each stride, in the units of `HumanGait`."""
    weighed: NDArray
    """(S,) True for strides with forces and moments that count: none but those on a force plate, where the file
    has forces."""
    partly: NDArray = field(default_factory=lambda: np.zeros(0, bool))
    """(S,) True for strides on a force plate that do not count, as a part of the force is missing."""
    fine: Series = field(default_factory=dict)
    """Curve of `TORQUE_ANGLE_CURVES` -> (S, 1001) over `FINE_PERCENT`, or (S, 101) of mean curves, in the units of
    `curves`."""
    events: str = ""
    """Name in `EVENT_METHODS` of the method that found heel strikes and toe-offs; empty for mean curves."""
    toe_off: float | None = None
    """Phase of toe-off of mean curves, 0..1."""

    @property
    def toe_off_phase(self) -> NDArray:
        """Return the phase of toe-off, 0..1, of the strides that count for forces; of all if none does."""
        begin, off, end = self.times[self.weighed if self.weighed.any() else slice(None)].T
        return (off - begin) / (end - begin)

    def counted(self, curve: str) -> NDArray:
        """Return `curve` over percent of the strides that count for it, (s, 101).

        These are all strides for an angle, and those in `weighed` for a force, a moment or a power.
        """
        return self.curves[curve] if curve in ANGLE_CURVES else self.curves[curve][self.weighed]


def merge_trials(trials: Sequence[Trial]) -> MeasuredWalk:
    """Merge trials of the same walk on common samples: each curve comes from the first trial that has it.

    Joint powers are computed where angle and moment are there, and knees bent backward are turned if the trial says so.
    Angles and moments that stand still were not measured, and are left out.

    Raises `SpringfootError` for sampling too coarse, a gap, or no time in common.
    """
    name = ",".join(trial.name for trial in trials)
    for trial in trials:
        gaps = np.diff(trial.time)
        if not len(gaps) or (tick := float(np.median(gaps))) > LONGEST_TICK * 1.001:  # times are rounded
            sampling = f"one every {tick:.3g} s" if len(gaps) else "a single one"
            column = next((name for name in TIME_COLUMNS if name in trial.columns), "time")
            guess = f": {column} in ms, or frames?" if len(gaps) and tick >= SHORTEST_MISTAKEN_TICK else ""
            raise SpringfootError(f"{trial.name} must have at least 30 samples a second, has {sampling}{guess}")
        if gaps.max() > LONGEST_GAP:
            longest = int(gaps.argmax())
            raise SpringfootError(
                f"{trial.name} has no samples for {gaps[longest]:.2f} s after {trial.time[longest]:.2f} s"
            )
    tick = max(min(float(np.median(np.diff(trial.time))) for trial in trials), SHORTEST_TICK)
    first = max(trial.time[0] for trial in trials)
    if any(abs((first - trial.time[0]) / tick % 1.0 - 0.5) < 0.25 for trial in trials):
        # Samples of one file lie between those of another: with twice as many both are kept, not smoothed.
        tick = max(tick / 2, SHORTEST_TICK)
    last = min(trial.time[-1] for trial in trials)
    if last - first < tick:
        raise SpringfootError(f"{name}: the files have no time in common")
    # The factor: a last sample must not be lost to rounding.
    time = first + tick * np.arange(int((last - first) / tick * (1 + 1e-12)) + 1)
    legs: dict[str, Series] = {}
    columns: dict[tuple[str, str], str] = {}
    unscaled = set()
    unsigned = {}  # side -> curves with the sign of the model's coordinate
    heading = -1.0 if any(trial.backward for trial in trials) else 1.0  # often another file's than the forces'
    for trial in trials:
        for side, curves in trial.legs.items():
            for curve in [curve for curve in curves if curve not in legs.get(side, {})]:
                along_x = trial.forces_along_x and curve == "grf_forward"
                values = heading * curves[curve] if along_x else curves[curve]
                legs.setdefault(side, {})[curve] = np.interp(time, trial.time, values)
                if trial.knee_as_read and curve in ("knee", "knee_moment"):
                    unsigned.setdefault(side, set()).add(curve)
                if curve in trial.unscaled:
                    unscaled.add((side, curve))
                if (side, curve) in trial.column_of:
                    columns[side, curve] = trial.column_of[side, curve]
    notes = [note for trial in trials for note in trial.notes]
    for side, leg in legs.items():
        still = [curve for curve, values in leg.items() if curve not in FORCES and np.ptp(values) <= STILL]
        for curve in still:
            value = float(leg.pop(curve)[0])
            words = f"{side} {curve.replace('_', ' ')}".strip()
            notes.append(f"{words} left out: it is {value:.3g} throughout, which is no measurement.")
        if side in unsigned and "knee" in leg and leg["knee"].mean() < 0:
            leg |= {curve: -leg[curve] for curve in unsigned[side] if curve in leg}
        refuse_impossible_angles(name, leg)
        for joint in ("hip", "knee", "ankle"):
            moment = f"{joint}_moment"
            power = f"{joint}_power"
            if power not in leg and joint in leg and moment in leg:
                leg[power] = -leg[moment] * np.gradient(_smooth(leg[joint], tick), tick)
                if (side, moment) in unscaled:
                    unscaled.add((side, power))
    # Reversed: of several trials with a side's events the first counts, being the last to be put in.
    contacts = {side: events for trial in reversed(trials) for side, events in trial.contacts.items()}
    with_speed = next((trial for trial in trials if trial.speed is not None), trials[0])
    legs = {side: leg for side, leg in legs.items() if leg}
    if not legs:
        raise SpringfootError(f"{name}: no curve moves")
    return MeasuredWalk(
        name=name,
        first=first,
        tick=tick,
        legs=legs,
        unscaled=unscaled,
        contacts=contacts,
        speed=with_speed.speed,
        speed_column=with_speed.speed_column,
        columns=columns,
        notes=tuple(notes),
    )


def cut_strides(walk: MeasuredWalk, side: str = "both", mass: float | None = None) -> tuple[NDArray, Series]:
    """Cut a walk into strides: return their events, and each curve over percent of the strides.

    Events are times (S, 3) of heel strike, toe-off and next heel strike of S strides [s]. Curves are (strides that have
    it, 101), in the units of `HumanGait`. `side` is both, left or right; `mass` [kg] as in `own_data.read_gait`. Raises
    `SpringfootError` for too few strides.
    """
    legs = strides_of_legs(walk, side, mass)
    times = np.concatenate([leg.times for leg in legs.values()])
    # Both legs' strides, one below the other.
    curves = {}
    for curve in COLUMNS:
        if counted := [leg.counted(curve) for leg in legs.values() if curve in leg.curves]:
            curves[curve] = np.concatenate(counted)
    return times, {name: values for name, values in curves.items() if len(values) >= FEWEST_STRIDES}


def strides_of_legs(walk: MeasuredWalk, side: str = "both", mass: float | None = None) -> dict[str, LegStrides]:
    """Cut each leg of a walk into strides; arguments and errors as in `cut_strides`."""
    legs = _legs_as_read(walk, side, mass)
    borne = borne_mass(walk) if mass is None else None
    mass = borne.mass if borne else mass
    return {
        name: replace(
            leg,
            curves=_scaled_curves(leg.curves, name, walk.unscaled, mass),
            fine=_scaled_curves(leg.fine, name, walk.unscaled, mass),
        )
        for name, leg in legs.items()
    }


def require_side(name: str, legs: Collection[str], side: str) -> None:
    """Raise `SpringfootError` if the files `name` have no leg of a `side`, only `legs`; "" is one without a side."""
    if side not in ("both", *legs):
        only = " and ".join(f"the {leg} one" for leg in legs if leg) or "curves without a side"
        allowed = " or ".join([*filter(None, legs), "both"])
        raise SpringfootError(f"{name} has no {side} leg, only {only}: side must be {allowed}")


def _legs_as_read(walk: MeasuredWalk, side: str, mass: float | None = None) -> dict[str, LegStrides]:
    """Cut each leg of `side` (both, left, right) into strides, their curves in the units of the files.

    The threshold of contact is first of about the body weight, then of that which the strides of all legs bear. `mass`
    [kg], if it is known, is that of a body of which one foot alone was on a plate.
    """
    require_side(walk.name, walk.legs, side)
    legs = _legs_by_weight(walk, None)
    weight = _borne_weight(legs.values())
    if weight is not None:
        legs = _legs_by_weight(walk, weight)
    if weight is not None and not walk.trusted:
        plates = [name for name, leg in legs.items() if "grf_vertical" in leg.curves and leg.weighed.any()]
        if mass is not None and len(plates) == 1 and (plates[0], "grf_vertical") in walk.unscaled:
            weight = mass * GRAVITY
        for name in plates:
            legs[name] = _without_strides(legs[name], ~_stands_whole(walk, name, legs[name], weight))
        light = _light_steps(walk, legs, weight)
        legs = {name: _without_strides(leg, _steps_in(leg.times, light).sum(axis=1) > 0) for name, leg in legs.items()}
        legs = {name: replace(leg, times=_mended_toe_offs(walk, name, leg)) for name, leg in legs.items()}
    legs = {name: leg for name, leg in legs.items() if side in ("both", name)}
    if (count := sum(len(leg.times) for leg in legs.values())) < FEWEST_STRIDES:
        raise SpringfootError(
            f"{walk.name}: needs at least {FEWEST_STRIDES} complete strides, has {count} "
            "(they are found in grf_vertical, events, or thigh or hip with knee)"
        )
    return legs


def _legs_by_weight(walk: MeasuredWalk, weight: float | None) -> dict[str, LegStrides]:
    """Cut each leg of a walk into strides, their curves in the units of the files.

    `weight` is that of the body in the unit of the forces, for the threshold of contact; None: estimated from a force.
    """
    legs = {}
    for name, leg in walk.legs.items():
        times, events = _strides_of_leg(walk, name, weight)
        begin, _, end = times.T
        curves = {curve: on_percent(series, begin, end, walk.tick, walk.first) for curve, series in leg.items()}
        legs[name] = LegStrides(
            times=times,
            curves=curves,
            weighed=np.full(len(begin), True),
            partly=np.full(len(begin), False),
            fine={
                curve: on_percent(leg[curve], begin, end, walk.tick, walk.first, FINE_PERCENT)
                for curve in TORQUE_ANGLE_CURVES
                if curve in leg
            },
            events=events,
        )
        if "grf_vertical" in curves:
            legs[name] = replace(legs[name], weighed=_on_plate(curves["grf_vertical"], weight))
            if not walk.trusted:
                legs[name] = _without_strides(legs[name], _ends_abruptly(curves["grf_vertical"], weight))
    return legs


def _stands_whole(walk: MeasuredWalk, name: str, leg: LegStrides, weight: float) -> NDArray:
    """Return (S,) True for strides of the leg `name` with the force of a whole stance.

    Such a force reaches `LEAST_PEAK`, and does not end before the foot leaves the ground by its motion, but for
    `EARLY_END`. `weight` is the body's, in the unit of the force.
    """
    whole = leg.curves["grf_vertical"].max(axis=1, initial=0.0) >= LEAST_PEAK * weight
    motion = _contacts_of_motion(walk, walk.legs[name])
    if motion is None or not len(motion.heel_strikes) or not len(motion.toe_offs):
        return whole
    begin, off, end = leg.times.T
    late_strike = _lateness(begin, motion.heel_strikes) / (end - begin)
    late_off = _lateness(off, motion.toe_offs) / (end - begin)
    # A force that is early by the same time at heel strike has another clock, and does not end early. At the ends of a
    # record the nearest strike may be the next one.
    late_clock = np.where(np.abs(late_strike) < 0.5, np.minimum(late_strike, 0.0), 0.0)
    return whole & (late_off - late_clock > -EARLY_END)


def _light_steps(walk: MeasuredWalk, legs: Mapping[str, LegStrides], weight: float) -> NDArray:
    """Return heel strike and next heel strike of the other foot (P, 2) [s] of steps in which the feet do not bear the
    body: their mean vertical force is off that of whole strides by `WEIGHT_OFF`.

    A step is looked at if a stride of each foot that was on a plate has it in it. `weight` is the body's, in the unit
    of the forces, if no stride has two such steps.
    """
    if set(legs) != set(FILE_SIDES) or any("grf_vertical" not in leg for leg in walk.legs.values()):
        return np.empty((0, 2))
    total = np.sum([walk.legs[side]["grf_vertical"] for side in FILE_SIDES], axis=0)
    impulse = walk.tick * np.concatenate([[0.0], np.cumsum((total[1:] + total[:-1]) / 2)])

    def borne(times: NDArray) -> NDArray:
        """Return the mean force of both feet between the `times` (N, 2) [s]."""
        return np.diff(sample(impulse, times, walk.tick, walk.first))[:, 0] / np.diff(times)[:, 0]

    strides = {side: legs[side].times[legs[side].weighed][:, [0, 2]] for side in FILE_SIDES}
    steps = [
        (begin, end)
        for ahead, behind in (FILE_SIDES, FILE_SIDES[::-1])
        for begin, _ in strides[ahead]
        for start, end in strides[behind]
        if start < begin < end
    ]
    if not steps:
        return np.empty((0, 2))
    times = np.array(steps)
    whole = np.concatenate([*strides.values()])
    whole = whole[_steps_in(whole, times).sum(axis=1) == len(FILE_SIDES)]
    if len(whole):
        # Plates lose force and never make any: the weight is nearer to the largest than to the mean.
        weight = float(np.quantile(borne(whole), 0.9))
    return times[np.abs(borne(times) / weight - 1.0) > WEIGHT_OFF]


def _steps_in(strides: NDArray, steps: NDArray) -> NDArray:
    """Return (S, P) True where a step (P, 2) lies within a stride, (S, 2) or (S, 3) [s]."""
    return (strides[:, :1] <= steps[:, 0]) & (steps[:, 1] <= strides[:, -1:])


def _without_strides(leg: LegStrides, off: NDArray) -> LegStrides:
    """Return a leg of which the strides `off` (S,), if they count for forces, do so no more."""
    return replace(leg, weighed=leg.weighed & ~off, partly=leg.partly | (leg.weighed & off))


def _mended_toe_offs(walk: MeasuredWalk, name: str, leg: LegStrides) -> NDArray:
    """Return the times (S, 3) of a leg's strides, toe-off by the foot's motion where a part of the force is missing."""
    motion = _contacts_of_motion(walk, walk.legs[name]) if leg.partly.any() else None
    if motion is None:
        return leg.times
    begin, off, end = leg.times.T
    moved = next_after(motion.toe_offs, begin)
    return np.stack([begin, np.where(leg.partly & (moved < end), moved, off), end], axis=-1)


def _borne_weight(legs: Iterable[LegStrides]) -> float | None:
    """Return the weight that the vertical forces bear over whole strides, in their unit; None without forces.

    Over a stride the two feet bear just the body's weight: one leg alone is taken to bear half of it.
    """
    # Mean vertical force over each leg's strides; percent 100 is percent 0 of the next stride.
    borne = [
        float(forces[:, :-1].mean())
        for leg in legs
        if "grf_vertical" in leg.curves and len(forces := leg.counted("grf_vertical"))
    ]
    return 2 * float(np.mean(borne)) if borne else None


class BorneMass(NamedTuple):
    """Mass that the vertical forces bear over whole strides."""

    mass: float
    """[kg]."""
    legs: tuple[str, ...]
    """Legs with the forces that tell it."""


def borne_mass(walk: MeasuredWalk) -> BorneMass | None:
    """Return the mass that the vertical forces of all legs bear over whole strides; None without forces in N."""
    legs = {name: leg for name, leg in _legs_as_read(walk, "both").items() if (name, "grf_vertical") in walk.unscaled}
    weight = _borne_weight(legs.values())
    weighed = tuple(name for name, leg in legs.items() if leg.weighed.any())
    return None if weight is None else BorneMass(weight / GRAVITY, weighed)


def _strides_of_leg(walk: MeasuredWalk, side: str, weight: float | None) -> tuple[NDArray, str]:
    """Return (S, 3) heel strike, toe-off, next heel strike [s] of one leg, by the first method that finds enough, and
    its name in `EVENT_METHODS`. `weight` as in `_legs_by_weight`."""
    leg = walk.legs[side]
    methods: tuple[Callable[[], Contacts | None], ...] = (
        lambda: _contacts_of_force(walk, leg, weight),
        lambda: walk.contacts.get(side),
        lambda: _contacts_without_force(walk, leg),
    )
    best = np.empty((0, 3))
    name = EVENT_METHODS[0]
    for method_name, method in zip(EVENT_METHODS, methods, strict=True):
        # A later method counts only if those before it found too few.
        if len(best) >= FEWEST_STRIDES or (contacts := method()) is None:
            continue
        strides = contacts.strides(after=walk.first)
        strides = strides[strides[:, 2] <= walk.last]
        duration = strides[:, 2] - strides[:, 0]
        usual = np.median(duration) if len(duration) else 0.0
        strides = strides[np.abs(duration - usual) <= UNEVEN_STRIDE * usual]
        if len(strides) > len(best):
            best = strides
            name = method_name
    return best, name


def _contacts_of_force(walk: MeasuredWalk, leg: Series, weight: float | None) -> Contacts | None:
    """Return the events of a leg by its vertical force; None without one. `weight` as in `_legs_by_weight`."""
    if "grf_vertical" not in leg:
        return None
    threshold = CONTACT_THRESHOLD_BW * (weight or _body_weight(leg["grf_vertical"]))
    return find_contacts(leg["grf_vertical"], walk.tick, threshold, walk.first)


def _contacts_of_motion(walk: MeasuredWalk, leg: Series) -> Contacts | None:
    """Return the events of a leg by its motion; None without thigh, or hip, and knee."""
    thigh = leg.get("thigh", leg.get("hip"))
    if thigh is None or "knee" not in leg:
        return None
    return _events_of_motion(thigh, leg["knee"], leg.get("ankle", 0 * thigh), walk.tick, walk.first)


def _contacts_without_force(walk: MeasuredWalk, leg: Series) -> Contacts | None:
    """Return the events of a leg by its motion, toe-off where the ankle's moment ends if it is in the files.

    The moment ends at `UNLOADED` of its peak in the stride. None without thigh, or hip, and knee.
    """
    contacts = _contacts_of_motion(walk, leg)
    if contacts is None or "ankle_moment" not in leg:
        return contacts
    moment = leg["ankle_moment"]
    offs = []
    for begin, end in pairwise(contacts.heel_strikes):
        first, last = (np.array([begin, end]) - walk.first) / walk.tick
        stride = moment[round(first) : round(last) + 1]
        if not len(stride):
            continue
        top = int(stride.argmax())
        ended = np.flatnonzero(stride[top:] <= UNLOADED * stride[top])
        if len(ended):
            offs.append(walk.first + walk.tick * (round(first) + top + int(ended[0])))
    return replace(contacts, toe_offs=np.array(offs)) if offs else contacts


def force_delay(walk: MeasuredWalk, side: str = "both") -> float | None:
    """Return the time by which forces are later than the motion of the legs of `side` [s]; None without both.

    It is that of toe-offs by force less toe-offs by motion, the median of each leg, the mean of the legs: heel strikes
    tell less, as on a stiff foot the heel is farthest ahead long before it lands.
    """
    delays = []
    for name, leg in walk.legs.items():
        by_force, by_motion = _contacts_of_force(walk, leg, None), _contacts_of_motion(walk, leg)
        if side in ("both", name) and by_force is not None and by_motion is not None:
            late = _lateness(by_force.toe_offs, by_motion.toe_offs)
            if min(len(late), len(by_motion.toe_offs)) > FEWEST_STRIDES:
                delays.append(float(np.median(late)))
    return float(np.mean(delays)) - USUAL_DELAY if delays else None


def _lateness(times: NDArray, others: NDArray) -> NDArray:
    """Return how much later each of `times` (N,) is than the nearest of `others` [s]; nothing without `others`."""
    return times - others[np.abs(others - times[:, None]).argmin(axis=1)] if len(others) else np.empty(0)


def _events_of_motion(thigh: NDArray, knee: NDArray, ankle: NDArray, tick: float, first: float) -> Contacts:
    """Find heel strikes and toe-offs from joint angles (T,) [rad]: the heel is farthest ahead, the toe hindmost.

    Samples are `tick` [s] apart, the first at time `first` [s]. Distances are from the hip, on a body of average
    proportions: only the times of the extremes count. After Zeni, Richards, Higginson, Gait & Posture 27 (2008)
    710-714 (there with markers from the sacrum), with the delay of people's events after these extremes.
    """
    from scipy.signal import find_peaks  # as below

    body = Body()
    thigh, knee, ankle = (_smooth(angle, tick) for angle in (thigh, knee, ankle))
    turn = segment_turns({"thigh": thigh, "knee": knee, "ankle": ankle, "toe": 0.0})
    x = joint_positions(body, turn, np.zeros((len(turn), 2)))["ankle"][:, 0]
    heel = x + turned(turn[:, FOOT_SEGMENT], -body.heel_to_ankle, -body.ankle_height)[0]
    toe = x + turned(turn[:, FOOT_SEGMENT], body.ankle_to_toe_joint + body.toe_length, -body.ankle_height)[0]

    def peaks(values: NDArray) -> NDArray:
        """Return the times [s] of the maxima, by the parabola through each and its neighbours."""
        # Half of the excursion stands out once a stride, whatever the cadence.
        index = find_peaks(values, prominence=0.5 * np.ptp(values))[0]
        before = values[index - 1]
        top = values[index]
        after = values[index + 1]
        return first + tick * (index + 0.5 * (before - after) / (before - 2 * top + after))

    strikes = peaks(heel)
    offs = peaks(-toe)
    stride = float(np.median(np.diff(strikes))) if len(strikes) > 1 else 0.0  # stride time [s]
    return Contacts(heel_strikes=strikes + HEEL_STRIKE_AFTER * stride, toe_offs=offs + TOE_OFF_AFTER * stride)


def _smooth(angle: NDArray, tick: float) -> NDArray:
    """Return the angle (T,) after a low-pass without delay: a Butterworth filter of second order, forward and back."""
    from scipy.signal import sosfiltfilt  # half a second to import, and only files need it

    # The ends are continued by half a second, or by as much as a short record has.
    return sosfiltfilt(_low_pass(tick), angle, padlen=min(len(angle) - 1, round(0.5 / tick)))


@lru_cache(maxsize=16)
def _low_pass(tick: float) -> NDArray:
    """Return the filter of `_smooth` for samples `tick` [s] apart; its design takes longer than its use."""
    from scipy.signal import butter  # as in `_smooth`

    return np.asarray(butter(2, CUTOFF, fs=1 / tick, output="sos"))


def _body_weight(force: NDArray) -> float:
    """Return an estimate of the body weight, in the unit of a vertical `force`: 1 for a force that is never positive.

    It is the median of the samples beyond half of the largest.
    """
    return float(np.median(force[force > 0.5 * force.max()])) if force.max(initial=0.0) > 0 else 1.0


def _on_plate(vertical: NDArray, weight: float | None) -> NDArray:
    """Return (S,) True for strides with the stance on a force plate; `vertical` (S, 101) is their vertical force, and
    `weight` as in `_legs_by_weight`."""
    low, high = WEIGHT_BEARING
    # A foot on a plate bears most of the body weight there; 0.3 of it is beyond noise.
    return vertical[:, low : high + 1].min(axis=1, initial=np.inf) > 0.3 * (weight or _body_weight(vertical))


def _ends_abruptly(vertical: NDArray, weight: float | None) -> NDArray:
    """Return (S,) True for strides with a force that falls by `ABRUPT_UNLOADING` at once to next to nothing; arguments
    as in `_on_plate`."""
    weight = weight or _body_weight(vertical)
    begin = WEIGHT_BEARING[0]
    after = vertical[:, begin + 2 :]
    fall = vertical[:, begin:-2] - after  # within 2 %
    # After an impact force falls as far, but not to nothing.
    return np.any((fall >= ABRUPT_UNLOADING * weight) & (after < (1.0 - LEAST_PEAK) * weight), axis=1)


def _scaled_curves(curves: Series, side: str, unscaled: Collection[tuple[str, str]], mass: float | None) -> Series:
    """Return the curves of the leg `side`, forces in body weights, moments and powers per kg of `mass` [kg].

    `unscaled` has the (side, curve) that still have to be divided; without a mass these are left out.
    """
    scaled = {}
    for name, values in curves.items():
        if (side, name) not in unscaled:
            scaled[name] = values
        elif mass is not None:
            scaled[name] = values / (mass * (GRAVITY if name in FORCES else 1.0))
    return scaled
