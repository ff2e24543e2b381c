"""People scrambled, same bits: under the guide "plan" a body, a search and a training know no curve of people.

    python -m benchmarks.scrambled

Everything in people's file but speeds, step lengths and times is replaced by noise. Then what candidates pay and the
constants after generations of a search near the plan from `generic` constants, and of one of least effort from the
package's, the weights of a training, and the series of episodes
of `predicted` are compared with those of the package's file, bit by bit.
"""

import json
import sys
import tempfile
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import tyro

from springfoot.agents.policies.policy import read_policy
from springfoot.agents.training.config import PRESETS
from springfoot.agents.training.training import train
from springfoot.envs.control import GENERIC
from springfoot.envs.control.constants import leg_constants
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import record
from springfoot.gait.people.human import PEOPLE_FILE
from springfoot.studies.searches.constants_file import read_constants, write_constants
from springfoot.studies.searches.leg_tuning import LegTuning


@dataclass(frozen=True, kw_only=True)
class Scrambled:
    """Do the same with people's file and with noise in its place, and compare every bit."""

    generations: int = 3
    """Generations of the search."""
    timesteps: int = 50_000
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
    constants = folder / "legs.json"
    file = people_file and str(people_file)
    write_constants(constants, {"constants": {}, "found_by": {}})
    search = LegTuning(
        guide="plan",
        start=GENERIC,
        push_newton=0.0,
        generations=how.generations,
        population=8,
        threads=1,
        constants=constants,
        people_file=people_file,
        log=folder / "costs.json",
    )
    search.ask(lambda progress: None)
    walking = folder / "walking.json"
    known = {"predicted": asdict(leg_constants("planned", "people", follows_plan=True))}
    write_constants(walking, {"constants": known, "found_by": {}})
    replace(search, start="", pays="effort", constants=walking, log=folder / "effort.json").ask(lambda progress: None)
    costs = [json.loads((folder / name).read_text(encoding="utf-8"))["costs"] for name in ("costs.json", "effort.json")]
    preset = PRESETS["predict"]
    settings = replace(preset.environment, people_file=file)
    train(replace(preset, timesteps=how.timesteps, threads=1, environment=settings), folder / "run")
    policy = read_policy(folder / "run" / "last.safetensors")
    given: dict[str, Any] = {"people_file": file} if file else {}
    walked = record(*policy_and_settings("predicted", given), name="predicted", episodes=how.episodes, threads=1)
    return {
        "what candidates pay": json.dumps(costs).encode(),
        "constants": json.dumps([read_constants(each)["constants"] for each in (constants, walking)]).encode(),
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
