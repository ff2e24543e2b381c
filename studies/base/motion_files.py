"""Give studies that read one walk's motion files their flags, the reading, and the words on it."""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import tyro

from springfoot.errors import SpringfootError
from springfoot.gait import Body, HumanGait
from springfoot.gait.body import REFERENCE_HEIGHT
from springfoot.gait.people import MeasuredPerson, read_person

from .flags import files_of
from .study import Study

USUAL_SPEED = 1.2
"""Speed of the norm where nothing tells the person's [m/s]."""


@dataclass(frozen=True, kw_only=True)
class MotionFiles(Study):
    """A study of the motion files of one walk."""

    files: Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="FILE ...", help_behavior_hint="")]
    """Motion files of one walk: CSV, OpenSim's .mot and .sto, .c3d, Visual3D's .txt; FILE:CONDITION for one of several
    in a CSV. docs/how-to/own-data.md lists the columns."""
    mass: float | None = None
    """Body mass [kg]; None takes the mass that the forces bear."""
    height: float = REFERENCE_HEIGHT
    """Body height [m], of the norm and of a body that walks here."""
    side: Literal["left", "right", "both"] = "both"
    """Side of the strides that count."""
    columns: Annotated[tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="OURS=THEIRS")] = ()
    """Name of a column here, and its name in the files, such as knee_angle_r=KneeRight; once for each column."""
    speed: float | None = None
    """Walking speed [m/s]; None takes that of the files."""
    skip: float | None = None
    """Time at the start of the files that does not count [s]; None takes 3 s, as evaluations do, of walks of 10 s and
    more."""
    trust_units: tyro.conf.FlagCreatePairsOff[bool] = False
    """Take the files as they are, even if units or signs look wrong, or forces seem to miss a part, as with a cane."""

    REPEATABLE: ClassVar[Collection[str]] = frozenset({"--columns"})

    def check(self) -> None:
        """Refuse a missing file, columns without two names, and a body out of range."""
        if not self.files:
            raise SpringfootError("give the motion files of one person, such as walk.mot forces.mot")
        for words in self.columns:
            ours, equals, theirs = words.partition("=")
            if not (ours and equals and theirs):
                raise SpringfootError(
                    f"--columns must be OURS=THEIRS, such as knee_angle_r=KneeRight, got {words!r:.60}"
                )
        if len({words.partition("=")[0] for words in self.columns}) < len(self.columns):
            raise SpringfootError("--columns names one of our columns twice")
        Body(height=self.height)

    def read(self) -> MeasuredPerson:
        """Return the person measured in the files."""
        named = [files_of(words) for words in self.files]
        conditions = [condition for _, condition in named if condition is not None]
        if conditions and len(named) > 1:
            raise SpringfootError(
                f"FILE:{conditions[0]} picks a gait of a CSV over percent, which must be alone, got {len(named)} files"
            )
        return read_person(
            [file for files, _ in named for file in files],
            condition=conditions[0] if conditions else None,
            side=self.side,
            mass=self.mass,
            speed=self.speed,
            skip=self.skip,
            trust_units=self.trust_units,
            columns=dict(words.split("=", 1) for words in self.columns),
        )

    def readings(self, measured: MeasuredPerson, norm: HumanGait, without_mass: str = "") -> list[str]:
        """Return sentences for the report on files, strides, speed, mass and norm; `without_mass` follows "Mass:
        unknown"."""
        gait = measured.gait
        speed = "as given" if self.speed else "from the files"
        return [
            f"Files: {gait.name}; strides: {_strides(measured)}; side: {self.side}.",
            f"Speed: {gait.speed:.2f} m/s, {speed}."
            if gait.speed
            else f"Speed: unknown; the norm is of {USUAL_SPEED:g} m/s. --speed gives it.",
            f"Mass: {measured.mass:.1f} kg, {measured.mass_from}."
            if measured.mass
            else f"Mass: unknown{without_mass}. --mass gives it.",
            f"Norm: 20 adults at {norm.speed:.2f} m/s, {self.height:g} m tall"
            f"{', the nearest measured speed' if norm.clamped else ''}.",
        ]


def _strides(measured: MeasuredPerson) -> str:
    """Return the number of strides of each leg in words, and how many of them stood on a force plate unless all did."""
    counts = {side: len(leg.times) for side, leg in measured.legs.items() if len(leg.times)}
    if not counts:
        return "mean curves" if measured.gait.strides is None else f"mean curves of {measured.gait.strides}"
    words = _list(counts.values(), counts)
    weighed = {side: int(leg.weighed.sum()) for side, leg in measured.legs.items()}
    if any(weighed[side] < count for side, count in counts.items()):
        words += f" (on a force plate {_list([weighed[side] for side in counts], counts)})"
    return words


def _list(counts: Collection[int], sides: Collection[str]) -> str:
    """Return counts with their sides in words, such as 12 left, 11 right."""
    return ", ".join(f"{count} {side}".strip() for count, side in zip(counts, sides, strict=True))
