"""Help of commands that refuse some settings says which."""

import re
from itertools import pairwise

import pytest

from springfoot.cli.evaluate import evaluate_main
from springfoot.cli.live import live_main
from springfoot.envs.settings import DRAWN_SETTINGS
from springfoot.evaluation.live.refused import LIVE_REFUSES


@pytest.mark.parametrize(("command", "refused"), [(live_main, LIVE_REFUSES), (evaluate_main, DRAWN_SETTINGS)])
def test_help_marks_every_flag_that_is_refused_and_no_other(monkeypatch, capsys, command, refused):
    monkeypatch.setenv("COLUMNS", "80")
    with pytest.raises(SystemExit, match=r"^0$"):
        command(["--help"])
    flag, text = r"--[a-z][a-z-]+(?= )", capsys.readouterr().out
    marked = {before for before, word in pairwise(re.findall(rf"{flag}|Refused: ", text)) if word == "Refused: "}
    assert marked == {f"--{name.replace('_', '-')}" for name in refused}
