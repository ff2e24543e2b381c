"""Pages of the reference that are made from the code while the site is built: a hook of MkDocs."""

import dataclasses
from collections.abc import Iterator
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

from springfoot.agents import TrainingConfig
from springfoot.cli.main import STUDIES
from springfoot.envs.batch.step_result import INFO
from springfoot.envs.env import SegmentedFootBiped
from springfoot.envs.physics.model import ACTIONS
from springfoot.envs.settings.settings import DEFAULT_WEIGHTS, THEME_OF, THEMES, BipedSettings
from springfoot.envs.task.observation import OBSERVATION
from springfoot.files.markdown import table
from springfoot.studies.base.flags import field_help

ROOMS = ("gait", "envs", "agents", "evaluation", "studies")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the generated pages to the site."""
    pages = {"settings": settings(), "commands": commands(), "observations": observations(), "api": api()}
    for name, text in pages.items():
        files.append(File.generated(config, f"reference/{name}.md", content=text))
    return files


def _rows(dataclass: Any, names: list[str] | None = None) -> Iterator[tuple[str, str, str]]:
    """Yield name, default and meaning of the fields of a dataclass."""
    meaning = field_help(dataclass)
    for item in dataclasses.fields(dataclass):
        if names is None or item.name in names:
            default = "" if item.default is dataclasses.MISSING else f"`{item.default}`"
            yield f"`{item.name}`", default, meaning[item.name].replace("|", "\\|")


def _names(head: list[str], rows: list[tuple[str, ...]]) -> str:
    """Return a table whose first column keeps its names whole, as docs/site.css says."""
    return f'<div class="names" markdown>\n\n{table(head, rows)}\n\n</div>'


def settings() -> str:
    """Return the page of every setting of environment and training."""
    head = ["setting", "default", "meaning"]
    parts = ["# Settings", "Every setting of the environment is a keyword of `gym.make` and a flag of every command."]
    for theme, words in THEMES.items():
        names = [name for name, its in THEME_OF.items() if its == theme]
        parts += [f"## {theme.capitalize()}", words, _names(head, list(_rows(BipedSettings, names)))]
    parts += ["## Training", "Flags of `train.py`.", _names(head, list(_rows(TrainingConfig)))]
    return "\n\n".join(parts) + "\n"


def commands() -> str:
    """Return the page of every command."""
    own = [
        ("`springfoot train`", "train a policy; `train.py` is the same"),
        ("`springfoot evaluate`", "evaluate policies; `evaluate.py` is the same"),
        ("`springfoot live`", "steer a walk in a browser"),
        ("`springfoot export`", "write a policy as an ONNX file"),
    ]
    studies = [(f"`springfoot study {name}`", question) for name, (_, question) in STUDIES.items()]
    parts = [
        "# Commands",
        "Each takes `--help`, which lists its flags in groups. A bad flag is one line on standard error, exit code 2.",
        _names(["command", "purpose"], own),
        "## Studies",
        _names(["command", "question"], studies),
    ]
    return "\n\n".join(parts) + "\n"


def observations() -> str:
    """Return the page of observation, action, `info` and reward."""
    entries = [
        (f"`{entry.name}`", str(index), entry.unit, f"{entry.low:g} to {entry.high:g}", entry.meaning)
        for index, entry in enumerate(OBSERVATION)
    ]
    weights = [(f"`{name}`", f"{weight:g}") for name, weight in DEFAULT_WEIGHTS.items()]
    doc = (SegmentedFootBiped.__doc__ or "").splitlines()
    parts = [
        "# Observations, actions and reward",
        "Observations are float32, dimensionless and within bounds: the SI value divided by the unit. There g is "
        "gravity and l the leg length.",
        "Actions are four numbers in [−1, 1]: " + ", ".join(f"`{name}`" for name in ACTIONS) + ".",
        "## Observation",
        _names(["name", "index", "unit", "bounds", "meaning"], entries),
        "## Reward",
        "Terms and weights of the default reward. `springfoot.envs.task.reward` defines each.",
        table(["term", "weight"], weights),
        "## Info",
        ", ".join(f"`{name}`" for name in (*INFO, "termination")),
        "## The environment",
        "```text\n" + "\n".join(line.removeprefix("    ") for line in doc) + "\n```",
    ]
    return "\n\n".join(parts) + "\n"


def api() -> str:
    """Return the page of the public names of each room."""
    parts = ["# Python", "The public names of each room, from their docstrings."]
    for room in ROOMS:
        parts.append(f"## springfoot.{room}\n\n::: springfoot.{room}\n    options:\n      show_root_heading: false")
    return "\n\n".join(parts) + "\n"
