"""Find springs of ankle and toe from pushes, beside the applied K, and test whether the joints are springs at all.

    springfoot study identify
    springfoot study identify schedule frozen:pretrained pretrained
    springfoot study identify schedule --repeats 200

`frozen:POLICY` is a policy's mean K over the phase, played open loop (`springfoot.evaluation.recording.open_loop`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
import tyro

from springfoot.envs.control import FEET
from springfoot.envs.physics import damping_times
from springfoot.envs.settings import body_of
from springfoot.errors import SpringfootError, require_count, require_number
from springfoot.evaluation.recording import alike_legs, record
from springfoot.files.markdown import MISSING, table
from springfoot.files.writing import csv_text
from springfoot.gait.springs import REACTS, SPRING, SPRINGS, Estimate

from ..base.study import Answer, OnProgress, WalkingStudy
from .push_experiment import Row, identified, prepare_pushed, samples

UNDISTURBED_EPISODES = 8
"""Episodes without pushes, from which the usual estimator finds springs for comparison."""
REPEAT_EPISODES, REPEAT_SECONDS = 28, 6.0
"""Episodes, and length of each, of a repeat of the experiment."""


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """Results of the experiment on one policy."""

    policy: str
    """Pushed policy."""
    episodes: int
    """Number of episodes."""
    falls: int
    """Episodes that ended in a fall."""
    damping_time: tuple[float, float]
    """True beta of ankle and toe [s]."""
    rows: tuple[Row, ...]
    """Leg by leg where they are not alike, joint by joint, phase by phase."""
    repeats: tuple[tuple[Row, ...], ...] = ()
    """Rows of every repeat, each on other episodes."""

    def of(self, joint: str) -> list[Row]:
        """Return the rows of a joint where it carries load."""
        return [row for row in self.rows if row.joint == joint and row.loaded]

    def repeated(self, row: Row) -> list[Row]:
        """Return the repeats' rows of the same joint and phase as `row`."""
        return [repeat[self.rows.index(row)] for repeat in self.repeats]


def springs_table(experiment: Experiment) -> str:
    """Return the Markdown table with a line for each joint and phase under load: applied K, estimates, verdict.

    Legs that are not alike have lines of their own.
    """
    head = (
        "",
        "% of stride",
        "K applied",
        "K pushed [95 %]",
        "off",
        "β ms [95 %]",
        "explained by K and β",
        "by further states",
        "verdict",
        "K undisturbed",
    )
    lines = []
    for row in (row for joint in SPRINGS for row in experiment.of(joint)):
        mean, low, high = row.applied
        spring = row.pushed
        undisturbed = row.undisturbed and row.undisturbed.stiffness
        varies = high - low > 0.01 * mean  # by more than the rounding of a constant K
        lines.append(
            (
                row.joint if row.leg == "both" else f"{row.leg} {row.joint}",
                f"{100 * row.start:.0f}–{100 * row.end:.0f}",
                f"{mean:.1f} ({low:.0f}–{high:.0f})" if varies else f"{mean:.1f}",
                _interval(spring.stiffness, 1.0),
                f"{100 * (spring.stiffness.value / mean - 1):+.1f} %" if spring.stiffness else MISSING,
                _interval(spring.damping_time, 1000.0),
                f"{100 * spring.explained:.0f} %",
                f"{100 * spring.reaction:.1f} %",
                spring.verdict,
                f"{undisturbed.value:.0f}" if undisturbed else MISSING,
            )
        )
    return table(head, lines)


def sentence(experiment: Experiment) -> str:
    """Return the verdict on each joint over all its phases under load, and the falls, in a sentence."""
    clauses = []
    for joint in SPRINGS:
        rows = experiment.of(joint)
        reacting, springs = (sum(row.pushed.verdict == verdict for row in rows) for verdict in (REACTS, SPRING))
        if reacting:
            clauses.append(f"{joint} **{REACTS}**, in {reacting} of {len(rows)} phases")
            continue
        errors = [abs(row.pushed.stiffness.value / row.applied[0] - 1) for row in rows if row.pushed.stiffness]
        within = f", K within {100 * max(errors):.1f} % of what was applied" if errors else ""
        clauses.append(f"{joint} a spring in {springs} of {len(rows)} phases{within}")
    return f"`{experiment.policy}`: {'; '.join(clauses)}. {experiment.falls} of {experiment.episodes} episodes fell."


def coverage_table(experiments: Sequence[Experiment]) -> str:
    """Return the Markdown table of the repeats under load: how often the intervals hold the applied K and beta, and how
    often each verdict comes."""
    head = ("", "", "phases", "repeats", "K in its interval", "β in its interval", "called a spring", "called reacting")
    lines = []
    for experiment in experiments:
        for column, joint in enumerate(SPRINGS):
            rows = experiment.of(joint)
            beta = experiment.damping_time[column]
            phases = [experiment.repeated(row) for row in rows]  # the repeats' rows of each phase
            columns = [
                [[_holds(row.pushed.stiffness, row.applied[0]) for row in repeats] for repeats in phases],
                [[_holds(row.pushed.damping_time, beta) for row in repeats] for repeats in phases],
                [[row.pushed.verdict == SPRING for row in repeats] for repeats in phases],
                [[row.pushed.verdict == REACTS for row in repeats] for repeats in phases],
            ]
            counts = (f"{len(rows)}", f"{len(experiment.repeats)}")
            lines.append((f"`{experiment.policy}`", joint, *counts, *map(_percent_text, columns)))
    return table(head, lines)


def springs_csv(experiments: Sequence[Experiment]) -> str:
    """Return the CSV with a line for each policy, repeat, leg, joint and phase; repeat 0 is the experiment itself."""
    spans = [f"{name}{end}" for name in ("stiffness_Nm_rad", "damping_time_s") for end in ("", "_low", "_high")]
    head = (
        *("policy", "repeat", "leg", "joint", "start", "end", "load"),
        *("applied_Nm_rad", "applied_lowest", "applied_highest"),
        *("samples", "trials", *spans, "explained", "reaction", "reaction_p", "angle_spread_rad", "verdict", "reason"),
        "undisturbed_Nm_rad",
    )
    lines = []
    for experiment in experiments:
        for repeat, rows in enumerate((experiment.rows, *experiment.repeats)):
            for row in rows:
                spring = row.pushed
                undisturbed = row.undisturbed and row.undisturbed.stiffness
                estimates = [*(spring.stiffness or [None] * 3), *(spring.damping_time or [None] * 3)]
                numbers = (spring.explained, spring.reaction, spring.reaction_p, spring.angle_spread)
                labels = (experiment.policy, repeat, row.leg, row.joint, row.start, row.end, row.load, *row.applied)
                result = (spring.samples, spring.trials, *estimates, *numbers, spring.verdict, spring.reason)
                lines.append((*labels, *result, undisturbed and undisturbed.value))
    return csv_text(head, lines)


def _interval(estimate: Estimate | None, scale: float) -> str:
    """Return an estimate and its interval, times `scale`, as in "310.2 [301.5, 318.9]"; a dash for None."""
    return MISSING if estimate is None else "{:.1f} [{:.1f}, {:.1f}]".format(*(scale * number for number in estimate))


def _holds(estimate: Estimate | None, truth: float) -> bool:
    """Return True if the estimate's interval contains the truth."""
    return estimate is not None and estimate.low <= truth <= estimate.high


def _percent_text(hits: Sequence[Sequence[bool]]) -> str:
    """Return the percentage of True, as in "94.2 % (90.0–98.5)": over all, then in the worst and the best phase.

    `hits` has for each phase a bool for each repeat; a dash stands for no phases.
    """
    if not hits:
        return MISSING
    percent = 100 * np.mean(hits, axis=1)  # of each phase
    return f"{percent.mean():.1f} % ({percent.min():.1f}–{percent.max():.1f})"


@dataclass(frozen=True, kw_only=True)
class Identify(WalkingStudy):
    """Find springs of ankle and toe from walking under random pushes, and test whether they are springs at all."""

    policies: Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="POLICY ...")] = ("pretrained",)
    """Policies of evaluate.py, or frozen:POLICY, a policy's mean K over the phase played open loop."""
    episodes: int = 128
    """Episodes of each policy, each a trial."""
    push_newton: float = 100.0
    """Size of the pushes, forward or backward at random [N]."""
    push_seconds: float = 0.1
    """Length of each push [s]."""
    push_interval: float = 2.0
    """One push at a random time in each interval of this length [s]."""
    noise_percent: float = 1.0
    """Noise on the measured torque: standard deviation in percent of the largest torque of the mean stride."""
    decisions: Literal["100hz", "50hz", "25hz"] | None = None
    """Decisions on K; by default 100hz for policies that follow the phase alone, and as trained for others."""
    margin: float = 0.0
    """Part of the stride left out at both ends of each phase: 0.02 where K is held from the phase before."""
    repeats: int = 0
    """Measure instead how often the intervals hold in this many other experiments, each of 28 episodes × 6 s."""

    QUICK: ClassVar = {"episodes": 28, "seconds": 4.5, "repeats": 0}

    def check(self) -> None:
        """Refuse impossible pushes and noise."""
        super().check()
        if not self.policies:
            raise SpringfootError("give one policy or more: run folders, .safetensors files or names")
        require_number("push_newton", self.push_newton, 0, above=True, unit="N")
        require_number("noise_percent", self.noise_percent, 0)
        require_number("margin", self.margin, 0, 0.02, "of a stride")
        require_count("repeats", self.repeats, 0)

    @property
    def total(self) -> float:
        """Return the simulated time of all walks if none falls [s]."""
        once = (self.episodes + UNDISTURBED_EPISODES) * self.seconds
        repeats = self.repeats * REPEAT_EPISODES * REPEAT_SECONDS
        return len(self.policies) * (once + repeats)

    def ask(self, progress: OnProgress) -> Answer:
        """Push every policy, and find its springs; with `repeats` tell how often their intervals hold the truth."""
        experiments = [self._identify_policy(name, progress) for name in self.policies]
        if self.repeats:
            text = f"{coverage_table(experiments)}\n\n{self._coverage_note} {self._pushes}"
        else:
            parts = [f"{sentence(experiment)}\n\n{springs_table(experiment)}" for experiment in experiments]
            text = "\n\n".join([*parts, f"{self._springs_note} {self._pushes}"])
        return Answer(text=text, files={"springs.csv": springs_csv(experiments)})

    @property
    def _springs_note(self) -> str:
        """Return the note below `springs_table`."""
        return (
            "K in N·m/rad, with its range where it ramps. Rows: where the joint carries load, more than a tenth of its "
            "largest torque; the CSV file has all. K undisturbed: what the estimator without pushes makes of the same "
            f"walk. {self.what_ran} of each policy."
        )

    @property
    def _coverage_note(self) -> str:
        """Return the note below `coverage_table`."""
        return (
            "Percent of all phases in which the joint carries load, and (of the phase with fewest – with most). "
            f"{self.repeats} experiments of {REPEAT_EPISODES} episodes × {REPEAT_SECONDS:g} s each, no episode twice."
        )

    @property
    def _pushes(self) -> str:
        """Return the pushes of the experiment and its noise, decisions and margin, in words."""
        further = f" K decided at {self.decisions}." if self.decisions else ""
        further += f" {100 * self.margin:g} % of the stride left out at both ends of each phase." if self.margin else ""
        return (
            f"A push of ±{self.push_newton:g} N × {self.push_seconds:g} s at a random time in each "
            f"{self.push_interval:g} s; legs that are alike together, others apart; noise on the torque of "
            f"{self.noise_percent:g} % of the mean stride's largest, lasting 50 ms.{further}"
        )

    def _identify_policy(self, name: str, progress: OnProgress) -> Experiment:
        """Walk a policy pushed and undisturbed, and identify its springs; for each of `repeats` identify them again on
        shorter pushed walks with other seeds."""
        pushes = ("push_newton", "push_seconds", "push_interval")
        conditions: dict[str, Any] = {key: getattr(self, key) for key in pushes} | {"episode_seconds": self.seconds}
        conditions |= {"decisions": self.decisions} if self.decisions else {}
        policy, settings = prepare_pushed(name, conditions, self.seed, self.threads)
        common: dict[str, Any] = {"name": name, "threads": self.threads, "progress": progress}
        pushed = record(policy, settings, episodes=self.episodes, seed=self.seed, **common)
        without_pushes = replace(settings, push_newton=0.0)
        undisturbed = record(policy, without_pushes, episodes=UNDISTURBED_EPISODES, seed=self.seed, **common)
        groups = alike_legs(undisturbed)
        rows: list[Row] = []
        for legs in groups:
            noisy = samples(pushed, self.noise_percent, self.seed, legs)
            rows += identified(noisy, samples(undisturbed, legs=legs), self.margin)
        repeats = []
        shorter = replace(settings, episode_seconds=REPEAT_SECONDS)
        for repeat in range(self.repeats):
            first_seed = self.seed + self.episodes + repeat * REPEAT_EPISODES
            again = record(policy, shorter, episodes=REPEAT_EPISODES, seed=first_seed, **common)
            noisy_again = [samples(again, self.noise_percent, first_seed, legs) for legs in groups]
            repeats.append(tuple(row for noisy in noisy_again for row in identified(noisy, margin=self.margin)))
        ankle, toe = damping_times(body_of(settings))[FEET]
        return Experiment(
            policy=name,
            episodes=self.episodes,
            falls=int((pushed.fall_reason != "").sum()),
            damping_time=(float(ankle), float(toe)),
            rows=tuple(rows),
            repeats=tuple(repeats),
        )
