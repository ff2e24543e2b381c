"""From paired walks to the influence of stiffness: intervals, links between cells, files and page."""

from dataclasses import replace
from math import isnan, sqrt

import numpy as np
import pytest
from drawn import kept_figures
from PIL import Image

from springfoot.files.writing import csv_text
from springfoot.gait import SpringfootError
from springfoot.studies.springs.influence import (
    INFLUENCE_CONDITIONS,
    Influence,
    headline,
    save_influence_figure,
    tables,
    walk_under,
)
from springfoot.studies.springs.stiffness_responses import (
    CSV_HEAD,
    IMPULSE,
    LINKS_HEAD,
    MANY_STRIDES_SPEED,
    TORQUE,
    csv_rows,
    summarise,
)
from springfoot.studies.springs.stiffness_steps import CELLS, DURATIONS, FIXED, MOVEMENT, PairedWalks

SEEDS, STRIDES = 6, 8
FORETOLD = "∫Δa dt → Δspeed of many strides"


def walks(scale=1.0):
    """Walks whose speed changes by twice the impulse, with a little noise; nothing changes with `scale` 0."""
    random = np.random.default_rng(1)
    fixed = scale * np.linspace(-0.01, 0.01, len(CELLS))[:, None, None] * np.ones((len(CELLS), SEEDS, len(FIXED)))
    noise = scale * 1e-4 * random.standard_normal((len(CELLS), len(DURATIONS), SEEDS, STRIDES, len(MOVEMENT)))
    return PairedWalks(
        fixed=fixed,
        velocity=fixed[..., FIXED.index("forward_m_s")],
        movement=2.0 * fixed[:, None, :, None, :1] + noise,
        unchanged=np.full((SEEDS, STRIDES, len(MOVEMENT)), 1.2),
        cut=np.zeros(len(CELLS)),
    )


def test_a_speed_that_follows_the_acceleration_is_foretold_and_a_scrambled_one_is_not():
    found = summarise(walks(), 0.1)
    r, low, high, scrambled = found.links[FORETOLD]
    assert r > 0.999 and low <= r <= high and scrambled < 0.01
    assert found.foretold.sum() == found.moved.sum() == len(CELLS)  # the smallest changes speed by 1.8 mm/s
    other = walks()
    order = np.random.default_rng(3).permutation(len(CELLS))
    r, _, _, scrambled = summarise(replace(other, movement=other.movement[order]), 0.1).links[FORETOLD]
    assert abs(r) < 0.6 and scrambled > 0.05


def test_the_opposite_sign_is_not_foretold():
    other = walks()
    found = summarise(replace(other, movement=-other.movement), 0.1)
    assert found.links[FORETOLD][0] < -0.999 and found.foretold.sum() == 0 and found.moved.all()


def test_intervals_hold_the_mean_and_narrow_with_the_noise():
    found = summarise(walks(), 0.1)
    low, high = found.interval[MANY_STRIDES_SPEED].T
    assert (low <= found.mean[MANY_STRIDES_SPEED]).all() and (found.mean[MANY_STRIDES_SPEED] <= high).all()
    assert 0 < (high - low).max() < 4e-4
    assert found.mean[MANY_STRIDES_SPEED] == pytest.approx(2.0 * found.mean[IMPULSE], abs=2e-4)


def test_a_walk_that_falls_is_counted_and_left_out_of_its_cell():
    fallen = walks()
    fallen.movement[4, 1, 2] = np.nan
    found, whole = summarise(fallen, 0.1), summarise(walks(), 0.1)
    assert found.unfinished.sum() == found.unfinished[4, 1] == 1
    assert found.mean[MANY_STRIDES_SPEED][4] == pytest.approx(whole.mean[MANY_STRIDES_SPEED][4], abs=1e-4)
    for cell in set(range(len(CELLS))) - {4}:
        assert found.mean[MANY_STRIDES_SPEED][cell] == whole.mean[MANY_STRIDES_SPEED][cell]


def test_a_cell_in_which_all_fall_has_no_number(tmp_path):
    fallen = walks()
    fallen.movement[4] = np.nan
    found = {"as it is": summarise(fallen, 0.1)}
    assert isnan(found["as it is"].mean[MANY_STRIDES_SPEED][4]) and isnan(found["as it is"].links[FORETOLD][0])
    assert "| ankle, push-off (50–62 %) | – |" in tables(Influence(), found)
    assert ",push-off,0.5,0.62,every stride,speed_m_s,many,,,,6,0\n" in csv_text(CSV_HEAD, csv_rows(found))
    with kept_figures() as figures:
        save_influence_figure(tmp_path / "influence.png", found)
    torque = figures["influence.png"].axes[0]
    widths = [bar.get_width() for bar in torque.patches]
    assert widths == pytest.approx(found["as it is"].mean[TORQUE].tolist(), nan_ok=True)
    assert torque.get_xlabel() == "Δ torque (N·m)"


def test_where_nothing_changes_nothing_is_claimed():
    found = {"as it is": summarise(walks(0.0), 0.0)}
    assert "most here: nowhere. Elsewhere by at most 0.0 mm/s" in headline(Influence(), found)
    assert not found["as it is"].moved.any() and isnan(found["as it is"].links[FORETOLD][0])


def test_conditions_change_what_they_say():
    asked = {name: walk_under(name, "schedule", 0.1, 0.002) for name in INFLUENCE_CONDITIONS}
    assert {name for name, (_, _, change) in asked.items() if change != 0.1} == {"opposite change"}
    assert asked["opposite change"][2] == -0.1
    settings = {name: own for name, (_, own, _) in asked.items()}
    assert {name for name, each in settings.items() if each.unevenness_m == 0.0} == {"level ground"}
    assert settings["1.90 m, 95 kg"].speed == pytest.approx(1.2 * sqrt(1.90 / 1.70))
    assert (settings["1.55 m, 50 kg"].height, settings["1.55 m, 50 kg"].mass) == (1.55, 50.0)
    assert [settings[f"θ_eq {name}"].equilibrium for name in ("neutral", "by phase")] == ["neutral", "phase"]
    assert settings["pretrained"].action_mode == "absolute" and settings["as it is"].decisions == "100hz"


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        ({"conditions": ("on the moon",)}, "conditions must be of 'as it is', .*, got 'on the moon'"),
        ({"seeds": 1}, "seeds must be"),
        ({"strides": 3}, "strides must be"),
        ({"change_percent": -95.0}, "change_percent must be"),
        ({"policy": "nobody"}, "no policy 'nobody'"),
    ],
)
def test_bad_flags_are_refused_before_anything_walks(flags, message):
    with pytest.raises(SpringfootError, match=message):
        Influence(**flags).check()


@pytest.mark.slow
def test_the_same_seeds_give_the_same_files_with_any_number_of_threads(tmp_path, capsys):
    for threads in (1, 2):
        assert Influence(quick=True, threads=threads, out=tmp_path / str(threads)).run("influence") == 0
    for name, head in (("influence.csv", CSV_HEAD), ("influence_links.csv", LINKS_HEAD)):
        one, other = ((tmp_path / threads / name).read_bytes() for threads in "12")
        assert one == other and one.decode().splitlines()[0] == ",".join(head)
    with Image.open(tmp_path / "1" / "influence.png") as one, Image.open(tmp_path / "2" / "influence.png") as other:
        assert one.size == other.size and (np.asarray(one) == np.asarray(other)).all()
    assert capsys.readouterr().out.count("+10 % of stiffness in one joint and phase of every stride") == 2
