"""Many walks held against each other; each runs as `springfoot study NAME`."""

from typing import TYPE_CHECKING

from springfoot.lazy import lazy_names

if TYPE_CHECKING:
    from .base.study import Answer, Study, WalkingStudy
    from .springs.agreement import agreements
    from .springs.any_stiffness import any_stiffness, mean_springs, rebuilt
    from .springs.push_experiment import identified
    from .walks.bodies import draw_pairs, walk_pairs
    from .walks.comparison import contenders

__all__ = [
    "Answer",
    "Study",
    "WalkingStudy",
    "agreements",
    "any_stiffness",
    "contenders",
    "draw_pairs",
    "identified",
    "mean_springs",
    "rebuilt",
    "walk_pairs",
]

_MODULE = {
    "Answer": "base.study",
    "Study": "base.study",
    "WalkingStudy": "base.study",
    "agreements": "springs.agreement",
    "any_stiffness": "springs.any_stiffness",
    "contenders": "walks.comparison",
    "draw_pairs": "walks.bodies",
    "identified": "springs.push_experiment",
    "mean_springs": "springs.any_stiffness",
    "rebuilt": "springs.any_stiffness",
    "walk_pairs": "walks.bodies",
}

if not TYPE_CHECKING:  # a type checker would take it to mean that any name exists
    __getattr__ = lazy_names(__name__, _MODULE)
