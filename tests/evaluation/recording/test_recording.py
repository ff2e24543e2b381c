"""Recording an evaluation: which episodes are walked, and which files hold one."""

import numpy as np
import pytest

from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import BATCH, load_recording, record
from springfoot.gait import SpringfootError


def test_every_episode_has_its_own_seed_in_every_batch():
    policy, settings = policy_and_settings("untrained", {"episode_seconds": 0.1})
    many = record(policy, settings, name="untrained", episodes=BATCH + 2, seed=3)
    second = record(policy, settings, name="untrained", episodes=2, seed=3 + BATCH)
    for name, values in second.series.items():
        np.testing.assert_array_equal(many.series[name][BATCH:], values, err_msg=name)
    assert len({values.tobytes() for values in many.series["base"]}) == BATCH + 2


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
