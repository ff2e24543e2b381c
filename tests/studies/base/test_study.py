"""What every study does alike: its flags, its folder, its page, and the commands that stand for it."""

import dataclasses
import io
from typing import Any, ClassVar

import pytest

from springfoot.cli.main import ASKED_BY_USERS, STUDIES, main, study_class
from springfoot.errors import SpringfootError
from springfoot.files.markdown import plus_minus
from springfoot.files.writing import csv_text, whole_folder
from springfoot.gait.people.scores import mean_sd
from springfoot.studies.base.study import QUICK_NOTE, Answer, Study, WalkingStudy


@dataclasses.dataclass(frozen=True, kw_only=True)
class Counted(WalkingStudy):
    """How many seconds were told."""

    QUICK: ClassVar[dict[str, Any]] = {"episodes": 2}

    def ask(self, progress):
        progress(self.seconds)
        files = {
            "counted.csv": csv_text(["episodes"], [[self.episodes]]),
            "a/b.png": lambda path: path.write_bytes(b""),
        }
        text = f"{self.episodes} episodes"
        return Answer(text=text, files=files, failed=self.seed == 1)


def test_episodes_are_told_with_their_seeds():
    assert Counted(episodes=3, seconds=12.0, seed=4).what_ran == "3 episodes × 12 s, seeds 4–6"
    assert Counted(episodes=1, seconds=6.5, seed=4).what_ran == "1 episode × 6.5 s, seed 4"


def test_a_study_prints_its_answer_and_writes_its_report_and_files(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    study = Counted(command="springfoot study counted --out there")
    assert (study.run("counted"), dataclasses.replace(study, seed=1).run("counted")) == (0, 1)
    said = capsys.readouterr().out
    assert said.startswith("20 episodes\n\nResults: runs/counted-1 (report.md, counted.csv, a/b.png)\n")
    assert sorted(path.name for path in (tmp_path / "runs").iterdir()) == ["counted-1", "counted-2"]
    assert (tmp_path / "runs" / "counted-1" / "counted.csv").read_text() == "episodes\n20\n"
    assert (tmp_path / "runs" / "counted-1" / "a" / "b.png").exists()  # beside the report, which shows it
    report = "20 episodes\n\nMade by `springfoot study counted`.\n"
    assert (tmp_path / "runs" / "counted-1" / "report.md").read_text() == report


def test_a_pipe_that_closes_early_loses_no_folder(tmp_path, monkeypatch):
    class Closed(io.StringIO):
        def write(self, text):
            raise BrokenPipeError

    monkeypatch.setattr("sys.stdout", Closed())
    with pytest.raises(BrokenPipeError):
        Counted(out=tmp_path / "new").run("counted")
    assert (tmp_path / "new" / "counted.csv").exists()


def test_quick_takes_its_own_counts_and_says_that_figures_mean_nothing(tmp_path, capsys):
    study = Counted(quick=True, episodes=500, out=tmp_path / "new")
    assert study.run("counted") == 0
    assert capsys.readouterr().out.startswith(f"{QUICK_NOTE}\n\n2 episodes\n")
    assert QUICK_NOTE in (tmp_path / "new" / "report.md").read_text()


@pytest.mark.parametrize(
    ("flags", "said"),
    [
        ({"out": "old"}, "old exists already: out must be a new folder"),
        ({"episodes": 0}, "episodes must be"),
        ({"seconds": 0.0}, "seconds must be"),
        ({"seed": -1}, "seed must be"),
        ({"episodes": -1, "quick": True}, "episodes must be"),
    ],
)
def test_what_cannot_be_is_refused_before_anything_is_asked(tmp_path, flags, said):
    (tmp_path / "old").mkdir()
    given = {name: tmp_path / value if isinstance(value, str) else value for name, value in flags.items()}
    with pytest.raises(SpringfootError, match=said):
        Counted(**{"out": tmp_path / "new"} | given).run("counted")
    assert [path.name for path in tmp_path.rglob("*")] == ["old"]


def test_a_folder_is_there_whole_or_not_at_all(tmp_path):
    def write_and_fail(folder):
        (folder / "half").touch()
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), whole_folder(tmp_path / "new", tmp_path / "free") as (folder, _):
        write_and_fail(folder)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", STUDIES)
def test_every_study_has_the_shared_flags_and_quick_sets_flags_it_has(name):
    study = study_class(name)
    fields = {field.name for field in dataclasses.fields(study)}
    assert issubclass(study, Study) and {"quick", "out"} <= fields
    assert set(study.QUICK) <= fields and study.QUICK


def test_help_lists_the_studies_that_users_ask_for_and_all_of_them_when_asked(capsys):
    assert (main(["study"]), main(["study", "--help"]), main(["study", "--all"])) == (0, 0, 0)
    some, again, everything = (text.splitlines() for text in capsys.readouterr().out.split("usage: ")[1:])
    assert some == again
    listed = [[line.split()[0] for line in text if line.startswith("  ")] for text in (some, everything)]
    assert listed == [list(ASKED_BY_USERS), list(STUDIES)]


def test_unknown_commands_and_studies_are_one_line_that_names_those_there_are(capsys):
    assert (main(["walk"]), main(["study", "walk"])) == (2, 2)
    first, second = capsys.readouterr().err.splitlines()
    known = (
        "train, evaluate, live, feet, person, score, export, submit, judge, study, datasets, examples and completion"
    )
    assert first == f"springfoot: error: no command 'walk'; there are {known}"
    assert second.startswith("springfoot study: error: no study 'walk'; there are compare, bodies, ")


def test_a_spread_stands_one_way():
    assert plus_minus(mean_sd([1.0, 2.0]), ".1f") == "1.5 ± 0.7"
    assert (plus_minus(mean_sd([1.0]), ".1f"), plus_minus(mean_sd([1.0]), ".1f", alone=False)) == ("1.0", "1.0 ± –")
    assert (plus_minus(mean_sd([]), ".1f"), plus_minus(mean_sd([]), ".1f", alone=False)) == ("–", "– ± –")


def test_a_csv_file_holds_six_digits_and_nothing_for_what_is_missing():
    assert csv_text(["a", "b"], [[1, 2 / 3], [None, float("nan")], ["x,y", True]]) == 'a,b\n1,0.666667\n,\n"x,y",True\n'
