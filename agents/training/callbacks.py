"""Let callbacks follow a training and end it: stable-baselines3's callbacks, and functions of evaluations."""

from collections.abc import Callable, Sequence
from typing import Any

from stable_baselines3.common.callbacks import BaseCallback, CallbackList

UserCallback = BaseCallback | Callable[[dict[str, Any]], object]
"""A callback of stable-baselines3, or a function called after each periodic evaluation with its entry of run.json.
Either ends the training in good order by returning False."""


class SessionAndUserCallbacks(CallbackList):
    """Call the session's callback and then the user's at every step; call `stop` if one of the user's returns False."""

    def __init__(
        self, session: BaseCallback, user_callbacks: Sequence[UserCallback], stop: Callable[[], object]
    ) -> None:
        super().__init__([session, *(callback for callback in user_callbacks if isinstance(callback, BaseCallback))])
        self._stop = stop

    def _on_step(self) -> bool:
        """Call every callback; return False to end the training."""
        session, *others = self.callbacks
        session_continues = session.on_step()
        others_continue = [callback.on_step() for callback in others]  # all are called, also after a False
        if not all(others_continue):
            self._stop()
        return session_continues and all(others_continue)


def call_with_evaluation(user_callbacks: Sequence[UserCallback], evaluation: dict[str, Any]) -> bool:
    """Call the functions among the callbacks with an evaluation, its entry of run.json; return False if one of them
    returned False, to end the training."""
    functions = [callback for callback in user_callbacks if not isinstance(callback, BaseCallback)]
    answers = [function(dict(evaluation)) for function in functions]
    return all(answer is not False for answer in answers)
