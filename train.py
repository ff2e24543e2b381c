"""Train a policy (`python train.py --out runs/walk`) or go on with a run (`python train.py --resume runs/walk`)."""

import dataclasses
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from springfoot.agents.command_line import exit_code
from springfoot.agents.config import PRESETS, TrainingConfig
from springfoot.agents.flags import given, optional_flags
from springfoot.envs.settings import BipedSettings, settings_from, settings_to_json
from springfoot.gait.errors import SpringfootError, require_count

PRESET = PRESETS["walk"]
TrainingFlags = optional_flags("TrainingFlags", TrainingConfig, PRESET, leave_out=("environment",))
FOLDER = tyro.conf.arg(metavar="FOLDER", help_behavior_hint="")
EnvironmentFlags = optional_flags("EnvironmentFlags", BipedSettings, PRESET.environment)


@dataclass(frozen=True, kw_only=True)
class Flags:
    """Train a policy that sets the stiffness of ankles and toes, by PPO.

    The first Ctrl-C ends it in good order with a usable policy (exit code 130). Defaults shown are those of
    the preset walk.
    """

    out: Annotated[Path | None, FOLDER] = None
    """New folder for the run."""
    resume: Annotated[Path | None, FOLDER] = None
    """Folder of a run to go on with, with its saved settings; --timesteps is then how many more."""
    seeds: Annotated[int | None, tyro.conf.arg(metavar="INT", help_behavior_hint="")] = None
    """Train from so many seeds at once, --seed and the next ones: one process a processor, one thread each, one
    report with the spread; each in a folder seed-N of --out."""
    preset: Literal["walk", "any-body"] = "walk"
    """Training that is known to work, from which the other flags differ: one body at one speed, or people of
    1.45-2.00 m and 40-120 kg at 0.8-1.6 m/s, drawn anew for each episode, with speeds that change within it."""
    training: tyro.conf.OmitArgPrefixes[TrainingFlags]  # type: ignore[valid-type]
    """How to train."""
    environment: tyro.conf.OmitArgPrefixes[EnvironmentFlags]  # type: ignore[valid-type]
    """What to train on."""


def main() -> int:
    """Exit code: 0 trained, 1 a seed of several failed, 2 bad input, 130 ended by Ctrl-C."""
    flags = tyro.cli(Flags)
    return exit_code("train.py", lambda: run(flags))


def run(flags: Flags) -> int:
    """Trains, or goes on, and says where the results lie."""
    settings = given(flags.training) | given(flags.environment)
    if (flags.out is None) == (flags.resume is None):
        raise SpringfootError("give either --out NEW_FOLDER or --resume FOLDER")
    if flags.seeds is not None:
        if flags.resume:
            raise SpringfootError("--seeds begins anew; go on with each seed's own folder by --resume FOLDER/seed-N")
        if "threads" in settings:
            raise SpringfootError("--seeds gives each seed one thread; drop --threads")
        require_count("seeds", flags.seeds)
    if flags.resume and (fixed := sorted(set(settings) - {"timesteps"})):
        raise SpringfootError(f"--resume goes on with the saved settings; drop --{fixed[0].replace('_', '-')}")
    if flags.resume:
        from springfoot.agents import training  # torch takes seconds; bad flags are told without waiting for it

        folder, record = flags.resume, training.resume(flags.resume, settings.get("timesteps"))
    else:
        assert flags.out is not None
        config = configured(PRESETS[flags.preset], given(flags.training), given(flags.environment))
        if flags.seeds is not None:
            return run_seeds(config, flags.out, flags.seeds)
        from springfoot.agents import training

        folder, record = flags.out, training.train(config, flags.out)
    interrupted, best = record["status"] == "interrupted", record["best"]
    print(f"\n{record['timesteps']:,} steps in {record['seconds']:.0f} s, {record['status']}.")
    if best:
        falls = f"{best['falls']} of {best['episodes']} episodes fell"
        print(f"Best:    return {best['return_mean']:.1f}, {falls}, after {best['timesteps']:,} steps")
    print(f"Results: {folder} (best.safetensors, last.safetensors, run.json, TensorBoard)")
    print(f"Next:    python evaluate.py {folder}")
    if interrupted:
        print(f"Or:      python train.py --resume {folder}")
    return 130 if interrupted else 0


def run_seeds(config: TrainingConfig, out: Path, count: int) -> int:
    """Trains from several seeds and says how far they agree and where the results lie."""
    from springfoot.agents import multi_seed as seeds

    record = seeds.train_seeds(config, out, count)
    print(f"\n{seeds.seeds_table(record)}\n")
    print(
        f"Results: {out} ({seeds.SEEDS}, and in each seed-N: best.safetensors, last.safetensors, run.json, TensorBoard)"
    )
    print(f"Next:    python -m springfoot.studies.comparison seeds {out}/seed-*")
    if record["status"] == "interrupted":
        print(f"Or:      python train.py --resume {out}/seed-N, for each N that was interrupted")
    return {"finished": 0, "interrupted": 130}.get(record["status"], 1)


def configured(preset: TrainingConfig, training: dict[str, Any], environment: dict[str, Any]) -> TrainingConfig:
    """The preset with what was given on the command line in its place."""
    settings = settings_from(**settings_to_json(preset.environment) | environment)
    return dataclasses.replace(preset, **training, environment=settings)


if __name__ == "__main__":
    sys.exit(main())
