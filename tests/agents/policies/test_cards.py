"""Policies that come with the package: each loads by its name, walks, and has a model card."""

from hashlib import sha256

import pytest

from springfoot.agents import load_policy, policy_card, read_policy
from springfoot.agents.policies import SHIPPED, find_policy
from springfoot.errors import SpringfootError
from springfoot.evaluation import policy_and_settings, record


def test_every_shipped_file_has_a_name():
    folder = find_policy("pretrained").parent
    named = {str(find_policy(name).relative_to(folder)) for name in SHIPPED}
    assert named == {str(path.relative_to(folder)) for path in folder.rglob("*.safetensors")} and len(named) == 23


@pytest.mark.parametrize("name", SHIPPED)
def test_each_loads_by_name_and_has_a_card(name):
    policy = load_policy(name)
    card = policy_card(name)
    assert card.startswith(f"**{name}.** ") and sha256(find_policy(name).read_bytes()).hexdigest() in card
    foot = policy_and_settings(name, {})[1].right_foot
    assert policy.settings.right_foot == foot
    assert f"network: 43 - 64 - 64 - 4, {read_policy(name).activation}; " in card
    assert foot.kind == "intact" or f"right_foot {foot}" in card


def test_a_policy_of_a_foot_walks_on_it():
    policy, settings = policy_and_settings("passive-1-0", {"episode_seconds": 6.0})
    recording = record(policy, settings, name="passive-1-0", episodes=2)
    assert settings.right_foot.kind == "passive" and recording.ticks.min() == 600


def test_another_name_has_no_card():
    with pytest.raises(
        SpringfootError, match="no policy 'mine' in the package; there are pretrained, medium, predicted, passive"
    ):
        policy_card("mine")
