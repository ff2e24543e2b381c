"""The contract of an exported policy: what goes in and what comes out, as names, units, order and bounds, in JSON.

The same numbers that stand in it, `scale_of`, stand in every exported file; nothing in it tells where or when it was
made.
"""

from collections.abc import Sequence
from importlib.metadata import version
from math import e
from typing import Any, NamedTuple

import numpy as np

from springfoot.arrays import NDArray
from springfoot.envs.control.equilibrium import foot_curves
from springfoot.envs.control.foot_rows import controlled_joints
from springfoot.envs.control.foot_springs import stiffness_of
from springfoot.envs.control.phase_table import SAMPLES
from springfoot.envs.control.reference_walk import ReferenceWalk, rows, walks_of_legs
from springfoot.envs.physics.model import ACTIONS
from springfoot.envs.settings.settings import BipedSettings, body_of
from springfoot.envs.task.observation import OBSERVATION
from springfoot.gait.body.body import REFERENCE_HEIGHT, REFERENCE_MASS, Body

from .policy import Policy

CONTRACT_VERSION = 1
"""Version of the contract's layout."""
SCHEDULE_STEP = SAMPLES // 100
"""Samples of a stride between two values of a schedule in the contract: one percent."""
PACKAGES = ("springfoot", "mujoco", "numpy")


class Scale(NamedTuple):
    """What an exported policy returns besides its actions: middle x factor^action, of the actions that count.

    In absolute mode that is `stiffness` [N m/rad] of the body of 1.70 m and 63 kg; in residual mode, where an action
    says how many times the schedule, `stiffness_factor` [-].
    """

    name: str
    """Name of that output."""
    unit: str
    """Its unit."""
    joints: list[int]
    """Indices of the actions that count: not those of a joint that `stiffness_joints` leaves out, nor of a device."""
    middle: NDArray
    """(joints,) its value at action 0."""
    factor: NDArray
    """(joints,) how many times that it is at action 1."""


def scale_of(settings: BipedSettings) -> Scale:
    """What the actions of a policy with these settings set."""
    joints = np.flatnonzero(controlled_joints(settings)).tolist()
    if settings.action_mode == "residual":
        return Scale("stiffness_factor", "1", joints, np.ones(len(joints)), np.full(len(joints), e))
    middle, stiffest = (np.tile(stiffness_of(np.full(2, a), settings, Body()), 2)[joints] for a in (0.0, 1.0))
    return Scale("stiffness", "N m/rad", joints, middle, stiffest / middle)


def two_floats(value: NDArray) -> tuple[NDArray, NDArray]:
    """float32 numbers whose sum is `value` to twice their precision.

    A mean of observations needs it, where the deviation it is counted in is a thousandth of it.
    """
    whole = value.astype(np.float32)
    return whole, (value - whole).astype(np.float32)


def contract_of(policy: Policy) -> dict[str, Any]:
    """The contract of a policy, as plain JSON values; docs/policies.md explains each of them."""
    settings, scale, header = policy.settings, scale_of(policy.settings), policy.header
    bounds = zip(scale.joints, scale.middle / scale.factor, scale.middle * scale.factor, strict=True)
    contract = {
        "contract_version": CONTRACT_VERSION,
        "observation": {
            "shape": ["N", len(OBSERVATION)],
            "dtype": "float32",
            "values": "finite, as the environment gives them: SI divided by the unit, within low and high; "
            "g is gravity, l the leg length of the body (hip to floor when standing)",
            "entries": [
                {"name": entry.name, "unit": entry.unit, "low": entry.low, "high": entry.high, "meaning": entry.meaning}
                for entry in OBSERVATION
            ],
        },
        "action": {
            "shape": ["N", len(ACTIONS)],
            "unit": "1",
            "entries": [{"name": name, "low": -1.0, "high": 1.0} for name in ACTIONS],
        },
        scale.name: {
            "shape": ["N", len(scale.joints)],
            "unit": scale.unit,
            "entries": [
                {"name": ACTIONS[joint], "low": round(float(low), 9), "high": round(float(high), 9)}
                for joint, low, high in bounds
            ],
        },
        "body": {
            "height_m": REFERENCE_HEIGHT,
            "mass_kg": REFERENCE_MASS,
            "scaling": "another body's stiffness is this one times (mass + load) / mass_kg x height / height_m",
        },
        "step_seconds": settings.step_seconds,
        "network": header["network"],
        "settings": header["settings"],
        "fingerprint": header["fingerprint"],
        "versions": {name: version(name) for name in PACKAGES},
    }
    return contract if settings.action_mode == "absolute" else contract | {"schedule": _schedule(settings)}


def _schedule(settings: BipedSettings) -> dict[str, Any]:
    """What a residual action multiplies, at each percent of the leg's stride, by speed; of the body of the contract.

    `right` is the right leg's, where a person has adapted to a foot; the rest is then the left leg's.
    """
    left, right = walks_of_legs(settings)
    found = {"unit": "N m/rad", "speed_m_s": [float(walk.speed) for walk in left], **_curves(settings, left)}
    return found | {"right": _curves(settings, right)} if right else found


def _curves(settings: BipedSettings, walks: Sequence[ReferenceWalk]) -> dict[str, list[list[float]]]:
    unit = body_of(settings).stiffness_scale
    curves = [foot_curves(settings, constants, walk)[1][::SCHEDULE_STEP] / unit for constants, walk in rows(walks)]
    table = np.round(np.stack(curves), 6)
    return {"ankle": table[..., 0].tolist(), "toe": table[..., 1].tolist()}
