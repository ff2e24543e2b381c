"""play.html: what it holds is what was recorded; in a browser it blends, loads nothing, and can be used by all."""

import base64
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from springfoot.cli.main import main
from springfoot.errors import SpringfootError
from springfoot.evaluation.numbers.metrics import measure
from springfoot.evaluation.page.play_data import LARGEST, MOMENTS, PLAY_COLUMNS, walk_of
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import record
from springfoot.studies.walks.play import Play

COMMITTED = Path(__file__).parents[3] / "docs" / "play.html"
GRID = ["--ankle", "0.15", "1", "--toe", "0.5", "1", "--speed", "1.0", "1.2", "--feet", "intact", "no_toe"]


def data_of(page):
    text = re.search(r'id="data">(.*?)</script>', page.read_text(encoding="utf-8"), re.DOTALL)
    assert text is not None
    return json.loads(text[1])


def series_of(data):
    """(walks, MOMENTS, columns)"""
    series = data["series"]
    whole = np.frombuffer(base64.b64decode(series["data"]), "<u2").reshape(-1, MOMENTS, len(PLAY_COLUMNS))
    return np.array(series["low"]) + whole / LARGEST * (np.array(series["high"]) - np.array(series["low"]))


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    out = tmp_path_factory.mktemp("play") / "study"
    assert main(["study", "play", *GRID, "--episodes", "1", "--seconds", "8", "--out", str(out)]) == 0
    return out / "play.html"


def walked(name, **given):
    policy, settings = policy_and_settings(name, {"episode_seconds": 8.0} | given)
    return record(policy, settings, name=name, episodes=2)


def test_a_walk_is_its_mean_stride():
    recording = walked("constant")
    told, walk = walk_of(recording)
    gait = measure(recording)
    assert told["falls"] == 0 and told["speed"] == gait.metrics["speed_m_s"]["mean"]
    assert told["length"] / told["seconds"] == pytest.approx(told["speed"], rel=0.02)
    column = {name: PLAY_COLUMNS.index(name) for name in PLAY_COLUMNS}
    assert walk[:, column["Knee angle"]] == pytest.approx(gait.feet[0].mean("knee_flexion_deg")[::2])
    assert walk[:, column["Knee angle"] + 1] == pytest.approx(gait.feet[1].mean("knee_flexion_deg")[::2])
    assert np.degrees(walk[:, column["angle"] + 1]) == pytest.approx(walk[:, column["Knee angle"]], abs=1e-3)
    up = walk[:-1, column["up"] : column["up"] + 2]
    assert up.sum(axis=1).mean() == pytest.approx(1.0, abs=0.02)
    assert walk[:, column["stiffness"]] == pytest.approx(300.0, rel=1e-6)
    assert walk[0, 0] == pytest.approx(0.0) and walk[-1, 0] == pytest.approx(
        0.0, abs=1e-9
    )  # hip, ahead of its mean way


def test_of_walks_that_stood_and_fell_the_stride_is_of_those_that_stood():
    recording = walked("constant")
    one_fell = replace(recording, fall_reason=np.array(["", "trunk"]))
    told, walk = walk_of(one_fell)
    assert (told["falls"], told["episodes"]) == (1, 2)
    assert not np.array_equal(walk, walk_of(recording)[1])


def test_who_only_falls_is_shown_falling():
    recording = walked("constant:30,10")
    told, walk = walk_of(recording)
    assert told["falls"] == 2 and told["ended"] == recording.fall_reason[recording.example]
    assert told["after"] == pytest.approx(recording.ticks.max() * 0.01)
    assert walk[-1, 1] < walk[0, 1] - 0.1  # the hip sinks


def test_the_page_holds_a_walk_for_every_point_of_the_grid(page):
    data = data_of(page)
    assert data["grid"] == {"feet": ["intact", "no_toe"], "speed": [1.0, 1.2], "toe": [0.5, 1], "ankle": [0.15, 1]}
    walks, series = data["walks"], series_of(data)
    assert len(walks) == len(series) == 16
    toe = series[:, :, PLAY_COLUMNS.index("Toe stiffness")].mean(axis=1)  # the schedule's is one number all the time
    walking = [at for at, walk in enumerate(walks[:8]) if "ended" not in walk]
    (tuned,) = {round(toe[at] / (0.5, 1.0)[at // 2 % 2], 1) for at in walking if walks[at]["speed"] > 1.1}
    assert 5.0 < tuned < 200.0
    walked = [walk for walk in walks if "ended" not in walk]
    assert walked and all(walk["speed"] == pytest.approx(walk["length"] / walk["seconds"], rel=0.1) for walk in walked)
    assert [body["feet"][1]["one_piece"] for body in data["bodies"]] == [False, True]
    assert "command: springfoot study play --ankle 0.15 1" in data["made"] and "--out" not in data["made"]


def test_one_file_that_loads_nothing_and_says_what_it_is(page):
    text = page.read_text(encoding="utf-8")
    assert "default-src 'none'" in text and not re.search(r"url\(|@import|fetch\(|XMLHttp|src=", text)
    assert "<strong>This is a recording.</strong>" in text


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"ankle": (3.0, 2.0)}, "ankle must be at least two ascending positive numbers"),
        ({"toe": (0.0, 1.0)}, "toe must be at least two ascending positive numbers"),
        ({"feet": ()}, "feet must be at least one kind of foot"),
        ({"seconds": 3.0}, "seconds must be more than the warm-up of 3 s, got 3"),
        ({"episodes": 33}, "episodes must be a whole number >= 1 and <= 32"),
    ],
)
def test_bad_grids_are_refused(wrong, said):
    with pytest.raises(SpringfootError, match=said):
        Play(**wrong).check()


def opened(browser, page, width, **how):
    """A tab with the page, what its console told and what it asked for."""
    tab = browser.new_page(viewport={"width": width, "height": 900}, **how)
    told, asked = [], []
    tab.on("console", lambda message: told.append(message.text))
    tab.on("pageerror", lambda error: told.append(str(error)))
    tab.on("request", lambda request: asked.append(request.url))
    tab.goto(page.as_uri())
    return tab, told, asked


def put(tab, slider, place):
    tab.locator(f"#{slider}").evaluate("(e, v) => { e.value = v; e.dispatchEvent(new Event('input')) }", str(place))


@pytest.mark.parametrize("width", [1280, 390])
def test_in_a_browser_sliders_change_figure_curves_and_numbers(chromium, page, width):
    tab, told, asked = opened(chromium, page, width)
    assert tab.evaluate("document.documentElement.scrollWidth <= document.documentElement.clientWidth")

    def drawn():
        knee = tab.locator("svg[aria-label^='Knee angle'] .mean").first.get_attribute("d")
        return knee, tab.locator("svg[data-frame] polyline").first.get_attribute("points")

    assert "A recorded point: fell in 0 of 1 episodes." in tab.locator("#said").inner_text()
    before, numbers = drawn(), tab.locator("#numbers").inner_text()
    put(tab, "toe", 0.5)
    assert "Between 2 recorded points" in tab.locator("#said").inner_text()
    assert tab.locator("#toe_is").inner_text() == "× 0.71"  # halfway of 0.5 and 1 by the logarithm
    assert all(now != then for now, then in zip(drawn(), before, strict=True))
    assert tab.locator("#numbers").inner_text() != numbers
    put(tab, "toe", 1)
    assert drawn() == before and tab.locator("#numbers").inner_text() == numbers
    tab.locator("#foot").select_option(index=1)
    assert drawn() != before and "no toe" in tab.locator("figcaption").inner_text()
    tab.locator("#foot").select_option(index=0)

    put(tab, "ankle", 0)  # too soft to walk on
    assert "The figure is the end of an episode here" in tab.locator("#said").inner_text()
    assert tab.locator("#curves svg").count() == 0
    put(tab, "ankle", 1)
    assert drawn() == before
    tab.close()
    assert told == [] and asked == [page.as_uri()]


def test_a_blend_lies_between_what_was_recorded(chromium, page):
    tab, _, _ = opened(chromium, page, 1280)
    speed = []
    for place in (0, 0.25, 1):
        put(tab, "pace", place)
        speed.append(float(tab.locator("#numbers td.number").first.inner_text()))
    slow, blend, fast = speed
    assert blend == pytest.approx(0.75 * slow + 0.25 * fast, abs=0.02) and slow < fast
    tab.close()


def test_the_keyboard_turns_a_slider_or_walks_through_the_stride(chromium, page):
    tab, _, _ = opened(chromium, page, 1280)
    body = tab.locator("svg[data-frame]")
    tab.locator("#ankle").focus()
    tab.keyboard.press("ArrowLeft")
    assert tab.locator("#ankle").input_value() == "0.95" and body.get_attribute("data-frame") == "0"
    tab.locator("#ankle").blur()
    tab.keyboard.press("ArrowRight")
    assert body.get_attribute("data-frame") == "1" and tab.locator("#ankle").input_value() == "0.95"
    cursor = tab.locator("svg[aria-label^='Knee angle'] .cursor").first
    assert float(cursor.get_attribute("data-percent")) == pytest.approx(2.0)
    tab.keyboard.press(" ")
    assert tab.locator("#play").inner_text() == "Pause"
    while body.get_attribute("data-frame") == "1":  # it plays, so that this ends
        tab.wait_for_timeout(50)
    tab.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 390])
def test_axe_finds_no_fault(chromium, page, width, scheme):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="pip install axe-playwright-python")
    tab, _, _ = opened(chromium, page, width, color_scheme=scheme)
    faults = axe.Axe().run(tab).response["violations"]
    tab.close()
    assert [(fault["id"], fault["impact"]) for fault in faults] == []


def test_the_committed_page_is_the_studys_of_this_script(page):
    assert COMMITTED.stat().st_size < 10_000_000
    own, made = data_of(COMMITTED), (COMMITTED.read_text(encoding="utf-8"), page.read_text(encoding="utf-8"))
    study = Play()
    grid = own["grid"]
    assert (tuple(grid["ankle"]), tuple(grid["toe"]), tuple(grid["speed"])) == (study.ankle, study.toe, study.speed)
    assert tuple(grid["feet"]) == study.feet and len(own["walks"]) == study.grid.size
    without_data = [re.sub(r'id="data">.*?</script>', "", text, flags=re.DOTALL) for text in made]
    assert without_data[0] == without_data[1]
    assert "command: springfoot study play\n" in own["made"]
