"""Recordings and schedules carry a digest; what is too large or of the wrong shape is refused before it is read."""

import io
import json
import resource
import zipfile

import numpy as np
import pytest

from springfoot.agents.policies.schedule_files import schedule_file
from springfoot.envs import BipedSettings
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import load_recording, record
from springfoot.evaluation.report.schedule_tables import write_schedules
from springfoot.files.array_file import read_arrays
from springfoot.files.digest import BLANK_DIGEST, require_unchanged, with_digest
from springfoot.files.json_file import MOST_JSON_BYTES, read_object
from springfoot.files.text_table import LONGEST_LINE, MOST_CELLS, MOST_TEXT_BYTES, read_csv
from springfoot.gait import SpringfootError
from springfoot.gait.people.human import harmonics
from springfoot.gait.people.own_data import read_gait
from springfoot.gait.plan.walk_style import styles_of
from springfoot.gait.springs.foot_file import read_foot

READERS = {
    "stiffness_schedule.csv": lambda path: schedule_file(str(path), BipedSettings()),
    "finite_states.json": lambda path: schedule_file(str(path), BipedSettings()),
    "strides.npz": load_recording,
}
GIGABYTES = 3 * 2**30


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("sealed")
    walk = record(*policy_and_settings("schedule", {"episode_seconds": 5.0}), name="schedule", episodes=1)
    write_schedules(path, walk)
    walk.save(path / "strides.npz")
    return path


@pytest.mark.parametrize(("name", "read"), READERS.items(), ids=READERS)
def test_any_flipped_bit_of_a_schedule_or_recording_is_refused(folder, tmp_path, name, read):
    content, damaged = (folder / name).read_bytes(), tmp_path / name
    damaged.write_bytes(content)
    read(damaged)
    random, count = np.random.default_rng(1), 300
    stored = name.endswith(".npz")
    for _ in range(count):
        flipped, place = bytearray(content), int(random.integers(len(content)))
        flipped[place] ^= 1 << int(random.integers(8))
        damaged.write_bytes(flipped)
        if stored and not _changes_an_array(content, flipped):
            continue  # the archive's own dates and flags hold nothing of the recording
        with pytest.raises(SpringfootError) as caught:
            read(damaged)
        assert str(caught.value).isprintable(), place


def _changes_an_array(content, flipped):
    try:
        with zipfile.ZipFile(io.BytesIO(flipped)) as other, zipfile.ZipFile(io.BytesIO(content)) as own:
            return [(m.filename, other.read(m)) for m in other.infolist()] != [
                (m.filename, own.read(m)) for m in own.infolist()
            ]
    except Exception:
        return True


def test_a_schedule_changed_by_hand_says_how_it_is_taken_as_it_is(folder, tmp_path):
    states = json.loads((folder / "finite_states.json").read_text(encoding="utf-8"))
    states["states"][0]["ankle"]["stiffness_Nm_per_rad"] = 150.0
    mine = tmp_path / "mine.json"
    mine.write_text(json.dumps(states), encoding="utf-8")
    with pytest.raises(SpringfootError, match=r"is damaged or was changed: .* without its sha256 it is read as it is"):
        schedule_file(str(mine), BipedSettings())
    del states["sha256"]
    mine.write_text(json.dumps(states), encoding="utf-8")
    own, _ = schedule_file(str(mine), BipedSettings())
    assert own["schedule"]["ankle"][0][1] == pytest.approx(150.0)


def test_a_seal_is_of_every_byte_and_neither_name_nor_digits_can_hide(tmp_path):
    text = with_digest(f'{{"a": 1, "sha256": "{BLANK_DIGEST}"}}\n').encode()
    require_unchanged(tmp_path, text)
    for place in range(len(text)):
        for bit in range(8):
            flipped = bytearray(text)
            flipped[place] ^= 1 << bit
            with pytest.raises(SpringfootError, match="is damaged or was changed"):
                require_unchanged(tmp_path, bytes(flipped))
    require_unchanged(tmp_path, b"of somebody else")


# Sizes, shapes and counts ------------------------------------------------------------------------------------


def sparse(path, size):
    with path.open("wb") as file:
        file.truncate(size)
    return path


@pytest.mark.parametrize(
    ("name", "read", "most"),
    [
        ("a.csv", read_gait, MOST_TEXT_BYTES),
        ("a.mot", read_gait, MOST_TEXT_BYTES),
        ("a.c3d", read_gait, MOST_TEXT_BYTES),
        ("a.csv", read_foot, MOST_TEXT_BYTES),
        ("a.json", read_foot, MOST_JSON_BYTES),
        ("a.csv", READERS["stiffness_schedule.csv"], MOST_TEXT_BYTES),
        ("a.json", READERS["finite_states.json"], MOST_JSON_BYTES),
    ],
)
def test_gigabytes_are_refused_unread(tmp_path, name, read, most):
    path = sparse(tmp_path / name, GIGABYTES)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(SpringfootError) as caught:
        read(path)
    assert str(caught.value) == f"{name} must have at most {most:,} bytes, has {GIGABYTES:,}"
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss < before + 50_000  # kB


@pytest.mark.parametrize("read", [harmonics, styles_of])
def test_gigabytes_in_place_of_data_of_the_package_are_refused_unread(tmp_path, read):
    path = sparse(tmp_path / "a.json", GIGABYTES)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(SpringfootError, match=f"must have at most {MOST_JSON_BYTES:,} bytes, has {GIGABYTES:,}"):
        read(path)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss < before + 50_000  # kB


@pytest.mark.parametrize("text", ["a,b\n1.5,-2e3\n", "a;b\n1,5;-2e3\n", "a;b\n1.5;-2e3\n", "\na\tb\n1,5\t-2,0e3\n"])
def test_cells_stand_between_commas_or_semicolons_or_tabs(tmp_path, text):
    path = tmp_path / "a.csv"
    path.write_text(text, encoding="utf-8", newline="")
    table = read_csv(path)
    assert [table.numbers(name).tolist() for name in "ab"] == [[1.5], [-2000.0]]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "said"),
    [
        (",".join(f"c{k}" for k in range(60_000)) + "\n1\n", "line 1: must have at most 2,000 columns, has 60,000"),
        ("a,b\n" + "1," * LONGEST_LINE, f"line 2: more than {LONGEST_LINE:,} letters"),
        ("a,b,c\n" + "1,2,3\n" * (MOST_CELLS // 3 + 1), "line 1000002: more than 3,000,000 cells; leave out columns"),
        ("a,b,a\n1,2,3\n", "line 1: column a stands twice"),
        ("a;b\n1,5;2,0;3\n", "line 2: 3 cells, but 2 columns"),
        ("a\tb\n1\t2\t3\n", "line 2: 3 cells, but 2 columns"),
        ("a,b\n", " has no data"),
        ("", " has no data"),
        ("a\0b", " is not a text file"),
        ("a,b\n1,\udcff\n", " is not a text file"),
        ('a,b\n"1,2\n', " is not a CSV file: unexpected end of data"),
    ],
    ids=["columns", "line", "cells", "twice", "semicolons", "tabs", "header", "empty", "NUL", "no UTF-8", "quote"],
)
def test_a_table_of_the_wrong_shape_is_refused(tmp_path, text, said):
    path = tmp_path / "a.csv"
    path.write_text(text, encoding="utf-8", errors="surrogateescape", newline="")
    with pytest.raises(SpringfootError) as caught:
        read_csv(path)
    assert str(caught.value).startswith(f"a.csv{said}" if said[0] == " " else f"a.csv, {said}")


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"{", "it is not JSON, line 1, column 2: expecting property name enclosed in double quotes"),
        (b"\xff", "it is not JSON, it is no UTF-8 text"),
        (b"[" * 100_000, "it is not JSON, it is nested too deeply"),
        (b'{"a": ' + b"9" * 5000 + b"}", "it is not JSON, Exceeds the limit (4300 digits) for integer string"),
        (b"[1]", "it must be an object in braces"),
    ],
)
def test_what_is_no_json_object_is_refused(tmp_path, content, said):
    path = tmp_path / "a.json"
    path.write_bytes(content)
    with pytest.raises(SpringfootError) as caught:
        read_object(path, "record")
    assert str(caught.value).startswith(f"{path} is no record: {said}")


@pytest.mark.parametrize(
    "kind", ["compressed", "lzma", "a shape of terabytes", "a shape beyond numbers", "objects", "no digest"]
)
def test_an_archive_that_would_fill_the_memory_or_run_code_is_refused(tmp_path, kind):
    path, arrays = tmp_path / "a.npz", {"header": np.array("{}"), "phase": np.zeros(10**6)}
    if kind == "compressed":
        np.savez_compressed(path, **arrays)
    elif kind == "objects":
        np.savez(path, phase=np.array([{}], object), allow_pickle=True)
    else:
        np.savez(path, **arrays)
    if kind == "lzma":
        with zipfile.ZipFile(path, "w", zipfile.ZIP_LZMA) as archive:
            archive.writestr("phase.npy", bytes(4000))
        content = bytearray(path.read_bytes())
        content[45:60] = b"\xff" * 15
        path.write_bytes(content)
    if kind.startswith("a shape"):
        file = io.BytesIO()
        descr, shape = ("|V0", (2**70,)) if kind.endswith("numbers") else ("<f8", (10**12,))
        np.lib.format.write_array_header_1_0(file, {"descr": descr, "fortran_order": False, "shape": shape})
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("phase.npy", file.getvalue() + b"0" * (0 if kind.endswith("numbers") else 100))
    with pytest.raises(SpringfootError) as caught:
        read_arrays(path, "recording")
    said = {"compressed": "is no recording: it is compressed", "no digest": "has no digest: another version"}
    assert str(caught.value).startswith(f"{path} {said.get(kind, 'is no recording')}")


@pytest.mark.parametrize("header", [b"((((", b"{'descr': (((", b"\x00", b"1" * 5000])
def test_an_array_whose_header_is_not_pythons_is_one_line(tmp_path, header):
    path = tmp_path / "strides.npz"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("phase.npy", b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header)
    with pytest.raises(SpringfootError, match=r"strides\.npz is no recording") as caught:
        read_arrays(path, "recording")
    assert "\n" not in str(caught.value)
