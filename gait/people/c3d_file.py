"""Read C3D files of a motion laboratory as curves in the names, signs and units of `HumanGait`; needs ezc3d, an extra.

The x components of Plug-in Gait's angles and moments have our signs; its pelvis is positive forward, so thigh = hip -
pelvis. If the ankle moment is negative on average, the moments are external ones, and the signs of all are turned.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError
from springfoot.files.text_table import read_bytes

from .gait_events import Contacts
from .human import FORCES
from .laboratory_names import with_internal_moments
from .motion_files import FILE_SIDES, Series, Trial, not_empty

PLATE_LOAD = 20.0
"""Force above which a foot stands on a force plate [N]; chosen, as usual in gait laboratories."""
PLUG_IN_GAIT = {"hip": "HipAngles", "knee": "KneeAngles", "ankle": "AnkleAngles", "toe": "HXFFA"} | {
    f"{joint}_moment": f"{joint.capitalize()}Moment" for joint in ("hip", "knee", "ankle")
}
"""Curve -> the name of its output in Plug-in Gait and the Oxford Foot Model, without the side's letter."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LaboratoryRecording:
    """A recording of a laboratory that ran Plug-in Gait: points, events and force plates."""

    name: str
    """The file's name."""
    rate: float
    """Frames a second."""
    first_frame: int
    points: Mapping[str, NDArray]
    """Name of a marker or of an output -> its x, y and z (3, T) in T frames; NaN in gaps."""
    moments_in_nm: bool = False
    """True if moments are in N m/kg, False for N mm/kg."""
    events: Mapping[str, Contacts] = field(default_factory=dict)
    """Side -> foot strikes and foot offs marked by the laboratory."""
    plates: Sequence[Any] = ()
    """Force plates, as ezc3d gives them: force (3, samples), its unit, and centre of pressure."""


def read_c3d(path: Path) -> Trial:
    """Return the walk in a C3D file, as `trial_of_recording` does; `c3d_process` calls this in a child process.

    Raises `SpringfootError` for a file that ezc3d cannot read, and for a gap within the walk.
    """
    import ezc3d  # an extra: only C3D files need it

    _refuse_broken(path)
    try:
        try:
            file = ezc3d.c3d(str(path), extract_forceplat_data=True)
        except ValueError:  # ezc3d cannot make sense of the plates; it may still read angles
            file = ezc3d.c3d(str(path))
    except (OSError, RuntimeError, ValueError, IndexError, MemoryError) as error:
        raise SpringfootError(f"{path.name} is not a C3D file that ezc3d can read: {error}") from None
    points = file["data"]["points"]
    parameters = file["parameters"]
    header = file["header"]["points"]
    # A label is NAME or SUBJECT:NAME; a marker's first three rows are x, y, z.
    labels = [label.rpartition(":")[2].strip() for label in parameters["POINT"]["LABELS"]["value"]]
    return trial_of_recording(
        LaboratoryRecording(
            name=path.name,
            rate=float(header["frame_rate"]),
            first_frame=int(header["first_frame"]),
            points={label: points[:3, k] for k, label in enumerate(labels)},
            # Plug-in Gait writes N mm/kg unless the file says N m.
            moments_in_nm=parameters["POINT"].get("MOMENT_UNITS", {}).get("value", ["Nmm"])[0].strip() == "Nm",
            events=_events(parameters.get("EVENT", {})),
            plates=file["data"].get("platform") or [],
        )
    )


def trial_of_recording(recording: LaboratoryRecording) -> Trial:
    """Return the walk in a recording with Plug-in Gait's output.

    It reads these, and for the right leg the same with R in place of L:
    - the x components of `LHipAngles`, `LKneeAngles`, `LAnkleAngles`, `LPelvisAngles` [deg], of the Oxford Foot Model's
      `LHXFFA` (toe) [deg], and of `LHipMoment`, `LKneeMoment`, `LAnkleMoment`;
    - the events Foot Strike and Foot Off;
    - the force plates; the markers `LHEE` and `LTOE` tell the foot on each plate, and the forward direction.

    Frames with gaps at the beginning and end of the record are left out. Raises `SpringfootError` for a gap between
    other frames.
    """
    points = recording.points
    legs: dict[str, Series] = {side: {} for side in FILE_SIDES}
    for side, curves in legs.items():
        letter = side[0].upper()  # L or R
        for curve, label in PLUG_IN_GAIT.items():
            if letter + label in points:
                x = points[letter + label][0]
                is_moment = curve.endswith("_moment")
                curves[curve] = x * (1.0 if recording.moments_in_nm else 1e-3) if is_moment else np.radians(x)
        if "hip" in curves and f"{letter}PelvisAngles" in points:
            curves["thigh"] = curves["hip"] - np.radians(points[f"{letter}PelvisAngles"][0])
        curves |= with_internal_moments(curves)
    frames = max((values.shape[1] for values in points.values()), default=0)
    feet = {side: (points.get(f"{side[0].upper()}HEE"), points.get(f"{side[0].upper()}TOE")) for side in FILE_SIDES}
    for side, (vertical, forward) in _plate_forces(recording.plates, feet, frames).items():
        legs[side] |= {"grf_vertical": vertical, "grf_forward": forward}
    legs = not_empty(recording.name, legs)
    complete = _frames_without_gaps(recording.name, legs)
    return Trial(
        name=recording.name,
        time=(recording.first_frame + np.arange(frames)[complete]) / recording.rate,
        legs={side: {name: values[complete] for name, values in curves.items()} for side, curves in legs.items()},
        unscaled=FORCES,
        contacts=recording.events,
        speed=None,
    )


def _refuse_broken(path: Path) -> None:
    """Raise `SpringfootError` for a damaged or shortened file: ezc3d would hang, crash or make up frames.

    Layout as in the C3D User Guide (c3d.org): blocks of 512 bytes with the header, a chain of groups and parameters,
    and the data. The checks walk the chain as ezc3d would, and compare the file's length with that in its header.
    """
    data = read_bytes(path)
    broken = SpringfootError(f"{path.name} is not a C3D file, or it is damaged")
    try:
        # The header's first byte is the number of the first block of parameters; this block begins with their number of
        # blocks in its byte 2 and the processor that wrote the file in its byte 3.
        start = 512 * (data[0] - 1)
        order = {84: "little", 85: "little", 86: "big"}[data[start + 3]]  # Intel, DEC, MIPS
        sign_byte = {84: 15, 85: 13, 86: 12}[data[start + 3]]  # of the scale: negative for floating-point data

        def word(position: int) -> int:
            """Return the 16-bit number that begins at byte `position`."""
            return int.from_bytes(data[position : position + 2], order)  # type: ignore[arg-type]

        end = start + 512 * data[start + 2]
        # 80 marks a C3D file.
        if data[1] != 80 or start < 512 or not start < end <= len(data):
            raise broken
        # An entry: length of its name (negative if locked), its group's number, name, link to the next entry, content.
        position = start + 4
        while length := min(data[position], 256 - data[position]):
            link = position + 2 + length
            content = link + 2
            following = link + word(link)
            if data[position + 1] < 128:  # a parameter: type, dimensions, values; groups have negative numbers
                size = data[content]
                dimensions = data[content + 2 : content + 2 + data[content + 1]]
                content += 2 + len(dimensions) + min(size, 256 - size) * prod(dimensions)
            if following == link:
                following = end
            has_name = data[position + 1] != 0 and data[link - length : link].isascii()
            if not has_name or content > following or following > end:
                raise broken
            position = following
            if position == end:
                break
        # Byte of the header -> number: 2 -> points, 4 -> analog samples a frame, 6 and 8 -> first and last frame, 16 ->
        # first block of data. A point has four numbers, and a number 4 bytes in floating point, otherwise 2.
        frames = word(8) - word(6) + 1
        expected = 512 * (word(16) - 1) + frames * (4 * word(2) + word(4)) * (4 if data[sign_byte] & 128 else 2)
    except (IndexError, KeyError):
        raise broken from None
    if len(data) < expected and word(8) < 65535:  # the largest 16-bit number: a longer recording's true end is unknown
        raise SpringfootError(f"{path.name} is cut short: {len(data)} of {expected} bytes")


def _events(event: Mapping[str, Any]) -> dict[str, Contacts]:
    """Return side -> events in the group EVENT of a file's parameters."""
    contexts, labels = (event.get(key, {}).get("value", []) for key in ("CONTEXTS", "LABELS"))
    times = np.reshape(event.get("TIMES", {}).get("value", []), (2, -1), order="A")  # rows of minutes and of seconds
    return contacts_of_events(contexts, labels, 60 * times[0] + times[1])


def contacts_of_events(contexts: Sequence[str], labels: Sequence[str], seconds: NDArray) -> dict[str, Contacts]:
    """Return side -> foot strikes and foot offs marked by the laboratory, for the sides with foot strikes.

    Event k has a context (left, right), a label (Foot Strike, Foot Off) and a time [s].
    """
    seconds_of: dict[tuple[str, str], list[float]] = {}
    for context, label, second in zip(contexts, labels, seconds, strict=False):
        seconds_of.setdefault((context.strip().lower(), label.strip().lower()), []).append(float(second))
    return {
        side: Contacts(
            heel_strikes=np.sort(seconds_of[side, "foot strike"]),
            toe_offs=np.sort(seconds_of.get((side, "foot off"), [])),
        )
        for side in FILE_SIDES
        if (side, "foot strike") in seconds_of
    }


def _plate_forces(plates: Iterable[Any], feet: Mapping[str, tuple], frames: int) -> dict[str, tuple[NDArray, NDArray]]:
    """Return side -> force up and forward (T,) [N] of each foot that stood on a plate, T the number of `frames`.

    `plates` are ezc3d's; `feet` is side -> markers of heel and toe (3, T), None if missing. Each contact on a plate
    belongs to the foot with the markers nearest to its centre of pressure; without markers no foot has a force.
    """
    if any(marker is None for pair in feet.values() for marker in pair):
        return {}
    total = {side: np.zeros((3, frames)) for side in FILE_SIDES}
    for plate in plates:
        force, cop = (_per_frame(np.asarray(plate[key]), frames) for key in ("force", "center_of_pressure"))
        if plate["unit_force"] == "kN":
            force = 1000 * force
        # Each run of loaded frames is a contact.
        loaded = np.abs(force).max(axis=0) > PLATE_LOAD
        edges = np.flatnonzero(np.diff(np.concatenate([[False], loaded, [False]]).astype(int)))
        for start, stop in edges.reshape(-1, 2):
            contact = slice(start, stop)
            # Mean distance of the middle of each foot from the centre of pressure; a foot must have been seen.
            distances = {
                side: np.nanmean(np.linalg.norm((heel + toe)[:, contact] / 2 - cop[:, contact], axis=0))
                for side, (heel, toe) in feet.items()
                if np.isfinite((heel + toe)[:, contact]).all(axis=0).any()
            }
            if distances:
                total[min(distances, key=lambda side: distances[side])][:, contact] += force[:, contact]
    forces = np.concatenate(list(total.values()), axis=1)
    if not forces.any():
        return {}
    # The laboratory's axes: up is the largest force's, forward that of heel to toe.
    up = int(np.abs(forces.sum(axis=1)).argmax())
    foot_direction = np.mean([np.nanmean(toe - heel, axis=1) for heel, toe in feet.values()], axis=0)
    foot_direction[up] = 0.0
    forward = int(np.abs(foot_direction).argmax())
    # A plate reports the foot's force on the plate, or the plate's on the foot, which points up: make it that one.
    sign = np.sign(forces.sum(axis=1)[up])
    return {
        side: (sign * force[up], sign * np.sign(foot_direction[forward]) * force[forward])
        for side, force in total.items()
        if force.any()
    }


def _per_frame(samples: NDArray, frames: int) -> NDArray:
    """Average a plate's samples (3, R x T), taken R a frame, around each of T frames: return (3, T)."""
    ratio = max(samples.shape[1] // max(frames, 1), 1)  # R; 1 also without frames, or for a plate without samples
    # The first sample is repeated half of R times, so that each mean has its frame in the middle.
    centred = np.pad(np.nan_to_num(samples), ((0, 0), (ratio // 2, 0)), mode="edge")
    cut = centred[:, : ratio * frames]
    return cut.reshape(3, -1, ratio).mean(axis=2)


def _frames_without_gaps(name: str, legs: Mapping[str, Series]) -> slice:
    """Return the slice from the first to the last frame in which all curves have numbers.

    Raises `SpringfootError`, which names the file by `name`, for a gap between these two frames, or if no frame has all
    curves.
    """
    missing = {
        f"{side} {curve}": ~np.isfinite(values) for side, curves in legs.items() for curve, values in curves.items()
    }
    complete = np.flatnonzero(~np.any(list(missing.values()), axis=0))
    if not len(complete):
        raise SpringfootError(f"{name}: no frame has {', '.join(missing)}")
    kept = slice(int(complete[0]), int(complete[-1]) + 1)
    for curve, flags in missing.items():
        if flags[kept].any():
            frame = int(np.flatnonzero(flags[kept])[0]) + kept.start
            raise SpringfootError(f"{name}, frame {frame + 1}, {curve}: a gap; fill it in the laboratory's software")
    return kept
