"""Open ONNX files: onnxruntime runs a file here only after it ran it in a process with bounds on memory and time."""

import json
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError
from springfoot.files.bounded_process import MOST_MEMORY, MOST_SECONDS, bound_resources, output_in_process

MOST_ONNX_BYTES = 2**26
"""Largest ONNX file to read; chosen, ten times the largest network that is trained here."""
INPUT_TYPES = {"tensor(float)": np.float32, "tensor(double)": np.float64}
"""Allowed types of the input."""
FORMS = ("(N, D)", "(1, D)", "(D,)")
"""Shapes in which observations are given to a network: several rows, one row, one without an axis of rows."""
REFUSED = {"Loop", "RandomNormal", "RandomNormalLike", "RandomUniform", "RandomUniformLike", "Multinomial", "Bernoulli"}
"""Operators that no policy needs, and with which two runs may take different time and memory."""

_CHILD = "from springfoot.agents.policies.onnx_process import main; main()"


def form(observation: NDArray) -> str:
    """Return the entry of `FORMS` that describes the shape of `observation`."""
    several_rows, one_row, without_rows = FORMS
    if observation.ndim == 1:
        return without_rows
    return one_row if len(observation) == 1 else several_rows


def onnx_session(path: Path, observations: NDArray) -> tuple[Any, dict[str, str]]:
    """Return onnxruntime's session of a file, and for each of `FORMS` in which it fails on `observations` (N, D), the
    reason.

    A child process with bounded time and memory opens the file and runs it on the observations first: time, memory and
    failures may depend on the numbers. Raises `SpringfootError` for a file that onnxruntime does not open, or not
    within the bounds.
    """
    if (size := path.stat().st_size) > MOST_ONNX_BYTES:
        raise SpringfootError(f"{path} must have at most {MOST_ONNX_BYTES:,} bytes, has {size:,}")
    output = output_in_process(_CHILD, str(path.absolute()), json.dumps(np.asarray(observations, float).tolist()))
    if output is None:
        raise SpringfootError(
            f"{path} is damaged: onnxruntime crashed on it, or took over {MOST_SECONDS} s or {MOST_MEMORY // 2**20} MiB"
        )
    result = json.loads(output)
    if result["refused"]:
        raise SpringfootError(f"{path} is not an ONNX file that onnxruntime runs: {result['refused']}")
    return _session(path), result["fails"]


def _session(path: Path) -> Any:
    """Return onnxruntime's session of the file `path`, on one thread."""
    import onnxruntime  # not above: an extra

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1  # more would compete with the physics'
    options.log_severity_level = 4  # fatal only: errors are raised anyway
    return onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])


def main() -> None:
    """Run the child process: open the file that the command line names, run it on the observations that follow, and
    print the reasons of refusal and failure as JSON."""
    import onnx  # before the bounds
    import onnxruntime  # noqa: F401  # likewise

    stdout = os.dup(1)
    os.dup2(2, 1)  # libraries print to standard error: standard output is for the result alone
    bound_resources()
    result: dict[str, Any] = {"refused": "", "fails": {}}
    try:
        session = _session(Path(sys.argv[1]))
        if refused := sorted(REFUSED & _operators(onnx.load(sys.argv[1], load_external_data=False))):
            raise SpringfootError(f"the operator {refused[0]} is not allowed in a policy")
    except Exception as error:  # onnxruntime's errors have no common class
        result["refused"] = one_line(error)
    else:
        result["fails"] = _failures(session, np.array(json.loads(sys.argv[2])))
    os.write(stdout, json.dumps(result).encode())


def _operators(model: Any) -> set[str]:
    """Return the names of a model's operators, also of those in its functions and in graphs within graphs."""
    names: set[str] = set()
    waiting = [*model.graph.node, *(node for function in model.functions for node in function.node)]
    while waiting:
        node = waiting.pop()
        names.add(node.op_type)
        for attribute in node.attribute:
            waiting += [inner for graph in (attribute.g, *attribute.graphs) for inner in graph.node]
    return names


def _failures(session: Any, observations: NDArray) -> dict[str, str]:
    """Return form -> error text of the `FORMS` in which a session fails on the observations (N, D).

    It runs on all rows together, on each row as (1, D), and on each as (D,). Empty for a session that has another
    number of inputs than one, or an input of another type.
    """
    inputs = session.get_inputs()
    failed: dict[str, str] = {}
    if len(inputs) != 1 or inputs[0].type not in INPUT_TYPES:
        return failed  # the parent says so
    for rows in (observations, *(row[None] for row in observations), *observations):
        try:
            session.run(None, {inputs[0].name: np.ascontiguousarray(rows, INPUT_TYPES[inputs[0].type])})
        except Exception as error:
            failed[form(rows)] = one_line(error)
    return failed


def one_line(error: Exception) -> str:
    """Return an error's text in one line; of an error that is not our own its class, and at most 300 characters."""
    text = " ".join(str(error).split())
    return text if isinstance(error, SpringfootError) else f"{type(error).__name__}: {text[:300]}"
