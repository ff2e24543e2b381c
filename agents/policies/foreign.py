"""Load policies from elsewhere, which take raw observations: an ONNX file, or a function that the user names.

An ONNX file is data, as a .safetensors file is: onnxruntime computes its graph and executes nothing else.
`module:function` is the user's own code, and runs because the user typed its name; no file or folder can ask for it.
"""

import json
import os
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from springfoot.arrays import NDArray
from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.physics.model import actions_of
from springfoot.envs.settings.settings import BipedSettings, settings_from
from springfoot.envs.task.observation_entries import OBSERVATION
from springfoot.errors import SpringfootError
from springfoot.files.json_file import MOST_JSON_BYTES
from springfoot.files.text_table import read_bytes

from .fingerprint import fingerprint, require_same
from .onnx_process import FORMS, INPUT_TYPES, form, one_line, onnx_session

CONTRACT_KEY = "springfoot"
"""Key of an ONNX file's metadata with the contract of an exported policy."""


def contract_path(path: Path) -> Path:
    """Return the path of a file's contract: walk.onnx.json beside walk.onnx."""
    return path.with_name(f"{path.name}.json")


def observation_rows(observation: Any, width: int) -> NDArray:
    """Return observations (N, D) or (D,) as float64 of the same shape.

    Raises `SpringfootError` unless D is `width`, and for numbers that are not finite.
    """
    rows = np.asarray(observation, dtype=np.float64)
    if rows.ndim not in (1, 2) or rows.shape[-1] != width:
        raise SpringfootError(f"observations must be (N, {width}), got {rows.shape}")
    if not np.isfinite(rows).all():
        raise SpringfootError("observations must be finite, got NaN or infinity")
    return rows


@dataclass(frozen=True, kw_only=True, eq=False)
class ForeignPolicy:
    """A policy from elsewhere, called like `Policy`: observations (N, D) or (D,) to actions in [-1, 1].

    Raises `SpringfootError` for bad observations, and if it returns other values than finite actions (N, A). Its last
    bits may differ with N.
    """

    name: str
    """Name in errors."""
    settings: BipedSettings
    """Settings of its task: from its contract or the function's attribute `settings`, else the defaults."""
    width: int
    """Entries D of an observation."""
    act: Callable[[NDArray], Any]
    """Function of float32 observations (N, D) that returns actions (N, A), which are clipped to [-1, 1]."""

    def __call__(self, observation: np.ndarray) -> np.ndarray:
        """Return actions (N, A) in [-1, 1] for observations (N, D)."""
        rows = observation_rows(observation, self.width).astype(np.float32)
        batch = np.atleast_2d(rows)
        with _only_ordinary_errors(self.name):
            returned = self.act(batch)
        if np.iscomplexobj(returned):
            raise SpringfootError(f"{self.name} must return real actions, returned complex ones")
        expected = len(batch), len(actions_of(self.settings.acts))
        try:
            actions = np.asarray(returned)
        except (TypeError, ValueError):
            actions = np.array(None)  # no numbers: refused next
        if actions.dtype.kind not in "biuf":  # bool, whole numbers, floats
            raise SpringfootError(f"{self.name} must return actions {expected}, returned no numbers")
        if actions.shape != expected:
            raise SpringfootError(f"{self.name} must return actions {expected}, returned {actions.shape}")
        if not np.isfinite(actions).all():
            raise SpringfootError(f"{self.name} returned an action that is not finite")
        return actions.astype(np.float64).reshape(*rows.shape[:-1], -1).clip(-1.0, 1.0).astype(np.float32)


def onnx_policy(path: Path) -> ForeignPolicy:
    """Return the policy in an ONNX file, run by onnxruntime.

    The file has one input, the raw observation (N, D), (1, D) or (D,) in float32 or float64; the output `action`, else
    the first one, is the action. The policy's settings are those of the contract beside the file, else of the contract
    inside it (exported policies carry one), else the defaults. Raises `SpringfootError`, one line, if onnxruntime is
    missing, for a file that it does not run within the bounds of `onnx_process`, for other widths, and for a contract
    that is malformed or of another version of the environment.
    """
    try:
        import onnx  # noqa: F401  # not above: an extra
        import onnxruntime  # noqa: F401  # likewise
    except ModuleNotFoundError as error:
        raise SpringfootError(f"{path} needs the package {error.name}: pip install 'springfoot[onnx]'") from None
    session, _ = onnx_session(path, np.zeros((2, len(OBSERVATION))))  # the real ones follow, of its environment
    inputs = session.get_inputs()
    outputs = [output.name for output in session.get_outputs()]
    if len(inputs) != 1:
        names = ", ".join(node.name for node in inputs) or "none"
        raise SpringfootError(f"{path} has the inputs {names}; a policy has one, the observation")
    (node,) = inputs
    if node.type not in INPUT_TYPES:
        raise SpringfootError(f"{path}: its input must be of float32 or float64, is {node.type}")
    biped = _environment_of(path, session.get_modelmeta().custom_metadata_map.get(CONTRACT_KEY))
    width = len(biped.observation_names)
    if len(node.shape) not in (1, 2) or (isinstance(node.shape[-1], int) and node.shape[-1] != width):
        raise SpringfootError(f"{path}: its input must be (N, {width}), is ({', '.join(map(str, node.shape))})")
    session, failed = onnx_session(path, _first_observations(biped))
    if len(failed) == len(FORMS):
        raise SpringfootError(f"{path} fails on observations (2, {width}): {failed[FORMS[0]]}")
    output = "action" if "action" in outputs else outputs[0]
    dtype = INPUT_TYPES[node.type]

    def act(observation: NDArray) -> Any:
        """Return the actions of the ONNX file for an observation in one of `FORMS`."""
        if (reason := failed.get(form(observation))) is not None:
            raise SpringfootError(reason)
        return session.run([output], {node.name: np.ascontiguousarray(observation, dtype)})[0]

    return _policy_calling(str(path), act, biped)


def is_function(name: str) -> bool:
    """Return True if a policy's name has the form `module:function` and is not that of a file."""
    return re.fullmatch(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*", name) is not None and not Path(name).exists()


def function_policy(name: str) -> ForeignPolicy:
    """Import a module and return the policy `module:function` of observations (N, D), (1, D) or (D,).

    The module is one that Python finds, else one in the current folder. An attribute `settings` of the function, a
    mapping or `BipedSettings`, describes its task. Raises `SpringfootError`, one line, if module or function are
    missing, and if it returns other values than finite actions (N, A) for the first observations of two episodes.
    """
    module_name, _, function_name = name.partition(":")
    if os.getcwd() not in sys.path:
        sys.path.append(os.getcwd())
    with _only_ordinary_errors(name):
        try:
            module = import_module(module_name)
        except Exception as error:  # whatever the user's module raises
            raise SpringfootError(f"{name}: cannot import {module_name}: {one_line(error)}") from error
        try:
            function = getattr(module, function_name, None)
            settings = getattr(function, "settings", None)
            if callable(function) and not isinstance(settings, BipedSettings):
                settings = settings_from(**(settings or {}))
        except Exception as error:  # whatever the user's properties raise
            raise SpringfootError(f"{name}: its settings: {one_line(error)}") from None
        if not callable(function):
            file = getattr(module, "__file__", None) or "it"
            raise SpringfootError(f"{name}: module {module_name} has no function {function_name} ({file})")
        return _policy_calling(name, function, Biped(settings or BipedSettings(), 1))


@contextmanager
def _only_ordinary_errors(name: str) -> Iterator[None]:
    """Raise `SpringfootError` if a user's code calls `sys.exit` or raises another error that is no `Exception`.

    Either would end our command without a message. Ctrl-C passes.
    """
    try:
        yield
    except SystemExit as error:
        raise SpringfootError(f"{name} calls sys.exit({error.code!r:.40}): a policy must return actions") from None
    except (Exception, KeyboardInterrupt):
        raise
    except BaseException as error:
        raise SpringfootError(f"{name} raises {type(error).__name__}: a policy must return actions") from None


def _environment_of(path: Path, inside: str | None) -> Biped:
    """Return the environment that an ONNX file was made for, as its contract says; the default one without a contract.

    The contract is the file beside it, else `inside`, the text in its metadata. Raises `SpringfootError` for a contract
    that is malformed, or of another version of the environment.
    """
    beside = contract_path(path)
    if inside is None and not beside.is_file():
        return Biped(BipedSettings(), 1)
    name = beside if beside.is_file() else f"{path}: the contract inside it"
    try:
        contract = json.loads(read_bytes(beside, MOST_JSON_BYTES) if beside.is_file() else inside or "")
        biped = Biped(settings_from(**contract["settings"]), 1)
        stored = None if contract.get("fingerprint") is None else dict(contract["fingerprint"])
    except (KeyError, TypeError, ValueError, RecursionError) as error:
        fault = f"has no {error}" if isinstance(error, KeyError) else f"is not a contract: {one_line(error)}"
        raise SpringfootError(f"{name} {fault}") from None
    if stored is not None:
        require_same(path, stored, fingerprint(biped))
    return biped


def _first_observations(biped: Biped) -> NDArray:
    """Return the first observation of each of two episodes, seeded 0 and 1, (2, D) float32; this resets `biped`."""
    observations = []
    for seed in range(2):
        biped.reset(np.array([0]), [seed])
        observations.append(biped.observe()[0])
    return np.stack(observations)


def _policy_calling(name: str, act: Callable[[NDArray], Any], biped: Biped) -> ForeignPolicy:
    """Return the policy `name` of a function `act` of observations (N, D), (1, D) or (D,), called in the first of these
    forms that works.

    Tries each form on the first observations of two episodes of `biped`. Raises `SpringfootError` if none returns
    actions of the right shape, and for actions that are not finite.
    """
    observations = _first_observations(biped)
    actions = len(biped.action_names)
    width = observations.shape[1]
    wrong_shape = ""  # messages of the first form that fails so
    failed = ""
    # The function as one of (N, D), the observation to try its form on, and the shape of actions that it must return.
    for act_on_rows, argument, expected in (
        (act, observations, (2, actions)),
        (lambda rows: np.concatenate([act(row[None]) for row in rows]), observations[:1], (1, actions)),
        (lambda rows: np.stack([act(row) for row in rows]), observations[0], (actions,)),
    ):
        try:
            shape = np.shape(act(argument))
        except Exception as error:  # whatever the user's function raises
            failed = failed or f"{name} fails on observations {argument.shape}: {one_line(error)}"
            continue
        if shape == expected:
            policy = ForeignPolicy(name=name, settings=biped.settings, width=width, act=act_on_rows)
            policy(observations)  # raises for actions that are not finite
            return policy
        wrong_shape = wrong_shape or (
            f"{name} must return actions {expected} for observations {argument.shape}, returned {shape}"
        )
    raise SpringfootError(wrong_shape or failed)
