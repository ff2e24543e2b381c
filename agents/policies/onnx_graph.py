"""A policy as an ONNX graph, from the raw observation to the action and what it sets; made by `onnx` alone."""

from typing import Any

import numpy as np
import onnx
from numpy.typing import ArrayLike
from onnx import helper, numpy_helper

from .contract import Scale, two_floats
from .foreign import CONTRACT_KEY
from .policy import Policy

OPSET, IR_VERSION = 17, 8
"""What the file asks of its reader, no newer than needed: onnxruntime has it since 1.12 (2022)."""
OPERATORS = {"tanh": "Tanh", "relu": "Relu", "leaky_relu": "LeakyRelu", "elu": "Elu"}
"""Operator of each activation that has one of its own, by default with the slopes of ours."""


def onnx_bytes(policy: Policy, scale: Scale, contract: str) -> bytes:
    """The file: input `observation` (N, D), outputs `action` (N, 4) and that of `scale`; `contract` in its metadata."""
    nodes: list[onnx.NodeProto] = []
    constants: list[onnx.TensorProto] = []

    def constant(value: ArrayLike, dtype: type = np.float32) -> str:
        constants.append(numpy_helper.from_array(np.array(value, dtype, order="C"), f"constant_{len(constants)}"))
        return constants[-1].name

    def node(operator: str, *inputs: str, name: str = "", **attributes: Any) -> str:
        nodes.append(helper.make_node(operator, inputs, [name or f"{operator}_{len(nodes)}"], **attributes))
        return nodes[-1].output[0]

    def clip(x: str, limit: float, name: str = "") -> str:
        return node("Clip", x, constant(-limit), constant(limit), name=name)

    mean, rest = two_floats(policy.observation_mean)
    x = node("Sub", node("Sub", "observation", constant(mean)), constant(rest))
    x = node("Div", x, constant(policy.observation_deviation))
    if policy.observation_clip is not None:
        x = clip(x, policy.observation_clip)
    for layer, (weight, bias) in enumerate(zip(policy.weights, policy.biases, strict=True)):
        if layer:
            x = (
                node("Mul", x, node("Sigmoid", x))
                if policy.activation == "silu"
                else node(OPERATORS[policy.activation], x)
            )
        x = node("Gemm", x, constant(weight), constant(bias), transB=1)
    action = node("Tanh", x, name="action") if policy.output == "tanh" else clip(x, 1.0, "action")
    power = node("Pow", constant(scale.factor), node("Gather", action, constant(scale.joints, np.int64), axis=1))
    node("Mul", constant(scale.middle), power, name=scale.name)

    def value(name: str, width: int) -> onnx.ValueInfoProto:
        return helper.make_tensor_value_info(name, onnx.TensorProto.FLOAT, ["N", width])

    outputs = [value("action", policy.layer_sizes[-1]), value(scale.name, len(scale.joints))]
    graph = helper.make_graph(nodes, "springfoot", [value("observation", policy.layer_sizes[0])], outputs, constants)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=IR_VERSION)
    model.producer_name = "springfoot"
    helper.set_model_props(model, {CONTRACT_KEY: contract})
    onnx.checker.check_model(model, full_check=True)
    return model.SerializeToString()
