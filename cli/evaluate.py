"""Define the command that evaluates a policy: `evaluate.py`, `springfoot evaluate`."""

import json
import shlex
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro
from tqdm import tqdm

from springfoot.command_line import end_in_order, exit_code, parse
from springfoot.errors import MOST_COUNT, MOST_THREADS, SpringfootError, printable, require_count
from springfoot.files.writing import is_taken, whole_folder
from springfoot.studies.base.flags import RecordedFlags, given

LONGEST_NAME = 60
"""Most letters of the policies' names in the name of a folder; chosen."""
MOST_IN_REPORT = 8
"""Policies that the colours and dashes of a report tell apart."""


@dataclass(frozen=True, kw_only=True)
class EvaluateFlags:
    """How human is the walk? Runs a policy, prints its gait beside people's, writes numbers, pictures and a report.

    Of several policies each gets a folder of its own, and one report shows them, up to eight, side by side.

    A fall is a result: the exit code is 0 with falls, 2 for bad input.
    """

    policies: Annotated[tyro.conf.Positional[tuple[str, ...]], tyro.conf.arg(metavar="POLICY ...")]
    """A .safetensors or .onnx file, a run folder (its best policy), module:function (your own code, of observations
    (N, D) or (D,); it is imported and run), or one of: pretrained, expert, medium, predicted, learned, learned-2 to
    learned-5, untrained, random, constant (300/40 N m/rad; constant:ANKLE,TOE for others), schedule (of the leg tuning,
    or --schedule; schedule:FACTOR for a multiple), quasi_stiffness, thesis, thesis_printed. A .csv or .json file is a
    stiffness schedule or a table of finite states, as an evaluation writes them. frozen:POLICY is a trained policy's
    mean stiffness over the stride, played open loop at the same rest angles."""
    episodes: int = 20
    """Number of episodes."""
    seconds: float = 20.0
    """Length of each; --episode-seconds means the same."""
    seed: int = 0
    """Episode i is seeded with seed + i."""
    out: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER", help_behavior_hint="(default: runs/eval-POLICY-N)")] = (
        None
    )
    """New folder for the results."""
    threads: int = 2
    """Threads of the physics; the results are the same with any number."""
    report: bool = True
    """Write report.html, which opens in any browser, offline."""
    film: bool = False
    """Write walk.mp4 too, the first 10 s as MuJoCo draws them; needs OpenGL (without a screen, MUJOCO_GL=egl) and the
    extra film."""
    json: bool = False
    """Print, in place of the tables, one JSON object: `folder`, and as `metrics` the content of each metrics.json."""
    environment: tyro.conf.OmitArgPrefixes[RecordedFlags]  # type: ignore[valid-type]
    """Settings of the environment. Each group says which of them a trained policy brings; all others have the defaults
    shown unless a flag says otherwise, whatever the policy was trained on."""


def evaluate_main(arguments: Sequence[str] | None = None, program: str = "evaluate.py") -> int:
    """Run the command line; return its exit code: 0 evaluated, 2 bad input, 130 ended by Ctrl-C, 143 by SIGTERM.

    `arguments` are those of the process unless given; `program` is the name in messages.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    flags = parse(EvaluateFlags, words, program, synonyms={"--episode-seconds": "--seconds"})
    return exit_code(program, lambda: run_evaluation(flags, program, printable(shlex.join([*program.split(), *words]))))


def run_evaluation(flags: EvaluateFlags, program: str, command: str = "") -> None:
    """Evaluate the policies one after another, write their results into one new folder, and print tables and folder.

    `program` is the name in messages, `command` the command line that the report shows.
    """
    for name, least, most in (("episodes", 1, MOST_COUNT), ("seed", 0, MOST_COUNT), ("threads", 1, MOST_THREADS)):
        require_count(name, getattr(flags, name), least, most)
    if not flags.policies:
        raise SpringfootError("give a policy, say pretrained; --help lists them")
    if flags.report and len(flags.policies) > MOST_IN_REPORT:
        raise SpringfootError(
            f"report.html shows up to {MOST_IN_REPORT} policies, got {len(flags.policies)}; give --no-report"
        )
    labels = _labels(flags.policies)
    if flags.out is not None and is_taken(flags.out):
        raise SpringfootError(f"{flags.out} exists already; give --out a new folder")
    from springfoot.agents.policies.baselines import FROZEN, has_feedback
    from springfoot.compiling import tell_of_compiling
    from springfoot.evaluation.numbers import metrics
    from springfoot.evaluation.page import (
        report_page,  # not above: Matplotlib takes a while, and bad flags need not wait for it
    )
    from springfoot.evaluation.recording import policies, recording
    from springfoot.evaluation.report import film, gait_table, report

    end_in_order()
    tell_of_compiling()
    settings = {"episode_seconds": flags.seconds} | given(flags.environment)
    if flags.film:
        film.require_film()
    # Find every policy, before anything is written.
    prepared = []  # policy and settings of each
    for label, name in zip(labels, flags.policies, strict=True):
        with _progress_bar(f"{label}, copying", 0.0, delay=0.5) as bar:
            prepared.append(policies.policy_and_settings(name, settings, flags.seed, flags.threads, _watch_of(bar)))
    for _, environment in prepared:
        recording.require_recordable(environment, flags.episodes)

    # Walk, measure and write one policy after another.
    default_out = Path("runs", f"eval-{'-'.join(labels)[:LONGEST_NAME]}")
    with whole_folder(flags.out, default_out) as (folder, out):
        walks = []
        written = set[str]()
        for label, (policy, environment) in zip(labels, prepared, strict=True):
            with _progress_bar(label, flags.episodes * environment.episode_seconds) as bar:
                episodes = recording.record(
                    policy,
                    environment,
                    name=label,
                    episodes=flags.episodes,
                    seed=flags.seed,
                    threads=flags.threads,
                    progress=bar.update,
                )
            policy_folder = folder if len(labels) == 1 else folder / label
            policy_folder.mkdir(exist_ok=policy_folder == folder)  # of a single policy it exists already
            with _progress_bar(f"{label}, files", 1.0, delay=0.5) as bar:
                gait = metrics.measure(episodes)
                report.write_report(policy_folder, episodes, gait, bar.update)
            if flags.film:
                with _progress_bar(f"{label}, film", film.film_seconds(episodes)) as bar:
                    film.save_film(policy_folder / "walk.mp4", episodes, bar.update)
            walks.append((episodes, gait))
            written |= {path.name for path in policy_folder.iterdir()}
        if flags.report:
            report_page.write_page(folder / "report.html", walks, command)
    # Tell the results.
    if flags.json:
        print(json.dumps({"folder": str(out), "metrics": [gait.metrics for _, gait in walks]}, ensure_ascii=False))
        return
    gait_table.print_tables([gait.metrics for _, gait in walks])
    for name in flags.policies:
        if has_feedback(name):
            open_loop = f"{program} {shlex.quote(f'{FROZEN}:{name}')}"
            print()
            gait_table.print_words(f"Its mean stiffness alone, open loop: {open_loop}, with the same flags")
    files = ", ".join(name for name in ("walk.mp4", *report.FILES) if name in written)
    if not any(name.startswith("finite_states") for name in written):
        print()
        gait_table.print_words("No finite_states.json: both feet have a device, whose stiffness no policy sets")
    per_policy = files if len(labels) == 1 else f"in each of the folders {', '.join(labels)}: {files}"
    gait_table.print_results(out, [*["report.html"] * flags.report, per_policy])


def _progress_bar(words: str, total: float, delay: float = 0.0) -> tqdm:
    """Return a progress bar named by `words`, of `total` units, with the time left.

    It appears only after `delay` [s], disappears at its end, and shows nothing without a terminal.
    """
    return tqdm(
        total=total,
        desc=words,
        bar_format="{desc}: {percentage:3.0f}% |{bar}| {elapsed}, {remaining} left",
        dynamic_ncols=True,
        leave=False,
        delay=delay,
        disable=None,  # where there is no terminal
    )


def _watch_of(bar: tqdm) -> Callable[[float], Callable[[float], object]]:
    """Return the `Watch` of `open_loop` that shows on `bar` the walk from which a copy `frozen:POLICY` is measured."""

    def watch(seconds: float) -> Callable[[float], object]:
        """Set the length of the walk [s]; return the function to call with the seconds of each step."""
        bar.total = seconds
        return bar.update

    return watch


def _labels(names: Sequence[str]) -> list[str]:
    """Return a label for each of the policies' `names`, which names its folder.

    No two labels are equal, nor equal to the report's name, also in file systems where capitals do not count: the
    second `walk` is `walk-2`.
    """
    from springfoot.evaluation.recording.policies import policy_label

    labels: list[str] = []
    taken = {"report.html"}
    for label in map(policy_label, names):
        number = 1
        numbered = label
        while numbered.casefold() in taken:
            number += 1
            numbered = f"{label}-{number}"
        taken.add(numbered.casefold())
        labels.append(numbered)
    return labels
