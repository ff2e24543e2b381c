"""Print tab completion for a shell: `springfoot completion bash`."""

import ast
import io
import re
import sys
from collections.abc import Callable, Sequence
from contextlib import redirect_stdout, suppress
from dataclasses import make_dataclass
from importlib import import_module
from typing import Annotated, Any, Literal, Union, get_args

import tyro

Shell = Literal["bash", "zsh"]
"""Shells that have completions; chosen of those that tyro writes for."""
COMMANDS = {
    "train": "train.TrainFlags",
    "evaluate": "evaluate.EvaluateFlags",
    "live": "live.LiveFlags",
    "feet": "feet.FootChoice",
    "person": "person.Person",
    "score": "score.Score",
    "export": "export.ExportFlags",
    "submit": "submit.SubmitFlags",
    "judge": "judge.JudgeFlags",
    "datasets": "datasets.DatasetsFlags",
    "examples": "examples.ExamplesFlags",
}
"""Command -> class of its flags."""
HELP = f"""usage: springfoot completion {{{",".join(get_args(Shell))}}}

bash:  mkdir -p ~/.local/share/bash-completion/completions
       springfoot completion bash > ~/.local/share/bash-completion/completions/springfoot
zsh:   springfoot completion zsh > FOLDER/_springfoot, a folder of your $fpath

A new shell has it."""
FILES_TOO = """
# Files, where no word of springfoot's begins so.
_springfoot() { _tyro_springfoot "$@"; [ -n "${COMPREPLY[*]}" ] || COMPREPLY=(); }
complete -o default -F _springfoot springfoot
"""
"""End of tyro's script for bash, which alone offers no file."""


def completion_main(arguments: Sequence[str], installed_studies: Callable[[], dict[str, Any]]) -> int:
    """Print the completion of all commands and flags for a shell; return 0, and 2 for another word.

    `installed_studies` returns name -> class of the studies with installed packages.
    """
    match arguments:
        case ["-h" | "--help"]:
            print(HELP)
            return 0
        case [shell] if shell in get_args(Shell):
            print(SPECIFICATION.sub(_completed_specification, _script_of_tyro(shell, installed_studies())))
            if shell == "bash":
                print(FILES_TOO)
        case _:
            words = " ".join(arguments)
            print(
                f"springfoot completion: error: give one of {', '.join(get_args(Shell))}, got {words!r:.60}",
                file=sys.stderr,
            )
            return 2
    return 0


SPECIFICATION = re.compile(r"^COMPLETION_SPEC = (\{.*\})$", re.MULTILINE)
"""Line of tyro's scripts with the words that they offer, as a Python literal."""


def _script_of_tyro(shell: str, studies: dict[str, Any]) -> str:
    """Return tyro's completion script for a shell, empty for one that tyro does not know.

    `studies` as in `_all_commands`.
    """
    output = io.StringIO()
    with suppress(SystemExit), redirect_stdout(output):  # tyro prints it and exits
        tyro.cli(
            _all_commands(studies),
            prog="springfoot",
            args=["--tyro-print-completion", shell],
            config=(tyro.conf.OmitArgPrefixes, tyro.conf.OmitSubcommandPrefixes),
        )
    return output.getvalue()


def _completed_specification(line: re.Match[str]) -> str:
    """Return the line COMPLETION_SPEC of a script of tyro's, with the names of policies and shells added to it.

    Each description in it comes on one line: the scripts offer every line that tyro's code prints as a word.
    """
    from springfoot.agents.policies.baselines import BASELINES  # not above: other commands need no simulator
    from springfoot.agents.policies.policy import SHIPPED

    specification = ast.literal_eval(line[1])
    for command, (description, names) in {
        "evaluate": ("policy", (*SHIPPED, *BASELINES)),
        "live": ("policy", (*SHIPPED, *BASELINES)),
        "export": ("policy", SHIPPED),
        "submit": ("policy", (*SHIPPED, *BASELINES)),
        "completion": ("shell", get_args(Shell)),
    }.items():
        # Words are offered as the flags of an option are.
        offered = {"flags": list(names), "description": description, "type": "flag"}
        specification["subcommands"][command]["options"].append(offered)
    _join_lines(specification)
    return f"COMPLETION_SPEC = {specification!r}"


def _join_lines(command: dict[str, Any]) -> None:
    """Put the descriptions of a command's options, and those of the commands below it, on one line each."""
    for option in command["options"]:
        option["description"] = " ".join(option["description"].split())
    for subcommand in command.get("subcommands", {}).values():
        _join_lines(subcommand)


def _all_commands(studies: dict[str, Any]) -> Any:
    """Return the type of the whole command line, a union for tyro: every command, and below `study` every study.

    `studies` is name -> class of its flags.
    """
    commands = {}
    for name, path in COMMANDS.items():
        module, _, flags = path.partition(".")
        commands[name] = getattr(import_module(f"springfoot.cli.{module}"), flags)
    commands["study"] = make_dataclass("StudyCommand", [("study", _union_of(studies))])
    commands["completion"] = make_dataclass("CompletionCommand", [])  # it has no flags
    return _union_of(commands)


def _union_of(commands: dict[str, Any]) -> Any:
    """Return a union for tyro, in which each class of flags is the command of its name; `commands` is name -> class."""
    return Union[  # noqa: UP007  (made at run time)
        tuple(Annotated[flags, tyro.conf.subcommand(name, prefix_name=False)] for name, flags in commands.items())
    ]
