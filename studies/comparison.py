"""Studies: many evaluations held against each other, as markdown tables.

    python -m springfoot.studies.comparison best-constant
    python -m springfoot.studies.comparison compare --constant 300 40
    python -m springfoot.studies.comparison seeds runs/seed-1 runs/seed-2 runs/seed-3
    python -m springfoot.studies.comparison bodies pretrained

Every row is one recording, measured as by `evaluate.py`. What is compared shares its seeds, hence starts and pushes,
and its reward: that of the policy which the others are held against.
"""

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from itertools import product
from operator import getitem
from typing import Annotated, Any

import numpy as np
import tyro
from numpy.typing import NDArray
from tqdm import tqdm

from springfoot.agents.baselines import BASELINES, PolicyFunction, constant, own_settings
from springfoot.agents.command_line import exit_code
from springfoot.agents.flags import SettingsFlags, given, optional_flags
from springfoot.agents.markdown import table, text_of
from springfoot.envs.settings import BipedSettings, settings_to_json
from springfoot.evaluation.metrics import measure
from springfoot.evaluation.recording import prepare, record
from springfoot.gait.errors import SpringfootError, require_count
from springfoot.gait.scores import mean_sd

from .body_sweep import JOINTS, Bodies

PUSHED = BipedSettings(push_newton=150.0)
"""Pushes [N] of `best-constant` and `compare` unless flagged otherwise."""
RESAMPLES = 10_000
"""Resamples of the bootstrap."""
COARSE = (8, 5)
"""First grid of the search for a constant, ankle by toe stiffness: evenly on a log scale over their ranges."""
REFINEMENTS = 3
"""Times the search then halves its spacing around the best so far."""
SEARCH_SEED = 100_000
"""Of the search's first episode: far from a comparison's, so that the best constant is not fitted to its starts."""

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

    Falls make returns two-humped and skewed, so no normal distribution is assumed.
    """
    drawn = np.random.default_rng(0).integers(len(values), size=(RESAMPLES, len(values)))
    low, high = np.quantile(values[drawn].mean(axis=1), [0.5 - level / 2, 0.5 + level / 2])
    return float(low), float(high)


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
    progress: Callable[[float], object] = lambda seconds: None,
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


def best_constant(
    settings: BipedSettings,
    *,
    grid: tuple[int, int] = COARSE,
    refinements: int = REFINEMENTS,
    episodes: int = 16,
    seed: int = SEARCH_SEED,
    threads: int = 2,
    progress: Callable[[int], object] = lambda candidates: None,
) -> tuple[tuple[float, float], NDArray]:
    """The constant ankle and toe stiffness of the highest mean return in `settings`, and its returns (episodes,).

    A log `grid` over the settings' ranges, then `refinements` around the best; all candidates walk the same episodes.
    Stiffness [N m/rad] is for 1.70 m and 63 kg. The return of the best of many is optimistic: judge it on other seeds.
    """
    low, high = np.log([settings.ankle_stiffness_range, settings.toe_stiffness_range]).T
    spacing = (high - low) / (np.array(grid) - 1)
    settings = replace(settings, action_mode="absolute")
    how: dict[str, Any] = {"episodes": episodes, "seed": seed, "threads": threads}
    tried: dict[tuple[float, float], NDArray] = {}

    def best() -> tuple[float, float]:
        return max(tried, key=lambda pair: tried[pair].mean())

    for refinement in range(refinements + 1):
        points = low + np.array(list(product(*map(range, grid)))) * spacing
        if refinement:
            points = np.log(best()) + np.array(list(product((-1, 0, 1), repeat=2))) * spacing / 2**refinement
        for point in np.exp(np.clip(points, low, high)):
            pair = float(f"{point[0]:.3g}"), float(f"{point[1]:.3g}")  # as it will be typed
            if pair not in tried:
                tried[pair] = record(constant(settings, pair), settings, name="constant", **how).returns
            progress(1)
    return best(), tried[best()]


def comparison_table(rows: Sequence[Row]) -> str:
    """Markdown: the first row's policy against the others, and whether the intervals of the mean return are apart."""
    first = rows[0]
    head = ["policy", "falls", "return, mean [95 %]", "speed m/s", "RMSE thigh / knee / ankle °", "peaks 1 / 2 BW"]
    lines = [[*head, f"return against {first.name}"]]
    for row in rows:
        m, (low, high) = row.metrics, row.interval
        rmse = " / ".join(text_of(m["joints"][joint]["rmse_deg"], ".1f") for joint in JOINTS)
        peaks = " / ".join(text_of(m["grf"][f"vertical_peak{peak}_bw"], ".2f") for peak in (1, 2))
        falls, speed = f"{m['falls']} of {m['episodes']}", text_of(m["speed_m_s"]["mean"], ".3f")
        returns = f"{row.returns.mean():.1f} [{low:.1f}, {high:.1f}]"
        lines.append(
            [f"`{row.name}`", falls, returns, speed, rmse, peaks, "" if row is first else _against(row, first)]
        )
    return table(lines[0], lines[1:])


def verdict(rows: Sequence[Row]) -> str:
    """Of how many rows the first one's mean return is higher with intervals apart; where its joints are farther off."""
    first, *others = rows
    apart = sum(_against(row, first).startswith("lower") for row in others)
    closer = []
    for row, joint in product(others, JOINTS):
        rmse, own = (each.metrics["joints"][joint]["rmse_deg"] for each in (row, first))
        if rmse is not None and own is not None and rmse < own:
            closer.append(f"{row.name} {joint} by {own - rmse:.2f}°")
    return (
        f"{first.name}: higher mean return, intervals apart, than {apart} of {len(others)} rows; "
        f"smaller joint RMSE than its own: {', '.join(closer) or 'none'}."
    )


def seeds_table(rows: Sequence[Row]) -> str:
    """Markdown: numbers down, policies across, and their mean ± SD over the policies (n - 1)."""
    lines = [["", *(f"`{row.name}`" for row in rows), "mean ± SD"]]
    for label, pattern, keys in _QUANTITIES:
        values: list[Any] = [reduce(getitem, keys, row.metrics) for row in rows]
        spread = mean_sd(values) if None not in values else {"mean": None, "sd": None}
        fine = ".1f" if pattern == "d" else pattern
        mean, sd = (text_of(spread[key], fine) for key in ("mean", "sd"))
        lines.append([label, *(text_of(value, pattern) for value in values), f"{mean} ± {sd}"])
    return table(lines[0], lines[1:])


_QUANTITIES = (
    ("falls", "d", ("falls",)),
    ("return", ".1f", ("return", "mean")),
    ("speed m/s", ".3f", ("speed_m_s", "mean")),
    *((f"RMSE {joint} °", ".2f", ("joints", joint, "rmse_deg")) for joint in ("thigh", "knee", "ankle", "toe")),
    *((f"vertical peak {peak} BW", ".2f", ("grf", f"vertical_peak{peak}_bw")) for peak in (1, 2)),
    ("vertical force r", ".3f", ("grf", "vertical_r")),
    *(
        (f"{joint} K {phase.replace('_', '-')} N·m/rad", ".0f", ("stiffness_Nm_rad", joint, phase))
        for joint in ("ankle", "toe")
        for phase in ("loading", "mid_stance", "push_off", "swing")
    ),
)
"""Label, format, and place in metrics.json of what `seeds` shows."""


def _against(row: Row, first: Row) -> str:
    """On which side of the first row's interval another's lies."""
    (low, high), (first_low, first_high) = row.interval, first.interval
    if high < first_low:
        return "lower, intervals apart"
    return "higher, intervals apart" if low > first_high else "intervals overlap"


@dataclass(frozen=True, kw_only=True)
class _Study:
    """What every study is told."""

    episodes: int = 100
    """Episodes of each row."""
    seconds: float = 20.0
    """Length of each."""
    seed: int = 0
    """Episode i is seeded with seed + i, in every row."""
    threads: int = 2
    """Threads of the physics; the results are the same with any number."""

    def how(self) -> dict[str, Any]:
        """Arguments of `recording.record`; refuses what cannot be counted."""
        counts = {"episodes": self.episodes, "seed": self.seed, "threads": self.threads}
        for name, count in counts.items():
            require_count(name, count, 0 if name == "seed" else 1)
        return counts

    def conditions(self, environment: Any, push_newton: float = 0.0) -> dict[str, Any]:
        """The study's pushes and length, and what was asked for."""
        return {"push_newton": push_newton, "episode_seconds": self.seconds} | given(environment)


@dataclass(frozen=True, kw_only=True)
class BestConstant(_Study):
    """Find the constant ankle and toe stiffness with the highest mean return."""

    policy: str = "pretrained"
    """In whose environment and reward: any policy of evaluate.py; untrained for the defaults."""
    episodes: int = 16
    """Episodes of each candidate."""
    seed: int = SEARCH_SEED
    """Of every candidate's first episode; keep it apart from that of the comparison."""
    environment: tyro.conf.OmitArgPrefixes[PushedFlags]  # type: ignore[valid-type]
    """What to walk in."""

    def run(self) -> None:
        """Search, and print the pair and its return."""
        how = self.how()
        _, settings = prepare(self.policy, self.conditions(self.environment, PUSHED.push_newton))
        total = COARSE[0] * COARSE[1] + 9 * REFINEMENTS
        with tqdm(total=total, desc="best constant", leave=False, disable=None) as bar:
            (ankle, toe), returns = best_constant(settings, **how, progress=bar.update)
        low, high = mean_interval(returns)
        print(f"--constant {ankle:g} {toe:g}")
        print(
            f"ankle {ankle:g}, toe {toe:g} N·m/rad for 1.70 m and 63 kg: mean return {returns.mean():.1f} "
            f"[{low:.1f}, {high:.1f}] over the search's {len(returns)} episodes, the best of {total} tries"
        )


@dataclass(frozen=True, kw_only=True)
class Compare(_Study):
    """Hold a policy against every baseline: falls, returns with 95 % intervals, speed, joint angles, forces."""

    policy: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="POLICY")] = "pretrained"
    """Any policy of evaluate.py; all rows walk in its environment and earn its reward."""
    constant: Annotated[tuple[float, float] | None, tyro.conf.arg(metavar="ANKLE TOE")] = None
    """One more constant stiffness [N m/rad]: what best-constant found."""
    environment: tyro.conf.OmitArgPrefixes[PushedFlags]  # type: ignore[valid-type]
    """What to walk in; a trained policy brings its own settings, standard conditions aside."""

    def run(self) -> None:
        """Run every row and print the table."""
        how, conditions = self.how(), self.conditions(self.environment, PUSHED.push_newton)
        with tqdm(desc="compare", unit="s", unit_scale=True, leave=False, disable=None) as bar:
            rows = compare(self.policy, conditions, self.constant, **how, progress=bar.update)
        print(f"{comparison_table(rows)}\n\n{_what_ran(self, rows[0])}")
        print(f"Intervals: percentile bootstrap of the mean over episodes, {RESAMPLES:,} resamples.\n{verdict(rows)}")


@dataclass(frozen=True, kw_only=True)
class Seeds(_Study):
    """Several policies side by side, such as the same training from several seeds, and their spread."""

    policies: Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="POLICY ...")]
    """Any policies of evaluate.py: run folders, files, names."""
    environment: tyro.conf.OmitArgPrefixes[SettingsFlags]  # type: ignore[valid-type]
    """What to walk in; a trained policy brings its own settings, standard conditions aside."""

    def run(self) -> None:
        """Run every policy and print the table."""
        if not self.policies:
            raise SpringfootError("give one policy or more: run folders, .safetensors files or names")
        how, conditions = self.how(), self.conditions(self.environment)
        prepared = [(name, *prepare(name, conditions, self.seed)) for name in self.policies]
        with tqdm(desc="seeds", unit="s", unit_scale=True, leave=False, disable=None) as bar:
            rows = [run_row(*each, **how, progress=bar.update) for each in prepared]
        print(f"{seeds_table(rows)}\n\n{_what_ran(self, rows[0])}")


def _what_ran(study: _Study, row: Row) -> str:
    """The episodes of a table in one sentence."""
    ran = row.metrics["environment"]
    pushes = "no pushes"
    if ran["push_newton"]:
        pushes = (
            f"pushes ±{ran['push_newton']:g} N × {ran['push_seconds']:g} s, one in every {ran['push_interval']:g} s"
        )
    last = study.seed + study.episodes - 1
    return f"{study.episodes} episodes × {ran['episode_seconds']:g} s, seeds {study.seed}–{last}, {pushes}."


def main() -> int:
    """Exit code: 0 done, 2 bad input, 130 ended by Ctrl-C."""
    flags = tyro.cli(BestConstant | Compare | Seeds | Bodies, prog="springfoot.studies.comparison")
    return exit_code("studies", flags.run)


if __name__ == "__main__":
    sys.exit(main())
