"""Walk one episode with each of many random bodies and speeds, and compare it with people at its Froude speed.

    springfoot study bodies pretrained --pairs 300

Heights, masses and speeds are drawn independently and uniformly over the ranges of `train.py --preset any-body`. A
height and a mass that make no body (`springfoot.gait.body.body.BMI_RANGE`) are drawn again.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
import tyro

from springfoot.agents.policies import PolicyFunction, and_copy
from springfoot.agents.training import PRESETS
from springfoot.arrays import NDArray
from springfoot.envs.control import DRAWN, Subjects, tabulated_speeds
from springfoot.envs.settings import BipedSettings, body_of, reference_gait
from springfoot.errors import require_count
from springfoot.evaluation.numbers import measure
from springfoot.evaluation.recording import BATCH, Recording, policy_and_settings, policy_label, record_each
from springfoot.files.markdown import table
from springfoot.files.writing import csv_text

from ..base.columns import COMPARED_JOINTS, OPEN_LOOP, open_loop_note
from ..base.flags import SettingsFlags, given
from ..base.study import Answer, OnProgress, Study

RANGES = {f"{name}_range": getattr(PRESETS["any-body"].environment, f"{name}_range") for name in DRAWN}
"""Default ranges of the draw [m], [kg], [m/s]."""
PAIRS = "pairs.csv"
"""File with a row for each pair of body and speed."""
PAIRS_OPEN_LOOP = "pairs_open_loop.csv"
"""File with a row for each pair, walked by the policy's open-loop copy."""
VERTICAL_R = "grf_vertical_r"
"""The one column that the open-loop copy does not have."""
WORST_FALLS = 10
"""Falls that the report names one by one."""

BODY_COLUMNS = (
    ("speed error %", "speed_error_percent", ".1f", abs),
    *((f"RMSE {joint} °", f"{joint}_rmse_deg", ".1f", abs) for joint in COMPARED_JOINTS),
    ("vertical force r", VERTICAL_R, ".3f", lambda r: -r),
)
"""Label, column of pairs.csv, format, and a function that is larger for a worse value."""


def draw_pairs(settings: BipedSettings, pairs: int, seed: int = 0) -> dict[str, NDArray]:
    """Draw `height` [m], `mass` [kg] and `speed` [m/s], (pairs,) each, as a reset of `settings` draws them."""
    subjects = Subjects(settings, tabulated_speeds(settings), pairs)
    subjects.reset(np.arange(pairs), [np.random.default_rng(seed)] * pairs)
    height, mass = np.array([(body.height, body.mass) for body in subjects.bodies]).T
    return {"height": height, "mass": mass, "speed": subjects.speed}


def walk_pairs(
    policy: PolicyFunction,
    settings: BipedSettings,
    subjects: Mapping[str, NDArray],
    *,
    name: str,
    seed: int = 0,
    threads: int = 2,
    block: int = BATCH,
    progress: OnProgress = lambda seconds: None,
) -> list[dict[str, Any]]:
    """Walk one episode with each pair of body and speed; return a row of pairs.csv for each.

    Args:
        policy, settings, name, seed, threads, progress: as for `recording.record_each`.
        subjects: `height` [m], `mass` [kg] and `speed` [m/s], (pairs,) each, as from `draw_pairs`.
        block: number of pairs that walk at a time; their series are freed before the next ones walk.

    docs/reference/metrics.md explains the columns; None stands for a number that could not be measured.
    """
    rows = []
    for first in range(0, len(subjects["height"]), block):
        part = {key: values[first : first + block] for key, values in subjects.items()}
        recordings = record_each(
            policy, settings, part, name=name, seed=seed + first, threads=threads, progress=progress
        )
        rows += [_row(recording) for recording in recordings]
    return rows


def _row(recording: Recording) -> dict[str, Any]:
    """Return the row of pairs.csv for the recording of one pair's episode."""
    metrics = measure(recording).metrics
    settings = recording.settings
    speed = metrics["speed_m_s"]["mean"]
    return {
        "height_m": settings.height,
        "mass_kg": settings.mass,
        "speed_m_s": settings.speed,
        "froude_speed": body_of(settings).froude_speed(settings.speed),
        "people_clamped": int(reference_gait(settings).clamped),
        "seconds": metrics["seconds_mean"],
        "fall": str(recording.fall_reason[0]),
        "measured_speed_m_s": speed,
        "speed_error_percent": None if speed is None else 100 * (speed / settings.speed - 1),
        **{f"{joint}_rmse_deg": metrics["joints"][joint]["rmse_deg"] for joint in COMPARED_JOINTS},
        "grf_vertical_r": metrics["grf"]["vertical_r"],
    }


def pairs_table(rows: Sequence[Mapping[str, Any]], copy: Sequence[Mapping[str, Any]] = ()) -> str:
    """Return the Markdown table of the pairs, and below it the first falls one by one.

    The table has the number of falls, and median, 95 % bound and worst value of each number over the pairs that did not
    fall; beside them the same of the policy's open-loop `copy` on the same pairs.
    """
    lines: list[list[str]] = [["falls", _falls(rows), "", "", "", *([_falls(copy), "", ""] if copy else [])]]
    for label, column, pattern, badness in BODY_COLUMNS:
        if standing := _pairs_that_stood(rows, column, badness):
            line = [label, *_spread(standing, column, pattern), _body_and_speed(standing[-1])]
            if copy:
                copy_standing = _pairs_that_stood(copy, column, badness) if column != VERTICAL_R else []
                line += _spread(copy_standing, column, pattern) if copy_standing else ["", "", ""]
            lines.append(line)
    columns = ("median", "95 % within", "worst")
    text = table(["", *columns, "worst pair", *(f"{OPEN_LOOP}: {name}" for name in columns if copy)], lines)
    fallen = [row for row in rows if row["fall"]]
    falls = [f"{_body_and_speed(row)}: after {row['seconds']:.1f} s, {row['fall']}" for row in fallen[:WORST_FALLS]]
    return "\n".join([text, "", *falls]).rstrip("\n")


def _falls(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return the number of pairs that fell, as in "2 of 300"."""
    return f"{sum(bool(row['fall']) for row in rows)} of {len(rows)}"


def _pairs_that_stood(rows: Sequence[Mapping[str, Any]], column: str, badness: Callable[[float], float]) -> list:
    """Return the rows of pairs that did not fall and have a number in the column, the worst last.

    `badness` is larger for a worse number (`BODY_COLUMNS`).
    """
    return sorted(
        (row for row in rows if not row["fall"] and row[column] is not None), key=lambda row: badness(row[column])
    )


def _spread(standing: Sequence[Mapping[str, Any]], column: str, pattern: str) -> list[str]:
    """Return median, 95 % bound and worst magnitude of a column as text; `standing` are rows with the worst last."""
    size = [abs(row[column]) for row in standing]
    bound = size[int(np.ceil(0.95 * len(size))) - 1]  # 95 % of the pairs are no worse than this one
    return [format(value, pattern) for value in (np.median(size), bound, size[-1])]


def _body_and_speed(row: Mapping[str, Any]) -> str:
    """Return body and speed of a pair, in words."""
    return f"{row['height_m']:.2f} m, {row['mass_kg']:.0f} kg, {row['speed_m_s']:.2f} m/s"


@dataclass(frozen=True, kw_only=True)
class Bodies(Study):
    """Walk many bodies at many speeds: falls, speed, joint angles and forces against people's, over all pairs.

    A trained policy stands beside its open-loop copy. The copy's mean stiffness changes with speed and scales with
    the body.
    """

    policy: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="POLICY")] = "pretrained"
    """Any policy of evaluate.py."""
    pairs: int = 300
    """Bodies and speeds drawn, from --height-range, --mass-range and --speed-range."""
    seconds: float = 20.0
    """Length of the episode of each pair."""
    seed: int = 0
    """Seed of the draw; the episode of pair i has seed + i."""
    threads: int = 2
    """Threads of the physics; the results are the same with any number."""
    environment: tyro.conf.OmitArgPrefixes[SettingsFlags]  # type: ignore[valid-type]
    """Environment; a trained policy brings its own settings, standard conditions aside."""

    QUICK: ClassVar[dict[str, Any]] = {"pairs": 2, "seconds": 5.0}

    def check(self) -> None:
        """Refuse counts out of range."""
        for name, least in (("pairs", 1), ("seed", 0), ("threads", 1)):
            require_count(name, getattr(self, name), least)

    @property
    def total(self) -> float:
        """Return the simulated time of all walks if none falls [s]."""
        return len(and_copy(self.policy)) * self.pairs * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """Walk every pair with the policy and its open-loop copy."""
        conditions = RANGES | {"episode_seconds": self.seconds} | given(self.environment)
        settings = policy_and_settings(self.policy, conditions, self.seed)[1]
        subjects = draw_pairs(settings, self.pairs, self.seed)
        how = {"seed": self.seed, "threads": self.threads}
        walks = []
        for name in and_copy(self.policy):
            prepared = policy_and_settings(name, conditions, self.seed, self.threads)
            walks.append(walk_pairs(*prepared, subjects, name=policy_label(name), progress=progress, **how))
        clamped = sum(row["people_clamped"] for row in walks[0])
        text = (
            f"{pairs_table(*walks)}\n\n`{self.policy}`, {self.pairs} pairs × {settings.episode_seconds:g} s, seed "
            f"{self.seed}: {_ranges(settings)}, independent and even. Of the pairs that did not fall; {clamped} of all "
            f"lie beyond people's measured speeds, and are held against the nearest.{open_loop_note(self.policy)}"
        )
        numbers = [csv_text(list(rows[0]), (list(row.values()) for row in rows)) for rows in walks]
        files = dict(zip([PAIRS, PAIRS_OPEN_LOOP], numbers, strict=False))
        return Answer(text=text, files={**files})


def _ranges(settings: BipedSettings) -> str:
    """Return the ranges of the draw, in words."""
    units = dict(zip(DRAWN, ("m", "kg", "m/s"), strict=True))
    spans = {name: getattr(settings, f"{name}_range") for name in DRAWN}
    return ", ".join(f"{span[0]:g}–{span[1]:g} {units[name]}" for name, span in spans.items())
