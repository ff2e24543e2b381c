"""Time a call of a kernel with plain tuples of arrays against named ones: `python -m benchmarks.named_tuples`.

It is why `springfoot.envs.batch.step_kernels` names its arrays inside the kernels and not at the call.
"""

from collections.abc import Callable
from timeit import repeat
from typing import Any

import numpy as np

from springfoot.envs import Biped, BipedSettings
from springfoot.envs.batch.step_kernels import EnvironmentRows, Tables, next_window
from springfoot.envs.physics.simulation import Physics

CALLS = 2_000


def microseconds(call: Callable[[], object]) -> float:
    """Return the fastest of seven mean times of a call [µs]."""
    return min(repeat(call, number=CALLS, repeat=7)) / CALLS * 1e6


def main() -> None:
    """Print both times for one body."""
    biped: Any = Biped(BipedSettings(), 1)
    biped.reset(np.arange(1), [0])
    plain = biped._rows, biped._physics, biped._tables
    named = EnvironmentRows(*plain[0]), Physics(*plain[1]), Tables(*plain[2])
    rest = biped._springs.options, 0, np.ones(1, bool)  # the first window of a step
    for name, arrays in (("plain", plain), ("named", named)):
        next_window(*arrays, *rest)
        print(f"{name} tuples: {microseconds(lambda arrays=arrays: next_window(*arrays, *rest)):.1f} µs a call")


if __name__ == "__main__":
    main()
