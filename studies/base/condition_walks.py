"""Walk one policy under several conditions from the same starts, and keep the numbers of each walk."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from springfoot.agents.policies import PolicyFunction
from springfoot.envs import BipedSettings
from springfoot.envs.settings import FOOT_SETTINGS
from springfoot.evaluation.recording import Recording, policy_and_settings, record_feet

from .kept import Kept, known_as
from .study import OnProgress, WalkingStudy


@dataclass(frozen=True, kw_only=True)
class ConditionWalks:
    """How a study walks under conditions: their episodes, their measurements, and where that is kept."""

    study: WalkingStudy
    """The study, which says episodes, seeds and length."""
    measured: Callable[[Recording], dict[str, Any]]
    """Function that returns the numbers of a recording, as JSON values."""
    names: Sequence[str]
    """Names of the numbers: with others all walks are measured again."""
    kept: Kept
    """Numbers kept so far."""
    find: Callable[[str, dict[str, Any]], tuple[PolicyFunction, BipedSettings]] = policy_and_settings
    """Function that returns a policy by its name, and its settings from those given."""

    def walk(self, policy: str, conditions: Sequence[Mapping[str, Any]], progress: OnProgress) -> list[dict[str, Any]]:
        """Return the `measured` numbers of a policy's walk under each condition, in the order of `conditions`.

        A condition is settings that differ from the usual. Walks in `kept` are not walked again; conditions that differ
        in feet alone are walked side by side.
        """
        known = known_as(policy)
        numbers: dict[str, dict[str, Any]] = {}
        for but_feet in {str(without_feet(condition)): without_feet(condition) for condition in conditions}.values():
            alike = [condition for condition in conditions if without_feet(condition) == but_feet]
            questions = [
                [{**self.study.walked, "seconds": self.study.seconds}, known, condition, self.names]
                for condition in alike
            ]

            def make(
                missing: list[int],
                but_feet: Mapping[str, Any] = but_feet,
                alike: Sequence[Mapping[str, Any]] = alike,
            ) -> list[dict[str, Any]]:
                """Walk the conditions `alike` of the `missing` indices side by side; return their numbers."""
                act, settings = self.find(policy, {**but_feet, "episode_seconds": self.study.seconds})
                feet = [
                    {name: alike[index][name] for name in FOOT_SETTINGS if name in alike[index]} for index in missing
                ]
                recordings = record_feet(act, settings, feet, name=policy, progress=progress, **self.study.how)
                return [self.measured(recording) for recording in recordings]

            numbers |= zip(map(str, alike), self.kept.get_all(questions, make), strict=True)
        return [numbers[str(condition)] for condition in conditions]


def without_feet(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return `settings` without the feet of either side (`FOOT_SETTINGS`)."""
    return {name: value for name, value in settings.items() if name not in FOOT_SETTINGS}
