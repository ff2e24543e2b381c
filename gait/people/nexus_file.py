"""Read the CSV that Vicon Nexus exports: sections of a name, a rate, three lines of heads, and a row for each sample.

A head names a point or device over the first of its columns, the next line its components, the third their units. Of
devices only force plates are read: those with a force and a centre of pressure.
"""

import csv
from collections.abc import Iterator, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError
from springfoot.files.text_table import Table, make_table, text_lines

from .c3d_file import LaboratoryRecording, contacts_of_events
from .gait_events import Contacts

EVENTS_SECTION, DEVICES_SECTION = "Events", "Devices"
POINTS = ("Model Outputs", "Trajectories")
"""Sections of points, three components each."""
SECTIONS = (EVENTS_SECTION, DEVICES_SECTION, *POINTS, "Joints", "Segments")
"""Names with which a section begins; the last two are not read."""

CsvLine = tuple[int, list[str]]
"""Number of a line, and its cells."""


def is_nexus(path: Path) -> bool:
    """Tell whether a CSV file begins with the name of a section."""
    first = next((line for line in text_lines(path) if line.strip()), "")
    return _name(first.split(",")) is not None


def read_nexus(path: Path) -> LaboratoryRecording:
    """Return a walk that Nexus exported; raise `SpringfootError` for a file of another form, by line and column."""
    sections = dict(_sections(path))
    of_points = [_section(path.name, sections[name]) for name in POINTS if name in sections]
    if not of_points:
        raise SpringfootError(f"{path.name} has no section {' or '.join(POINTS)}: export the outputs of the model")
    frames = [_frames(section.table) for section in of_points]
    first = min(numbers[0] for numbers in frames)
    count = max(numbers[-1] for numbers in frames) - first + 1
    points: dict[str, NDArray] = {}
    in_nm = False
    for section, numbers in zip(of_points, frames, strict=True):
        for column, unit in section.units.items():
            name, _, component = column.rpartition(" ")
            if component in ("X", "Y", "Z"):
                point = points.setdefault(name, np.full((3, count), np.nan))
                point["XYZ".index(component), numbers - first] = section.table.numbers(column, gaps=True)
                in_nm |= name.endswith("Moment") and unit.startswith("nm/")
    return LaboratoryRecording(
        name=path.name,
        rate=of_points[0].rate,
        first_frame=first,
        points=points,
        moments_in_nm=in_nm,
        events=_events(path.name, sections[EVENTS_SECTION]) if EVENTS_SECTION in sections else {},
        plates=_plates(_section(path.name, sections[DEVICES_SECTION]), first, count)
        if DEVICES_SECTION in sections
        else (),
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


def _section(file: str, rows: list[CsvLine]) -> _Section:
    """Return a section of numbers from its lines; raise `SpringfootError` for lines of another form."""
    if len(rows) < 5:
        raise SpringfootError(f"{file} is cut short: a section needs rate, names, components, units and rows")
    (rate_line, rate), (_, names), (line, components), (_, units), *samples = rows
    if [cell.strip() for cell in components[:2]] != ["Frame", "Sub Frame"]:
        raise SpringfootError(f"{file}, line {line}: must begin with Frame,Sub Frame")
    columns = ["Frame", "Sub Frame"]
    unit_of = {}
    name = ""
    # SUBJECT:NAME stands over its first component, nothing over the others.
    for head, component, unit in zip_longest(names[2:], components[2:], units[2:], fillvalue=""):
        name = head.rpartition(":")[2].strip() or name
        if component.strip():
            columns.append(f"{name} {component.strip()}")
            unit_of[columns[-1]] = unit.lower().replace(" ", "").replace(".", "")
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


def _plates(devices: _Section, first: int, count: int) -> list[dict[str, Any]]:
    """Return the force plates among the devices, as ezc3d gives them, of `count` frames from `first` on."""
    frames = devices.table.numbers("Frame")
    kept = (frames >= first) & (frames < first + count)
    plates = []
    for column in devices.units:
        device, is_force, _ = column.partition(" - Force Fx")
        columns = {
            "force": [f"{device} - Force F{axis}" for axis in "xyz"],
            "center_of_pressure": [f"{device} - CoP C{axis}" for axis in "xyz"],
        }
        if is_force and all(name in devices.units for names in columns.values() for name in names):
            plate = {
                key: np.stack([devices.table.numbers(name, gaps=True)[kept] for name in names])
                for key, names in columns.items()
            }
            plates.append(plate | {"unit_force": "kN" if devices.units[column] == "kn" else "N"})
    return plates


def _events(file: str, rows: list[CsvLine]) -> dict[str, Contacts]:
    """Return side -> events of a section with the columns Context, Name and Time (s)."""
    table = make_table(file, rows[1:])
    text = {}
    for column in ("Context", "Name", "Time (s)"):
        if column not in table.columns:
            raise SpringfootError(f"{file}, line {rows[1][0] if rows[1:] else 1}: no column {column} in the events")
        text[column] = [cells[table.columns.index(column)] for _, cells in table.rows]
    return contacts_of_events(text["Context"], text["Name"], table.numbers("Time (s)"))
