"""Step N bodies at once: the kernels of a step, its result and its exact state."""

from typing import TYPE_CHECKING

from springfoot.lazy import lazy_names

if TYPE_CHECKING:
    from .biped_batch import Biped
    from .step_result import Tick
    from .walk import walked_steps

__all__ = ["Biped", "Tick", "walked_steps"]

if not TYPE_CHECKING:  # a type checker would take it to mean that any name exists
    __getattr__ = lazy_names(
        __name__,
        {"Biped": "biped_batch", "Tick": "step_result", "walked_steps": "walk"},
    )
