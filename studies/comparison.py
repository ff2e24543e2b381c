"""A policy held against every baseline, on the same seeds, hence starts and pushes, and by its own reward.

    springfoot study compare --constant 300 40

Every row is one recording, measured as by `evaluate.py`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Annotated, Any

import numpy as np
import tyro
from numpy.typing import NDArray
from scipy.stats import bootstrap

from springfoot.agents.baselines import BASELINES, PolicyFunction, own_settings
from springfoot.agents.flags import given, optional_flags
from springfoot.agents.markdown import table, text_of
from springfoot.envs.settings import BipedSettings, settings_to_json
from springfoot.evaluation.metrics import measure
from springfoot.evaluation.recording import prepare, record

from .quantities import COMPARED_JOINTS, falls_text, rmse_text, walks_csv
from .study import Answer, OnProgress, WalkingStudy

PUSHED = BipedSettings(push_newton=150.0)
"""Pushes [N] of `best-constant` and `compare` unless flagged otherwise."""
RESAMPLES = 10_000
"""Resamples of the bootstrap."""
INTERVALS = f"Intervals: 95 %, percentile bootstrap of the mean over episodes (scipy.stats), {RESAMPLES:,} resamples."
"""How they are made."""
SECTION = "COMPARE"
"""Of the results page."""

PushedFlags = optional_flags("PushedFlags", BipedSettings, PUSHED)


@dataclass(frozen=True, kw_only=True, eq=False)
class Row:
    """One policy's episodes in numbers."""

    name: str
    """What was run."""
    metrics: dict[str, Any]
    """As in metrics.json."""
    returns: NDArray
    """(episodes,) return of each."""

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the mean return."""
        return mean_interval(self.returns)


def mean_interval(values: NDArray, level: float = 0.95) -> tuple[float, float]:
    """Percentile bootstrap interval of the mean of a sample (n,), from `RESAMPLES` resamples of a fixed seed.

    Falls make returns two-humped and skewed, so no normal distribution is assumed. Of one value, that value.
    """
    if len(values) < 2:
        return float(values[0]), float(values[0])
    found = bootstrap(
        (values,),
        np.mean,
        n_resamples=RESAMPLES,
        confidence_level=level,
        method="percentile",
        rng=np.random.default_rng(0),
    )
    return float(found.confidence_interval.low), float(found.confidence_interval.high)


def run_row(name: str, policy: PolicyFunction, settings: BipedSettings, **how: Any) -> Row:
    """Record (`episodes`, `seed`, `threads`, `progress` as for `recording.record`) and measure a policy."""
    recording = record(policy, settings, name=name, **how)
    return Row(name=name, metrics=measure(recording).metrics, returns=recording.returns)


def compare(
    name: str,
    given: dict[str, Any],
    best: tuple[float, float] | None = None,
    *,
    episodes: int = 100,
    seed: int = 0,
    threads: int = 2,
    progress: OnProgress = lambda seconds: None,
) -> list[Row]:
    """The policy `name` and every baseline on the same episodes, in the policy's own environment and reward.

    Args:
        name: any policy of `recording.prepare`.
        given: environment settings that differ from the evaluation's standard conditions and the policy's own.
        best: ankle and toe stiffness [N m/rad] of one more constant, as found by `best_constant`.
        episodes, seed, threads, progress: as for `recording.record`.

    Baselines act absolutely, whatever the policy does, and each pays for changing its own action. The row `thesis` has
    its own equilibrium, "phase".
    """
    policy, settings = prepare(name, given, seed)
    found = [] if best is None else [f"constant:{best[0]:g},{best[1]:g}"]
    prepared = [(name, policy, settings)]
    for baseline in [*BASELINES, *found]:
        own = own_settings(baseline, settings)
        prepared.append((baseline, *prepare(baseline, settings_to_json(settings) | own, seed)))
    how = {"episodes": episodes, "seed": seed, "threads": threads, "progress": progress}
    return [run_row(*each, **how) for each in prepared]


def comparison_table(rows: Sequence[Row]) -> str:
    """Markdown: the first row's policy against the others, and whether the intervals of the mean return are apart."""
    first = rows[0]
    head = ["policy", "falls", "return, mean [95 %]", "speed m/s", "RMSE thigh / knee / ankle °", "peaks 1 / 2 BW"]
    lines = [[*head, f"return against {first.name}"]]
    for row in rows:
        m, (low, high) = row.metrics, row.interval
        peaks = " / ".join(text_of(m["grf"][f"vertical_peak{peak}_bw"], ".2f") for peak in (1, 2))
        speed = text_of(m["speed_m_s"]["mean"], ".3f")
        returns = f"{row.returns.mean():.1f} [{low:.1f}, {high:.1f}]"
        against = "" if row is first else _against(row, first)
        lines.append([f"`{row.name}`", falls_text(m), returns, speed, rmse_text(m), peaks, against])
    return table(lines[0], lines[1:])


def verdict(rows: Sequence[Row]) -> str:
    """Of how many rows the first one's mean return is higher with intervals apart; where its joints are farther off."""
    first, *others = rows
    apart = sum(_against(row, first).startswith("lower") for row in others)
    closer = []
    for row, joint in product(others, COMPARED_JOINTS):
        rmse, own = (each.metrics["joints"][joint]["rmse_deg"] for each in (row, first))
        if rmse is not None and own is not None and rmse < own:
            closer.append(f"{row.name} {joint} by {own - rmse:.2f}°")
    return (
        f"{first.name}: higher mean return, intervals apart, than {apart} of {len(others)} rows; "
        f"smaller joint RMSE than its own: {', '.join(closer) or 'none'}."
    )


def _against(row: Row, first: Row) -> str:
    """On which side of the first row's interval another's lies."""
    (low, high), (first_low, first_high) = row.interval, first.interval
    if high < first_low:
        return "lower, intervals apart"
    return "higher, intervals apart" if low > first_high else "intervals overlap"


@dataclass(frozen=True, kw_only=True)
class Compare(WalkingStudy):
    """Hold a policy against every baseline: falls, returns with 95 % intervals, speed, joint angles, forces."""

    policy: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="POLICY")] = "pretrained"
    """Any policy of evaluate.py; all rows walk in its environment and earn its reward."""
    constant: Annotated[tuple[float, float] | None, tyro.conf.arg(metavar="ANKLE TOE")] = None
    """One more constant stiffness [N m/rad]: what best-constant found."""
    episodes: int = 100
    """Episodes of each row."""
    environment: tyro.conf.OmitArgPrefixes[PushedFlags]  # type: ignore[valid-type]
    """What to walk in; a trained policy brings its own settings, standard conditions aside."""

    def ask(self, progress: OnProgress) -> Answer:
        """Walk every row."""
        conditions = pushed(self.seconds, self.environment)
        rows = compare(self.policy, conditions, self.constant, **self.how, progress=progress)
        text = f"{comparison_table(rows)}\n\n{what_ran(self, rows[0])}\n{INTERVALS}\n{verdict(rows)}"
        low_high = [dict(zip(("return_low", "return_high"), row.interval, strict=True)) for row in rows]
        numbers = walks_csv(
            [({"policy": row.name} | ends, row.metrics) for row, ends in zip(rows, low_high, strict=True)]
        )
        return Answer(text=text, files={"compare.csv": numbers}, sections={SECTION: text})


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
