"""report.html in a real browser, Debian's Chromium by Playwright, from file://, as wide as a desk's and a phone's."""

import csv
import re
from dataclasses import replace

import imageio.v3 as iio
import pytest

from springfoot.evaluation.numbers.metrics import measure
from springfoot.evaluation.page.report_page import write_page
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import record
from springfoot.files.markdown import table

CUT_OFF = """() => [...document.querySelectorAll("svg text")].filter(text => {
  const own = text.getBoundingClientRect(), around = text.ownerSVGElement.getBoundingClientRect();
  return own.width && (own.left < around.left - 1 || own.right > around.right + 1
    || own.top < around.top - 1 || own.bottom > around.bottom + 1);
}).map(text => text.textContent)"""
"""Words of the drawings that reach beyond them."""
CROWDED = """() => [...document.querySelectorAll("svg text.unit[transform]")].flatMap(unit => {
  const right = unit.getBoundingClientRect().right;
  return [...unit.ownerSVGElement.querySelectorAll("text[text-anchor='end']:not(.unit)")].filter(
    text => text.getBoundingClientRect().left < right).map(text => text.textContent);
})"""
"""Numbers of an axis that reach into its unit."""
BROKEN = """() => [...document.querySelectorAll("td.number")].filter(cell => {
  const words = document.createRange(); words.selectNodeContents(cell);
  return new Set([...words.getClientRects()].map(line => line.top)).size > 1;
}).map(cell => cell.textContent)"""
"""Numbers of the tables that stand on more than one line."""


def walked(name, **given):
    policy, settings = policy_and_settings(name, {"episode_seconds": 8.0} | given)
    recording = record(policy, settings, name=name, episodes=2, threads=1)
    return recording, measure(recording)


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "report.html"
    other = walked("constant", right_foot="no_toe", left_foot={"kind": "rigid_toe", "orthosis": {}})
    write_page(path, [walked("schedule"), other], "evaluate.py schedule constant")
    return path


def opened(browser, page, width, **how):
    """A tab with the page, and what its console told and what it asked for."""
    tab = browser.new_page(viewport={"width": width, "height": 900}, **how)
    told, asked = [], []
    tab.on("console", lambda message: told.append(message.text))
    tab.on("pageerror", lambda error: told.append(str(error)))
    tab.on("request", lambda request: asked.append(request.url))
    tab.goto(page.as_uri())
    return tab, told, asked


@pytest.mark.parametrize("width", [1280, 390])
def test_in_a_browser_nothing_fails_is_loaded_or_cut_off_and_all_follows_the_scrubber(chromium, page, width):
    tab, told, asked = opened(chromium, page, width)
    assert tab.evaluate(CUT_OFF) == [] and tab.evaluate(CROWDED) == []
    assert tab.evaluate("document.documentElement.scrollWidth <= document.documentElement.clientWidth")
    cursors, walkers = tab.locator(".cursor"), tab.locator("svg[data-frame]")
    assert walkers.count() == 2 and cursors.count() > 20

    def at():
        return [each.get_attribute("data-frame") for each in walkers.all()], cursors.first.get_attribute("data-percent")

    (begin, _), first = at()
    for title in ("CoM height", "Ankle, stiffness K"):  # where the stride begins, so do step and leg
        assert float(tab.locator(f"svg[aria-label^='{title}'] .cursor").get_attribute("data-percent")) < 3.0
    tab.keyboard.press("ArrowRight")
    (after, _), second = at()
    assert (begin, after) == ("0", "1") and float(second) > float(first)
    tab.locator("#scrub").evaluate("each => { each.value = 250; each.dispatchEvent(new Event('input')) }")
    frames, percent = at()
    assert float(percent) == pytest.approx(50.0, abs=1.5) and int(frames[0]) > 40
    dot = tab.locator("svg[aria-label^='Knee angle'] .dot").first
    line = tab.locator("svg[aria-label^='Knee angle'] .cursor").first
    assert float(dot.get_attribute("cx")) == pytest.approx(float(line.get_attribute("x1")), abs=2.0)
    tab.keyboard.press(" ")
    assert tab.locator("#play").inner_text() == "Pause"
    while at()[0] == frames:  # it plays, so that this ends
        tab.wait_for_timeout(50)
    tab.locator("#play").click()
    tab.keyboard.press("Home")  # of the walk, though the button has the focus
    assert at()[0][0] == "0"
    assert tab.evaluate(BROKEN) == []
    tab.close()
    assert told == [] and asked == [page.as_uri()]


@pytest.mark.parametrize("width", [1280, 390])
@pytest.mark.parametrize("ends", [(0.0, 5e-24), (0.0, 3e-4), (-1.2e-4, 1.1e-4), (-2e4, 2e4), (0.0, 0.0123)])
def test_numbers_of_any_size_stand_on_an_axis(chromium, page, width, ends):
    tab, told, _ = opened(chromium, page, width)
    tab.evaluate(
        "ends => frame(document.querySelector('.grid'), 'a title', '% of the stride', 'N·m', [0, 100], ends)", ends
    )
    assert tab.evaluate(CUT_OFF) == [] and tab.evaluate(CROWDED) == [] and told == []
    tab.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 390])
def test_axe_finds_no_fault(chromium, page, width, scheme):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="pip install axe-playwright-python")
    tab, _, _ = opened(chromium, page, width, color_scheme=scheme)
    faults = axe.Axe().run(tab).response["violations"]
    tab.close()
    assert [(fault["id"], fault["impact"]) for fault in faults] == []


@pytest.mark.parametrize(("width", "height"), [(1280, 900), (390, 844)])
def test_the_first_screen_has_the_walker_its_falls_and_curves(chromium, page, tmp_path, width, height):
    write_page(tmp_path / "report.html", [walked("schedule")])
    for path in (tmp_path / "report.html", *([page] if width > 1000 else [])):
        tab, _, _ = opened(chromium, path, width)
        falls = tab.get_by_text("Never fell").or_(tab.get_by_text("Fell in")).first.bounding_box()
        body = tab.locator("svg[data-frame]").first.bounding_box()
        curve = tab.locator("svg[aria-label^='Thigh angle']").bounding_box()
        assert falls["y"] < 200 and body["y"] < 400 and curve["y"] + 0.9 * curve["height"] < height
        tab.close()


@pytest.mark.parametrize("width", [1280, 390])
def test_an_introduction_is_read_by_all_and_its_table_moves_within_the_page(chromium, tmp_path, width):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="pip install axe-playwright-python")
    wide = table(["foot", *(f"number {k}" for k in range(9))], [["none", *9 * ["−53 % (−55 to −51)"]]])
    write_page(tmp_path / "report.html", [walked("schedule")], introduction=f"**Least with none.**\n\n{wide}\n\n- one")
    tab, told, _ = opened(chromium, tmp_path / "report.html", width)
    assert tab.evaluate("document.documentElement.scrollWidth <= document.documentElement.clientWidth")
    assert tab.locator("#answer").evaluate("each => each.scrollWidth > each.clientWidth")
    assert tab.locator("#answer").bounding_box()["y"] < tab.locator("#who").bounding_box()["y"]
    faults = axe.Axe().run(tab).response["violations"]
    tab.close()
    assert [(fault["id"], fault["impact"]) for fault in faults] == [] and told == []


@pytest.fixture(scope="module")
def feet(tmp_path_factory):
    """A page of one walk under six names, said to be on six feet."""
    path = tmp_path_factory.mktemp("feet") / "report.html"
    recording, gait = walked("schedule")
    walks = []
    for stiffness in (0, 2, 4, 6, 9, 12):
        name = f"{stiffness} N·m/deg"
        foot = {"kind": "weak", "strength": 0.25, "orthosis": {"ankle_stiffness": float(stiffness)}}
        environment = gait.metrics["environment"] | {"left_foot": foot, "right_foot": foot}
        metrics = gait.metrics | {"policy": name, "environment": environment}
        settings = replace(recording.settings, left_foot=foot, right_foot=foot)
        walks.append((replace(recording, policy=name, settings=settings), replace(gait, metrics=metrics)))
    words = "springs of the user's, {:g} N·m/deg beside a calf of 25 %"
    write_page(path, walks, words_of=lambda foot: words.format(foot.numbers["orthosis"]["ankle_stiffness"]))
    return path


@pytest.mark.parametrize(("width", "height"), [(1280, 900), (390, 844)])
def test_of_six_feet_one_is_shown_or_all_with_every_value(chromium, feet, width, height):
    tab, told, _ = opened(chromium, feet, width)
    curve = tab.locator("svg[aria-label^='Thigh angle']")
    box = curve.bounding_box()
    assert box["y"] + 0.9 * box["height"] < height
    lines, values = curve.locator(".mean"), tab.locator("figure", has=curve).locator(".value .own")
    shown = [line.is_visible() for line in lines.all()]
    assert shown == [True, *5 * [False]] and values.count() == 1
    tab.select_option("#shown", label="9 N·m/deg")
    assert [line.is_visible() for line in lines.all()].index(True) == 4
    tab.select_option("#shown", label="all")
    assert all(line.is_visible() for line in lines.all())
    curve.scroll_into_view_if_needed()
    curve.hover()
    edges = tab.locator("figure", has=curve).bounding_box()
    boxes = [value.bounding_box() for value in values.all()]
    assert len(boxes) == 6
    assert all(edges["x"] <= each["x"] and each["x"] + each["width"] <= edges["x"] + edges["width"] for each in boxes)
    assert tab.evaluate("document.documentElement.scrollWidth <= document.documentElement.clientWidth")
    assert "both feet springs of the user's" in tab.locator("#who").inner_text() and told == []
    tab.close()


@pytest.mark.parametrize(("width", "height"), [(1280, 900), (390, 844)])
def test_of_all_six_feet_a_curve_is_in_the_first_screen(chromium, feet, width, height):
    tab, _, _ = opened(chromium, feet, width)
    tab.select_option("#shown", label="all")
    tab.evaluate("scrollTo(0, 0)")
    box = tab.locator("svg[aria-label^='Thigh angle']").bounding_box()
    assert box["y"] + 0.9 * box["height"] < height
    tab.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 390])
def test_pointing_at_a_curve_reads_it(chromium, page, width, scheme):
    tab, told, _ = opened(chromium, page, width, color_scheme=scheme)
    panel = tab.locator("svg[aria-label^='Knee angle']")
    value = tab.locator("figure", has=panel).locator(".value")
    panel.scroll_into_view_if_needed()
    before = value.text_content()
    box = panel.bounding_box()
    left, right = (edge * box["width"] / 340 for edge in (58, 330))  # of the axis, as `frame` draws it
    panel.hover(position={"x": left + 0.72 * (right - left), "y": box["height"] / 2})
    read = value.text_content()
    knee = tab.evaluate("policies[0].panels.find(p => p.title === 'Knee angle').mean[72]")
    people = tab.evaluate("policies[0].panels.find(p => p.title === 'Knee angle').people[72]")
    assert read.startswith("72 %: ") and f"{knee:.1f}" in read and read.endswith(f"people {people:.1f}deg")
    tab.mouse.move(1, 1)
    assert value.text_content() == before and told == []
    tab.close()


def test_values_have_a_unit_and_one_precision(chromium, feet):
    tab, _, _ = opened(chromium, feet, 1280)
    panel = tab.locator("svg[aria-label^='Knee angle']")
    panel.scroll_into_view_if_needed()
    panel.hover()
    read = tab.locator("figure", has=panel).locator(".value").inner_text().split("\n")
    assert re.fullmatch(r"-?\d+\.\d ± \d+\.\d", read[1]) and re.fullmatch(r"people -?\d+\.\d", read[2])
    assert read[3] == "deg"
    assert tab.evaluate("[teller([-71, 3])(0.04), teller([0, 1.2])(0.5), teller([0, 520])(41.6), teller([])(0)]") == [
        *("0.0", "0.50", "42", "0"),
    ]
    tab.close()


def test_the_caption_explains_the_lines_that_are_shown_and_a_plan_where_one_is_drawn(chromium, feet):
    tab, _, _ = opened(chromium, feet, 1280)
    caption = tab.get_by_text("Lines and bands")
    assert caption.inner_text().startswith("Lines and bands: mean ± SD over strides of 0 N·m/deg (solid). Grey: ")
    tab.select_option("#shown", label="4 N·m/deg")
    assert "of 4 N·m/deg (dotted). Grey" in caption.inner_text()
    tab.select_option("#shown", label="all")
    assert "0 N·m/deg (solid), 2 N·m/deg (dashed), 4 N·m/deg (dotted)" in caption.inner_text()
    assert "Dotted upright lines: toe-off." in caption.inner_text() and "plan" not in caption.inner_text()
    strokes = tab.locator(".toe-off").evaluate_all("lines => lines.map(line => line.getAttribute('stroke-dasharray'))")
    assert set(strokes) == {"2 2"}  # as of the lines that are called dotted
    with_plan = tab.locator("section", has=tab.locator(".plan"))
    assert with_plan.count() == tab.get_by_text("Dotted: the plan.").count() == 1
    assert with_plan.get_by_text("Dotted: the plan.").count() == 1
    tab.close()


def test_a_drawing_is_saved_as_a_picture_and_as_numbers(chromium, page, tmp_path):
    tab, told, asked = opened(chromium, page, 1280)
    with tab.expect_download() as picture:
        tab.get_by_label("PNG of Knee angle").click()
    assert picture.value.suggested_filename == "Knee_angle.png"
    picture.value.save_as(tmp_path / "knee.png")
    pixels = iio.imread(tmp_path / "knee.png")
    assert pixels.shape[:2] == (430, 680) and pixels.std() > 10  # twice the drawing, and not one colour
    with tab.expect_download() as numbers:
        tab.get_by_label("CSV of Knee angle").click()
    numbers.value.save_as(tmp_path / "knee.csv")
    head, *rows = list(csv.reader((tmp_path / "knee.csv").read_text(encoding="utf-8").splitlines()))
    assert head[:3] == ["percent", "schedule mean", "schedule sd"] and head[-2:] == ["people mean", "people sd"]
    mean = tab.evaluate("policies[0].panels.find(p => p.title === 'Knee angle').mean")
    assert [float(row[1]) for row in rows] == pytest.approx(mean)
    assert told == [] and [address for address in asked if not address.startswith("data:")] == [page.as_uri()]
    tab.close()


def test_feet_are_drawn_by_what_they_are(chromium, page):
    tab, _, _ = opened(chromium, page, 1280)
    body = tab.locator("svg[data-frame]").nth(1)
    kinds = [each.get_attribute("class") for each in body.locator(".joint").all()]
    assert kinds == ["joint muscles", "joint lock", "joint muscles", "joint lock"]  # right leg, then left
    shown = [each.get_attribute("visibility") for each in body.locator(".joint").all()]
    assert shown == ["visible", "hidden", "visible", "visible"]  # a foot of one piece has no toe joint
    assert "left foot rigid toe (in an orthosis" in tab.locator("figcaption").nth(1).inner_text()
    assert "locked" in body.text_content()
    knee = tab.locator("svg[aria-label^='Knee angle']")
    lines = knee.locator(".mean")
    assert lines.count() == 3  # one policy, and both legs of the other
    drawn = [
        line.evaluate("each => [getComputedStyle(each).stroke, each.getAttribute('stroke-opacity')]")
        for line in lines.all()
    ]
    values = tab.locator("figure", has=knee).locator(".value .own")
    told = [value.evaluate("each => getComputedStyle(each).borderLeftColor") for value in values.all()]
    assert told == [
        shade if opacity == "1" else shade.replace("rgb(", "rgba(").replace(")", f", {opacity})")
        for shade, opacity in drawn
    ]
    assert len(set(told)) == 3
    assert [value.inner_text().rpartition(" ")[0] for value in values.all()] == ["", "left", "right"]
    tab.close()


def test_the_page_has_the_colours_that_its_browser_prefers_until_the_reader_turns_them(chromium, page):
    tab, _, _ = opened(chromium, page, 1280, color_scheme="dark")
    light, dark = "rgb(255, 255, 255)", "rgb(20, 24, 28)"
    seen = [tab.evaluate("getComputedStyle(document.body).backgroundColor")]
    tab.locator("#theme").click()
    seen += [tab.evaluate("getComputedStyle(document.body).backgroundColor")]
    assert seen == [dark, light]
    tab.close()


def test_on_paper_the_page_is_black_on_white_without_its_buttons(chromium, page):
    tab, _, _ = opened(chromium, page, 1280, color_scheme="dark")
    tab.emulate_media(media="print")
    assert not tab.locator(".controls").is_visible() and not tab.get_by_text("Space plays").is_visible()
    assert tab.get_by_text("Lines and bands").is_visible()  # which line is whose
    assert tab.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert tab.evaluate("getComputedStyle(document.body).color") == "rgb(0, 0, 0)"
    tab.close()
