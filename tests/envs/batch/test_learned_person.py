"""Test a learned person: a network in the step."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from springfoot.agents.policies.fingerprint import fingerprint
from springfoot.agents.policies.policy import Policy, read_policy, save_policy
from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.batch.learned_person import PERSON_NAMES, LearnedPerson
from springfoot.envs.physics.model import ACTIONS
from springfoot.envs.settings.settings import BipedSettings
from springfoot.envs.task.mirror import mirror_of
from springfoot.errors import SpringfootError

BOTH = BipedSettings(acts="both", action_mode="residual", stiffness_by="schedule", aim_rate=1.0)
SCHEDULE = BipedSettings(action_mode="residual")


def person(settings=BOTH, mirrored=True) -> Policy:
    """Return a person with random weights, which moves the rest angles by a few degrees."""
    random = np.random.default_rng(0)
    biped = Biped(settings, 1)
    mirror = mirror_of(biped.observation_names, biped.action_names)
    actions = len(biped.action_names)
    sizes = [len(biped.observation_names), 16, actions // 2 if mirrored else actions]
    return Policy(
        settings=settings,
        fingerprint=fingerprint(biped),
        weights=tuple(0.1 * random.standard_normal((b, a)) for a, b in itertools.pairwise(sizes)),
        biases=tuple(0.1 * random.standard_normal(b) for b in sizes[1:]),
        observation_mean=np.zeros(sizes[0]),
        observation_variance=np.ones(sizes[0]),
        mirror=mirror if mirrored else None,
    )


@pytest.fixture(scope="module")
def file(tmp_path_factory) -> str:
    path = tmp_path_factory.mktemp("person") / "person.safetensors"
    save_policy(path, person())
    return str(path)


def started(settings, num=1, seed=0, threads=1) -> Biped:
    biped = Biped(settings, num, threads)
    biped.reset(np.arange(num), [seed + index for index in range(num)])
    return biped


def with_person(file, **settings) -> BipedSettings:
    return BipedSettings(**{"action_mode": "residual", "person": file} | settings)


@pytest.mark.parametrize(
    "given",
    [
        {"guide": "people"},
        {"guide": "plan"},
        {"guide": "people", "speed_range": (0.9, 1.5), "speed_interval": 0.25},
    ],
    ids=str,
)
def test_the_network_in_the_step_does_what_its_policy_does(given, tmp_path) -> None:
    settings = replace(BOTH, **given)
    policy = person(settings)
    file = str(tmp_path / "person.safetensors")
    save_policy(file, policy)
    inside = started(with_person(file, **given))
    outside = started(settings)
    observation = outside.observe()
    for _ in range(50):
        observation[:, PERSON_NAMES.index("own_stiffness")] = 0.0
        expected = outside.step(policy(observation))
        result = inside.step(np.zeros((1, 4)))
        observation = expected.observation
        np.testing.assert_allclose(result.observation, observation[:, :43], atol=2e-4)
    moved = outside.subjects.rows["person"]["offset"]
    np.testing.assert_allclose(inside.subjects.rows["person"]["offset"], moved, atol=1e-4)
    assert np.abs(moved).max() > 0.01


def test_the_network_in_the_step_is_the_policys_to_the_bit(file) -> None:
    policy = person()
    observation = np.random.default_rng(2).standard_normal((200, len(PERSON_NAMES))).astype(np.float32)
    observation *= np.geomspace(1e-3, 1e3, 200, dtype=np.float32)[:, None]  # up to where tanh is 1
    observation[:, [PERSON_NAMES.index(name) for name in ("own_stiffness", *(f"last_action_{a}" for a in ACTIONS))]] = 0
    offsets = LearnedPerson(file, "people").offsets(observation, np.ones(200, bool)).reshape(200, 6)
    expected = np.radians(BOTH.person_range_deg) * policy(observation)[:, 4:].astype(float)
    assert np.array_equal(offsets, expected)
    exact = replace(policy, output="tanh")  # of NumPy in double precision, and bounded otherwise
    np.testing.assert_allclose(policy(observation), np.arctanh(exact(observation).astype(float)).clip(-1, 1), atol=1e-5)


def test_mirrored_bodies_have_mirrored_offsets_to_the_bit(file) -> None:
    mirror = mirror_of(PERSON_NAMES, ACTIONS)
    learned = LearnedPerson(file, "people")
    observation = np.random.default_rng(1).standard_normal((20, len(PERSON_NAMES))).astype(np.float32)
    everyone = np.ones(20, bool)
    offsets = learned.offsets(observation.copy(), everyone)
    image = learned.offsets(mirror.of(observation), everyone)
    assert image.tobytes() == offsets[:, ::-1].tobytes()


def test_alone_as_in_a_batch_on_any_threads_and_from_a_kept_state(file) -> None:
    settings = with_person(file, push_newton=50.0, sensor_noise=0.01)
    batch = started(settings, 5, threads=2)
    alone = started(settings, 1, 3)
    for step in range(40):
        result = batch.step(np.zeros((5, 4)))
        assert alone.step(np.zeros((1, 4))).observation.tobytes() == result.observation[3:4].tobytes()
        if step == 20:
            copy = started(settings, 5, 50)
            copy.restore(batch.state())
        if step > 20:
            assert copy.step(np.zeros((5, 4))).observation.tobytes() == result.observation.tobytes()


@pytest.mark.parametrize(("decisions", "windows"), [("100hz", 1), ("50hz", 2), ("25hz", 4), ("event", 2)])
def test_it_acts_every_20_ms_whatever_the_steps(file, decisions, windows) -> None:
    biped = started(with_person(file, decisions=decisions))
    offsets = []
    biped.on_tick = lambda tick: offsets.append(biped.subjects.rows["person"]["offset"].copy())
    for _ in range(40 // windows):
        biped.step(np.zeros((1, 4)))
    changes = [not np.array_equal(*pair) for pair in itertools.pairwise(offsets)]
    assert changes == [index % 2 == 1 for index in range(len(changes))]


def test_a_standing_body_is_not_moved(file) -> None:
    biped = started(with_person(file, start="standing"))
    biped.step(np.zeros((1, 4)))
    assert not biped.subjects.rows["person"]["offset"].any()


def test_a_file_that_is_no_person_is_one_line(file, tmp_path) -> None:
    plain = tmp_path / "plain.safetensors"
    save_policy(plain, person(mirrored=False))
    for name, message in (
        (str(plain), "is no person"),
        ("nobody", "person must be one of 'tuned', 'learned'"),
    ):
        with pytest.raises(SpringfootError, match=message) as error:
            Biped(with_person(name), 1)
        assert "\n" not in str(error.value)
    old = person()  # of an environment that told less
    old = replace(
        old,
        weights=(old.weights[0][:, 1:], *old.weights[1:]),
        observation_mean=old.observation_mean[1:],
        observation_variance=old.observation_variance[1:],
    )
    save_policy(plain, old)
    for read in (lambda: Biped(with_person(str(plain)), 1), lambda: read_policy(plain)):
        with pytest.raises(SpringfootError, match=r"observes 82 numbers, .* version .*83: train it again"):
            read()
    with pytest.raises(SpringfootError, match="was trained with guide 'people', not 'plan'"):
        Biped(with_person(file, guide="plan"), 1)


def test_a_policy_relies_on_the_file_of_its_person(file) -> None:
    assert "person" not in fingerprint(Biped(SCHEDULE, 1))
    assert len(fingerprint(Biped(with_person(file), 1))["person"]) == 64
