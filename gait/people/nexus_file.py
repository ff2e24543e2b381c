"""Read the CSV that Vicon Nexus exports: sections of a name, a rate, three lines of heads, and a row for each sample.

A head names a point or device over the first of its columns, the next line its components, the third their units. Of
devices only force plates are read: those with a force and a centre of pressure.
"""

import csv
from collections.abc import Iterator, Mapping, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError
from springfoot.files.text_table import Table, make_table, text_lines

from .c3d_file import PLUG_IN_GAIT, LaboratoryRecording, contacts_of_events
from .gait_events import Contacts

EVENTS_SECTION, DEVICES_SECTION = "Events", "Devices"
POINTS = ("Model Outputs", "Trajectories")
"""Sections of points, three components each."""
SECTIONS = (EVENTS_SECTION, DEVICES_SECTION, *POINTS, "Joints", "Segments")
"""Names with which a section begins; the last two are not read."""
HEADS = 4
"""Lines of a section above its samples: rate, names, components and units."""
UNITS_OF_ANGLES = {"": 1.0, "deg": 1.0, "rad": 180 / np.pi}
"""Unit -> factor to degrees."""
UNITS_OF_FORCES = {"": 1.0, "n": 1.0, "kn": 1e3}
"""Unit -> factor to N."""
UNITS_OF_LENGTHS = {"": 1.0, "mm": 1.0, "cm": 10.0, "m": 1e3}
"""Unit -> factor to mm."""
UNITS_OF_MOMENTS = {"": 1.0, "nmm/kg": 1.0, "nm/kg": 1e3}
"""Unit -> factor to N mm/kg."""
UNITS_OF = {label: UNITS_OF_MOMENTS if label.endswith("Moment") else UNITS_OF_ANGLES for label in PLUG_IN_GAIT.values()}
UNITS_OF |= {"PelvisAngles": UNITS_OF_ANGLES, "HEE": UNITS_OF_LENGTHS, "TOE": UNITS_OF_LENGTHS}
"""Output or marker, without the side's letter, that is read -> its units."""

CsvLine = tuple[int, list[str]]
"""Number of a line, and its cells."""


def is_nexus(path: Path) -> bool:
    """Tell whether a CSV file begins with the name of a section."""
    first = next((line for line in text_lines(path) if line.strip()), "")
    return _name(next(csv.reader([first]), [])) is not None


def read_nexus(path: Path) -> LaboratoryRecording:
    """Return a walk that Nexus exported; raise `SpringfootError` for a file of another form, by line and column."""
    sections: dict[str, list[CsvLine]] = {}
    for name, rows in _sections(path):
        if name in sections:
            raise SpringfootError(f"{path.name} has two sections {name}: export one trial")
        sections[name] = rows
    of_points = [_section(path.name, sections[name]) for name in POINTS if len(sections.get(name, [])) > HEADS]
    if not of_points:
        raise SpringfootError(f"{path.name} has no rows of {' or '.join(POINTS)}: export the outputs of the model")
    rate = of_points[0].rate
    frames = [_frames(section.table) for section in of_points]
    first = int(min(numbers[0] for numbers in frames))
    count = int(max(numbers[-1] for numbers in frames)) - first + 1
    if count > sum(map(len, frames)) or any(section.rate != rate for section in of_points):
        raise SpringfootError(f"{path.name}: the frames of {' and '.join(POINTS)} must be of one trial")
    points: dict[str, NDArray] = {}
    for section, numbers in zip(of_points, frames, strict=True):
        for column in section.units:
            name, _, component = column.rpartition(" ")
            if component in ("X", "Y", "Z") and name[1:] in UNITS_OF:
                values = section.in_units(column, UNITS_OF[name[1:]])
                points.setdefault(name, np.full((3, count), np.nan))["XYZ".index(component), numbers - first] = values
    has_plates = len(sections.get(DEVICES_SECTION, [])) > HEADS
    return LaboratoryRecording(
        name=path.name,
        rate=rate,
        first_frame=first,
        points=points,
        events=_events(path.name, sections.get(EVENTS_SECTION, [])),
        plates=_plates(_section(path.name, sections[DEVICES_SECTION]), first, count, rate) if has_plates else (),
    )


def _name(cells: Sequence[str]) -> str | None:
    """Return the name of the section that a line of `cells` begins, None for any other line."""
    filled = [cell.strip() for cell in cells if cell.strip()]
    return filled[0] if len(filled) == 1 and filled[0] in SECTIONS else None


def _sections(path: Path) -> Iterator[tuple[str, list[CsvLine]]]:
    """Yield the name of each section, and the lines below it that are not empty."""
    name = ""
    rows: list[CsvLine] = []
    try:
        for number, cells in enumerate(csv.reader(text_lines(path), strict=True), 1):
            if (begins := _name(cells)) is not None:
                if name:
                    yield name, rows
                name = begins
                rows = []
            elif any(cell.strip() for cell in cells):
                rows.append((number, cells))
    except csv.Error as error:
        raise SpringfootError(f"{path.name} is not a CSV file: {error}") from None
    yield name, rows


class _Section(NamedTuple):
    """A section of numbers."""

    rate: float
    """Samples a second."""
    table: Table
    """Its columns are Frame, Sub Frame, then point and component, such as `LKneeAngles X`."""
    units: dict[str, str]
    """Column -> its unit in lower case without blanks and dots, such as nmm/kg."""

    def in_units(self, column: str, factors: Mapping[str, float]) -> NDArray:
        """Return a column in the unit with factor 1, NaN where a cell is empty.

        Raises `SpringfootError` for a unit without a factor.
        """
        unit = self.units[column]
        if unit not in factors:
            known = ", ".join(filter(None, factors))
            raise SpringfootError(f"{self.table.name}, column {column}: unit must be one of {known}, got {unit}")
        return factors[unit] * self.table.numbers(column, gaps=True)


def _section(file: str, rows: list[CsvLine]) -> _Section:
    """Return a section of numbers from its lines; raise `SpringfootError` for lines of another form."""
    (rate_line, rate), (_, names), (line, components), *samples = rows
    if [cell.strip() for cell in components[:2]] != ["Frame", "Sub Frame"]:
        raise SpringfootError(f"{file}, line {line}: must begin with Frame,Sub Frame")
    units = [] if samples[0][1][0].strip() else samples.pop(0)[1]  # an empty line of units is left out before
    columns = ["Frame", "Sub Frame"]
    unit_of = {}
    name = ""
    # SUBJECT:NAME stands over its first component, nothing over the others.
    for head, component, unit in zip_longest(names[2:], components[2:], units[2:], fillvalue=""):
        name = head.rpartition(":")[2].strip() or name
        # A column without a component is kept, so that the others stay in their places.
        columns.append(f"{name} {component.strip() or f'column {len(columns) + 1}'}".strip())
        unit_of[columns[-1]] = unit.lower().translate(str.maketrans("", "", " .·*"))
    width = len(columns)
    padded = [(number, [*cells, *[""] * width][:width]) for number, cells in samples]
    header = Table(name=file, columns=["rate"], rows=[(rate_line, rate[:1])])
    value = float(header.numbers("rate")[0])
    if value <= 0:
        raise header.error(rate_line, "rate", f"must be above 0, got {value:g}")
    return _Section(value, make_table(file, [(line, columns), *padded]), unit_of)


def _frames(table: Table) -> NDArray:
    """Return the numbers of the frames (R,) of a table of points; raise `SpringfootError` unless they ascend."""
    numbers = table.ascending("Frame")
    if (numbers % 1).any() or numbers[-1] - numbers[0] >= len(numbers):
        raise SpringfootError(f"{table.name}: frames must be whole numbers, one after another without a gap")
    return numbers.astype(int)


def _plates(devices: _Section, first: int, count: int, rate: float) -> list[dict[str, Any]]:
    """Return the force plates among the devices, as ezc3d gives them, of `count` frames from `first` on.

    Samples are averaged around each frame, of which there are `rate` a second; a frame without any has no force.
    """
    samples_a_frame = devices.rate / rate
    position = devices.table.numbers("Frame") + devices.table.numbers("Sub Frame") / samples_a_frame
    frame = np.floor(position + 0.5).astype(int) - first
    kept = (frame >= 0) & (frame < count)
    numbers = np.bincount(frame[kept], minlength=count)

    def averaged(names: Sequence[str], factors: Mapping[str, float]) -> NDArray:
        values = [np.nan_to_num(devices.in_units(name, factors))[kept] for name in names]
        sums = np.array([np.bincount(frame[kept], column, minlength=count) for column in values])
        return sums / np.maximum(numbers, 1)

    plates = []
    for column in devices.units:
        device, is_force, _ = column.partition(" - Force Fx")
        forces, centres = [f"{device} - Force F{axis}" for axis in "xyz"], [f"{device} - CoP C{axis}" for axis in "xyz"]
        if is_force and all(name in devices.units for name in (*forces, *centres)):
            plates.append(
                {
                    "force": averaged(forces, UNITS_OF_FORCES),
                    "center_of_pressure": averaged(centres, UNITS_OF_LENGTHS),
                    "unit_force": "N",
                }
            )
    return plates


def _events(file: str, rows: list[CsvLine]) -> dict[str, Contacts]:
    """Return side -> events of a section with the columns Context, Name and Time (s); none without rows."""
    if len(rows) < 3:  # rate and heads
        return {}
    table = make_table(file, rows[1:])
    text = {}
    for column in ("Context", "Name", "Time (s)"):
        if column not in table.columns:
            raise SpringfootError(f"{file}, line {rows[1][0]}: no column {column} in the events")
        text[column] = [cells[table.columns.index(column)] for _, cells in table.rows]
    return contacts_of_events(text["Context"], text["Name"], table.numbers("Time (s)"))
