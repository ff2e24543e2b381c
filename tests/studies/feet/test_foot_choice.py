"""The command `springfoot feet`: the numbers of `study orthosis` on the same feet, its page, its refusals."""

import csv

import numpy as np
import pytest

from springfoot.cli.main import main
from springfoot.command_line import field_help
from springfoot.envs.settings import settings_from
from springfoot.errors import SpringfootError
from springfoot.files.markdown import html_of
from springfoot.gait.plan import PLAN_SPEED_RANGE
from springfoot.studies.feet.foot_choice import (
    CANNOT_SAY,
    LEAST_SECONDS,
    LEAST_SPEED,
    OTHER_SPEED,
    PRICE_NAMES,
    FootChoice,
    named_feet,
    price_cells,
    price_figure,
)
from springfoot.studies.feet.orthosis import MOST_SPRING

QUICK = ["feet", "--quick", "--threads", "1"]


def read(path) -> list[dict[str, str]]:
    """Return the rows of a CSV file."""
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.mark.slow
def test_springs_have_the_numbers_of_the_study_of_orthoses(tmp_path, capsys):
    words = ["--calf", "0.2", "--speed", "1.0", "--spring", "0", "3.6", "8.7"]
    assert main([*QUICK, *words, "--out", str(tmp_path / "feet")]) == 0
    text = capsys.readouterr().out
    study = ["study", "orthosis", "learned", "--quick", "--threads", "1", "--beside", "None"]
    assert main([*study, "--out", str(tmp_path / "study")]) == 0
    feet = {row["foot"]: row for row in read(tmp_path / "feet" / "feet.csv")}
    study_rows = [row for row in read(tmp_path / "study" / "walks.csv") if float(row["speed_m_s"]) == 1.0]
    for spring in ("0", "3.6", "8.7"):
        (expected,) = (row for row in study_rows if float(row["spring"]) == float(spring))
        own = feet[f"{spring} N·m/deg"]
        assert own["speed_m_s"] == expected["walked_m_s"]
        for name in ("falls", "fibre_J_kg_m", "effort", "push_off_J_kg", "sound_peak_bw", "knee_moment_Nm_kg"):
            assert own[name] == expected[name]
    assert "What this cannot say" in text and "the nearest to the asked speed that all walk" in text
    page = (tmp_path / "feet" / "report.html").read_text(encoding="utf-8")
    assert all(page.count(name) > 1 for name in feet)  # a tab for each foot
    assert html_of(text[text.index("**") : text.index("\n\n1.7 m, 63 kg")]) in page  # the sentences and the table
    assert (tmp_path / "feet" / "feet.png").stat().st_size > 10_000


@pytest.mark.slow
def test_what_is_said_follows_from_prices_csv(tmp_path, capsys):
    words = ["--height", "1.8", "--mass", "80", "--calf", "0.25", "--speed", "1.1", "--spring", "4", "6"]
    assert main([*QUICK, *words, "--out", str(tmp_path / "feet")]) == 0
    text = capsys.readouterr().out
    rows = read(tmp_path / "feet" / "prices.csv")
    (speed,) = {float(row["speed_m_s"]) for row in rows}
    assert f"**Compared at {speed:.2f} m/s walked, as not on every foot all persons reach the asked 1.1 m/s." in text
    (line,) = (line for line in text.splitlines() if line.startswith("| 6 N·m/deg"))
    cells = [cell.strip() for cell in line.split("|")]
    for column, place in (("fibre_J_kg_m", 4), ("effort", 6)):
        of = {row["foot"]: float(row[column]) for row in rows}  # of one person and one episode
        assert cells[place] == f"{of['6 N·m/deg']:.2f}"
        change = round(100 * (of["6 N·m/deg"] / of["4 N·m/deg"] - 1))
        assert cells[place + 1] == (f"{change:+d} %".replace("-", "−") if change else "0 %")


@pytest.mark.parametrize(
    ("words", "error"),
    [
        ([], "give either --spring or --foot, such as --spring 0 2 4 6 or --foot intact --foot rigid"),
        (["--spring", "0", "2", "--foot", "rigid"], "give either --spring or --foot, such as"),
        (["--spring", "0", "2", "--seconds", "3"], "seconds must be a finite number >= 6 s, got 3.0"),
        (["--spring", "2"], "give 2 to 8 different springs or feet, got 1"),
        (["--spring", "0", "2", "2", "4"], "error: --spring: 2 N·m/deg is given 2 times; give each once"),
        (["--spring", "4", "4.0000001"], "error: --spring: 4 N·m/deg is given 2 times; give each once"),
        (["--spring", "0", "-0"], "error: --spring: 0 N·m/deg is given 2 times; give each once"),
        (["--spring", "0", "2", "--persons"], "error: --persons: give one person at least, such as learned"),
        (["--spring", "0", "2", "--persons", "learned", "learned"], "--persons: learned is given 2 times; give each"),
        (["--spring", "0", "2", "--persons", "runs/a", "learned", "runs/a/"], "runs/a is given 2 times; give each"),
        (["--foot", "rigid", "--foot", "rigid"], "--foot: rigid is given 2 times; give each once"),
        (["--spring", *map(str, range(9))], "give 2 to 8 different springs or feet, got 9"),
        (["--foot", "rigid", "--foot", "intact", "--calf", "0.3"], "--calf and --rest-deg go with --spring"),
        (["--foot", "rigid", "--foot", "ridig"], "ridig"),
        (["--foot", "rigid", "--foot", "{"], "error: --foot must be JSON, but"),
        (["--foot", "rigid", "--foot", "none.csv"], "none.csv"),
        (["--spring", "0", "2", "--calf", "2"], "error: calf must be in [0.1, 0.6] (of the sound leg), got 2"),
        (["--spring", "0", "2", "--rest-deg", "40"], "error: rest_deg must be in [-30, 30] deg, got 40"),
        (["--spring", "0", "-1"], "spring must be in [0, 17.45] N m/deg, got -1"),
        (["--spring", "0", "17.4533"], "spring must be in [0, 17.45] N m/deg, got 17.4533"),
        (["--spring", "0", "2", "--speed", "0.4"], "error: speed must be in [0.48, 2] m/s, got 0.4"),
        (["--spring", "0", "2", "--quick", "--episodes", "-1"], "episodes must be"),
        (["--spring", "0", "2", "--persons", "pretrained"], "pretrained moves no person"),
        (["--spring", "0", "2", "--spring", "4"], "--spring is given twice"),
    ],
)
def test_bad_input_is_one_line(words, error, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    try:
        code = main(["feet", *words])
    except SystemExit as end:
        code = end.code
    told = capsys.readouterr().err
    assert code == 2 and error in told and told.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_ranges_of_the_help_are_those_that_are_refused_beyond():
    told = field_help(FootChoice)
    assert f"0 to {MOST_SPRING:g} [N m/deg]" in told["spring"]
    assert (
        f"{LEAST_SPEED:g} to {PLAN_SPEED_RANGE[1]:g} [m/s]; in the slower walk {100 * OTHER_SPEED:g} %" in told["speed"]
    )
    assert f"{LEAST_SECONDS:g} or more [s]" in told["seconds"]
    for spring, speed in ((MOST_SPRING, LEAST_SPEED), (0.1, PLAN_SPEED_RANGE[1])):
        choice = FootChoice(spring=(0.0, spring), speed=speed, seconds=LEAST_SECONDS)
        choice.check()
        settings_from(speed=choice.other_speed, left_foot=choice.feet[f"{spring:g} N·m/deg"])


def test_feet_have_their_words_or_the_name_of_their_file(tmp_path):
    file = tmp_path / "mine.json"
    file.write_text('{"kind": "weak", "strength": 0.2}', encoding="utf-8")
    weak = [f'{{"kind": "weak", "strength": {strength}}}' for strength in (0.25, 0.5)]
    named = named_feet([*weak, str(file), "rigid"])
    assert list(named) == [f"weak (strength {share} (of the sound leg))" for share in (0.25, 0.5)] + ["mine", "rigid"]
    other = tmp_path / "other" / "mine.json"
    other.parent.mkdir()
    other.write_text('{"kind": "rigid"}', encoding="utf-8")
    with pytest.raises(SpringfootError, match=r"^--foot: two feet are called 'mine'; give each foot once"):
        named_feet([str(file), str(other)])
    with pytest.raises(SpringfootError, match=r"^--foot: ankle_stiffness must be in \[0, 3000\] N m/rad, got 5000$"):
        named_feet(['{"kind": "passive", "ankle_stiffness": 5000}'])


def test_changes_are_against_the_first_foot_that_has_a_price():
    priced = {"4": np.full((1, 2), 3.0), "6": np.full((1, 2), 3.3)}  # none of "0", which stands before them
    assert [price_cells(priced, name) for name in ("0", "4", "6")] == [("–", "–"), ("3.00", "–"), ("3.30", "+10 %")]


def test_a_drawing_without_a_price_says_so():
    prices = np.ones((3, 5))
    for of_feet, words in (([prices, None], []), ([None, None], ["no foot has a price"])):
        figure = price_figure(["0", "4"], (0.0, 4.0), dict.fromkeys(PRICE_NAMES, of_feet))
        assert [[text.get_text() for text in ax.texts] for ax in figure.axes] == [words, words]


@pytest.mark.parametrize(
    ("persons", "whose"),
    [(("learned", "learned-3"), "learned, the first of 2 persons"), (("learned-2",), "learned-2, the one person")],
)
def test_the_page_begins_with_the_answer_over_all_persons_and_says_whose_curves_it_shows(persons, whose):
    said = FootChoice(spring=(0.0, 2.0), persons=persons).introduction("**Least with 2.**")
    assert said == f"**Least with 2.**\n\n{CANNOT_SAY}\n\nCurves and verdicts below: {whose}."
    assert CANNOT_SAY.count("\n- ") == 3
