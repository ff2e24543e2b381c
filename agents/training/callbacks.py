"""Let callbacks watch a training, and end it: stable-baselines3's callbacks, and functions of evaluations."""

from collections.abc import Callable, Sequence
from typing import Any

from stable_baselines3.common.callbacks import BaseCallback, CallbackList

Onlooker = BaseCallback | Callable[[dict[str, Any]], object]
"""A callback of stable-baselines3, or a function of each periodic evaluation as in run.json. Either ends the training
in good order by returning False."""


class Onlookers(CallbackList):
    """The training's own callback, then the onlookers; `stop` is called when an onlooker returns False."""

    def __init__(self, own: BaseCallback, others: Sequence[Onlooker], stop: Callable[[], object]) -> None:
        super().__init__([own, *(each for each in others if isinstance(each, BaseCallback))])
        self._stop = stop

    def _on_step(self) -> bool:
        own, *others = self.callbacks
        going = own.on_step()
        told = [other.on_step() for other in others]  # every one
        if not all(told):
            self._stop()
        return going and all(told)


def tell(onlookers: Sequence[Onlooker], evaluation: dict[str, Any]) -> bool:
    """Call the functions among the onlookers with an evaluation; return False if one of them ends the training."""
    functions = [each for each in onlookers if not isinstance(each, BaseCallback)]
    answers = [each(dict(evaluation)) for each in functions]
    return all(answer is not False for answer in answers)
