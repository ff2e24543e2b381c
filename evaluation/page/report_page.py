"""Write report.html: one page that opens offline, with the verdict in words and all curves behind a walk's numbers.

Its drawings are SVG by a small script (`drawing.js`, 18 kB): the bundle that pip brings with plotly is 4.8 MB, and
would not draw the body.
"""

import json
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from springfoot.envs.settings.settings import settings_from
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
from ..recording.recording import Recording
from ..report.gait_table import leg_rows, people_metrics, table_rows
from .page_data import policy_data
from .page_figure import walker_words
from .template import as_json, filled

PAGE_PACKAGES = ("springfoot", "mujoco", "numpy")
"""Packages whose versions the page names."""
JUDGED_SPEED = 1.2
"""Commanded speed for which the criteria were chosen [m/s]."""


def write_page(path: Path, walks: Sequence[tuple[Recording, Gait]], command: str = "") -> None:
    """Write report.html: one page of one or several evaluated policies.

    Args:
        path: the file.
        walks: recording and measured gait of each policy.
        command: command line that made the page, which it shows; empty for none.
    """
    data = {
        "policies": [policy_data(recording, gait) for recording, gait in walks],
        "tables": [table_rows(gait.metrics) for _, gait in walks],
        "legs": [leg_rows(gait.metrics) for _, gait in walks],
        "made": _origin_text(walks, command),
    }
    verdicts = "\n".join(_verdict(index, gait.metrics) for index, (_, gait) in enumerate(walks))
    path.write_text(filled("page.html", {"VERDICT": verdicts, "DATA": as_json(data)}), encoding="utf-8")


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


def _verdict(index: int, metrics: dict[str, Any]) -> str:
    """Return the HTML of the verdict on policy number `index`; `metrics` is the content of its metrics.json."""
    colour = COLOURS[index % len(COLOURS)]
    items = "".join(f"<dt>{escape(term)}</dt><dd>{escape(text)}</dd>" for term, text in spoken_verdict(metrics).items())
    return (
        f'<section class="verdict" aria-label="Verdict on {escape(metrics["policy"])}">'
        f'<h2 class="name" style="border-color:{colour}">{escape(metrics["policy"])}</h2><dl>{items}</dl></section>'
    )


def spoken_verdict(metrics: dict[str, Any]) -> dict[str, str]:
    """Return the verdict in words: heading -> sentences on falls, walker, faults, speed, joints, forces and energy."""
    environment = metrics["environment"]
    settings = settings_from(**environment)
    people = people_metrics(settings)
    # The criteria hold for people at one speed.
    judged = environment["human"] is None and environment["speed"] == JUDGED_SPEED
    falls = metrics["falls"]
    episodes = metrics["episodes"]
    reasons = ", ".join(f"{count} × {reason}" for reason, count in metrics["fall_reasons"].items())
    episode_count = f"{episodes} episode{'' if episodes == 1 else 's'}"
    falls_text = f"Fell in {falls} of {episode_count}: {reasons}." if falls else f"Never fell in {episode_count}."
    joints = metrics["joints"]
    grf = metrics["grf"]
    work = metrics["joint_work_J_kg"]["ankle"]
    verdict = {
        "Falls": f"{falls_text} Mean length {metrics['seconds_mean']:.1f} s.",
        "Walker": f"{walker_words(settings)}.",
    }
    if metrics["strides"]["count"] == 0:
        return verdict | {"Gait": "No complete stride after the warm-up, so nothing of the gait could be measured."}
    angles = ", ".join(f"{name} {_text(errors['rmse_deg'], '.1f')}°" for name, errors in joints.items())
    peaks = " / ".join(_text(grf[name], ".2f") for name in _PEAKS)
    people_peaks = " / ".join(_text(people["grf"][name], ".2f") for name in _PEAKS)
    if warning := fault(metrics):
        verdict["Warning"] = warning
    return verdict | {
        "Speed": f"{_text(metrics['speed_m_s']['mean'], '.2f')} m/s, asked for {environment['speed']:.2f}.",
        "Joints": f"Off people's mean by {angles} (rms). {_judged(metrics, MOVES_LIKE_PEOPLE, judged)}",
        "Forces": f"Vertical peak, valley, peak {peaks} body weights, people {people_peaks}. "
        f"{_judged(metrics, LOADS_LIKE_PEOPLE, judged)}",
        "Energy": f"Cost of transport {_text(metrics['cost_of_transport'], '.3f')}; the ankle gives "
        f"{_text(work['positive'], '.2f')} J/kg a stride, people's {people['ankle_work_J_kg']['positive']:.2f}. "
        f"{_judged(metrics, WORKS_LIKE_PEOPLE, judged)}",
    }


_PEAKS = ("vertical_peak1_bw", "vertical_valley_bw", "vertical_peak2_bw")
"""Numbers of the vertical force in `grf` of metrics.json: two peaks and the valley between them."""


def _judged(metrics: Mapping[str, Any], criteria: Sequence[Criterion], judged: bool) -> str:
    """Return a sentence that names those of `criteria` that a walk misses.

    Unless the walk is `judged`, the sentence says that there is no verdict. `metrics` is the content of metrics.json.
    """
    if not judged:
        return f"No verdict: the criteria are for {JUDGED_SPEED:g} m/s and people."
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
