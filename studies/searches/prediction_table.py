"""List the criteria of a predicted walk, and make their table: people, the plan alone, walks that follow the plan."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from springfoot.envs.control import reference_walk_at
from springfoot.envs.settings import BipedSettings, reference_gait
from springfoot.evaluation.numbers import NO_FALLS, Criterion, with_derived
from springfoot.files.markdown import MISSING, span_text, table
from springfoot.gait.body import GRAVITY
from springfoot.gait.people import PERCENT, HumanGait, correlation, force_features, rmse, stride_work

from ..base.columns import COMPARED_JOINTS

JOINT_LIMITS = {"thigh": (3.5, 0.95), "knee": (5.0, 0.95), "ankle": (5.5, 0.93)}
"""Largest RMSE [deg] and least r with people's mean."""


def _force(label: str, name: str, low: float, high: float = np.inf) -> Criterion:
    """Return a criterion on the number `name` of the ground reaction force in metrics: from `low` to `high`."""
    return Criterion(name=label, path=("grf", name), low=low, high=high)


PREDICTION = (
    NO_FALLS,
    Criterion(name="speed off by [m/s]", path=("off", "speed_m_s"), high=0.03, pattern=".3f"),
    *(
        Criterion(name=f"{joint}: RMSE [°]", path=("joints", joint, "rmse_deg"), high=most, pattern=".1f")
        for joint, (most, _) in JOINT_LIMITS.items()
    ),
    *(
        Criterion(name=f"{joint}: r", path=("joints", joint, "r"), low=least)
        for joint, (_, least) in JOINT_LIMITS.items()
    ),
    _force("vertical force: r", "vertical_r", 0.95),
    _force("its first peak [BW]", "vertical_peak1_bw", 0.85, 1.25),
    _force("its second peak [BW]", "vertical_peak2_bw", 1.02, 1.24),
    _force("fore-aft force: r", "forward_r", 0.88),
    _force("braking [BW]", "braking_peak_bw", -0.22, -0.08),
    _force("forward [BW]", "forward_peak_bw", 0.12, 0.27),
    Criterion(name="ankle moment: r", path=("moments", "ankle", "r"), low=0.95),
    Criterion(name="its peak [N·m/kg]", path=("moments", "ankle", "peak_Nm_kg"), low=1.1, high=1.5),
    Criterion(name="hip moment: r", path=("moments", "hip", "r"), low=0.8),
    Criterion(name="its peak [N·m/kg]", path=("moments", "hip", "peak_Nm_kg"), high=0.8),
    Criterion(name="double support off by [s]", path=("off", "double_support_s"), high=0.03, pattern=".3f"),
    Criterion(name="cost of transport", path=("cost_of_transport",), high=0.14, pattern=".3f"),
)
"""Criteria of a predicted walk: angles as near to people as published predictions are, people's forces and effort."""


def walk_numbers(metrics: Mapping[str, Any]) -> dict[str, Any]:
    """Return the metrics of a walk with the further numbers of `PREDICTION`, among them the distance of double support
    from people's [s]."""
    values = with_derived(dict(metrics))
    settings = BipedSettings(speed=metrics["environment"]["speed"], height=metrics["environment"]["height"])
    support = values["double_support_s"]
    human = reference_gait(settings)
    off = None if support is None else abs(support - _double_support(human))
    return values | {"off": values["off"] | {"double_support_s": off}}


def plan_numbers(settings: BipedSettings) -> dict[str, Any]:
    """Return the numbers of `PREDICTION` for the plan of `settings`, from its inverse dynamics."""
    return prediction_numbers(reference_walk_at(settings, settings.speed).target, reference_gait(settings))


def people_numbers(settings: BipedSettings) -> dict[str, Any]:
    """Return the numbers of `PREDICTION` for people's mean curves."""
    human = reference_gait(settings)
    return prediction_numbers(human, human)


def prediction_table(
    columns: Mapping[str, Mapping[str, Any]],
    judged: Sequence[str],
    spans: Mapping[str, Sequence[Mapping[str, Any]]] | None = None,
) -> str:
    """Return the Markdown table of `PREDICTION`: a column for each entry of `columns` (head -> numbers), then one for
    each of `spans` (head -> numbers of several walks), with the least and the largest.

    In the `judged` columns missed numbers are bold, and the last line counts them.
    """
    spans = spans or {}
    lines = []
    for criterion in PREDICTION:
        cells = []
        for name, values in columns.items():
            value = _value(criterion, values)
            text = MISSING if value is None else format(value, criterion.pattern)
            cells.append(f"**{text}**" if name in judged and not _holds(criterion, values) else text)
        cells += [_span(criterion, walks) for walks in spans.values()]
        lines.append([criterion.name, criterion.text, *cells])
    missed = [
        str(sum(not _holds(criterion, values) for criterion in PREDICTION)) if name in judged else ""
        for name, values in columns.items()
    ]
    lines.append(["missed", f"of {len(PREDICTION)}", *missed, *[""] * len(spans)])
    return table(["", "wanted", *columns, *spans], lines)


def _span(criterion: Criterion, walks: Sequence[Mapping[str, Any]]) -> str:
    """Return a criterion's least and largest number in `walks` as a cell; a dash if one does not have it."""
    values = [_value(criterion, walk) for walk in walks]
    known = [value for value in values if value is not None]
    return span_text(known, criterion.pattern) if known and len(known) == len(values) else MISSING


def _value(criterion: Criterion, values: Mapping[str, Any]) -> float | None:
    """Return the number of a criterion in a column; None if the column does not have it."""
    try:
        return criterion.value(dict(values))
    except KeyError:
        return None


def _holds(criterion: Criterion, values: Mapping[str, Any]) -> bool:
    """Return True if the column has the criterion's number, within its limits."""
    value = _value(criterion, values)
    return value is not None and criterion.low <= value <= criterion.high


def _double_support(gait: HumanGait) -> float:
    """Return the time of one double support [s], from half a stride to toe-off."""
    return (gait.toe_off - 0.5) * gait.stride_time


def _positive_work(gait: HumanGait) -> float:
    """Return the positive work of hip, knee and ankle of both legs in a stride over body weight [J/N = m]."""
    power = np.stack([gait.mean(f"{joint}_power", PERCENT / 100) for joint in ("hip", "knee", "ankle")])
    return 2 * float(stride_work(power, np.full(3, gait.stride_time))[0].sum()) / GRAVITY


def prediction_numbers(gait: HumanGait, human: HumanGait) -> dict[str, Any]:
    """Return the numbers of `PREDICTION` but falls and speed, for the mean curves of `gait` against those of `human`.

    They are nested as metrics of a walk are. `human` is people's gait.
    """
    phase = PERCENT / 100

    def pair(name: str) -> tuple[Any, Any]:
        """Return the mean curve `name` (101,) of `gait` and of `human`."""
        return gait.mean(name, phase), human.mean(name, phase)

    vertical = pair("grf_vertical")
    forward = pair("grf_forward")
    features = force_features(vertical[0], forward[0])
    return {
        "off": {"double_support_s": abs(_double_support(gait) - _double_support(human))},
        "joints": {
            joint: {"rmse_deg": np.degrees(rmse(*pair(joint)) or 0.0), "r": correlation(*pair(joint))}
            for joint in COMPARED_JOINTS
        },
        "grf": {
            "vertical_r": correlation(*vertical),
            "forward_r": correlation(*forward),
            **{f"{name}_bw": getattr(features, name) for name in ("vertical_peak1", "vertical_peak2")},
            **{f"{name}_bw": getattr(features, name) for name in ("braking_peak", "forward_peak")},
        },
        "moments": {
            joint: {"r": correlation(*pair(f"{joint}_moment")), "peak_Nm_kg": float(pair(f"{joint}_moment")[0].max())}
            for joint in ("hip", "ankle")
        },
        "cost_of_transport": _positive_work(gait) / (2 * gait.step_length),
    }
