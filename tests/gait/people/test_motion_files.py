"""Motion files that cannot be read: one line that names file, line and column."""

import pytest

from springfoot.gait import SpringfootError
from springfoot.gait.people.own_data import read_gait

SHORT = "time_s,knee_flexion_deg,thigh_flexion_deg\n0.00,5,20\n0.01,6,21\n0.02,7,22\n"
BAD = [
    ("a.csv", "", ["a.csv has no data"]),
    ("a.csv", "time_s,knee_flexion_deg\n", ["a.csv has no data"]),
    ("a.csv", "knee_flexion_deg\n1\n", ["a.csv, line 1", "percent", "time_s"]),
    ("a.csv", "time_s,elbow\n0,1\n1,2\n", ["a.csv has none", "knee_flexion_deg"]),
    ("a.csv", "percent,elbow\n" + "".join(f"{k},1\n" for k in range(101)), ["a.csv, line 1", "knee_flexion_deg"]),
    ("a.csv", SHORT.replace("6,21", "abc,21"), ["a.csv, line 3, column knee_flexion_deg", "'abc'"]),
    ("a.csv", SHORT.replace("6,21", "nan,21"), ["a.csv, line 3, column knee_flexion_deg", "nan"]),
    ("a.csv", SHORT.replace("6,21", ",21"), ["a.csv, line 3, column knee_flexion_deg", "''"]),
    ("a.csv", SHORT.replace("6,21", "21"), ["a.csv, line 3: 2 cells", "3 columns"]),
    ("a.csv", SHORT.replace("0.02", "0.01"), ["a.csv, line 4, column time_s", "greater than 0.01"]),
    (
        "a.csv",
        SHORT.replace("knee_flexion_deg", "thigh_flexion_deg"),
        ["line 1: column thigh_flexion_deg stands twice"],
    ),
    ("a.csv", SHORT, ["a.csv", "at least 2 complete strides, has 0"]),
    ("a.csv", SHORT.replace("0.01", "0.10").replace("0.02", "0.20"), ["at least 30 samples a second", "every 0.1 s"]),
    ("a.csv", SHORT + "1.0,5,20\n", ["no samples for 0.98 s after 0.02 s"]),
    ("a.csv", "percent,knee_flexion_deg\n0,1\n3,1\n", ["a.csv, line 3, column percent", "must be 1 here"]),
    ("a.csv", "percent,knee_flexion_deg\n0,1\n1,1\n", ["a.csv, line 3, column percent", "ends at 1", "100"]),
    ("a.csv", "\x00\x01\x02", ["a.csv is not a text file"]),
    ("a.csv", b"\xff\xfe\x80junk", ["a.csv is not a text file"]),
    ("a.csv", 'time_s,knee_flexion_deg\n"0,1\n', ["a.csv is not a CSV file"]),
    ("a.mot", "time\tknee_angle_r\n0\t1\n", ["a.mot", "endheader"]),
    ("a.mot", "inDegrees=yes\nendheader\nknee_angle_r\n0\n", ["a.mot, line 3", "no column time"]),
    (
        "a.sto",
        "inDegrees=si\nendheader\ntime knee_angle_r\n0 0\n0.01 0.1\n",
        ["a.sto", "inDegrees=yes or inDegrees=no"],
    ),
    (
        "a.sto",
        "inDegrees=no\nendheader\n\ntime knee_angle_r\n0 0\n0.01 x\n",
        ["a.sto, line 6, column knee_angle_r", "'x'"],
    ),
    ("a.sto", "inDegrees=no\nendheader\ntime knee_angle_r\n0 0\n0.01 0.1 3\n", ["a.sto, line 5: 3 cells"]),
    ("a.sto", "inDegrees=no\nendheader\ntime\tarm_flex_r\n0\t0\n", ["a.sto has none"]),
    ("a.txt", "ITEM\t1\n", ["a.txt is no text of Visual3D"]),
    ("a.xlsx", "", ["a.xlsx", ".csv, .txt, .mot, .sto or .c3d"]),
    ("a.c3d", b"", ["a.c3d is not a C3D file"]),
    ("a.c3d", b"junk" * 300, ["a.c3d is not a C3D file"]),
    ("a.c3d", b"\x02\x50" + bytes(1000), ["a.c3d is not a C3D file"]),
]


@pytest.mark.parametrize(("name", "content", "words"), BAD)
def test_a_bad_file_is_refused_in_one_line_that_says_where(tmp_path, name, content, words):
    (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(SpringfootError) as caught:
        read_gait(tmp_path / name)
    message = str(caught.value)
    assert "\n" not in message
    for word in words:
        assert word in message, message


@pytest.mark.parametrize("name", ["nothing.csv", "nothing.mot", "nothing.c3d"])
def test_a_file_that_is_not_there(tmp_path, name):
    with pytest.raises(SpringfootError, match=f"no file .*{name}"):
        read_gait(tmp_path / name)
