"""People scrambled, same bits: under the guide "plan" a body and the training of a person know no curve of people.

    python -m benchmarks.scrambled

Everything in people's file but speeds, step lengths and times is replaced by noise. Then the weights of a training by
the preset `predict`, and the series of episodes of `predicted`, are compared with those of the package's file, bit by
bit.
"""

import json
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import tyro

from springfoot.agents.policies.policy import read_policy
from springfoot.agents.training.config import PRESETS
from springfoot.agents.training.training import train
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import record
from springfoot.gait.people.human import PEOPLE_FILE


@dataclass(frozen=True, kw_only=True)
class Scrambled:
    """Do the same with people's file and with noise in its place, and compare every bit."""

    timesteps: int = 3 * PRESETS["predict"].update_steps
    """Steps of the training."""
    episodes: int = 20
    """Episodes of `predicted`."""


def scrambled(seed: int = 0) -> dict[str, Any]:
    """Return the package's file with noise in place of everything but speeds, step lengths and times."""
    random = np.random.default_rng(seed)
    table = json.loads(PEOPLE_FILE.read_text(encoding="utf-8"))

    def noise(value: Any) -> Any:
        if isinstance(value, list):
            return [noise(each) for each in value]
        return value + 0.1 * random.standard_normal() if isinstance(value, float) else value

    for kind in ("mean", "sd"):
        table[kind] = {name: noise(rows) for name, rows in table[kind].items()}
    for condition in table["conditions"]:
        condition["toe_off_percent"] += random.uniform(1, 3)
    table["cop"]["coefficients"] = noise(table["cop"]["coefficients"])
    table["foot"]["plateaus"] = sorted(random.uniform(0, 0.9, 10).tolist())
    table["foot"]["ankle_quasi_stiffness"] = random.uniform(50, 500, 5).tolist()
    for name in ("toe_flat", "toe_off"):
        table["foot"][name] = sorted((np.array(table["foot"][name]) + random.uniform(0, 0.02, 2)).tolist())
    table["foot"]["toe_swing_deg"] = 3.0
    return table


def done(how: Scrambled, folder: Path, people_file: Path | None) -> dict[str, bytes]:
    """Return the values to compare, by name."""
    folder.mkdir()
    file = people_file and str(people_file)
    preset = PRESETS["predict"]
    settings = replace(preset.environment, people_file=file)
    train(replace(preset, timesteps=how.timesteps, threads=1, environment=settings), folder / "run")
    policy = read_policy(folder / "run" / "last.safetensors")
    given: dict[str, Any] = {"people_file": file} if file else {}
    walked = record(*policy_and_settings("predicted", given), name="predicted", episodes=how.episodes, threads=1)
    return {
        "weights": b"".join(np.ascontiguousarray(each).tobytes() for each in (*policy.weights, *policy.biases)),
        "series": b"".join(np.ascontiguousarray(values).tobytes() for values in walked.series.values()),
    }


def main(how: Scrambled) -> int:
    """Compare; 0 if all is equal, else 1."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        noise = Path(place, "noise.json")
        noise.write_text(json.dumps(scrambled()), encoding="utf-8")
        ours = done(how, folder / "people", None)
        theirs = done(how, folder / "noise", noise)
    for name, values in ours.items():
        print(f"{name}: {len(values):,} bytes, {'equal' if values == theirs[name] else 'DIFFERENT'}")
    return 0 if ours == theirs else 1


if __name__ == "__main__":
    sys.exit(main(tyro.cli(Scrambled)))
