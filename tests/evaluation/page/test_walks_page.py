"""walks.html: it shows what was recorded, falls too; in a browser it loads nothing, and can be used by all."""

import base64
import csv
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from springfoot.cli.main import main
from springfoot.errors import SpringfootError
from springfoot.evaluation.numbers.metrics import measure
from springfoot.evaluation.page.walks import LARGEST, MOMENTS, STRIDE_COLUMNS, fall_of, mean_stride, walk_of
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import record
from springfoot.studies.feet.walks import PAGE_COLUMNS, PAGE_FEET, Walks

COMMITTED = Path(__file__).parents[3] / "docs" / "walks.html"
FEET = ["intact", '{"kind": "passive", "ankle_stiffness": 300}', '{"kind": "passive", "ankle_stiffness": 3}']
FEET_FLAGS = [word for foot in FEET for word in ("--foot", foot)]
EPISODES = ["--episodes", "2", "--seconds", "6", "--seed", "1"]
"""On the softest foot one of two episodes of 50 kg falls at 0.8 m/s, and all others."""
SOFT = 2


def data_of(page):
    text = re.search(r'id="data">(.*?)</script>', page.read_text(encoding="utf-8"), re.DOTALL)
    assert text is not None
    return json.loads(text[1])


def series_of(data):
    """(strides and falls, MOMENTS, columns)"""
    series = data["series"]
    whole = np.frombuffer(base64.b64decode(series["data"]), "<u2").reshape(-1, MOMENTS, len(STRIDE_COLUMNS))
    return np.array(series["low"]) + whole / LARGEST * (np.array(series["high"]) - np.array(series["low"]))


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    out = tmp_path_factory.mktemp("walks") / "study"
    grid = ["--mass", "50", "80", "--speed", "0.8", "1.5"]
    assert main(["study", "walks", *FEET_FLAGS, *grid, *EPISODES, "--threads", "1", "--out", str(out)]) == 0
    return out / "walks.html"


def walked(name):
    policy, settings = policy_and_settings(name, {"episode_seconds": 8.0})
    return record(policy, settings, name=name, episodes=2, threads=1)


@pytest.fixture(scope="module")
def recording():
    return walked("constant")


def test_a_walk_is_its_mean_stride(recording):
    walk = walk_of(recording)
    stride = mean_stride(walk)
    assert stride is not None and fall_of(walk) is None
    numbers, series = stride
    gait = measure(recording)
    assert numbers["length"] / numbers["seconds"] == pytest.approx(gait.metrics["speed_m_s"]["mean"], rel=0.02)
    column = {name: STRIDE_COLUMNS.index(name) for name in STRIDE_COLUMNS}
    assert series[:, column["Knee angle"]] == pytest.approx(gait.feet[0].mean("knee_flexion_deg")[::2])
    assert series[:, column["Knee angle"] + 1] == pytest.approx(gait.feet[1].mean("knee_flexion_deg")[::2])
    assert np.degrees(series[:, column["angle"] + 1]) == pytest.approx(series[:, column["Knee angle"]], abs=1e-3)
    up = series[:-1, column["up"] : column["up"] + 2]
    assert up.sum(axis=1).mean() == pytest.approx(1.0, abs=0.02)
    assert series[:, column["stiffness"]] == pytest.approx(300.0, rel=1e-6)
    assert series[[0, -1], 0] == pytest.approx(0.0, abs=1e-9)  # hip, ahead of its mean way


def test_where_one_of_two_falls_both_are_shown(recording):
    walk = walk_of(replace(recording, fall_reason=np.array(["", "trunk"])))
    stride, fall, of_both = mean_stride(walk), fall_of(walk), mean_stride(walk_of(recording))
    assert stride is not None and fall is not None and of_both is not None
    assert not np.array_equal(stride[1], of_both[1])
    assert fall[0]["reason"] == "trunk" and fall[0]["after"] == pytest.approx(8.0)


def test_a_walk_that_only_falls_is_a_fall():
    recording = walked("constant:30,10")
    walk = walk_of(recording)
    assert walk.gait is None and mean_stride(walk) is None
    fall = fall_of(walk)
    assert fall is not None
    numbers, series = fall
    assert numbers["reason"] == recording.fall_reason[recording.example]
    assert numbers["after"] == pytest.approx(recording.ticks.max() * 0.01)
    assert series[-1, 1] < series[0, 1] - 0.1  # the hip sinks


def test_the_page_holds_every_foot_mass_and_speed(page):
    data = data_of(page)
    feet = ["intact", *(f"passive (ankle stiffness {stiffness} N m/rad)" for stiffness in (300, 3))]
    assert data["grid"] == {"foot": feet, "mass": [50.0, 80.0], "speed": [0.8, 1.5]}
    cells, series = data["cells"], series_of(data)
    assert len(cells) == 12 and len(data["people"]) == 2
    assert [cell["falls"] for cell in cells] == [0, 0, 1, 0, 0, 2, 0, 0, 2, 0, 0, 2]
    assert [(cell["stride"] is not None, cell["fall"] is not None) for cell in cells[:6]] == [
        *([(True, False)] * 2 + [(True, True)]),
        *([(True, False)] * 2 + [(False, True)]),
    ]
    parts = [part for cell in cells for part in (cell["stride"], cell["fall"]) if part]
    assert [part["series"] for part in parts] == list(range(len(series)))
    right_ankle = STRIDE_COLUMNS.index("stiffness") + 2
    assert series[cells[1]["stride"]["series"], :, right_ankle] == pytest.approx(300.0, rel=1e-3)
    with (page.parent / "walks.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    for cell, row in zip(cells, rows, strict=True):
        assert float(row["falls"]) == cell["falls"] / 2
        told = [f"{float(row[key]):.2f}" if row[key] else "–" for key in PAGE_COLUMNS.values()]
        assert cell["numbers"] == told and (told[0] == "–") == (cell["stride"] is None)
        if cell["stride"]:
            own_speed = cell["stride"]["length"] / cell["stride"]["seconds"]
            assert own_speed == pytest.approx(float(row["speed_m_s"]), rel=0.1)
    assert f"| {feet[SOFT]} | 1 / 2 of 2 | 2 / 2 of 2 |" in (page.parent / "report.md").read_text(encoding="utf-8")
    assert "command: springfoot study walks --foot intact" in data["made"] and "--out" not in data["made"]


def test_muscles_grow_with_mass_so_that_only_fixed_springs_walk_otherwise(page):
    numbers = [cell["numbers"] for cell in data_of(page)["cells"]]
    assert numbers[0] == numbers[6] and numbers[1] != numbers[7] and numbers[2] != numbers[8]


def test_one_file_that_loads_nothing_and_says_what_it_is(page):
    text = page.read_text(encoding="utf-8")
    assert "default-src 'none'" in text and not re.search(r"url\(|@import|fetch\(|XMLHttp|src=", text)
    assert "<strong>This is a recording.</strong>" in text


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"mass": (80.0, 63.0)}, "mass must be ascending numbers"),
        ({"speed": ()}, "speed must be ascending numbers"),
        ({"foot": tuple(f'{{"kind": "passive", "ankle_stiffness": {k}}}' for k in range(9))}, "at most 8 feet, got 9"),
        ({"seconds": 3.0}, "seconds must be more than the warm-up of 3 s, got 3"),
        ({"episodes": 33}, "episodes must be a whole number >= 1 and <= 32"),
    ],
)
def test_bad_grids_are_refused(wrong, said):
    with pytest.raises(SpringfootError, match=said):
        Walks(**wrong).check()


def opened(browser, page, width, **how):
    """A tab with the page, one foot shown, what its console told and what it asked for."""
    tab = browser.new_page(viewport={"width": width, "height": 900}, **how)
    told, asked = [], []
    tab.on("console", lambda message: told.append(message.text))
    tab.on("pageerror", lambda error: told.append(str(error)))
    tab.on("request", lambda request: asked.append(request.url))
    tab.goto(page.as_uri())
    assert tab.locator("figcaption").count() == 2  # the first foot, and the second beside it
    tab.locator("#beside").select_option(index=0)
    return tab, told, asked


@pytest.mark.parametrize("width", [1280, 390])
def test_in_a_browser_lists_change_figure_curves_and_numbers(chromium, page, width):
    tab, told, asked = opened(chromium, page, width)

    def fits():
        return tab.evaluate("document.documentElement.scrollWidth <= document.documentElement.clientWidth")

    def drawn():
        knee = tab.locator("svg[aria-label^='Knee angle'] .mean").first.get_attribute("d")
        return knee, tab.locator("svg[data-frame] polyline").first.get_attribute("points")

    def choose(name, index):
        tab.locator(f"#{name}").select_option(index=index)

    said = tab.locator("#said")
    choose("pace", 0)
    assert fits() and said.inner_text() == "intact: fell in 0 of 2 episodes. Shown: the mean stride."
    assert tab.locator("#numbers tbody tr").count() == 3
    before, numbers = drawn(), tab.locator("#numbers").inner_text()
    choose("foot", 1)
    assert all(now != then for now, then in zip(drawn(), before, strict=True))
    assert "passive" in tab.locator("tr.shown").inner_text()
    other = drawn()
    choose("mass", 0)
    assert drawn() != other and tab.locator("#numbers").inner_text() != numbers
    choose("mass", 1)
    choose("foot", 0)
    assert drawn() == before and tab.locator("#numbers").inner_text() == numbers

    choose("beside", 2)  # the passive one
    assert fits() and drawn() == before and tab.locator("figcaption").count() == 2
    assert tab.locator("svg[aria-label^='Knee angle'] .mean").count() == 4
    assert tab.locator("figcaption").first.inner_text() == "intact: both feet intact"
    choose("beside", 0)
    tab.close()
    assert told == [] and asked == [page.as_uri()]


def test_a_fall_is_shown_as_a_fall(chromium, page):
    tab, told, _ = opened(chromium, page, 1280)
    said, curves, box = tab.locator("#said"), tab.locator("#curves svg"), tab.locator("#fall")
    tab.locator("#pace").select_option(index=0)
    assert not box.is_visible()
    tab.locator("#foot").select_option(index=SOFT)
    assert "fell in 1 of 2 episodes. Shown: the mean stride of the others." in said.inner_text()
    assert curves.count() == 10 and tab.locator("#where").inner_text().endswith("% of the stride")
    box.check()
    fall = data_of(page)["cells"][SOFT]["fall"]
    assert fall["reason"].startswith("fell: ")
    assert f"Shown: the end of an episode, after {fall['after']:.1f} s ({fall['reason']})." in said.inner_text()
    assert curves.count() == 0 and tab.locator("#where").inner_text() == "0.00 s"
    box.uncheck()
    tab.locator("#pace").select_option(index=1)  # at 1.5 m/s both fall
    assert "fell in 2 of 2 episodes. Shown: the end of an episode" in said.inner_text()
    assert not box.is_visible() and curves.count() == 0
    assert "2 of 2" in tab.locator("tr.shown").inner_text() and "–" in tab.locator("tr.shown").inner_text()
    tab.locator("#beside").select_option(index=1)  # a sound foot, whose curves stay
    assert curves.count() == 10 and tab.locator("#where").inner_text().endswith("% of the stride")
    tab.close()
    assert told == []


def test_the_keyboard_chooses_in_a_list_or_walks_through_the_stride(chromium, page):
    tab, _, _ = opened(chromium, page, 1280)
    body = tab.locator("svg[data-frame]")
    tab.locator("#foot").focus()
    tab.keyboard.press("ArrowDown")
    assert tab.locator("#foot").evaluate("e => e.selectedIndex") == 1 and body.get_attribute("data-frame") == "0"
    tab.locator("#foot").blur()
    tab.keyboard.press("ArrowRight")
    assert body.get_attribute("data-frame") == "1"
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
    tab.locator("#beside").select_option(index=SOFT + 1)
    faults = axe.Axe().run(tab).response["violations"]
    tab.close()
    assert [(fault["id"], fault["impact"]) for fault in faults] == []


def test_the_committed_page_is_the_studys_of_this_script(page):
    assert COMMITTED.stat().st_size < 2_500_000
    own, made = data_of(COMMITTED), (COMMITTED.read_text(encoding="utf-8"), page.read_text(encoding="utf-8"))
    study = Walks()
    grid = own["grid"]
    assert (tuple(grid["mass"]), tuple(grid["speed"]), tuple(grid["foot"])) == (
        study.mass,
        study.speed,
        tuple(PAGE_FEET),
    )
    assert len(own["cells"]) == len(study.mass) * len(study.speed) * len(PAGE_FEET)
    without_data = [re.sub(r'id="data">.*?</script>', "", text, flags=re.DOTALL) for text in made]
    assert without_data[0] == without_data[1]
    assert "command: springfoot study walks\n" in own["made"]
