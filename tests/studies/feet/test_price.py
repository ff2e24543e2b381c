"""Sensitivities of the price: a tendon moves the price of its own joint alone, and charges are those of the reward."""

import numpy as np
import pytest

from springfoot.cli.main import study_main
from springfoot.envs.task.reward import TERMS
from springfoot.errors import SpringfootError
from springfoot.evaluation.numbers import stiffness_charge
from springfoot.evaluation.recording import policy_and_settings, record
from springfoot.studies.feet.price import AS_KNOWN, CASES, plan_prices, price_table, prices_of


def walk(**given):
    act, settings = policy_and_settings("schedule", {"episode_seconds": 6.0, **given})
    return record(act, settings, name="schedule", episodes=2, threads=1)


def test_a_tendon_moves_the_price_of_its_own_joint_alone():
    rows = {row["case"]: row for row in prices_of("schedule", walk())}
    assert list(rows) == list(CASES)
    known = rows[AS_KNOWN]
    for joint in ("ankle", "toe"):
        for factor in ("0.5", "2"):
            changed = rows[f"{joint}'s tendon × {factor}"]
            same = [name for name in ("hip", "knee", "ankle", "toe") if changed[name] == known[name]]
            assert same == [name for name in ("hip", "knee", "ankle", "toe") if name != joint]
            difference = changed[joint] - known[joint]
            assert changed["fibre_J_kg_m"] - known["fibre_J_kg_m"] == pytest.approx(difference, rel=1e-9)


@pytest.mark.parametrize("mass", [63.0, 90.0])
def test_the_charge_is_the_mean_of_the_rewards_term(mass):
    recording = walk(ankle_tendon=300.0, mass=mass)
    term = recording.series["reward"][..., TERMS.index("stiffness")].astype(float)
    assert stiffness_charge(recording) == pytest.approx(np.nanmean(term), rel=1e-4)  # of single precision
    assert stiffness_charge(recording, 0.5) > stiffness_charge(recording) > stiffness_charge(recording, 2.0)


def test_a_charge_needs_a_tendon():
    with pytest.raises(SpringfootError, match="needs a recording with ankle_tendon, got None"):
        stiffness_charge(walk(episode_seconds=0.5))


def test_the_table_tells_changes_from_the_price_as_it_is():
    prices = [dict(row, fibre_J_kg_m=4.0, effort=1.0) for row in plan_prices()]
    prices[1] |= {"fibre_J_kg_m": 5.0, "effort": 0.9}
    text = price_table(prices, [])
    assert "| as it is | 4.00 / 1.00 |" in text and "| ankle's tendon × 0.5 | +25% / -10% |" in text


@pytest.mark.slow
def test_quick_runs(tmp_path):
    assert study_main(["price", "--quick", "--threads", "1", "--out", str(tmp_path / "out")]) == 0
    assert "pretrained,toe's tendon × 2" in (tmp_path / "out" / "prices.csv").read_text(encoding="utf-8")
    assert (tmp_path / "out" / "charges.csv").read_text(encoding="utf-8").count("\n") == 1 + 3 * 2 * 3
