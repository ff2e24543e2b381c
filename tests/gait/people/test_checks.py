"""Own data with a wrong unit, sign or beginning are refused with a guess; people and bodies that walk are taken."""

from pathlib import Path

import numpy as np
import pytest
import tyro

from springfoot.cli.evaluate import EvaluateFlags
from springfoot.evaluation.numbers.metrics import measure
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import record
from springfoot.evaluation.report.report import write_gait_cycle
from springfoot.gait import GRAVITY, SpringfootError, human_gait
from springfoot.gait.people.human import COLUMNS
from springfoot.gait.people.own_data import read_gait
from springfoot.studies.base.flags import given, read_own_gait

PERCENT = np.arange(101)
MASS, HEIGHT = 82.0, 1.85
ANGLES = ("thigh", "hip", "knee", "ankle", "toe")
MOMENTS = ("hip_moment", "knee_moment", "ankle_moment")
POWERS = ("hip_power", "knee_power", "ankle_power")
FORCES = ("grf_vertical", "grf_forward")


def people(speed=1.2, seed=None):
    """Curves as they stand in a file, at percent 0 to 100; with a `seed` those of somebody a little different."""
    human, random = human_gait(speed), np.random.default_rng(seed)
    curves = {name: human.mean(name, PERCENT / 100) for name in COLUMNS}
    curves = {name: np.degrees(values) if name in ANGLES else values for name, values in curves.items()}
    if seed is not None:
        for name, values in curves.items():
            offset = random.uniform(-8, 8) if name in ANGLES else 0.0
            most = 0.1 if name in FORCES else 0.4  # everybody bears their own weight
            curves[name] = values * random.uniform(1 - most, 1 + most) + offset * (name != "knee")
    return curves


def file_of(path, curves):
    lines = [",".join(["percent", *(COLUMNS[name] for name in curves)])]
    lines += [",".join([str(k), *(f"{values[k]:.6g}" for values in curves.values())]) for k in PERCENT]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def times(factor, *names):
    return lambda curves: {name: values * (factor if name in names else 1) for name, values in curves.items()}


def late(percent):
    return lambda curves: {name: np.roll(v[:-1], percent)[np.arange(101) % 100] for name, v in curves.items()}


def only(*names):
    return lambda curves: {name: curves[name] for name in names}


def moved(degrees, name):
    return lambda curves: curves | {name: curves[name] + degrees}


def one_late(percent, name):
    return lambda curves: curves | {name: late(percent)(curves)[name]}


def noisy(share, *names):
    random = np.random.default_rng(0)
    return lambda curves: {
        name: values + (name in names) * random.normal(0.0, share * np.ptp(values), len(values))
        for name, values in curves.items()
    }


def backward(percent, *names):
    return lambda curves: late(percent)({name: curves[name][::-1] for name in names})


def interchanged(one, other):
    return lambda curves: curves | {one: curves[other], other: curves[one]}


def knee_from_straight(curves):
    return curves | {"knee": 180.0 - curves["knee"]}


WRONG = {
    "all angles in radians": (times(np.pi / 180, *ANGLES), "radians?"),
    "the knee in radians": (times(np.pi / 180, "knee"), "0.017 times as far as people's: radians?"),
    "the thigh in radians": (times(np.pi / 180, "thigh"), "radians?"),
    "forces in newtons": (times(MASS * GRAVITY, *FORCES), ": N?"),
    "forces in percent": (times(100, *FORCES), ": percent of body weight?"),
    "forces in N/kg": (times(GRAVITY, *FORCES), ": N/kg?"),
    "the forward force in newtons": (times(MASS * GRAVITY, "grf_forward"), "grf_forward_bw goes from"),
    "moments in N m": (times(MASS, *MOMENTS), ": N m, not per kg?"),
    "moments in N mm/kg": (times(1000, *MOMENTS), ": N mm/kg?"),
    "moments in N mm": (times(1000 * MASS, *MOMENTS), ": N mm?"),
    "moments in percent": (times(100 / GRAVITY / HEIGHT, *MOMENTS), ": percent of body weight times height?"),
    "the ankle's moment in N m": (times(MASS, "ankle_moment"), "ankle_moment_Nm_per_kg goes from"),
    "powers in W": (times(MASS, *POWERS), ": W, not per kg?"),
    "external moments": (times(-1, *MOMENTS), "external moments? internal ones are needed"),
    "an external ankle moment": (times(-1, "ankle_moment"), "plantarflexion must be positive"),
    "a mirrored thigh": (times(-1, "thigh"), "thigh_flexion_deg is opposite to people's (r = -"),
    "a mirrored hip": (times(-1, "hip"), "hip_flexion_deg is opposite to people's"),
    "a mirrored ankle": (times(-1, "ankle"), "dorsiflexion must be positive"),
    "a mirrored knee": (times(-1, "knee"), "the knee is bent backward; flexion must be positive"),
    "walking backward": (times(-1, "grf_forward"), "forward must be positive"),
    "forces on the ground": (times(-1, "grf_vertical"), "up must be positive"),
    "power absorbed": (times(-1, "ankle_power"), "generation must be positive"),
    "half a stride late": (late(50), "% of the stride late: does it begin at the other foot's heel strike?"),
    "a fifth of a stride late": (late(20), "% of the stride late"),
    "angles half a stride late": (
        lambda curves: late(50)(only("thigh", "knee", "ankle")(curves)),
        "% of the stride late: does it begin",
    ),
    "a knee of 175 deg": (knee_from_straight, "the angle between thigh and shank?"),
    "all zeros": (times(0, *COLUMNS), "is 0 throughout the stride: was it measured?"),
    "both feet together": (
        lambda curves: curves | {"grf_vertical": curves["grf_vertical"] + late(50)(curves)["grf_vertical"]},
        "grf_vertical_bw is 1 on the average, where each foot bears half of 1: both feet together,",
    ),
    "the force of half a body": (times(0.4, "grf_vertical"), "where each foot bears half of 1: not per body weight?"),
    "moments over height and weight": (times(1 / GRAVITY / HEIGHT, *MOMENTS), "_Nm_per_kg goes from"),
    "the ankle's moment over mass and height": (
        times(0.15, "ankle_moment"),
        "ankle_moment_Nm_per_kg at its peak is the force at a lever of 0.0",
    ),
    "the ankle's moment in pound-feet": (times(3.0, "ankle_moment"), "longer than a foot's: N m/kg and body weights?"),
    "a moment of another stride": (
        lambda curves: curves | {"ankle_moment": late(25)(curves)["ankle_moment"]},
        "body weights: moment and force of one foot?",
    ),
    "powers of nobody": (times(0, *POWERS), "hip_power_W_per_kg is 0 throughout the stride: was it measured?"),
    "moments beyond all bodies": (times(1e9, *MOMENTS), "_Nm_per_kg goes from"),
    "an ankle between shank and foot": (
        moved(90, "ankle"),
        "deg more than people's: from another zero? 0 is a shank at right angles to the sole",
    ),
    "a thigh from the horizontal": (moved(-90, "thigh"), "less than people's: from another zero? 0 is upright"),
    "a thigh 60 deg ahead": (moved(60, "thigh"), "deg more than people's: from another zero?"),
    "a knee from a bent leg": (moved(50, "knee"), "more than people's: from another zero? 0 is a straight leg"),
    "the knee twice": (times(2, "knee"), "2 times as far as people's: another scale, or another joint's?"),
    "the ankle three times": (times(3, "ankle"), "times as far as people's: another scale, or another joint's?"),
    "the ankle's moment 1.9 times": (times(1.9, "ankle_moment"), "m, longer than a foot's: N m/kg and body weights?"),
    "the same without forces": (
        lambda curves: times(1.9, "ankle_moment")(only("thigh", "knee", "ankle", "ankle_moment")(curves)),
        "times as far as people's: another scale",
    ),
    "thigh and knee interchanged": (interchanged("thigh", "knee"), "but like knee_flexion_deg: were columns"),
    "knee and ankle interchanged": (interchanged("knee", "ankle"), "but like ankle_dorsiflexion_deg: were columns"),
    "noise of 10 deg": (noisy(0.2, "knee"), "knee_flexion_deg jumps up and down from percent to percent: noise?"),
    "noise on all": (noisy(0.2, *COLUMNS), "jumps up and down from percent to percent: noise?"),
    "noise on moments": (noisy(0.2, *MOMENTS), "hip_moment_Nm_per_kg jumps up and down"),
    "time backward": (backward(0, *COLUMNS), "people's backward in time: were the samples reversed?"),
    "three angles backward": (backward(0, "thigh", "knee", "ankle"), "people's backward in time"),
    "backward from toe-off": (backward(63, *COLUMNS), "people's backward in time"),
    "the knee backward": (lambda c: c | backward(0, "knee")(c), "knee_flexion_deg is not like people's (r = -0.4"),
    "the thigh of the other foot": (one_late(50, "thigh"), "thigh_flexion_deg is not like people's (r = -0.9"),
    "the knee of the other foot": (one_late(50, "knee"), "knee_flexion_deg is not like people's (r = -0."),
    "the ankle of the other foot": (one_late(50, "ankle"), "% of the stride late: of the other foot?"),
    "the moment of the other foot": (one_late(50, "hip_moment"), "% of the stride late: of the other foot?"),
    "the force of the other foot": (one_late(50, "grf_forward"), "% of the stride late: of the other foot?"),
    "no force": (times(0, "grf_vertical"), "grf_vertical_bw is 0 throughout the stride: was it measured?"),
}


@pytest.mark.parametrize("speed", [0.8, 1.2, 1.6])
@pytest.mark.parametrize(("wrong", "guess"), WRONG.values(), ids=WRONG)
def test_wrong_units_and_signs_are_refused_with_what_was_seen_and_a_guess(tmp_path, wrong, guess, speed):
    path = file_of(tmp_path / "wrong.csv", wrong(people(speed)))
    with pytest.raises(SpringfootError) as caught:
        read_gait(path)
    message = str(caught.value)
    assert message.startswith("wrong.csv: ") and guess in message and message.isprintable()


@pytest.mark.parametrize("speed", [0.5, 0.8, 1.2, 1.6, 2.2])
@pytest.mark.parametrize("somebody", range(6))
def test_people_of_every_speed_are_taken_whatever_their_habits(tmp_path, somebody, speed):
    read_gait(file_of(tmp_path / "right.csv", people(speed, somebody)))


WALKS = {
    **{name: (name, {}) for name in ("schedule", "constant", "quasi_stiffness", "thesis", "untrained")},
    "slow": ("schedule", {"speed": 0.6}),
    "up a slope": ("schedule", {"slope_deg": 5.0}),
    "limping": ("schedule", {"right_foot": "rigid_toe", "speed": 0.8}),
    "on a passive foot": ("schedule", {"right_foot": "passive", "slope_deg": 4.0}),
    "on a stiff foot": ("schedule", {"right_foot": {"kind": "passive", "ankle_stiffness": 1200}}),
}


@pytest.mark.slow
@pytest.mark.parametrize(("name", "settings"), WALKS.values(), ids=WALKS)
def test_what_walks_here_can_be_walked_after(tmp_path, name, settings):
    gait = measure(record(*policy_and_settings(name, {"episode_seconds": 8.0} | settings), name=name, episodes=1))
    for side, curves in enumerate(gait.feet):
        assert curves.count
        path = tmp_path / f"{side}.csv"
        write_gait_cycle(path, curves, gait.metrics)
        read_gait(path)


REFERENCE = Path(__file__).resolve().parents[4] / "shared" / "reference" / "human_gait.csv"


@pytest.mark.skipif(not REFERENCE.is_file(), reason="Bovi's data are not ours to publish")
@pytest.mark.parametrize("condition", ["very_slow", "slow", "natural", "medium", "fast"])
def test_the_people_themselves_are_taken(condition):
    assert read_gait(REFERENCE, condition=condition).strides


def test_who_insists_is_believed(tmp_path):
    path = file_of(tmp_path / "odd.csv", times(-1, "ankle")(people()))
    own = read_gait(path, trust_units=True).gait(1.2, 1.7)
    assert own.mean("ankle", 0.3) == pytest.approx(-human_gait(1.2).mean("ankle", 0.3), abs=1e-3)
    insisting = tyro.cli(EvaluateFlags, args=["schedule", "--human", str(path), "--trust-units"])
    assert given(insisting.environment) == {"human": read_own_gait(str(path), trust_units=True)}
    asking = tyro.cli(EvaluateFlags, args=["schedule", "--human", str(path)])
    with pytest.raises(SpringfootError, match="dorsiflexion must be positive; if it is right, trust_units takes it"):
        given(asking.environment)
