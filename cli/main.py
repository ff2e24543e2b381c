"""Define the command `springfoot`: the code of `train.py` and `evaluate.py`, and every study by its name."""

import sys
from collections.abc import Collection, Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from springfoot import __version__
from springfoot.errors import perhaps
from springfoot.extras import EXTRA_OF, missing
from springfoot.terminal import at_terminal

if TYPE_CHECKING:
    from springfoot.studies.base.study import Study

FIRST = """To begin with:

  springfoot live pretrained            watch a walk in your browser, and steer it
  springfoot evaluate pretrained        how human is it? numbers, curves, and report.html
  springfoot train --out runs/mine      train a policy of your own, three to ten minutes on two cores
  springfoot evaluate runs/mine         how human is yours?
  springfoot examples --copy examples   programs to start from

springfoot --help lists all commands."""
"""Commands that a newcomer types, in their order."""
COMMANDS = (
    "train",
    "evaluate",
    "live",
    "feet",
    "person",
    "score",
    "export",
    "submit",
    "judge",
    "study",
    "datasets",
    "examples",
    "completion",
)
"""Names of all commands."""
HELP = f"""usage: springfoot {{{",".join(COMMANDS)}}} ...

  springfoot train --out FOLDER     train a policy that sets the stiffness of ankles and toes
  springfoot evaluate POLICY        how human is its walk? numbers, curves, pictures; POLICY may be pretrained
  springfoot live POLICY            walk it in a browser, its stiffness, speed, slope, body and feet under sliders
  springfoot feet                   which spring or foot takes a person least? such as --spring 0 2 4 6
  springfoot person FILE ...        how stiff is this person? ankle and toe from their motion files
  springfoot score FILE ...         how human is any gait? motion files of a walk held against people
  springfoot export POLICY          write it as an ONNX file, which runs without springfoot
  springfoot submit POLICY          walk it on a frozen task of the benchmark, and write its returns beside it
  springfoot judge FOLDER ...       repeat submissions, and walk them on seeds drawn from their digests
  springfoot study NAME             hold many walks against each other; springfoot study --help lists some
  springfoot datasets               write Minari sets of walks, for offline learning
  springfoot examples --copy FOLDER copy the programs to start from, for springfoot and other learners
  springfoot completion SHELL       print the tab completion of commands, policies and flags for bash or zsh

Each takes --help; springfoot --version says which this is.
Pages that help names, docs/..., lie in {Path(__file__).parents[1]}."""

STUDIES = {
    "compare": (
        "walks.comparison.Compare",
        "How do policies walk beside each other, beside springs that learn nothing, and elsewhere?",
    ),
    "bodies": ("walks.bodies.Bodies", "Does a policy walk with any body at any speed?"),
    "ablations": ("walks.ablations.Ablations", "What does each part of the training contribute? (trains)"),
    "agreement": ("springs.agreement.SeedAgreement", "Do the springs of several policies agree over the stride?"),
    "any-stiffness": ("springs.any_stiffness.AnyStiffness", "Does a gait walk with any other stiffness?"),
    "identify": (
        "springs.push_identification.Identify",
        "Do pushes find a policy's springs, and are they springs at all?",
    ),
    "influence": ("springs.influence.Influence", "Does stiffness change torque, the CoM's acceleration and the walk?"),
    "learning-curves": ("walks.learning_curves.LearningCurves", "How fast was a walk learned?"),
    "leg-tuning": ("searches.leg_tuning.LegTuning", "Which leg constants walk like people? (searches for hours)"),
    "plan-tuning": ("searches.plan_tuning.PlanTuning", "Which plan of a walk costs least effort? (searches)"),
    "predict": ("searches.predict.Predict", "Which walk follows from body, plan and physics alone? (searches, trains)"),
    "controls": ("feet.controls.Controls", "Does the price of a walk hold where its answer is known?"),
    "joint-prices": (
        "feet.joint_prices.JointPrices",
        "Which joint pays for a spring, and which for a missing ankle?",
    ),
    "price": ("feet.price.Price", "How much does the price of a walk change with its tendons?"),
    "persons": ("feet.persons.Persons", "How do learned persons walk on drawn bodies and feet, and beside people?"),
    "foot-map": (
        "feet.foot_map.FootMap",
        "Which feet does a learned person walk on, and what is it worth to know them?",
    ),
    "specialists": (
        "feet.specialists.Specialists",
        "How much less does a walk cost if the person learns one foot alone? (trains)",
    ),
    "landscape": (
        "springs.landscape.Landscape",
        "With which stiffness of ankles and toes does a person walk, fall, and take least?",
    ),
    "effects": ("walks.effects.Effects", "Does a person change as people did in laboratories, in sign and size?"),
    "changes": ("walks.changes.Changes", "Does a walk change with speed as people's does?"),
    "toe": ("walks.toe.ToeJoint", "What does a toe joint do for a walk: free, sprung, locked or absent?"),
    "when": ("springs.when.When", "What does it buy to vary ankle and toe stiffness within the step? (searches)"),
    "orthosis": ("feet.orthosis.Orthosis", "Which spring beside the ankles helps weak calves?"),
    "prosthesis": ("feet.prosthesis.Prosthesis", "Which stiffness of a passive prosthetic ankle takes least?"),
    "drop-foot": ("feet.drop_foot.DropFoot", "Which spring beside the ankle holds a drop foot?"),
    "walks": ("feet.walks.Walks", "How does a learned person walk on each foot? A page of recorded walks."),
}
"""Name of each study on the command line -> its class, imported when asked for, and its question."""
ASKED_BY_USERS = ("compare", "landscape", "identify", "orthosis", "prosthesis", "drop-foot")
"""Studies that help lists; `--all` lists the others too, most of which made tables of this project's docs."""
_EXTRA_OF_COMMAND = {"train": "train", "live": "live", "datasets": "minari"}
"""Command that needs all of an extra, which brings `evaluate` -> that extra."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run `springfoot`; return the exit code, 2 for bad input and for a package that is not installed.

    `arguments` are those of the process unless given. Imports only the packages of the command.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    return at_terminal(lambda: _run(words))


def _run(words: list[str]) -> int:
    """Run the command that the first word names, or print help; return the exit code."""
    try:
        match words:
            case ["train", *rest]:
                from .train import train_main

                return train_main(rest, "springfoot train")
            case ["evaluate", *rest]:
                from .evaluate import evaluate_main

                return evaluate_main(rest, "springfoot evaluate")
            case ["live", *rest]:
                from .live import live_main

                return live_main(rest)
            case ["feet", *rest]:
                from .feet import feet_main

                return feet_main(rest)
            case ["person", *rest]:
                from .person import person_main

                return person_main(rest)
            case ["score", *rest]:
                from .score import score_main

                return score_main(rest)
            case ["export", *rest]:
                from .export import export_main

                return export_main(rest, "springfoot export")
            case ["submit", *rest]:
                from .submit import submit_main

                return submit_main(rest)
            case ["judge", *rest]:
                from .judge import judge_main

                return judge_main(rest)
            case ["study", *rest]:
                return study_main(rest)
            case ["datasets", *rest]:
                from .datasets import datasets_main

                return datasets_main(rest)
            case ["examples", *rest]:
                from .examples import examples_main

                return examples_main(rest)
            case ["completion", *rest]:
                from .completion import completion_main

                return completion_main(rest, _installed_studies)
            case []:
                print(FIRST)
                return 0
            case ["-h" | "--help", *_]:
                print(HELP)
                return 0
            case ["--version"]:
                print(f"springfoot {__version__}")
                return 0
    except KeyboardInterrupt:  # during imports; the commands handle it themselves
        return 130
    except ModuleNotFoundError as error:
        if error.name not in EXTRA_OF:
            raise
        extra = EXTRA_OF[error.name]
        if extra == "evaluate":
            extra = _EXTRA_OF_COMMAND.get(words[0], extra)
        print(f"springfoot {words[0]}: error: {missing(error.name, extra)}", file=sys.stderr)
        return 2
    *others, last = COMMANDS
    known = f"there are {', '.join(others)} and {last}{perhaps(words[0], COMMANDS)}"
    print(f"springfoot: error: no command {words[0]!r:.60}; {known}", file=sys.stderr)
    return 2


def study_main(arguments: Sequence[str]) -> int:
    """Run the study that the first argument names, or print help; return the exit code.

    It is 0 done, 1 a training failed, 2 bad input, 130 Ctrl-C, 143 SIGTERM.
    """
    name, *words = arguments or ["--help"]
    if name in ("-h", "--help", "--all"):
        print(study_help(STUDIES if "--all" in arguments else ASKED_BY_USERS))
        return 0
    if name not in STUDIES:
        known = f"there are {', '.join(STUDIES)}{perhaps(name, STUDIES)}"
        print(f"springfoot study: error: no study {name!r:.60}; {known}", file=sys.stderr)
        return 2
    from .study import run_study

    return run_study(study_class(name), name, words, f"springfoot study {name}")


def study_class(name: str) -> "type[Study]":
    """Import and return the class of the study `name`, one of `STUDIES`."""
    module, _, class_name = STUDIES[name][0].rpartition(".")
    return getattr(import_module(f"springfoot.studies.{module}"), class_name)


def _installed_studies() -> "dict[str, type[Study]]":
    """Return name -> class of the studies with installed packages."""
    classes = {}
    for name in STUDIES:
        try:
            classes[name] = study_class(name)
        except ModuleNotFoundError as error:
            if error.name not in EXTRA_OF:
                raise
    return classes


def study_help(names: Collection[str]) -> str:
    """Return the help text of `springfoot study`: usage, and each study of `names` with its question."""
    width = max(map(len, names))
    others = len(STUDIES) - len(names)
    return "\n".join(
        [
            "usage: springfoot study NAME [--quick] [--out FOLDER] ...",
            "",
            *(f"  {name:<{width}}  {STUDIES[name][1]}" for name in names),
            "",
            *([f"springfoot study --all lists {others} more, behind tables of docs/results."] if others else []),
            "Each takes --help; with --quick it runs a minute at most, only to be seen to run.",
        ]
    )
