"""Policies that come with the package: each loads by its name, walks, and has a model card."""

from hashlib import sha256

import pytest

from springfoot.agents import policy_card, read_policy
from springfoot.agents.policies import SHIPPED, find_policy
from springfoot.envs.batch.learned_person import LEARNED, PERSONS_FOLDER
from springfoot.errors import SpringfootError


def test_every_shipped_file_has_a_name():
    folders = find_policy("pretrained").parent, PERSONS_FOLDER
    assert {find_policy(name) for name in SHIPPED} == {path for folder in folders for path in folder.iterdir()}


@pytest.mark.parametrize("name", SHIPPED)
def test_each_loads_by_name_and_has_a_card(name):
    policy = read_policy(name)
    card = policy_card(name)
    assert card.startswith(f"**{name}.** ") and sha256(find_policy(name).read_bytes()).hexdigest() in card
    layers = "83 - 256 - 256 - 5, tanh, for each leg, the right one's mirrored"
    assert f"network: {layers if name in LEARNED else f'43 - 64 - 64 - 4, {policy.activation}'}; " in card
    assert ("Slopes, loads and other bodies were not trained" in card) == (policy.settings.slope_range_deg is None)


def test_another_name_has_no_card():
    with pytest.raises(
        SpringfootError,
        match=r"no policy 'mine' in the package; there are pretrained, .*, learned, .*, learned-5, predicted$",
    ):
        policy_card("mine")
