"""Say how each effect of docs/effects.csv is walked and measured here, or why it is not.

An experiment is conditions (settings), a speed, and a function from measured numbers to the effect, for each episode.
Energy and work are compared where all conditions walk equally fast, as on a treadmill; all else at the commanded speed.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from math import degrees
from typing import Any

import numpy as np

from springfoot.arrays import NDArray
from springfoot.envs import BipedSettings
from springfoot.envs.physics import JOINTS
from springfoot.envs.settings import body_of
from springfoot.gait.body import TOE_STIFFNESS

from ..feet.both_feet import both, braced
from .condition_effects import Effect, Measured, change, difference, mean_of, per_unit, share, slope
from .effect_numbers import ALL_EFFORT, FIBRE
from .laboratory import HEAVY_FEET, LOADS, SLOPES, WAIST_LOADS

_SOUND = "sound"
LOCKED_TOE = 1000.0
"""Stiffness of a passive foot's toe that is called locked, the largest [N m/rad]."""
_BODY = body_of(BipedSettings())


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """How one effect is walked and measured."""

    conditions: Mapping[Any, Mapping[str, Any]]
    """Condition -> settings that differ from the sound walk."""
    speed: float
    """Commanded speed [m/s]."""
    effect: Effect
    """The effect."""
    walked: bool = True
    """True: conditions are compared where all walk as fast; False: as commanded."""
    at: float | None = None
    """Walked speed at which they are compared [m/s]; None for that of `speed`."""
    beside: Mapping[str, Effect] = field(default_factory=dict)
    """Name -> further numbers that are told beside the effect."""
    also: Mapping[str, Callable[[Measured], bool]] = field(default_factory=dict)
    """Clause of the published tolerance beside its range -> whether it holds."""
    note: str = ""
    """Departures from the configuration, and derived numbers."""


# Conditions ---------------------------------------------------------------------------------------------------


def _passive_foot(toe: float) -> dict[str, Any]:
    """Return the settings of a passive right foot with a toe of the stiffness `toe` [N m/rad]."""
    return {"right_foot": {"kind": "passive", "toe_stiffness": toe}}


STRENGTHS = (0.2, 0.3)
"""Strength of weak calves [-]."""
BRACES = (160.0, 233.0, 305.0, 378.0)
"""Stiffness of braces on weak calves, 2.8 to 6.6 N m/deg [N m/rad]."""
_WEAK = {
    (strength, k): both({"kind": "weak", "strength": strength, "orthosis": {"ankle_stiffness": k, "ankle_deg": 0.0}})
    for strength in STRENGTHS
    for k in BRACES
}
_EXO = {
    k: both(braced(ankle_stiffness=k, ankle_deg=-5.7, engages="dorsiflexion")) for k in (0.0, 50.0, 100.0, 150.0, 250.0)
}
_TOE = {"locked": _passive_foot(LOCKED_TOE), "flexible": _passive_foot(60.0)}
_STIFF = {1.0: {}} | {factor: both(braced(toe_stiffness=(factor - 1.0) * TOE_STIFFNESS)) for factor in (2.0, 4.0)}
_STIFF_NOTE = f"× 2 and × 4 are springs at the toe beside its own {TOE_STIFFNESS:g} N·m/rad"
_LOADS_KG = {ratio: ratio * _BODY.mass for ratio in LOADS}
_STOPS = {"free": {}} | {
    f"stop at {rest:g}°": both(braced(ankle_stiffness=1000.0, ankle_deg=rest, engages="plantarflexion"))
    for rest in (0.0, -5.0, -10.0)
}
_ROUGH = {"smooth": {}, "rough": {"unevenness_m": 0.0125}}
_TOE_ONSLOPES = {
    (toe, slope_deg): foot | {"slope_deg": slope_deg} for slope_deg in (5.0, -5.0) for toe, foot in _TOE.items()
}
_TOE_ON_ROUGH = {toe: foot | {"unevenness_m": 0.0125} for toe, foot in _TOE.items()}
_HINGES = {
    k: {"right_foot": braced(ankle_stiffness=k, ankle_deg=0.0, engages="dorsiflexion")}
    for k in (0.0, 14.0, 57.0, 115.0, 212.0)
}


def _slope_conditions(*slopes_deg: float) -> dict[Any, dict[str, Any]]:
    """Return slope [deg] -> settings of a walk on it."""
    return {slope_deg: {"slope_deg": slope_deg} if slope_deg else {} for slope_deg in slopes_deg}


# Experiments --------------------------------------------------------------------------------------------------


def _carried_mass_experiment(conditions: Mapping[float, Mapping[str, Any]]) -> Experiment:
    """Return an experiment on masses [kg] that are carried, the keys of `conditions`: the slope of fibre work over
    them [% of that without/kg]."""
    return Experiment(
        conditions=conditions,
        speed=1.25,
        effect=lambda measured: slope(
            list(conditions), [100.0 * measured[kg][FIBRE] / measured[0.0][FIBRE] for kg in conditions]
        ),
    )


def _weak_calf_experiment(effect_of: Callable[[float], Effect], **fields: Any) -> Experiment:
    """Return an experiment on weak calves in braces: the mean over `STRENGTHS` of the effect at a calf's strength.

    `fields` are further fields of `Experiment`.
    """
    effects = {f"calf {strength:g}": effect_of(strength) for strength in STRENGTHS}
    return Experiment(conditions=_WEAK, speed=1.1, effect=mean_of(effects), beside=effects, **fields)


def _slope_over_braces(name: str) -> Callable[[float], Effect]:
    """Return a function of the calf's strength that returns the effect: the slope of the number `name` over the brace's
    stiffness [1/(N m/deg)]."""
    return lambda strength: per_unit(name, {(strength, k): k / degrees(1.0) for k in BRACES})


def _worst_against_best(strength: float) -> Effect:
    """Return the effect: the change of fibre work from the cheapest to the dearest brace [%], at a calf's `strength`.

    The two braces are those of the least and largest mean over episodes; NaN in all episodes if a brace has none.
    """

    def effect(measured: Measured) -> NDArray:
        """Return the change in each episode (E,)."""
        walks = [measured[strength, k][FIBRE] for k in BRACES]
        means = [float(np.nanmean(walk)) if np.isfinite(walk).any() else np.nan for walk in walks]
        if np.isnan(means).any():
            return np.full(len(walks[0]), np.nan)
        return 100.0 * (walks[int(np.argmax(means))] / walks[int(np.argmin(means))] - 1.0)

    return effect


def _saves_less_at_250(measured: Measured) -> bool:
    """Return True if, in the mean over episodes, the exoskeleton's fibre work is larger at 250 N m/rad than at 50."""
    dearer = measured[250.0][FIBRE] - measured[50.0][FIBRE]
    dearer = dearer[np.isfinite(dearer)]
    return bool(len(dearer) and dearer.mean() > 0.0)


def _lost_ankle_work_experiment(of_a_step: Callable[[Mapping[str, NDArray]], NDArray]) -> Experiment:
    """Return an experiment on plantarflexion stops: energy of a step for each joule of positive ankle work lost.

    `of_a_step` returns that energy in each episode (E,) from a condition's numbers.
    """

    def effect(measured: Measured) -> NDArray:
        """Return the slope over the conditions in each episode (E,), > 0 if energy rises as ankle work falls."""
        walks = [measured[key] for key in _STOPS]
        return -slope([walk["ankle_positive_J_kg"] for walk in walks], [of_a_step(walk) for walk in walks])

    lost = {f"ankle work, {key}": partial(_number, "ankle_positive_J_kg", key) for key in _STOPS}
    return Experiment(conditions=_STOPS, speed=1.4, effect=effect, beside=lost)


def _number(name: str, key: Any, measured: Measured) -> NDArray:
    """Return the number `name` under the condition `key` in each episode (E,)."""
    return measured[key][name]


def _slope_experiment(of: str) -> Experiment:
    """Return an experiment on the slope `of` ("up" or "down"): fibre work less that on level ground, and its split
    between joints."""
    split = {joint: difference(f"fibre_{joint}_J_kg_m", of, "level") for joint in JOINTS}
    conditions = {key: SLOPES[key] for key in ("level", of)}
    return Experiment(conditions=conditions, speed=1.3, effect=difference(FIBRE, of, "level"), beside=split)


def _flexible_toe_experiment(name: str, **fields: Any) -> Experiment:
    """Return an experiment on a flexible toe against a locked one: the change of the number `name` [%].

    It is on level ground at 1.2 m/s unless `fields` of `Experiment` say otherwise.
    """
    return Experiment(
        **{"conditions": _TOE, "speed": 1.2, "effect": change(name, "flexible", "locked")} | fields,
    )


def _stiff_foot_experiment(name: str, **fields: Any) -> Experiment:
    """Return an experiment on toes of fourfold stiffness: the change of the number `name` [%]; twofold ones beside it.

    `fields` are further fields of `Experiment`.
    """
    beside = {"× 2": change(name, 2.0, 1.0)}
    effect = change(name, 4.0, 1.0)
    return Experiment(conditions=_STIFF, speed=1.25, effect=effect, beside=beside, note=_STIFF_NOTE, **fields)


def _rough_ground_experiment(name: str) -> Experiment:
    """Return an experiment on uneven ground against even ground: the change of the number `name` [%]."""
    return Experiment(conditions=_ROUGH, speed=1.0, effect=change(name, "rough", "smooth"))


_TOE_SLOPE_WORK = {
    f"{slope_deg:+g}°": (
        lambda measured, at=slope_deg: (
            _BODY.mass * difference("right_push_off_J_kg", ("flexible", at), ("locked", at))(measured)
        )
    )
    for slope_deg in (5.0, -5.0)
}
_WHOLE_STRIDE = "positive work over the stride, whose split by phase metrics lack"
_STROKE = "not run: its people had a stroke; no foot or person here is like theirs"

EXPERIMENTS: dict[str, Experiment | str] = {
    "afo_dorsiflexion": _weak_calf_experiment(
        _slope_over_braces("dorsiflexion_deg"),
        walked=False,
        note="largest value of the mean curve in stance",
    ),
    "afo_power": _weak_calf_experiment(
        _slope_over_braces("ankle_power_W_kg"), walked=False, note="largest value of the mean curve"
    ),
    "afo_range": _weak_calf_experiment(
        _worst_against_best, at=1.05, note="at 1.05 m/s, as one brace does not reach 1.1"
    ),
    "exo_saving": Experiment(
        conditions=_EXO,
        speed=1.25,
        effect=change(FIBRE, 50.0, 0.0),
        beside={f"{k:g} N·m/rad": change(FIBRE, k, 0.0) for k in (100.0, 150.0, 250.0)}
        | {f"{k:g} N·m/rad by effort": change(ALL_EFFORT, k, 0.0) for k in (50.0, 250.0)}
        | {f"of it {joint}": share(f"fibre_{joint}_J_kg_m", FIBRE, 50.0, 0.0) for joint in JOINTS},
        also={"less at 250 than at 50": _saves_less_at_250},
    ),
    "toe_pushoff": _flexible_toe_experiment(
        "right_push_off_J_kg", note=f"locked is {LOCKED_TOE:g} N·m/rad; ankle and toe, {_WHOLE_STRIDE}"
    ),
    "toe_com_pushoff": _flexible_toe_experiment("right_com_push_off_J_kg", note=f"locked is {LOCKED_TOE:g} N·m/rad"),
    "stiff_foot_cost": _stiff_foot_experiment(FIBRE),
    "slope_up": _slope_experiment("up"),
    "slope_down": _slope_experiment("down"),
    "load_cost": Experiment(conditions=LOADS, speed=1.25, effect=per_unit(FIBRE, _LOADS_KG, factor=1.25 * _BODY.mass)),
    "load_com_work": Experiment(
        conditions=LOADS,
        speed=1.25,
        effect=per_unit("com_positive_W_kg", _LOADS_KG, factor=_BODY.mass),
        note="derived from mean curves of ground force and CoM velocity, both legs, all of the stride",
    ),
    "foot_mass": _carried_mass_experiment(HEAVY_FEET),
    "waist_mass": _carried_mass_experiment(WAIST_LOADS),
    "ankle_k_falls": "not run: it has neither sign nor size; springfoot study identify shows it",
    "pushoff_collision": _lost_ankle_work_experiment(lambda walk: walk["collision_J_kg"]),
    "pushoff_joint_work": _lost_ankle_work_experiment(
        lambda walk: np.sum([walk[f"{joint}_positive_J_kg"] for joint in JOINTS], axis=0)
    ),
    "pushoff_cost": _lost_ankle_work_experiment(lambda walk: walk[FIBRE] * walk["step_length_m"]),
    "rigid_both_cost": Experiment(
        conditions={_SOUND: {}, "rigid": both("rigid")}, speed=1.25, effect=change(FIBRE, "rigid", _SOUND)
    ),
    "stay_propulsion": Experiment(
        conditions={_SOUND: {}, "stay": {"right_foot": braced(ankle_stiffness=1000.0, ankle_deg=0.0)}},
        speed=0.8,
        walked=False,
        effect=difference("right_forward_bw", "stay", _SOUND),
    ),
    "load_knee_moment": Experiment(
        conditions={0.0: {}, 0.35: {"carried_ratio": 0.35}},
        speed=1.5,
        walked=False,
        effect=change("knee_moment_Nm_kg", 0.35, 0.0),
    ),
    "rough_cost": _rough_ground_experiment(FIBRE),
    "rough_hip_work": _rough_ground_experiment("hip_positive_J_kg"),
    "rough_knee_work": _rough_ground_experiment("knee_negative_J_kg"),
    "toe_slope_pushoff": Experiment(
        conditions=_TOE_ONSLOPES,
        speed=1.1,
        effect=mean_of(_TOE_SLOPE_WORK),
        beside=_TOE_SLOPE_WORK,
        note=f"the mean of both slopes; ankle and toe, {_WHOLE_STRIDE}",
    ),
    "toe_slope_knee": Experiment(
        conditions={key: given for key, given in _TOE_ONSLOPES.items() if given["slope_deg"] > 0.0},
        speed=1.1,
        walked=False,
        effect=difference("right_knee_at_toe_off_deg", ("flexible", 5.0), ("locked", 5.0)),
        note="the mean curve at toe-off",
    ),
    "toe_rough_hip": _flexible_toe_experiment("right_hip_net_J_kg", conditions=_TOE_ON_ROUGH, speed=1.0),
    "exo_ankle_moment": Experiment(
        conditions={k: _EXO[k] for k in (0.0, 50.0)},
        speed=1.25,
        walked=False,
        effect=change("ankle_fibres_Nm", 50.0, 0.0),
        note="largest value of the mean curve of the recorded fibre_moment",
    ),
    "stiff_foot_loss": _stiff_foot_experiment("toe_negative_J_kg"),
    "stiff_foot_force": _stiff_foot_experiment("ankle_moment_Nm_kg", walked=False),
    "afo_knee_extension": Experiment(
        conditions=_HINGES,
        speed=0.8,
        walked=False,
        effect=per_unit("right_knee_least_in_stance_deg", {k: k / degrees(1.0) for k in _HINGES}, factor=-1.0),
        note="least flexion of the mean curve in stance, turned around, for each N·m/deg",
    ),
    "afo_stop_knee": _STROKE,
    "afo_angle_swing_knee": _STROKE,
    "clearance_speed": Experiment(
        conditions={
            speed: {"right_foot": {"kind": "passive", "ankle_stiffness": 600.0}, "speed": speed}
            for speed in (0.9, 1.2, 1.5)
        },
        speed=1.2,
        walked=False,
        effect=per_unit("clearance_sound_less_right_m", {speed: speed for speed in (0.9, 1.2, 1.5)}),
        note="for each m/s commanded",
    ),
    "slope_trailing": Experiment(
        conditions=_slope_conditions(0.0, 3.0, 5.0),
        speed=1.25,
        effect=per_unit("push_off_J_kg", {0.0: 0.0, 3.0: 3.0, 5.0: 5.0}),
        note="for each degree",
    ),
    "slope_leading": Experiment(
        conditions=_slope_conditions(0.0, -3.0, -5.0),
        speed=1.25,
        effect=per_unit("collision_J_kg", {0.0: 0.0, -3.0: 3.0, -5.0: 5.0}),
        note="for each degree",
    ),
    "slope_hip_share": Experiment(
        conditions=_slope_conditions(-5.0, 0.0, 5.0),
        speed=1.25,
        effect=per_unit("hip_share", {-5.0: -5.0, 0.0: 0.0, 5.0: 5.0}),
        note="derived from the mean curves of power in stance",
    ),
}
"""Name of each effect of docs/effects.csv -> its experiment, or the reason why it is not run."""
