"""The study of varying stiffness: planted differences and their intervals, falls, and a search that goes on."""

import csv
from dataclasses import replace

import numpy as np
import pytest

from springfoot.cli.main import study_main
from springfoot.envs import BipedSettings
from springfoot.evaluation.numbers import measure
from springfoot.evaluation.recording import policy_and_settings, record
from springfoot.studies.base.intervals import visible
from springfoot.studies.base.kept import Kept
from springfoot.studies.springs.class_search import TEST_SEED, Condition, PersonsSearch, aim_numbers
from springfoot.studies.springs.links import BESIDE_AIM, Link, compared, fewest_falls, links_table, verdict
from springfoot.studies.springs.stiffness_classes import nested_classes

NAMES = ("constant", "per phase")


def walks(fibre, fell=(), speed=1.2):
    """Return the numbers of episodes whose fibre work is given; those of index `fell` fall."""
    return {
        "fell": [index in fell for index in range(len(fibre))],
        "fibre": list(fibre),
        "likeness": [3.0] * len(fibre),
        "speed_m_s": [speed] * len(fibre),
    }


def planted(difference, spread, episodes, seed):
    """Return a link whose outer class costs `difference` more, episode by episode within `spread`; starts that both
    share differ ten times as much."""
    generator = np.random.default_rng(seed)
    starts = generator.normal(4.0, 10.0 * spread, episodes)
    outer = starts + difference + generator.normal(0.0, spread, episodes)
    return compared("one", "fibre", NAMES, "undisturbed", [(walks(starts), walks(outer))])


def interval(link):
    """Return the ends of the interval of a link that has one."""
    assert link.low is not None and link.high is not None
    return link.low, link.high


def test_intervals_cover_a_planted_difference_and_pairing_takes_the_starts_out():
    ends = [interval(planted(-0.1, 0.1, 24, seed)) for seed in range(100)]
    covered = np.mean([low <= -0.1 <= high for low, high in ends])
    assert 0.89 <= covered <= 0.98  # a percentile bootstrap of 24 is a little short of 95 %
    # Paired differences scatter by 0.1: an interval is some 4 x 0.1 / sqrt(24) wide; unpaired it would be ten times.
    assert np.mean([high - low for low, high in ends]) == pytest.approx(4 * 0.1 / np.sqrt(24), rel=0.1)


def test_a_difference_of_the_smallest_visible_size_is_seen_four_times_in_five():
    spread, episodes = 0.1, 24
    size = (2.069 + 0.858) * spread / np.sqrt(episodes)  # Student's t of 23 degrees of freedom, at 97.5 and 80 %
    links = [planted(-size, spread, episodes, seed) for seed in range(100)]
    assert np.mean([interval(link)[1] < 0.0 for link in links]) == pytest.approx(0.8, abs=0.08)
    assert np.mean([link.visible or 0.0 for link in links]) == pytest.approx(size, rel=0.05)
    none = [planted(0.0, spread, episodes, seed) for seed in range(100)]
    assert np.mean([interval(link)[1] < 0.0 for link in none]) <= 0.07
    assert visible(np.array([0.1])) is None and visible(np.zeros(12)) is None


def test_episodes_that_fall_do_not_count_in_the_difference_but_in_the_falls():
    link = compared("one", "fibre", NAMES, "±300 N", [(walks([4.0, 9.0, 4.2], fell=(1,)), walks([3.9, 3.0, 4.1]))])
    assert link.difference == pytest.approx(-0.1) and link.inner_mean == pytest.approx(4.1)
    assert (link.inner_falls, link.outer_falls, link.episodes) == (1, 0, 3)
    assert link.inner_falls_low < 1 / 3 < link.inner_falls_high
    nobody = compared("one", "fibre", NAMES, "±300 N", [(walks([None, None], fell=(0, 1)), walks([3.9, 3.0]))])
    assert (nobody.difference, nobody.inner_falls) == (None, 2)
    assert "| – | – |" in links_table([nobody])


def test_of_several_persons_their_means_count_and_the_falls_of_all():
    pairs = [(walks([4.0, 4.0], fell=(1,)), walks([3.9, 3.0])), (walks([6.0, 8.0]), walks([5.9, 7.5]))]
    link = compared("all", "fibre", NAMES, "undisturbed", pairs)
    assert (link.inner_mean, link.difference) == (pytest.approx(5.5), pytest.approx(-0.2))
    assert interval(link) == pytest.approx((-0.2 - 12.706205 * 0.1, -0.2 + 12.706205 * 0.1))  # Student's t of 2 persons
    assert (link.episodes, link.inner_falls, link.outer_falls) == (4, 1, 0)


def test_falls_differ_from_the_fewest_on_that_the_test_shows():
    assert (fewest_falls(5), fewest_falls(6), fewest_falls(100)) == (None, 6, 6)  # 2 x (1/2)^6 < 0.05

    def falls_of(alone):
        """Return the sentence on falls if the inner class alone falls in so many of 16 episodes."""
        level = planted(-1.0, 0.1, 16, 0)
        inner, outer = walks([4.0] * 16, fell=range(alone)), walks([4.0] * 16)
        return verdict([level, compared("one", "fibre", NAMES, "±300 N", [(inner, outer)])])

    assert falls_of(5).endswith("Falls differ at no link.")
    assert falls_of(6).endswith("Falls differ with per phase (fibre, ±300 N: 6 to 0 of 16).")


def test_the_verdict_names_the_links_whose_interval_lies_below_0():
    cheaper = planted(-1.0, 0.1, 16, 0)
    same = planted(0.0, 0.1, 16, 1)
    same = Link(**{**vars(same), "inner": "per phase", "outer": "open loop"})
    text = verdict([cheaper, same])
    assert (
        "better than the class within: constant → per phase -1.0" in text
        and "; not better: per phase → open loop." in text
    )
    assert verdict([same]).startswith("For fibre, undisturbed, none is better.")


@pytest.mark.slow
def test_kept_costs_and_numbers_are_not_walked_again(tmp_path, monkeypatch, capsys):
    words = ["when", "--generations", "1", "--population", "2", "--episodes", "2"]
    words += ["--choosing", "1", "--pushes", "100", "--roughness", "0.01", "--seconds", "5.5", "--threads", "1"]
    words += ["--keep", str(tmp_path / "kept")]
    assert study_main([*words, "--out", str(tmp_path / "first")]) == 0
    assert (tmp_path / "first/stiffness.png").stat().st_size > 0
    (folder,) = (tmp_path / "kept").iterdir()  # of the person
    assert len(list(folder.iterdir())) == 1 + 2 * 9  # numbers, and the costs of nine searches for each aim
    monkeypatch.setattr("springfoot.studies.springs.class_search._batch", None)  # walking again would fail
    assert study_main([*words, "--out", str(tmp_path / "second")]) == 0
    for name in ("links.csv", "stiffness.csv"):
        assert (tmp_path / "first" / name).read_bytes() == (tmp_path / "second" / name).read_bytes()
    rows = list(csv.DictReader((tmp_path / "first/links.csv").read_text().splitlines()))
    price = [row for row in rows if row["outer"].endswith("for likeness")]
    assert {row["inner_mean"] for row in price if row["condition"] == "undisturbed"} == {rows[0]["inner_mean"]}
    assert price[0]["outer"] == "constant for likeness" and len(price) == 4 * 3
    likeness = [row for row in rows if row["aim"] == "likeness"]
    assert [(row["inner"], row["outer"]) for row in likeness[::3]] == [
        ("constant", "per phase"),
        ("per phase", "open loop"),
        ("open loop", "linear reflex"),
        ("constant", "open loop"),
        ("constant", "linear reflex"),
        ("linear reflex", "40 ms late"),
        ("linear reflex", "80 ms late"),
    ]
    assert {row["condition"] for row in rows} == {"undisturbed", "±100 N", "rough by 10 mm"}
    told = capsys.readouterr().out
    assert "constant → per phase" in told and "linear reflex → 80 ms late" in told


def test_a_person_of_the_plan_walks_under_the_plan():
    search = PersonsSearch(
        person="predicted",
        owner="person",
        damping_time=None,
        seconds=6.0,
        seed=0,
        population=2,
        choosing=1,
        push_newton=100.0,
        threads=1,
        folder=None,
        kept=Kept(None),
        progress=lambda _: None,
    )
    constant, *_ = nested_classes(BipedSettings())
    numbers = search.test_numbers(constant, np.zeros(constant.size), Condition(), 1)
    act, settings = policy_and_settings("predicted", {"episode_seconds": 6.0})
    own = measure(record(act, settings, name="predicted", episodes=1, seed=TEST_SEED)).metrics
    short = record(act, replace(settings, episode_seconds=0.5), name="predicted", episodes=1)
    assert set(aim_numbers(short).values()) == {None} and {*aim_numbers(short), "fell"} == {*numbers}
    assert not any(numbers["fell"]) and numbers["speed_m_s"][0] == pytest.approx(own["speed_m_s"]["mean"], abs=0.02)
    assert numbers["fibre"][0] == pytest.approx(own["effort"]["fibre_J_kg_m"], rel=0.15)


def test_bad_flags_are_one_line(tmp_path, capsys):
    assert study_main(["when", "--pushes", "0"]) == 2
    assert capsys.readouterr().err == (
        "springfoot study when: error: pushes must be a finite number > 0 and <= 1000 N, got 0.0\n"
    )
    (tmp_path / "file").touch()
    assert study_main(["when", "--keep", str(tmp_path / "file")]) == 2
    assert "keep must be a folder" in capsys.readouterr().err
    assert study_main(["when", "--damping-time", "0.01"]) == 2
    assert capsys.readouterr().err == ("springfoot study when: error: damping_time needs owner 'foot', got 'person'\n")
    assert study_main(["when", "--owner", "foot", "--damping-time", "0.2"]) == 2
    assert "damping_time must be a finite number >= 0 and <= 0.1 s, got 0.2" in capsys.readouterr().err


def test_a_foot_that_varies_is_compared_with_a_passive_one_by_its_work_too(tmp_path):
    words = ["when", "--owner", "foot", "--aims", "fibre", "--generations", "1", "--population", "2", "--episodes", "1"]
    words += ["--choosing", "1", "--pushes", "100", "--roughness", "0.01", "--seconds", "5", "--threads", "1"]
    assert study_main([*words, "--out", str(tmp_path / "out")]) == 0
    rows = list(csv.DictReader((tmp_path / "out/links.csv").read_text().splitlines()))
    level = [row for row in rows if row["condition"] == "undisturbed"]
    assert [(row["aim"], row["inner"], row["outer"]) for row in level] == [
        (aim, f"{inner}{suffix}", f"{outer}{suffix}")
        for aim, suffix in (("fibre", ""), *((beside, " for fibre") for beside in BESIDE_AIM))
        for inner, outer in (
            ("constant", "in the air"),
            ("in the air", "per phase"),
            ("per phase", "open loop"),
            ("constant", "per phase"),
            ("constant", "open loop"),
        )
    ]
    passive = {row["aim"]: float(row["inner_mean"]) for row in level if row["inner"].startswith("constant")}
    assert -passive["foot takes"] < passive["foot work"] < 0.0  # it gives back less than it takes
    report = (tmp_path / "out/report.md").read_text()
    assert "adaptive right foot" in report and "reflex" not in report
