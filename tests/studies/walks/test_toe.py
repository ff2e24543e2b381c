"""The study of the toe joint: valid feet, planted differences, missing walks, and a locked toe that stays straight."""

import csv
from itertools import product

import numpy as np
import pytest

from springfoot.cli.main import study_main
from springfoot.envs.settings import settings_from
from springfoot.studies.walks.effect_numbers import EFFECT_NUMBERS, FIBRE
from springfoot.studies.walks.toe import (
    AGAINST,
    BESIDE,
    FOOT_WORK,
    NUMBERS,
    PASSIVE_ANKLES,
    SOUND_ANKLES,
    TOE_ABSENT,
    TOE_FREE,
    TOE_LOCKED,
    TOES,
    Toe,
    beside_rows,
    compared_rows,
    toe_table,
    toes_at_speed,
    verdict,
    with_foot,
)


def planted(numbers_of, fallen=(), episodes=4):
    """Rows of walks as commanded at 1.0 and 1.2 m/s, whose numbers are 1 but for those of `numbers_of`, a function of
    toe, speed and episode; on the toes `fallen` every episode falls."""
    rows = []
    for toe, speed, episode in product(TOES, (1.0, 1.2), range(episodes)):
        numbers = dict.fromkeys(EFFECT_NUMBERS, 1.0) | {"walked_m_s": speed, **numbers_of(toe, speed, episode)}
        if toe in fallen:
            numbers = dict.fromkeys(numbers)
        fell = float(toe in fallen)
        rows.append(with_foot({"condition": toe, "episode": episode, "speed_m_s": speed, "falls": fell, **numbers}))
    return rows


def found(rows, toe, number):
    """Return the row of `compared_rows` of a toe and a number."""
    (row,) = [row for row in rows if (row["ankles"], row["toe"], row["number"]) == (*toe, number)]
    return row


def test_every_toe_has_valid_settings_and_one_to_be_compared_with():
    for toe, given in TOES.items():
        left, right = settings_from(**given).feet
        assert left == right and toe._replace(toe=AGAINST[toe.ankles]) in TOES
    locked, absent = (settings_from(**TOES[Toe(SOUND_ANKLES, toe)]).feet[0] for toe in (TOE_LOCKED, TOE_ABSENT))
    assert locked.toe.is_locked and absent.one_piece and not locked.one_piece


def test_planted_differences_at_equal_walked_speed_are_paired_by_start_and_told_by_person():
    def dearer(by):
        """Fibre work rises by `by` with a locked toe, and by 2 with each m/s and by 5 with each start on any toe."""
        return lambda toe, speed, episode: {
            FIBRE: 3.0 + 2.0 * speed + 5.0 * episode + by * (toe == Toe(SOUND_ANKLES, TOE_LOCKED)),
            "walked_m_s": speed - 0.1 * (toe == Toe(SOUND_ANKLES, TOE_LOCKED)),
        }

    measured = {name: toes_at_speed(1.05, planted(dearer(by))) for name, by in (("one", 0.5), ("two", 0.7))}
    row = found(compared_rows(1.05, measured), Toe(SOUND_ANKLES, TOE_LOCKED), FIBRE)
    # The locked toe walks 0.1 m/s slower than commanded: at equal speed it costs 0.2 more than at equal command.
    assert (row["one"], row["two"], row["difference"]) == pytest.approx((0.7, 0.9, 0.8))
    reach = 12.706205 * 0.1  # Student's t of one degree of freedom, the error of the mean of two persons
    assert (row["low"], row["high"]) == pytest.approx((0.8 - reach, 0.8 + reach), rel=1e-6) and row["pairs"] == 8
    foot = found(compared_rows(1.05, measured), Toe(SOUND_ANKLES, TOE_LOCKED), FOOT_WORK)
    assert foot["mean"] == 2.0 and foot["difference"] == 0.0


def test_a_toe_on_which_nobody_walks_has_no_numbers_but_its_falls():
    rows = planted(lambda *_: {}, fallen={Toe(SOUND_ANKLES, TOE_ABSENT)})
    measured = {"one": toes_at_speed(1.1, rows)}
    compared = compared_rows(1.1, measured)
    row = found(compared, Toe(SOUND_ANKLES, TOE_ABSENT), FIBRE)
    assert (row["mean"], row["difference"], row["low"], row["pairs"]) == (None, None, None, 0)
    line = next(line for line in toe_table(compared, rows, 1.1, 1.2).splitlines() if "sound ankles, absent" in line)
    assert line == f"| sound ankles, absent | 8 of 8 | {' | '.join('–' * (1 + len(NUMBERS)))} |"
    assert "absent changes push-off – %" in verdict(compared, beside_rows(1.1, measured), 1.1)


def test_published_directions_are_met_where_the_effect_is_planted():
    def as_people(toe, speed, episode):
        """Less push-off of a flexible toe than of a locked one, dearer walks with springs."""
        generator = np.random.default_rng(episode)  # the same start on every toe
        flexible = toe == Toe(PASSIVE_ANKLES, "spring of 60")
        return {
            "ankle_positive_J_kg": 0.2 * (0.84 if flexible else 1.0) + 0.01 * generator.normal(),
            FIBRE: 3.0 + 0.3 * (toe == Toe(SOUND_ANKLES, "spring of 84")),
        }

    rows = {row["effect"]: row for row in beside_rows(1.1, {"one": toes_at_speed(1.1, planted(as_people))})}
    assert set(rows) == set(BESIDE)
    assert rows["toe_pushoff"]["difference"] < 0.0 and rows["toe_pushoff"]["sign_is"] == "right"
    assert rows["stiff_foot_cost"]["difference"] == pytest.approx(10.0)
    assert [rows[name]["sign_is"] for name in ("stiff_foot_cost", "stiff_foot_loss")] == ["right", "unclear"]


@pytest.mark.slow
def test_quick_walks_every_toe_and_locked_toes_do_no_work(tmp_path, capsys):
    assert study_main(["toe", "--quick", "--threads", "1", "--out", str(tmp_path / "out")]) == 0
    assert "passive ankles, locked" in capsys.readouterr().out
    walks = list(csv.DictReader((tmp_path / "out/walks.csv").read_text(encoding="utf-8").splitlines()))
    work = {(row["ankles"], row["toe"]): row["toe_positive_J_kg"] for row in walks if row["toe_positive_J_kg"]}
    assert set(work) <= set(TOES) and float(work[SOUND_ANKLES, TOE_FREE]) > 0.005
    assert (
        float(work[SOUND_ANKLES, TOE_LOCKED]) == pytest.approx(0.0, abs=1e-3) == float(work[SOUND_ANKLES, TOE_ABSENT])
    )
