"""Read the motion files of one person: their mean gait as `read_gait` reads it, and each leg's strides behind it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError, require_within
from springfoot.files.text_table import Table

from ..body.body import GRAVITY, MASS_RANGE
from .checks import AS_IT_IS
from .gait_events import PERCENT, WARM_UP
from .human import COLUMNS
from .motion_files import FILE_SIDES, NO_NAMES
from .own_data import (
    ACCEPTED,
    OwnGait,
    gait_of_percents,
    gait_of_walk,
    one_condition,
    people_at,
    percent_curves,
    read_files,
    toe_off_of,
)
from .scores import LOADING_END_PERCENT
from .strides import (
    EVENT_METHODS,
    TORQUE_ANGLE_CURVES,
    LegStrides,
    MeasuredWalk,
    borne_mass,
    force_delay,
    strides_of_legs,
)

MASSES_APART = 1.1
"""Largest factor between the body mass of the caller and that which the forces bear that gets no note; chosen."""
CLOCKS_APART = 0.055
"""Largest time between forces and motion (`force_delay`), or between ankle moment and force, that gets no note [s];
chosen. Right files have 0.027 and 0.031 s at most: people at 0.85 to 1.9 m/s, and walks here on sound, weak, passive
and rigid feet."""
PARTLY = (
    "a foot was partly off its plate, as its force ends before the foot leaves the ground, does not reach 0.9 body "
    "weights, or both feet together do not bear the body in a step"
)
"""Words on `LegStrides.partly`."""
SLOW_RISE = 0.6
"""Rate at which the vertical force rises at heel strike, over people's at that speed, below which the report asks for
smoothing [-]; chosen. Walks here have 0.68 and more, behind a low-pass at 6 Hz 0.3 to 0.55 on most feet."""
FORCE_UNIT_OFF = 0.1
"""Largest difference of the borne weight from that of a unit, for the unit to be the guess [-]; chosen."""
SMALLEST_NM = 6.0
"""Peak of an ankle's moment below which it is not in N m; chosen: the least mass, 20 kg, makes 28 at people's 1.4
N m/kg, and 3.5 times people's moment is 4.9 N m/kg."""
LONGEST_SKIP = 1e4
"""Longest start of a walk that may be left out [s]; chosen."""
LONG_WALK = 10.0
"""Time from which the first `WARM_UP` of a walk does not count [s]; chosen. A simulation begins in a state that is not
yet its gait, and on a laboratory's treadmill, where the belt may still speed up, these are 3 of ten strides or more;
walks over ground, which begin before the cameras see them, are shorter."""

LATE_STANCE, MID_STANCE = (0.7, 1.0), (0.25, 0.6)
"""Parts of stance after heel-off, and with a flat foot; chosen."""
LEAST_TOE_TURN, LEAST_TOE_RISE = np.radians(10.0), 0.2
"""Excursion of a toe over the stride below which its shape is not looked at [rad], and least rise after heel-off over
the excursion [-]; chosen. Toes here rise by 0.67 and more."""
LEAST_TOE_SHARE = 0.01
"""Least moment of a toe over the ankle's [-]; chosen. Toes here have 0.08 and more, one in N m/kg where N m must be
0.003."""
STRIKES_APART = 0.15
"""Least time between strikes of the two feet over that of a stride [-]; chosen. Walks have 0.4 to 0.5."""

COARSE = (
    "quasi-stiffness of short phases, such as controlled plantarflexion and the toe's push-off, may be a third off, of "
    "2 % grids more than half; late rising 11 %, the ankle's push-off 5 %"
)
"""Words on mean curves: the largest differences of 17 walks here and of people at 0.9 to 1.9 m/s, read at percents,
from the same at tenths of a percent."""


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredPerson:
    """One person's walk, measured."""

    gait: OwnGait
    """Their mean gait: of both legs together, or of the side that was asked for."""
    legs: Mapping[str, LegStrides]
    """Side (left, right, or "" for curves without a side) -> strides; a mean curve counts as one stride."""
    mass: float | None
    """Body mass [kg]; None if neither the caller nor the forces give it."""
    mass_from: str
    """Where the mass comes from, in words."""
    notes: tuple[str, ...]
    """Sentences on guesses and omissions."""

    def toe_off(self, side: str) -> float | None:
        """Return the mean phase of toe-off of a leg, 0..1; None for mean curves of a file that does not tell it."""
        return _toe_off(self.legs[side])


def read_person(
    paths: Sequence[str | Path],
    *,
    condition: str | None = None,
    side: str = "both",
    mass: float | None = None,
    speed: float | None = None,
    skip: float | None = None,
    trust_units: bool = False,
    columns: Mapping[str, str] = NO_NAMES,
) -> MeasuredPerson:
    """Return one person's walk from its files.

    `speed` [m/s] goes before that of the files. Of a walk over time the first `skip` seconds are left out; None leaves
    out `WARM_UP` of a walk that lasts `LONG_WALK`. The rest is as in `read_gait`, which leaves out nothing.

    A leg with too few strides for a spread is kept, with all its strides. Raises `SpringfootError` as `read_gait` does,
    for forces that bear a mass outside `MASS_RANGE`, for a toe's moment larger than the ankle's, and for a
    `skip` that leaves nothing.
    """
    if mass is not None:
        require_within("mass", mass, MASS_RANGE, "kg")
    if speed is not None:
        low, high, unit = ACCEPTED["speed"]
        require_within("speed", speed, (low, high), unit)
    if skip is not None:
        require_within("skip", skip, (0.0, LONGEST_SKIP), "s")
    read = read_files(paths, columns)
    notes: list[str] = []
    if isinstance(read, Table):
        table = one_condition(read, condition)
        gait = gait_of_percents(table, side, trust_units)
        legs = {
            leg: LegStrides(
                times=np.empty((0, 3)),
                curves={name: values[None] for name, values in curves.items()},
                fine={name: curves[name][None] for name in TORQUE_ANGLE_CURVES if name in curves},
                weighed=np.ones(1, bool),
                toe_off=toe_off_of(table, leg, curves),
            )
            for leg, curves in percent_curves(table).items()
            if side == "both" or leg in (side, "")
        }
        grid = "" if len(table.rows) == len(PERCENT) else "every 2 % of the stride, interpolated by cubic splines, "
        notes.append(f"{table.name} has mean curves {grid}and no samples between: {COARSE}.")
        borne = None
    else:
        walk = replace(read, trusted=trust_units, speed=read.speed if speed is None else speed)
        if skip is None:
            skip = WARM_UP if round(walk.last - walk.first, 1) >= LONG_WALK else 0.0  # ends of files differ by ticks
        if skip:
            walk = walk.without_start(skip)
            notes.append(f"Left out: the first {skip:g} s.")
        by_forces = borne_mass(walk)
        borne = by_forces.mass if by_forces else None
        if mass is None and borne is not None:
            low, high = MASS_RANGE
            if not low <= borne <= high:
                raise SpringfootError(
                    f"{walk.name}: the vertical forces, {_columns_of(walk, 'grf_vertical')}, bear {borne:.3g} kg, must "
                    f"be {low:g} to {high:g}: {_force_unit(borne)}?"
                )
        gait = gait_of_walk(walk, side, mass, trust_units)
        legs = {leg: strides for leg, strides in strides_of_legs(walk, side, mass).items() if len(strides.times)}
        notes += walk.notes
        notes += _notes_on_plates(walk, legs)
        if mass is None and by_forces and len(by_forces.legs) < len(walk.legs):
            alone = by_forces.legs[0]
            notes.append(f"The mass is from the force of the {alone} foot alone, taken to bear half of the body.")
        delay = force_delay(walk, side)
        if delay is not None and abs(delay) > CLOCKS_APART:
            late = "later" if delay > 0 else "earlier"
            notes.append(
                f"The forces are {abs(delay):.2f} s {late} than the legs' motion: do the files have one clock? "
                "Stiffness needs moment and angle of one time."
            )
        notes += _notes_on_moments(legs)
        if any(leg.events == EVENT_METHODS[-1] for leg in legs.values()):
            notes.append(
                f"Heel strikes and toe-offs are by {EVENT_METHODS[-1]}: in walks here quasi-stiffness of controlled "
                "plantarflexion was then up to a half off, of the toe's push-off a fifth, elsewhere a tenth."
            )
        if any(name.endswith("_moment") for _, name in walk.unscaled) and mass is None and borne is None:
            notes.append("Moments left out: they are in N m, and without forces only --mass tells the body mass.")
            notes += _doubtful_moments(walk)
    if speed is not None:
        gait = replace(gait, speed=speed)
    if not trust_units:
        _require_toe(gait.name, legs, people_at(gait.speed).toe_off)
        _require_two_legs(gait.name, legs)
    mass_from = "as given" if mass is not None else "from the forces over whole strides"
    if mass is not None and borne is not None and not 1 / MASSES_APART < borne / mass < MASSES_APART:
        notes.append(f"The forces bear {borne:.3g} kg, not {mass:g}.")
    return MeasuredPerson(
        gait=gait, legs=legs, mass=borne if mass is None else mass, mass_from=mass_from, notes=tuple(notes)
    )


def _notes_on_plates(walk: MeasuredWalk, legs: Mapping[str, LegStrides]) -> list[str]:
    """Return sentences on strides left out as a foot was partly off its plate, and on forces that rise slowly."""
    notes = []
    partly = [f"{count} {side}".strip() for side, leg in legs.items() if (count := int(leg.partly.sum()))]
    if partly:
        notes.append(f"Forces and moments of {', '.join(partly)} strides left out: {PARTLY}.")
    people = _rise(people_at(walk.speed).mean("grf_vertical", PERCENT / 100))
    rises = {
        side: _rise(leg.counted("grf_vertical").mean(axis=0)) / people
        for side, leg in legs.items()
        if "grf_vertical" in leg.curves and leg.weighed.any()
    }
    if slow := {side: rise for side, rise in rises.items() if rise < SLOW_RISE}:
        words = " and ".join(f"{100 * rise:.0f} % {side}".strip() for side, rise in slow.items())
        notes.append(
            f"The vertical force rises at heel strike at {words} of people's rate: was it smoothed, or is a part "
            "missing? In a walk here "
            "a low-pass at 6 Hz made quasi-stiffness a third to a half too low in the first 6 % of the stride, and a "
            "fifth too high in late mid-stance."
        )
    return notes


def _notes_on_moments(legs: Mapping[str, LegStrides]) -> list[str]:
    """Return a sentence on ankle moments of another clock than their forces, for each leg with one.

    In push-off the force stays at the ball of the foot, so that moment and force fall to their halves together.
    """
    notes = []
    for side, leg in legs.items():
        if not {"ankle_moment", "grf_vertical"} <= leg.curves.keys() or not leg.weighed.any():
            continue
        moment, force = (leg.counted(name).mean(axis=0) for name in ("ankle_moment", "grf_vertical"))
        top = int(moment.argmax())
        halves = [_half_after(curve, top) for curve in (moment, force)]
        stride = float(np.mean(leg.times[:, 2] - leg.times[:, 0]))
        delay = stride * (halves[0] - halves[1]) / 100
        if abs(delay) > CLOCKS_APART:
            late = "later" if delay > 0 else "earlier"
            notes.append(
                f"The {side} ankle's moment falls {abs(delay):.2f} s {late} than its force: "
                "do the files have one clock?"
            )
    return notes


def _half_after(curve: NDArray, top: int) -> float:
    """Return the percent of the stride at which a curve (101,) has fallen to half of its value at percent `top`."""
    below = np.flatnonzero(curve[top:] < 0.5 * curve[top])
    if not len(below):
        return float(len(curve) - 1)
    after = top + int(below[0])
    return after - 1 + float((curve[after - 1] - 0.5 * curve[top]) / (curve[after - 1] - curve[after]))


def _rise(vertical: NDArray) -> float:
    """Return the largest rise of a vertical force (101,) within 2 % of the stride in the loading response."""
    loading = vertical[: LOADING_END_PERCENT + 1]
    return float((loading[2:] - loading[:-2]).max())


def _columns_of(walk: MeasuredWalk, curve: str) -> str:
    """Return the columns of a curve in words, of all legs."""
    return " and ".join(column for (_, name), column in walk.columns.items() if name == curve) or COLUMNS[curve]


def _force_unit(borne: float) -> str:
    """Return the unit in which forces bear a mass `borne` [kg] out of range: both feet bear one body weight."""
    low, high = MASS_RANGE
    of_body = {"body weights": 1.0, "percent of body weight": 100.0, "N/kg": GRAVITY}
    for unit, weight in of_body.items():
        if abs(borne * GRAVITY / weight - 1.0) < FORCE_UNIT_OFF:
            return f"in {unit}, not in N"
    return "in kN, not in N" if low <= 1e3 * borne <= high else "are they in N"


def _doubtful_moments(walk: MeasuredWalk) -> list[str]:
    """Return a sentence on ankle moments too small for N m, if they are; a list of it, or an empty one."""
    peaks = [float(np.abs(leg["ankle_moment"]).max()) for leg in walk.legs.values() if "ankle_moment" in leg]
    if not peaks or max(peaks) >= SMALLEST_NM:
        return []
    return [f"The largest of {_columns_of(walk, 'ankle_moment')} is {max(peaks):.2g}, too little for N m: in N m/kg?"]


def _toe_off(leg: LegStrides) -> float | None:
    """Return the mean phase of toe-off of a leg, 0..1; None for mean curves of a file that does not tell it."""
    return float(np.mean(leg.toe_off_phase)) if len(leg.times) else leg.toe_off


def _require_toe(name: str, legs: Mapping[str, LegStrides], usual_toe_off: float) -> None:
    """Raise `SpringfootError` for a toe that moves as none does: another foot's, of the wrong sign, or in another unit.

    The toe turns up after heel-off, and its moment, plantarflexion positive, is largest then and smaller than the
    ankle's with its longer lever. `usual_toe_off` is the phase of toe-off of legs that do not tell their own.
    """
    for side, leg in legs.items():
        where = f"{name}, the {side or 'one'} leg"
        toe_off = _toe_off(leg) or usual_toe_off
        late, middle = (
            slice(*(np.array(part) * 100 * toe_off).round().astype(int)) for part in (LATE_STANCE, MID_STANCE)
        )
        if "toe" in leg.curves:
            toe = leg.curves["toe"].mean(axis=0)
            if np.ptp(toe) > LEAST_TOE_TURN and toe[late].max() - toe[middle].mean() < LEAST_TOE_RISE * np.ptp(toe):
                raise SpringfootError(
                    f"{where}: the toe does not turn up after heel-off: of the other foot, or is toe up not positive? "
                    f"{AS_IT_IS}"
                )
        if not {"toe_moment", "ankle_moment"} <= leg.curves.keys() or not leg.weighed.any():
            continue
        toe, ankle = (leg.counted(curve).mean(axis=0) for curve in ("toe_moment", "ankle_moment"))
        largest = int(np.abs(toe).argmax())
        share = abs(toe[largest]) / np.abs(ankle).max()
        if not LEAST_TOE_SHARE <= share <= 1.0:
            raise SpringfootError(
                f"{where}: the toe's moment reaches {abs(toe[largest]):.3g} N m/kg, the ankle's "
                f"{np.abs(ankle).max():.3g}: another unit? {AS_IT_IS}"
            )
        if toe[largest] < 0:
            raise SpringfootError(
                f"{where}: the toe's moment is largest below 0: plantarflexion must be positive; {AS_IT_IS}"
            )
        if not 0.5 * toe_off <= largest / 100 <= toe_off + 0.05:
            raise SpringfootError(
                f"{where}: the toe's moment is largest at {largest} % of the stride, not in the second half of stance: "
                f"of the other foot? {AS_IT_IS}"
            )


def _require_two_legs(name: str, legs: Mapping[str, LegStrides]) -> None:
    """Raise `SpringfootError` if both feet strike at once, as of a leg that is a copy of the other."""
    if set(legs) != set(FILE_SIDES) or any(not len(leg.times) for leg in legs.values()):
        return
    left, right = (legs[side].times[:, 0] for side in FILE_SIDES)
    stride = float(np.median(legs["left"].times[:, 2] - left))
    # Time since the other foot's nearest strike, at most half a stride.
    apart = np.abs(left[:, None] - right).min(axis=1)
    if np.median(apart) < STRIKES_APART * stride:
        raise SpringfootError(f"{name}: both feet strike at once: is one leg a copy of the other? {AS_IT_IS}")
