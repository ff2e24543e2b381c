"""A policy held against springs that need no learning, on the same seeds, hence starts and pushes.

    springfoot study compare --constant 363 79.5 --factor 1.07 --page docs/results.md

Every row walks in the policy's environment, earns its reward and is measured as by `evaluate.py`. Returns are compared
episode by episode (paired bootstrap), falls by McNemar's test.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, NamedTuple

import tyro

from springfoot.agents.policies.baselines import PolicyFunction, and_copy, own_settings
from springfoot.arrays import NDArray
from springfoot.envs.settings.settings import BipedSettings, settings_to_json
from springfoot.evaluation.numbers.metrics import measure
from springfoot.evaluation.recording.policies import prepare
from springfoot.evaluation.recording.recording import record
from springfoot.files.markdown import table, text_of

from ..base.flags import SettingsFlags, given, optional_flags
from ..base.intervals import RESAMPLES, mean_interval, paired_p, share_interval
from ..base.quantities import rmse_text, walks_csv
from ..base.study import Answer, OnProgress, WalkingStudy

PUSHED = BipedSettings(push_newton=150.0)
"""Pushes [N] of `best-constant` unless flagged otherwise."""
PUSHES = (150.0, 200.0)
"""Pushes [N] of `compare`."""
QUASI_SPEED = 1.35
"""Commanded speed [m/s] at which people's quasi-stiffness, which is not tuned, walks about 1.2 m/s."""
SIGNIFICANT = 0.05
"""Below this p, McNemar's, one row falls less often than another."""
INTERVALS = (
    f"Intervals: 95 %, percentile bootstrap over episodes (scipy.stats, {RESAMPLES:,} resamples), of the difference "
    "paired; falls: Wilson's, and p of McNemar's exact test against the first row."
)
"""How they are made."""
SECTION = "COMPARE"
"""Of the results page."""

PushedFlags = optional_flags("PushedFlags", BipedSettings, PUSHED)


class Contender(NamedTuple):
    """A policy, what its row is called, and the environment it walks in."""

    name: str
    policy: PolicyFunction
    settings: BipedSettings


@dataclass(frozen=True, kw_only=True, eq=False)
class Row:
    """One policy's episodes in numbers."""

    name: str
    """What was run."""
    metrics: dict[str, Any]
    """As in metrics.json."""
    returns: NDArray
    """(episodes,) return of each."""
    fell: NDArray
    """(episodes,) whether it fell."""

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the mean return."""
        return mean_interval(self.returns)

    def difference(self, first: "Row") -> tuple[float, float, float] | None:
        """Mean return of `first` less this row's, and its interval; None where another speed was commanded."""
        if self.metrics["environment"]["speed"] != first.metrics["environment"]["speed"]:
            return None
        differences = first.returns - self.returns
        return float(differences.mean()), *mean_interval(differences)


def run_row(name: str, policy: PolicyFunction, settings: BipedSettings, **how: Any) -> Row:
    """Record (`episodes`, `seed`, `threads`, `progress` as for `recording.record`) and measure a policy."""
    recording = record(policy, settings, name=name, **how)
    fell = recording.fall_reason != ""
    return Row(name=name, metrics=measure(recording).metrics, returns=recording.returns, fell=fell)


def contenders(
    name: str,
    given: dict[str, Any],
    constant: tuple[float, float] | None = None,
    factor: float | None = None,
    seed: int = 0,
    threads: int = 2,
) -> list[Contender]:
    """The policy `name`, and what it has to beat, in its own environment and reward.

    Its own mean K played open loop; what its training starts from; the tuned schedule, and its best `factor`; the best
    `constant` (ankle, toe) [N m/rad] and the default one; people's quasi-stiffness as it is, and commanded
    `QUASI_SPEED`; the thesis's lines, completed and as printed; random actions. `given` are environment settings that
    differ from the evaluation's standard conditions and the policy's own. Each row pays for changing its own action.
    """
    policy, settings = prepare(name, given, seed)
    found = [Contender(name, policy, settings)]
    found += [Contender(copy, *prepare(copy, given, seed, threads)) for copy in and_copy(name)[1:]]
    for each in rivals(constant, factor):
        own = settings_to_json(settings) | own_settings(each, settings)
        found.append(Contender(each, *prepare(each, own, seed)))
        if each == "quasi_stiffness" and settings.speed == BipedSettings.speed:
            faster = prepare(each, own | {"speed": QUASI_SPEED}, seed)
            found.append(Contender(f"{each}, commanded {QUASI_SPEED:g} m/s", *faster))
    return found


def rivals(constant: tuple[float, float] | None, factor: float | None) -> list[str]:
    """The names of the baselines among the contenders."""
    names = ["untrained", "schedule", *([f"schedule:{factor:g}"] if factor else [])]
    names += [f"constant:{constant[0]:g},{constant[1]:g}"] if constant else []
    return [*names, "constant", "quasi_stiffness", "thesis", "thesis_printed", "random"]


def comparison_table(rows: Sequence[Row]) -> str:
    """Markdown: the first row's policy against the others."""
    first = rows[0]
    head = ["policy", "falls [95 %]", "p", "return", f"{first.name} is ahead by [95 %]", "speed m/s"]
    lines = []
    for row in rows:
        m = row.metrics
        low, high = share_interval(m["falls"], m["episodes"])
        falls = f"{m['falls']} of {m['episodes']} [{100 * low:.0f}, {100 * high:.0f} %]"
        ahead, p = "", ""
        if row is not first:
            difference = row.difference(first)
            ahead = "–" if difference is None else "{:.1f} [{:.1f}, {:.1f}]".format(*difference)
            p = f"{paired_p(first.fell, row.fell):.2g}"
        speed = text_of(m["speed_m_s"]["mean"], ".3f")
        lines.append([f"`{row.name}`", falls, p, f"{row.returns.mean():.1f}", ahead, speed, rmse_text(m)])
    return table([*head, "RMSE thigh / knee / ankle °"], lines)


def verdict(rows: Sequence[Row]) -> str:
    """Which rows the first one is ahead of, in return and in falls, and which not."""
    first, *others = rows
    told = {row.name: row.difference(first) for row in others}
    behind = [name for name, difference in told.items() if difference is not None and difference[1] <= 0.0]
    known = sum(difference is not None for difference in told.values())
    fewer = [
        row.name for row in others if paired_p(first.fell, row.fell) < SIGNIFICANT and first.fell.sum() < row.fell.sum()
    ]
    alike = [row.name for row in others if row.name not in fewer]
    return (
        f"{first.name} earns more than {known - len(behind)} of {known} rows (interval above 0)"
        f"{'; not more than ' + ', '.join(behind) if behind else ''}. It falls less often than {len(fewer)} of "
        f"{len(others)} (p < {SIGNIFICANT:g}){'; not less than ' + ', '.join(alike) if alike else ''}."
    )


@dataclass(frozen=True, kw_only=True)
class Compare(WalkingStudy):
    """Hold a policy against springs that need no learning, under pushes: falls, returns, speed, joint angles."""

    policy: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="POLICY")] = "pretrained"
    """Any policy of evaluate.py; all rows walk in its environment and earn its reward."""
    constant: Annotated[tuple[float, float] | None, tyro.conf.arg(metavar="ANKLE TOE")] = None
    """The best constant stiffness [N m/rad], as best-constant finds it."""
    factor: Annotated[float | None, tyro.conf.arg(metavar="FLOAT")] = None
    """The best factor on the schedule, as best-factor finds it."""
    pushes: tuple[float, ...] = PUSHES
    """Sizes of the pushes [N], a table each."""
    episodes: int = 100
    """Episodes of each row."""
    environment: tyro.conf.OmitArgPrefixes[SettingsFlags]  # type: ignore[valid-type]
    """What to walk in; a trained policy brings its own settings, standard conditions aside."""

    QUICK: ClassVar[dict[str, Any]] = {"episodes": 1, "seconds": 4.0, "pushes": (150.0,)}

    @property
    def total(self) -> float:
        """Simulated time [s], without falls."""
        rows = len(and_copy(self.policy)) + len(rivals(self.constant, self.factor)) + 1  # one commanded faster
        return len(self.pushes) * rows * self.episodes * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """Walk every row under every push."""
        parts, lines = [], []
        for push in self.pushes:
            conditions = {"episode_seconds": self.seconds} | given(self.environment) | {"push_newton": push}
            found = contenders(self.policy, conditions, self.constant, self.factor, self.seed, self.threads)
            rows = [run_row(*each, **self.how, progress=progress) for each in found]
            parts += [f"**{what_ran(self, rows[0])}**", comparison_table(rows), verdict(rows)]
            lines += [(_ends(push, row, rows[0]), row.metrics) for row in rows]
        text = "\n\n".join([*parts, INTERVALS])
        return Answer(text=text, files={"compare.csv": walks_csv(lines)}, sections={SECTION: text})


def _ends(push: float, row: Row, first: Row) -> dict[str, Any]:
    """What a row's line in compare.csv begins with."""
    difference = row.difference(first) or (None, None, None)
    falls = share_interval(row.metrics["falls"], row.metrics["episodes"])
    return {
        "policy": row.name,
        "push_newton": push,
        **dict(zip(("falls_low", "falls_high"), falls, strict=True)),
        "falls_p": paired_p(first.fell, row.fell),
        **dict(zip(("return_low", "return_high"), row.interval, strict=True)),
        **dict(zip(("ahead", "ahead_low", "ahead_high"), difference, strict=True)),
    }


def pushed(seconds: float, environment: Any) -> dict[str, Any]:
    """Environment settings: the pushes of `PUSHED`, episodes of `seconds`, and what was flagged."""
    return {"push_newton": PUSHED.push_newton, "episode_seconds": seconds} | given(environment)


def what_ran(study: WalkingStudy, row: Row) -> str:
    """The episodes of a table in one sentence."""
    ran = row.metrics["environment"]
    pushes = "no pushes"
    if ran["push_newton"]:
        pushes = (
            f"pushes ±{ran['push_newton']:g} N × {ran['push_seconds']:g} s, one in every {ran['push_interval']:g} s"
        )
    last = study.seed + study.episodes - 1
    return f"{study.episodes} episodes × {ran['episode_seconds']:g} s, seeds {study.seed}–{last}, {pushes}."
