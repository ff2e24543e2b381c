"""Define the frozen tasks of the benchmark; `import springfoot` registers each with Gymnasium.

Each task has two ids: `springfoot/Walk-v0`, where the action is the stiffness of ankles and toes and a committed person
walks (`learned`; in `FromThePlan` `predicted`), and `springfoot/WalkBoth-v0`, where the action also moves hips, knees
and ankles. New settings, another person or other physics make a new version. Until springfoot 0.1.0
is released, v0 may change.
"""

from typing import Any

VERSION = "v0"
"""Version of every task."""
SECONDS = 10.0
"""Length of an episode [s]."""
PLAN_RANGE_DEG = 20.0
"""Largest offset of a rest angle on the plan [deg], where the legs begin at constants that nobody tuned."""
HOW_IT_ACTS = ("action_mode", "aim_rate")
"""Settings that stay a policy's own on every task: how its action becomes a stiffness, how it holds a speed."""
MUST_AGREE = (
    "acts",
    "guide",
    "decisions",
    "stiffness_joints",
    "ankle_stiffness_range",
    "toe_stiffness_range",
    "schedule",
    "person_range_deg",
)
"""Settings that give an action its meaning: a policy trained with others is refused."""
MAY_NAME_FILES = ("people_file", "plan_file", "person")
"""Settings that may name a file, which a submission does not hold: a policy trained with one is refused."""
_PUSHES = {"push_newton": 100.0}
_WEAK_CALF = {"kind": "weak", "strength": 0.3}

STIFFNESS_TASKS: dict[str, dict[str, Any]] = {
    "Walk": {},
    "Pushed": {"push_newton": 250.0},
    "AnyBody": {
        "height_range": [1.5, 1.9],
        "mass_range": [50.0, 90.0],
        "speed_range": [0.8, 1.6],
        "speed_interval": 4.0,
        **_PUSHES,
    },
    "Slopes": {
        "slope_range_deg": [-5.0, 5.0],
        "unevenness_m": 0.01,
        "speed_range": [0.9, 1.5],
        "speed_interval": 5.0,
    },
    "WeakCalf": {"left_foot": _WEAK_CALF, "right_foot": _WEAK_CALF, **_PUSHES},
    "Prosthesis": {"right_foot": "adaptive", **_PUSHES},
    "FromThePlan": {"guide": "plan", "reward_weights": {"pose": 0.0, "grf": 0.0}, **_PUSHES},
}
"""Name of a task -> settings that differ from the defaults. In FromThePlan body and reward know the plan, no people's
curve."""


def _tasks() -> dict[str, dict[str, Any]]:
    """Return name with version -> settings of every task, those that set stiffness first."""
    stiffness, both = {}, {}
    for name, settings in STIFFNESS_TASKS.items():
        given = {"episode_seconds": SECONDS, **settings}
        on_plan = settings.get("guide") == "plan"
        farther = {"person_range_deg": PLAN_RANGE_DEG} if on_plan else {}
        stiffness[f"{name}-{VERSION}"] = {"person": "predicted" if on_plan else "learned", **given}
        both[f"{name}Both-{VERSION}"] = {"acts": "both", **farther, **given}
    return stiffness | both


TASKS = _tasks()
"""Name with version, such as "Walk-v0" -> its settings in plain JSON values; its id has `springfoot/` before it."""

FINGERPRINTS = {
    "Walk-v0": 2265.59,
    "Pushed-v0": 2137.7,
    "AnyBody-v0": 2274.47,
    "Slopes-v0": 2198.88,
    "WeakCalf-v0": 1978.69,
    "Prosthesis-v0": 2005.57,
    "FromThePlan-v0": 567.255,
    "WalkBoth-v0": 1518.38,
    "PushedBoth-v0": 770.565,
    "AnyBodyBoth-v0": 1078.88,
    "SlopesBoth-v0": 971.828,
    "WeakCalfBoth-v0": 562.028,
    "ProsthesisBoth-v0": 550.034,
    "FromThePlanBoth-v0": 102.915,
}
"""Task -> mean return of eight walks with small random actions [-], on the versions of constraints.txt
(`springfoot.evaluation.benchmark.task_walks.task_fingerprint`)."""
PERSONS_SHA256 = {
    "learned": "941daa201a21a8ab9d48eedc887a3a03b57ea9b199b17ea061c9735dae6d0f5f",
    "predicted": "bf5418a4915daadcd14d5812b0961233e32d04436b32df3e3cb0f0eb19268141",
}
"""Person that walks on the v0 of the tasks -> digest of the file."""
