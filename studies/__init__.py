"""Many walks held against each other; each runs as `springfoot study NAME`."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from springfoot.extras import naming_extras

if TYPE_CHECKING:
    from .body_sweep import draw_pairs, walk_pairs
    from .comparison import contenders
    from .constant_search import best_constant
    from .identifiability import any_stiffness, mean_springs, rebuilt
    from .push_experiment import identified
    from .seed_agreement import agreements
    from .study import Answer, Study, WalkingStudy

__all__ = [
    "Answer",
    "Study",
    "WalkingStudy",
    "agreements",
    "any_stiffness",
    "best_constant",
    "contenders",
    "draw_pairs",
    "identified",
    "mean_springs",
    "rebuilt",
    "walk_pairs",
]

_MODULE = {
    "Answer": "study",
    "Study": "study",
    "WalkingStudy": "study",
    "agreements": "seed_agreement",
    "any_stiffness": "identifiability",
    "best_constant": "constant_search",
    "contenders": "comparison",
    "draw_pairs": "body_sweep",
    "identified": "push_experiment",
    "mean_springs": "identifiability",
    "rebuilt": "identifiability",
    "walk_pairs": "body_sweep",
}

if not TYPE_CHECKING:  # a type checker would take it to mean that any name exists

    def __getattr__(name: str) -> Any:
        if name not in _MODULE:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        with naming_extras():
            return getattr(import_module(f"{__name__}.{_MODULE[name]}"), name)
