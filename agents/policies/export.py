"""Exported policies: one file that runs without springfoot, and its contract; normalisation and scaling inside."""

import json
from importlib import resources
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from springfoot.errors import SpringfootError
from springfoot.extras import EXTRA_OF
from springfoot.files.writing import require_new_files, write_new

from .contract import Scale, contract_of, scale_of
from .foreign import contract_path
from .policy import Policy

FORMATS = {"onnx": ".onnx", "torch": ".pt2", "numpy": ".npz"}
"""Formats, and how their files' names end."""


def export_policy(policy: Policy, out: str | Path, to: str) -> list[Path]:
    """Write a policy for use without springfoot; returns the new files.

    Args:
        policy: of this version (`read_policy`).
        out: new file, ending as `FORMATS` says. Beside it appear its contract, OUT.json, and for `numpy` the player
            play_STEM.py.
        to: `onnx` (any ONNX runtime), `torch` (`torch.export.load`) or `numpy` (an .npz without objects).

    Each takes the raw observation (N, D) and returns the action (N, 4) and the stiffness it sets (`Scale`); onnx and
    torch in float32, a trained policy's actions within 1e-5 of its own, numpy in float64. Raises `SpringfootError`,
    with nothing written, for another format or ending, for files that exist, and without the package that it needs.
    """
    files = planned_files(out, to)
    scale, contract = scale_of(policy.settings), json.dumps(contract_of(policy), indent=1, allow_nan=False) + "\n"
    try:
        content = {"onnx": _onnx, "torch": _torch, "numpy": _numpy}[to](policy, scale, contract)
    except ModuleNotFoundError as error:
        extra = EXTRA_OF.get(error.name or "", to)
        raise SpringfootError(f"to {to} needs the package {error.name}: pip install 'springfoot[{extra}]'") from None
    player = [(resources.files("springfoot.agents.policies") / "numpy_player.py").read_bytes()] if to == "numpy" else []
    write_new(dict(zip(files, [content, contract.encode(), *player], strict=True)))
    return files


def planned_files(out: str | Path, to: str) -> list[Path]:
    """The files of an export: policy, contract, for `numpy` the player; `SpringfootError` if one exists already."""
    out = Path(out)
    if to not in FORMATS:
        raise SpringfootError(f"to must be one of {', '.join(FORMATS)}, got {to!r}")
    if out.suffix != FORMATS[to]:
        raise SpringfootError(f"out must end in {FORMATS[to]} for {to}, got {out}")
    files = [out, contract_path(out)]
    if to == "numpy":
        files.append(out.with_name(f"play_{out.stem}.py"))
    require_new_files(files)
    return files


def _onnx(policy: Policy, scale: Scale, contract: str) -> bytes:
    from .onnx_graph import onnx_bytes

    return onnx_bytes(policy, scale, contract)


def _torch(policy: Policy, scale: Scale, contract: str) -> bytes:
    from .torch_program import torch_bytes

    return torch_bytes(policy, scale)


def _numpy(policy: Policy, scale: Scale, contract: str) -> bytes:
    arrays: dict[str, Any] = {
        "mean": policy.observation_mean,
        "deviation": policy.observation_deviation,
        "clip": np.array(np.inf if policy.observation_clip is None else policy.observation_clip),
        "activation": np.array(policy.activation),
        "output": np.array(policy.output),
        "layer_sizes": np.array(policy.layer_sizes),
        "joints": np.array(scale.joints),
        "middle": scale.middle,
        "factor": scale.factor,
    }
    for layer, (weight, bias) in enumerate(zip(policy.weights, policy.biases, strict=True)):
        arrays |= {f"weight_{layer}": weight, f"bias_{layer}": bias}
    file = BytesIO()
    np.savez(file, **arrays)
    return file.getvalue()
