"""How a policy walks elsewhere than on level ground, and how untrained springs walk: rows of `evaluate.py`'s flags.

springfoot study conditions pretrained --episodes 100
"""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

import tyro

from springfoot.agents.flags import given
from springfoot.agents.markdown import table, text_of
from springfoot.evaluation.evaluate_command import EvaluateFlags
from springfoot.evaluation.metrics import measure
from springfoot.evaluation.policies import prepare
from springfoot.evaluation.recording import record

from .quantities import falls_text, rmse_text, walks_csv
from .study import Answer, OnProgress, WalkingStudy

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
LONG = "--episodes 10 --seconds 600"
"""Flags of one more row: hours of walking in all."""
UNTRAINED_ROWS = (
    "constant --equilibrium neutral",
    "schedule",
    "schedule --feedforward plan",
    "schedule --cadence thesis",
    "untrained",
)
"""Untrained policies and their flags, each on leg constants of its own."""


def conditions_table(head: str, rows: Sequence[tuple[str, dict[str, Any]]]) -> str:
    """Markdown: a line for each row of flags and its metrics."""
    lines = []
    for words, m in rows:
        rest = "" if m["came_to_rest"] is None else f", {m['came_to_rest']} at rest"
        peaks = " / ".join(text_of(m["grf"][f"vertical_peak{peak}_bw"], ".2f") for peak in (1, 2))
        largest, speed = text_of(m["grf"]["vertical_max_bw"], ".2f"), text_of(m["speed_m_s"]["mean"], ".3f")
        lines.append([f"`{words or '(none)'}`", falls_text(m) + rest, speed, rmse_text(m), peaks, largest])
    columns = ["falls", "speed m/s", "RMSE thigh / knee / ankle °", "peaks 1 / 2 BW", "largest 10 ms BW"]
    return table([head, *columns], lines)


@dataclass(frozen=True, kw_only=True)
class Conditions(WalkingStudy):
    """Walk under one condition after the other, each a row of evaluate.py's flags, all else as evaluate.py has it.

    Rows `world`: pushes, slopes, uneven and slippery ground, delayed stiffness, standing starts, other proportions,
    loads. Rows `springs`: policies that nobody trained, on other equilibria, moments and cadences.
    """

    policy: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="POLICY")] = "pretrained"
    """Who walks the rows of `world`: any policy of evaluate.py."""
    rows: Literal["all", "world", "springs"] = "all"
    """Which rows to walk."""
    long: bool = True
    """Whether ten walks of 600 s are one of the rows of `world`."""

    QUICK: ClassVar[dict[str, Any]] = WalkingStudy.QUICK | {"long": False}  # type: ignore[operator]

    def ask(self, progress: OnProgress) -> Answer:
        """Walk every row."""
        sections, lines = {}, []
        if self.rows != "springs":
            world = [*WORLD, *([LONG] if self.long else [])]
            found = [(words, self._walk([self.policy, *shlex.split(words)], progress)) for words in world]
            sections["WORLD"] = conditions_table(f"`{self.policy}` with", found)
            lines += [({"policy": self.policy, "flags": words}, metrics) for words, metrics in found]
        if self.rows != "world":
            found = [(words, self._walk(shlex.split(words), progress)) for words in UNTRAINED_ROWS]
            sections["SPRINGS-UNTRAINED"] = conditions_table("", found)
            split = [(*words.partition(" "), metrics) for words, metrics in found]
            lines += [({"policy": name, "flags": words}, metrics) for name, _, words, metrics in split]
        ran = f"`springfoot evaluate` with these flags, {self.what_ran} where the row says no other."
        sections = {name: f"{text}\n\n{ran}" for name, text in sections.items()}
        text = "\n\n".join(sections.values())
        return Answer(text=text, files={"conditions.csv": walks_csv(lines)}, sections=sections)

    def _walk(self, words: Sequence[str], progress: OnProgress) -> dict[str, Any]:
        """The metrics of evaluate.py with these words, this study's counts in place of evaluate's own."""
        counts = {"episodes": self.episodes, "seconds": self.seconds, "seed": self.seed, "threads": self.threads}
        ours = [str(word) for name, count in counts.items() for word in (f"--{name}", count)]
        flags = tyro.cli(EvaluateFlags, args=[*ours, *words])
        policy, settings = prepare(
            flags.policy, {"episode_seconds": flags.seconds} | given(flags.environment), flags.seed
        )
        how: dict[str, Any] = {"episodes": flags.episodes, "seed": flags.seed, "threads": flags.threads}
        return measure(record(policy, settings, name=flags.policy, progress=progress, **how)).metrics
