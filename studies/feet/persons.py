"""Ask how persons without tuning walk: on drawn bodies, feet, speeds and slopes, and on sound feet beside people.

    springfoot study persons learned learned-2

A person is a policy that `springfoot train --preset person`, or `predict`, trained. The drawn episodes have feet,
proportions, loads, slopes and ground of that preset, bodies and speeds of `WALKED`, and seeds that no training uses; in
each the commanded speed stays, and the step time is people's. `predict` trains on sound feet and one body, so that the
bodies of `WALKED` are new to its persons.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar

import numpy as np
import tyro

from springfoot.agents.policies import PolicyFunction
from springfoot.agents.training import PRESETS
from springfoot.arrays import NDArray
from springfoot.envs import Biped, BipedSettings
from springfoot.envs.physics import Feet
from springfoot.errors import require_count
from springfoot.evaluation.numbers import mean_speed, measure
from springfoot.evaluation.recording import TICK, WARM_UP, Episodes, policy_and_settings, record, record_walk
from springfoot.files.markdown import MISSING, table, text_of
from springfoot.files.writing import csv_text

from ..base.adapting_persons import person_and_settings
from ..base.study import Answer, OnProgress, WalkingStudy

WALKED = {"height_range": (1.5, 1.9), "mass_range": (50.0, 90.0), "speed_range": (0.8, 1.6)}
"""Heights [m], masses [kg] and commanded speeds [m/s] of the drawn episodes."""
SOUND_SPEEDS = (0.9, 1.0, 1.2, 1.4, 1.5)
"""Commanded speeds on sound feet [m/s]."""
FIRST_SEED = 50_000_000
"""Seed of the first drawn episode; trainings use others."""
PUSH_NEWTON = 100.0
"""Size of the pushes [N]."""
SLOPES_DEG = (-5.0, 5.0)
"""Slopes on sound feet [deg]."""
STEP_TIME_RATIOS = (0.85, 1.15)
"""Step times over people's on sound feet [-]."""
PEAKS = ("vertical_peak1_bw", "vertical_peak2_bw")
"""Peaks of the mean vertical force."""
_BATCH = 100
"""Drawn episodes side by side; chosen: a batch takes seconds to make."""


@dataclass(frozen=True, kw_only=True)
class DrawnEpisode:
    """One drawn episode."""

    foot: str
    """The feet in words, as `feet_in_words`."""
    speed: float
    """Commanded speed [m/s]."""
    walked: float
    """Mean speed of the CoM after `WARM_UP` [m/s]; NaN if it fell before."""
    fell: bool


def _walked(preset: BipedSettings) -> BipedSettings:
    """Return the settings of the preset with the ranges of `WALKED` and without other step times than people's."""
    bodies = [body for body in preset.drawn_bodies or () if body.step_time_ratio is None] or None
    return replace(preset, drawn_bodies=bodies, **WALKED)


def feet_in_words(feet: Feet) -> str:
    """Return kind, brace and added mass of a pair of feet, such as "intact, braced, heavier (both)" or, of the foot
    that is not intact, "passive"; of two such feet that differ, the left one's."""
    names = []
    for foot in feet:
        braced = ", braced" if foot.ankle.orthosis else ""
        heavier = ", heavier" if foot.foot_mass_ratio > 1.0 else ""
        names.append(foot.kind + braced + heavier)
    left, right = names
    if left == right:
        return left if left == "intact" else f"{left} (both)"
    return right if left == "intact" else left


def walk_drawn(
    act: PolicyFunction, settings: BipedSettings, episodes: int, threads: int, progress: OnProgress
) -> list[DrawnEpisode]:
    """Walk this many `episodes`, with body, feet, speed and slope that a reset draws from the ranges of `settings`;
    return them in the order of their seeds, from `FIRST_SEED` on."""
    walked = []
    for first in range(0, episodes, _BATCH):
        count = min(_BATCH, episodes - first)
        biped = Biped(settings, count, threads)
        biped.reset(np.arange(count), [FIRST_SEED + first + index for index in range(count)])
        feet = [feet_in_words(pair) for pair in biped.feet]
        speed = biped.subjects.speed.copy()
        recorded = Episodes.of_length(settings, count)
        record_walk(biped, act, recorded, progress=progress)
        walked += [
            DrawnEpisode(
                foot=foot,
                speed=float(speed[index]),
                walked=_settled_speed(recorded.episode(index)["com"]),
                fell=bool(recorded.fall_reason[index]),
            )
            for index, foot in enumerate(feet)
        ]
    return walked


def _settled_speed(com: NDArray) -> float:
    """Return the CoM's mean forward speed after `WARM_UP` [m/s], from its positions (T, (x, z)) [m] at each
    `TICK`; NaN for a shorter walk."""
    settled = round(WARM_UP / TICK)
    return mean_speed(com, settled, len(com)) if len(com) > settled else np.nan


def speed_errors(episodes: Sequence[DrawnEpisode]) -> NDArray:
    """Return |walked - commanded speed| [m/s] of each episode that did not fall; the others are left out."""
    return np.array([abs(episode.walked - episode.speed) for episode in episodes if not episode.fell])


@dataclass(frozen=True, kw_only=True)
class Persons(WalkingStudy):
    """Walk learned persons on drawn bodies, feet, speeds and slopes, and on sound feet beside people."""

    persons: Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="PERSON ...")] = ("learned",)
    """Policies that move the person: run folders, files, or those of the package, such as `learned`."""
    drawn: int = 2000
    """Drawn episodes of each person, and as many pushed."""

    QUICK: ClassVar = {"episodes": 1, "seconds": 6.0, "drawn": 2}

    def check(self) -> None:
        """Refuse counts out of range."""
        super().check()
        require_count("drawn", self.drawn)

    @property
    def total(self) -> float:
        """Return the simulated time of all walks if none falls [s]."""
        sound = self.episodes * (len(SOUND_SPEEDS) + len(SLOPES_DEG) + len(STEP_TIME_RATIOS))
        return len(self.persons) * self.seconds * (2 * self.drawn + sound)

    def ask(self, progress: OnProgress) -> Answer:
        """Walk every person through the drawn episodes, undisturbed and pushed, and on sound feet."""
        drawn: dict[str, dict[float, list[DrawnEpisode]]] = {}
        sound: list[dict[str, Any]] = []
        for name in self.persons:
            act, settings = person_and_settings(name, {})
            ranges = replace(
                _walked(PRESETS["predict" if settings.follows_plan else "person"].environment),
                plan_file=settings.plan_file,
                acts=settings.acts,
                stiffness_by="action",
                person_range_deg=settings.person_range_deg,
                aim_rate=settings.aim_rate,
                speed_interval=None,
                episode_seconds=self.seconds,
            )
            drawn[name] = {
                push: walk_drawn(act, replace(ranges, push_newton=push), self.drawn, self.threads, progress)
                for push in (0.0, PUSH_NEWTON)
            }
            sound += [self.sound_walk(name, {"speed": speed}, progress) for speed in SOUND_SPEEDS]
            sound += [self.sound_walk(name, {"slope_deg": slope}, progress) for slope in SLOPES_DEG]
            sound += [self.sound_walk(name, {"step_time_ratio": ratio}, progress) for ratio in STEP_TIME_RATIOS]
        files = {
            "drawn.csv": _drawn_csv(drawn),
            "by_foot.csv": by_foot_csv(drawn),
            "sound.csv": csv_text(list(sound[0]), [list(r.values()) for r in sound]),
        }
        about = f"Drawn episodes: {self.drawn} × {self.seconds:g} s. Sound feet: {self.what_ran}."
        return Answer(text=f"{drawn_table(drawn)}\n\n{sound_table(sound)}\n\n{about}", files=files)

    def sound_walk(self, name: str, given: dict[str, Any], progress: OnProgress) -> dict[str, Any]:
        """Walk a person on sound feet with the settings `given`; return falls, walked speed, likeness to people's level
        walk at the commanded speed, and both prices."""
        act, settings = policy_and_settings(name, {**given, "episode_seconds": self.seconds})
        metrics = measure(record(act, settings, name=name, progress=progress, **self.how)).metrics
        joints = metrics["joints"]
        force = metrics["grf"]
        return {
            "person": name,
            "speed_m_s": settings.speed,
            "slope_deg": settings.slope_deg,
            "step_time_ratio": settings.step_time_ratio,
            "falls": metrics["falls"],
            "episodes": metrics["episodes"],
            "walked_m_s": metrics["speed_m_s"]["mean"],
            **{f"{joint}_rms_deg": joints[joint]["rmse_deg"] for joint in ("thigh", "knee", "ankle")},
            "vertical_r": force["vertical_r"],
            "forward_r": force["forward_r"],
            "peak_bw": max((force[peak] for peak in PEAKS if force[peak] is not None), default=None),
            "fibre_J_kg_m": metrics["effort"]["fibre_J_kg_m"],
            "effort": metrics["effort"]["total"],
        }


def drawn_table(drawn: dict[str, dict[float, list[DrawnEpisode]]]) -> str:
    """Return the Markdown table of falls by foot and of the speed's error, a column for each person.

    `drawn` is person -> size of the pushes [N] -> episodes; all lines but that of the pushed falls are undisturbed.
    """
    calm = {name: pushed[0.0] for name, pushed in drawn.items()}
    shaken = {name: pushed[PUSH_NEWTON] for name, pushed in drawn.items()}
    feet = sorted({episode.foot for episodes in calm.values() for episode in episodes})
    lines = [
        [f"falls, {foot}", *(_falls([e for e in calm[name] if e.foot == foot]) for name in drawn)] for foot in feet
    ]
    lines.append(["falls, all", *(_falls(calm[name]) for name in drawn)])
    lines.append([f"falls, pushed by ±{PUSH_NEWTON:g} N", *(_falls(shaken[name]) for name in drawn)])
    sound = {name: [episode for episode in episodes if episode.foot == "intact"] for name, episodes in calm.items()}
    for label, percent, walked in (("median", 50, calm), ("95 %", 95, calm), ("95 % on sound feet", 95, sound)):
        errors = [speed_errors(episodes) for episodes in walked.values()]
        cells = [f"{np.percentile(e, percent):.3f}" if len(e) else MISSING for e in errors]
        lines.append([f"speed error of those that do not fall, {label} [m/s]", *cells])
    return table(["drawn episodes", *drawn], lines)


def by_foot_csv(drawn: dict[str, dict[float, list[DrawnEpisode]]]) -> str:
    """Return the CSV with a line for each person, size of the pushes and foot: walks, falls, and of those that do not
    fall the 95 % quantile of the speed's error [m/s]; `drawn` as in `drawn_table`."""
    lines = []
    for name, pushed in drawn.items():
        for push, episodes in pushed.items():
            for foot in sorted({episode.foot for episode in episodes}):
                here = [episode for episode in episodes if episode.foot == foot]
                errors = speed_errors(here)
                error = float(np.percentile(errors, 95)) if len(errors) else None
                lines.append([name, push, foot, len(here), sum(episode.fell for episode in here), error])
    return csv_text(["person", "push_N", "foot", "walks", "falls", "speed_error_95_m_s"], lines)


def _falls(episodes: Sequence[DrawnEpisode]) -> str:
    """Return the number of episodes that fell, as in "2 of 20"."""
    return f"{sum(episode.fell for episode in episodes)} of {len(episodes)}"


def sound_table(rows: Sequence[dict[str, Any]]) -> str:
    """Return the Markdown table of walks on sound feet; `rows` as in `Persons.sound_walk`."""
    head = ["sound feet", "falls", "walked m/s", "thigh / knee / ankle °", "forces r", "peak BW", "fibre work J/kg/m"]
    lines = []
    for row in rows:
        angles = " / ".join(text_of(row[f"{joint}_rms_deg"], ".1f") for joint in ("thigh", "knee", "ankle"))
        forces = " / ".join(text_of(row[f"{way}_r"], ".3f") for way in ("vertical", "forward"))
        slope = f", {row['slope_deg']:+g}°" if row["slope_deg"] else ""
        pace = f", step time × {row['step_time_ratio']:g}" if row["step_time_ratio"] != 1.0 else ""
        lines.append(
            [
                f"{row['person']}, {row['speed_m_s']:g} m/s{slope}{pace}",
                f"{row['falls']} of {row['episodes']}",
                text_of(row["walked_m_s"], ".3f"),
                angles,
                forces,
                text_of(row["peak_bw"], ".2f"),
                text_of(row["fibre_J_kg_m"], ".2f"),
            ]
        )
    return table(head, lines)


def _drawn_csv(drawn: dict[str, dict[float, list[DrawnEpisode]]]) -> str:
    """Return the CSV with a line for each drawn episode; `drawn` as in `drawn_table`."""
    lines = [
        [name, push, episode.foot, episode.speed, episode.walked, int(episode.fell)]
        for name, pushed in drawn.items()
        for push, episodes in pushed.items()
        for episode in episodes
    ]
    return csv_text(["person", "push_N", "foot", "speed_m_s", "walked_m_s", "fell"], lines)
