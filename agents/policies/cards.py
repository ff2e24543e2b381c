"""Describe the policies that come with the package: a model card each, made from their files."""

from hashlib import sha256
from typing import Any

from springfoot.envs.batch.learned_person import LEARNED
from springfoot.envs.settings.settings import BipedSettings, settings_to_json
from springfoot.errors import SpringfootError, perhaps
from springfoot.files.text_table import read_bytes

from .policy import PRETRAINED_BY, SHIPPED, find_policy, read_policy

MADE = {
    "pretrained": (
        "Walks on level ground at 1.2 m/s, and goes on when it is pushed.",
        f"`{PRETRAINED_BY}`",
        "docs/results/walk.md",
    ),
    "expert": (
        "Sets the stiffness on the frozen task Walk-v0, where `learned` walks; a set for offline learning.",
        "`springfoot train --task Walk-v0 --timesteps 500000 --out runs/expert`",
        "docs/results/leaderboard.md",
    ),
    "medium": (
        "The same after a fifth of the training, worse than the best constant springs; another such set.",
        "`springfoot train --task Walk-v0 --timesteps 100000 --out runs/medium`",
        "benchmarks/submissions/Walk-v0/medium/judged.json",
    ),
    **{
        name: (
            "Moves hips, knees and ankles too, on any foot, body, speed, step time and slope that it drew.",
            f"`springfoot train --preset person --seed {LEARNED[name].rpartition('-')[2]}`, its last policy",
            "docs/results/persons.md",
        )
        for name in SHIPPED
        if name.startswith("learned")
    },
    "predicted": (
        "Walks by a plan that knows no person's curves; it moves hips, knees and ankles too, from untuned constants.",
        "`springfoot train --preset predict --seed 1`, its last policy",
        "docs/results/prediction.md",
    ),
}
"""Policy -> purpose, the command that made it, and the file of its results."""
SHARED_LIMITS = "One planar body in simulation; a stiffness that walks here is none for a patient's foot."
"""Limits of every policy that comes with the package."""
ONE_BODY = " {} and other bodies were not trained: measure them first (`springfoot study compare --world`)."
"""Further limits of those that were trained on one body, the untrained ground and load in the braces."""
ACTED_ON = {
    "stiffness": "four stiffnesses",
    "person": "six rest angles",
    "both": "four stiffnesses and six rest angles",
}
"""Setting `acts` -> the actions in words."""


def _in_short(value: Any) -> Any:
    """Return a setting's value, or of a long list of dictionaries its length in words."""
    is_long = isinstance(value, list) and len(value) > 2 and all(isinstance(entry, dict) for entry in value)
    return f"({len(value)} entries, in the file's header)" if is_long else value


def policy_card(name: str) -> str:
    """Return the model card of one of `SHIPPED`, as Markdown; raise `SpringfootError` for another name."""
    if name not in SHIPPED:
        raise SpringfootError(
            f"no policy {name!r} in the package; there are {', '.join(SHIPPED)}{perhaps(name, SHIPPED)}"
        )
    policy = read_policy(name)
    purpose, command, results = MADE[name]
    defaults = settings_to_json(BipedSettings())
    changed = {key: value for key, value in settings_to_json(policy.settings).items() if value != defaults[key]}
    layers = " - ".join(map(str, policy.layer_sizes))
    differences = ", ".join(f"{key} {_in_short(value)}" for key, value in changed.items())
    legs = ", for each leg, the right one's mirrored" if policy.mirror is not None else ""
    level = policy.settings.slope_range_deg == BipedSettings().slope_range_deg
    further = "" if policy.settings.drawn_bodies else ONE_BODY.format("Slopes, loads" if level else "Loads")
    lines = [
        f"made by: {command}",
        f"results and falls: {results}",
        f"network: {layers}, {policy.activation}{legs}; observations to {ACTED_ON[policy.settings.acts]}",
        f"settings of its training, where not the defaults: {differences or 'none'}",
        f"limits: {SHARED_LIMITS}{further}",
        f"SHA-256: `{sha256(read_bytes(find_policy(name))).hexdigest()}`",
    ]
    return "\n- ".join([f"**{name}.** {purpose}\n", *lines])
