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
from .motion_files import NO_NAMES
from .own_data import (
    ACCEPTED,
    OwnGait,
    gait_of_percents,
    gait_of_walk,
    one_condition,
    people_at,
    percent_curves,
    read_files,
)
from .scores import LOADING_END_PERCENT
from .strides import LegStrides, MeasuredWalk, borne_mass, force_delay, strides_of_legs

MASSES_APART = 1.1
"""Largest factor between the body mass of the caller and that which the forces bear that gets no note; chosen."""
CLOCKS_APART = 0.06
"""Largest time between forces and motion that gets no note [s]; chosen. Right files have 0.03 s at most: people
at 0.85 to 1.9 m/s, and walks here on sound, weak, passive, rigid and dropping feet."""
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
yet its gait, and of a laboratory's treadmill these are 3 of ten strides or more, whose belt may still speed up; walks
over ground, which begin before the cameras see them, are shorter."""

COARSE = (
    "interpolated by cubic splines; in short phases of stance, such as controlled plantarflexion, quasi-stiffness may "
    "be 6 % off that of a full grid at the ankle, 14 % at the toe, elsewhere 1 %"
)
"""Words on curves with a row every 2 %: the largest differences of people's curves at 0.9 to 1.9 m/s and of a walk of
`pretrained` here from the same at every percent. Without the spline they were 28 and 79 %."""


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
        """Return the mean phase of toe-off of a leg, 0..1; for mean curves that of the file, None if it has none."""
        leg = self.legs[side]
        if not len(leg.times):
            return self.gait.toe_off
        return float(np.mean(leg.toe_off_phase))


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
                weighed=np.ones(1, bool),
            )
            for leg, curves in percent_curves(table).items()
            if side == "both" or leg in (side, "")
        }
        if len(table.rows) != len(PERCENT):
            notes.append(f"{table.name} has a row every 2 % of the stride: {COARSE}.")
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
        if any(name.endswith("_moment") for _, name in walk.unscaled) and mass is None and borne is None:
            notes.append("Moments left out: they are in N m, and without forces only --mass tells the body mass.")
            notes += _doubtful_moments(walk)
    if speed is not None:
        gait = replace(gait, speed=speed)
    _require_small_toe_moment(gait.name, legs, trust_units)
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
            f"The vertical force rises at heel strike at {words} of people's rate: was it smoothed? In a walk here "
            "a low-pass at 6 Hz made quasi-stiffness a third to a half too low in the first 6 % of the stride, and a "
            "fifth too high in late mid-stance."
        )
    return notes


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


def _require_small_toe_moment(name: str, legs: Mapping[str, LegStrides], trust_units: bool) -> None:
    """Raise `SpringfootError` for a toe's moment larger than the ankle's, whose lever is longer."""
    for side, leg in legs.items():
        if trust_units or not {"toe_moment", "ankle_moment"} <= leg.curves.keys() or not leg.weighed.any():
            continue
        toe, ankle = (np.abs(leg.counted(curve).mean(axis=0)).max() for curve in ("toe_moment", "ankle_moment"))
        if toe > ankle:
            raise SpringfootError(
                f"{name}, the {side or 'one'} leg: the toe's moment reaches {toe:.3g} N m/kg, the ankle's {ankle:.3g}: "
                f"another unit? {AS_IT_IS}"
            )
