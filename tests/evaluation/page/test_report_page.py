"""report.html: what it says, what it draws, and what it does in a real browser."""

import copy
import dataclasses
import json
import re
from html.parser import HTMLParser
from typing import Any

import numpy as np
import pytest

from springfoot.cli.evaluate import evaluate_main
from springfoot.envs.settings.feet import foot_setting
from springfoot.envs.settings.settings import reference_gait, settings_from
from springfoot.envs.task.reward import TERMS
from springfoot.evaluation.numbers.metrics import measure
from springfoot.evaluation.numbers.per_leg import leg_numbers
from springfoot.evaluation.page.page_figure import foot_words, walker_words
from springfoot.evaluation.page.report_page import spoken_verdict, write_page
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import record


def walked(name, label=None, **given):
    policy, settings = policy_and_settings(name, {"episode_seconds": 8.0} | given)
    recording = record(policy, settings, name=label or name, episodes=2, threads=1)
    return recording, measure(recording)


@pytest.fixture(scope="module")
def walk():
    return walked("schedule")


@pytest.fixture(scope="module")
def page(walk, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "report.html"
    write_page(path, [walk, walked("constant")], "evaluate.py schedule constant")
    return path


class Reader(HTMLParser):
    """What of a page is loaded from elsewhere, its visible text and its data."""

    def __init__(self, text):
        super().__init__()
        self.loads: list[str | None] = []
        self.said: list[str] = []
        self.data: dict[str, Any] = {}
        self._within: list[tuple[str, dict]] = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.loads += [value for name, value in given.items() if name in ("src", "href", "srcset", "action")]
        if tag not in ("meta", "link", "input", "br"):
            self._within.append((tag, given))

    def handle_endtag(self, tag):
        while self._within and self._within.pop()[0] != tag:
            pass

    def handle_data(self, data):
        tag, given = self._within[-1] if self._within else ("", {})
        if given.get("id") == "data":
            self.data = json.loads(data)
        elif tag not in ("style", "script"):
            self.said.append(data)


def test_a_page_is_one_small_file_that_loads_nothing(page):
    text = page.read_text(encoding="utf-8")
    assert Reader(text).loads == ["data:,"]
    assert "default-src 'none'" in text and not re.search(r"url\(|@import|fetch\(|XMLHttp", text)
    assert page.stat().st_size < 1_000_000


def test_its_numbers_are_those_of_metrics_and_of_the_table(page, walk):
    data = Reader(page.read_text(encoding="utf-8")).data
    assert data["policies"][0]["metrics"] == json.loads(json.dumps(walk[1].metrics))
    rows = {row[0]: row for row in data["tables"][0]}
    assert rows["knee angle, RMSE"][2] == f"{walk[1].metrics['joints']['knee']['rmse_deg']:.1f}"
    assert rows["falls"][2] == "0 of 2"
    assert "evaluate.py schedule constant" in data["made"] and "mujoco" in data["made"]


def test_its_curves_are_the_walks_and_peoples(page, walk):
    recording, gait = walk
    panels = {panel["title"]: panel for panel in Reader(page.read_text(encoding="utf-8")).data["policies"][0]["panels"]}
    knee, human = panels["Knee angle"], reference_gait(recording.settings)
    assert knee["mean"] == pytest.approx(gait.both.mean("knee_flexion_deg"), rel=1e-3, abs=1e-3)
    assert knee["sd"] == pytest.approx(gait.both.sd("knee_flexion_deg"), rel=1e-3)
    phase = np.linspace(0, 1, 101)
    assert knee["people"] == pytest.approx(np.degrees(human.mean("knee", phase)), rel=1e-3, abs=1e-3)
    assert knee["people_sd"] == pytest.approx(np.degrees(human.sd("knee", phase)), rel=1e-3)
    assert panels["CoM height"]["plan"] == pytest.approx(recording.plan_com[:, 1], rel=1e-3)
    assert "people" not in panels["Toe moment"]  # of which nobody knows
    assert all(panel["unit"] for panel in panels.values())
    held = {panel["title"]: panel for panel in Reader(page.read_text(encoding="utf-8")).data["policies"][1]["panels"]}
    assert [leg["mean"] for leg in held["Toe, stiffness K"]["legs"]] == [pytest.approx([40.0] * 101, rel=1e-3)] * 2


def test_its_figure_is_two_strides_from_a_left_heel_strike(page, walk):
    figure = Reader(page.read_text(encoding="utf-8")).data["policies"][0]["figure"]
    stride = 120 / walk[1].metrics["cadence_steps_min"]
    assert len(figure["base"]) * figure["seconds_a_frame"] == pytest.approx(2 * stride, rel=0.03)
    percent = np.array([frame[0] for frame in figure["percent"]], float)
    assert percent[0] == pytest.approx(0.0, abs=1.5) and (np.diff(percent) < 0).sum() == 1
    step, phase = np.array(figure["step"], float), np.array(figure["phase"], float)
    assert step[0] == pytest.approx(0.0, abs=3.0) and phase[0, 0] == pytest.approx(0.0, abs=0.03)  # as the stride
    assert ((step >= 0) & (step <= 100)).all() and (np.diff(step) < 0).sum() == 3
    late = (percent / 100 - phase[:, 0] + 0.5) % 1.0 - 0.5
    assert np.abs(late).max() < 0.03  # the leg's phase runs with the stride
    force = np.array(figure["force"], float)  # (side, frame, (place, forward, up)), body weights
    assert force[..., 2].sum(axis=0).mean() == pytest.approx(1.0, abs=0.02)
    loaded = np.abs(force[0, :, 2] - 1.0) < 0.3
    assert np.abs(force[0, loaded, 0] - np.array(figure["base"])[loaded, 0]).max() < 0.6  # below the body
    assert np.abs(np.array(figure["zmp"]) - np.array(figure["com"])[:, 0]).max() < 0.5


def test_the_rewards_terms_are_drawn_over_the_step_and_add_up_to_the_return(page, walk):
    recording, gait = walk
    policy = Reader(page.read_text(encoding="utf-8")).data["policies"][0]
    panels = {panel["title"]: panel for panel in policy["panels"]}
    pose = panels["Reward term pose"]
    assert pose["axis"] == "step" and pose["mean"] == pytest.approx(gait.tally.reward.mean("pose"), rel=1e-3)
    assert panels["Reward term alive"]["mean"] == [1.0] * 101
    brought = [term["return_mean"] for term in policy["metrics"]["reward_terms"].values()]
    assert sum(brought) == pytest.approx(recording.returns.mean(), rel=1e-6)
    stiffest = np.nanmax(recording.series["reward"][..., TERMS.index("stiffness")])
    assert 0.0 < max(panels["Reward term stiffness"]["mean"]) <= stiffest


FEET = {
    "left_foot": {"kind": "passive", "ankle_stiffness": 500.0, "shank_mass_ratio": 0.6},
    "right_foot": {"kind": "no_toe", "orthosis": {"ankle_stiffness": 100.0}},
}


def test_feet_of_other_kinds_are_told_drawn_and_measured_apart(tmp_path):
    recording, gait = walked("schedule", person="learned", **FEET)
    write_page(tmp_path / "report.html", [(recording, gait)])
    data = Reader((tmp_path / "report.html").read_text(encoding="utf-8")).data
    policy = data["policies"][0]
    left, right = policy["figure"]["feet"]
    assert left["words"].startswith("passive (ankle stiffness 500 N m/rad, shank mass ratio 0.6")
    assert right["words"] == "no toe (in an orthosis with ankle stiffness 100 N m/rad)"
    assert left["joints"] == ["device", "device"] and right["joints"] == ["muscles", "lock"]
    assert (left["one_piece"], right["one_piece"]) == (False, True) and (left["orthosis"], right["orthosis"]) == (0, 1)
    knee = next(panel for panel in policy["panels"] if panel["title"] == "Knee angle")
    for side, leg in enumerate(knee["legs"]):
        assert leg["mean"] == pytest.approx(gait.feet[side].mean("knee_flexion_deg"), rel=1e-3, abs=1e-3)
    assert policy["loops"][0]["legs"][1]["x"] == pytest.approx(
        gait.feet[1].mean("ankle_dorsiflexion_deg"), rel=1e-3, abs=1e-3
    )
    rows = {row[0]: row for row in data["legs"][0]}
    left_stance, right_stance = (leg["stance_percent"] for leg in gait.metrics["per_leg"].values())
    human = reference_gait(recording.settings)
    numbers = [f"{left_stance:.1f}", f"{right_stance:.1f}", f"{right_stance - left_stance:+.1f}"]
    assert rows["stance"][2:] == [*numbers, f"{100 * human.toe_off:.1f}"]
    assert rows["ankle stiffness, swing"][-1] == "–"  # which nobody has measured


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("rigid_toe", "rigid toe"),
        ({"kind": "weak", "strength": 0.4}, "weak (strength 0.4 (of the sound leg))"),
        ({"kind": "passive", "ankle_deg": 3.0}, "passive (ankle rest angle 3 deg)"),
        ({"kind": "passive", "ankle_table": [[-10, 60], [10, -60]]}, "passive (ankle table of 2 points)"),
        ({"kind": "drop", "orthosis": {}}, "drop (in an orthosis with no spring)"),
        (
            {"kind": "drop", "orthosis": {"ankle_stiffness": 90, "engages": "dorsiflexion"}},
            "drop (in an orthosis with ankle stiffness 90 N m/rad in dorsiflexion alone)",
        ),
    ],
)
def test_a_foot_in_words(setting, words):
    assert foot_words(foot_setting("right_foot", setting)) == words


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({}, "1.7 m, 63 kg, both feet intact"),
        ({"right_foot": "no_toe", "mass": 70.0}, "1.7 m, 70 kg, left foot intact, right foot no toe"),
        ({"person": "learned"}, "1.7 m, 63 kg, both feet intact, person learned"),
        ({"height_range": (1.5, 1.9), "left_foot": "drop"}, "1.5 to 1.9 m, 63 kg, left foot drop, right foot intact"),
    ],
)
def test_a_walker_in_words(settings, words):
    assert walker_words(settings_from(**settings)) == words


def who(path):
    """Return the lines on the walkers of a page."""
    (part,) = re.findall(r'<ul id="who">(.*?)</ul>', path.read_text(encoding="utf-8"), re.DOTALL)
    return [re.sub(r"<[^>]+>", "", line) for line in re.findall(r"<li.*?</li>", part)]


def test_walkers_are_told_by_what_differs_after_what_they_have_in_common(walk, tmp_path):
    recording, gait = walk
    falls = "Never fell in 2 episodes. Mean length 8.0 s."
    write_page(tmp_path / "one.html", [walk])
    assert who(tmp_path / "one.html") == [
        f"schedule: 1.7 m, 63 kg, both feet intact, 1.2 m/s, after people&#x27;s mean walk. {falls}"
    ]
    rigid = dataclasses.replace(gait, metrics=copy.deepcopy(gait.metrics))
    rigid.metrics["environment"]["left_foot"] = "rigid"
    write_page(tmp_path / "two.html", [walk, (recording, rigid)])
    assert who(tmp_path / "two.html") == [
        f"All: 1.7 m, 63 kg, 1.2 m/s, after people&#x27;s mean walk. {falls}",
        "schedule: both feet intact.",
        "schedule: left foot rigid, right foot intact.",
    ]
    rigid.metrics["falls"] = 1
    write_page(tmp_path / "fall.html", [walk, (recording, rigid)])
    assert [line.count("ell in") for line in who(tmp_path / "fall.html")] == [0, 1, 1]


def test_the_verdict_is_told_in_words(walk):
    said = spoken_verdict(walk[1].metrics, leg_numbers(walk[1].tally))
    assert list(said) == ["Falls", "Walker", "Speed", "Joints", "Forces", "Energy"]
    assert said["Walker"] == "1.7 m, 63 kg, both feet intact, 1.2 m/s, after people's mean walk."
    assert said["Falls"].startswith("Never fell in 2 episodes") and "asked for 1.20" in said["Speed"]
    assert re.search(r"Misses \d of 14 criteria|Meets all 14 criteria", said["Joints"])
    missed = [int(count) for text in said.values() for count in re.findall(r"Misses (\d+) of", text)]
    limits = [limit for text in said.values() for limit in re.findall(r"\d\S*(?: \S+)?, asked ([≤≥-]? ?\d)", text)]
    assert sum(missed) == len(limits) > 0


def test_a_walk_at_another_speed_is_held_against_people_at_that_speed():
    _, gait = walked("schedule", speed=1.4)
    said = spoken_verdict(gait.metrics, leg_numbers(gait.tally))
    assert "criteria" not in " ".join(said.values())
    inside = gait.metrics["joints"]["knee"]["within_1sd_percent"]
    assert "Inside people's mean ± SD: thigh" in said["Joints"] and f"knee {inside:.0f} %" in said["Joints"]
    assert "Neither foot's largest force is more than a quarter above people's mean peak" in said["Forces"]
    assert f"Fibre work {gait.metrics['effort']['fibre_J_kg_m']:.2f} J/kg/m, people's" in said["Energy"]


def test_a_foot_that_bears_too_much_is_named_at_any_speed(walk):
    gait = walk[1]
    legs = {side: {"vertical_max_mean_bw": value} for side, value in (("left", 2.3), ("right", 1.1))}
    for speed in (1.2, 0.9):
        metrics = gait.metrics | {"environment": gait.metrics["environment"] | {"speed": speed}}
        forces = spoken_verdict(metrics, legs)["Forces"]
        assert (
            "Overload: the left foot bears 2.30 body weights at the largest of a stride, people's mean peak is 1."
            in forces
        )


def test_a_walk_that_only_falls_has_a_page_too(tmp_path):
    recording, gait = walked("thesis_printed")
    write_page(tmp_path / "report.html", [(recording, gait)])
    reader = Reader((tmp_path / "report.html").read_text(encoding="utf-8"))
    said = " ".join(reader.said)
    assert "Fell in 2 of 2 episodes" in said and "nothing of the gait could be measured" in said
    assert "None: every episode ends in a fall." in said
    own = reader.data["policies"][0]
    assert own["panels"][0]["mean"] == [None] * 101 and len(own["figure"]["base"]) > 50


@pytest.mark.parametrize(
    ("falls", "words"),
    [
        (0, ""),
        (1, "1 of 2 episodes end in a fall. All numbers count the time before too."),
        (2, "None: every episode ends in a fall. All numbers are of the time before."),
    ],
)
def test_the_verdict_on_a_walk_that_falls_says_so_and_meets_no_criteria(walk, falls, words):
    fallen = walk[1].metrics | {"falls": falls, "fall_reasons": {"hips below 0.55 m": falls}}
    said = spoken_verdict(fallen, leg_numbers(walk[1].tally))
    assert said.get("Walk", "") == words
    assert ("criteria" in said["Joints"] + said["Forces"] + said["Energy"]) == (falls < 2)


def test_a_name_is_text_and_nothing_else(tmp_path):
    write_page(tmp_path / "report.html", [walked("schedule", label='</script><img src=x onerror="alert(1)">')])
    reader = Reader((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert reader.loads == ["data:,"]
    assert reader.data["policies"][0]["name"].startswith("</script><img") and "</script><img" in " ".join(reader.said)


def test_an_introduction_stands_above_the_walks_and_is_text_alone(walk, tmp_path):
    words = '**Least with <img src=x onerror="alert(1)">.**\n\n- It is a body in a plane.'
    write_page(tmp_path / "report.html", [walk], introduction=words)
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    reader = Reader(text)
    said = " ".join(reader.said)
    assert reader.loads == ["data:,"] and 'Least with <img src=x onerror="alert(1)">.' in said
    assert said.index("springfoot report") < said.index("It is a body in a plane.") < said.index("Never fell")


@pytest.mark.slow
def test_several_policies_have_a_folder_each_and_one_page(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names = ["schedule", "...csv", "schedule", "report.html.csv"]
    for name in names[1::2]:
        head = "percent,ankle_stiffness_Nm_per_rad,toe_stiffness_Nm_per_rad"
        (tmp_path / name).write_text(f"{head}\n0,300,40\n", encoding="utf-8")
    words = [*names, "--episodes", "1", "--seconds", "1"]
    assert evaluate_main(words) == 0
    assert {path.name for path in tmp_path.iterdir()} == {"...csv", "report.html.csv", "runs"}
    labels = ["schedule", "policy", "schedule-2", "report.html-2"]
    out = tmp_path / "runs" / f"eval-{'-'.join(labels)}-1"
    assert {path.name for path in out.iterdir()} == {*labels, "report.html"}
    reader = Reader((out / "report.html").read_text(encoding="utf-8"))
    for policy in reader.data["policies"]:
        metrics = json.loads((out / policy["name"] / "metrics.json").read_text(encoding="utf-8"))
        assert policy["metrics"] == metrics
    assert reader.data["made"].startswith(f"command: evaluate.py {' '.join(words)}")
    told = capsys.readouterr().out
    assert told.count("falls") == 1  # of one table with a column for each
    assert f"\nreport.html, in each of the folders {', '.join(labels)}: metrics.json, " in told


@pytest.mark.slow
def test_the_page_can_be_left_out_and_a_policy_cannot(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert evaluate_main(["random", "--episodes", "1", "--seconds", "1", "--no-report", "--out", "bare"]) == 0
    assert "metrics.json" in {path.name for path in (tmp_path / "bare").iterdir()}
    assert not (tmp_path / "bare" / "report.html").exists() and "report.html" not in capsys.readouterr().out
    assert evaluate_main([]) == 2
    assert capsys.readouterr().err == "evaluate.py: error: give a policy, say pretrained; --help lists them\n"
    assert evaluate_main(["schedule", "nonsense"]) == 2
    assert [path.name for path in tmp_path.iterdir()] == ["bare"]


def test_machines_get_one_json_object(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert evaluate_main(["random", "constant", "--episodes", "1", "--seconds", "1", "--json", "--out", "two"]) == 0
    told = json.loads(capsys.readouterr().out)
    stand = [(tmp_path / "two" / name / "metrics.json").read_text(encoding="utf-8") for name in ("random", "constant")]
    assert told == {"folder": "two", "metrics": [json.loads(text) for text in stand]}
