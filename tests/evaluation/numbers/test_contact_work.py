"""Ground gives nothing: over a stride contacts take energy from the body, in every committed walk."""

import io
from dataclasses import replace

import pytest
from rich.console import Console

from springfoot.agents.policies.policy import SHIPPED
from springfoot.envs.physics.model import build_model
from springfoot.envs.physics.timing import PHYSICS_STEP
from springfoot.envs.settings.settings import body_of
from springfoot.evaluation.numbers.criteria import GROUND_GIVES_NOTHING, WALKS, fault, unmet
from springfoot.evaluation.numbers.metrics import measure
from springfoot.evaluation.page.report_page import spoken_verdict
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import record
from springfoot.evaluation.report.gait_table import print_table

STIFFEST = "schedule", {"right_foot": {"kind": "passive", "ankle_stiffness": 3000}}
"""Policy and settings of a walk on the stiffest spring that an ankle may have."""


def walked(policy, given, episodes=2, seconds=8.0, step=PHYSICS_STEP, armature=None):
    """The numbers of a walk with another physics step [s], or another armature of the right ankle's device [kg m^2]."""
    acting, settings = policy_and_settings(policy, {"episode_seconds": seconds, **given})
    left, right = settings.feet
    if armature is not None and right.ankle.device is not None:
        ankle = replace(right.ankle, device=replace(right.ankle.device, armature=armature))
        right = replace(right, ankle=ankle)
    model = build_model(body_of(settings), settings.friction, (left, right))
    model.opt.timestep = step
    return measure(record(acting, settings, name=policy, episodes=episodes, model=model, threads=1)).metrics


def told(metrics):
    """What the terminal prints."""
    text = io.StringIO()
    print_table(metrics, Console(file=text, width=200))
    return text.getvalue()


def test_a_stiff_ankle_that_contacts_do_not_feel_gives_energy_and_a_warning():
    """The fault that this criterion was made for: a stiff ankle without armature, at the default physics step."""
    metrics = walked(*STIFFEST, armature=1e-9)  # 0 is the device's own
    assert metrics["energy_J_kg"]["contact"] > 0.05 and abs(metrics["energy_J_kg"]["residual"]) < 0.01
    assert any(missed.startswith("contact work") for missed in unmet(metrics, WALKS))
    assert (
        fault(metrics) in told(metrics)
        and spoken_verdict(metrics, metrics["per_leg"])["Warning"] == fault(metrics) != ""
    )


@pytest.mark.parametrize("given", [STIFFEST[1], {"right_foot": "rigid_toe"}, {"right_foot": "no_toe"}], ids=str)
def test_a_stiff_or_locked_foot_gives_none(given):
    metrics = walked("schedule", given)
    assert metrics["falls"] == 0 and metrics["energy_J_kg"]["contact"] < -0.03
    assert "Fault" not in told(metrics) and "Warning" not in spoken_verdict(metrics, metrics["per_leg"])


BY_NAME = [(name, {}) for name in ("schedule", "constant", "quasi_stiffness", *SHIPPED)]


@pytest.mark.slow
@pytest.mark.parametrize(("policy", "given"), BY_NAME, ids=str)
def test_ground_gives_nothing_in_any_committed_walk(policy, given):
    assert GROUND_GIVES_NOTHING.holds(walked(policy, given))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("policy", "given"),
    [
        ("pretrained", {}),
        ("predicted", {}),
        ("schedule", {}),
        ("schedule", {"right_foot": "rigid_toe"}),
    ],
    ids=str,
)
def test_half_the_physics_step_gives_the_same_walk(policy, given):
    coarse, fine = (
        walked(policy, given, episodes=20, seconds=12.0, step=step) for step in (PHYSICS_STEP, PHYSICS_STEP / 2)
    )
    assert coarse["speed_m_s"]["mean"] == pytest.approx(fine["speed_m_s"]["mean"], rel=0.01)
    legs = [None] if coarse["per_leg"] is None else list(coarse["per_leg"])
    for leg in legs:
        work = [(each if leg is None else each["per_leg"][leg])["joint_work_J_kg"] for each in (coarse, fine)]
        push_off = [each["ankle"]["positive"] + each["toe"]["positive"] for each in work]
        assert push_off[0] == pytest.approx(push_off[1], rel=0.05, abs=0.005)


def test_the_ground_gives_a_rigid_foot_nothing():
    """Of a locked ankle, on which the tuned walk falls and a learned person walks."""
    metrics = walked("schedule", {"right_foot": "rigid", "person": "learned"})
    assert metrics["falls"] == 0
    assert metrics["energy_J_kg"]["contact"] < 0.0
