"""Write the reference pages that are made from the code: `make docs` runs it, a test compares."""

import dataclasses
import inspect
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from springfoot.agents import TrainingConfig, policy_card
from springfoot.agents.policies import SHIPPED
from springfoot.cli.main import STUDIES
from springfoot.command_line import field_help
from springfoot.envs.env import SegmentedFootBiped
from springfoot.envs.settings.feet import KINDS, ORTHOSIS_NUMBERS, SEGMENT_RATIOS
from springfoot.envs.settings.settings import THEME_OF, THEMES, BipedSettings
from springfoot.envs.task.observation_entries import OBSERVATION, PERSON_OBSERVATION
from springfoot.evaluation.benchmark.leaderboard import leaderboard
from springfoot.files.markdown import table

FOLDER = Path(__file__).parent
SUBMISSIONS = FOLDER.parent / "benchmarks" / "submissions"
NOTE = "<!-- Made from the code by `make docs`; do not edit. -->"
COMMANDS = [
    ("`springfoot train`", "train a policy; `train.py` is the same"),
    ("`springfoot evaluate`", "evaluate policies; `evaluate.py` is the same"),
    ("`springfoot live`", "steer a walk in a browser"),
    ("`springfoot feet`", "compare springs or feet on learned persons"),
    ("`springfoot person`", "tell one person's quasi-stiffness from their motion files"),
    ("`springfoot score`", "hold any gait's motion files against people"),
    ("`springfoot export`", "write a policy as an ONNX file"),
    ("`springfoot submit`", "walk a policy on a frozen task of the benchmark, and write a submission"),
    ("`springfoot judge`", "repeat submissions, and walk them on seeds drawn from their digest"),
    ("`springfoot datasets`", "write Minari sets of walks, for offline learning"),
    ("`springfoot examples`", "list or copy programs to start from"),
    ("`springfoot completion`", "print the tab completion of commands, policies and flags for bash or zsh"),
]


def _rows(dataclass: Any, names: list[str] | None = None) -> Iterator[tuple[str, ...]]:
    """Yield name, default and meaning of the fields of a dataclass."""
    meaning = field_help(dataclass)
    for item in dataclasses.fields(dataclass):
        if names is None or item.name in names:
            default = "" if item.default is dataclasses.MISSING else f"`{item.default}`"
            yield f"`{item.name}`", default, meaning[item.name].replace("|", "\\|")


def _names(head: list[str], rows: list[tuple[str, ...]]) -> str:
    """Return a table with whole names in its first column, as docs/site.css says."""
    return f'<div class="names" markdown>\n\n{table(head, rows)}\n\n</div>'


def _foot_numbers() -> str:
    """Return the table of the numbers of feet, with their ranges."""
    owners = {f"`{kind}`": numbers for kind, numbers in KINDS.items() if numbers}
    owners |= {"`orthosis` of every kind": ORTHOSIS_NUMBERS, "every kind": SEGMENT_RATIOS}
    rows = [
        (owner, f"`{name}`", "" if one.usual is None else f"{one.usual:g}", f"{one.low:g} to {one.high:g}", one.unit)
        for owner, numbers in owners.items()
        for name, one in numbers.items()
    ]
    return _names(["foot", "number", "default", "range", "unit"], rows)


def settings() -> str:
    """Return the page of every setting of environment and training."""
    head = ["setting", "default", "meaning"]
    parts = ["# Settings", "Every setting of the environment is a keyword of `gym.make` and a flag of every command."]
    for theme, words in THEMES.items():
        names = [name for name, its in THEME_OF.items() if its == theme]
        parts += [f"## {theme.capitalize()}", words, _names(head, list(_rows(BipedSettings, names)))]
    parts += ["## Numbers of a foot", "Of the dictionaries of `left_foot` and `right_foot`.", _foot_numbers()]
    parts += ["## Training", "Flags of `springfoot train`.", _names(head, list(_rows(TrainingConfig)))]
    return "\n\n".join(parts)


def commands() -> str:
    """Return the page of every command."""
    studies = [(f"`springfoot study {name}`", question) for name, (_, question) in STUDIES.items()]
    parts = [
        "# Commands",
        "Each takes `--help`, which lists its flags in groups. A bad flag is one line on standard error, exit code 2.",
        table(["command", "purpose"], COMMANDS),
        "## Studies",
        table(["command", "question"], studies),
    ]
    return "\n\n".join(parts)


def observations() -> str:
    """Return the page of the environment: its docstring, with the entries of a person's observation in place of the
    module that lists them, and a link in place of its list of settings."""
    before, _, rest = inspect.getdoc(SegmentedFootBiped).partition("## Arguments")
    before = before.replace("\n(`springfoot.envs.task.observation_entries`).", f":\n\n{_person_entries()}")
    after = rest.partition("\nand `render_mode`")[2]
    settings_line = "Every [setting](settings.md), and `render_mode`"
    return f"# Observations, actions, reward\n\n{before}## Arguments\n{settings_line}{after}".rstrip()


def _person_entries() -> str:
    """Return the table of the entries that only a person observes."""
    entries = enumerate(PERSON_OBSERVATION[len(OBSERVATION) :], len(OBSERVATION))
    rows = [(str(n), one.name, one.unit, f"{one.low:g}", f"{one.high:g}", one.meaning) for n, one in entries]
    words = "300 and 60 N m/rad are of 1.70 m and 63 kg, and scale with mass x height."
    return f"{table(['Num', 'Observation', 'Divided by', 'Min', 'Max', 'Meaning'], rows)}\n\n{words}"


def policies() -> str:
    """Return the page of the policies that come with the package: a model card each."""
    words = "Each is a name for every command, and for `springfoot.agents.load_policy`."
    return "\n\n".join(["# Policies of the package", words, *map(policy_card, SHIPPED)])


def benchmark() -> str:
    """Return the page of the leaderboard."""
    words = (
        "Submissions to the frozen tasks, each repeated by `springfoot judge`; at most eight a task, random stiffness "
        "and the best constant springs among them. [The benchmark](benchmark.md) says what they are and how they are "
        "scored. *Drawn*: seeds and bodies that follow from the policy's digest. Trainings that differ in the seed "
        "alone are one entry: the interquartile mean of their returns, with a 95 % bootstrap interval; of all tasks, "
        "that of all their scores together. `make benchmark` makes the entries of this project."
    )
    return f"# Leaderboard\n\n{words}\n\n{leaderboard(SUBMISSIONS)}"


def pages() -> dict[str, str]:
    """Return the text of each page by its path below `FOLDER`, without suffix."""
    texts = {
        "reference/settings": settings(),
        "reference/commands": commands(),
        "reference/observations": observations(),
        "reference/policies": policies(),
        "results/leaderboard": benchmark(),
    }
    return {name: f"{NOTE}\n\n{text}\n" for name, text in texts.items()}


if __name__ == "__main__":
    for name, text in pages().items():
        (FOLDER / f"{name}.md").write_text(text, encoding="utf-8")
