"""Export policies: one ONNX file that runs without springfoot, and its contract in JSON.

The contract describes inputs and outputs: names, units, order and bounds. Neither file tells where or when it was made.
"""

import json
from collections.abc import Sequence
from importlib.metadata import version
from math import e, radians
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from springfoot.arrays import NDArray
from springfoot.envs.control.equilibrium import foot_curves
from springfoot.envs.control.foot_rows import controlled_joints
from springfoot.envs.control.phase_table import SAMPLES
from springfoot.envs.control.reference_walk import reference_walks, rows
from springfoot.envs.control.stiffness_control import stiffness_of
from springfoot.envs.physics.model import ACTIONS, PERSON_ACTIONS, SIDES, actions_of
from springfoot.envs.settings.settings import BipedSettings, body_of
from springfoot.envs.task.observation_entries import entries_of
from springfoot.errors import SpringfootError
from springfoot.files.writing import require_new_files, write_new
from springfoot.gait.body.body import REFERENCE_HEIGHT, REFERENCE_MASS, Body
from springfoot.gait.springs.stiffness import SPRINGS

from .foreign import CONTRACT_KEY, contract_path
from .policy import Policy

SUFFIX = ".onnx"
"""Ending of an exported policy's name."""


def export_policy(policy: Policy, out: str | Path) -> list[Path]:
    """Write a policy as an ONNX file for use without springfoot; return the new files.

    Args:
        policy: policy of this version, from `read_policy`.
        out: new file, ending in .onnx. Beside it appears its contract, OUT.json.

    The graph takes the raw observation (N, D) and returns the action (N, A), and the values that it sets: stiffness
    (`Scale`), offsets of a person's rest angles (`REST_OFFSETS`), or both. All are float32, the actions within 1e-5 of
    the policy's own. Raises `SpringfootError`, with nothing written, for another ending, for files that exist, and
    without the package onnx.
    """
    files = planned_files(out)
    contract = json.dumps(contract_of(policy), indent=1, allow_nan=False) + "\n"
    try:
        content = onnx_bytes(policy, contract)
    except ModuleNotFoundError as error:
        raise SpringfootError(f"an export needs the package {error.name}: pip install 'springfoot[onnx]'") from None
    write_new(dict(zip(files, [content, contract.encode()], strict=True)))
    return files


def planned_files(out: str | Path) -> list[Path]:
    """Return the paths of an export's two new files: the policy `out`, and its contract beside it.

    Raises `SpringfootError` if `out` does not end in `SUFFIX`, or one of them exists already.
    """
    out = Path(out)
    if out.suffix != SUFFIX:
        raise SpringfootError(f"out must end in {SUFFIX}, got {out}")
    files = [out, contract_path(out)]
    require_new_files(files)
    return files


CONTRACT_VERSION = 2
"""Version of the contract's layout; 1 knew no person."""
REST_OFFSETS = "rest_angle_offset"
"""Output of a policy that moves a person: how far the rest angles of hips, knees and ankles are moved [rad]."""
SCHEDULE_STEP = SAMPLES // 100
"""Samples of a stride between two values of a schedule in the contract: one percent."""
PACKAGES = ("springfoot", "mujoco", "numpy")


class Scale(NamedTuple):
    """Output of an exported policy, the meaning of its actions on the stiffness: middle x factor^action for each set
    joint.

    In absolute mode the output is `stiffness` [N m/rad] of the body of 1.70 m and 63 kg; in residual mode, where an
    action is a factor on the schedule, `stiffness_factor` [-].
    """

    name: str
    """Name of the output."""
    unit: str
    """Its unit."""
    joints: list[int]
    """Indices of the actions that have an effect: none of a joint that `stiffness_joints` leaves out, or of a
    device."""
    middle: NDArray
    """(joints,) output at action 0."""
    factor: NDArray
    """(joints,) output at action 1 over that at action 0."""


def scale_of(settings: BipedSettings) -> Scale | None:
    """Return the `Scale` by which a policy's actions become stiffnesses in an environment of these settings; None where
    no action is one."""
    if settings.acts == "person":
        return None
    joints = np.flatnonzero(controlled_joints(settings)).tolist()
    if settings.action_mode == "residual":
        # An action a multiplies the schedule by e^a.
        return Scale("stiffness_factor", "1", joints, np.ones(len(joints)), np.full(len(joints), e))
    # K of the four actions' joints, ankle and toe of each leg, where all actions are 0, and where all are 1
    middle, stiffest = (
        np.tile(stiffness_of(np.full(len(SPRINGS), action), settings, Body()), len(SIDES))[joints]
        for action in (0.0, 1.0)
    )
    return Scale("stiffness", "N m/rad", joints, middle, stiffest / middle)


def two_floats(value: NDArray) -> tuple[NDArray, NDArray]:
    """Return two float32 arrays with the float64 `value` as their sum, to twice float32's precision.

    float32 alone is too coarse: an observation's mean can be 1,000 times its standard deviation.
    """
    whole = value.astype(np.float32)
    return whole, (value - whole).astype(np.float32)


def contract_of(policy: Policy) -> dict[str, Any]:
    """Return the contract of a policy, as plain JSON values; docs/how-to/policies.md explains its entries."""
    settings = policy.settings
    header = policy.header
    observed = entries_of(settings.acts)
    actions = actions_of(settings.acts)
    contract = {
        "contract_version": CONTRACT_VERSION,
        "observation": {
            "shape": ["N", len(observed)],
            "dtype": "float32",
            "values": "finite, as the environment gives them: SI divided by the unit, within low and high; "
            "g is gravity, l the leg length of the body (hip to floor when standing)",
            "entries": [
                {"name": entry.name, "unit": entry.unit, "low": entry.low, "high": entry.high, "meaning": entry.meaning}
                for entry in observed
            ],
        },
        "action": {
            "shape": ["N", len(actions)],
            "unit": "1",
            "entries": [{"name": name, "low": -1.0, "high": 1.0} for name in actions],
        },
        **_stiffness(scale_of(settings)),
        **_offsets(settings),
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
    multiplied = settings.acts != "person" and settings.action_mode == "residual"
    return contract | {"schedule": _schedule(settings)} if multiplied else contract


def _stiffness(scale: Scale | None) -> dict[str, Any]:
    """Return the contract's entry on the output of a `Scale`, by its name; empty for None."""
    if scale is None:
        return {}
    # (joint, stiffness at action -1, stiffness at action 1)
    bounds = zip(scale.joints, scale.middle / scale.factor, scale.middle * scale.factor, strict=True)
    entries = [  # rounded: without the last bits' noise
        {"name": ACTIONS[joint], "low": round(float(low), 9), "high": round(float(high), 9)}
        for joint, low, high in bounds
    ]
    return {scale.name: {"shape": ["N", len(entries)], "unit": scale.unit, "entries": entries}}


def _offsets(settings: BipedSettings) -> dict[str, Any]:
    """Return the contract's entry on `REST_OFFSETS`, by its name; empty for a policy that moves no person."""
    if settings.acts == "stiffness":
        return {}
    farthest = radians(settings.person_range_deg)
    entries = [{"name": name, "low": -farthest, "high": farthest} for name in PERSON_ACTIONS]
    return {REST_OFFSETS: {"shape": ["N", len(entries)], "unit": "rad", "entries": entries}}


def _schedule(settings: BipedSettings) -> dict[str, Any]:
    """Return the entry `schedule` of a contract: the K that a residual action multiplies, as JSON values.

    `ankle` and `toe` are lists [speed][percent of the leg's stride] [N m/rad], for the contract's body, 1.70 m and
    63 kg; `speed_m_s` holds the speeds.
    """
    walks = reference_walks(settings)
    scale = body_of(settings).stiffness_scale
    curves = []
    for constants, walk in rows(walks):
        _, stiffness = foot_curves(settings, constants, walk)
        curves.append(stiffness[::SCHEDULE_STEP] / scale)
    table = np.round(np.stack(curves), 6)  # (speed, percent, joint), without the last bits' noise
    return {
        "unit": "N m/rad",
        "speed_m_s": [float(walk.speed) for walk in walks],
        "ankle": table[..., 0].tolist(),
        "toe": table[..., 1].tolist(),
    }


OPSET, IR_VERSION = 17, 8
"""ONNX versions of the file, no newer than needed: onnxruntime reads them since 1.12 (2022)."""
OPERATORS = {"tanh": "Tanh", "relu": "Relu", "leaky_relu": "LeakyRelu", "elu": "Elu"}
"""Activation -> ONNX operator with the same function; silu has none."""


def onnx_bytes(policy: Policy, contract: str) -> bytes:
    """Return the content of the ONNX file: input `observation` (N, D), outputs `action` (N, A), and by its name that of
    the `Scale`, then `REST_OFFSETS`, where the policy has them.

    The graph computes `Policy.__call__` in float32, then the values its actions set. The metadata holds `contract`.
    """
    import onnx  # an extra of its own
    from onnx import helper, numpy_helper

    nodes: list[Any] = []
    constants: list[Any] = []

    # These three functions add to the graph; each returns the name of its output.
    def constant(value: ArrayLike, dtype: type = np.float32) -> str:
        constants.append(numpy_helper.from_array(np.array(value, dtype, order="C"), f"constant_{len(constants)}"))
        return constants[-1].name

    def node(operator: str, *inputs: str, name: str = "", **attributes: Any) -> str:
        nodes.append(helper.make_node(operator, inputs, [name or f"{operator}_{len(nodes)}"], **attributes))
        return nodes[-1].output[0]

    def clip(x: str, limit: float, name: str = "") -> str:
        return node("Clip", x, constant(-limit), constant(limit), name=name)

    mean, mean_remainder = two_floats(policy.observation_mean)
    statistics = [constant(value) for value in (mean, mean_remainder, policy.observation_deviation)]
    layers = [(constant(w), constant(b)) for w, b in zip(policy.weights, policy.biases, strict=True)]

    def output_of(observation: str) -> str:
        """Add to the graph the layers on `observation`, the name of an input; return the name of their output."""
        # Normalise the observation: (observation - mean) / deviation, clipped.
        x = node("Sub", node("Sub", observation, statistics[0]), statistics[1])
        x = node("Div", x, statistics[2])
        if policy.observation_clip is not None:
            x = clip(x, policy.observation_clip)
        for layer, (weight, bias) in enumerate(layers):
            if layer > 0:  # activations stand between the layers
                if policy.activation == "silu":
                    x = node("Mul", x, node("Sigmoid", x))
                else:
                    x = node(OPERATORS[policy.activation], x)
            x = node("Gemm", x, weight, bias, transB=1)
        return x

    x = output_of("observation")
    if (mirror := policy.mirror) is not None:
        # The network once more, on the mirrored observation, for the right leg; then the actions in their order.
        image = node("Gather", "observation", constant(mirror.index, np.int64), axis=1)
        x = node("Concat", x, output_of(node("Mul", image, constant(mirror.sign))), axis=1)
        x = node("Gather", x, constant(mirror.legs_order, np.int64), axis=1)
    action = node("Tanh", x, name="action") if policy.output == "tanh" else clip(x, 1.0, "action")

    def actions_at(places: Sequence[int]) -> str:
        """Add to the graph the actions at these places; return the name of the output."""
        return node("Gather", action, constant(places, np.int64), axis=1)

    def float_rows(name: str, width: int) -> Any:
        return helper.make_tensor_value_info(name, onnx.TensorProto.FLOAT, ["N", width])

    inputs = [float_rows("observation", policy.layer_sizes[0])]
    outputs = [float_rows("action", policy.action_count)]
    if (scale := scale_of(policy.settings)) is not None:
        power = node("Pow", constant(scale.factor), actions_at(scale.joints))
        node("Mul", constant(scale.middle), power, name=scale.name)
        outputs.append(float_rows(scale.name, len(scale.joints)))
    if policy.settings.acts != "stiffness":
        farthest = constant(radians(policy.settings.person_range_deg))
        offsets = range(policy.action_count - len(PERSON_ACTIONS), policy.action_count)
        node("Mul", farthest, actions_at(offsets), name=REST_OFFSETS)
        outputs.append(float_rows(REST_OFFSETS, len(PERSON_ACTIONS)))
    graph = helper.make_graph(nodes, "springfoot", inputs, outputs, constants)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=IR_VERSION)
    model.producer_name = "springfoot"
    helper.set_model_props(model, {CONTRACT_KEY: contract})
    onnx.checker.check_model(model, full_check=True)
    return model.SerializeToString()
