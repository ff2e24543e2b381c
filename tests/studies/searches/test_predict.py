"""A walk from nothing by one command: its stages and their seconds, its table, the file of its plan."""

import json

import cma
import numpy as np
import pytest

from springfoot.agents.policies.policy import read_policy
from springfoot.cli.main import study_main
from springfoot.envs.settings.settings import BipedSettings, settings_from
from springfoot.gait import SpringfootError
from springfoot.gait.plan.walk_style import STYLES
from springfoot.studies.base.stage_seconds import StageSeconds
from springfoot.studies.searches.cma_search import generations
from springfoot.studies.searches.predict import PLAN_SPEEDS
from springfoot.studies.searches.prediction_table import PREDICTION, people_numbers, plan_numbers, prediction_table


@pytest.mark.slow
def test_all_stages_run_and_a_second_time_nothing_is_done_again(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    runs = tmp_path / "runs-quick"
    pages, before, seconds = [], {}, []
    for number in range(2):
        words = ["--quick", "--runs", "runs", "--out", f"out-{number}", "--threads", "1"]
        assert study_main(["predict", *words]) == 0
        report = (tmp_path / f"out-{number}" / "report.md").read_text(encoding="utf-8")
        pages.append(report.split("| stage |")[0])  # behind it seconds
        seconds.append(json.loads((runs / "seconds.json").read_text(encoding="utf-8")))
        kept = {path: path.stat().st_mtime_ns for path in runs.rglob("*.json")} | {runs / "seconds.json": 0}
        kept |= {path: path.read_bytes() for path in runs.glob("style*.json")}
        if number:
            assert kept == before
        before = kept
    assert pages[0] == pages[1] and pages[0].count("|") > 100
    first, both = seconds
    assert list(first) == ["plans", "person", "evaluation"] and all(both[stage] > first[stage] for stage in first)
    assert both["person"] < 1.5 * first["person"]  # it learns once
    (person,) = runs.glob("person-*/last.safetensors")
    settings = read_policy(person).settings
    styles = json.loads((runs / "styles.json").read_text(encoding="utf-8"))["styles"]
    assert sorted(map(float, styles)) == sorted(PLAN_SPEEDS)
    assert len({str(one) for one in styles.values()}) > 1  # one generation may find nothing better than its start
    assert {path.stem for path in runs.glob("plan-*.json")} == {f"plan-{speed:g}" for speed in PLAN_SPEEDS}
    assert settings.follows_plan and settings.plan_file == "runs-quick/styles.json"
    capsys.readouterr()
    assert study_main(["predict", "--quick", "--runs", "runs", "--search-seed", "1"]) == 2
    assert "is of a search with other settings" in capsys.readouterr().err


def test_seconds_of_a_stage_add_up_over_stops(tmp_path):
    path = tmp_path / "seconds.json"

    def stop():
        with StageSeconds(path).of("plan") as keep:
            keep(1)
            assert json.loads(path.read_text(encoding="utf-8"))["plan"] > 0  # a kill after this keeps it
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        stop()
    stopped = StageSeconds(path).seconds["plan"]
    again = StageSeconds(path)
    with again.of("plan"):
        pass
    with again.of("person"):
        pass
    assert list(again.seconds) == ["plan", "person"] and again.seconds["plan"] > stopped
    path.write_text('{"plan": "long"}', encoding="utf-8")
    with pytest.raises(SpringfootError, match="seconds of 'plan' must be"):
        StageSeconds(path)


def test_a_stopped_search_goes_on_with_the_same_bits(tmp_path):
    def searched(count, kept=None, asked="a bowl"):
        strategy = cma.CMAEvolutionStrategy(np.ones(4), 0.5, {"seed": 3, "popsize": 6, "verbose": -9})
        priced = []

        def price(generation, vectors):
            priced.append(generation)
            return np.array([np.sum(vector**2) for vector in vectors])

        list(generations(strategy, count, price, kept, asked))
        return strategy.mean.tobytes(), priced

    whole, _ = searched(9)
    path = tmp_path / "log.json"
    searched(4, path)
    assert searched(9, path) == (whole, [4, 5, 6, 7, 8]) and searched(9, path) == (whole, [])
    with pytest.raises(SpringfootError, match="is of a search with other settings"):
        searched(9, path, "another bowl")
    path.write_text("[]", encoding="utf-8")
    with pytest.raises(SpringfootError, match="is no file of a search's costs"):
        searched(9, path)


def test_the_table_has_people_in_range_and_bold_where_a_walk_is_not():
    settings = BipedSettings(guide="plan")
    columns = {"people": people_numbers(settings), "the plan": plan_numbers(settings)}
    assert all(each.holds(columns["people"]) for each in PREDICTION if each.name not in ("falls", "speed off by [m/s]"))
    lines = prediction_table(columns, ("the plan",)).splitlines()
    assert len(lines) == len(PREDICTION) + 3
    for each, line in zip(PREDICTION[2:], lines[4:], strict=False):  # a plan cannot fall, and keeps its speed
        _, name, _, people, plan, *_ = (cell.strip() for cell in line.split("|"))
        assert name == each.name and plan.startswith("**") != each.holds(columns["the plan"]), name
        assert people == "0.0" or "RMSE" not in name


def test_a_spread_has_the_least_and_the_largest_of_its_walks():
    people = people_numbers(BipedSettings(guide="plan"))
    other = people | {"cost_of_transport": 0.25}
    lines = prediction_table({"people": people}, (), {"several": [other, people, people]}).splitlines()
    last = {line.split(" | ")[0].strip("| "): line.split(" | ")[-1].strip("| ") for line in lines}
    assert last["cost of transport"] == f"{people['cost_of_transport']:.3f} to 0.250"
    assert last["thigh: RMSE [°]"] == "0.0" and last["falls"] == "–" and last["missed"] == ""


def test_a_plan_file_takes_the_place_of_the_packages_own_and_another_kind_is_refused(tmp_path):
    path, styles = tmp_path / "found.json", json.loads(STYLES.read_text(encoding="utf-8"))["styles"]
    path.write_text(json.dumps({"styles": styles}), encoding="utf-8")
    own, given = (plan_numbers(settings_from(guide="plan", plan_file=file)) for file in (None, str(path)))
    assert own == given
    for values, said in (
        ({"plan_file": str(path)}, "plan_file needs guide 'plan', got 'people'"),
        ({"guide": "plan", "plan_file": str(tmp_path / "none.json")}, "none.json is not a file of styles"),
        ({"guide": "plan", "plan_file": 3}, "plan_file must be the name of a file, got 3"),
    ):
        with pytest.raises(SpringfootError, match=said):
            settings_from(**values)
