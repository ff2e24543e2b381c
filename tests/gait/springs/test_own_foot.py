"""A foot of one's own: a torque-angle table as a passive foot, a stiffness schedule as an adaptive one."""

import json
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import tyro
from walked_ticks import walked_ticks

from springfoot.cli.evaluate import evaluate_main
from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.batch.step_result import Tick
from springfoot.envs.control.stiffness_control import FEET
from springfoot.envs.physics.model import ANKLE
from springfoot.envs.settings.feet import MOST_POINTS
from springfoot.envs.settings.settings import settings_from, settings_to_json
from springfoot.errors import SpringfootError
from springfoot.evaluation.report.schedule_tables import states_json, table_of_states
from springfoot.gait.body.body import Body
from springfoot.gait.springs.foot_file import read_foot
from springfoot.gait.springs.stiffness import StiffnessSchedule
from springfoot.studies.base.flags import SettingsFlags, given

RIGHT = 1
LINE = [[-20.0, 90.0], [-5.0, 30.0], [2.0, 0.0], [8.0, -60.0], [20.0, -300.0]]
"""Stiffer the further it is bent."""
TABLE = {"kind": "passive", "ankle_table": LINE, "toe_stiffness": 30.0, "toe_deg": 5.0}
SPRINGS = StiffnessSchedule.from_json(
    {"ankle": [[0.0, 200.0, 0.05], [0.3, 500.0, 0.0], [0.65, 40.0, 0.02]], "toe": [[0.1, 50.0, 0.0], [0.6, 8.0, 0.1]]}
)
SCHEDULE = {"kind": "adaptive", "schedule": SPRINGS.to_json()}


def walk(biped: Biped, steps: int = 50, action: float = 0.3) -> list[Tick]:
    """The ticks in which everybody walks."""
    return [tick for tick in walked_ticks(biped, steps, action) if tick.active.all()]


def test_a_torque_angle_table_gives_its_torque_at_the_angle_each_window_begins_with():
    ticks = walk(Biped(settings_from(mass=80, right_foot=TABLE), 3))
    degrees, torque = np.array(LINE).T
    seen = set()
    for before, tick in pairwise(ticks):
        angle = before.measurement.angle[:, RIGHT, ANKLE]
        given = tick.stiffness[:, RIGHT, ANKLE] * (tick.equilibrium[:, RIGHT, ANKLE] - angle)
        np.testing.assert_allclose(given, np.interp(np.degrees(angle), degrees, torque), atol=1e-6)
        slopes = -np.diff(torque) / np.diff(np.radians(degrees))
        index = np.clip(np.searchsorted(np.radians(degrees), angle, side="right") - 1, 0, len(slopes) - 1)
        np.testing.assert_allclose(tick.stiffness[:, RIGHT, ANKLE], slopes[index])
        seen.update(index.tolist())
    assert len(seen) >= 3 and len(ticks) > 60


def test_a_table_of_one_straight_line_is_that_spring():
    spring = {"kind": "passive", "ankle_stiffness": 400.0, "ankle_deg": 4.0, "toe_stiffness": 30.0, "toe_deg": 5.0}
    straight = {
        f"{joint}_table": [[at, k * np.radians(rest - at)] for at in (-20.0, 3.0, 30.0)]
        for joint, k, rest in (("ankle", 400.0, 4.0), ("toe", 30.0, 5.0))
    }
    ours, its = (walk(Biped(settings_from(right_foot=foot), 1)) for foot in (spring, {"kind": "passive"} | straight))
    for mine, other in zip(ours[:60], its[:60], strict=True):
        np.testing.assert_allclose(mine.measurement.angle, other.measurement.angle, atol=1e-5)
        np.testing.assert_allclose(mine.stiffness[:, RIGHT, FEET], other.stiffness[:, RIGHT, FEET], rtol=1e-9)


def test_a_table_followed_in_windows_of_10_ms_gives_back_what_it_took_and_nothing_changes_it():
    foot = {"kind": "passive", "ankle_table": LINE}
    ticks = walk(Biped(settings_from(right_foot=foot), 4))
    angle, k, rest = (
        np.stack([values[:, RIGHT, ANKLE] for values in series])
        for series in zip(*((t.measurement.angle, t.stiffness, t.equilibrium) for t in ticks), strict=True)
    )
    degrees, torque = np.array(LINE).T
    degrees, torque = np.append(degrees, 50.0), np.append(torque, -900.0)  # beyond its ends it goes on straight
    degrees, torque = np.insert(degrees, 0, -50.0), np.insert(torque, 0, 210.0)
    fine = np.radians(np.linspace(-50, 50, 10_001))
    curve = np.interp(np.degrees(fine), degrees, torque)
    held = -np.concatenate([[0.0], np.cumsum(0.5 * (curve[1:] + curve[:-1]) * np.diff(fine))])
    energy = np.interp(angle, fine, held)
    by_windows = 0.5 * k[1:] * ((rest[1:] - angle[:-1]) ** 2 - (rest[1:] - angle[1:]) ** 2)
    turned_over = np.abs(by_windows).sum(0)
    assert turned_over.min() > 3.0
    np.testing.assert_allclose(by_windows.sum(0), energy[0] - energy[-1], atol=0.05 * turned_over.max())
    done = np.stack([tick.work.work[:, RIGHT, ANKLE].sum(-1) for tick in ticks])[1:].sum(0)
    assert (done < energy[0] - energy[-1]).all()  # damped, it gives back less
    both = walk(Biped(settings_from(left_foot=foot, right_foot=foot), 1), 20)
    for change in ("equilibrium_changes", "stiffness_changes"):
        assert not np.stack([tick.work.energy[change][:, ANKLE] for tick in both]).any()


def test_an_adaptive_foot_follows_its_schedule_whatever_is_asked():
    for action in (-0.5, 0.5):
        biped = Biped(settings_from(right_foot=SCHEDULE), 3)
        assert biped.controlled.tolist() == [[[True, True], [False, False]]] * 3
        for tick in walk(biped, 40, action):
            stiffness, rest = SPRINGS.at(tick.phase[:, RIGHT])
            corner = (np.abs(tick.phase[:, RIGHT, None] - [0.1, 0.3, 0.6, 0.65]) < 0.002).any(-1)  # a sample's ramp
            corner |= tick.phase[:, RIGHT] > 0.998
            np.testing.assert_allclose(tick.stiffness[~corner, RIGHT, FEET], stiffness[~corner])
            np.testing.assert_allclose(tick.equilibrium[~corner, RIGHT, FEET], rest[~corner], atol=1e-12)


@pytest.mark.parametrize("foot", [TABLE, SCHEDULE], ids=["table", "schedule"])
def test_beside_other_feet_it_is_as_alone_bit_for_bit(foot):
    other = {"kind": "passive", "ankle_table": [[-10.0, 50.0], [10.0, -50.0]]}
    later = {"kind": "adaptive", "schedule": {"ankle": [[0.0, 90.0, 0.1]], "toe": [[0.0, 9.0, 0.1]]}}
    pairs = [
        settings_from(left_foot=other, right_foot=later).feet,
        settings_from(right_foot=foot).feet,
        settings_from(left_foot="rigid", right_foot="drop").feet,
    ]
    together, alone = Biped(settings_from(), 3, feet=pairs), Biped(settings_from(right_foot=foot), 1)
    together.reset(np.arange(3), [4, 5, 6])
    alone.reset(np.arange(1), [5])
    for _ in range(25):
        ours = together.step(np.full((3, 4), 0.2))
        its = alone.step(np.full((1, 4), 0.2))
        assert ours.observation[1].tobytes() == its.observation[0].tobytes()
        assert ours.values[1].tobytes() == its.values[0].tobytes()


def test_a_csv_is_a_passive_foot_and_a_json_schedule_an_adaptive_one(tmp_path):
    rows = ["ankle_deg,ankle_torque_Nm", *(f"{angle},{torque}" for angle, torque in LINE)]
    (tmp_path / "foot.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    (tmp_path / "springs.json").write_text(json.dumps(SPRINGS.to_json()), encoding="utf-8")
    (tmp_path / "drop.json").write_text('{"kind": "drop"}', encoding="utf-8")
    table, schedule, drop = (read_foot(tmp_path / name) for name in ("foot.csv", "springs.json", "drop.json"))
    assert table == {"kind": "passive", "ankle_table": LINE} and schedule == SCHEDULE and drop == {"kind": "drop"}
    for name, foot in (("foot.csv", table), ("springs.json", schedule)):
        assert given(tyro.cli(SettingsFlags, args=["--right-foot", str(tmp_path / name)])) == {"right_foot": foot}
        settings = settings_from(right_foot=foot)
        assert settings_from(**json.loads(json.dumps(settings_to_json(settings)))) == settings


def test_finite_states_of_an_evaluation_are_an_adaptive_foot_with_their_springs(tmp_path):
    states = [
        {"phase": 0.0, "ankle": spring(200.0, 3.0), "toe": spring(50.0, 0.0)},
        {"phase": 0.65, "ankle": spring(40.0, -2.0), "toe": spring(8.0, 5.0)},
    ]
    file = tmp_path / "finite_states.json"
    file.write_text(states_json(table_of_states("mine", Body(height=1.8, mass=80.0), 1.2, states)), encoding="utf-8")
    foot = read_foot(file)
    springs = settings_from(left_foot=foot).left_foot.foot.schedule
    assert foot["kind"] == "adaptive" and springs is not None
    stiffness, rest = springs.at(np.array([0.3, 0.9]))
    np.testing.assert_allclose(stiffness, [[200.0, 50.0], [40.0, 8.0]])  # a device's K is that of no other body
    np.testing.assert_allclose(np.degrees(rest), [[3.0, 0.0], [-2.0, 5.0]])


def spring(stiffness: float, rest_deg: float) -> dict[str, float]:
    return {"stiffness_Nm_per_rad": stiffness, "damping_time_s": 0.0206, "equilibrium_deg": rest_deg}


def foot(**numbers: Any) -> dict[str, Any]:
    return {"kind": "passive", **numbers}


@pytest.mark.parametrize("points", [2, MOST_POINTS])
def test_a_table_has_two_to_a_thousand_points(points):
    angles = np.linspace(-20.0, 30.0, points)
    table = [[float(angle), float(-4.0 * angle)] for angle in angles]
    assert settings_from(left_foot=foot(ankle_table=table)).left_foot.numbers["ankle_table"] == table


@pytest.mark.parametrize(
    ("wrong", "text"),
    [
        (foot(ankle_table=[]), "ankle_table must be a list of 2 to 1000 pairs [deg, N m], got []"),
        (foot(ankle_table=[[0, 1]]), "ankle_table must be a list of 2 to 1000 pairs [deg, N m], got [[0, 1]]"),
        (foot(ankle_table=[[0, -1]] * (MOST_POINTS + 1)), "ankle_table must be a list of 2 to 1000 pairs [deg, N m]"),
        (foot(ankle_table=[[0, 1], [1]]), "ankle_table must be a list of 2 to 1000 pairs [deg, N m]"),
        (foot(toe_table="line"), "toe_table must be a list of 2 to 1000 pairs [deg, N m], got 'line'"),
        (foot(ankle_table=[[0, 9], [0, 1]]), "ankle_table: angles must ascend, got 0 deg after 0 deg"),
        (foot(ankle_table=[[0, 9], [5, 9]]), "the torque must fall by 1 to 3000 N m/rad, got 0 between 0 and 5 deg"),
        (
            foot(ankle_table=[[0, 0], [5, 20]]),
            "must fall by 1 to 3000 N m/rad, got -229.2 between 0 and 5 deg; angle and torque are positive in "
            "dorsiflexion (toe up): a foot bent that way pushes back, below 0",
        ),
        (foot(ankle_table=[[0, 0], [0.1, -20]]), "must fall by 1 to 3000 N m/rad, got 1.146e+04"),
        (foot(ankle_table=[[0, 0], [99, -20]]), "ankle_table: angle must be in [-60, 90] deg, got 99"),
        (foot(ankle_table=[[0, "x"], [9, -20]]), "ankle_table: torque must be in [-1000, 1000] N m, got 'x'"),
        (foot(ankle_table=LINE, ankle_deg=3), "give ankle_table or ankle_deg, not both"),
        ({"kind": "adaptive", "schedule": {"ankle": []}}, "schedule: a stiffness schedule must be an object with keys"),
        (
            {"kind": "adaptive", "schedule": {"ankle": [[0, 3001, 0]], "toe": [[0, 60, 0]]}},
            "schedule: ankle K must be in [0, 3000] N m/rad, got 3001",
        ),
        (SCHEDULE | {"ankle_deg": 3}, "give schedule or ankle_deg, not both"),
        ({"kind": "rigid", "ankle_table": LINE}, "a foot of kind 'rigid' has no 'ankle_table'"),
    ],
)
def test_a_wrong_table_is_refused_in_one_line(wrong, text):
    with pytest.raises(SpringfootError) as caught:
        settings_from(left_foot=wrong)
    assert str(caught.value).startswith("left_foot: ") and text in str(caught.value)


@pytest.mark.parametrize(
    ("name", "content", "text"),
    [
        ("a.csv", "angle,torque\n0,1\n1,0\n", "line 1: needs ankle_deg and ankle_torque_Nm, toe_deg and"),
        ("a.csv", "ankle_deg,torque\n0,1\n1,0\n", "line 1: ankle_deg and ankle_torque_Nm go together"),
        ("a.csv", "ankle_deg,ankle_torque_Nm\n0,1\n0,0\n", "line 3, column ankle_deg: 0 must be greater than 0"),
        ("a.csv", "ankle_deg,ankle_torque_Nm\n0,1\n1,much\n", "line 3, column ankle_torque_Nm: must be a number"),
        ("a.csv", "ankle_deg,ankle_torque_Nm\n0,1\n1,5\n", "the torque must fall by 1 to 3000 N m/rad"),
        ("a.json", "[1, 2]", "is no foot (a JSON object, or a table in a file .csv): it must be an object in"),
        ("a.json", "{", "is not JSON, line 1, column 2: expecting property name enclosed in double quotes"),
        ("a.txt", "rigid", "is no foot (a JSON object, or a table in a file .csv): it is not JSON, line 1"),
        ("a.json", '{"ankle": [], "toe": []}', "a.json: ankle segments must ascend in phase"),
        ("a.json", '{"states": []}', "a.json: ankle segments must ascend in phase"),
        ("a.json", '{"states": [{"phase": 0}]}', "a.json is no table of finite states: an object with states"),
        ("a.json", '{"kind": "rigid", "kind": "drop"}', "it is not JSON, 'kind' stands twice in an object"),
        ("a.json", '{"foot": "rigid"}', "a.json is no foot: it must have a 'kind', or the schedule of an"),
    ],
)
def test_a_wrong_file_is_one_line_exit_code_2(name, content, text, tmp_path, capsys):
    (tmp_path / name).write_text(content, encoding="utf-8")
    out = tmp_path / "out"
    assert evaluate_main(["constant", "--right-foot", str(tmp_path / name), "--out", str(out)]) == 2
    error = capsys.readouterr().err
    assert text in error and len(error.strip().splitlines()) == 1 and not out.exists()
