"""Plays a policy exported by `springfoot export POLICY --to numpy`; needs NumPy alone, executes nothing of the file.

policy = load("walk.npz")
action, stiffness = policy(observation)  # (D,) or (N, D), raw and finite; walk.npz.json says what each number means
"""

from collections.abc import Callable
from os import PathLike

import numpy as np

ACTIVATIONS = {
    "tanh": np.tanh,
    "relu": lambda x: np.maximum(x, 0.0),
    "leaky_relu": lambda x: np.where(x > 0.0, x, 0.01 * x),
    "elu": lambda x: np.where(x > 0.0, x, np.expm1(np.minimum(x, 0.0))),
    "silu": lambda x: 0.5 * x * (1.0 + np.tanh(0.5 * x)),
}
"""What stands between the layers of a network, by name."""


def load(path: str | PathLike) -> Callable:
    """The policy in the .npz file `path`: a function of observations that returns actions and what they set."""
    with np.load(path) as file:
        part = dict(file)
    between, squashed = ACTIVATIONS[str(part["activation"])], str(part["output"]) == "tanh"
    layers = [(part[f"weight_{i}"].T, part[f"bias_{i}"]) for i in range(len(part["layer_sizes"]) - 1)]

    def policy(observation):
        """Actions (..., 4) in [-1, 1], and what those that count set, as the file's contract says."""
        x = (np.asarray(observation, float) - part["mean"]) / part["deviation"]
        x = np.clip(x, -part["clip"], part["clip"])
        for i, (weight, bias) in enumerate(layers):
            x = (between(x) if i else x) @ weight + bias
        action = np.tanh(x) if squashed else np.clip(x, -1.0, 1.0)
        return action, part["middle"] * part["factor"] ** action[..., part["joints"]]

    return policy
