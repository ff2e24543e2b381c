"""How a policy walks elsewhere than on level ground, and how untrained springs walk: rows of `evaluate.py`'s flags.

springfoot study conditions pretrained --episodes 100
"""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

import tyro

from springfoot.agents.policies.baselines import and_copy
from springfoot.cli.evaluate import EvaluateFlags
from springfoot.evaluation.numbers.metrics import measure
from springfoot.evaluation.recording.policies import prepare
from springfoot.evaluation.recording.recording import record
from springfoot.files.markdown import table, text_of

from ..base.flags import given
from ..base.quantities import OPEN_LOOP, falls_text, open_loop_note, rmse_text, walks_csv
from ..base.study import Answer, OnProgress, WalkingStudy

WORLD = (
    "",
    "--push-newton 150",
    "--slope-deg 5",
    "--slope-deg -5",
    "--unevenness-m 0.01",
    "--friction 0.5",
    "--stiffness-delay-s 0.02",
    "--start standing --stop-at 12",
    "--leg-ratio 0.94",
    "--leg-ratio 1.06",
    "--foot-ratio 0.93",
    "--foot-ratio 1.07",
    "--carried-ratio 0.159",
    "--carried-ratio 0.317",
)
"""Flags of one policy's rows. Proportions are ± 2 SD of adults; loads are 10 and 20 kg for 63 kg."""
LONG_EPISODES, LONG_SECONDS = 10, 600
LONG = f"--episodes {LONG_EPISODES} --seconds {LONG_SECONDS}"
"""Flags of one more row: hours of walking in all."""
UNTRAINED_ROWS = (
    "constant --equilibrium neutral",
    "schedule",
    "schedule --feedforward plan",
    "schedule --cadence thesis",
    "untrained",
)
"""Untrained policies and their flags, each on leg constants of its own."""


def conditions_table(head: str, rows: Sequence[tuple[str, Sequence[dict[str, Any]]]]) -> str:
    """Markdown: a line for each row of flags, with the metrics of the policy and, where there are any, of its copy."""
    lines = []
    for words, (m, *copies) in rows:
        peaks = " / ".join(text_of(m["grf"][f"vertical_peak{peak}_bw"], ".2f") for peak in (1, 2))
        largest = text_of(m["grf"]["vertical_max_bw"], ".2f")
        walked = [cell for copy in copies for cell in _walked(copy)]
        lines.append([f"`{words or '(none)'}`", *_walked(m), peaks, largest, *walked])
    columns = ["falls", "speed m/s", "RMSE thigh / knee / ankle °"]
    beside = [f"{OPEN_LOOP}: {column}" for column in columns] * (len(rows[0][1]) - 1)
    return table([head, *columns, "peaks 1 / 2 BW", "largest 10 ms BW", *beside], lines)


def _walked(m: dict[str, Any]) -> list[str]:
    rest = "" if m["came_to_rest"] is None else f", {m['came_to_rest']} at rest"
    return [falls_text(m) + rest, text_of(m["speed_m_s"]["mean"], ".3f"), rmse_text(m)]


@dataclass(frozen=True, kw_only=True)
class Conditions(WalkingStudy):
    """Walk under one condition after the other, each a row of evaluate.py's flags, all else as evaluate.py has it.

    Rows `world`: pushes, slopes, uneven and slippery ground, delayed stiffness, standing starts, other proportions,
    loads; a trained policy beside its open-loop copy, whose mean stiffness is that of the row's body, speed and slope.
    Rows `springs`: policies that nobody trained, on other equilibria, moments and cadences.
    """

    policy: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="POLICY")] = "pretrained"
    """Who walks the rows of `world`: any policy of evaluate.py."""
    rows: Literal["all", "world", "springs"] = "all"
    """Which rows to walk."""
    long: bool = True
    """Whether ten walks of 600 s are one of the rows of `world`."""

    QUICK: ClassVar[dict[str, Any]] = WalkingStudy.QUICK | {"long": False}  # type: ignore[operator]

    @property
    def total(self) -> float:
        """Simulated time [s], without falls."""
        own, names = self.episodes * self.seconds, len(and_copy(self.policy))
        world = names * (len(WORLD) * own + self.long * LONG_EPISODES * LONG_SECONDS)
        springs = len(UNTRAINED_ROWS) * own
        return (self.rows != "springs") * world + (self.rows != "world") * springs

    def ask(self, progress: OnProgress) -> Answer:
        """Walk every row."""
        sections, lines = {}, []
        ran = f"`springfoot evaluate` with these flags, {self.what_ran} where the row says no other."
        if self.rows != "springs":
            world, names = [*WORLD, *([LONG] if self.long else [])], and_copy(self.policy)
            found = [(words, [self._walk([name, *shlex.split(words)], progress) for name in names]) for words in world]
            text = conditions_table(f"`{self.policy}` with", found)
            sections["WORLD"] = f"{text}\n\n{ran}{open_loop_note(self.policy)}"
            for words, walks in found:
                lines += [({"policy": name, "flags": words}, m) for name, m in zip(names, walks, strict=True)]
        if self.rows != "world":
            found = [(words, [self._walk(shlex.split(words), progress)]) for words in UNTRAINED_ROWS]
            sections["SPRINGS-UNTRAINED"] = f"{conditions_table('', found)}\n\n{ran}"
            split = [(*words.partition(" "), metrics) for words, (metrics,) in found]
            lines += [({"policy": name, "flags": words}, metrics) for name, _, words, metrics in split]
        text = "\n\n".join(sections.values())
        return Answer(text=text, files={"conditions.csv": walks_csv(lines)}, sections=sections)

    def _walk(self, words: Sequence[str], progress: OnProgress) -> dict[str, Any]:
        """The metrics of evaluate.py with these words, this study's counts in place of evaluate's own."""
        counts = {"episodes": self.episodes, "seconds": self.seconds, "seed": self.seed, "threads": self.threads}
        ours = [str(word) for name, count in counts.items() for word in (f"--{name}", count)]
        flags = tyro.cli(EvaluateFlags, args=[*ours, *words])
        (name,) = flags.policies
        conditions = {"episode_seconds": flags.seconds} | given(flags.environment)
        policy, settings = prepare(name, conditions, flags.seed, flags.threads)
        how: dict[str, Any] = {"episodes": flags.episodes, "seed": flags.seed, "threads": flags.threads}
        return measure(record(policy, settings, name=name, progress=progress, **how)).metrics
