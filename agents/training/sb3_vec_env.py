"""Adapt the batched environment to stable-baselines3, with the bits of the Gymnasium VectorEnv under it."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvStepReturn

from springfoot.envs.control.subjects import GIVEN
from springfoot.envs.vector_env import SegmentedFootBipedVector
from springfoot.errors import SpringfootError


class SegmentedFootBipedVecEnv(VecEnv):
    """`SegmentedFootBipedVector` with SAME_STEP autoreset as a stable-baselines3 `VecEnv`.

    Takes the same keyword arguments, `num_envs`, `num_threads` and every field of `BipedSettings`. Info dictionaries
    are empty except where an episode ended: there they have `terminal_observation`, `TimeLimit.truncated`, `episode`
    (`r` return, `l` steps; no VecMonitor is needed) and the values of that last step. `step_info` has the values of the
    last step for the whole batch, arrays (N,) by name.
    """

    def __init__(self, num_envs: int = 1, *, num_threads: int = 1, **settings: Any) -> None:
        self.env = SegmentedFootBipedVector(
            num_envs=num_envs, num_threads=num_threads, autoreset_mode=AutoresetMode.SAME_STEP, **settings
        )
        super().__init__(num_envs, self.env.single_observation_space, self.env.single_action_space)
        self.step_info: dict[str, np.ndarray] = {}
        self._actions = np.zeros((num_envs, len(self.env.biped.action_names)), np.float32)
        self._returns = np.zeros(num_envs)
        self._lengths = np.zeros(num_envs, int)

    def reset(self) -> np.ndarray:
        """Begin a new episode in every environment, with the seeds and options set since the last reset; return the
        first observations (N, D)."""
        options = _merge_options(self._options)
        observation, _ = self.env.reset(seed=self._seeds, options=options or None)
        self._reset_seeds()
        self._reset_options()
        self._returns[:] = 0.0
        self._lengths[:] = 0
        return observation

    def step_async(self, actions: np.ndarray) -> None:
        """Keep the actions (N, A) for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Return observations (N, D), rewards (N,), dones (N,) and infos; a new episode follows each ended one."""
        observation, reward, terminated, truncated, info = self.env.step(self._actions)
        done = terminated | truncated
        self._returns += reward
        self._lengths += 1
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        self.step_info = _step_values(info)
        if done.any():
            final = _step_values(
                info["final_info"]
            )  # of the last step; `info` already is that of the new episode's reset
            self.step_info = {name: np.where(done, last, info.get(name, last)) for name, last in final.items()}
            for i in np.flatnonzero(done):
                infos[i] = {name: values[i] for name, values in final.items()} | {
                    "terminal_observation": info["final_obs"][i],
                    "TimeLimit.truncated": bool(truncated[i] and not terminated[i]),
                    "episode": {"r": float(self._returns[i]), "l": int(self._lengths[i])},
                }
            self._returns[done] = 0.0
            self._lengths[done] = 0
        return observation, reward.copy(), done, infos  # PPO adds bootstrapped values to the rewards in place

    def state(self) -> dict[str, Any]:
        """Return the exact state between two steps: that of `Biped.state`, and return and length of the running
        episodes."""
        episodes = {"episode.return": self._returns.copy(), "episode.length": self._lengths.copy()}
        return self.env.biped.state() | episodes

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from `state`, as the method of that name returned it; raise `SpringfootError` for a state of other
        settings."""
        for name, present in (("episode.return", self._returns), ("episode.length", self._lengths)):
            if np.shape(state.get(name, ())) != present.shape:
                raise SpringfootError(f"the state does not fit: {name!r} must be {present.shape}")
        self.reset()  # an episode must be running in every environment; `restore` then replaces all of it
        self.env.biped.restore({name: values for name, values in state.items() if not name.startswith("episode.")})
        self._returns[:] = state["episode.return"]
        self._lengths[:] = state["episode.length"]

    def close(self) -> None:
        """Free the simulation and any window."""
        self.env.close()

    def get_images(self) -> Sequence[np.ndarray | None]:
        """Return one picture of each environment, None for each if the environment does not render."""
        return list(self.env.render() or [None] * self.num_envs)

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return the batch's attribute, once for each of `indices`: all environments share it."""
        value = getattr(self.env, attr_name)
        return [value for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Set an attribute of the whole batch; raise `SpringfootError` for a part of it."""
        self._require_all(indices, f"set {attr_name}")
        setattr(self.env, attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: VecEnvIndices = None, **method_kwargs: Any
    ) -> list[Any]:
        """Call a method of the whole batch once, and return its result for each environment."""
        self._require_all(indices, f"call {method_name}")
        return [getattr(self.env, method_name)(*method_args, **method_kwargs)] * self.num_envs

    def env_is_wrapped(self, wrapper_class: type, indices: VecEnvIndices = None) -> list[bool]:
        """Return False for each of `indices`: nothing wraps an environment inside the batch."""
        return [False for _ in self._get_indices(indices)]

    def _require_all(self, indices: VecEnvIndices, action: str) -> None:
        """Raise `SpringfootError` if `indices` leave environments out of an action such as "set NAME"."""
        if set(self._get_indices(indices)) != set(range(self.num_envs)):
            raise SpringfootError(f"cannot {action} for some environments only: the batch is one simulation")


def _merge_options(by_environment: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return the reset options of the batch, merged from those of each environment, `by_environment`.

    The options of `GIVEN` (bodies, speeds, feet) may differ between environments and become lists; all others must
    agree. Raises `SpringfootError` otherwise, and for an option of `GIVEN` that only some environments have.
    """
    merged, *others = (
        {name: value for name, value in options.items() if name not in GIVEN} for options in by_environment
    )
    if any(other != merged for other in others):
        raise SpringfootError(f"reset options other than {', '.join(GIVEN)} must be the same for all environments")
    for name in GIVEN:
        values = [options[name] for options in by_environment if name in options]
        if 0 < len(values) < len(by_environment):
            raise SpringfootError(f"reset option {name!r} must be given to all environments, or to none")
        if values:
            merged[name] = values
    return merged


def _step_values(info: dict[str, Any]) -> dict[str, np.ndarray]:
    """Return name -> values (N,) of a vector environment's `info`.

    Leaves out the masks (`_NAME`), and the last observations and infos of ended episodes (`final_NAME`).
    """
    return {name: values for name, values in info.items() if not name.startswith(("_", "final_"))}
