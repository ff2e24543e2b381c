"""The walking model in MuJoCo, as Gymnasium environments; `import springfoot` registers them.

Settings need no simulator; MuJoCo and numba are imported at the first use of a name that walks.
"""

from typing import TYPE_CHECKING

from springfoot.lazy import lazy_names

from .settings.settings import BipedSettings, body_of, reference_gait, settings_from, settings_to_json

if TYPE_CHECKING:
    from .batch.biped_batch import Biped
    from .batch.step_result import TERMINATIONS
    from .env import SegmentedFootBiped
    from .vector_env import SegmentedFootBipedVector

__all__ = [
    "TERMINATIONS",
    "Biped",
    "BipedSettings",
    "SegmentedFootBiped",
    "SegmentedFootBipedVector",
    "body_of",
    "reference_gait",
    "settings_from",
    "settings_to_json",
]

_MODULE = {
    "Biped": "batch.biped_batch",
    "SegmentedFootBiped": "env",
    "SegmentedFootBipedVector": "vector_env",
    "TERMINATIONS": "batch.step_result",
}

if not TYPE_CHECKING:  # a type checker would take it to mean that any name exists
    __getattr__ = lazy_names(__name__, _MODULE)
