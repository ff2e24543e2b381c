"""The Gymnasium `Env`: one body. `springfoot.envs.vector_env` has N bodies, and gives the same bits."""

from typing import Any

import gymnasium as gym
import numpy as np

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError

from .batch.biped_batch import Biped
from .batch.step_result import INFO, report_start
from .gym_face import METADATA, Face, check_options, check_render_mode, given_subjects, spaces_of
from .physics.simulation import MjData, MjModel
from .settings.checks import check_seed, real_numbers
from .settings.settings import settings_from

_NO_INFO: dict[str, Any] = dict.fromkeys((*INFO, "termination"))
"""The names of the info, without values."""


class SegmentedFootBiped(Face, gym.Env[NDArray, NDArray]):  # pyright: ignore[reportIncompatibleVariableOverride]
    """A planar body with segmented feet that walks by the stiffness of its ankles and toes.

    ## Description
    Trunk, thighs, shanks, feet and toes of a person of given height and mass. Hips and knees follow a phase controller
    with human-like curves; ankles and toes are springs, torque = K (rest angle - angle - beta x angular rate). The
    policy sets K alone, 50 times a second (`decisions`). The rest angle follows the target's ankle (`equilibrium`).

    ## Action space
    `Box(-1, 1, (4,), float32)`, from -1 to 1 on a log scale over the stiffness range (`action_mode="absolute"`) or as
    K = K_schedule exp(action) (`"residual"`). Values outside are clipped; NaN is refused.

    | Num | Action      | Stiffness at -1 | Stiffness at +1 | Unit     |
    | --- | ----------- | --------------- | --------------- | -------- |
    | 0   | ankle_left  | 20              | 800             | N m/rad  |
    | 1   | toe_left    | 5               | 200             | N m/rad  |
    | 2   | ankle_right | 20              | 800             | N m/rad  |
    | 3   | toe_right   | 5               | 200             | N m/rad  |

    For 1.70 m and 63 kg; scales with mass x height. Of a joint with a device (Feet) an action is read and seen as 0.

    With `acts="person"` the action is the person instead, `Box(-1, 1, (6,), float32)`: offsets to the rest angles of
    hips, knees and ankles, up to `person_range_deg` each: `rest_hip_left`, `rest_knee_left`, `rest_ankle_left`, then
    those of the right leg. With `acts="both"` these six stand behind the four. `stiffness_by` tells the source of
    the stiffness; where that is not the action, the action's four are read and seen as 0.

    ## Feet
    `left_foot` and `right_foot` are each one of these kinds, or a dictionary of `kind` and numbers. Stiffness [N m/rad]
    and rest angle [deg] of a device are the same on everybody. Every kind may have an `orthosis`, a dictionary of the
    numbers of `passive`: a spring beside the joints. With `engages`, "dorsiflexion" or "plantarflexion", it acts only
    beyond its angle that way, without damping. `shank_mass_ratio`, `shank_com_ratio`, `shank_inertia_ratio`,
    `foot_mass_ratio` and `foot_inertia_ratio` say how much of an intact one's a prosthesis has.

    | Kind      | Ankle                            | Toe                      | Numbers of its own                     |
    | --------- | -------------------------------- | ------------------------ | -------------------------------------- |
    | intact    | the action's                     | the action's             |                                        |
    | rigid     | locked                           | a spring of 110 N m/rad  |                                        |
    | rigid_toe | the action's                     | locked                   |                                        |
    | no_toe    | the action's                     | locked, without a ball   |                                        |
    | passive   | a spring                         | a spring                 | `ankle_stiffness`, `ankle_deg`,        |
    |           |                                  |                          | `toe_stiffness`, `toe_deg`,            |
    |           |                                  |                          | `damping_time` [s], or torque-angle    |
    |           |                                  |                          | lines `ankle_table`, `toe_table`       |
    | adaptive  | the action's, fixed rest angle   | likewise                 | `ankle_deg`, `toe_deg`, or `schedule`  |
    |           |                                  |                          | with `damping_time`                    |
    | weak      | the action's, weak plantarflexor | the action's             | `strength` [0.1..0.6]                  |
    | drop      | the action's, slack in swing     | the action's             |                                        |

    With `drawn_feet`, such as `[{"foot": "rigid", "on": "one", "weight": 2}, {"foot": {"kind": "passive",
    "ankle_stiffness": [150, 1500]}, "on": "both"}]`, every episode draws its feet, by the weights: on one side, either
    with equal chance, on both, on the left or on the right. Pairs of numbers are ranges to draw from, of stiffness and
    damping on the log scale. The options `left_foot` and `right_foot` of a reset set feet once.

    ## Observation space
    `Box(Min, Max, (43,), float32)`, dimensionless: each value is divided by its unit and clipped to its bounds. l is
    the leg length (hip to floor when standing, 0.53 of height), g gravity.

    | Num | Observation             | Divided by  | Min  | Max | Meaning                                   |
    | --- | ----------------------- | ----------- | ---- | --- | ----------------------------------------- |
    | 0   | hip_height              | leg length  | 0    | 2   | height of the hip                         |
    | 1   | pitch                   | rad         | -3.2 | 3.2 | pitch of the trunk, forward positive      |
    | 2   | hip_left                | rad         | -3.2 | 3.2 | angle, flexion positive                   |
    | 3   | knee_left               | rad         | -3.2 | 3.2 | angle, flexion positive                   |
    | 4   | ankle_left              | rad         | -3.2 | 3.2 | angle, dorsiflexion positive              |
    | 5   | toe_left                | rad         | -3.2 | 3.2 | angle, toe up positive                    |
    | 6   | hip_right               | rad         | -3.2 | 3.2 | angle, flexion positive                   |
    | 7   | knee_right              | rad         | -3.2 | 3.2 | angle, flexion positive                   |
    | 8   | ankle_right             | rad         | -3.2 | 3.2 | angle, dorsiflexion positive              |
    | 9   | toe_right               | rad         | -3.2 | 3.2 | angle, toe up positive                    |
    | 10  | hip_velocity_x          | sqrt(g l)   | -5   | 5   | velocity of the hip, forward positive     |
    | 11  | hip_velocity_z          | sqrt(g l)   | -5   | 5   | velocity of the hip, up positive          |
    | 12  | pitch_rate              | sqrt(g/l)   | -15  | 15  | rate of the pitch, forward positive       |
    | 13  | hip_rate_left           | sqrt(g/l)   | -15  | 15  | angular rate, flexion positive            |
    | 14  | knee_rate_left          | sqrt(g/l)   | -15  | 15  | angular rate, flexion positive            |
    | 15  | ankle_rate_left         | sqrt(g/l)   | -15  | 15  | angular rate, dorsiflexion positive       |
    | 16  | toe_rate_left           | sqrt(g/l)   | -15  | 15  | angular rate, toe up positive             |
    | 17  | hip_rate_right          | sqrt(g/l)   | -15  | 15  | angular rate, flexion positive            |
    | 18  | knee_rate_right         | sqrt(g/l)   | -15  | 15  | angular rate, flexion positive            |
    | 19  | ankle_rate_right        | sqrt(g/l)   | -15  | 15  | angular rate, dorsiflexion positive       |
    | 20  | toe_rate_right          | sqrt(g/l)   | -15  | 15  | angular rate, toe up positive             |
    | 21  | phase_sin               | 1           | -1   | 1   | sine of 2 pi x left stride phase          |
    | 22  | phase_cos               | 1           | -1   | 1   | cosine of 2 pi x left stride phase        |
    | 23  | phase_sin_2             | 1           | -1   | 1   | sine of 4 pi x left stride phase          |
    | 24  | phase_cos_2             | 1           | -1   | 1   | cosine of 4 pi x left stride phase        |
    | 25  | load_heel_left          | body weight | 0    | 5   | vertical force, mean of the step          |
    | 26  | load_ball_left          | body weight | 0    | 5   | vertical force, mean of the step          |
    | 27  | load_toe_left           | body weight | 0    | 5   | vertical force, mean of the step          |
    | 28  | load_heel_right         | body weight | 0    | 5   | vertical force, mean of the step          |
    | 29  | load_ball_right         | body weight | 0    | 5   | vertical force, mean of the step          |
    | 30  | load_toe_right          | body weight | 0    | 5   | vertical force, mean of the step          |
    | 31  | com_x_error             | leg length  | -2   | 2   | CoM minus plan, forward positive          |
    | 32  | com_z_error             | leg length  | -2   | 2   | CoM minus plan, up positive               |
    | 33  | speed_error             | sqrt(g l)   | -5   | 5   | forward speed of the CoM minus plan       |
    | 34  | last_action_ankle_left  | 1           | -1   | 1   | action of the step before                 |
    | 35  | last_action_toe_left    | 1           | -1   | 1   | action of the step before                 |
    | 36  | last_action_ankle_right | 1           | -1   | 1   | action of the step before                 |
    | 37  | last_action_toe_right   | 1           | -1   | 1   | action of the step before                 |
    | 38  | planned_ankle_left      | rad         | -3.2 | 3.2 | target's ankle angle at the leg's phase   |
    | 39  | planned_ankle_right     | rad         | -3.2 | 3.2 | target's ankle angle at the leg's phase   |
    | 40  | leading_leg             | 1           | -1   | 1   | stance that began last: +1 left, -1 right |
    | 41  | command_speed           | sqrt(g l)   | 0    | 2   | commanded speed (Froude speed)            |
    | 42  | height_ratio            | 1           | 0    | 2   | height / 1.70 m                           |

    Where the action moves the person, 40 further entries tell the last offsets, whether the action sets the stiffness,
    the slope, the stiffness now, feet and body, the length of the planned steps, the mean speed's error and the aim
    (`springfoot.envs.task.observation_entries`).

    ## Rewards
    Sum of weight x term. All terms are dimensionless and stand unweighted in `info`. On the step of a fall the reward
    is 0. Tolerances are those of 1.70 m; lengths scale with height, speeds with its square root.

    | Term           | Weight | Meaning                                                                         |
    | -------------- | ------ | ------------------------------------------------------------------------------- |
    | alive          | 0.15   | neither fallen nor diverged                                                     |
    | speed          | 0.4    | exp(-(e/0.05)^2), e forward speed of the CoM minus plan [m/s]                   |
    | com_x          | 0.2    | exp(-(e/0.03)^2), e CoM minus plan, forward [m]                                 |
    | com_z          | 0.1    | exp(-(e/0.015)^2), e CoM minus plan, up [m]                                     |
    | zmp            | 0.5    | exp(-(e/0.04)^2), e CoP of both feet minus planned ZMP [m]; 0 in flight         |
    | pose           | 2      | exp(-E/0.02), E squared distance [rad^2] from people's joint angles             |
    | grf            | 5      | exp(-D/0.4), D body weights by which the feet's forces leave people's range     |
    | stiffness_rate | -0.1   | squared change of the action, per 20 ms                                         |
    | stiffness      | -0.02  | mean over legs of [(K_ankle/300)^2 + (K_toe/60)^2/4]/1.25                       |
    | effort         | 0      | positive work of all joints over weight x commanded way (cost of transport)     |
    | fibre_work     | 0      | energy that muscle fibres spend on work, over weight x commanded way            |
    | activation     | 0      | squared moment of the fibres over their strength, weighted by volume            |
    | impact         | 0      | squared change of the feet's forces in a step [body weights], x (50 ms/step)^2  |
    | speed_held     | 0      | distance of the mean speed of 0.7 s from the commanded one, over that           |
    | person_rate    | 0      | squared change of the person's offsets over 0.25 rad, per 20 ms                 |
    | acceleration   | 0      | sum over joints of (acceleration x (50 ms)^2)^2 [rad^2]                         |
    | step_length    | 0      | difference of the last step's length and the planned one, over that             |
    | activation_rate | 0     | squared rate of the activation x 50 ms, weighted by volume                      |

    In `stiffness` K is of muscles, and of an adaptive device. With `ankle_tendon` K_ankle is that of the calf's
    fibres, beyond their K at rest and by their torque.

    ## Starting state
    People's posture at a random phase of single support (0.08 to 0.38 of either leg's stride), or at `start`, moving at
    the commanded speed, with `start_noise`. `reset(options={"start": phase})` sets the left leg's phase once.
    With `start="standing"` the body stands for about a second, sets off and speeds up to the commanded speed; from
    `stop_at` on it slows down, stops with one foot ahead and stands. Ankle and toe stiffness are then those of springs
    that hold it, or of the fixed schedule while it sets off and slows down; info tells them, and the action acts in the
    steady walk between. While it stands the phase waits, and reward and observation are against people and plan there.

    With `height_range`, `mass_range` or `speed_range` every episode draws its own body or speed; `options` may set them
    once: `{"height": 1.85, "mass": 95, "speed": 1.4}`. All scales with the body as mechanics do, and is linear between
    walks tabulated every 0.1 m/s. With `speed_interval` the commanded speed, which is observed, goes to new ones.
    With `drawn_bodies`, such as `[{}, {"leg_ratio": 1.03}, {"carried_ratio": 0.2, "weight": 3}]`, every episode draws
    its own proportions, load and step time; the option `body` is an index in it.

    ## Episode end
    Termination: the hip is lower than 0.65 m (x height / 1.70 m), the trunk is tilted by more than 0.8 rad, or the
    simulation diverges. Truncation: after `episode_seconds` (1000 steps by default), which `spec.max_episode_steps`
    follows. `gym.make(..., max_episode_steps=100)` ends episodes earlier, never later.

    ## Info
    Numbers of Python, the same keys from `reset` and `step`. Of each action's name: `stiffness/` [N m/rad], `torque/`
    [N m] and `equilibrium/` [rad] at the step's end; `work/stiffness/` and `work/equilibrium/` [J], the work done in
    the step by changing stiffness and by moving the equilibrium; `controlled/`, 1 where the action counts and 0
    where it is read as 0. Of each reward term `reward/`. `phase/left`, `phase/right` [0, 1), `time` [s], `speed` [m/s].
    After `reset` all is 0 but `controlled/`, phases and speed: no spring acts before the first action. `termination` is
    a code; `springfoot.envs.TERMINATIONS` names it:

    | Code | Name                   | Meaning                                                                        |
    | ---- | ---------------------- | ------------------------------------------------------------------------------ |
    | 0    |                        | not terminated: walking, or out of time                                        |
    | 1    | fell: hip too low      | as under Episode end                                                           |
    | 2    | fell: trunk too tilted | as under Episode end                                                           |
    | 3    | diverged: INERTIA      | MuJoCo warned of a matrix it cannot invert                                     |
    | 4    | diverged: CONTACTFULL  | MuJoCo's memory for contacts was full                                          |
    | 5    | diverged: CNSTRFULL    | MuJoCo's memory for constraints was full                                       |
    | 6    | diverged: BADQPOS      | a position was no finite number, or far too large                              |
    | 7    | diverged: BADQVEL      | a velocity was                                                                 |
    | 8    | diverged: BADQACC      | an acceleration was                                                            |
    | 9    | diverged: BADCTRL      | a control was                                                                  |

    ## MuJoCo
    `model` and `data`, as Gymnasium's MuJoCo environments have them, to be read: `data` is a new copy at each access,
    `model` that of the present body. Bodies are changed by settings and by the options of a reset.

    ## Arguments
    Every field of `springfoot.envs.settings.settings.BipedSettings`, by theme, as plain JSON values:

    | Argument                  | Default         | Meaning                                                            |
    | ------------------------- | --------------- | ------------------------------------------------------------------ |
    | **body**                  |                 |                                                                    |
    | `height`                  | `1.7`           | standing height [m]                                                |
    | `mass`                    | `63.0`          | body mass [kg]                                                     |
    | `leg_ratio`               | `1.0`           | thigh and shank over the average at that height, trunk the rest    |
    | `foot_ratio`              | `1.0`           | length of the foot over the average at that height                 |
    | `carried_ratio`           | `0.0`           | mass of a load over body mass                                      |
    | `carried_at`              | `"back"`        | place of the load: back, or waist                                  |
    | `height_range`            | `None`          | heights drawn at each reset [m], in place of `height`              |
    | `mass_range`              | `None`          | body masses drawn at each reset [kg], in place of `mass`           |
    | `drawn_bodies`            | `None`          | proportions, loads drawn at each reset; see Starting state         |
    | **feet**                  |                 |                                                                    |
    | `left_foot`               | `"intact"`      | a kind of foot, or `{"kind": ...}` with its numbers; see Feet      |
    | `right_foot`              | `"intact"`      | likewise                                                           |
    | `drawn_feet`              | `None`          | feet drawn at each reset; see Feet                                 |
    | **speed**                 |                 |                                                                    |
    | `speed`                   | `1.2`           | commanded speed [m/s]                                              |
    | `speed_range`             | `None`          | speeds drawn at each reset [m/s], in place of `speed`              |
    | `speed_interval`          | `None`          | mean time between changes of the commanded speed [s]               |
    | `speed_rate`              | `0.25`          | rate at which it goes to a new one [m/s^2]                         |
    | `step_time_ratio`         | `1.0`           | step time over people's at the same speed, 0.8 to 1.2              |
    | **reference**             |                 |                                                                    |
    | `cadence`                 | `"people"`      | steps of `"people"`, the `"thesis"`, or least `"effort"`           |
    | `guide`                   | `"people"`      | target of the walk: `"people"`, or its own `"plan"`                |
    | `people_file`             | `None`          | file of people's data in place of the package's, in its form       |
    | `plan_file`               | `None`          | the plan's styles in place of the package's                        |
    | `human`                   | `None`          | someone's own walk in people's place: `read_gait(FILE).to_json()`  |
    | **springs**               |                 |                                                                    |
    | `equilibrium`             | `"planned"`     | `"planned"`, `"angle"`, `"neutral"` or `"phase"`                   |
    | `feedforward`             | `"people"`      | moments fed forward: measured on `"people"`, or the `"plan"`'s own |
    | `action_mode`             | `"absolute"`    | `"absolute"` or `"residual"`                                       |
    | `decisions`               | `"50hz"`        | steps of 10, 20, 40 ms (`"100hz"`, `"50hz"`, `"25hz"`), `"event"`  |
    | `stiffness_joints`        | `"both"`        | joints the action decides: `"both"`, `"ankle"` or `"toe"`          |
    | `ankle_stiffness_range`   | `(20.0, 800.0)` | ankle stiffness at action -1 and +1 [N m/rad]                      |
    | `toe_stiffness_range`     | `(5.0, 200.0)`  | toe stiffness at action -1 and +1 [N m/rad]                        |
    | `ankle_tendon`            | `None`          | stiffness of the Achilles tendon, which bounds K [N m/rad]         |
    | `schedule`                | `None`          | a stiffness schedule in JSON form                                  |
    | **person**                |                 |                                                                    |
    | `acts`                    | `"stiffness"`   | the action sets `"stiffness"`, the `"person"`, or `"both"`         |
    | `person`                  | `None`          | walker there: the guide's own, `"tuned"`, a person, or a file      |
    | `person_range_deg`        | `14.0`          | largest offset of a rest angle [deg]                               |
    | `aim_rate`                | `0.0`           | how fast a person aims at the speed it lacks [1/s]                 |
    | `stiffness_by`            | `"action"`      | source of the stiffness where the action moves the person          |
    | **episode**               |                 |                                                                    |
    | `episode_seconds`         | `20.0`          | time until truncation [s]                                          |
    | `start`                   | `"random"`      | left leg's stride phase at the start, `"random"` or `"standing"`   |
    | `stop_at`                 | `None`          | time from which the body slows down, stops and stands [s]          |
    | `start_noise`             | `0.0`           | relative spread of joint angles and velocities at the start        |
    | **ground**                |                 |                                                                    |
    | `friction`                | `1.0`           | coefficient of friction between feet and ground                    |
    | `slope_deg`               | `0.0`           | slope of the ground, uphill positive [deg]                         |
    | `slope_range_deg`         | `None`          | slopes drawn at each reset [deg], in place of `slope_deg`          |
    | `unevenness_m`            | `0.0`           | each footfall's ground is up to this much higher or lower [m]      |
    | **disturbance**           |                 |                                                                    |
    | `push_newton`             | `0.0`           | size of each push on the trunk [N] for 63 kg, scales with mass     |
    | `push_seconds`            | `0.1`           | duration of each push [s]                                          |
    | `push_interval`           | `4.0`           | one push at a random time in each interval [s]                     |
    | `sensor_noise`            | `0.0`           | SD of noise on the measured entries of the observation             |
    | `stiffness_delay_s`       | `0.0`           | a new stiffness acts this much later [s]                           |
    | `stiffness_delay_range_s` | `None`          | delays drawn at each reset [s], in place of it                     |
    | **reward**                |                 |                                                                    |
    | `reward_weights`          | `{}`            | weights that differ from the table above                           |
    | `forward_force_weight`    | `1.0`           | weight of the forward force in the term `grf`, [0, 10]             |
    | `knee_weight`             | `2.5`           | weight of the knee's error in the term `pose`, [0, 20]             |

    and `render_mode`: `"human"`, `"rgb_array"` or None.

    ## Version history
    * v0: first version; may change until springfoot's first release, 0.1.0.
    """

    metadata = dict(METADATA)

    def __init__(self, render_mode: str | None = None, **settings: Any) -> None:
        self.settings = settings_from(**settings)
        self.render_mode = check_render_mode(render_mode)
        self.biped = Biped(self.settings, 1)
        self.metadata = METADATA | {"render_fps": round(1 / self.biped.dt)}
        self.observation_space, self.action_space = spaces_of(self.biped)
        self._over = True

    @property
    def _np_random(self) -> np.random.Generator | None:  # the batch's own, so that a copy's reset goes on as well
        return self.biped.generators[0]

    @_np_random.setter
    def _np_random(self, generator: np.random.Generator | None) -> None:
        self.biped.generators[0] = generator

    @property
    def model(self) -> MjModel:
        """The compiled model of the present body; see MuJoCo."""
        return self.biped.model_of(0)

    @property
    def data(self) -> MjData:
        """A new copy of the present state, after `mj_forward`; see MuJoCo."""
        return self.biped.data(0)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray, dict[str, Any]]:
        """Start an episode; `options` may set its `start`, body, speed and feet (see Starting state)."""
        chosen = check_options(options)
        super().reset(seed=check_seed(seed))
        self.biped.reset(np.array([0]), [self.np_random], chosen.get("start"), given_subjects(chosen, 1))
        self._over = False
        if self.render_mode == "human":
            self.render()
        values = report_start(self.biped.measurement, self.biped.leg_phase, self.biped.controlled)
        return self.biped.observe()[0], _info(values[0], termination=0)

    def step(self, action: NDArray) -> tuple[NDArray, float, bool, bool, dict[str, Any]]:
        """Hold the values set by `action` (A,), by default stiffness of ankles and toes, during a step,
        by default 20 ms."""
        if self._over:
            raise SpringfootError("no episode is running: call reset() before step()")
        action = real_numbers("action", action)
        if action.shape != self.action_space.shape:
            raise SpringfootError(f"action must have shape {self.action_space.shape}, got {action.shape}")
        result = self.biped.step_checked(action[None])
        terminated = bool(result.terminated[0])
        truncated = bool(result.truncated[0])
        self._over = terminated or truncated
        if self.render_mode == "human":
            self.render()
        info = _info(result.values[0], result.termination[0])
        return result.observation[0], float(result.reward[0]), terminated, truncated, info

    def render(self) -> Any:
        """Return a frame, uint8 (480, 640, 3), or None after drawing the window ("human").

        `SpringfootError` without GL.
        """
        return self._camera_for().show(self.biped.data(0), self.biped.model_of(0))

    def close(self) -> None:
        """Close the window, if there is one."""
        self._close_camera()


def _info(values: NDArray, termination: int | np.integer) -> dict[str, Any]:
    """Return the info of one environment by name, from `StepResult.values` (len(INFO),) and the code of the
    termination.

    The numbers are Python's, as wrappers copy every info, and NumPy's take a quarter longer to copy.
    """
    info = dict(_NO_INFO)  # of its full size: an empty one would grow name by name
    info.update(zip(INFO, values.tolist(), strict=False))  # in every step: strict would take half as long again
    info["termination"] = int(termination)
    return info
