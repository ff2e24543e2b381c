"""Policy files: what goes in comes out, rows do not depend on each other, and anything else is refused."""

import json
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from safetensors.numpy import load, save

from springfoot.agents.policies.fingerprint import fingerprint
from springfoot.agents.policies.policy import Policy, load_policy, read_policy, save_policy
from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.control.constants import leg_constants
from springfoot.envs.settings.settings import BipedSettings, settings_from
from springfoot.envs.task.mirror import mirror_of
from springfoot.errors import SpringfootError
from springfoot.files.writing import write_atomically

SETTINGS = BipedSettings(speed=1.1, ankle_stiffness_range=(30.0, 700.0), reward_weights={"stiffness": -0.2})
NETWORK = {"observation_clip": 10, "activation": "tanh", "variance_floor": 1e-8}


def drawn(mirrored=False):
    """A policy of random weights, whose statistics are not alike on both sides."""
    biped, random = Biped(SETTINGS, 1), np.random.default_rng(0)
    sizes = [len(biped.observation_names), 64, 64, 2 if mirrored else 4]
    return Policy(
        settings=SETTINGS,
        fingerprint=fingerprint(biped),
        weights=tuple(random.normal(0, 0.2, (o, i)).astype(np.float32) for i, o in pairwise(sizes)),
        biases=tuple(random.normal(0, 0.2, o).astype(np.float32) for o in sizes[1:]),
        observation_mean=random.normal(size=sizes[0]),
        observation_variance=random.uniform(0.1, 2.0, sizes[0]),
        observation_clip=7.0,
        mirror=mirror_of(biped.observation_names, biped.action_names) if mirrored else None,
    )


@pytest.fixture(scope="module")
def policy():
    return drawn()


@pytest.fixture(scope="module")
def mirrored():
    return drawn(mirrored=True)


@pytest.fixture
def observations(policy):
    return np.random.default_rng(1).normal(0, 3, (65, len(policy.observation_mean))).astype(np.float32)


@pytest.mark.parametrize("form", ["policy", "mirrored"])
def test_a_saved_policy_acts_the_same_to_the_bit(form, request, observations, tmp_path):
    policy = request.getfixturevalue(form)
    save_policy(tmp_path / "policy.safetensors", policy)
    again = read_policy(tmp_path / "policy.safetensors")
    assert np.array_equal(again(observations), policy(observations))
    assert again.settings == SETTINGS
    assert again.header == policy.header
    save_policy(tmp_path / "again.safetensors", again)
    assert (tmp_path / "again.safetensors").read_bytes() == (tmp_path / "policy.safetensors").read_bytes()


def test_forward_pass_is_the_network_written_out(policy, observations):
    rows = (observations - policy.observation_mean) / np.sqrt(policy.observation_variance + 1e-8)
    hidden = np.clip(rows, -7, 7)
    for weight, bias in zip(policy.weights[:-1], policy.biases[:-1], strict=True):
        hidden = np.tanh(hidden @ weight.T + bias)
    expected = np.clip(hidden @ policy.weights[-1].T + policy.biases[-1], -1, 1)
    assert policy(observations) == pytest.approx(expected, abs=1e-5)
    assert policy(observations).dtype == np.float32
    assert (np.abs(expected) == 1).any() and (np.abs(expected) < 1).any()


@pytest.mark.parametrize("form", ["policy", "mirrored"])
def test_a_row_does_not_depend_on_the_others(form, request, observations):
    policy = request.getfixturevalue(form)
    whole = policy(observations)
    for size in (1, 2, 7, 64):
        parts = [policy(observations[k : k + size]) for k in range(0, len(observations), size)]
        assert np.array_equal(np.concatenate(parts), whole)
    assert np.array_equal(policy(observations[5]), whole[5])
    assert policy(observations[:0]).shape == (0, 4)


def test_a_mirrored_policy_is_the_left_legs_network_on_both_images(mirrored, observations):
    left = replace(mirrored, mirror=None)
    one, other = left(observations), left(mirrored.mirror.of(observations))
    both = np.concatenate([one, other], -1)  # left ankle and toe, then right
    np.testing.assert_allclose(mirrored(observations), both, atol=2e-6)  # it computes in single precision
    assert np.abs(one - other).max() > 0.5


def test_the_mirrored_observation_has_the_mirrored_action_to_the_bit(mirrored, observations):
    action, image = mirrored(observations), mirrored(mirrored.mirror.of(observations))
    assert image.tobytes() == np.take(action, mirrored.mirror.action_index, -1).tobytes()
    assert action.flags.c_contiguous and action.shape == (65, 4)
    assert np.array_equal(mirrored(observations[3]), action[3])


def test_worlds_that_are_mirror_images_stay_so_under_a_mirrored_policy(mirrored):
    biped = Biped(SETTINGS, 2)
    biped.reset(np.array([0]), [0], start=0.2)
    biped.reset(np.array([1]), [0], start=0.7)
    observation = biped.observe()
    for _ in range(50):
        result = biped.step(mirrored(observation))
        observation = result.observation
    angle = biped.measurement.angle
    np.testing.assert_allclose(angle[0], angle[1, ::-1], atol=1e-6)
    for joint in ("ankle", "toe"):
        left, right = (result.info[f"stiffness/{joint}_{side}"] for side in ("left", "right"))
        np.testing.assert_allclose(left, right[::-1], rtol=1e-5)
    assert np.abs(angle[0] - angle[0, ::-1]).max() > 0.1
    assert result.reward[0] == pytest.approx(result.reward[1], abs=1e-6)


def test_a_plain_policys_header_has_no_word_of_mirrors(policy, mirrored):
    assert "mirrored" not in policy.header["network"] and mirrored.header["network"]["mirrored"] is True
    assert mirrored.layer_sizes == [43, 64, 64, 2] and (policy.action_count, mirrored.action_count) == (4, 4)


@pytest.mark.parametrize(("change", "words"), [(lambda x: x[:, :-1], "must be"), (lambda x: x * np.nan, "finite")])
def test_bad_observations_are_refused(policy, observations, change, words):
    with pytest.raises(SpringfootError, match=words):
        policy(change(observations))


def test_a_folder_means_its_best_policy(policy, observations, tmp_path):
    save_policy(tmp_path / "best.safetensors", policy)
    assert np.array_equal(load_policy(tmp_path)(observations), policy(observations))


def test_the_header_tells_the_task_and_nothing_of_where_or_when(policy):
    assert set(policy.header) == {"format_version", "network", "settings", "fingerprint"}
    assert policy.header["settings"]["speed"] == 1.1


def test_the_fingerprint_knows_body_and_action_map():
    base = fingerprint(Biped(BipedSettings(), 1))
    assert fingerprint(Biped(BipedSettings(push_newton=50.0, episode_seconds=3.0), 4)) == base
    heavier = fingerprint(Biped(BipedSettings(mass=70.0), 1))
    assert heavier["model"] != base["model"] and heavier["action"] != base["action"]
    stiffer = fingerprint(Biped(BipedSettings(toe_stiffness_range=(5.0, 210.0)), 1))
    assert stiffer["action"] != base["action"] and stiffer["model"] == base["model"]


def test_the_fingerprint_knows_the_legs_and_what_the_feet_follow():
    base = fingerprint(Biped(BipedSettings(), 1))
    for settings in ({"equilibrium": "angle"}, {"equilibrium": "neutral"}, {"speed": 1.1}):
        other = fingerprint(Biped(settings_from(**settings), 1))
        assert other["legs"] != base["legs"] and other["model"] == base["model"]
    tuned = leg_constants("planned", "people")
    retuned = fingerprint(Biped(BipedSettings(), 1, legs=[replace(tuned, trunk_damping=1.001 * tuned.trunk_damping)]))
    assert [part for part in base if retuned[part] != base[part]] == ["legs"]


def test_a_policy_carries_the_gait_it_was_trained_after(policy, tmp_path):
    own = {"name": "mine.csv", "strides": 9, "speed": 1.1, "stride_time": 1.1, "step_length": 0.6, "toe_off": 0.62}
    own |= {"mean": {"knee": [[0.4, 0.0], [0.1, -0.2]]}, "sd": {}}
    settings = settings_from(speed=1.1, human=own)
    after = fingerprint(Biped(settings, 1))
    assert after["legs"] != fingerprint(Biped(settings_from(speed=1.1), 1))["legs"]
    save_policy(tmp_path / "policy.safetensors", replace(policy, settings=settings, fingerprint=after))
    assert load_policy(tmp_path / "policy.safetensors").settings == settings


def changed(policy, path, header=None, tensors=None):
    """The policy's file with parts of its header or tensors changed."""
    save_policy(path, policy)
    arrays = load(path.read_bytes()) | (tensors or {})
    arrays = {name: array for name, array in arrays.items() if array is not None}
    path.write_bytes(save(arrays, {"springfoot": json.dumps(policy.header | (header or {}))}))


@pytest.mark.parametrize(
    ("header", "tensors", "words"),
    [
        ({"format_version": 2}, {}, "policy format 2, this version reads 1"),
        ({"format_version": None}, {}, "policy format None"),
        ({"settings": {"hight": 1.7}}, {}, "'hight'.*height"),
        ({"settings": {"mass": -1.0}}, {}, "mass must be"),
        ({"settings": [1]}, {}, "header is not valid"),
        ({"settings": {"right_foot": {"kind": "rigid", "adapted": "rigid"}}}, {}, 'the setting person="learned" walks'),
        ({"network": {}}, {}, "header has no 'observation_clip'"),
        ({"network": NETWORK | {"layer_sizes": [3, 4], "activation": "gelu"}}, {}, "a network this version does not"),
        ({"network": NETWORK | {"layer_sizes": [3, 4], "output": "sign"}}, {}, "a network this version does not"),
        ({"network": NETWORK | {"layer_sizes": [3, 4], "variance_floor": -1}}, {}, "a network this version does not"),
        ({"network": NETWORK | {"layer_sizes": [3, 4], "observation_clip": 0}}, {}, "observation_clip must be in"),
        ({"network": NETWORK | {"layer_sizes": []}}, {}, r"layers \[\] do not lead from observation to action"),
        ({"network": NETWORK | {"layer_sizes": [3, 4]}}, {}, r"layers \[3, 4\] do not lead"),
        (
            {"network": NETWORK | {"layer_sizes": [43, 64, 64, 4], "mirrored": 1}},
            {},
            "a network this version does not",
        ),
        (
            {"network": NETWORK | {"layer_sizes": [43, 64, 64, 4], "mirrored": True}},
            {},
            r"layers \[43, 64, 64, 4\] do not lead from observation to the actions of one leg",
        ),
        (
            {"network": NETWORK | {"layer_sizes": [43, 64, 64, 2], "mirrored": True}},
            {},
            r"layer.2.bias must be \(2,\), is \(4,\)",
        ),
        ({"fingerprint": None}, {}, "header is not valid"),
        ({"fingerprint": [1]}, {}, "header is not valid"),
        (
            {"fingerprint": {}},
            {},
            "another version of this environment: other observation and action and model and legs",
        ),
        ({}, {"layer.0.bias": np.full(64, np.nan, np.float32)}, "layer.0.bias must be finite"),
        ({}, {"layer.0.bias": np.zeros(64, np.int32)}, "layer.0.bias must be finite float"),
        ({}, {"layer.0.bias": np.zeros(63, np.float32)}, r"layer.0.bias must be \(64,\), is \(63,\)"),
        ({}, {"layer.2.weight": None}, "layer.2.weight must be .* is absent"),
        ({}, {"layer.3.weight": np.zeros((4, 4), np.float32)}, "layer.3.weight must be absent"),
    ],
)
def test_a_changed_file_is_refused_with_one_line(policy, tmp_path, header, tensors, words):
    changed(policy, tmp_path / "policy.safetensors", header, tensors)
    with pytest.raises(SpringfootError, match=words) as caught:
        load_policy(tmp_path / "policy.safetensors")
    assert "\n" not in str(caught.value)


def test_negative_variance_and_foreign_observations_are_refused(policy, tmp_path):
    path = tmp_path / "policy.safetensors"
    changed(policy, path, tensors={"observation.variance": -policy.observation_variance})
    with pytest.raises(SpringfootError, match=r"observation\.variance must be in \[0, 1e\+30\], has -"):
        load_policy(path)
    smaller = replace(policy, settings=BipedSettings(speed=1.1, height=1.6))
    save_policy(path, smaller)
    with pytest.raises(SpringfootError, match=r"another version of this environment: other .*model"):
        load_policy(path)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "not a .safetensors file"),
        (b"\x80\x04K\x01.", "not a .safetensors file"),  # a pickle
        (b"import springfoot\n" * 20, "not a .safetensors file"),
        (save({"x": np.zeros(3)}), "no springfoot policy"),
        (save({"x": np.zeros(3)}, {"springfoot": "{"}), "not JSON"),
        (save({"x": np.zeros(3)}, {"springfoot": "[" * 100_000}), "not JSON"),
        (save({"x": np.zeros(3)}, {"springfoot": "[]"}), "not a JSON object"),
    ],
    ids=["empty", "pickle", "text", "foreign", "half", "deep", "list"],
)
def test_a_foreign_file_is_refused_with_one_line(tmp_path, content, words):
    (tmp_path / "policy.safetensors").write_bytes(content)
    with pytest.raises(SpringfootError, match=words) as caught:
        load_policy(tmp_path / "policy.safetensors")
    assert "\n" not in str(caught.value)


def test_a_broken_off_file_is_refused(policy, tmp_path):
    path = tmp_path / "policy.safetensors"
    save_policy(path, policy)
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(SpringfootError, match=r"not a .safetensors file"):
        load_policy(path)


def test_what_is_not_there_is_said(tmp_path):
    with pytest.raises(SpringfootError, match=r"no policy .*nothing.*pretrained"):
        load_policy(tmp_path / "nothing")
    with pytest.raises(SpringfootError, match=r"folder without best.safetensors"):
        load_policy(tmp_path)


def test_a_failed_write_leaves_the_old_file_alone(tmp_path):
    path = tmp_path / "file"
    write_atomically(path, b"old")
    with pytest.raises(TypeError):
        write_atomically(path, None)  # type: ignore[arg-type]
    assert path.read_bytes() == b"old"
    assert [item.name for item in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize("name", ["schedule", "constant:300,40"])
def test_a_baseline_is_no_policy_file(name):
    with pytest.raises(SpringfootError, match=r"is a baseline, not a policy file: call springfoot\.agents\.baseline\("):
        load_policy(name)
