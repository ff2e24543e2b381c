"""Ground gives nothing: over a stride contacts take energy from the body, in every committed walk."""

import io
from dataclasses import replace

import pytest
from rich.console import Console

from springfoot.agents.policies.policy import SHIPPED
from springfoot.envs.physics.foot import LOCK
from springfoot.envs.physics.model import build_model
from springfoot.envs.physics.timing import PHYSICS_STEP
from springfoot.envs.settings.adapted import ADAPTED, committed_feet, without_person
from springfoot.envs.settings.settings import body_of
from springfoot.evaluation.numbers.criteria import GROUND_GIVES_NOTHING, WALKS, fault, unmet
from springfoot.evaluation.numbers.metrics import measure
from springfoot.evaluation.page.report_page import spoken_verdict
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import record
from springfoot.evaluation.report.gait_table import print_table


def person_on(name):
    """Policy and settings of the person who has adapted to the committed foot `name`."""
    foot = committed_feet()[name]
    worn = {**without_person(foot), ADAPTED: name}
    return "untrained", {"action_mode": "residual", "speed": float(next(iter(foot[ADAPTED]))), "right_foot": worn}


def walked(policy, given, episodes=2, seconds=8.0, step=PHYSICS_STEP, lock=LOCK):
    """The numbers of a walk with another physics step [s], or another lock in place of the rigid foot's."""
    acting, settings = policy_and_settings(policy, {"episode_seconds": seconds, **given})
    left, right = settings.feet
    if right.ankle.device == LOCK:
        right = replace(right, ankle=replace(right.ankle, device=lock))
    model = build_model(body_of(settings), settings.friction, (left, right))
    model.opt.timestep = step
    return measure(record(acting, settings, name=policy, episodes=episodes, model=model)).metrics


def told(metrics):
    """What the terminal prints."""
    text = io.StringIO()
    print_table(metrics, Console(file=text, width=200))
    return text.getvalue()


def test_a_lock_that_contacts_do_not_feel_gives_energy_and_a_warning():
    """The fault that this criterion was made for: a locked ankle without armature, at the default physics step."""
    metrics = walked(*person_on("rigid, search 2"), lock=replace(LOCK, armature=0.0))
    assert metrics["energy_J_kg"]["contact"] > 0.05 and abs(metrics["energy_J_kg"]["residual"]) < 0.01
    assert any(missed.startswith("contact work") for missed in unmet(metrics, WALKS))
    assert fault(metrics) in told(metrics) and spoken_verdict(metrics)["Warning"] == fault(metrics) != ""


@pytest.mark.parametrize("name", ["rigid", "rigid, search 2", "rigid, toe held"])
def test_the_lock_of_a_rigid_foot_gives_none(name):
    metrics = walked(*person_on(name))
    assert metrics["falls"] == 0 and metrics["energy_J_kg"]["contact"] < -0.03
    assert "Fault" not in told(metrics) and "Warning" not in spoken_verdict(metrics)


BY_NAME = [(name, {}) for name in ("schedule", "constant", "quasi_stiffness", *SHIPPED)]


@pytest.mark.slow
@pytest.mark.parametrize(("policy", "given"), [*BY_NAME, *map(person_on, committed_feet())], ids=str)
def test_ground_gives_nothing_in_any_committed_walk(policy, given):
    assert GROUND_GIVES_NOTHING.holds(walked(policy, given))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("policy", "given"),
    [("pretrained", {}), ("predicted", {}), ("schedule", {}), person_on("rigid, search 2")],
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
