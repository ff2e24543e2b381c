"""Collect the data that `report.html` draws of one policy, as plain JSON values.

Table, curves, schedules, loops, and the body. None stands for numbers that could not be measured. Numbers are rounded
for the screen, those of metrics.json are not.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from springfoot.arrays import NDArray
from springfoot.envs.physics.model import SIDES
from springfoot.envs.settings.feet import FootSetting
from springfoot.envs.settings.settings import BipedSettings, body_of, reference_gait
from springfoot.envs.task.reward import TERMS
from springfoot.gait import HumanGait
from springfoot.gait.people.gait_events import PERCENT
from springfoot.gait.people.human import ADULTS
from springfoot.gait.springs.stiffness import SPRINGS, thesis_schedule

from ..numbers.curves import StrideCurves
from ..numbers.metrics import MOMENT_CURVES, Gait
from ..numbers.per_leg import ANGLE_COLUMNS, feet_differ
from ..recording.recording import Recording
from ..report.schedule_tables import schedule_curves
from .page_figure import figure_data, shown_numbers

FORCE_PANELS = {
    "grf_vertical": ("Vertical force", "up, body weights"),
    "grf_forward": ("Fore-aft force", "forward, body weights"),
}
"""Force -> title and unit of its panel."""


def policy_data(
    recording: Recording, gait: Gait, words_of: Callable[[FootSetting], str] | None = None
) -> dict[str, Any]:
    """Return the page's data of one policy as JSON values: numbers, panels of curves, loops, two strides of the body.

    `words_of` as in `figure_data`. The page's table and verdict come beside it (`report_page`).
    """
    human = reference_gait(recording.settings)
    by_leg = feet_differ(recording.settings)
    return {
        "name": recording.policy,
        "metrics": gait.metrics,
        "people": people_words(recording.settings, human),
        "toe_off": shown_numbers(
            np.array([np.nan if (t := gait.metrics["toe_off_percent"]) is None else t, 100 * human.toe_off])
        ),
        "panels": [
            *_angle_panels(gait, human, by_leg),
            *_force_panels(gait, human, by_leg),
            *_com_panels(recording, gait),
            *_spring_panels(recording),
            *_reward_panels(gait),
        ],
        "loops": _moment_loops(recording, gait, human, by_leg),
        "figure": figure_data(recording, words_of),
    }


def people_words(settings: BipedSettings, human: HumanGait) -> str:
    """Return the words on the page's grey curves: the people of their mean, and the sample of their band's SD."""
    if settings.human is None:
        return f"people at {human.speed:.2f} m/s, mean ± SD over {ADULTS} adults"
    borrowed = ", of people where it has no data" if human.borrowed else ""
    return f"the own person {human.condition}, mean ± SD over its strides{borrowed}"


def _panel(group: str, title: str, unit: str, curve: tuple[NDArray, NDArray], **entries: Any) -> dict[str, Any]:
    """Return one panel of the page as JSON values.

    Args:
        group: heading below which the panel stands.
        title: of the panel.
        unit: of the curve, with its positive direction.
        curve: mean and SD of the walk, (101,) each.
        entries: further entries, such as people's curve, the plan, or the axis.
    """
    return {
        "group": group,
        "title": title,
        "unit": unit,
        "mean": shown_numbers(curve[0]),
        "sd": shown_numbers(curve[1]),
    } | entries


def _mean_and_sd(curves: StrideCurves, name: str) -> tuple[NDArray, NDArray]:
    """Return mean and SD of the curve `name` over strides, (101,) each."""
    return curves.mean(name), curves.sd(name)


def _leg_curves(gait: Gait, name: str, by_leg: bool) -> dict[str, Any]:
    """Return a panel's entry `legs`: the curve `name` of the left and of the right leg; no entry unless `by_leg`."""
    if not by_leg:
        return {}
    return {
        "legs": [
            {"mean": shown_numbers(curves.mean(name)), "sd": shown_numbers(curves.sd(name))} for curves in gait.feet
        ],
    }


def _people_curve(human: HumanGait, name: str, degrees: bool = False) -> dict[str, Any]:
    """Return people's mean and SD of a curve over percent of the stride, for a panel."""
    unit = np.degrees(1.0) if degrees else 1.0  # people's angles are in radians
    phase = PERCENT / 100
    return {
        "people": shown_numbers(unit * human.mean(name, phase)),
        "people_sd": shown_numbers(unit * human.sd(name, phase)),
    }


def _angle_panels(gait: Gait, human: HumanGait, by_leg: bool) -> list[dict[str, Any]]:
    """Return the panels of joint angles, with a curve of each leg too if `by_leg`."""
    positive = {"ankle": "dorsiflexion", "toe": "up"}
    panels = []
    for joint, column in ANGLE_COLUMNS.items():
        title = f"{joint.capitalize()} angle"
        unit = f"{positive.get(joint, 'flexion')}, deg"
        people = _people_curve(human, joint, degrees=True)
        legs = _leg_curves(gait, column, by_leg)
        panels.append(_panel("Angles", title, unit, _mean_and_sd(gait.both, column), **people, **legs))
    return panels


def _force_panels(gait: Gait, human: HumanGait, by_leg: bool) -> list[dict[str, Any]]:
    """Return the panels of moments, powers and ground reaction forces, with a curve of each leg too if `by_leg`."""

    def stride_panel(group: str, title: str, unit: str, column: str, people: dict[str, Any]) -> dict[str, Any]:
        """Return the panel of a column of the curves over the stride, with `people`'s entries."""
        return _panel(
            group, title, unit, _mean_and_sd(gait.both, column), **people, **_leg_curves(gait, column, by_leg)
        )

    panels = []
    for joint, column in MOMENT_CURVES.items():
        unit = f"{'extension' if joint in ('hip', 'knee') else 'plantarflexion'}, N·m/kg"
        people = {} if joint == "toe" else _people_curve(human, f"{joint}_moment")
        panels.append(stride_panel("Moments", f"{joint.capitalize()} moment", unit, column, people))
    for joint in ("hip", "knee", "ankle"):
        column = f"{joint}_power_W_per_kg"
        people = _people_curve(human, f"{joint}_power")
        panels.append(stride_panel("Powers", f"{joint.capitalize()} power", "generation, W/kg", column, people))
    for name, (title, unit) in FORCE_PANELS.items():
        panels.append(stride_panel("Ground reaction forces", title, unit, f"{name}_bw", _people_curve(human, name)))
    return panels


def _com_panels(recording: Recording, gait: Gait) -> list[dict[str, Any]]:
    """Return the panels of CoM and CoP over the step, with their plan."""
    group = "Centre of mass, centre of pressure and their plans, over the step"
    axis = "step"
    com = gait.com
    x, z = recording.plan_com.T
    cop = gait.tally.cop
    return [
        _panel(group, "CoM ahead of the ankle", "forward, m", _mean_and_sd(com, "x"), plan=shown_numbers(x), axis=axis),
        _panel(group, "CoM height", "above the ground, m", _mean_and_sd(com, "z"), plan=shown_numbers(z), axis=axis),
        _panel(
            group,
            "CoP and planned ZMP",
            "ahead of the ankle, m",
            _mean_and_sd(cop, "x"),
            plan=shown_numbers(recording.plan_zmp),
            axis=axis,
        ),
    ]


def _spring_panels(recording: Recording) -> list[dict[str, Any]]:
    """Return the panels of K and theta_eq over each leg's phase, both legs on one pair of axes.

    The mean over strides is the part of a policy that its open-loop copy repeats in every stride; the SD is how far
    feedback departs from it.
    """
    curves = schedule_curves(recording)
    group = "Stiffness and rest angle over the leg's phase"
    panels = []
    for column, words, unit in (
        ("stiffness_Nm_per_rad", "stiffness K", "N·m/rad"),
        ("equilibrium_deg", "rest angle θ_eq", "dorsiflexion or up, deg"),
    ):
        for joint in SPRINGS:
            names = [f"{joint}_{side}_{column}" for side in SIDES]
            legs = [{"mean": shown_numbers(curves[n]), "sd": shown_numbers(curves[f"{n}_sd"])} for n in names]
            left = curves[names[0]], curves[f"{names[0]}_sd"]  # the page draws `legs` in its place
            title = f"{joint.capitalize()}, {words}"
            panels.append(_panel(group, title, unit, left, zero=unit == "N·m/rad", axis="leg", legs=legs))
    return panels


def _reward_panels(gait: Gait) -> list[dict[str, Any]]:
    """Return the panels of the reward's terms over the step: rewards from 0 to 1, and costs."""
    group = "Reward terms over the step, unweighted"
    return [
        _panel(
            group, f"Reward term {name}", "dimensionless", _mean_and_sd(gait.tally.reward, name), zero=True, axis="step"
        )
        for name in TERMS
    ]


def _moment_loops(recording: Recording, gait: Gait, human: HumanGait, by_leg: bool) -> list[dict[str, Any]]:
    """Return the loops of moment [N m/kg] over angle [deg] of ankle and toe, of each leg too if `by_leg`.

    The ankle's has people's loop and the thesis's lines beside it.
    """
    phase = PERCENT / 100
    body = body_of(recording.settings)
    # The thesis's springs in stance, each a straight line from its start to that of the next.
    lines = [
        segment for segment in thesis_schedule(body, recording.settings.speed).ankle if segment.start < human.toe_off
    ]
    ends = [*(segment.start for segment in lines[1:]), human.toe_off]
    thesis = []
    for segment, end in zip(lines, ends, strict=True):
        angle = human.mean("ankle", np.array([segment.start, end]))  # people's, at the two ends
        moment = segment.stiffness * (angle - segment.equilibrium) / (body.total_mass * body.length_scale)
        thesis.append(shown_numbers(np.stack([np.degrees(angle), moment], -1)))

    def leg_loop(curves: StrideCurves, joint: str) -> dict[str, Any]:
        """Return the loop of a joint, "ankle" or "mtp", in the mean curves of a leg or of both."""
        angle = curves.mean(f"{joint}_dorsiflexion_deg")
        moment = curves.mean(f"{joint}_moment_Nm_per_kg")
        return {"x": shown_numbers(angle), "y": shown_numbers(moment)}

    def loop(joint: str) -> dict[str, Any]:
        """Return the loop of a joint in the mean of both legs, and if `by_leg` in each."""
        legs = {"legs": [leg_loop(foot, joint) for foot in gait.feet]} if by_leg else {}
        return leg_loop(gait.both, joint) | legs

    return [
        {
            "title": "Ankle: moment over angle",
            **loop("ankle"),
            "people_x": shown_numbers(np.degrees(human.mean("ankle", phase))),
            "people_y": shown_numbers(human.mean("ankle_moment", phase)),
            "thesis": thesis,
        },
        {
            "title": "Toe: moment over angle",
            **loop("mtp"),
        },
    ]
