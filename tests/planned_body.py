"""A body on its plan, with people's angles and forces: what the tests of observation and reward start from."""

import numpy as np
from numpy.typing import NDArray
from parts import judge, total

from springfoot.envs.control.reference_walk import reference_walks, rows
from springfoot.envs.control.subjects import Subjects
from springfoot.envs.physics.measurement import BODY_ROW, Measurement
from springfoot.envs.physics.model import LEFT, RIGHT
from springfoot.envs.settings.settings import settings_from
from springfoot.envs.task.reward import TERMS, Task
from springfoot.gait.body.body import GRAVITY, Body
from springfoot.gait.people.human import human_gait
from springfoot.gait.plan.com_plan import over_peoples_zmp
from springfoot.gait.plan.plan import plan_walk


class Setup:
    """A task with the body, plan and people's curves it was made from."""

    def __init__(self, **settings):
        self.settings = settings_from(**settings)
        self.body = Body(self.settings.height, self.settings.mass)
        self.human = human_gait(self.settings.speed, self.settings.height)
        self.plan = over_peoples_zmp(plan_walk(self.body, self.settings.speed))
        self.walks = reference_walks(self.settings)

    def task(self, num) -> Task:
        """For so many environments."""
        return self.at(np.zeros(num))[0]

    def at(self, left_phase, measurement=None) -> tuple[Task, NDArray, NDArray]:
        """Task, rows of the control, and rows of the bodies, at these phases and as measured."""
        legs = leg_phases(np.atleast_1d(left_phase))
        subjects = Subjects(self.settings, np.array([self.settings.speed]), len(legs))
        subjects.rows["legs"]["phase"] = legs
        bodies = np.zeros(len(legs), BODY_ROW)
        for name, values in vars(measurement or self.measurement(legs[:, LEFT])).items():
            bodies["measured"][name] = values
        feet = [self.settings.feet] * len(bodies)
        return Task(self.settings, list(rows(self.walks)), subjects, feet), subjects.rows, bodies

    def tracking(self, measurement, left_phase) -> NDArray:
        task, _, bodies = self.at(left_phase, measurement)
        return task.tracking(bodies)

    def measurement(self, left_phase, **other) -> Measurement:
        """The body on its plan with people's joint angles, trunk upright, the leading ankle at x = 10 m."""
        phase = np.atleast_1d(np.asarray(left_phase, float))
        n, legs = len(phase), leg_phases(phase)
        step = 2 * np.minimum(legs[:, LEFT], legs[:, RIGHT])
        x, z = self.plan.com(step)
        angle = np.stack([self.human.mean(name, legs) for name in ("thigh", "knee", "ankle", "toe")], -1)
        values = {
            "time": np.zeros(n),
            "base": np.tile([10.0, self.body.leg_length, 0.0], (n, 1)),
            "base_velocity": np.zeros((n, 3)),
            "angle": angle,
            "velocity": np.zeros((n, 2, 4)),
            "torque": np.zeros((n, 2, 4)),
            "com": np.stack([10 + x, z], -1),
            "com_velocity": np.tile([self.settings.speed, 0.0], (n, 1)),
            "ankle": np.stack([np.where(legs < 0.5, 10.0, 9.0), np.full((n, 2), 0.1)], -1),
            "contact": np.zeros((n, 2, 3, 2)),
            "force": np.zeros((n, 2, 3, 2)),
            "diverged": np.full(n, -1),
        }
        return Measurement(**(values | other))

    def people_force(self, left_phase, windows=2):
        """People's forces (W, N, 2, 3, 2) [N] amid the step that ends at `left_phase`, all on the ball."""
        legs = leg_phases(np.atleast_1d(left_phase)) - 0.01 / self.plan.stride_time
        force = np.zeros((windows, len(legs), 2, 3, 2))
        for axis, name in enumerate(("grf_forward", "grf_vertical")):
            force[..., 1, axis] = self.human.mean(name, legs) * self.body.mass * GRAVITY
        return force

    def observe(self, measured, left_phase, **other) -> NDArray:
        n = len(left_phase)
        values = {"last_action": np.zeros((n, 4)), "force": np.zeros((n, 2, 3, 2))} | other
        task, controls, bodies = self.at(left_phase, measured)
        controls["decision"]["last_action"], task.rows["force"] = values["last_action"], values["force"]
        return task.observe(bodies)

    def terms(self, measurement, left_phase, **other):
        n = len(np.atleast_1d(left_phase))
        values = {
            "action": np.zeros((n, 4)),
            "last_action": np.zeros((n, 4)),
            "stiffness": np.tile([300.0, 60.0], (n, 2, 1)) * self.body.mass_scale * self.body.length_scale,
            "force_windows": self.people_force(left_phase),
            "muscles": {},
            "last_force": None,
        }
        values |= other
        task, controls, bodies = self.at(left_phase, measurement)
        controls["decision"]["action"], controls["decision"]["last_action"] = values["action"], values["last_action"]
        controls["springs"]["stiffness"] = values["stiffness"]
        controls["springs"]["taut"] = 1.0
        for name, value in values["muscles"].items():
            bodies["muscles"][name] = value
        if values["last_force"] is not None:
            task.rows["steps"], task.rows["force"] = 1, values["last_force"]
        terms = np.empty((n, len(TERMS)))
        judge(task.rows, controls, bodies, task.table, task.options, values["force_windows"], terms)
        return dict(zip(TERMS, terms.T, strict=True))

    def reward(self, terms) -> NDArray:
        total_of = np.empty(len(terms["alive"]))
        total(np.stack([*terms.values()], -1), self.task(len(total_of)).options, total_of)
        return total_of


def leg_phases(left):
    left = np.asarray(left, float)
    return np.stack([left, (left + 0.5) % 1], -1)
