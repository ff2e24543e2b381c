"""Files in the form that the field writes: right ones are taken, each side for itself, wrong units are refused."""

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from springfoot.gait import GRAVITY, SpringfootError, human_gait
from springfoot.gait.people.human import COLUMNS, FORCES
from springfoot.gait.people.measured_person import read_person
from springfoot.gait.people.own_data import read_gait
from springfoot.gait.springs import phase_slope, stance_phases

MASS = 71.0
PHASE = np.linspace(0, 1, 101)
JOINTS = {"hip": "hip_flexion", "knee": "knee_angle", "ankle": "ankle_angle", "toe": "mtp_angle"}
RIGHT_SHARE = 0.8
"""Knee and ankle moment of the right leg over those of the left, so that interchanged sides are seen."""


def walk(speed):
    """Time [s] and side -> curves, in the units of `HumanGait`."""
    human = human_gait(speed)
    time = 0.01 * np.arange(500)
    legs = {}
    for side, offset, share in (("left", 0.2, 1.0), ("right", 0.7, RIGHT_SHARE)):
        legs[side] = {name: human.mean(name, time / human.stride_time + offset) for name in COLUMNS}
        for name in ("knee", "ankle_moment"):
            legs[side][name] = share * legs[side][name]
    return time, legs


def write(path, columns, head=(), separator="\t"):
    """Write columns as text and return the path."""
    rows = zip(*columns.values(), strict=True)
    lines = [*head, separator.join(columns), *(separator.join(f"{value:.6g}" for value in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


FORCE_NAMES = {
    "AddBiomechanics": ("ground_force_calcn_r_v", "ground_force_calcn_l_v"),
    "OpenCap": ("ground_force_right_v", "ground_force_left_v"),
    "Rajagopal": ("ground_force_r_v", "ground_force_l_v"),
    "gait2392": ("ground_force_v", "1_ground_force_v"),
}


def opensim(form, folder, *, speed=1.3, kinetic=True, degrees=True, says=None, paths=False, ahead=1.0, wrong=None):
    """Write angles, forces and moments as people's tools do; `says` is the word for inDegrees, "" leaves the line out,
    `ahead` -1 walks towards the laboratory's -x, `wrong` maps beginnings or ends of columns to factors."""
    time, legs = walk(speed)
    unit = 180 / np.pi if degrees else 1.0
    knee = -1.0 if form == "gait2392" else 1.0
    says = ("yes" if degrees else "no") if says is None else says
    head = [f"inDegrees={says}"] if says else []
    path_of = "/jointset/joint/{}/value" if paths else "{}"
    angles = {"pelvis_tilt": unit * (legs["left"]["thigh"] - legs["left"]["hip"]), "pelvis_tx": ahead * speed * time}
    forces, moments = {}, {}
    for side, start in zip(("right", "left"), FORCE_NAMES[form], strict=True):
        curves = legs[side]
        for joint, coordinate in JOINTS.items():
            sign = knee if joint == "knee" else 1.0
            still = joint == "toe" and form == "OpenCap"
            name = f"{coordinate}_{side[0]}"
            angles[name] = 0.0 * time if still else unit * sign * curves[joint]
            moments[f"{name}_moment"] = -sign * MASS * curves.get(f"{joint}_moment", 0.0 * time)
        for axis, force in (("y", "grf_vertical"), ("x", "grf_forward")):
            forces[f"{start}{axis}"] = MASS * GRAVITY * (ahead if axis == "x" else 1.0) * curves[force]
        forces[f"{start[:-1]}px"] = speed * time
    for end, factor in (wrong or {}).items():
        for columns in (angles, forces, moments):
            columns |= {
                name: factor * values for name, values in columns.items() if name.startswith(end) or name.endswith(end)
            }
    angles = {path_of.format(name): values for name, values in angles.items()}
    files = [write(folder / "ik.mot", {"time": time} | angles, ["Coordinates", *head, "endheader"])]
    if kinetic:
        files.append(write(folder / "grf.mot", {"time": time} | forces, ["nRows=500", "endheader"]))
        files.append(write(folder / "id.sto", {"time": time} | moments, ["nRows=500", "inDegrees=no", "endheader"]))
    return files


def visual3d(folder, *, speed=1.3, kinetic=True, rows=None, angle=1.0, moment=1.0):
    """Write Visual3D's text: over time, or with `rows` mean curves over the stride."""
    time, legs = walk(speed)
    columns = {} if rows else {"TIME": time}
    for side, curves in legs.items():
        if rows:
            human, share = human_gait(speed), RIGHT_SHARE if side == "right" else 1.0
            curves = {name: human.mean(name, np.linspace(0, 1, rows)) for name in COLUMNS}
            curves |= {name: share * curves[name] for name in ("knee", "ankle_moment")}
        for joint in ("hip", "knee", "ankle"):
            sign = -1.0 if joint == "knee" else 1.0
            columns[f"{side.upper()}_{joint.upper()}_ANGLE"] = sign * angle * np.degrees(curves[joint])
            if kinetic:
                columns[f"{side.upper()}_{joint.upper()}_MOMENT"] = -sign * moment * curves[f"{joint}_moment"]
    names = list(columns)
    x = ["0" if name == "TIME" else "X" for name in names]
    heads = [["walk.c3d"] * len(names), names, ["LINK_MODEL_BASED"] * len(names), ["ORIGINAL"] * len(names), x]
    lines = ["\t".join(["ITEM" if index == 4 else "", *head]) for index, head in enumerate(heads)]
    lines += [
        "\t".join([str(k + 1), *(f"{v:.6g}" for v in row)]) for k, row in enumerate(zip(*columns.values(), strict=True))
    ]
    (folder / "export.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return [folder / "export.txt"]


def plug_in_gait(folder, *, speed=1.3, kinetic=True, angle=1.0, moment=1.0, separator=","):
    """Write a table with Plug-in Gait's names, angles in degrees, moments in N mm/kg."""
    time, legs = walk(speed)
    columns = {"time_s": time}
    for side, curves in legs.items():
        letter = side[0].upper()
        columns[f"{letter}PelvisAngles"] = angle * np.degrees(curves["hip"] - curves["thigh"])
        for joint in ("hip", "knee", "ankle"):
            columns[f"{letter}{joint.capitalize()}Angles"] = angle * np.degrees(curves[joint])
            if kinetic:
                columns[f"{letter}{joint.capitalize()}Moment"] = 1000 * moment * curves[f"{joint}_moment"]
    path = write(folder / "pig.csv", columns, separator=separator)
    if separator == ";":
        path.write_text(path.read_text().replace(".", ","), encoding="utf-8")
    return [path]


def nexus(folder, *, speed=1.3, kinetic=True, plates=True, angle=1.0, moment=1.0, units=("N.mm/kg", "N")):
    """Write the sections of a Nexus export; each foot walks on a plate of its own, sampled at 1000 Hz, along y."""
    time, legs = walk(speed)
    human = human_gait(speed)
    frames = 1 + np.arange(len(time))
    outputs, markers, devices = {}, {}, {}
    fine = 1e-3 * (np.arange(10 * len(time)) + 5)
    sub = np.arange(len(fine)) % 10
    events = []
    for side, curves, offset in zip(legs, legs.values(), (0.2, 0.7), strict=True):
        letter = side[0].upper()
        outputs[f"Anna:{letter}PelvisAngles"] = angle * np.degrees(curves["hip"] - curves["thigh"])
        for joint in ("hip", "knee", "ankle"):
            outputs[f"Anna:{letter}{joint.capitalize()}Angles"] = angle * np.degrees(curves[joint])
            if kinetic:
                outputs[f"Anna:{letter}{joint.capitalize()}Moment"] = 1000 * moment * curves[f"{joint}_moment"]
        for phase, name in ((0.0, "Foot Strike"), (human.toe_off, "Foot Off")):
            at = (np.arange(1, 6) - offset + phase) * human.stride_time
            events += [f"Anna,{side.capitalize()},{name},{t + 0.01:.4f},words" for t in at if t < time[-1]]
        across = 100 if side == "left" else 500
        for marker, y in (("HEE", 100.0), ("TOE", 300.0)):
            markers[f"Anna:{letter}{marker}"] = [across + 0 * time, y + 0 * time, 0 * time]
        up, ahead = (MASS * GRAVITY * human.mean(name, fine / human.stride_time + offset) for name in FORCES)
        kilo = 1e-3 if units[1] == "kN" else 1.0
        loaded = up > 0
        devices[f"Plate {letter} - Force"] = [0 * up, -ahead * kilo, -up * kilo]
        devices[f"Plate {letter} - CoP"] = [across * loaded, 200 * loaded, 0 * up]
    outputs = {name: [values, 0 * time, 0 * time] for name, values in outputs.items()}

    def unit_of(name):
        return "deg" if "Angle" in name else units[0] if "Moment" in name else units[1] if "Force" in name else "mm"

    def section(name, rate, frames, subs, columns, axes):
        lines = [name, str(rate), ",,".join(["", *(f"{key}," for key in columns)])]
        lines += [
            ",".join(["Frame", "Sub Frame", *axes]),
            ",".join(["", "", *(unit_of(key) for key in columns for _ in range(3))]),
        ]
        values = zip(frames, subs, *(row for rows in columns.values() for row in rows), strict=True)
        return [*lines, *(",".join(f"{value:.6g}" for value in row) for row in values), ""]

    lines = []
    if kinetic:
        lines = ["Events", "100", "Subject,Context,Name,Time (s),Description", *events, ""]
    if plates and kinetic:
        lines += section(
            "Devices", 1000, np.repeat(frames, 10), sub, devices, [*("Fx", "Fy", "Fz", "Cx", "Cy", "Cz")] * 2
        )
    lines += section("Model Outputs", 100, frames, 0 * frames, outputs, ["X", "Y", "Z"] * len(outputs))
    lines += section("Trajectories", 100, frames, 0 * frames, markers, ["X", "Y", "Z"] * len(markers))
    (folder / "Walk01.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return [folder / "Walk01.csv"]


SPEEDS = (0.9, 1.3, 1.7)
RIGHT = {
    **{f"{form} at {v}": (opensim, form, {"speed": v}) for form in FORCE_NAMES for v in SPEEDS},
    **{f"{form}, angles alone": (opensim, form, {"kinetic": False}) for form in FORCE_NAMES},
    **{f"{form} in radians": (opensim, form, {"degrees": False}) for form in FORCE_NAMES},
    **{f"{form} says nothing of degrees": (opensim, form, {"says": ""}) for form in FORCE_NAMES},
    **{f"{form} says nothing of radians": (opensim, form, {"says": "", "degrees": False}) for form in FORCE_NAMES},
    **{f"{form} towards -x": (opensim, form, {"ahead": -1.0}) for form in FORCE_NAMES},
    **{f"{form} with paths": (opensim, form, {"paths": True}) for form in FORCE_NAMES},
    **{f"Visual3D at {v}": (visual3d, None, {"speed": v}) for v in SPEEDS},
    "Visual3D, angles alone": (visual3d, None, {"kinetic": False}),
    "Visual3D, 101 rows a stride": (visual3d, None, {"rows": 101}),
    "Visual3D, 51 rows a stride": (visual3d, None, {"rows": 51}),
    **{f"Plug-in Gait at {v}": (plug_in_gait, None, {"speed": v}) for v in SPEEDS},
    "Plug-in Gait, angles alone": (plug_in_gait, None, {"kinetic": False}),
    "Plug-in Gait in N m/kg": (plug_in_gait, None, {"moment": 1e-3}),
    "Plug-in Gait, external moments": (plug_in_gait, None, {"moment": -1.0}),
    "Plug-in Gait, semicolons and decimal commas": (plug_in_gait, None, {"separator": ";"}),
    "Plug-in Gait, tabs": (plug_in_gait, None, {"separator": "\t"}),
    **{f"Nexus at {v}": (nexus, None, {"speed": v}) for v in SPEEDS},
    "Nexus, angles alone": (nexus, None, {"kinetic": False}),
    "Nexus without plates": (nexus, None, {"plates": False}),
    "Nexus in N m and kN": (nexus, None, {"moment": 1e-3, "units": ("N.m/kg", "kN")}),
}


def written(case, folder):
    maker, form, options = case
    return maker(form, folder, **options) if form else maker(folder, **options)


@pytest.mark.parametrize("case", RIGHT.values(), ids=RIGHT)
def test_right_files_are_taken_each_side_for_itself(case, tmp_path):
    measured = read_person(written(case, tmp_path))
    options = case[2]
    human = human_gait(options.get("speed", 1.3))
    for side, share in (("left", 1.0), ("right", RIGHT_SHARE)):
        leg = measured.legs[side]
        knee = leg.counted("knee").mean(axis=0)
        # Events found in angles alone are a percent or two of the stride off.
        assert np.degrees(np.abs(knee - share * human.mean("knee", PHASE))).mean() < 2.0
        assert np.ptp(knee) == pytest.approx(share * np.ptp(human.mean("knee", PHASE)), rel=0.05)
        assert ("ankle_moment" in leg.curves) == options.get("kinetic", True)
        if "ankle_moment" in leg.curves:
            assert np.abs(leg.counted("ankle_moment")).mean(axis=0).max() == pytest.approx(
                share * human.mean("ankle_moment", PHASE).max(), rel=0.06
            )
        assert ("toe" in leg.curves) == (case[1] not in (None, "OpenCap"))
    told = " ".join(measured.notes)
    assert ("right toe left out: it is 0 throughout" in told) == (case[1] == "OpenCap")
    assert ("does not say inDegrees" in told) == (options.get("says") == "")
    if case[1] and options.get("kinetic", True):
        assert measured.mass == pytest.approx(MASS, rel=0.06) and measured.mass_from.startswith("from the forces")


def times(**factors):
    return {"wrong": factors}


FLIPPED = times(ankle_angle=-1.0, ankle_angle_r_moment=-1.0, ankle_angle_l_moment=-1.0)
BODY_WEIGHTS = times(vy=1 / MASS / GRAVITY, vx=1 / MASS / GRAVITY)
OF_OPENSIM = {
    "degrees as radians": ({"says": "no"}, "degrees or radians?"),
    "radians as degrees": ({"degrees": False, "says": "yes"}, "radians?"),
    "forces in body weights": (BODY_WEIGHTS, "in body weights, not in N?"),
    "forces in N/kg": (times(vy=1 / MASS, vx=1 / MASS), "in N/kg, not in N?"),
    "forces in kN": (times(vy=1e-3, vx=1e-3), "in kN, not in N?"),
    "moments in N mm": (times(_moment=1e3), "_moment goes from"),
    "moments per kg": (times(_moment=1 / MASS), "times as far as people's: N m/kg where N m must be?"),
    "a flipped ankle": (FLIPPED, "opposite"),
}
WRONG = {
    **{f"{form}: {name}": (opensim, form, *case) for form in FORCE_NAMES for name, case in OF_OPENSIM.items()},
    "one knee flipped": (opensim, "gait2392", times(knee_angle_r_moment=-1.0), "knee_angle_r_moment is opposite"),
    "flipped hips": (opensim, "Rajagopal", times(hip_flexion_r=-1.0, hip_flexion_l=-1.0), "behind at heel strike"),
    "the pelvis in mm": (opensim, "OpenCap", times(pelvis_tx=1e3), "speed, of pelvis_tx, must be in [0.1, 4] m/s, got"),
    "the pelvis in cm": (opensim, "OpenCap", times(pelvis_tx=1e2), ", got 130: cm/s?"),
    "forces downward": (opensim, "AddBiomechanics", times(vy=-1.0), "up must be positive"),
    "Visual3D: radians": (visual3d, None, {"angle": np.pi / 180}, "radians?"),
    "Visual3D: moments in N m": (visual3d, None, {"moment": MASS}, "N m, not per kg?"),
    "Visual3D: mean curves in radians": (visual3d, None, {"angle": np.pi / 180, "rows": 101}, "radians?"),
    "Nexus: radians": (nexus, None, {"angle": np.pi / 180}, "radians?"),
    "Plug-in Gait: radians": (plug_in_gait, None, {"angle": np.pi / 180}, "radians?"),
    "Plug-in Gait: moments in N mm": (plug_in_gait, None, {"moment": MASS}, "N m, not per kg?"),
}


@pytest.mark.parametrize("case", WRONG.values(), ids=WRONG)
def test_wrong_units_and_signs_are_refused_with_a_guess(case, tmp_path):
    *maker, guess = case
    with pytest.raises(SpringfootError) as caught:
        read_person(written(maker, tmp_path))
    assert guess in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("unit", [1e3, 1e2], ids=["ms", "frames"])
def test_times_in_ms_or_frames_are_refused_with_a_guess(unit, tmp_path):
    files = opensim("Rajagopal", tmp_path, kinetic=False)
    lines = files[0].read_text(encoding="utf-8").splitlines()
    begin = lines.index("endheader") + 2
    rows = [line.split("\t", 1) for line in lines[begin:]]
    scaled = [f"{unit * float(time):.6g}\t{rest}" for time, rest in rows]
    files[0].write_text("\n".join([*lines[:begin], *scaled]) + "\n", encoding="utf-8")
    every = unit / 100
    with pytest.raises(SpringfootError, match=f"has one every {every:g} s: time in ms, or frames\\?$"):
        read_person(files)


@pytest.mark.parametrize(("height", "unit"), [(950.0, "mm"), (95.0, "cm")])
def test_a_pelvis_in_mm_or_cm_is_refused_with_a_guess(height, unit, tmp_path):
    columns = {"time": 0.01 * np.arange(9), "hip_flexion_r": np.arange(9), "pelvis_ty": np.full(9, height)}
    path = write(tmp_path / "ik.mot", columns, ["inDegrees=yes", "endheader"])
    with pytest.raises(
        SpringfootError, match=f"ik.mot: pelvis_ty is {height:g} in the median, must be in m: {unit}\\?$"
    ):
        read_person([path])


def test_a_column_is_named_as_the_user_named_it(tmp_path):
    files = opensim("Rajagopal", tmp_path, wrong={"ankle_angle_r_moment": 1 / MASS})
    files[2].write_text(files[2].read_text().replace("ankle_angle_r_moment", "Ankle R"))
    with pytest.raises(SpringfootError, match=r"the right leg: Ankle R goes from .* N m/kg where N m must be\?"):
        read_person(files, columns={"ankle_angle_r_moment": "Ankle R"})


def test_plates_of_nexus_weigh_the_body_and_its_events_mark_the_strides_without_them(tmp_path):
    weighed = read_person(nexus(tmp_path))
    assert weighed.mass == pytest.approx(MASS, rel=0.06) and weighed.mass_from.startswith("from the forces")
    marked = read_person(nexus(tmp_path, plates=False))
    assert marked.mass is None
    for side in ("left", "right"):
        np.testing.assert_allclose(marked.legs[side].times[:, [0, 2]], weighed.legs[side].times[:, [0, 2]], atol=0.02)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("\nModel Outputs\n100\n", "\nModel Outputs\n0\n", "column rate: must be above 0, got 0"),
        ("Frame,Sub Frame,X", "Time,Sub Frame,X", "must begin with Frame,Sub Frame"),
        ("\n7,0,", "\n9,0,", "column Frame: 8 must be greater than 9 in the row before"),
        (",Context,", ",Side,", "no column Context in the events"),
        ("LKneeAngles", "LHipAngles", "column LHipAngles X stands twice"),
        ("\nTrajectories\n100", "\nTrajectories\n200", "must be of one trial"),
        ("\nTrajectories\n", "\nModel Outputs\n", "has two sections Model Outputs"),
    ],
)
def test_a_damaged_export_of_nexus_is_refused_by_line(old, new, words, tmp_path):
    path = nexus(tmp_path, plates=False)[0]
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(SpringfootError, match=words):
        read_person([path])


@pytest.mark.parametrize("lost", [(0, 1), (1000, 0)], ids=["the last sample", "the first second"])
def test_forces_of_nexus_keep_their_time_where_samples_are_missing(lost, tmp_path):
    whole = read_person(nexus(tmp_path)).legs["left"]
    path = nexus(tmp_path)[0]
    lines = path.read_text().splitlines()
    begin = lines.index("Devices") + 5
    end = lines.index("", begin)
    path.write_text("\n".join([*lines[:begin], *lines[begin + lost[0] : end - lost[1]], *lines[end:]]) + "\n")
    cut = read_person([path], trust_units=True).legs["left"]
    shared = [np.abs(whole.times[:, 0] - strike).min() for strike in cut.times[1:-1, 0]]
    assert len(shared) and max(shared) < 1e-3


def test_units_of_nexus_are_those_that_it_names(tmp_path):
    path = nexus(tmp_path)[0]
    whole = read_person([path]).legs["left"]
    lines = path.read_text().splitlines()
    begin = lines.index("Devices") + 4
    end = lines.index("", begin)
    assert lines[begin] == ",,N,N,N,mm,mm,mm,N,N,N,mm,mm,mm"
    rows = [line.split(",") for line in lines[begin + 1 : end]]
    units = lines[begin].split(",")
    metres = [
        [f"{float(cell) / 1000:.8g}" if unit == "mm" else cell for unit, cell in zip(units, row, strict=True)]
        for row in rows
    ]
    text = [*lines[:begin], lines[begin].replace("mm", "m"), *map(",".join, metres), *lines[end:]]
    path.write_text("\n".join(text) + "\n")
    np.testing.assert_allclose(read_person([path]).legs["left"].times, whole.times, atol=1e-6)
    path.write_text("\n".join([*lines[:begin], lines[begin].replace("N", "lbf"), *lines[begin + 1 :]]) + "\n")
    with pytest.raises(SpringfootError, match=r"Fx: unit must be one of n, kn, got lbf"):
        read_person([path])


def test_there_are_as_many_right_and_wrong_files_as_were_asked_for():
    assert len(RIGHT) >= 40 and len(WRONG) >= 25


def test_forces_of_the_other_foot_are_noticed(tmp_path):
    files = opensim("OpenCap", tmp_path)
    text = files[1].read_text()
    files[1].write_text(
        text.replace("force_right", "force_r0").replace("force_left", "force_right").replace("force_r0", "force_left")
    )
    with pytest.raises(SpringfootError, match=r"interchanged|other foot"):
        read_person(files)


def test_other_names_of_columns_are_named(tmp_path):
    files = opensim("Rajagopal", tmp_path)
    files[0].write_text(files[0].read_text().replace("knee_angle_r", "Knee R"))
    named = read_person(files, columns={"knee_angle_r": "Knee R"})
    assert "knee" in named.legs["right"].curves
    for columns, words in (
        ({"knee_angle_r": "Knee Q"}, "no column 'Knee Q' in a text file; there are time, pelvis_tilt"),
        ({"knee_angel_r": "Knee R"}, "'knee_angel_r' is no column that is read here; perhaps knee_angle_r"),
    ):
        with pytest.raises(SpringfootError, match=words):
            read_person(files, columns=columns)


def test_a_grid_of_two_percent_gives_the_curves_between(tmp_path):
    human, percent = human_gait(1.3), np.arange(0, 101, 2)
    columns = {"percent": percent, "toe_off_percent": np.full(51, 100 * human.toe_off)}
    for name in ("knee", "ankle", "ankle_moment", "grf_vertical"):
        unit = 180 / np.pi if COLUMNS[name].endswith("_deg") else 1.0
        columns[COLUMNS[name]] = unit * human.mean(name, percent / 100)
    gait = read_gait(write(tmp_path / "grid.csv", columns, separator=",")).gait(1.3, 1.7)
    assert np.degrees(np.abs(gait.mean("knee", PHASE) - human.mean("knee", PHASE))).max() < 0.5
    assert np.abs(gait.mean("ankle_moment", PHASE) - human.mean("ankle_moment", PHASE)).max() < 0.02


@pytest.mark.parametrize("speed", [0.9, 1.3, 1.7])
def test_a_grid_of_two_percent_has_the_quasi_stiffness_of_a_full_one(speed, tmp_path):
    human = human_gait(speed)
    slopes = []
    for percent in (np.arange(0, 101, 2), np.arange(101)):
        columns = {"percent": percent, "toe_off_percent": np.full(len(percent), 100 * human.toe_off)}
        columns |= {COLUMNS[name]: human.mean(name, percent / 100) for name in ("ankle", "ankle_moment")}
        columns[COLUMNS["ankle"]] = np.degrees(columns[COLUMNS["ankle"]])
        measured = read_person([write(tmp_path / f"{len(percent)}.csv", columns, separator=",")])
        angle, moment = (measured.legs[""].curves[name] for name in ("ankle", "ankle_moment"))
        phases = stance_phases("ankle", angle[0], human.toe_off)
        slopes.append([slope.value for phase in phases if (slope := phase_slope(angle, moment, phase))])
        (told,) = (note for note in measured.notes if "controlled plantarflexion" in note)
        assert ("every 2 % of the stride" in told) == (len(percent) == 51)
    np.testing.assert_allclose(*slopes, rtol=0.02)


def test_moments_alone_are_divided_by_the_mass_that_is_given(tmp_path):
    angles, _, moments = opensim("Rajagopal", tmp_path, wrong={"_moment": 1.8})  # a strong walk, beyond people's
    measured = read_person([angles, moments], mass=MASS)
    peak = measured.legs["left"].curves["ankle_moment"].mean(axis=0).max()
    assert peak == pytest.approx(1.8 * human_gait(1.3).mean("ankle_moment", PHASE).max(), rel=0.06)
    for factor, unit in ((1e3, "N mm"), (1 / MASS, "times as far as people's")):
        files = opensim("Rajagopal", tmp_path, wrong={"_moment": factor})
        with pytest.raises(SpringfootError, match=unit):
            read_person([files[0], files[2]], mass=MASS)


def shifted(path, delay):
    """Write the times of an OpenSim file later by `delay` [s]."""
    lines = path.read_text(encoding="utf-8").splitlines()
    begin = lines.index("endheader") + 2
    rows = [line.split("\t", 1) for line in lines[begin:]]
    later = [f"{float(time) + delay:.6g}\t{rest}" for time, rest in rows]
    path.write_text("\n".join([*lines[:begin], *later]) + "\n", encoding="utf-8")


@pytest.mark.parametrize("delay", [-0.1, 0.0, 0.1])
def test_forces_of_another_clock_than_the_angles_are_told(delay, tmp_path):
    files = opensim("Rajagopal", tmp_path)
    shifted(files[1], delay)
    told = [note for note in read_person(files).notes if "one clock" in note]
    # The forces are late for the motion, and so the moments early for the forces.
    of_motion = [note for note in told if "than the legs' motion" in note]
    of_moments = [note for note in told if "than its force" in note]
    assert [len(of_motion), len(of_moments)] == ([1, 2] if delay else [0, 0]) and len(told) == 3 * bool(delay)
    assert all(("later" if delay > 0 else "earlier") in note for note in of_motion)
    assert all(("earlier" if delay > 0 else "later") in note for note in of_moments)


@pytest.mark.parametrize("delay", [-0.08, 0.08])
def test_moments_of_another_clock_than_the_forces_are_told(delay, tmp_path):
    files = opensim("Rajagopal", tmp_path)
    shifted(files[2], delay)
    told = [note for note in read_person(files, trust_units=True).notes if "one clock" in note]
    assert len(told) == 2 and all(f"{'later' if delay > 0 else 'earlier'} than its force" in note for note in told)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"mtp_angle_r": -1.0, "mtp_angle_l": -1.0}, "toe-up must be positive"),
        ({"mtp_angle_r_moment": -1.0}, "the right leg: the toe's moment is largest below 0"),
        ({"mtp_angle_l_moment": 1e-3}, "the left leg: the toe's moment reaches .* another unit"),
    ],
)
def test_a_toe_that_moves_as_none_does_is_refused(change, words, tmp_path):
    with pytest.raises(SpringfootError, match=words):
        read_person(with_toe_moments(opensim("Rajagopal", tmp_path), change))


def with_toe_moments(files, change):
    """Give files of OpenSim a toe's moment, a fifth of the ankle's; `change` is column -> its factor."""
    for path in (files[0], files[2]):
        lines = path.read_text().splitlines()
        begin = lines.index("endheader") + 1
        names = lines[begin].split("\t")
        rows = [dict(zip(names, map(float, line.split("\t")), strict=True)) for line in lines[begin + 1 :]]
        for row in rows:
            for side in "lr":
                if f"ankle_angle_{side}_moment" in row:
                    row[f"mtp_angle_{side}_moment"] = 0.2 * row[f"ankle_angle_{side}_moment"]
            row.update({name: factor * row[name] for name, factor in change.items() if name in row})
        text = ["\t".join(names), *("\t".join(f"{row[name]:.6g}" for name in names) for row in rows)]
        path.write_text("\n".join([*lines[:begin], *text]) + "\n")
    return files


def test_toes_that_change_places_are_refused(tmp_path):
    for number in (0, 2):
        files = with_toe_moments(opensim("Rajagopal", tmp_path), {})
        text = files[number].read_text()
        for old, new in (("mtp_angle_r", "mtp_0"), ("mtp_angle_l", "mtp_angle_r"), ("mtp_0", "mtp_angle_l")):
            text = text.replace(old, new)
        files[number].write_text(text)
        with pytest.raises(SpringfootError, match="of the other foot"):
            read_person(files)


def test_a_leg_that_is_a_copy_of_the_other_is_refused(tmp_path):
    files = opensim("Rajagopal", tmp_path, kinetic=False)
    lines = files[0].read_text().splitlines()
    begin = lines.index("endheader") + 1
    names = lines[begin].split("\t")
    twice = [names.index(name[:-2] + "_l" if name.endswith("_r") else name) for name in names]
    rows = [line.split("\t") for line in lines[begin + 1 :]]
    text = [*lines[: begin + 1], *("\t".join(row[index] for index in twice) for row in rows)]
    files[0].write_text("\n".join(text) + "\n")
    with pytest.raises(SpringfootError, match="both feet strike at once: is one leg a copy of the other"):
        read_person(files)


def test_a_file_with_fewer_rows_than_it_says_is_told(tmp_path):
    files = opensim("Rajagopal", tmp_path)
    files[2].write_text(files[2].read_text().replace("nRows=500", "nRows=900"))
    told = [note for note in read_person(files).notes if "cut short" in note]
    assert told == ["id.sto says that it has 900 rows, and has 500: was it cut short?"]


def test_each_leg_has_its_own_toe_off_in_mean_curves(tmp_path):
    human = human_gait(1.3)
    columns = {"percent": np.arange(101)}
    for side, off in (("left", 0.55), ("right", 0.7)):
        stretched = np.minimum(PHASE * human.toe_off / off, 1.0)
        columns |= {f"{COLUMNS[name]}_{side}": human.mean(name, stretched) for name in ("ankle", "ankle_moment")}
        columns[f"{COLUMNS['ankle']}_{side}"] = np.degrees(columns[f"{COLUMNS['ankle']}_{side}"])
        force = human.mean("grf_vertical", stretched)
        columns[f"{COLUMNS['grf_vertical']}_{side}"] = force * (off > PHASE)
    measured = read_person([write(tmp_path / "mean.csv", columns, separator=",")], trust_units=True)
    assert [measured.toe_off(side) for side in ("left", "right")] == pytest.approx([0.55, 0.7], abs=0.015)
    columns |= {"toe_off_percent_left": np.full(101, 57.0)}
    measured = read_person([write(tmp_path / "mean.csv", columns, separator=",")], trust_units=True)
    assert measured.toe_off("left") == 0.57
    columns |= {"toe_off_percent_left": np.full(101, 0.3)}
    with pytest.raises(SpringfootError, match=r"toe_off_percent_left must be in \[0.3, 0.9\] of the stride, got 0.003"):
        read_person([write(tmp_path / "mean.csv", columns, separator=",")])


def test_strides_off_the_force_plate_count_for_angles_alone(tmp_path):
    files = opensim("Rajagopal", tmp_path)
    lines = files[1].read_text().splitlines()
    # Without force after 3 s: inverse dynamics there means nothing.
    cut = [
        line if k < 303 or not line[:1].isdigit() else "\t".join([line.split("\t")[0], *["0"] * 6])
        for k, line in enumerate(lines)
    ]
    files[1].write_text("\n".join(cut) + "\n")
    leg = read_person(files).legs["left"]
    assert len(leg.counted("ankle_moment")) == leg.weighed.sum() == len(leg.counted("grf_vertical"))


@pytest.mark.parametrize("end", [0.3, 0.48, 0.55])
def test_a_plate_that_ends_under_the_foot_weighs_no_stride(end, tmp_path):
    files = opensim("Rajagopal", tmp_path)
    lines = files[1].read_text().splitlines()
    whole = read_person(files).legs["left"]
    strike, _, following = whole.times[1]
    off = strike + end * (following - strike)
    begin = lines.index("endheader") + 2
    for k in range(begin, len(lines)):
        cells = lines[k].split("\t")
        if off <= float(cells[0]) < following - 0.05:
            lines[k] = "\t".join([cells[0], *["0"] * (len(cells) - 1)])
    files[1].write_text("\n".join(lines) + "\n")
    cut = read_person(files).legs["left"]
    assert whole.weighed.all() and not cut.weighed[1] and cut.weighed[2:].all()


def smoothed(values, cutoff=6.0):
    """Columns after a low-pass without delay, as laboratories filter forces."""
    return sosfiltfilt(butter(2, cutoff, fs=100.0, output="sos"), values, axis=0)


def half_off(columns, stance):
    """Seven tenths of the force: the rest of the foot is beside the plate."""
    return np.where(stance[:, None] < 1.0, 0.7 * columns, columns)


def cut_short(columns, stance):
    """A plate that ends under the foot at 48 % of the stride, and a filter that hides the edge."""
    return np.where(stance[:, None] < 0.95, smoothed(np.where(stance[:, None] > 0.48, 0.0, columns)), columns)


def damaged(files, side, strides, damage):
    """Change force and moments of a side in some strides (S, 3) as `damage` does, and write the files again."""
    for path in files[1:]:
        lines = path.read_text(encoding="utf-8").splitlines()
        begin = lines.index("endheader") + 1
        names = lines[begin].split("\t")
        rows = np.array([line.split("\t") for line in lines[begin + 1 :]], float)
        own = [k for k, name in enumerate(names) if f"calcn_{side}_v" in name or name.endswith(f"_{side}_moment")]
        for strike, _, following in strides:
            stance = (rows[:, 0] - strike + 1e-9) / (following - strike)
            rows[:, own] = np.where(
                stance[:, None] >= 0.0, damage(rows[:, own], np.where(stance < 0.0, 9.0, stance)), rows[:, own]
            )
        text = ["\t".join(f"{value:.6g}" for value in row) for row in rows]
        path.write_text("\n".join([*lines[: begin + 1], *text]) + "\n", encoding="utf-8")
    return files


def slopes(measured, side, strides):
    """Quasi-stiffness of the ankle in the phases of stance, from some of the strides."""
    leg = measured.legs[side]
    angle, moment = (leg.curves[name][strides] for name in ("ankle", "ankle_moment"))
    phases = stance_phases("ankle", angle.mean(axis=0), measured.toe_off(side))
    return [slope.value for phase in phases if (slope := phase_slope(angle, measured.mass * moment, phase))]


@pytest.mark.parametrize("damage", [half_off, cut_short])
@pytest.mark.parametrize("side", ["left", "right"])
def test_strides_in_which_a_plate_loses_force_are_left_out_and_told(side, damage, tmp_path):
    files = opensim("AddBiomechanics", tmp_path)
    whole = read_person(files)
    assert all(leg.weighed.all() and not leg.partly.any() for leg in whole.legs.values())
    strides = whole.legs[side].times
    cut = read_person(damaged(files, side[0], strides[1:2], damage))
    leg = cut.legs[side]
    assert leg.partly[1] and not leg.weighed[1] and leg.weighed[2:].any()
    assert leg.times[1, 1] == pytest.approx(strides[1, 1], abs=0.03)  # toe-off by the motion, not by what is left
    assert cut.mass == pytest.approx(whole.mass, rel=0.01)
    assert cut.toe_off(side) == pytest.approx(whole.toe_off(side), abs=0.01)
    # In controlled plantarflexion the slope is near 0: 2 N m/rad are its noise.
    np.testing.assert_allclose(slopes(cut, side, leg.weighed), slopes(whole, side, leg.weighed), rtol=0.02, atol=2.0)
    (told,) = (note for note in cut.notes if "off its plate" in note)
    assert told.startswith("Forces and moments of ") and f"{leg.partly.sum()} {side}" in told


@pytest.mark.parametrize("damage", [half_off, cut_short])
def test_a_plate_that_loses_force_in_every_stride_tells_no_stiffness(damage, tmp_path):
    files = opensim("AddBiomechanics", tmp_path)
    strides = read_person(files).legs["left"].times
    leg = read_person(damaged(files, "l", strides, damage)).legs["left"]
    assert leg.partly[:-1].all() and leg.weighed[:-1].sum() == 0
    trusted = read_person(files, trust_units=True).legs["left"]
    assert trusted.weighed.all() and not trusted.partly.any()


@pytest.mark.parametrize("speed", [0.9, 1.3, 1.7])
def test_smoothed_forces_are_told(speed, tmp_path):
    files = opensim("AddBiomechanics", tmp_path, speed=speed)
    assert not any("smoothed" in note for note in read_person(files).notes)
    lines = files[1].read_text(encoding="utf-8").splitlines()
    begin = lines.index("endheader") + 2
    rows = np.array([line.split("\t") for line in lines[begin:]], float)
    rows[:, 1:] = smoothed(rows[:, 1:])
    text = ["\t".join(f"{value:.6g}" for value in row) for row in rows]
    files[1].write_text("\n".join([*lines[:begin], *text]) + "\n", encoding="utf-8")
    (told,) = (note for note in read_person(files).notes if "smoothed" in note)
    assert " % left and " in told and "of people's rate" in told


def test_the_mass_of_one_plate_is_told(tmp_path):
    files = opensim("AddBiomechanics", tmp_path)
    files[1].write_text(files[1].read_text().replace("calcn_r_v", "other_v"), encoding="utf-8")
    measured = read_person(files)
    assert measured.mass == pytest.approx(MASS, rel=0.06)
    assert any("the force of the left foot alone" in note for note in measured.notes)
    assert not any("foot alone" in note for note in read_person(files, mass=MASS).notes)


def test_the_mass_that_was_given_and_the_one_the_forces_bear(tmp_path):
    files = opensim("Rajagopal", tmp_path)
    measured = read_person(files, mass=90.0)
    assert measured.mass == 90.0 and any("The forces bear 7" in note and "not 90" in note for note in measured.notes)
    # Feet are whole on their plates against the weight that both bear, whatever the mass given.
    assert all(leg.weighed.all() for leg in read_person(files, mass=140.0).legs.values())
    alone = read_person([tmp_path / "ik.mot", tmp_path / "id.sto"])
    assert alone.mass is None and any("--mass" in note for note in alone.notes)
    assert not any("too little for N m" in note for note in alone.notes)
    weighed = read_person([tmp_path / "ik.mot", tmp_path / "id.sto"], mass=MASS)
    assert "ankle_moment" in weighed.legs["left"].curves and FORCES[0] not in weighed.legs["left"].curves


def test_moments_too_small_for_newton_metres_are_told(tmp_path):
    angles, _, moments = opensim("Rajagopal", tmp_path, wrong={"_moment": 1 / MASS})
    told = read_person([angles, moments]).notes[-1]
    assert told.startswith("The largest of ankle_angle_l_moment and ankle_angle_r_moment is 1.")
    assert told.endswith("too little for N m: in N m/kg?")


def test_one_side_of_an_uneven_walk_is_divided_by_the_mass_that_both_feet_bear(tmp_path):
    limping = opensim("gait2392", tmp_path, wrong={"1_ground_force_vy": 0.9, "ground_force_vy": 1.0})
    both = read_person(limping)
    for side in ("left", "right"):
        assert read_person(limping, side=side).mass == both.mass
    left, right = (both.legs[side].counted("grf_vertical")[:, :-1].mean() for side in ("left", "right"))
    assert left + right == pytest.approx(1.0, abs=1e-12) and left < 0.95 * right
