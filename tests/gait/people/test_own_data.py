"""Own data: people's curves written to files of every kind, with noise, come back as the curves they were."""

import csv
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tyro

from springfoot.cli.evaluate import EvaluateFlags
from springfoot.gait import GRAVITY, SpringfootError, human_gait
from springfoot.gait.people.human import COLUMNS, FORCES
from springfoot.gait.people.motion_files import FILE_SIDES
from springfoot.gait.people.own_data import OwnGait, read_gait
from springfoot.studies.base.flags import given

HUMAN = human_gait(1.3)
MASS = 71.0
ANGLES, MOMENTS = ("thigh", "hip", "knee", "ankle", "toe"), ("hip_moment", "knee_moment", "ankle_moment")
NOISE = {name: 0.005 if name in FORCES else 0.009 for name in COLUMNS}
"""Standard deviation of the noise of a sample: 0.005 body weights, 0.5 deg, 0.009 N m/kg."""
PERCENT = np.arange(101)
PHASE = PERCENT / 100


def walk(seconds=12.0, rate=100.0, names=(*ANGLES, *MOMENTS, *FORCES), noise=True):
    """Time [s] and, for each side, curves over it."""
    random = np.random.default_rng(3)
    time = 0.5 + np.arange(round(seconds * rate)) / rate
    legs = {}
    for side, offset in zip(FILE_SIDES, (0.2, 0.7), strict=True):
        phase = time / HUMAN.stride_time + offset
        legs[side] = {n: HUMAN.mean(n, phase) + noise * NOISE[n] * random.standard_normal(len(time)) for n in names}
    return time, legs


def write_table(path, columns, head=(), separator=","):
    rows = zip(*columns.values(), strict=True)
    lines = [*head, separator.join(columns), *(separator.join(f"{value:.6g}" for value in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def our_csv(path, legs=FILE_SIDES, **options):
    time, curves = walk(**options)
    columns = {"time_s": time}
    for side in legs:
        for name, values in curves[side].items():
            column = COLUMNS[name] + (f"_{side}" if len(legs) > 1 else "")
            columns[column] = np.degrees(values) if "_deg" in column else values
    return write_table(path, columns)


def table_of(path):
    """The columns of a file of numbers."""
    names = path.read_text(encoding="utf-8").splitlines()[0].split(",")
    return dict(zip(names, np.loadtxt(path, delimiter=",", skiprows=1).T, strict=True))


def opensim(path, degrees=True, knee_sign=1.0, kind="angles", names="{}"):
    time, legs = walk()
    columns, unit = {"time": time}, 180 / np.pi if degrees else 1.0
    tilt = unit * (legs["left"]["thigh"] - legs["left"]["hip"])
    if kind == "angles":
        columns |= {names.format("pelvis_tilt"): tilt, names.format("pelvis_tx"): 1.3 * time}
    for side, curves in legs.items():
        letter = side[0]
        coordinates = {"hip": f"hip_flexion_{letter}", "knee": f"knee_angle_{letter}"} | {
            "ankle": f"ankle_angle_{letter}",
            "toe": f"mtp_angle_{letter}",
        }
        for curve, name in coordinates.items():
            sign = knee_sign if curve == "knee" else 1.0
            if kind == "angles":
                columns[names.format(name)] = sign * unit * curves[curve]
            elif kind == "moments" and curve != "toe":
                columns[f"{name}_moment"] = -sign * MASS * curves[f"{curve}_moment"]
        if kind == "forces":
            start = "ground_force_v" if side == "right" else "1_ground_force_v"
            columns[f"{start}x"] = MASS * GRAVITY * curves["grf_forward"]
            columns[f"{start}y"] = MASS * GRAVITY * curves["grf_vertical"]
    head = [path.name, f"nRows={len(time)}", f"inDegrees={'yes' if degrees else 'no'}", "endheader"]
    return write_table(path, columns, head, "\t")


def people_of(own):
    """Our people, as nothing was measured but the curves: own step, speed and toe-off."""
    return own.gait(1.3, 1.7)


def assert_like_people(own, names, events=0.02):
    """Curves within the noise and the smear of the events (share of the stride); rms over the stride."""
    gait = people_of(own)
    assert gait.stride_time == pytest.approx(HUMAN.stride_time, rel=0.005)
    assert gait.toe_off == pytest.approx(HUMAN.toe_off, abs=events)
    for name in names:
        error = np.sqrt(np.mean((gait.mean(name, PHASE) - HUMAN.mean(name, PHASE)) ** 2))
        limit = np.radians(0.8) if name in ANGLES else 0.03
        assert error < limit, (name, error)
        assert name not in gait.borrowed and f"{name} sd" not in gait.borrowed


def test_a_csv_over_time_gives_the_curves_back(tmp_path):
    own = read_gait(our_csv(tmp_path / "mine.csv"))
    assert_like_people(own, (*ANGLES, *MOMENTS, *FORCES))
    gait = own.gait(1.3, 1.7)
    assert not any("power" in name for name in gait.borrowed)
    assert np.corrcoef(gait.mean("ankle_power", PHASE), HUMAN.mean("ankle_power", PHASE))[0, 1] > 0.97
    assert own.name == "mine.csv" and own.strides == pytest.approx(2 * 12 / HUMAN.stride_time, abs=3)


def test_the_spread_over_strides_is_that_of_the_noise(tmp_path):
    gait = read_gait(our_csv(tmp_path / "mine.csv", seconds=60)).gait(1.3, 1.7)
    # Half-way between samples the noise of two is averaged: between 1 and 1/sqrt(2) of one sample's.
    middle = slice(10, 50)
    assert 0.6 * NOISE["hip"] < gait.sd("hip", PHASE)[middle].mean() < 1.3 * NOISE["hip"]


def test_forces_are_exactly_zero_in_swing(tmp_path):
    gait = read_gait(our_csv(tmp_path / "mine.csv")).gait(1.3, 1.7)
    swing = np.linspace(gait.toe_off, 1, 50)[:-1]
    assert (gait.mean("grf_vertical", swing) == 0).all()


def test_without_forces_events_come_from_the_angles(tmp_path):
    own = read_gait(our_csv(tmp_path / "mine.csv", names=ANGLES))
    assert_like_people(own, ANGLES)
    gait = own.gait(1.1, 1.7)
    people = human_gait(1.1)
    assert {"grf_vertical", "ankle_moment", "ankle_moment sd"} <= set(gait.borrowed)
    np.testing.assert_array_equal(gait.mean("ankle_moment", PHASE), people.mean("ankle_moment", PHASE))
    assert gait.step_length == pytest.approx(1.1 * gait.stride_time / 2)


def test_one_leg_without_names_of_sides(tmp_path):
    path = our_csv(tmp_path / "mine.csv", legs=("left",))
    assert_like_people(read_gait(path), (*ANGLES, *FORCES))
    with pytest.raises(
        SpringfootError, match=r"mine.csv has no right leg, only curves without a side: side must be both"
    ):
        read_gait(path, side="right")


def test_the_side_of_a_leg_that_is_missing_is_refused_by_its_name(tmp_path):
    for percent in (True, False):
        lines = our_csv(tmp_path / "both.csv").read_text(encoding="utf-8").splitlines()
        table = [line.split(",") for line in lines]
        kept = [k for k, name in enumerate(table[0]) if not name.endswith("_right")]
        rows = [[row[k] for k in kept] for row in table]
        if percent:
            rows = [["percent", *rows[0][1:]], *([str(k), *row[1:]] for k, row in enumerate(rows[1:102]))]
        (tmp_path / "left.csv").write_text("\n".join(map(",".join, rows)) + "\n", encoding="utf-8")
        with pytest.raises(
            SpringfootError, match=r"left.csv has no right leg, only the left one: side must be left or both"
        ):
            read_gait(tmp_path / "left.csv", side="right")


def test_one_side_alone(tmp_path):
    path = our_csv(tmp_path / "mine.csv")
    both, left = read_gait(path), read_gait(path, side="left")
    assert left.strides and both.strides and left.strides < both.strides
    with pytest.raises(SpringfootError, match="side must be"):
        read_gait(path, side="middle")


@pytest.mark.parametrize(("degrees", "knee_sign"), [(True, 1.0), (False, -1.0)])
def test_opensim_angles_in_degrees_and_radians_with_either_knee_sign(tmp_path, degrees, knee_sign):
    own = read_gait(opensim(tmp_path / "ik.mot", degrees, knee_sign))
    assert_like_people(own, ANGLES)
    assert own.speed == pytest.approx(1.3, abs=0.001)
    assert own.stride_time and own.step_length == pytest.approx(1.3 * own.stride_time / 2, rel=0.001)


def test_opensim_4_paths(tmp_path):
    path = opensim(tmp_path / "states.sto", False, names="/jointset/some_joint/{}/value")
    assert_like_people(read_gait(path), ANGLES)


@pytest.mark.parametrize("knee_sign", [1.0, -1.0])
def test_opensim_angles_forces_and_moments_in_three_files(tmp_path, knee_sign):
    files = [
        opensim(tmp_path / f"{kind}.sto", knee_sign=knee_sign, kind=kind) for kind in ("angles", "forces", "moments")
    ]
    own = read_gait(*files)
    # The body's weight is what the feet bear: people's curves bear 4 % too much (reference), and so would the moments.
    assert_like_people(own, ANGLES)
    assert_like_people(read_gait(*files, mass=MASS), (*ANGLES, *MOMENTS, *FORCES))
    total = 2 * people_of(own).mean("grf_vertical", np.linspace(0, 1, 1000, endpoint=False)).mean()
    assert total == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("kinds", [("angles", "moments"), ("angles", "forces", "moments")])
def test_a_body_of_a_given_mass_gets_the_moments_of_a_walk_whose_files_have_no_forces(tmp_path, kinds):
    files = [opensim(tmp_path / f"{kind}.sto", kind=kind) for kind in kinds]
    words = ["schedule", "--human", ",".join(map(str, files)), "--mass", str(MASS)]
    settings = given(tyro.cli(EvaluateFlags, args=words).environment)
    weighed = read_gait(*files) if "forces" in kinds else read_gait(*files, mass=MASS)
    assert settings == {"human": weighed.to_json(), "mass": MASS} and {*MOMENTS} <= {*settings["human"]["mean"]}


def gait_csv(path, gait=HUMAN, repeat=("mine",), **changes):
    """Mean curves over percent, in the columns of the reference data."""
    columns = {"percent": PERCENT, "speed_m_s": np.full(101, 1.3), "stride_time_s": np.full(101, 1.05)}
    columns |= {"step_length_m": np.full(101, 0.68), "toe_off_percent": np.full(101, 100 * gait.toe_off)}
    for name, column in COLUMNS.items():
        unit = 180 / np.pi if "_deg" in column else 1.0
        columns[column], columns[f"{column}_sd"] = unit * gait.mean(name, PHASE), unit * gait.sd(name, PHASE)
    columns |= changes
    columns = {name: values for name, values in columns.items() if values is not None}
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([*columns, "condition"])
        for condition in repeat:
            writer.writerows([*row, condition] for row in zip(*columns.values(), strict=True))
    return path


def test_mean_curves_over_percent_come_back_to_rounding(tmp_path):
    own = read_gait(gait_csv(tmp_path / "mean.csv"))
    gait = own.gait(1.2, 1.8)
    assert (gait.speed, gait.stride_time, gait.step_length) == (1.3, 1.05, 0.68)
    assert gait.condition == "mean.csv" and not gait.borrowed and not gait.clamped
    phase = np.random.default_rng(0).uniform(0, 1, 200)
    for name in ANGLES:
        np.testing.assert_allclose(gait.mean(name, phase), HUMAN.mean(name, phase), atol=1e-5)
        np.testing.assert_allclose(gait.sd(name, phase), HUMAN.sd(name, phase), atol=1e-5)
    for name in FORCES:
        np.testing.assert_allclose(gait.mean(name, PHASE), HUMAN.mean(name, PHASE), atol=0.01)


@pytest.mark.parametrize(
    ("column", "value", "words"),
    [
        ("speed_m_s", 1300.0, "speed must be in [0.1, 4] m/s, got 1300: mm/s?"),
        ("speed_m_s", 130.0, "got 130: cm/s?"),
        ("speed_m_s", 4.7, "got 4.7: km/h?"),
        ("stride_time_s", 1050.0, "stride_time must be in [0.4, 4] s, got 1050: ms?"),
        ("step_length_m", 680.0, "step_length must be in [0.05, 2] m, got 680: mm?"),
        ("step_length_m", 68.0, "got 68: cm?"),
        ("step_length_m", 5.0, "got 5: cm?"),  # the least that is accepted
        ("stride_time_s", 4000.0, "got 4000: ms?"),  # the largest
        ("toe_off_percent", 0.62, "[0.3, 0.9] of the stride, got 0.0062: a fraction, where percent must be?"),
        ("stride_time_s", 9.0, "stride_time must be in [0.4, 4] s, got 9"),
    ],
)
def test_a_number_beside_mean_curves_in_another_unit_is_refused_with_a_guess(column, value, words, tmp_path):
    changes: dict[str, Any] = {column: np.full(101, value)}
    path = gait_csv(tmp_path / "mean.csv", **changes)
    with pytest.raises(SpringfootError) as caught:
        read_gait(path, trust_units=True)
    assert str(caught.value).endswith(words)


def test_thigh_follows_from_hip_and_pelvis(tmp_path):
    tilt = np.degrees(HUMAN.mean("hip", PHASE) - HUMAN.mean("thigh", PHASE))
    path = gait_csv(tmp_path / "mean.csv", thigh_flexion_deg=None, pelvis_anterior_tilt_deg=tilt)
    gait = read_gait(path).gait(1.3, 1.7)
    np.testing.assert_allclose(gait.mean("thigh", PHASE), HUMAN.mean("thigh", PHASE), atol=1e-4)


def test_of_several_conditions_one_is_named(tmp_path):
    path = gait_csv(tmp_path / "mean.csv", repeat=("slow", "fast"))
    assert read_gait(path, condition="fast").name == "mean.csv:fast"
    for condition in (None, "medium"):
        with pytest.raises(
            SpringfootError, match=r"mean\.csv holds the conditions slow, fast; condition must .* mean\.csv:slow\), got"
        ):
            read_gait(path, condition=condition)
    twice = gait_csv(tmp_path / "twice.csv", repeat=("slow", "fast", "slow"))
    assert read_gait(twice, condition="fast").name == "twice.csv:fast"
    with pytest.raises(SpringfootError, match=r"^twice\.csv holds 2 gaits of the condition slow; it must name one$"):
        read_gait(twice, condition="slow")


def test_json_gives_the_same_gait_to_the_bit(tmp_path):
    own = read_gait(our_csv(tmp_path / "mine.csv"))
    text = json.dumps(own.to_json(), allow_nan=False)
    again = OwnGait.from_json(json.loads(text))
    assert json.dumps(again.to_json()) == text
    for name in (*ANGLES, *FORCES):
        np.testing.assert_array_equal(again.gait(1.2, 1.7).mean(name, PHASE), own.gait(1.2, 1.7).mean(name, PHASE))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda v: [], "human must be"),
        (lambda v: v | {"extra": 1}, "human must be"),
        (lambda v: v | {"name": 3}, "human must be"),
        (lambda v: v | {"speed": -1.0}, "speed must be"),
        (lambda v: v | {"stride_time": "long"}, "stride_time must be"),
        (lambda v: v | {"strides": 0.5}, "strides must be"),
        (lambda v: v | {"toe_off": None}, "forces need a toe_off"),
        (lambda v: v | {"mean": None}, "human mean must map"),
        (lambda v: v | {"mean": {"elbow": [[1, 0]]}}, "no curve 'elbow'"),
        (lambda v: v | {"mean": {"knee": [1.0, 2.0]}}, "human mean knee must be"),
        (lambda v: v | {"mean": {"knee": [[10**400, 0]]}}, "human mean knee must be"),
        (lambda v: v | {"sd": {"knee": [[float("nan"), 0]]}}, "human sd knee must be"),
        (lambda v: v | {"sd": {"grf_vertical": [["x"]]}}, "human sd grf_vertical must be"),
    ],
)
def test_what_is_no_own_gait_is_refused(tmp_path, change, words):
    values = read_gait(gait_csv(tmp_path / "mean.csv")).to_json()
    with pytest.raises(SpringfootError, match=words) as caught:
        OwnGait.from_json(change(values))
    assert "\n" not in str(caught.value)


def test_interchanged_legs_and_wrong_units_are_noticed(tmp_path):
    time, legs = walk()
    turned = {f"{COLUMNS[n]}_left": np.degrees(legs["right"][n]) for n in ANGLES} | {
        f"{COLUMNS[n]}_left": legs["left"][n] for n in FORCES
    }
    with pytest.raises(SpringfootError, match="interchanged"):
        read_gait(write_table(tmp_path / "a.csv", {"time_s": time} | turned))
    path = opensim(tmp_path / "ik.mot")
    path.write_text(path.read_text().replace("inDegrees=yes", "inDegrees=no"))
    with pytest.raises(SpringfootError, match="degrees or radians"):
        read_gait(path)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"knee_flexion_deg_right": np.pi / 180}, "the right leg: knee_flexion_deg goes from"),
        ({"ankle_dorsiflexion_deg_left": -1.0}, "the left leg: ankle_dorsiflexion_deg is opposite to people's"),
        ({"grf_vertical_bw_right": -1.0}, "the right leg: the vertical force is below 0 while the foot bears weight"),
    ],
)
def test_one_leg_in_other_units_or_signs_is_refused_though_the_mean_of_both_looks_right(tmp_path, wrong, words):
    columns = table_of(our_csv(tmp_path / "mine.csv"))
    for name, factor in wrong.items():
        columns[name] = columns[name] * factor
    path = write_table(tmp_path / "wrong.csv", columns)
    with pytest.raises(SpringfootError, match=words):
        read_gait(path)
    read_gait(path, side="left" if "right" in words else "right")
    read_gait(path, trust_units=True)


def test_a_leg_that_was_not_measured_is_left_out(tmp_path):
    columns = table_of(our_csv(tmp_path / "mine.csv"))
    still = {name: values * (not name.endswith("_right")) for name, values in columns.items()}
    assert read_gait(write_table(tmp_path / "one.csv", still)).strides == pytest.approx(12 / HUMAN.stride_time, abs=2)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"speed_m_s": 3.9}, "two steps of 0.68 m in 1.05 s are 1.30 m/s, and the speed is 3.9"),
        ({"step_length_m": 2 * HUMAN.step_length}, "a stride's length, or a step's time?"),
        ({"stride_time_s": HUMAN.stride_time / 2}, "a stride's length, or a step's time?"),
        ({"n": 2.5}, "n must be a whole number of strides, got 2.5"),
        ({"knee_flexion_deg_sd": -5.0}, "knee_flexion_deg_sd must lie from 0 to 2 times the range of its curve"),
        ({"knee_flexion_deg_sd": 500.0}, "knee_flexion_deg_sd must lie from 0 to 2 times the range of its curve"),
    ],
)
def test_numbers_beside_the_curves_that_contradict_them_are_refused(tmp_path, wrong, words):
    changes: dict[str, Any] = {name: np.full(101, value) for name, value in wrong.items()}
    with pytest.raises(SpringfootError, match=words):
        read_gait(gait_csv(tmp_path / "mean.csv", **changes))


def test_reading_text_needs_no_c3d_library():
    code = "import springfoot.gait.people.own_data, sys; print('ezc3d' in sys.modules, 'mujoco' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout == "False False\n"


REFERENCE = Path(__file__).resolve().parents[4] / "shared" / "reference" / "human_gait.csv"


@pytest.mark.skipif(not REFERENCE.is_file(), reason="the measured data are not ours to give away: ../shared/reference")
def test_the_reference_data_are_a_file_like_any_other():
    own = read_gait(REFERENCE, condition="slow").gait(1.2, 1.71)
    people = human_gait(1.2, 1.71)
    for name in ("thigh", "knee", "ankle", "ankle_moment"):
        np.testing.assert_allclose(own.mean(name, PHASE), people.mean(name, PHASE), atol=1e-5)
    assert own.step_length == people.step_length and "toe" in own.borrowed
