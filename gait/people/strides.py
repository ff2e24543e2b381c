"""Cut measured walks into strides: common time, heel strikes and toe-offs, curves over percent of each stride."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError

from ..body.body import GRAVITY, Body
from ..body.leg import FOOT_SEGMENT, joint_positions, segment_turns
from ..body.rockers import turned
from .gait_events import CONTACT_THRESHOLD_BW, Contacts, find_contacts, on_percent
from .human import COLUMNS, FORCES
from .motion_files import Series, Trial, refuse_impossible_angles

FEWEST_STRIDES = 2
"""Fewest strides, of both feet together, for a mean and its spread."""
LONGEST_TICK = 1 / 30
"""Longest time between samples [s]; chosen: a coarser sampling misses the time of a landing."""
SHORTEST_TICK = 1e-3
"""Shortest time between samples [s]; chosen: finer sampling is thinned out to it."""
LONGEST_GAP = 0.1
"""Longest gap between samples that a straight line bridges [s]; chosen."""
UNEVEN_STRIDE = 0.25
"""Largest difference of a stride's duration from the median, over the median; other strides are left out, as a missed
event or a turn; chosen."""
HEEL_STRIKE_AFTER, TOE_OFF_AFTER = 0.032, 0.006
"""Time from the farthest heel to heel strike, and from the hindmost toe to toe-off, in people's curves [strides]: 0.030
to 0.036 and 0.004 to 0.009 at 0.85 to 1.96 m/s."""
CUTOFF = 6.0
"""Low-pass frequency of angles for events and rates [Hz]: usual for walking (Winter 2009, ch. 3)."""
WEIGHT_BEARING = (15, 45)
"""Percents of the stride between which a foot bears weight; chosen. A foot without load there was not on a plate."""


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

    @property
    def last(self) -> float:
        """Return the time of the last sample [s]."""
        return self.first + self.tick * (min(len(c) for leg in self.legs.values() for c in leg.values()) - 1)


def merge_trials(trials: Sequence[Trial]) -> MeasuredWalk:
    """Merge trials of the same walk on common samples: each curve comes from the first trial that has it.

    Joint powers are computed where angle and moment are there, and knees bent backward are turned if the trial says so.

    Raises `SpringfootError` for sampling too coarse, a gap, or no time in common.
    """
    name = ",".join(trial.name for trial in trials)
    for trial in trials:
        gaps = np.diff(trial.time)
        if not len(gaps) or (tick := float(np.median(gaps))) > LONGEST_TICK * 1.001:  # times are rounded
            sampling = f"one every {tick:.3g} s" if len(gaps) else "a single one"
            raise SpringfootError(f"{trial.name} must have at least 30 samples a second, has {sampling}")
        if gaps.max() > LONGEST_GAP:
            longest = int(gaps.argmax())
            raise SpringfootError(
                f"{trial.name} has no samples for {gaps[longest]:.2f} s after {trial.time[longest]:.2f} s"
            )
    tick = max(min(float(np.median(np.diff(trial.time))) for trial in trials), SHORTEST_TICK)
    first = max(trial.time[0] for trial in trials)
    last = min(trial.time[-1] for trial in trials)
    if last - first < tick:
        raise SpringfootError(f"{name}: the files have no time in common")
    # The factor: a last sample must not be lost to rounding.
    time = first + tick * np.arange(int((last - first) / tick * (1 + 1e-12)) + 1)
    legs: dict[str, Series] = {}
    unscaled = set()
    unsigned = {}  # side -> curves whose sign is that of the model's coordinate
    for trial in trials:
        for side, curves in trial.legs.items():
            for curve in curves.keys() - legs.get(side, {}).keys():
                legs.setdefault(side, {})[curve] = np.interp(time, trial.time, curves[curve])
                if trial.knee_as_read and curve in ("knee", "knee_moment"):
                    unsigned.setdefault(side, set()).add(curve)
                if curve in trial.unscaled:
                    unscaled.add((side, curve))
    for side, leg in legs.items():
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
    speed = next((trial.speed for trial in trials if trial.speed is not None), None)
    return MeasuredWalk(name=name, first=first, tick=tick, legs=legs, unscaled=unscaled, contacts=contacts, speed=speed)


def cut_strides(walk: MeasuredWalk, side: str = "both", mass: float | None = None) -> tuple[NDArray, Series]:
    """Cut a walk into strides: return their events, and each curve over percent of the strides.

    Events are times (S, 3) of heel strike, toe-off and next heel strike of S strides [s]. Curves are (strides that have
    it, 101), in the units of `HumanGait`. `side` is both, left or right; `mass` [kg] as in `own_data.read_gait`. Raises
    `SpringfootError` for too few strides.
    """
    chosen = {name: leg for name, leg in walk.legs.items() if side in ("both", name)}
    strides = {name: _strides_of_leg(walk, name) for name in chosen}
    times = np.concatenate([*strides.values(), np.empty((0, 3))])
    if len(times) < FEWEST_STRIDES:
        raise SpringfootError(
            f"{walk.name}: needs at least {FEWEST_STRIDES} complete strides, has {len(times)} "
            "(they are found in grf_vertical, events, or thigh or hip with knee)"
        )
    cut: dict[tuple[str, str], NDArray] = {}  # (side, curve) -> (strides, 101)
    for name, leg in chosen.items():
        begin, _, end = strides[name].T
        for curve, series in leg.items():
            cut[name, curve] = on_percent(series, begin, end, walk.tick, walk.first)
        _drop_unmeasured_forces(cut, name)
    _normalise(cut, walk.unscaled, mass)
    # Both legs' strides, one below the other.
    curves = {
        curve: np.concatenate([values for (_, name), values in cut.items() if name == curve])
        for curve in COLUMNS
        if any(name == curve for _, name in cut)
    }
    return times, {name: values for name, values in curves.items() if len(values) >= FEWEST_STRIDES}


def _strides_of_leg(walk: MeasuredWalk, side: str) -> NDArray:
    """Return (S, 3) heel strike, toe-off, next heel strike [s] of one leg, by the first method that finds enough.

    Methods: the vertical force, the events in the file, the leg's motion.
    """
    leg = walk.legs[side]
    candidates = []
    if "grf_vertical" in leg:
        threshold = CONTACT_THRESHOLD_BW * _body_weight(leg["grf_vertical"])
        candidates.append(find_contacts(leg["grf_vertical"], walk.tick, threshold, walk.first))
    if side in walk.contacts:
        candidates.append(walk.contacts[side])
    thigh = leg.get("thigh", leg.get("hip"))
    if thigh is not None and "knee" in leg:
        candidates.append(_events_of_motion(thigh, leg["knee"], leg.get("ankle", 0 * thigh), walk.tick, walk.first))
    best = np.empty((0, 3))
    for contacts in candidates:
        strides = contacts.strides(after=walk.first)
        strides = strides[strides[:, 2] <= walk.last]
        duration = strides[:, 2] - strides[:, 0]
        usual = np.median(duration) if len(duration) else 0.0
        strides = strides[np.abs(duration - usual) <= UNEVEN_STRIDE * usual]
        # A later method counts only if those before it found too few.
        if len(strides) > len(best) and len(best) < FEWEST_STRIDES:
            best = strides
    return best


def _events_of_motion(thigh: NDArray, knee: NDArray, ankle: NDArray, tick: float, first: float) -> Contacts:
    """Find heel strikes and toe-offs from joint angles (T,) [rad]: the heel is farthest ahead, the toe hindmost.

    Samples are `tick` [s] apart, the first at time `first` [s]. Distances are from the hip, on a body of average
    proportions: only the times of the extremes count. After Zeni, Richards, Higginson, Gait & Posture 27 (2008)
    710-714, who take markers from the sacrum, with the delay of people's events after these extremes.
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
    from scipy.signal import butter, sosfiltfilt  # half a second to import, and only files need it

    # The ends are continued by half a second, or by as much as a short record has.
    return sosfiltfilt(
        butter(2, CUTOFF, fs=1 / tick, output="sos"), angle, padlen=min(len(angle) - 1, round(0.5 / tick))
    )


def _body_weight(force: NDArray) -> float:
    """Return about the body weight, in the unit of a vertical `force`: 1 for a force that is never positive.

    It is the median of the samples beyond half of the largest.
    """
    return float(np.median(force[force > 0.5 * force.max()])) if force.max(initial=0.0) > 0 else 1.0


def _drop_unmeasured_forces(cut: dict[tuple[str, str], NDArray], side: str) -> None:
    """Drop, in place, a leg's forces in strides whose stance was not on a force plate.

    `cut` is (side, curve) -> (strides, 101).
    """
    vertical = cut.get((side, "grf_vertical"))
    if vertical is not None:
        low, high = WEIGHT_BEARING
        # A foot on a plate bears most of the body weight there; 0.3 of it is beyond what noise shows.
        measured = vertical[:, low : high + 1].min(axis=1) > 0.3 * _body_weight(vertical)
        for name in FORCES:
            if (side, name) in cut:
                cut[side, name] = cut[side, name][measured]


def _normalise(cut: dict[tuple[str, str], NDArray], unscaled: set[tuple[str, str]], mass: float | None) -> None:
    """Divide the `unscaled` curves in place: forces by body weight, moments and powers by body mass.

    `cut` is (side, curve) -> (strides, 101). The mass is `mass` [kg], or the one that the vertical forces bear; without
    either these curves are dropped.
    """
    weight = None if mass is None else mass * GRAVITY  # [N]
    # Mean vertical force of each stride [N]; percent 100 is percent 0 of the next stride.
    borne = [cut[key][:, :-1].mean(axis=1) for key in unscaled if key[1] == "grf_vertical" and key in cut]
    if weight is None and sum(map(len, borne)):  # at least one stride with a measured force
        # Over a stride the two feet bear just the body's weight, and so one bears half of it.
        weight = 2 * float(np.mean(np.concatenate(borne)))
    for key in unscaled & cut.keys():
        if weight is None:
            del cut[key]
        else:
            cut[key] = cut[key] / (weight if key[1] in FORCES else weight / GRAVITY)
