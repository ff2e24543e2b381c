"""Time a call of a kernel with plain tuples of arrays against named ones: `python -m benchmarks.named_tuples`.

It is why `springfoot.envs.batch.step_kernels` names its arrays inside the kernels and not at the call.
"""

from collections.abc import Callable
from timeit import repeat
from typing import Any

import numpy as np

from springfoot.envs import Biped, BipedSettings
from springfoot.envs.batch.step_kernels import Tables, next_window
from springfoot.envs.physics.simulation import Physics

CALLS = 2_000


def microseconds(call: Callable[[], object]) -> float:
    """Return the fastest of seven mean times of a call [µs]."""
    return min(repeat(call, number=CALLS, repeat=7)) / CALLS * 1e6


def main() -> None:
    """Print both times for one body."""
    biped: Any = Biped(BipedSettings(), 1)
    biped.reset(np.arange(1), [0])
    plain = biped._physics, biped._tables
    named = Physics(*biped._physics), Tables(*biped._tables)
    first = 0  # window of a step
    for name, (physics, tables) in (("plain", plain), ("named", named)):
        of_forces = biped._forces, first
        of_springs = biped._springs.options, np.ones(1, bool)
        arguments = biped.subjects.rows, physics, *of_forces, biped._control, tables, *of_springs
        next_window(*arguments)
        print(f"{name} tuples: {microseconds(lambda arguments=arguments: next_window(*arguments)):.1f} µs a call")


if __name__ == "__main__":
    main()
