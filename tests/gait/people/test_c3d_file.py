"""C3D files: a laboratory's file with people's curves in it, written by the library, gives the curves back."""

import sys

import ezc3d
import numpy as np
import pytest

from springfoot.files import bounded_process
from springfoot.gait import GRAVITY, SpringfootError, human_gait
from springfoot.gait.people import c3d_process
from springfoot.gait.people.human import FORCES
from springfoot.gait.people.motion_files import FILE_SIDES
from springfoot.gait.people.own_data import read_gait

HUMAN = human_gait(1.3)
MASS, SECONDS, BEGIN = 71.0, 12.0, 0.5
PHASE = np.arange(101) / 100
ANGLES, MOMENTS = ("thigh", "hip", "knee", "ankle", "toe"), ("hip_moment", "knee_moment", "ankle_moment")
OFFSETS = dict(zip(FILE_SIDES, (0.2, 0.7), strict=True))
"""Stride phase of each leg at time 0."""


def strides_at(time, side):
    return time / HUMAN.stride_time + OFFSETS[side]


def laboratory(path, plates=None, events=False, moment_sign=1.0, gap=None, force_sign=1.0):
    """Plug-in Gait output at 100 Hz, walking along -y; `plates`: force of a leg at 1000 Hz as a function of strides."""
    time = BEGIN + np.arange(round(SECONDS * 100)) / 100
    flat = np.zeros_like(time)
    points = {}
    for side in FILE_SIDES:
        letter, strides = side[0].upper(), strides_at(time, side)
        x = {name: np.degrees(HUMAN.mean(name, strides)) for name in ANGLES}
        x["pelvis"] = x["hip"] - x["thigh"]
        for name in ("hip", "knee", "ankle", "pelvis"):
            points[f"{letter}{name.capitalize()}Angles"] = np.stack([x[name], flat, flat])
        points[f"{letter}HXFFA"] = np.stack([x["toe"], flat, flat])
        for name in MOMENTS:
            label = f"{letter}{name.removesuffix('_moment').capitalize()}Moment"
            points[label] = np.stack([moment_sign * 1000 * HUMAN.mean(name, strides), flat, flat])
        for marker, y in (("HEE", 300.0), ("TOE", 100.0)):
            points[letter + marker] = np.stack([flat + (100 if side == "left" else 500), flat + y, flat])
    data = np.stack([*points.values()], axis=1)
    if gap is not None:
        data[:, [*points].index("LKneeAngles"), gap] = np.nan
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [100]
    file["parameters"]["POINT"]["LABELS"]["value"] = [f"Subject:{label}" for label in points]
    file["data"]["points"] = np.concatenate([data, np.ones((1, *data.shape[1:]))])
    if plates:
        add_plates(file, {side: force_sign * plates(side) for side in FILE_SIDES})
    if events:
        add_events(file)
    file.write(str(path))
    return path


def forces(side, kept=lambda strides: strides == strides):
    """(2, T) up and forward [N] at 1000 Hz, of the `kept` strides."""
    strides = strides_at(BEGIN + np.arange(round(SECONDS * 1000)) / 1000, side)
    return MASS * GRAVITY * np.stack([HUMAN.mean(name, strides) * kept(np.floor(strides)) for name in FORCES])


def add_plates(file, forces):
    """A plate under each foot's line; its corners say that its y is the laboratory's and its z down."""
    none = np.zeros(round(SECONDS * 1000))
    channels = [row for up, forward in forces.values() for row in (none, -forward, -up, none, none, none)]
    file["parameters"]["ANALOG"]["RATE"]["value"] = [1000]
    file["parameters"]["ANALOG"]["LABELS"]["value"] = [f"channel {k}" for k in range(12)]
    file["data"]["analogs"] = np.stack(channels)[None]
    file.add_parameter("POINT", "UNITS", ["mm"])
    file.add_parameter("ANALOG", "UNITS", (["N"] * 3 + ["Nmm"] * 3) * 2)
    corners = np.array([[0, 200, 200, 0], [400, 400, 0, 0], [0, 0, 0, 0]], float)
    other = np.add(corners, [[400], [0], [0]])
    file.add_parameter("FORCE_PLATFORM", "ORIGIN", np.zeros((3, 2)))
    file.add_parameter("FORCE_PLATFORM", "CORNERS", np.stack([corners, other], axis=-1))
    whole = {"USED": [2], "TYPE": [2, 2], "CHANNEL": np.arange(1, 13).reshape(2, 6).T, "ZERO": [1, 0]}
    for name, value in whole.items():  # `add_parameter` would write them as floats
        entry = {"type": 2, "description": "", "is_locked": False, "value": np.array(value)}
        file["parameters"]["FORCE_PLATFORM"][name] = entry


def add_events(file):
    marks = []
    for side in FILE_SIDES:
        for label, phase in (("Foot Strike", 0.0), ("Foot Off", HUMAN.toe_off)):
            times = (np.arange(13) + phase - OFFSETS[side]) * HUMAN.stride_time - BEGIN
            marks += [(side.capitalize(), label, time) for time in times if 0 < time < SECONDS]
    file.add_parameter("EVENT", "USED", len(marks))
    file.add_parameter("EVENT", "CONTEXTS", [mark[0] for mark in marks])
    file.add_parameter("EVENT", "LABELS", [mark[1] for mark in marks])
    file.add_parameter("EVENT", "TIMES", np.array([[0.0, mark[2]] for mark in marks]).T)


def assert_like_people(gait, names):
    assert gait.stride_time == pytest.approx(HUMAN.stride_time, rel=0.003)
    for name in names:
        error = np.sqrt(np.mean((gait.mean(name, PHASE) - HUMAN.mean(name, PHASE)) ** 2))
        assert error < (np.radians(0.6) if name in ANGLES else 0.02), (name, error)
        assert name not in gait.borrowed


@pytest.mark.parametrize("force_sign", [1.0, -1.0], ids=["reaction", "push on the plate"])
def test_with_force_plates(tmp_path, force_sign):
    own = read_gait(laboratory(tmp_path / "lab.c3d", plates=forces, force_sign=force_sign), mass=MASS)
    assert_like_people(own.gait(1.3, 1.7), (*ANGLES, *MOMENTS, *FORCES))


def test_a_plate_that_is_hit_once_by_each_foot_still_gives_forces(tmp_path):
    path = laboratory(tmp_path / "lab.c3d", plates=lambda side: forces(side, lambda strides: strides == 4), events=True)
    own = read_gait(path, mass=MASS)
    assert own.strides and own.strides > 15
    assert_like_people(own.gait(1.3, 1.7), (*ANGLES, *FORCES))


@pytest.mark.parametrize("events", [True, False], ids=["events in the file", "events from the angles"])
def test_without_plates_and_with_external_moments(tmp_path, events):
    own = read_gait(laboratory(tmp_path / "lab.c3d", events=events, moment_sign=-1.0))
    gait = own.gait(1.3, 1.7)
    assert_like_people(gait, (*ANGLES, *MOMENTS))
    assert gait.toe_off == pytest.approx(HUMAN.toe_off, abs=0.002 if events else 0.01)
    assert set(FORCES) <= set(gait.borrowed)


def test_gaps_at_the_ends_are_left_out_and_others_named(tmp_path):
    whole = read_gait(laboratory(tmp_path / "lab.c3d"))
    ends = read_gait(laboratory(tmp_path / "ends.c3d", gap=slice(0, 150)))
    assert ends.strides and whole.strides and 2 < ends.strides < whole.strides
    with pytest.raises(SpringfootError, match=r"mid\.c3d, frame 501, left knee: a gap"):
        read_gait(laboratory(tmp_path / "mid.c3d", gap=slice(500, 510)))
    with pytest.raises(SpringfootError, match=r"both\.c3d, frame 501, left knee: a gap"):
        read_gait(laboratory(tmp_path / "both.c3d", gap=[*range(150), *range(500, 510)]))


def test_without_its_library_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "ezc3d", None)
    (tmp_path / "lab.c3d").write_bytes(b"")
    with pytest.raises(SpringfootError, match=r"springfoot\[c3d\]"):
        read_gait(tmp_path / "lab.c3d")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda whole: whole[: len(whole) // 2], "is cut short"),
        (lambda whole: whole[:600], "is not a C3D file"),
        (lambda whole: whole[:700] + whole[720:], "is not a C3D file"),
        (lambda whole: whole[:2100] + whole[2120:], "is not a C3D file"),
        (lambda whole: whole[:515] + b"\x00" + whole[516:], "is not a C3D file"),
    ],
    ids=["half of it", "its beginning", "bytes lost in the labels", "bytes lost in the events", "no processor"],
)
def test_a_damaged_file_is_refused_in_one_line(tmp_path, change, words):
    path = laboratory(tmp_path / "lab.c3d", events=True)
    path.write_bytes(change(path.read_bytes()))
    with pytest.raises(SpringfootError, match=rf"lab\.c3d {words}") as caught:
        read_gait(path)
    assert "\n" not in str(caught.value)


def test_a_recording_may_end_with_its_last_number(tmp_path):
    path = laboratory(tmp_path / "lab.c3d", events=True)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(SpringfootError, match="is cut short") as caught:
        read_gait(path)
    last = int(str(caught.value).split()[-2])  # "193024 of 385536 bytes"
    path.write_bytes(whole[:last])
    assert read_gait(path).strides == read_gait(laboratory(tmp_path / "whole.c3d", events=True)).strides
    path.write_bytes(whole[: last - 1])
    with pytest.raises(SpringfootError, match=f"lab.c3d is cut short: {last - 1} of {last} bytes"):
        read_gait(path)


def test_bytes_that_crash_or_fill_the_library_end_a_child_and_not_us(tmp_path, monkeypatch):
    monkeypatch.setitem(globals(), "SECONDS", 2.5)
    path = laboratory(tmp_path / "lab.c3d", events=True)
    content = bytearray(path.read_bytes())
    for place, value in ((1720, 176),):  # found by changing bytes at random
        changed = content.copy()
        changed[place] = value
        path.write_bytes(changed)
        with pytest.raises(SpringfootError, match=r"^lab\.c3d is (damaged|not a C3D file)"):
            read_gait(path)
    path.write_bytes(content)
    small = "import springfoot.files.bounded_process as bounded; bounded.MOST_MEMORY = 2**20; "
    monkeypatch.setattr(c3d_process, "_CHILD", small + c3d_process._CHILD)
    with pytest.raises(SpringfootError, match=r"^lab\.c3d is (damaged|not a C3D file)"):
        read_gait(path)
    monkeypatch.setattr(c3d_process, "_CHILD", "import time; time.sleep(60)")
    monkeypatch.setattr(bounded_process, "MOST_WAIT", 1)
    with pytest.raises(SpringfootError, match=r"lab\.c3d is damaged: ezc3d crashed on it, or took over 60 s"):
        read_gait(path)
