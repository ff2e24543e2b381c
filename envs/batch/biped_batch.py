"""Step N walking bodies with actions of ankle and toe stiffness; the Gymnasium environments stand on this batch.

One step lasts 20 ms, or as the setting `decisions` says. The action sets the stiffness, which is held for all control
windows of 10 ms in the step; in each window the springs' rest angles, the hips and the knees follow the phase. Row i of
every array depends on environment i alone, by the same operations for any N: a batch of N gives the bits of N batches
of one.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError

from ..control.constants import LegConstants, slope_constants
from ..control.decision_times import DecisionTimes
from ..control.equilibrium import foot_tables
from ..control.legs import LegController, slope_table
from ..control.person_actions import PersonActions
from ..control.reference_walk import reference_walks, rows
from ..control.standing import WALKING, Standing, off_phase
from ..control.stiffness_control import FootSprings, draw_delay
from ..control.stiffness_source import StiffnessSource
from ..control.subjects import Subjects
from ..control.worn_feet import WornFeet
from ..physics.contact import CONTACTS
from ..physics.foot import Feet
from ..physics.measurement import Measurement
from ..physics.model import ACTIONS, JOINTS, PERSON_ACTIONS, SIDES, actions_of
from ..physics.simulation import MjData, MjModel, Simulation
from ..physics.timing import CONTROL_WINDOW, WINDOWS_PER_ACTION_STEP
from ..settings.checks import real_numbers
from ..settings.drawn import OWN_FEET
from ..settings.settings import TUNED, BipedSettings, settings_of_bodies
from ..task.episode_end import reasons_of
from ..task.ground import Ground
from ..task.initial_state import place, random_phase, start_table, walking_posture
from ..task.observation import SensorNoise
from ..task.observation_entries import PERSON_OBSERVATION
from ..task.pushes import Pushes
from ..task.reward import Task
from .exact_state import ExactState
from .learned_person import LearnedPerson
from .step_kernels import Tables, begin_step, begin_window, end_step, end_window, next_window
from .step_result import StepResult, Tick, empty_outcome, stiffness_and_rest


class Biped(ExactState):
    """N bodies in one task.

    Args:
        settings: the task, the same for all N.
        num_envs: number N of bodies.
        num_threads: threads of the physics; any number gives the same bits.
        legs: V sets of leg constants in place of the committed one.
        variant: (N,) index into `legs` of each body's set.
        rest: (V, SAMPLES, 2) rest angles of the foot springs in place of the settings' [rad], one for each of `legs`.
        model: a custom model, as for `Simulation`.
        feet: N pairs, the feet of each body in place of the settings' `left_foot` and `right_foot`.
    """

    tick_dt = CONTROL_WINDOW

    def __init__(
        self,
        settings: BipedSettings,
        num_envs: int,
        num_threads: int = 1,
        legs: Sequence[LegConstants] | None = None,
        variant: NDArray | None = None,
        rest: NDArray | None = None,
        model: MjModel | None = None,
        feet: Sequence[Feet] | None = None,
    ):
        # A copy of the batch is made of these arguments (`ExactState`).
        self._arguments = {"settings": settings, "num_envs": num_envs, "num_threads": num_threads, "legs": legs}
        self._arguments |= {"variant": variant, "rest": rest, "model": model, "feet": feet}
        self.settings = settings
        self.num_envs = num_envs
        self.dt = settings.step_seconds
        """Time of one step [s]."""
        self.windows_per_step = round(self.dt / CONTROL_WINDOW)
        """Control windows in one step."""
        self.on_tick: Callable[[Tick], None] | None = None
        self._acts_on_stiffness = settings.acts != "person"
        self._acts_as_person = settings.acts != "stiffness"
        self.action_names = actions_of(settings.acts)
        """Name of each action, those of the stiffness first."""
        walks = [reference_walks(of_body, legs) for of_body in settings_of_bodies(settings)]
        self.walks = walks[0]
        """Reference walks at each tabulated speed. They, and all that follows from them here, are of the settings'
        body, or of the first of `drawn_bodies`."""
        walk_at_speed = next(walk for walk in self.walks if walk.speed == settings.speed)
        self.body = walk_at_speed.body
        self.target = walk_at_speed.target
        self.plan = walk_at_speed.plan
        self.constants = walk_at_speed.constants
        table_rows = [row for of_body in walks for row in rows(of_body)]
        speeds = np.array([walk.speed for walk in self.walks])
        self.subjects = Subjects(settings, speeds, num_envs, variant, len(self.constants))
        self._worn = WornFeet(settings, feet or [settings.feet] * num_envs)
        self._incline = slope_table(slope_constants()).table
        self._legs = LegController(table_rows, self.subjects)
        planned, stiffness = foot_tables(settings, table_rows)
        # Tables have a row for each body, variant and speed.
        rest = planned if rest is None else np.tile(np.repeat(rest, len(speeds), axis=0), (len(walks), 1, 1))
        self._springs = FootSprings(settings, rest, stiffness, self.subjects, self._worn)
        self._decisions = DecisionTimes(settings, self.target, self.subjects.rows)
        self._start = start_table(table_rows)
        starts_or_stops = settings.start == "standing" or settings.stop_at is not None
        self._standing = Standing(settings, self.subjects) if starts_or_stops else None
        self._simulation = Simulation(
            self.body,
            num_envs,
            num_threads,
            model,
            settings.friction,
            self._worn.pairs,
            one_way=self._worn.one_way,
            loaded=any(of_body.carried_ratio > 0.0 for of_body in settings_of_bodies(settings)),
        )
        self._learned = None if settings.walker == TUNED else LearnedPerson(settings.walker, settings.guide)
        aim_rate = settings.aim_rate if self._learned is None else self._learned.aim_rate
        self._person = PersonActions(settings, self.subjects.rows, aim_rate)
        self._source = StiffnessSource(settings, self.subjects.rows)
        self._task = Task(settings, table_rows, self.subjects, self._simulation.feet)
        self._ground = Ground(settings, self._simulation, self.subjects, self._task.rows)
        self._noise = SensorNoise(settings.sensor_noise, self._task.rows)
        self._pushes = Pushes(settings, self.subjects, self._task.rows)
        self.observation_names = self._task.names
        self.observation_low = self._task.low
        self.observation_high = self._task.high
        self._random: list[np.random.Generator | None] = [None] * num_envs
        self._everyone = np.ones(num_envs, bool)
        self._nobody = np.zeros(num_envs, bool)
        self._no_reason = np.broadcast_to(0, num_envs)
        self._steps = self._task.rows["steps"]
        self._forces = np.zeros((self.windows_per_step, num_envs, len(SIDES), len(CONTACTS), 2))
        self._control = np.zeros((num_envs, len(SIDES), len(JOINTS), 2))
        self._tables = self._kernel_tables()
        self._physics = tuple(self._simulation.arrays)
        self._kept = {"control": self.subjects.rows, "task": self._task.rows} | self._simulation.kept
        if settings.drawn_bodies is not None:
            self._kept["proportions"] = self.subjects.proportions
        self._simulation.measure()

    @property
    def model(self) -> MjModel:
        """The compiled model of the settings' body."""
        return self._simulation.model

    def model_of(self, index: int) -> MjModel:
        """Return the compiled model of the body and feet that environment `index` has now; do not change it."""
        return self._simulation.models[index]

    @property
    def measurement(self) -> Measurement:
        """The measurement at the end of the last control window, or right after a reset."""
        return Measurement.of(self._simulation.arrays.bodies["measured"].copy())

    @property
    def leg_phase(self) -> NDArray:
        """(N, side) stride phase of each leg in [0, 1), 0 at its heel strike; a copy."""
        return self._legs.phase.copy()

    @property
    def feet(self) -> list[Feet]:
        """Left and right foot of each body now; a copy."""
        return list(self._worn.pairs)

    @property
    def controlled(self) -> NDArray:
        """Return (N, side, 2) True where actions set the stiffness of ankle and toe; others are read as 0. A copy."""
        rows = self.subjects.rows
        return rows["feet"]["controlled"].astype(bool) & (rows["source"]["not_action"] == 0)[:, None, None]

    @property
    def standing_mode(self) -> NDArray:
        """(N,) as `envs.control.standing.Standing.mode`: walking, standing, starting, stopping or stopped; a copy."""
        return np.full(self.num_envs, WALKING) if self._standing is None else self._standing.mode.copy()

    def data(self, index: int) -> MjData:
        """Return a copy of environment `index`'s state, to render or to inspect."""
        return self._simulation.data(index)

    def scheduled_stiffness(self) -> NDArray:
        """Return (N, side, 2) ankle and toe stiffness of the schedule at the present phases [N m/rad]."""
        return self._springs.scheduled(self._legs.phase)

    def command(self, ids: NDArray, speed: NDArray) -> None:
        """Change the commanded speed of environments `ids` (K,) to `speed` (K,) [m/s], at the rate `speed_rate`."""
        self.subjects.command(ids, speed)

    def push(self, force: NDArray) -> None:
        """Push the trunks forward by `force` (N,) [N] until the next call.

        It has no effect unless the setting `push_newton` is 0, since pushes that it draws replace the force.
        """
        self._simulation.push(real_numbers("force", force))

    def reset(
        self,
        ids: NDArray,
        seeds: Sequence[int | np.random.Generator | None],
        start: float | str | None = None,
        given: Mapping[str, Any] | None = None,
    ) -> None:
        """Begin a new episode in environments `ids`: walking, at a random phase of single support or at a given phase,
        or standing.

        Args:
            ids: (K,) indices.
            seeds: K seeds, or generators; with None the environment keeps its own generator.
            start: stride phase of the left leg [0, 1), "random" or "standing", in place of the setting.
            given: (K,) `height` [m], `mass` [kg], `speed` [m/s], `body` (index in `drawn_bodies`), `left_foot` or
                `right_foot` (feet in plain JSON values), in place of set or drawn ones.

        Raises `SpringfootError` for an impossible body, for feet that the batch cannot wear, or a standing start that
        the settings do not allow.
        """
        if len(ids) == 0:
            return
        start = self.settings.start if start is None else start
        if start == "standing" and self.settings.start != "standing":
            raise SpringfootError(
                f"a reset can start 'standing' where the setting start is 'standing' too, got {self.settings.start!r}"
            )
        self.subjects.check(given)
        self._worn.check(given)
        phase = np.empty(len(ids))
        noise = np.zeros((len(ids), 2, len(SIDES), len(JOINTS)))
        randoms: list[np.random.Generator] = []
        for row, (index, seed) in enumerate(zip(ids, seeds, strict=True)):
            random = self._random[index]
            if seed is not None or random is None:
                random = self._random[index] = np.random.default_rng(seed)
            drawn = random_phase(random)  # in every case, so that the generator is used alike
            if start == "random":
                phase[row] = drawn
            elif start == "standing":
                phase[row] = off_phase(drawn)  # at which the body will set off
            else:
                phase[row] = start
            if self.settings.start_noise:
                noise[row] = self.settings.start_noise * random.standard_normal(noise.shape[1:])
            self._pushes.reset(index, random)
            randoms.append(random)
        new_bodies = self.subjects.reset(ids, randoms, given)
        self._fit(new_bodies, self._worn.put_on(ids.tolist(), self._worn.draw(randoms, given)))
        self._legs.reset(ids, phase)
        self._ground.reset(ids, randoms, self._legs.phase)
        self._springs.reset(ids, [draw_delay(self.settings, random) for random in randoms])
        self._noise.draw(ids, randoms)
        self._decisions.reset(ids)
        self._person.reset(ids)
        self._source.reset(ids, randoms)
        posture = walking_posture(self._start, self.subjects, ids, phase)
        if self._standing is not None:
            standing_posture = self._standing.reset(ids, randoms, self._ground.slope[ids], start == "standing")
            posture = standing_posture or posture  # None for bodies that walk
        # Tuned legs were found with starts at which the foot slides; a person learns better from a foot at rest.
        person_walks = self._acts_as_person or self._learned is not None
        place(
            self._simulation,
            self.subjects,
            ids,
            posture,
            noise,
            phase if person_walks and start != "standing" else None,
        )
        self._task.reset(ids, self._simulation.measure(ids).velocity)

    def _fit(self, new_bodies: list[int], new_feet: list[int]) -> None:
        """Fit simulation, task and springs to environments with a changed body or changed feet, given by their indices.

        The gains of all legs follow the commanded speeds.
        """
        if ids := sorted({*new_bodies, *new_feet}):
            bodies = [self.subjects.bodies[index] for index in ids]
            self._simulation.fit(ids, bodies, [self._worn.pairs[index] for index in ids])
            self._task.fit(ids)
            self._fit_springs(ids)
        self._legs.follow()

    def _fit_springs(self, ids: list[int]) -> None:
        """Fit the foot springs to the feet of environments `ids`, and the kernels' tables to new torque-angle lines."""
        if self._springs.fit(ids):
            self._tables = self._kernel_tables()

    def _kernel_tables(self) -> tuple[Any, ...]:
        """Return the curves over the stride for the kernels of a window: `Tables`, as a plain tuple."""
        return tuple(
            Tables(
                rest=self._springs.rest.table,
                legs=self._legs.table.table,
                incline=self._incline,
                feet=self._springs.feet,
            )
        )

    def _embody(self, ids: NDArray, numbers: Mapping[str, NDArray], feet: Any) -> None:
        replaced = [OWN_FEET] * len(ids) if feet is None else self._worn.from_json(feet, len(ids))
        height, mass = (numbers[f"control.subject.{name}"] for name in ("height", "mass"))
        proportions = numbers.get("proportions", np.zeros(len(ids), int))
        new_bodies = self.subjects.embody(ids, height, mass, proportions)
        self._fit(new_bodies, self._worn.put_on(ids.tolist(), replaced))

    def _rewrite_numbers(self, ids: NDArray) -> None:
        self._fit_springs(ids.tolist())  # lines of another batch may have other numbers

    def _feet_of(self, ids: NDArray) -> list[Any] | None:
        """Return the feet (left, right) of the bodies `ids` as JSON; None if all are those of `settings`, and none is
        drawn."""
        replaced = self._worn.to_json(ids.tolist())
        return replaced if self.settings.drawn_feet or any(any(pair) for pair in replaced) else None

    def observe(self) -> NDArray:
        """Return the present observation (N, D), float32."""
        return self._noise.on(self._task.observe(self._simulation.arrays.bodies))

    def step(self, actions: NDArray, active: NDArray | None = None) -> StepResult:
        """Apply actions (N, A), as `action_names`, for one step.

        Environments where the mask `active` (N,) is False stay as they are; their reward is 0.
        Raises `SpringfootError` for actions of another shape, and for NaN or infinity.
        """
        return self.step_checked(real_numbers("actions", actions), active)

    def step_checked(self, action: NDArray, active: NDArray | None = None) -> StepResult:
        """Step as `step` does, without a check of the type: `action` must be a float64 array in C order, as
        `real_numbers` returns it."""
        expected = self.num_envs, len(self.action_names)
        if action.shape != expected:
            raise SpringfootError(f"actions must have shape {expected}, got {action.shape}")
        step = self._decode(action, active)
        self._before_step(step)
        for window in range(self.windows_per_step - 1):
            self._simulate(step)
            self._next_window(step, window)
        self._simulate(step)
        return self._judge(step)

    def _decode(self, action: NDArray, active: NDArray | None) -> "_Step":
        """Return the step that is to be taken: the environments that run, and the factors of their actions on the
        stiffness. Raises `SpringfootError` for NaN or infinity.
        """
        running = self._everyone
        ids = None
        if active is not None and not active.all():
            running = active
            ids = np.flatnonzero(active)
        of_stiffness, of_person = action, None
        if self._acts_as_person:  # behind the actions on the stiffness, if any
            of_person = action[:, -len(PERSON_ACTIONS) :]
            none = np.zeros((self.num_envs, len(ACTIONS)))
            of_stiffness = np.ascontiguousarray(action[:, : len(ACTIONS)]) if self._acts_on_stiffness else none
        finite = of_person is None or np.isfinite(of_person[running]).all()
        taken = self._decisions.take(of_stiffness, running) if finite else None
        if taken is None:
            raise SpringfootError("actions must be finite numbers in [-1, 1], got NaN or infinity")
        factor = self._springs.factor(taken)
        # Where the setting `stiffness_by` has others set the stiffness, their factor takes the place of the action's.
        self._source.replace_factors(factor, self._springs.factor_at_one, running, self._random)
        # Until `_before_step` asks `Standing`, all bodies that run walk, and none with the schedule's stiffness.
        return _Step(
            running=running, ids=ids, factor=factor, of_person=of_person, walking=running, on_schedule=self._nobody
        )

    def _before_step(self, step: "_Step") -> None:
        """Let bodies set off or stop, change speeds, push, set the stiffness and begin the first window."""
        seen = self._seen_by_person()  # as by a policy, before commands change
        if self._standing is not None:
            time = self._steps * self.dt
            step.walking, step.on_schedule = self._standing.switch(self._simulation.arrays, time, step.running)
        if self.subjects.advance(self._steps, self._random, step.walking):
            self._legs.follow()
        if self.settings.push_newton:
            self._simulation.push(self._pushes.force(self._steps, self._random, step.running))
        if step.of_person is not None or self._learned is not None:
            self._move_person(step, 0, seen)
        begin_step(
            self.subjects.rows,
            self._simulation.arrays.bodies,
            self._control,
            self._tables,
            self._springs.schedule.table,
            self._springs.options,
            step.factor,
            step.walking,
            step.on_schedule,
        )

    def _seen_by_person(self) -> NDArray | None:
        """Return the observation (N, D) of a learned person, without noise; None if none walks."""
        if self._learned is None:
            return None
        return self._task.observe(self._simulation.arrays.bodies, len(PERSON_OBSERVATION))

    def _move_person(self, step: "_Step", window: int, seen: NDArray | None) -> None:
        """Move the rest angles of hips, knees and ankles before control window number `window` of the step: by the
        action at the step's beginning, or, every 20 ms, by a learned person that has `seen` an observation."""
        resting = step.running & ~step.walking
        if step.of_person is not None:
            self._person.move(self._person.offsets(step.of_person), step.walking, resting)
        elif self._learned is not None and seen is not None:
            windows = self._steps * self.windows_per_step + window  # since the episode began
            moving = step.walking & (windows % WINDOWS_PER_ACTION_STEP == 0)
            self._person.move(self._learned.offsets(seen, moving), moving, resting)

    def _simulate(self, step: "_Step") -> None:
        """Run the physics of one control window with the control that the springs, the legs and the stance set."""
        if self._standing is not None:  # the springs of standing bodies replace the control of their legs and feet
            standing = step.running & ~step.walking
            bodies = self._simulation.arrays.bodies
            self._standing.drive(bodies, self._control, standing)
            self._springs.hold(bodies, self._control, standing)
        watched = self.on_tick is not None
        if watched:
            step.window_start = {"phase": self._legs.phase.copy(), "active": step.running.copy()}
            slack = self._simulation.arrays.bodies["muscles"]["slack"]
            step.window_start |= stiffness_and_rest(self._control, slack)
        self._simulation.advance(self._control, step.ids, watched=watched)

    def _next_window(self, step: "_Step", window: int) -> None:
        """End control window number `window` of the step and begin the next."""
        controls = self.subjects.rows
        options = self._springs.options
        person_acts = self._learned is not None and (window + 1) % WINDOWS_PER_ACTION_STEP == 0
        if step.window_start is None and not person_acts:  # nothing happens in between: one compiled call
            next_window(
                controls, self._physics, self._forces, window, self._control, self._tables, options, step.walking
            )
            self._after_window(step)
        else:  # in between, a listener reads the numbers of the ended window, or the person moves amid a 40 ms step
            end_window(controls, self._physics, self._forces, window, step.walking)
            self._after_window(step)
            if person_acts:
                self._move_person(step, window + 1, self._seen_by_person())
            bodies = self._simulation.arrays.bodies
            begin_window(controls, bodies, self._control, self._tables, options, step.walking)

    def _after_window(self, step: "_Step") -> None:
        """Lay the ground of the next footfalls, and report the window to a listener."""
        if self.settings.unevenness_m:
            self._ground.advance(self._simulation.now, self._legs.phase, self._random)
        if self.on_tick is not None and step.window_start is not None:
            bodies = self._simulation.arrays.bodies
            self.on_tick(
                Tick(
                    measurement=self.measurement,
                    work=self._simulation.work,
                    fibre_moment=bodies["muscles"]["moment"][:, 0].copy(),  # [:, 0]: of the last window
                    muscle_work=bodies["muscles"]["delivered"][:, 0].copy(),
                    com_reference=self._task.planned_com(bodies),
                    **step.window_start,
                )
            )

    def _judge(self, step: "_Step") -> StepResult:
        """End the last window of the step, and return its result: reward, observation, termination."""
        outcome = empty_outcome(self.num_envs, len(self.observation_names))
        observation, reward, terminated, truncated, values = outcome
        any_terminated = end_step(
            self.subjects.rows,
            self._task.rows,
            self._physics,
            self._forces,
            self._task.table,
            self._task.options,
            step.walking,
            step.running,
            outcome,
        )
        self._after_window(step)
        if self.settings.sensor_noise:
            running = np.flatnonzero(step.running)
            self._noise.draw(running, [self._random[index] for index in running])
        reasons = self._no_reason
        if any_terminated:
            reasons = reasons_of(self._simulation.now, self._task.rows["scales"]["min_hip_height"], terminated)
        return StepResult(
            observation=self._noise.on(observation),
            reward=reward,
            terminated=terminated,
            truncated=truncated,
            values=values,
            termination=reasons,
        )


@dataclass(slots=True)
class _Step:
    """State of a step that the batch is taking."""

    running: NDArray
    """(N,) environments that take the step."""
    ids: NDArray | None
    """Indices of the running environments; None for all."""
    factor: NDArray
    """(N, 4) factors of the actions on the stiffness [-]."""
    of_person: NDArray | None
    """(N, 6) actions that move the person; None if they do not."""
    walking: NDArray
    """(N,) environments with moving springs and phase; the others stand or do not run."""
    on_schedule: NDArray
    """(N,) walking environments that take the schedule's stiffness in place of the action's."""
    window_start: dict[str, NDArray] | None = None
    """Fields of a `Tick` known at the beginning of a window, if someone listens."""
