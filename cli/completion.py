"""Print tab completion for a shell: `springfoot completion bash`."""

import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import make_dataclass
from importlib import import_module
from typing import Annotated, Any, Literal, Union, get_args

import tyro

Shell = Literal["bash", "zsh", "tcsh"]
"""Shells that tyro writes completions for."""
COMMANDS = {
    "train": "train.TrainFlags",
    "evaluate": "evaluate.EvaluateFlags",
    "live": "live.LiveFlags",
    "export": "export.ExportFlags",
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

    `installed_studies` returns name -> class of the studies whose packages are installed.
    """
    match arguments:
        case ["-h" | "--help"]:
            print(HELP)
            return 0
        case [shell] if shell in get_args(Shell):
            unprefixed = (tyro.conf.OmitArgPrefixes, tyro.conf.OmitSubcommandPrefixes)
            with suppress(SystemExit):  # so tyro ends
                tyro.cli(
                    _all_commands(installed_studies()),
                    prog="springfoot",
                    args=["--tyro-print-completion", shell],
                    config=unprefixed,
                )
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


def _all_commands(studies: dict[str, Any]) -> Any:
    """Return the type of the whole command line, a union for tyro: every command, and below `study` every study.

    `studies` is name -> class of its flags.
    """
    commands = {}
    for name, path in COMMANDS.items():
        module, _, flags = path.partition(".")
        commands[name] = getattr(import_module(f"springfoot.cli.{module}"), flags)
    commands["study"] = make_dataclass("StudyCommand", [("study", _one_of(studies))])
    return _one_of(commands)


def _one_of(commands: dict[str, Any]) -> Any:
    """Return a union for tyro, in which each class of flags is the command of its name; `commands` is name -> class."""
    return Union[  # noqa: UP007  (made at run time)
        tuple(Annotated[flags, tyro.conf.subcommand(name, prefix_name=False)] for name, flags in commands.items())
    ]
