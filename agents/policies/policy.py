"""Define a policy as one .safetensors file: weights, observation statistics, settings, a fingerprint; no code.

The file's header has one entry, `springfoot`, JSON that describes the tensors and holds a digest (`tensor_file`); the
file does not tell where or when it was made. `Policy` needs NumPy only, so a policy runs without a learner.
"""

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from importlib import resources
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.batch.learned_person import LEARNED, POLICY_ENTRIES, person_file
from springfoot.envs.batch.leg_network import LegNetwork
from springfoot.envs.settings.settings import BipedSettings, settings_from, settings_to_json, with_bodies_of_model
from springfoot.envs.task.mirror import Mirror, mirror_of
from springfoot.errors import SpringfootError, perhaps, quoted
from springfoot.files.tensor_file import read_tensors, write_tensors

from .baselines import BASELINES
from .fingerprint import fingerprint, require_same
from .foreign import ForeignPolicy, function_policy, is_function, observation_rows, onnx_policy
from .number_bounds import LARGEST_WEIGHT, require_bounded

FORMAT_VERSION = 1
"""Version of the file layout; a reader refuses any other."""


VARIANCE_FLOOR = 1e-8
"""Added to each observation's variance before the root, as in stable-baselines3's VecNormalize."""


ACTIVATIONS = {
    "tanh": np.tanh,
    "relu": lambda x: np.maximum(x, 0.0),
    "leaky_relu": lambda x: np.where(x > 0.0, x, 0.01 * x),
    "elu": lambda x: np.where(x > 0.0, x, np.expm1(np.minimum(x, 0.0))),
    "silu": lambda x: 0.5 * x * (1.0 + np.tanh(0.5 * x)),
}
"""Name -> activation function between the layers of a network."""
Output = Literal["clip", "tanh"]
"""Function that bounds the last layer's output to [-1, 1], as PPO (clip) or SAC (tanh) does."""


BEST, LAST = "best.safetensors", "last.safetensors"
"""Names of a run folder's policies: the one with the highest return in periodic evaluation, and the newest."""
_PRETRAINED = Path(str(resources.files("springfoot.agents"))) / "pretrained"
SHIPPED = {
    "pretrained": _PRETRAINED / "walk.safetensors",
    "expert": _PRETRAINED / "expert.safetensors",
    "medium": _PRETRAINED / "medium.safetensors",
    **{name: person_file(name) for name in LEARNED if name != "learned-1"},  # that one is `learned`
}
"""Name of a policy of this package -> its file; `policy_card` describes each."""
PRETRAINED_BY = "springfoot train --push-newton 250 --timesteps 14000000 --out runs/pretrained"
"""Command that made `pretrained` from nothing."""
POLICY_SUFFIXES = (".safetensors", ".onnx")
"""Ends of the names of policies' files."""
RUN = "run.json"
"""Name of a run folder's record: configuration, evaluations, status."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Policy:
    """A deterministic policy: normalised observation -> layers -> mean action in [-1, 1].

    With a `mirror`, the layers give the actions of the left leg, and for the mirrored observation those of the right
    leg: the mirrored observation has the mirrored action, bit for bit.

    Calling it maps observations (N, D), or one (D,), to actions (N, A) or (A,), float32; A is 4, 6 or 10 by the setting
    `acts`. The result of a row does not depend on the other rows. Raises `SpringfootError` for another width or for an
    observation that is not finite.
    """

    settings: BipedSettings
    """Settings of the training's environment."""
    fingerprint: dict[str, str]
    """Fingerprint of that environment, from `fingerprint`."""
    weights: tuple[np.ndarray, ...]
    """Weights of each layer, (outputs, inputs); the last one's outputs are all actions, or with a `mirror` those of
    the left leg."""
    biases: tuple[np.ndarray, ...]
    """Biases of each layer, (outputs,)."""
    observation_mean: np.ndarray
    """(D,) mean of the observations in training."""
    observation_variance: np.ndarray
    """(D,) variance of the observations in training."""
    observation_clip: float | None = 10.0
    """Largest magnitude of a normalised observation; None for no limit."""
    variance_floor: float = VARIANCE_FLOOR
    """Added to each variance before the root."""
    activation: str = "tanh"
    """Activation between the layers, one of `ACTIVATIONS`."""
    output: Output = "clip"
    """Function that bounds the last layer's output."""
    mirror: Mirror | None = None
    """Mirror of its observations and actions, if one network acts for each leg."""

    @property
    def layer_sizes(self) -> list[int]:
        """Return the widths of observation, hidden layers and output, which with a `mirror` is one leg's actions."""
        return [self.weights[0].shape[1], *(len(bias) for bias in self.biases)]

    @property
    def action_count(self) -> int:
        """Return the number of actions for one observation, both legs' together."""
        return len(self.biases[-1]) if self.mirror is None else len(self.mirror.action_index)

    @property
    def header(self) -> dict[str, Any]:
        """Return the header of the policy's file, as plain JSON values: all but the numbers of its tensors."""
        return {
            "format_version": FORMAT_VERSION,
            "network": {
                "layer_sizes": self.layer_sizes,
                "activation": self.activation,
                "output": self.output,
                "observation_clip": self.observation_clip,
                "variance_floor": self.variance_floor,
                **({} if self.mirror is None else {"mirrored": True}),
            },
            "settings": settings_to_json(self.settings),
            "fingerprint": self.fingerprint,
        }

    @property
    def observation_deviation(self) -> np.ndarray:
        """Return (D,) the divisor that normalises observations: the root of variance and variance floor together."""
        return np.sqrt(self.observation_variance + self.variance_floor)

    def __call__(self, observation: np.ndarray) -> np.ndarray:
        """Return mean actions (N, A) or (A,) in [-1, 1], float32, for observations (N, D) or (D,)."""
        rows = observation_rows(observation, len(self.observation_mean))
        if self.mirror is None:
            return self._output_of(rows)
        if self._legs is not None:
            bodies = np.atleast_2d(rows).astype(np.float32)
            left, right = np.moveaxis(self._legs(bodies, np.ones(len(bodies), bool)), 1, 0)
            return self.mirror.both_legs(left, right).reshape(*rows.shape[:-1], self.action_count)
        return self.mirror.both_legs(self._output_of(rows), self._output_of(self.mirror.of(rows)))

    @cached_property
    def _legs(self) -> LegNetwork | None:
        """Return the network as a person in the step has it, a fifth of the time of `_output_of`; None for other
        forms."""
        deviation = self.observation_deviation
        if self.mirror is None or self.activation != "tanh" or self.output != "clip" or not deviation.min() > 0.0:
            return None
        return LegNetwork(
            self.observation_mean, deviation, self.observation_clip, self.mirror, self.weights, self.biases
        )

    def _output_of(self, rows: np.ndarray) -> np.ndarray:
        """Return the network's output in [-1, 1], float32, for raw observations (..., D), float64 and finite.

        Raises `SpringfootError` if the output is not finite.
        """
        rows = (rows - self.observation_mean) / self.observation_deviation
        if self.observation_clip is not None:
            rows = rows.clip(-self.observation_clip, self.observation_clip)
        for layer, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            rows = ACTIVATIONS[self.activation](rows) if layer > 0 else rows  # activations stand between the layers
            # einsum adds in the same order for any N, BLAS does not; a row must not depend on the other rows.
            rows = np.einsum("...i,oi->...o", rows, weight.astype(np.float64), optimize=False) + bias
        if not np.isfinite(rows).all():  # wide and deep unbounded layers can overflow
            raise SpringfootError("the policy's output is not finite")
        return (np.tanh(rows) if self.output == "tanh" else rows.clip(-1.0, 1.0)).astype(np.float32)


def save_policy(path: str | Path, policy: Policy) -> None:
    """Write a policy as one .safetensors file, whole or not at all; equal policies give equal bytes."""
    tensors = {
        "observation.mean": policy.observation_mean,
        "observation.variance": policy.observation_variance,
    }
    for layer, (weight, bias) in enumerate(zip(policy.weights, policy.biases, strict=True)):
        tensors |= {f"layer.{layer}.weight": weight, f"layer.{layer}.bias": bias}
    write_tensors(Path(path), "springfoot", policy.header, tensors)


def find_policy(name: str | Path) -> Path:
    """Return the path of a policy's file.

    `name` is that path, a run folder (its best policy) or one of `SHIPPED`. Raises `SpringfootError` if there is no
    such file.
    """
    path = Path(name)
    if str(name) in SHIPPED:
        path = SHIPPED[str(name)]
        if not path.is_file():
            raise SpringfootError(f"this installation of springfoot has no {name} policy; train one: springfoot train")
    elif str(name) and path.is_dir():
        if not (path / BEST).is_file():
            raise SpringfootError(f"{name} is a folder without {BEST}, so not a run of springfoot train")
        path /= BEST
    elif not path.is_file():
        raise SpringfootError(
            f"no policy {str(name) or repr('')}: give a .safetensors or .onnx file, a run folder, module:function, "
            f"or one of {', '.join(SHIPPED)}{perhaps_policy(str(name), SHIPPED)}"
        )
    return path


def perhaps_policy(name: str, known: Iterable[str]) -> str:
    """Return the hint that ends a message on a missing policy `name`: the most similar of the `known` names, else of
    the folders and policy files in the folder of that path; "" if none is similar."""
    path = Path(name)
    beside: list[str] = []
    with suppress(OSError):
        beside = [other.name for other in path.parent.iterdir() if other.is_dir() or other.suffix in POLICY_SUFFIXES]
    folder = "" if path.parent == Path() else f"{path.parent}/"
    return perhaps(name.partition(":")[0], known) or perhaps(path.name, beside, before=folder)


_NUMBERS = ("observation_clip", "variance_floor")
"""Entries of a header's network that are numbers; a clip may be null."""


def load_policy(name: str | Path) -> Policy | ForeignPolicy:
    """Return the policy in a file, a run folder (its best), one of `SHIPPED`, or the function `module:function`.

    A .safetensors file is read by `read_policy`, an .onnx file by `onnx_policy`; neither executes anything. Only a
    `name` of the form `module:function` runs code: `function_policy` imports that module. Raises `SpringfootError` for
    anything else, and for a baseline, which needs settings.
    """
    if isinstance(name, str) and name.partition(":")[0] in BASELINES and not Path(name).exists():
        raise SpringfootError(
            f"{name} is a baseline, not a policy file: call springfoot.agents.baseline({name!r}, settings)"
        )
    if isinstance(name, str) and is_function(name):
        return function_policy(name)
    path = find_policy(name)
    return onnx_policy(path) if path.suffix == ".onnx" else read_policy(name)


def read_policy(name: str | Path) -> Policy:
    """Read, check and return the policy in a .safetensors file, a run folder (its best) or one of `SHIPPED`.

    Raises `SpringfootError`, one line, if the file is missing, no .safetensors file, not of springfoot, of another
    format version, incomplete or not finite, or made for other spaces, another model or other legs than this version's.
    """
    path = find_policy(name)
    header, tensors = read_tensors(path, "springfoot", "policy", POLICY_ENTRIES)
    if header.get("format_version") != FORMAT_VERSION:
        raise SpringfootError(
            f"{name} has policy format {header.get('format_version')!r}, this version reads {FORMAT_VERSION}"
        )
    try:
        network = header["network"]
        values = header["settings"]
        clip, floor = (None if network[key] is None else float(network[key]) for key in _NUMBERS)
        activation = network["activation"]
        output = network.get("output", "clip")
        mirrored = network.get("mirrored", False)
        sizes = list(network["layer_sizes"])
        stored = dict(header["fingerprint"])
        settings = settings_from(**values)
        biped = Biped(with_bodies_of_model(settings), 1)
    except (KeyError, TypeError, ValueError, OverflowError) as error:  # the last: an integer too large for a float
        fault = f"has no {error}" if isinstance(error, KeyError) else f"is not valid: {error}"
        raise SpringfootError(f"{name}: its header {fault}") from None
    has_functions = activation in ACTIVATIONS and output in get_args(Output) and isinstance(mirrored, bool)
    if not has_functions or floor is None or not 0 <= floor <= LARGEST_WEIGHT:
        raise SpringfootError(f"{name}: its header asks for a network this version does not have: {quoted(network)}")
    if clip is not None and not 0 < clip <= LARGEST_WEIGHT:
        raise SpringfootError(f"{name}: observation_clip must be in (0, {LARGEST_WEIGHT:g}] or null, is {clip:g}")
    mirror = mirror_of(biped.observation_names, biped.action_names) if mirrored else None
    ends = (len(biped.observation_names), len(biped.action_names) // (2 if mirrored else 1))
    if mirrored and len(sizes) > 1 and sizes[0] != ends[0]:
        raise SpringfootError(
            f"{name} observes {sizes[0]!r} numbers, its environment in this version tells {ends[0]}: train it again"
        )
    if len(sizes) < 2 or (sizes[0], sizes[-1]) != ends:
        actions = "the actions of one leg" if mirrored else "action"
        raise SpringfootError(f"{name}: its layers {sizes} do not lead from observation to {actions}")
    _check_tensors(name, tensors, sizes)
    current = fingerprint(biped)
    require_same(name, stored, current)
    layers = range(len(sizes) - 1)
    return Policy(
        settings=settings,
        fingerprint=current,
        weights=tuple(tensors[f"layer.{layer}.weight"] for layer in layers),
        biases=tuple(tensors[f"layer.{layer}.bias"] for layer in layers),
        observation_mean=tensors["observation.mean"],
        observation_variance=tensors["observation.variance"],
        observation_clip=clip,
        variance_floor=floor,
        activation=activation,
        output=output,
        mirror=mirror,
    )


def _check_tensors(name: str | Path, tensors: dict[str, np.ndarray], sizes: list[int]) -> None:
    """Raise `SpringfootError` unless the tensors of the policy `name` are those of its layers, with numbers within
    bounds.

    `sizes` are the widths of observation, hidden layers and output.
    """
    shapes = {"observation.mean": (sizes[0],), "observation.variance": (sizes[0],)}
    for layer, (inputs, outputs) in enumerate(pairwise(sizes)):
        shapes |= {f"layer.{layer}.weight": (outputs, inputs), f"layer.{layer}.bias": (outputs,)}
    for tensor_name in sorted(set(shapes) | set(tensors)):
        expected = shapes.get(tensor_name, "absent")
        shape = tensors[tensor_name].shape if tensor_name in tensors else "absent"
        if shape != expected:
            raise SpringfootError(f"{name}: {tensor_name} must be {expected}, is {shape}")
    require_bounded(name, tensors)
