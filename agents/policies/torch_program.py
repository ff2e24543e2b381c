"""A policy as a torch program, from the raw observation to the action and what it sets; saved by `torch.export`."""

from io import BytesIO

import torch

from .contract import Scale, two_floats
from .conversion import TORCH_NAMES
from .policy import Policy


class _Program(torch.nn.Module):
    mean: torch.Tensor
    rest: torch.Tensor
    deviation: torch.Tensor
    middle: torch.Tensor
    factor: torch.Tensor
    joints: torch.Tensor

    def __init__(self, policy: Policy, scale: Scale) -> None:
        super().__init__()
        mean, rest = two_floats(policy.observation_mean)
        for name, value in (
            ("mean", mean),
            ("rest", rest),
            ("deviation", policy.observation_deviation),
            ("middle", scale.middle),
            ("factor", scale.factor),
        ):
            self.register_buffer(name, torch.tensor(value, dtype=torch.float32))
        self.register_buffer("joints", torch.tensor(scale.joints))
        parts: list[torch.nn.Module] = []
        for weight, bias in zip(policy.weights, policy.biases, strict=True):
            layer = torch.nn.Linear(weight.shape[1], len(weight))
            layer.load_state_dict({"weight": torch.tensor(weight), "bias": torch.tensor(bias)})
            parts += [getattr(torch.nn, TORCH_NAMES[policy.activation])(), layer]
        self.layers = torch.nn.Sequential(*parts[1:])
        self.clip, self.squashes = policy.observation_clip, policy.output == "tanh"

    def forward(self, observation: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        x = (observation - self.mean - self.rest) / self.deviation
        x = self.layers(x if self.clip is None else x.clamp(-self.clip, self.clip))
        action = x.tanh() if self.squashes else x.clamp(-1.0, 1.0)
        return action, self.middle * self.factor ** action.index_select(1, self.joints)


def torch_bytes(policy: Policy, scale: Scale) -> bytes:
    """The file: `torch.export.load(file).module()` maps observations (N, D) to (action (N, 4), that of `scale`)."""
    two = torch.zeros(2, policy.layer_sizes[0])  # of one, torch would make a program for one alone
    shapes = {"observation": {0: torch.export.Dim("N")}}
    program = torch.export.export(_Program(policy, scale).requires_grad_(False), (two,), dynamic_shapes=shapes)
    program.example_inputs = None  # torch would keep them as a pickle
    file = BytesIO()
    torch.export.save(program, file)
    return file.getvalue()
