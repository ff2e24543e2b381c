"""The themes of the settings: the groups of `--help` and of the table of `SegmentedFootBiped`."""

THEMES = {
    "body": "Whose body walks.",
    "feet": "What its feet are: intact, prosthetic, weak.",
    "speed": "How fast it is commanded to walk.",
    "reference": "Whose walk it is held to.",
    "springs": "What its ankle and toe springs do, and which part of that the action decides.",
    "episode": "How an episode starts and ends.",
    "ground": "What it walks on.",
    "disturbance": "What disturbs it: pushes, noise of the sensors, delay of the actuators.",
    "reward": "What it is rewarded for.",
}
"""The themes of the settings, and what each one says."""
CONDITION_THEMES = ("body", "speed", "episode", "ground", "disturbance")
"""Themes that say who walks where, whatever the policy was trained on."""
