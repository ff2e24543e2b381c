"""A policy as one .safetensors file: weights, observation statistics, settings, a fingerprint; no code.

The file's header has one entry, `springfoot`, whose JSON says what the tensors mean; nothing in it tells
where or when it was made. `Policy` needs NumPy only, so a policy runs where no learner is installed.
"""

import hashlib
import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from importlib import resources
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save as to_safetensors

from springfoot.envs.biped_batch import Biped
from springfoot.envs.control.equilibrium import foot_curves
from springfoot.envs.control.foot_springs import stiffness_of
from springfoot.envs.control.leg_controller import leg_curves
from springfoot.envs.control.reference_walk import rows
from springfoot.envs.settings import BipedSettings, settings_from, settings_to_json
from springfoot.gait.errors import SpringfootError

from .files import write_atomically

FORMAT_VERSION = 1
"""Version of the file layout; a reader refuses any other."""


VARIANCE_FLOOR = 1e-8
"""Added to each observation's variance before the root, as in stable-baselines3's VecNormalize."""


BEST, LAST = "best.safetensors", "last.safetensors"
"""Names of a run folder's policies: the one with the highest return in periodic evaluation, and the newest."""
RUN = "run.json"
"""Name of a run folder's record: configuration, evaluations, status."""


_MODEL_NUMBERS = (
    *("body_mass", "body_inertia", "body_pos", "body_ipos", "jnt_range", "jnt_actfrcrange", "dof_damping"),
    *("dof_armature", "geom_size", "geom_pos", "pair_friction", "pair_solref", "pair_solreffriction", "pair_solimp"),
    "actuator_gainprm",
)


@dataclass(frozen=True, kw_only=True, eq=False)
class Policy:
    """A deterministic policy: normalised observation -> tanh layers -> mean action, clipped to [-1, 1].

    Calling it maps observations (N, D), or one (D,), to actions (N, 4) or (4,), float32. The result of a row
    does not depend on the other rows. Raises `SpringfootError` for another width or for an observation that
    is not finite.
    """

    settings: BipedSettings
    """The task the policy was trained on."""
    fingerprint: dict[str, str]
    """What it was trained on, as `fingerprint` gives it."""
    weights: tuple[np.ndarray, ...]
    """Of each layer, shape (outputs, inputs)."""
    biases: tuple[np.ndarray, ...]
    """Of each layer, shape (outputs,)."""
    observation_mean: np.ndarray
    """Of the observations in training, shape (D,)."""
    observation_variance: np.ndarray
    """Of the observations in training, shape (D,)."""
    observation_clip: float = 10.0
    """Largest magnitude of a normalised observation."""

    @property
    def layer_sizes(self) -> list[int]:
        """Observation, hidden layers, actions."""
        return [self.weights[0].shape[1], *(len(bias) for bias in self.biases)]

    @property
    def header(self) -> dict[str, Any]:
        """What the file's header says, as plain JSON values."""
        return {
            "format_version": FORMAT_VERSION,
            "network": {
                "layer_sizes": self.layer_sizes,
                "activation": "tanh",
                "observation_clip": self.observation_clip,
                "variance_floor": VARIANCE_FLOOR,
            },
            "settings": settings_to_json(self.settings),
            "fingerprint": self.fingerprint,
        }

    def __call__(self, observation: np.ndarray) -> np.ndarray:
        """Mean actions (N, 4) in [-1, 1] for observations (N, D)."""
        rows = np.asarray(observation, dtype=np.float64)
        if rows.ndim not in (1, 2) or rows.shape[-1] != len(self.observation_mean):
            raise SpringfootError(f"observations must be (N, {len(self.observation_mean)}), got {rows.shape}")
        if not np.isfinite(rows).all():
            raise SpringfootError("observations must be finite, got NaN or infinity")
        deviation = np.sqrt(self.observation_variance + VARIANCE_FLOOR)
        rows = ((rows - self.observation_mean) / deviation).clip(-self.observation_clip, self.observation_clip)
        for layer, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            rows = np.tanh(rows) if layer else rows
            # einsum adds in the same order for any N; BLAS does not, and a batch must equal its rows alone.
            rows = np.einsum("...i,oi->...o", rows, weight.astype(np.float64), optimize=False) + bias
        return rows.clip(-1.0, 1.0).astype(np.float32)


def fingerprint(biped: Biped) -> dict[str, str]:
    """SHA-256 of what a policy relies on: its `observation`, its `action`, the compiled `model`, and the `legs`.

    The legs are the constants of hips, knees and foot springs and the curves they follow, at every tabulated speed.
    Numbers count to six significant digits, so that compilers and processors agree.
    """
    model, probe = biped.model, np.array([[-1.0, -1.0], [0.0, 0.0], [1.0, 1.0]])
    numbers: list[Any] = []
    for legs, walk in rows(biped.walks):
        curves = (leg_curves(legs, walk), *foot_curves(biped.settings, legs, walk))
        numbers += [*asdict(legs).values(), *(curve[::50] for curve in curves)]
    return {
        "observation": _digest(biped.observation_names, biped.observation_low, biped.observation_high),
        "action": _digest(biped.action_names, stiffness_of(probe, biped.settings, biped.body)),
        "model": _digest(_MODEL_NUMBERS, *(getattr(model, name) for name in _MODEL_NUMBERS), [model.opt.timestep]),
        "legs": _digest(asdict(biped.constants[0]), *numbers),
    }


def _digest(names: Iterable[str], *numbers: Any) -> str:
    values = np.concatenate([np.ravel(item).astype(np.float64) for item in numbers])
    values[np.abs(values) < 1e-9] = 0.0  # rounding noise has no significant digits
    return hashlib.sha256(" ".join([*names, *(f"{value:.6g}" for value in values)]).encode()).hexdigest()


def save_policy(path: str | Path, policy: Policy) -> None:
    """Write a policy as one .safetensors file, whole or not at all; equal policies give equal bytes."""
    tensors = {
        "observation.mean": policy.observation_mean,
        "observation.variance": policy.observation_variance,
    }
    for layer, (weight, bias) in enumerate(zip(policy.weights, policy.biases, strict=True)):
        tensors |= {f"layer.{layer}.weight": weight, f"layer.{layer}.bias": bias}
    packed = {name: np.ascontiguousarray(tensor) for name, tensor in tensors.items()}
    header = {"springfoot": json.dumps(policy.header, sort_keys=True, allow_nan=False)}
    write_atomically(Path(path), to_safetensors(packed, header))


def find_policy(name: str | Path) -> Path:
    """The file that a path, a run folder (its best) or `pretrained` means; `SpringfootError` if there is none."""
    path = Path(name)
    if str(name) == "pretrained":
        path = Path(str(resources.files("springfoot.agents") / "pretrained" / "walk.safetensors"))
        if not path.is_file():
            raise SpringfootError("this installation of springfoot has no pretrained policy; train one: train.py")
    elif path.is_dir():
        if not (path / BEST).is_file():
            raise SpringfootError(f"{name} is a folder without {BEST}, so not a run of train.py")
        path /= BEST
    elif not path.is_file():
        raise SpringfootError(f"no policy {name}: give a .safetensors file, a run folder or 'pretrained'")
    return path


def load_policy(name: str | Path) -> Policy:
    """The policy in a file, a run folder (its best) or `pretrained`, checked against this springfoot.

    Raises `SpringfootError`, one line, if the file is missing, no .safetensors file, not of springfoot, of
    another format version, incomplete or not finite, or made for other spaces, another model or other legs than
    this version has.
    """
    path = find_policy(name)
    header, tensors = read_tensors(path, "springfoot", "policy")
    if header.get("format_version") != FORMAT_VERSION:
        raise SpringfootError(
            f"{name} has policy format {header.get('format_version')!r}, this version reads {FORMAT_VERSION}"
        )
    try:
        network, values = header["network"], header["settings"]
        clip, sizes = float(network["observation_clip"]), list(network["layer_sizes"])
        stored = dict(header["fingerprint"])
        settings = settings_from(**values)
        biped = Biped(settings, 1)
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        what = f"has no {error}" if isinstance(error, KeyError) else f"is not valid: {error}"
        raise SpringfootError(f"{name}: its header {what}") from None
    if network.get("activation") != "tanh" or network.get("variance_floor") != VARIANCE_FLOOR or not clip > 0:
        raise SpringfootError(f"{name}: its header asks for a network this version does not have: {network}")
    if len(sizes) < 2 or (sizes[0], sizes[-1]) != (len(biped.observation_names), len(biped.action_names)):
        raise SpringfootError(f"{name}: its layers {sizes} do not lead from observation to action")
    _check_tensors(name, tensors, sizes)
    current = fingerprint(biped)
    if different := [part for part in current if current[part] != stored.get(part)]:
        raise SpringfootError(
            f"{name} was trained on another version of this environment: other {' and '.join(different)}; "
            "train it again, or use the version of springfoot it came from"
        )
    layers = range(len(sizes) - 1)
    return Policy(
        settings=settings,
        fingerprint=current,
        weights=tuple(tensors[f"layer.{layer}.weight"] for layer in layers),
        biases=tuple(tensors[f"layer.{layer}.bias"] for layer in layers),
        observation_mean=tensors["observation.mean"],
        observation_variance=tensors["observation.variance"],
        observation_clip=clip,
    )


def read_tensors(path: Path, key: str, what: str) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """The JSON under `key` of a .safetensors header, and the tensors, all finite; else `SpringfootError`."""
    try:
        with safe_open(path, framework="numpy") as file:
            text = (file.metadata() or {}).get(key)
            if text is None:
                raise SpringfootError(f"{path} is a .safetensors file, but no springfoot {what}")
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        header = json.loads(text)
    except (SafetensorError, OSError, TypeError, AttributeError) as error:
        raise SpringfootError(f"{path} is not a .safetensors file: {error}") from None
    except (json.JSONDecodeError, RecursionError) as error:
        raise SpringfootError(f"{path}: the springfoot entry of its header is not JSON: {error}") from None
    if not isinstance(header, dict):
        raise SpringfootError(f"{path}: the springfoot entry of its header is not a JSON object")
    for tensor_name, tensor in tensors.items():
        if tensor.dtype not in (np.float32, np.float64) or not np.isfinite(tensor).all():
            raise SpringfootError(f"{path}: {tensor_name} must be finite float32 or float64 numbers")
    return header, tensors


def _check_tensors(name: str | Path, tensors: dict[str, np.ndarray], sizes: list[int]) -> None:
    """Raise `SpringfootError` for tensors that are not those of the layer sizes."""
    expected = {"observation.mean": (sizes[0],), "observation.variance": (sizes[0],)}
    for layer, (inputs, outputs) in enumerate(pairwise(sizes)):
        expected |= {f"layer.{layer}.weight": (outputs, inputs), f"layer.{layer}.bias": (outputs,)}
    for tensor_name in sorted(set(expected) | set(tensors)):
        wanted = expected.get(tensor_name, "absent")
        found = tensors[tensor_name].shape if tensor_name in tensors else "absent"
        if found != wanted:
            raise SpringfootError(f"{name}: {tensor_name} must be {wanted}, is {found}")
    if (tensors["observation.variance"] < 0).any():
        raise SpringfootError(f"{name}: observation.variance must not be negative")
