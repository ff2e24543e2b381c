"""N of `SegmentedFootBiped` in one batched simulation, as a Gymnasium `VectorEnv`."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from gymnasium.spaces import Space
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from springfoot.arrays import NDArray
from springfoot.errors import MOST_THREADS, SpringfootError, require_count

from .batch.biped_batch import Biped
from .batch.step_result import INFO, StepResult, report_start
from .gym_face import METADATA, Face, check_options, check_render_mode, given_subjects, spaces_of
from .settings.checks import MOST_ENVIRONMENTS, check_seed
from .settings.feet import foot_pairs
from .settings.settings import BipedSettings, settings_from

_NAMES = (*INFO, "termination")
_MASKS = tuple(f"_{name}" for name in _NAMES)


class SegmentedFootBipedVector(  # pyright: ignore[reportIncompatibleVariableOverride]
    Face, VectorEnv[NDArray, NDArray, NDArray]
):
    """N of `SegmentedFootBiped` in one batched simulation: same settings, spaces, rewards and bits.

    Environment i of a vector seeded with s equals `SegmentedFootBiped` seeded with s + i. Its info comes as arrays (N,)
    by name, each with Gymnasium's mask `_name` (N,) of valid entries. `biped.model_of(i)` is its MuJoCo
    model, `biped.data(i)` a copy of its state.

    Args:
        num_envs: number N of environments.
        autoreset_mode: `AutoresetMode` or its value: "NextStep" (the step after an episode's last one ignores the
            action and resets), "SameStep" (`final_obs`, `final_info` in the info), "Disabled"
            (`reset(options={"reset_mask": mask})` by the caller).
        num_threads: threads of the physics; any number gives the same bits.
        max_episode_steps: number of steps after which an episode is truncated, if `episode_seconds` is longer;
            `spec.max_episode_steps` is the lesser of the two.
        render_mode: "rgb_array" (a frame of each environment), "human" (a window that shows the first) or None.
        settings: as for `SegmentedFootBiped`; `left_foot` and `right_foot` may be lists, a foot for each of the N, and
            `settings` then has the first ones.
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        render_mode: str | None = None,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        num_threads: int = 1,
        max_episode_steps: int | None = None,
        **settings: Any,
    ) -> None:
        require_count("num_envs", num_envs, most=MOST_ENVIRONMENTS)
        require_count("num_threads", num_threads, most=MOST_THREADS)
        settings_of_all, feet = foot_pairs(settings, num_envs)
        self.settings = _limit_steps(settings_from(**settings_of_all), max_episode_steps)
        self.num_envs = num_envs
        self.render_mode = check_render_mode(render_mode)
        self.autoreset_mode = _autoreset_mode(autoreset_mode)
        self.biped = Biped(self.settings, num_envs, num_threads, feet=feet)
        self.metadata = METADATA | {"autoreset_mode": self.autoreset_mode, "render_fps": round(1 / self.biped.dt)}
        self.single_observation_space, self.single_action_space = spaces_of(self.biped)
        self.observation_space: Space[NDArray] = batch_space(self.single_observation_space, num_envs)
        self.action_space: Space[NDArray] = batch_space(self.single_action_space, num_envs)
        self._seeds = [-1] * num_envs  # Gymnasium's number for an unknown seed
        self._over = np.ones(num_envs, bool)
        self._started = False

    @property
    def np_random(self) -> tuple[np.random.Generator | None, ...]:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Return the generator of each environment; None before its first reset."""
        return tuple(self.biped.generators)

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Return the seed of each environment's generator; -1 before its first reset."""
        return tuple(self._seeds)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray, dict[str, Any]]:
        """Start episodes in all environments, or in those of `options["reset_mask"]`, a bool array (N,).

        A `seed` s gives environment i the seed s + i; a list gives each environment its own. Other `options` are as in
        the Env; `height`, `mass`, `speed` and `body` may also be (N,) arrays, feet a list of N.
        """
        chosen = check_options(options, ("reset_mask",))
        given = given_subjects(chosen, self.num_envs)
        mask = self._reset_mask(chosen.get("reset_mask"))
        ids = np.flatnonzero(mask)
        seeds = self._seeds_of_all(seed)
        generators = self.biped.generators
        for index in ids.tolist():
            if seeds[index] is not None or generators[index] is None:
                generators[index], self._seeds[index] = seeding.np_random(seeds[index])
        self._restart(ids, chosen.get("start"), given)
        self._over[ids] = False
        if self.render_mode == "human":
            self.render()
        return self.biped.observe(), _infos(self._start_values(), np.zeros(self.num_envs, int), mask)

    def step(self, actions: NDArray) -> tuple[NDArray, NDArray, NDArray, NDArray, dict[str, Any]]:
        """Hold the values set by `actions` (N, A), the stiffnesses by default, during a step, 20 ms by default.

        Environments with an ended episode are reset as `autoreset_mode` says: in this step in place of a step of their
        own, or with "SameStep" at the end of the step in which it ends.
        """
        self._check_running()
        resetting = self._over
        same_step = self.autoreset_mode is AutoresetMode.SAME_STEP
        result = self.biped.step(actions, active=~resetting if np.count_nonzero(resetting) else None)
        ended = result.terminated | result.truncated
        if same_step:
            resetting = ended
        else:
            self._over = ended
        if np.count_nonzero(resetting):
            final = _final_infos(result, ended) if same_step else {}
            self._restart(np.flatnonzero(resetting))
            observation = self.biped.observe()
            values = np.where(resetting[:, None], self._start_values(), result.values)
            infos = _infos(values, np.where(resetting, 0, result.termination)) | final
        else:
            observation = result.observation
            infos = _infos(result.values, result.termination.copy())
        if self.render_mode == "human":
            self.render()
        return observation, result.reward, result.terminated, result.truncated, infos

    def render(self) -> Any:
        """Return a tuple of N frames, uint8 (480, 640, 3); "human" draws the first environment and gives None."""
        camera = self._camera_for()
        biped = self.biped
        if self.render_mode == "human":
            return camera.show(biped.data(0), biped.model_of(0))
        return tuple(camera.show(biped.data(index), biped.model_of(index)) for index in range(self.num_envs))

    def close_extras(self, **_: Any) -> None:
        """Close the window, if any."""
        self._close_camera()

    def _start_values(self) -> NDArray:
        """Return the numbers of the info right after a reset, (N, len(INFO)), as `StepResult.values`."""
        return report_start(self.biped.measurement, self.biped.leg_phase, self.biped.controlled)

    def _restart(
        self, ids: NDArray, start: float | str | None = None, given: Mapping[str, NDArray] | None = None
    ) -> None:
        """Begin episodes in environments `ids` (K,); `start` is the option of a reset, None for the setting.

        `given` is name of `GIVEN` -> (N,) values in place of drawn ones.
        """
        given = {name: values[ids] for name, values in (given or {}).items()}
        self.biped.reset(ids, [None] * len(ids), start, given)  # each goes on with its generator

    def _check_running(self) -> None:
        """Raise `SpringfootError` if an environment has to be reset before it can step."""
        if self._started and self.autoreset_mode is not AutoresetMode.DISABLED:
            return
        waiting = np.array([generator is None for generator in self.biped.generators])
        if self.autoreset_mode is AutoresetMode.DISABLED:
            waiting |= self._over
        if waiting.any():
            which = ", ".join(map(str, np.flatnonzero(waiting)))
            raise SpringfootError(f"no episode is running in environments {which}: call reset() before step()")
        self._started = True

    def _seeds_of_all(self, seed: int | Sequence[int | None] | None) -> Sequence[int | None]:
        """Return N seeds from the argument `seed` of a reset: None for all, s + i for an integer s, or those of a
        list."""
        if seed is None:
            return [None] * self.num_envs
        if not isinstance(seed, (Sequence, np.ndarray)) or isinstance(seed, str):
            first = check_seed(seed) or 0  # `or 0` is for the type alone: it is not None here
            return [first + index for index in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise SpringfootError(f"seed must be an integer or a list of {self.num_envs}, got {len(seed)} seeds")
        return [check_seed(one_seed) for one_seed in seed]

    def _reset_mask(self, mask: Any) -> NDArray:
        """Return the mask (N,) of a reset, checked; True everywhere for None."""
        if mask is None:
            return np.ones(self.num_envs, bool)
        if not isinstance(mask, np.ndarray) or mask.dtype != bool or mask.shape != (self.num_envs,) or not mask.any():
            raise SpringfootError(
                f"reset_mask must be a bool array of shape ({self.num_envs},) with at least one True, got {mask!r}"
            )
        return mask


def _infos(values: NDArray, termination: NDArray, mask: NDArray | None = None) -> dict[str, Any]:
    """Return a vector's info in Gymnasium's form: arrays by name, and for each a mask `_name` of valid entries.

    Args:
        values: (N, len(INFO)) as `StepResult.values`; the infos are views of it.
        termination: (N,) codes, not copied.
        mask: (N,) valid entries, all if None; other entries are 0.
    """
    if mask is None:
        mask = np.ones(len(values), bool)
    else:
        values = np.where(mask[:, None], values, 0.0)
        termination = np.where(mask, termination, 0)
        mask = mask.copy()
    mask.flags.writeable = False  # all names share it
    infos: dict[str, Any] = dict.fromkeys(_MASKS, mask)
    infos.update(zip(_NAMES, (*values.T, termination), strict=True))
    return infos


def _final_infos(result: StepResult, ended: NDArray) -> dict[str, Any]:
    """Return the last observation and info of the episodes that ended in this step, in Gymnasium's form.

    `ended` (N,) is their mask; environments that go on have None for an observation.
    """
    last = np.full(len(ended), None, dtype=object)
    for index in np.flatnonzero(ended):
        last[index] = result.observation[index].copy()
    return {
        "final_obs": last,
        "_final_obs": ended.copy(),
        "final_info": _infos(result.values, result.termination, ended),
        "_final_info": ended.copy(),
    }


def _autoreset_mode(mode: str | AutoresetMode) -> AutoresetMode:
    """Return the autoreset mode of this value; raise `SpringfootError` for an unknown one."""
    try:
        return AutoresetMode(mode)
    except ValueError:
        valid = ", ".join(repr(choice.value) for choice in AutoresetMode)
        raise SpringfootError(f"autoreset_mode must be one of {valid}, got {mode!r}") from None


def _limit_steps(settings: BipedSettings, max_episode_steps: int | None) -> BipedSettings:
    """Return settings with episodes of `max_episode_steps` at most, None for no such limit.

    Gymnasium puts no TimeLimit around a vector entry point, so the limit becomes one of `episode_seconds`.
    """
    if max_episode_steps is None:
        return settings
    limit = require_count("max_episode_steps", max_episode_steps) * settings.step_seconds
    return replace(settings, episode_seconds=min(settings.episode_seconds, limit))
