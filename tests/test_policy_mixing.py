"""The weighted mean of policies: whose weights, what it pays for, what is refused, what is written."""

import csv
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from springfoot.agents import read_policy, save_policy
from springfoot.cli.main import study_main
from springfoot.errors import SpringfootError
from springfoot.evaluation.numbers.criteria import Criterion, numbers
from springfoot.evaluation.numbers.metrics import measure
from springfoot.evaluation.recording.policies import CONDITIONS
from springfoot.evaluation.recording.recording import record
from springfoot.studies.policy_mixing import MARGIN_PERCENT, cheapest_shares, mean_policy, missed_percent, price

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def policies():
    """`pretrained`, and another whose numbers are all higher."""
    first = read_policy("pretrained")
    raised = {name: tuple(array + 0.25 for array in getattr(first, name)) for name in ("weights", "biases")}
    return first, replace(first, **raised, observation_mean=first.observation_mean + 1.0)


def test_a_mean_lies_between_and_beyond_its_policies(policies):
    first, other = policies
    for share in (0.0, 1.0, 0.5, 1.5):
        mean = mean_policy(policies, np.array([1 - share, share]))
        for own, found in zip((*first.weights, *first.biases), (*mean.weights, *mean.biases), strict=True):
            np.testing.assert_allclose(found, own + 0.25 * share, atol=1e-6)
        np.testing.assert_allclose(mean.observation_mean, first.observation_mean + share, atol=1e-12)
        assert mean.settings == first.settings and (mean.observation_variance >= 0).all()
    rows = np.zeros((2, len(first.observation_mean)), np.float32)
    np.testing.assert_array_equal(mean_policy([first, other], np.array([1.0, 0.0]))(rows), first(rows))


def test_policies_of_other_layers_have_no_mean(policies):
    first = policies[0]
    narrow = replace(first, weights=(first.weights[0][:8], first.weights[1][:, :8], first.weights[2]))
    narrow = replace(narrow, biases=(first.biases[0][:8], *first.biases[1:]))
    with pytest.raises(SpringfootError, match="only policies of equal layers, for the same body and legs"):
        mean_policy([first, narrow], np.array([0.5, 0.5]))


def test_what_is_missed_counts_and_so_does_what_is_hardly_met():
    criteria = [Criterion(name=name, path=(name,), high=2.0) for name in ("a", "b", "c", "falls")]
    met, hardly, missed = 1.0, 2.0 * (1 - 0.002), 2.0 * (1 + 0.03)
    values = {"a": met, "b": hardly, "c": missed, "falls": 9}
    assert missed_percent(values, criteria) == pytest.approx((MARGIN_PERCENT - 0.2) + (MARGIN_PERCENT + 3.0))


def test_the_search_finds_the_shares_that_pay_least():
    best = np.array([0.9, -0.6, 0.7])
    found = cheapest_shares(lambda shares: float(((shares - best) ** 2).sum()), 3, 40, 8, 0.3, 1, lambda done: None)
    assert found.sum() == pytest.approx(1.0)
    np.testing.assert_allclose(found, best, atol=1e-3)


def test_falls_and_lost_return_have_their_price():
    policy = read_policy("pretrained")
    walk = record(policy, replace(policy.settings, **CONDITIONS | {"episode_seconds": 6.0}), name="p", episodes=1)
    metrics = measure(walk).metrics
    misses = missed_percent(numbers(metrics))
    first = (metrics, np.array([90.0, 110.0]), np.zeros(2, bool))
    for returns, falls, more in (
        ([100, 100], 0, 0.0),
        ([120, 120], 0, 0.0),
        ([80, 100], 0, 10.0),
        ([100, 100], 3, 6.0),
    ):
        walked = (metrics | {"falls": falls}, np.array(returns, float), np.zeros(2, bool))
        assert price(walked, first) == pytest.approx(misses + more)


def test_pretrained_is_the_mean_that_the_page_says():
    page = (ROOT / "docs" / "mixed" / "README.md").read_text(encoding="utf-8")
    shares = re.findall(r"^\| (\d\d) \| (−?[\d.]+) \|", page, re.MULTILINE)
    policies = [read_policy(ROOT / "docs" / "mixed" / f"{name}.safetensors") for name, _ in shares]
    mean = mean_policy(policies, np.array([float(share.replace("−", "-")) for _, share in shares]))
    shipped = read_policy("pretrained")
    assert len(policies) == 11 and mean.settings == shipped.settings
    shipped_arrays = *shipped.weights, *shipped.biases, shipped.observation_mean, shipped.observation_variance
    mean_arrays = *mean.weights, *mean.biases, mean.observation_mean, mean.observation_variance
    for own, found in zip(shipped_arrays, mean_arrays, strict=True):
        # OpenBLAS adds in another order on processors with AVX-512 than on that where it was made.
        np.testing.assert_allclose(own, found, rtol=0.0, atol=8 * np.finfo(own.dtype).eps * np.abs(own).max())


def test_a_search_writes_a_policy_and_the_shares_it_is_of(policies, tmp_path, capsys):
    for index, policy in enumerate(policies):
        save_policy(tmp_path / f"{index}.safetensors", replace(policy, weights=policies[0].weights))
    names = [str(tmp_path / f"{index}.safetensors") for index in range(2)]
    words = ["--episodes", "1", "--seconds", "6", "--generations", "1", "--population", "4", "--trained", "2"]
    words += ["--judged", "1"]
    for out in ("a", "b"):
        assert study_main(["mix", *names, *words, "--threads", "1", "--out", str(tmp_path / out)]) == 0
    written = [(tmp_path / out / "mix.safetensors").read_bytes() for out in ("a", "b")]
    assert written[0] == written[1]
    with (tmp_path / "a" / "mix.csv").open(encoding="utf-8", newline="") as file:
        lines = list(csv.DictReader(file))
    assert [line["policy"] for line in lines] == ["0", "1", "mix"]
    shares = np.array([float(line["share"]) for line in lines[:2]])
    found, expected = read_policy(tmp_path / "a" / "mix.safetensors"), mean_policy(policies, shares)
    assert shares.sum() == pytest.approx(1.0)
    np.testing.assert_allclose(found.observation_mean, expected.observation_mean, rtol=1e-9)
    assert "| `mix` |" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["pretrained"], "mix takes two or more policies, got 1"),
        (["pretrained", "nobody"], "no policy nobody"),
        (["pretrained", "pretrained", "--population", "1"], "population must be"),
        (["pretrained", "pretrained", "--sigma", "0"], "sigma must be"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(words, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert study_main(["mix", *words]) == 2
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1 and not list(tmp_path.iterdir())
