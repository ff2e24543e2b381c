"""Recording an evaluation: which episodes are walked, and which files hold one."""

import numpy as np
import pytest

from springfoot.envs.batch.biped_batch import Biped
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import (
    BATCH,
    REWARD,
    Episodes,
    load_recording,
    record,
    record_policies,
    recorded_steps,
)
from springfoot.gait import SpringfootError


def test_every_episode_has_its_own_seed_in_every_batch():
    policy, settings = policy_and_settings("untrained", {"episode_seconds": 0.1})
    many = record(policy, settings, name="untrained", episodes=BATCH + 2, seed=3)
    second = record(policy, settings, name="untrained", episodes=2, seed=3 + BATCH)
    for name, values in second.series.items():
        np.testing.assert_array_equal(many.series[name][BATCH:], values, err_msg=name)
    assert len({values.tobytes() for values in many.series["base"]}) == BATCH + 2


def test_policies_side_by_side_walk_as_each_alone_in_every_batch():
    names = [f"constant:{ankle}" for ankle in ("100,20", "300,60", "200,28")]
    found = {name: policy_and_settings(name, {"episode_seconds": 0.3}) for name in names}
    settings = found[names[0]][1]
    policies = {name: policy for name, (policy, _) in found.items()}
    episodes = BATCH // 2  # two policies in the first batch, the last alone
    together = record_policies(policies, settings, episodes=episodes, seed=5)
    for recording, (name, policy) in zip(together, policies.items(), strict=True):
        alone = record(policy, settings, name=name, episodes=episodes, seed=5)
        assert (recording.policy, recording.seed) == (name, 5)
        for series, values in alone.series.items():
            np.testing.assert_array_equal(recording.series[series], values, err_msg=f"{name} {series}")
        one = recording.of_episode(3)
        assert one.seed == 8 and one.returns == alone.returns[3]
        np.testing.assert_array_equal(one.shown()["angle"], alone.series["angle"][3])
    assert len({recording.series["torque"].tobytes() for recording in together}) == 3


def test_a_walk_that_is_ended_early_keeps_the_series_asked_for_and_shows_every_tick():
    policy, settings = policy_and_settings("schedule", {"episode_seconds": 1.0})
    whole = record(policy, settings, name="schedule", episodes=2)
    biped = Biped(settings, 2)
    biped.reset(np.arange(2), [0, 1])
    kept = Episodes.empty(2, 100, ("com", "force"))
    seen = []
    walk = recorded_steps(biped, policy, kept, on_tick=seen.append)
    for _ in range(20):
        next(walk)
    walk.close()
    assert biped.on_tick is None  # later steps write nowhere
    assert set(kept.series) == {"com", "force", REWARD}
    assert kept.ticks.tolist() == [40, 40] and len(seen) == 40
    for name, values in kept.series.items():
        np.testing.assert_array_equal(values[:, :40], whole.series[name][:, :40])
        assert np.isnan(values[:, 40:]).all()


def test_a_recording_is_of_one_body_at_one_speed():
    policy, settings = policy_and_settings("untrained", {"mass_range": (50.0, 80.0)})
    with pytest.raises(SpringfootError, match="mass_range"):
        record(policy, settings, name="untrained", episodes=1)


@pytest.mark.parametrize("content", [b"", b"not an archive", b"PK\x03\x04 half an archive", b"\x80\x04K\x01."])
def test_a_foreign_file_is_refused_with_one_line(tmp_path, content):
    foreign = tmp_path / "foreign.npz"
    foreign.write_bytes(content)
    with pytest.raises(SpringfootError, match=r"strides\.npz") as caught:
        load_recording(foreign)
    assert "\n" not in str(caught.value)
