"""All that is people's is in one file, and another file may take its place."""

import json
from copy import deepcopy

import numpy as np
import pytest

from benchmarks.scrambled import scrambled
from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.control.equilibrium import PLATEAUS, REFERENCE_STIFFNESS, foot_curves
from springfoot.envs.settings.settings import BipedSettings, reference_gait, settings_from
from springfoot.gait import SpringfootError, human_gait
from springfoot.gait.people.fit_human import SPRING_HABITS
from springfoot.gait.people.human import PEOPLE_FILE, foot_habits, human_cop


@pytest.fixture
def noise_file(tmp_path):
    path = tmp_path / "noise.json"
    path.write_text(json.dumps(scrambled()), encoding="utf-8")
    return path


def walked(settings):
    biped = Biped(settings, 2)
    biped.reset(np.arange(2), [0, 1])
    steps = [biped.step(np.zeros((2, 4))) for _ in range(20)]
    return np.stack([step.observation for step in steps]), np.stack([step.reward for step in steps])


def test_the_packages_own_file_by_its_name_gives_the_same_bits():
    for ours, theirs in zip(walked(BipedSettings()), walked(BipedSettings(people_file=str(PEOPLE_FILE))), strict=True):
        assert ours.tobytes() == theirs.tobytes()


def test_another_file_takes_peoples_place_everywhere(noise_file):
    noise, people = human_gait(1.2, people=noise_file), human_gait(1.2)
    assert (noise.step_length, noise.stride_time) == (people.step_length, people.stride_time)
    phase = np.linspace(0, 1, 50)
    for name in people.mean_series:
        assert not np.array_equal(noise.mean(name, phase), people.mean(name, phase)), name
    assert not np.array_equal(human_cop(phase, noise_file), human_cop(phase))
    assert noise.foot == foot_habits(noise_file) != people.foot
    settings = settings_from(people_file=str(noise_file))
    assert np.array_equal(reference_gait(settings).mean("knee", phase), noise.mean("knee", phase))
    (own,), (theirs,) = (Biped(each, 1).walks for each in (settings, BipedSettings()))
    for ours, packaged in zip(*(foot_curves(settings, walk.constants[0], walk) for walk in (own, theirs)), strict=True):
        assert not np.array_equal(ours, packaged)
    assert not np.array_equal(walked(settings)[1], walked(BipedSettings())[1])


def test_the_fit_writes_what_the_springs_take_of_people():
    assert json.loads(PEOPLE_FILE.read_text(encoding="utf-8"))["foot"] == SPRING_HABITS
    assert foot_habits().plateaus == PLATEAUS and foot_habits().ankle_quasi_stiffness == REFERENCE_STIFFNESS


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"mean": {}, "sd": {}}', '{"mean": 1, "sd": {}}'])
def test_a_file_of_another_kind_is_refused(tmp_path, text):
    path = tmp_path / "other.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(SpringfootError, match=r"other\.json must be a file of people's data as human_harmonics\.json"):
        BipedSettings(people_file=str(path))
    with pytest.raises(SpringfootError, match=r"missing\.json must be a file of people's data"):
        BipedSettings(people_file=str(tmp_path / "missing.json"))


def _at(table, path):
    for key in path[:-1]:
        table = table[key]
    return table, path[-1]


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), 1e200, -1e9, "1", None, [], True, 10**400])
@pytest.mark.parametrize(
    "path",
    [
        ("height_m",),
        ("conditions", 1, "speed_m_s"),
        ("conditions", 0, "stride_time_s"),
        ("conditions", 4, "step_length_m"),
        ("conditions", 2, "toe_off_percent"),
        ("mean", "knee", 3, 2, 1),
        ("mean", "grf_vertical", 0, 27),
        ("sd", "hip_moment", 1, 12),
        ("cop", "coefficients", 6),
        ("foot", "plateaus", 3),
        ("foot", "ankle_quasi_stiffness", 0),
        ("foot", "toe_flat", 1),
        ("foot", "toe_swing_deg"),
    ],
)
def test_a_number_that_no_person_has_is_refused_in_one_line(tmp_path, path, bad):
    table = json.loads(PEOPLE_FILE.read_text(encoding="utf-8"))
    holder, key = _at(table, path)
    holder[key] = bad
    file = tmp_path / "people.json"
    file.write_text(json.dumps(table), encoding="utf-8")
    with pytest.raises(SpringfootError, match=r"people\.json must be a file of people's data") as error:
        BipedSettings(people_file=str(file))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("path", [("height_m",), ("conditions",), ("mean", "toe"), ("sd", "grf_forward"), ("foot",)])
def test_a_part_that_is_missing_is_refused(tmp_path, path):
    table = json.loads(PEOPLE_FILE.read_text(encoding="utf-8"))
    holder, key = _at(table, path)
    del holder[key]
    file = tmp_path / "people.json"
    file.write_text(json.dumps(table), encoding="utf-8")
    with pytest.raises(SpringfootError, match=r"people\.json must be a file of people's data"):
        BipedSettings(people_file=str(file))


def test_conditions_and_phases_must_ascend(tmp_path):
    whole = json.loads(PEOPLE_FILE.read_text(encoding="utf-8"))
    swapped, alone, backward = deepcopy(whole), deepcopy(whole), deepcopy(whole)
    swapped["conditions"] = swapped["conditions"][::-1]
    alone["conditions"] = alone["conditions"][:1]
    backward["foot"]["toe_off"] = [0.7, 0.62]
    for table, said in (
        (swapped, "the speeds of the conditions must ascend"),
        (alone, "conditions must be a list of two or more"),
        (backward, "foot: the phases toe_off must ascend"),
    ):
        file = tmp_path / f"{len(said)}.json"
        file.write_text(json.dumps(table), encoding="utf-8")
        with pytest.raises(SpringfootError, match=said):
            BipedSettings(people_file=str(file))
