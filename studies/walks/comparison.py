"""Compare policies with each other, with springs that need no learning, and with themselves under other conditions.

    springfoot study compare pretrained --constant 363 79.5 --factor 1.07
    springfoot study compare runs/five/seed-0 runs/five/seed-1 runs/five/seed-2 --no-springs --pushes 0
    springfoot study compare pretrained --no-springs --pushes 0 --world
    springfoot study compare learned --no-springs --pushes 0 --laboratory

Each policy walks in its own environment, springs in the first policy's; all rows have the same seeds and are measured
as by `evaluate.py`. Returns are compared episode by episode (paired bootstrap), falls by McNemar's test.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, NamedTuple

import tyro

from springfoot.agents.policies import PolicyFunction, and_copy, own_settings
from springfoot.arrays import NDArray
from springfoot.envs.settings import BipedSettings, settings_to_json
from springfoot.errors import SpringfootError, require_count
from springfoot.evaluation.numbers import measure
from springfoot.evaluation.recording import policy_and_settings, record
from springfoot.files.markdown import MISSING, plus_minus, table, text_of
from springfoot.gait.people import mean_sd

from ..base.columns import OPEN_LOOP, WALK_COLUMNS, falls_text, rmse_text, walks_csv
from ..base.flags import RecordedFlags, given
from ..base.intervals import RESAMPLES, mean_interval, paired_p, share_interval
from ..base.study import Answer, OnProgress, WalkingStudy, episodes_words
from .laboratory import LABORATORY, laboratory_csv, laboratory_table

PUSHES = (150.0, 200.0)
"""Default pushes of `compare` [N]."""
WORLD: tuple[dict[str, Any], ...] = (
    {},
    {"push_newton": 150.0},
    {"slope_deg": 5.0},
    {"slope_deg": -5.0},
    {"unevenness_m": 0.01},
    {"friction": 0.5},
    {"stiffness_delay_s": 0.02},
    {"start": "standing", "stop_at": 12.0},
    {"leg_ratio": 0.94},
    {"leg_ratio": 1.06},
    {"foot_ratio": 0.93},
    {"foot_ratio": 1.07},
    {"carried_ratio": 0.159},
    {"carried_ratio": 0.317},
)
"""Conditions of `--world`. Proportions are ± 2 SD of adults; loads are 10 and 20 kg for 63 kg."""
QUASI_SPEED = 1.35
"""Commanded speed [m/s] at which people's quasi-stiffness, which is not tuned, walks about 1.2 m/s."""
COMPARABLE = (
    *("speed", "step_time_ratio", "cadence", "guide", "people_file", "plan_file", "human"),
    *("reward_weights", "forward_force_weight", "knee_weight"),
)
"""Settings that rows must share for a comparison of their returns."""
SIGNIFICANT = 0.05
"""Largest p of McNemar's test with which a row falls less often than another."""
INTERVALS = (
    f"Intervals: 95 %, percentile bootstrap over episodes (scipy.stats, {RESAMPLES:,} resamples), of the difference "
    "paired; falls: Wilson's, and p of McNemar's exact test against the first row."
)
"""Sentence of the report on its intervals."""


class Contender(NamedTuple):
    """A policy, the name of its row, and its environment."""

    name: str
    policy: PolicyFunction
    settings: BipedSettings


@dataclass(frozen=True, kw_only=True, eq=False)
class Row:
    """Numbers of one policy's episodes: a row of the tables."""

    name: str
    """Name of the policy in tables."""
    metrics: dict[str, Any]
    """Metrics as in metrics.json."""
    returns: NDArray
    """(episodes,) return of each episode."""
    fell: NDArray
    """(episodes,) True for an episode that ended in a fall."""

    @property
    def interval(self) -> tuple[float, float]:
        """Return the 95 % interval of the mean return."""
        return mean_interval(self.returns)

    def difference(self, first: "Row") -> tuple[float, float, float] | None:
        """Return the mean return of `first` less this row's, and the ends of its 95 % interval.

        None if the rows differ in a setting of `COMPARABLE`.
        """
        if any(self.metrics["environment"].get(name) != first.metrics["environment"].get(name) for name in COMPARABLE):
            return None
        differences = first.returns - self.returns
        return float(differences.mean()), *mean_interval(differences)


def run_row(name: str, policy: PolicyFunction, settings: BipedSettings, **how: Any) -> Row:
    """Return the row of a policy's walk; `how` has `episodes`, `seed`, `threads`, `progress` as for
    `recording.record`."""
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
    """Return the policy `name`, its open-loop copy (`with_copy`) and the springs to compare it with (`springs_beside`).

    All walk in the policy's own environment. `given` are environment settings that differ from the evaluation's
    standard conditions and the policy's own; `constant` and `factor` as for `springs_beside`.
    """
    return with_copy(name, given, seed, threads) + springs_beside(name, given, constant, factor, seed)


def with_copy(name: str, given: dict[str, Any], seed: int = 0, threads: int = 2) -> list[Contender]:
    """Return the policy `name` and, if it sets stiffness alone and has feedback, its open-loop copy."""
    first = Contender(name, *policy_and_settings(name, given, seed, threads))
    copies = and_copy(name)[1:] if first.settings.acts == "stiffness" else ()
    return [first, *(Contender(copy, *policy_and_settings(copy, given, seed, threads)) for copy in copies)]


def springs_beside(
    name: str,
    given: dict[str, Any],
    constant: tuple[float, float] | None = None,
    factor: float | None = None,
    seed: int = 0,
) -> list[Contender]:
    """Return the springs that need no learning, in the environment and with the reward of the policy `name`.

    The springs are: the action 0, with which a training starts (`untrained`); the tuned schedule, and a `factor` on it;
    a `constant` stiffness (ankle, toe) [N m/rad], and the default one; people's quasi-stiffness at the commanded speed,
    and commanded `QUASI_SPEED`; the thesis's lines, completed and as printed; random actions. The reward charges a
    spring for changes of its own action. Raises `SpringfootError` for a policy that moves the legs too.
    """
    _, settings = policy_and_settings(name, given, seed)
    if settings.acts != "stiffness":
        raise SpringfootError(f"{name} moves the legs too, which springs cannot: give --no-springs")
    springs = []
    for baseline in spring_names(constant, factor):
        conditions = settings_to_json(settings) | own_settings(baseline, settings)
        springs.append(Contender(baseline, *policy_and_settings(baseline, conditions, seed)))
        if baseline == "quasi_stiffness" and settings.speed == BipedSettings.speed:  # the default speed, 1.2 m/s
            faster = policy_and_settings(baseline, conditions | {"speed": QUASI_SPEED}, seed)
            springs.append(Contender(f"{baseline}, commanded {QUASI_SPEED:g} m/s", *faster))
    return springs


def spring_names(constant: tuple[float, float] | None, factor: float | None) -> list[str]:
    """Return the names of the baselines that `springs_beside` compares a policy with."""
    names = ["untrained", "schedule"]
    if factor:
        names.append(f"schedule:{factor:g}")
    if constant:
        ankle, toe = constant
        names.append(f"constant:{ankle:g},{toe:g}")
    return [*names, "constant", "quasi_stiffness", "thesis", "thesis_printed", "random"]


def comparison_table(rows: Sequence[Row]) -> str:
    """Return the Markdown table of the policies: falls and return against the first row's, speed, RMSE."""
    first = rows[0]
    head = ["policy", "falls [95 %]", "p", "return", f"{first.name} is ahead by [95 %]", "speed m/s"]
    lines = []
    for row in rows:
        m = row.metrics
        low, high = share_interval(m["falls"], m["episodes"])
        falls = f"{m['falls']} of {m['episodes']} [{100 * low:.0f}, {100 * high:.0f} %]"
        ahead = ""
        p = ""
        if row is not first:
            difference = row.difference(first)
            ahead = MISSING if difference is None else "{:.1f} [{:.1f}, {:.1f}]".format(*difference)
            p = f"{paired_p(first.fell, row.fell):.2g}"
        speed = text_of(m["speed_m_s"]["mean"], ".3f")
        lines.append([f"`{row.name}`", falls, p, f"{row.returns.mean():.1f}", ahead, speed, rmse_text(m)])
    return table([*head, "RMSE thigh / knee / ankle °"], lines)


def verdict(rows: Sequence[Row]) -> str:
    """Return, in words, the rows that the first row is ahead of in return and in falls, and the rows that it is not."""
    first, *others = rows
    differences = [row.difference(first) for row in others]
    not_beaten = [
        row.name
        for row, difference in zip(others, differences, strict=True)
        if difference is not None and difference[1] <= 0.0
    ]
    compared = sum(difference is not None for difference in differences)
    fall_more = [
        row.name for row in others if paired_p(first.fell, row.fell) < SIGNIFICANT and first.fell.sum() < row.fell.sum()
    ]
    no_more_falls = [row.name for row in others if row.name not in fall_more]
    earns = (
        f"{first.name} earns more than {compared - len(not_beaten)} of {compared} rows (interval above 0)"
        f"{'; not more than ' + ', '.join(not_beaten) if not_beaten else ''}"
    )
    return (
        f"{earns if compared else f'No return compares with that of {first.name}'}. It falls less often than "
        f"{len(fall_more)} of {len(others)} (p < {SIGNIFICANT:g})"
        f"{'; not less than ' + ', '.join(no_more_falls) if no_more_falls else ''}."
    )


def spread_table(rows: Sequence[Row]) -> str:
    """Return the Markdown table with a line for each of `WALK_COLUMNS` and a column for each policy, the last with
    their mean ± SD (n - 1)."""
    lines = []
    for column in WALK_COLUMNS:
        values = [column.of(row.metrics) for row in rows]
        spread = mean_sd([] if None in values else values)
        mean = plus_minus(spread, ".1f" if column.pattern == "d" else column.pattern, alone=False)
        lines.append([column.label, *(text_of(value, column.pattern) for value in values), mean])
    return table(["", *(f"`{row.name}`" for row in rows), "mean ± SD"], lines)


def elsewhere_table(name: str, rows: Sequence[tuple[str, Sequence[Row]]]) -> str:
    """Return the Markdown table with a line for each condition, of the policy `name` and its open-loop copy.

    `rows` are conditions in words, each with the policy's row and, if it has a copy that walks, the copy's.
    """
    lines = []
    for words, (row, *copies) in rows:
        m = row.metrics
        peaks = " / ".join(text_of(m["grf"][f"vertical_peak{peak}_bw"], ".2f") for peak in (1, 2))
        largest = text_of(m["grf"]["vertical_max_bw"], ".2f")
        of_copies = [cell for copy in copies for cell in _walk_cells(copy.metrics)]
        lines.append([words or "(none)", *_walk_cells(m), peaks, largest, *of_copies])
    columns = ["falls", "speed m/s", "RMSE thigh / knee / ankle °"]
    copy_columns = [f"{OPEN_LOOP}: {column}" for column in columns] * (max(len(row) for _, row in rows) - 1)
    head = [f"`{name}` with", *columns, "peaks 1 / 2 BW", "largest 10 ms BW", *copy_columns]
    # A dash in each cell of a copy that does not walk under a condition.
    return table(head, [[*line, *[MISSING] * (len(head) - len(line))] for line in lines])


def _walk_cells(m: dict[str, Any]) -> list[str]:
    """Return the cells of one walk: falls (and how many came to rest), speed, RMSE."""
    at_rest = "" if m["came_to_rest"] is None else f", {m['came_to_rest']} at rest"
    return [falls_text(m) + at_rest, text_of(m["speed_m_s"]["mean"], ".3f"), rmse_text(m)]


@dataclass(frozen=True, kw_only=True)
class Compare(WalkingStudy):
    """Compare policies with each other, with springs that need no learning, and with themselves under other conditions.

    Each policy walks in its own environment, springs in the first policy's, all on the same seeds. A trained policy has
    its open-loop copy beside it. Several policies, such as one training from several seeds, get their mean and spread.
    """

    policies: Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="POLICY ...")] = ("pretrained",)
    """Any policies of evaluate.py: run folders, files, names."""
    springs: bool = True
    """Also walk springs that need no learning."""
    constant: Annotated[tuple[float, float] | None, tyro.conf.arg(metavar="ANKLE TOE")] = None
    """A constant stiffness [N m/rad] among them, beside the default one."""
    factor: Annotated[float | None, tyro.conf.arg(metavar="FLOAT")] = None
    """A factor on the schedule among them."""
    pushes: tuple[float, ...] = PUSHES
    """Sizes of the pushes [N], a table each."""
    world: bool = False
    """Also walk every policy on slopes, uneven and slippery ground, with delays, loads and other proportions."""
    laboratory: bool = False
    """Also walk every policy on slopes of 8 %, with loads, on heavy feet and at other step times, as laboratories had
    people."""
    episodes: int = 100
    """Episodes of each row."""
    environment: tyro.conf.OmitArgPrefixes[RecordedFlags]  # type: ignore[valid-type]
    """Environment; a trained policy brings its own settings, standard conditions aside."""

    QUICK: ClassVar[dict[str, Any]] = {
        "episodes": 1,
        "seconds": 4.0,
        "pushes": (150.0,),
        "world": False,
        "laboratory": False,
    }

    def check(self) -> None:
        """Refuse an empty list of policies."""
        super().check()
        if not self.policies:
            raise SpringfootError("give one policy or more: run folders, .safetensors files or names")
        require_count("pushes", len(self.pushes))

    @property
    def total(self) -> float:
        """Return the simulated time of all walks if none falls [s]."""
        names = sum(len(and_copy(name)) for name in self.policies)
        baselines = {*spring_names(self.constant, self.factor)} - {*self.policies}
        springs = self.springs * (len(baselines) + 1)  # quasi-stiffness walks at two speeds
        rows = len(self.pushes) * (names + springs) + self.world * len(WORLD) * names
        rows += self.laboratory * len(LABORATORY) * len(self.policies)
        return rows * self.episodes * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """Walk every row under every push, then under other conditions."""
        parts = []
        lines = []
        for push in self.pushes:
            conditions = self._conditions | {"push_newton": push}
            compared = [row for name in self.policies for row in with_copy(name, conditions, self.seed, self.threads)]
            if self.springs:
                springs = springs_beside(next(iter(self.policies)), conditions, self.constant, self.factor, self.seed)
                compared += [spring for spring in springs if spring.name not in self.policies]
            rows = [run_row(*contender, **self.how, progress=progress) for contender in compared]
            parts += [f"**{what_ran(self, rows[0])}**", comparison_table(rows)]
            if len(rows) > 1:
                parts.append(verdict(rows))
            if len(self.policies) > 1:
                parts.append(spread_table([row for row in rows if row.name in self.policies]))
            lines += [(_csv_labels(push, row, rows[0]), row.metrics) for row in rows]
        parts.append(INTERVALS)
        files = {"compare.csv": walks_csv(lines)}
        if self.world:
            elsewhere = {name: self._walk_world(name, progress) for name in self.policies}
            parts += [elsewhere_table(name, rows) for name, rows in elsewhere.items()]
            parts.append(f"{self.what_ran} of each row.")
            files["world.csv"] = walks_csv(
                [
                    ({"policy": row.name, "conditions": words}, row.metrics)
                    for conditions in elsewhere.values()
                    for words, rows in conditions
                    for row in rows
                ]
            )
        if self.laboratory:
            walks = {name: self._walk_laboratory(name, progress) for name in self.policies}
            parts += [laboratory_table(name, of_policy) for name, of_policy in walks.items()]
            parts.append(
                f"{self.what_ran} of each row, at the same command; in brackets the change from the usual walk. "
                "`springfoot study effects` holds such changes, at equal walked speed, against people's."
            )
            files["laboratory.csv"] = laboratory_csv(walks)
        return Answer(text="\n\n".join(parts), files=files)

    @property
    def _conditions(self) -> dict[str, Any]:
        """Return the settings of all rows: no pushes, the flag `seconds`, then the environment's flags."""
        return {"push_newton": 0.0, "episode_seconds": self.seconds} | given(self.environment)

    def _with_copy_if_it_walks(self, name: str, conditions: dict[str, Any]) -> list[Contender]:
        """Return a policy and its open-loop copy; the policy alone if it falls too soon for a copy."""
        alone = Contender(name, *policy_and_settings(name, conditions, self.seed))
        try:
            return [alone, *with_copy(name, conditions, self.seed, self.threads)[1:]]
        except SpringfootError:
            return [alone]

    def _walk_world(self, name: str, progress: OnProgress) -> list[tuple[str, list["Row"]]]:
        """Walk a policy and its open-loop copy under each of `WORLD`; return each condition in words, with its rows."""
        walked = []
        for conditions in WORLD:
            contenders = self._with_copy_if_it_walks(name, self._conditions | conditions)
            words = ", ".join(f"{key} {value}" for key, value in conditions.items())
            walked.append((words, [run_row(*contender, **self.how, progress=progress) for contender in contenders]))
        return walked

    def _walk_laboratory(self, name: str, progress: OnProgress) -> dict[str, dict[str, Any]]:
        """Walk a policy under each of `LABORATORY`; return the metrics by condition."""
        walks = {}
        for words, conditions in LABORATORY.items():
            contender = Contender(name, *policy_and_settings(name, {**self._conditions, **conditions}, self.seed))
            walks[words] = run_row(*contender, **self.how, progress=progress).metrics
        return walks


def _csv_labels(push: float, row: Row, first: Row) -> dict[str, Any]:
    """Return the first columns of a row of compare.csv: name, push, intervals of falls and return, lead of `first`."""
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


def what_ran(study: WalkingStudy, row: Row) -> str:
    """Return a sentence on the episodes and pushes of a table, from one of its rows."""
    settings = row.metrics["environment"]
    pushes = "no pushes"
    if settings["push_newton"]:
        size = f"±{settings['push_newton']:g} N × {settings['push_seconds']:g} s"
        pushes = f"pushes {size}, one in every {settings['push_interval']:g} s"
    return f"{episodes_words(study.episodes, settings['episode_seconds'], study.seed)}, {pushes}."
