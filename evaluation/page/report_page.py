"""Write report.html: one page that opens offline, with the verdict in words and all curves behind a walk's numbers.

Its drawings are SVG by a small script (`drawing.js`, 18 kB): the bundle that pip brings with plotly is 4.8 MB, and
would not draw the body.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from datetime import date
from html import escape
from pathlib import Path
from typing import Any

from springfoot.envs.settings.feet import FootSetting
from springfoot.envs.settings.settings import BipedSettings, settings_from
from springfoot.files.markdown import html_of
from springfoot.files.provenance import versions_and_commit

from ..numbers.criteria import (
    LOADS_LIKE_PEOPLE,
    MOVES_LIKE_PEOPLE,
    WORKS_LIKE_PEOPLE,
    Criterion,
    fault,
    missed_text,
    with_derived,
)
from ..numbers.metrics import Gait
from ..numbers.per_leg import leg_numbers
from ..recording.recording import Recording
from ..report.gait_table import leg_numbers_beside_people, people_metrics, table_rows
from .page_data import policy_data
from .page_figure import walker_parts
from .template import as_json, filled

PAGE_PACKAGES = ("springfoot", "mujoco", "numpy")
"""Packages that the page names with their versions."""
JUDGED_SPEED = 1.2
"""Commanded speed for which the criteria were chosen [m/s]."""


def write_page(
    path: Path,
    walks: Sequence[tuple[Recording, Gait]],
    command: str = "",
    words_of: Callable[[FootSetting], str] | None = None,
    introduction: str = "",
) -> None:
    """Write report.html: one page of one or several evaluated policies.

    Args:
        path: the file.
        walks: recording and measured gait of each policy.
        command: command line that made the page, which it shows; empty for none.
        words_of: function that puts a foot into words, `foot_words` by default.
        introduction: Markdown that stands above the walks, as `html_of` reads it; empty for none.
    """
    _, first = walks[0]
    own = first.metrics["environment"]["human"] is not None
    data = {
        "policies": [policy_data(recording, gait, words_of) for recording, gait in walks],
        "tables": [table_rows(gait.metrics) for _, gait in walks],
        "legs": [_leg_rows(recording, gait) for recording, gait in walks],
        "norm": "own person" if own else "people",
        "made": _origin_text(walks, command),
    }
    spoken = [spoken_verdict(gait.metrics, leg_numbers(gait.tally), words_of) for _, gait in walks]
    blocks = {
        "ORIGIN": f"{date.today():%-d %B %Y}. Grey: {escape(data['policies'][0]['people'])}.",
        "INTRODUCTION": _introduction(introduction),
        "WHO": "\n".join(_walker_lines([gait.metrics for _, gait in walks], spoken, words_of)),
        "VERDICT": "\n".join(_verdict(index, gait.metrics, spoken[index]) for index, (_, gait) in enumerate(walks)),
        "DATA": as_json(data),
    }
    path.write_text(filled("page.html", blocks), encoding="utf-8")


def _introduction(text: str) -> str:
    """Return the HTML of the introduction above the walks, from Markdown; empty without one."""
    if not text:
        return ""
    return f'<section id="answer" class="wide" tabindex="0" aria-label="Answer">{html_of(text)}</section>'


def _leg_rows(recording: Recording, gait: Gait) -> list[tuple[str, ...]]:
    """Return the rows of the table of both legs: quantity, unit, left, right, right less left, people."""
    rows = []
    for row in leg_numbers_beside_people(leg_numbers(gait.tally), recording.settings):
        measured = isinstance(row.left, float) and isinstance(row.right, float)
        difference = row.right - row.left if measured else None  # type: ignore[operator]
        texts = (
            *map(row.text, (row.left, row.right)),
            _text(difference, f"+{row.pattern}"),
            row.text(row.people),
        )
        rows.append((row.label, row.unit, *texts))
    return rows


def _origin_text(walks: Sequence[tuple[Recording, Gait]], command: str) -> str:
    """Return the text on the origin of the page: command, seeds, commit, versions, settings."""
    origin = versions_and_commit(PAGE_PACKAGES)
    commit = origin["commit"] or "none: not in a clone of the project"
    lines = [f"command: {command}"] if command else []
    lines += [f"{recording.policy}: episodes seeded from {recording.seed} on" for recording, _ in walks]
    lines += [f"commit: {commit}{' and changes to it' if origin['modified'] else ''}"]
    lines += [f"{name} {number}" for name, number in origin["versions"].items()]
    settings = [
        f"settings of {recording.policy}: {json.dumps(gait.metrics['environment'])}" for recording, gait in walks
    ]
    return "\n".join([*lines, *settings])


COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#7A3DB8", "#8A5A00")
"""Colours of the policies, in their order; as in page.html."""


def _walker_lines(
    metrics: Sequence[dict[str, Any]],
    spoken: Sequence[Mapping[str, str]],
    words_of: Callable[[FootSetting], str] | None,
) -> list[str]:
    """Return the HTML of a line on each policy's walker and its falls, after a line on the parts common to all.

    Args:
        metrics: content of metrics.json of each policy.
        spoken: verdict on each, of `spoken_verdict`.
        words_of: as in `write_page`.
    """
    walkers = [_walker_parts(each, words_of) for each in metrics]
    falls = [verdict["Falls"] for verdict in spoken]
    several = len(walkers) > 1
    common = [part for part in walkers[0] if several and all(part in parts for parts in walkers)]
    common_falls = falls[0] if several and len(set(falls)) == 1 else ""
    lines = [f"<li>All: {escape(_sentences(common, common_falls))}</li>"] if common or common_falls else []
    for index, (each, parts, own_falls) in enumerate(zip(metrics, walkers, falls, strict=True)):
        words = _sentences([part for part in parts if part not in common], "" if common_falls else own_falls)
        lines.append(
            f'<li class="name" data-of="{index}" style="border-color:{COLOURS[index % len(COLOURS)]}">'
            f"<strong>{escape(each['policy'])}</strong>{escape(f': {words}' if words else '')}</li>"
        )
    return lines


def _sentences(parts: Sequence[str], falls: str) -> str:
    """Return the parts of a walker as a sentence, if there are any, and the one on its `falls`."""
    return f"{', '.join(parts)}{'. ' if parts else ''}{falls}".strip()


def _walker_parts(metrics: dict[str, Any], words_of: Callable[[FootSetting], str] | None) -> list[str]:
    """Return words on the walker of a policy: those of `walker_parts`, its commanded speed and its target."""
    settings = settings_from(**metrics["environment"])
    return [*walker_parts(settings, words_of), f"{settings.speed:g} m/s", _guide_words(settings)]


def _verdict(index: int, metrics: dict[str, Any], spoken: Mapping[str, str]) -> str:
    """Return the HTML of the `spoken` verdict on policy number `index`, without the words of `_walker_line`."""
    colour = COLOURS[index % len(COLOURS)]
    items = "".join(
        f"<dt>{escape(term)}</dt><dd>{escape(text)}</dd>"
        for term, text in spoken.items()
        if term not in ("Falls", "Walker")
    )
    return (
        f'<section class="verdict" data-of="{index}" aria-label="Verdict on {escape(metrics["policy"])}">'
        f'<h2 class="name" style="border-color:{colour}">{escape(metrics["policy"])}</h2><dl>{items}</dl></section>'
    )


def spoken_verdict(
    metrics: dict[str, Any],
    legs: Mapping[str, Mapping[str, Any]],
    words_of: Callable[[FootSetting], str] | None = None,
) -> dict[str, str]:
    """Return the verdict in words: heading -> sentences on falls, walker, faults, speed, joints, forces and energy.

    At the speed for which the criteria were chosen they judge the walk. At other speeds, with the user's own recording
    (the setting `human`), or if every episode falls, the walk is compared with people's curves or with that recording,
    without criteria.

    Args:
        metrics: content of metrics.json.
        legs: of `leg_numbers`.
        words_of: as in `write_page`.
    """
    environment = metrics["environment"]
    settings = settings_from(**environment)
    people = people_metrics(settings)
    falls = metrics["falls"]
    episodes = metrics["episodes"]
    # The criteria hold for people at one speed, and for a walk.
    judged = environment["human"] is None and environment["speed"] == JUDGED_SPEED and falls < episodes
    reasons = ", ".join(f"{count} × {reason}" for reason, count in metrics["fall_reasons"].items())
    episode_count = f"{episodes} episode{'' if episodes == 1 else 's'}"
    falls_text = f"Fell in {falls} of {episode_count}: {reasons}." if falls else f"Never fell in {episode_count}."
    joints = metrics["joints"]
    grf = metrics["grf"]
    work = metrics["joint_work_J_kg"]["ankle"]
    verdict = {
        "Falls": f"{falls_text} Mean length {metrics['seconds_mean']:.1f} s.",
        "Walker": f"{', '.join(_walker_parts(metrics, words_of))}.",
    }
    if falls == episodes:
        verdict["Walk"] = "None: every episode ends in a fall. All numbers are of the time before."
    elif falls:
        verdict["Walk"] = f"{falls} of {episode_count} end in a fall. All numbers count the time before too."
    if metrics["strides"]["count"] == 0:
        return verdict | {"Gait": "No complete stride after the warm-up, so nothing of the gait could be measured."}
    whose = "people" if environment["human"] is None else "the own person"
    angles = ", ".join(f"{name} {_text(errors['rmse_deg'], '.1f')}°" for name, errors in joints.items())
    inside = ", ".join(f"{name} {_text(errors['within_1sd_percent'], '.0f')} %" for name, errors in joints.items())
    peaks = " / ".join(_text(grf[name], ".2f") for name in _PEAKS)
    people_peaks = " / ".join(_text(people["grf"][name], ".2f") for name in _PEAKS)
    if warning := fault(metrics):
        verdict["Warning"] = warning
    angles_judged = (
        _criteria_sentence(metrics, MOVES_LIKE_PEOPLE)
        if judged
        else f"Inside {whose}'s mean ± SD: {inside} of the stride."
    )
    forces_judged = _criteria_sentence(metrics, LOADS_LIKE_PEOPLE) if judged else ""
    fibre_work = (
        f"Fibre work {_text(metrics['effort']['fibre_J_kg_m'], '.2f')} J/kg/m, {whose}'s {people['fibre_J_kg_m']:.2f}."
    )
    energy_judged = _criteria_sentence(metrics, WORKS_LIKE_PEOPLE) if judged else fibre_work
    forces = f"Mean vertical force: peak, valley, peak {peaks} body weights, {whose}'s {people_peaks}."
    return verdict | {
        "Speed": f"{_text(metrics['speed_m_s']['mean'], '.2f')} m/s, asked for {environment['speed']:.2f}.",
        "Joints": f"Off {whose}'s mean by {angles} (rms). {angles_judged}",
        "Forces": " ".join(
            words for words in (forces, forces_judged, _overload_sentence(legs, people, whose)) if words
        ),
        "Energy": f"Cost of transport {_text(metrics['cost_of_transport'], '.3f')}; the ankle gives "
        f"{_text(work['positive'], '.2f')} J/kg a stride, {whose}'s {people['ankle_work_J_kg']['positive']:.2f}. "
        f"{energy_judged}",
    }


def _guide_words(settings: BipedSettings) -> str:
    """Return words on the target: the body's own plan, people's mean walk, or the walk of the setting `human`."""
    if settings.follows_plan:
        return "after its own plan alone"
    return "after people's mean walk" if settings.human is None else "fitted to an own person"


OVERLOAD = 1.25
"""Largest vertical force over people's from which on the report says so; chosen, a quarter more."""


def _overload_sentence(legs: Mapping[str, Mapping[str, Any]], people: Mapping[str, Any], whose: str) -> str:
    """Return a sentence that names the feet with a largest vertical force over `OVERLOAD` times people's mean peak.

    `legs` are those of `leg_numbers`, `people` the numbers of `people_metrics`, `whose` the word for these people.
    """
    usual = max(people["grf"]["vertical_peak1_bw"], people["grf"]["vertical_peak2_bw"])
    largest = {side: leg["vertical_max_mean_bw"] for side, leg in legs.items()}
    over = {side: value for side, value in largest.items() if value is not None and value > OVERLOAD * usual}
    if not over:
        return f"Neither foot's largest force is more than a quarter above {whose}'s mean peak, {usual:.2f}."
    feet = " and ".join(f"the {side} foot bears {value:.2f}" for side, value in over.items())
    return f"Overload: {feet} body weights at the largest of a stride, {whose}'s mean peak is {usual:.2f}."


_PEAKS = ("vertical_peak1_bw", "vertical_valley_bw", "vertical_peak2_bw")
"""Numbers of the vertical force in `grf` of metrics.json: two peaks and the valley between them."""


def _criteria_sentence(metrics: Mapping[str, Any], criteria: Sequence[Criterion]) -> str:
    """Return a sentence that names those of `criteria` that a walk misses; `metrics` is the content of metrics.json."""
    values = with_derived(dict(metrics))
    missed = [
        f"{criterion.label or criterion.name} {missed_text(criterion, values)}"
        for criterion in criteria
        if not criterion.holds(values)
    ]
    if not missed:
        return f"Meets all {len(criteria)} criteria of a human-like walk."
    return f"Misses {len(missed)} of {len(criteria)} criteria: {'; '.join(missed)}."


def _text(value: float | None, pattern: str) -> str:
    """Return a number as text; a dash for None."""
    return "–" if value is None else format(value, pattern)
