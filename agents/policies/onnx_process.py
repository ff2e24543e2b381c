"""Open ONNX files: onnxruntime runs a file here only after it ran it in a process with bounds on memory and time."""

import json
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError
from springfoot.files.bounded_process import MOST_MEMORY, MOST_SECONDS, bound_resources, in_process

MOST_ONNX_BYTES = 2**26
"""Largest ONNX file to read; chosen, ten times the largest network that is trained here."""
INPUT_TYPES = {"tensor(float)": np.float32, "tensor(double)": np.float64}
"""Allowed types of the input."""

_CHILD = "from springfoot.agents.policies.onnx_process import main; main()"


def onnx_session(path: Path, observations: NDArray) -> tuple[Any, str]:
    """Return onnxruntime's session of a file, and the reason why it takes none of the `observations` (N, D), else "".

    A child process opens the file and runs it on them first: the time and the memory that a graph takes may depend on
    the numbers that it is given. Raises `SpringfootError` for a file that onnxruntime does not open, or not within the
    bounds.
    """
    if (size := path.stat().st_size) > MOST_ONNX_BYTES:
        raise SpringfootError(f"{path} must have at most {MOST_ONNX_BYTES:,} bytes, has {size:,}")
    said = in_process(_CHILD, str(path.absolute()), json.dumps(np.asarray(observations, float).tolist()))
    if said is None:
        raise SpringfootError(
            f"{path} is damaged: onnxruntime crashed on it, or took over {MOST_SECONDS} s or {MOST_MEMORY // 2**20} MiB"
        )
    found = json.loads(said)
    if found["refused"]:
        raise SpringfootError(f"{path} is not an ONNX file that onnxruntime runs: {found['refused']}")
    return _session(path), found["fails"]


def _session(path: Path) -> Any:
    """Open a file with onnxruntime, on one thread."""
    import onnxruntime  # not above: an extra

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1  # more would compete with the physics'
    options.log_severity_level = 4  # errors are raised, and told
    return onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])


def main() -> None:
    """Run the child: open the file that the command line names, run it once, print the reason if it failed."""
    import onnxruntime  # noqa: F401  # before the bounds

    out = os.dup(1)
    os.dup2(2, 1)  # what a library prints is not ours
    bound_resources()
    found = {"refused": "", "fails": ""}
    try:
        session = _session(Path(sys.argv[1]))
    except Exception as error:  # its classes have no common one
        found["refused"] = one_line(error)
    else:
        found["fails"] = _fails(session, np.array(json.loads(sys.argv[2])))
    os.write(out, json.dumps(found).encode())


def _fails(session: Any, observations: NDArray) -> str:
    """Return the reason why a session takes neither several observations nor one; "" if it does."""
    inputs = session.get_inputs()
    failed = ""
    if len(inputs) != 1 or inputs[0].type not in INPUT_TYPES:
        return failed  # the parent says so
    for rows in (observations, observations[:1], observations[0]):
        try:
            session.run(None, {inputs[0].name: np.ascontiguousarray(rows, INPUT_TYPES[inputs[0].type])})
        except Exception as error:
            failed = failed or one_line(error)
        else:
            return ""
    return failed


def one_line(error: Exception) -> str:
    """Return an error as a part of a message."""
    text = " ".join(str(error).split())
    return text if isinstance(error, SpringfootError) else f"{type(error).__name__}: {text[:300]}"
