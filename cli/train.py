"""Define the command that trains a policy or continues a run: `train.py`, `springfoot train`."""

import dataclasses
import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from springfoot.agents.training.config import PRESETS, TrainingConfig, require_of_rllib, task_training
from springfoot.command_line import end_in_order, exit_code, parse, stopped_by
from springfoot.envs.settings.settings import CONDITION_SETTINGS, BipedSettings, settings_from, settings_to_json
from springfoot.errors import MOST_THREADS, SpringfootError, require_count
from springfoot.extras import naming_extras
from springfoot.files.writing import require_new
from springfoot.studies.base.flags import given, optional_flags
from springfoot.tasks import MAY_NAME_FILES, MUST_AGREE

PRESET = PRESETS["walk"]
"""Preset with the values that the help shows as defaults."""
ENGINES = Literal["sb3", "rllib"]
RESUMED = {"timesteps", "threads", "device", "reward_weights"}
"""Settings that may change when a run is continued."""
TrainingFlags = optional_flags("TrainingFlags", TrainingConfig, PRESET, leave_out=("environment",))
FOLDER = tyro.conf.arg(metavar="FOLDER", help_behavior_hint="")
EnvironmentFlags = optional_flags("EnvironmentFlags", BipedSettings, PRESET.environment)


@dataclass(frozen=True, kw_only=True)
class TrainFlags:
    """Train a policy that sets the stiffness of ankles and toes, by PPO.

    The first Ctrl-C ends it in good order with a usable policy (exit code 130), the second at once; likewise SIGTERM,
    with exit code 143. Defaults shown are those of the preset walk.
    """

    out: Annotated[Path | None, FOLDER] = None
    """New folder for the run."""
    resume: Annotated[Path | None, FOLDER] = None
    """Folder of a run to continue, with its saved settings, bit for bit as if nothing had interrupted it; on a GPU with
    other random numbers. --timesteps then counts further steps; --threads, --device and --reward-weights may be
    changed."""
    begin_from: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER|POLICY", help_behavior_hint="")] = None
    """Folder of a run, or a policy (`learned`, a file): the training begins with its network in place of an
    untrained one, as to adapt a person to one foot; the task may be another, observations and actions not."""
    seeds: Annotated[int | None, tyro.conf.arg(metavar="INT", help_behavior_hint="")] = None
    """Train from so many seeds at once, --seed and the next ones: one process a processor, one thread each, one
    report with the spread; each in a folder seed-N of --out."""
    preset: Literal["walk", "any-body", "predict", "person"] = "walk"
    """Training that is known to work, which the other flags change. walk: one body at one speed. any-body: people of
    1.45-2.00 m and 40-120 kg at 0.8-1.6 m/s, drawn anew for each episode, with speeds that change within it. predict:
    one body that follows its own plan, no curve of people's. person: a person that walks on any foot."""
    task: Annotated[str | None, tyro.conf.arg(metavar="TASK", help_behavior_hint="")] = None
    """Frozen task of the benchmark, such as Walk-v0 (docs/how-to/benchmark.md), in place of a preset."""
    engine: ENGINES = "sb3"
    """Library that learns: stable-baselines3 on this machine, or RLlib on a Ray cluster (extra `rllib`), that of the
    variable RAY_ADDRESS or this machine. --resume goes on with the engine that began."""
    num_env_runners: Annotated[int | None, tyro.conf.arg(metavar="INT", help_behavior_hint="")] = None
    """Processes of RLlib that collect, on one processor each; one for each processor but one unless given, or the next
    smaller number that divides --num-envs."""
    training: tyro.conf.OmitArgPrefixes[TrainingFlags]  # type: ignore[valid-type]
    """How to train."""
    environment: tyro.conf.OmitArgPrefixes[EnvironmentFlags]  # type: ignore[valid-type]
    """Settings of the environment."""


def train_main(arguments: Sequence[str] | None = None, program: str = "train.py") -> int:
    """Run the command line; return its exit code: 0 trained, 1 a seed of several failed, 2 bad input, 130 Ctrl-C, 143
    SIGTERM.

    `arguments` are those of the process unless given; `program` is the name in messages.
    """
    flags = parse(TrainFlags, arguments, program)
    return exit_code(program, lambda: run_training(flags))


def run_training(flags: TrainFlags) -> int:
    """Check the flags, train or continue a run, and print its result, its folder and the next commands; return the exit
    code."""
    settings = given(flags.training) | given(flags.environment)
    from springfoot.agents.policies.policy import RUN  # here, as below: help and bad flags need no simulator
    from springfoot.agents.training.run_record import runs_within

    # Check the flags against each other.
    if (flags.out is None) == (flags.resume is None):
        raise SpringfootError("give either --out NEW_FOLDER or --resume FOLDER")
    if flags.out is not None:
        try:
            require_new(flags.out)
        except SpringfootError as error:
            runs = [flags.out] if (flags.out / RUN).is_file() else runs_within(flags.out)
            hint = f"; to continue a run, give {_for_folders('--resume', runs)}" if runs else ""
            raise SpringfootError(f"{error}{hint}") from None
    if flags.task is not None and (flags.resume or flags.preset != "walk"):
        raise SpringfootError("--task begins a training with its own preset; drop --resume or --preset")
    if flags.task is not None and (changed := [name for name in (*MUST_AGREE, *MAY_NAME_FILES) if name in settings]):
        raise SpringfootError(f"--task does not leave {changed[0]} open; drop --{changed[0].replace('_', '-')}")
    if flags.num_env_runners is not None:
        if flags.engine != "rllib" and flags.out is not None:
            raise SpringfootError("--num-env-runners is of --engine rllib; give that, or drop it")
        require_count("num_env_runners", flags.num_env_runners, 0, MOST_THREADS)
    if flags.begin_from is not None and (flags.resume or flags.seeds is not None or flags.engine != "sb3"):
        raise SpringfootError("--begin-from begins one run with stable-baselines3; drop --resume, --seeds or --engine")
    if flags.seeds is not None:
        if flags.engine != "sb3":
            raise SpringfootError("--seeds trains with stable-baselines3; drop --engine")
        if flags.resume:
            raise SpringfootError("--seeds begins anew; continue each seed's own by --resume FOLDER/seed-N")
        if "threads" in settings:
            raise SpringfootError("--seeds gives each seed one thread; drop --threads")
        if settings.get("device", "cpu") != "cpu":
            raise SpringfootError("--seeds trains on the CPU; drop --device")
        require_count("seeds", flags.seeds)
    if flags.resume and (fixed := sorted(set(settings) - RESUMED)):
        raise SpringfootError(f"--resume continues with the saved settings; drop --{fixed[0].replace('_', '-')}")
    # Train.
    if flags.resume:
        folder = flags.resume
        record = _resume(flags, settings)
    else:
        assert flags.out is not None
        preset = PRESETS[flags.preset] if flags.task is None else task_training(flags.task)
        config = configured(preset, given(flags.training), given(flags.environment))
        if flags.seeds is not None:
            return run_seeds(config, flags.out, flags.seeds)
        folder = flags.out
        record = _train(flags, config)
    # Tell the result.
    best = record["best"]
    print(f"\n{record['timesteps']:,} steps in {record['seconds']:.0f} s, {record['status']}.")
    if best:
        falls = f"{best['falls']} of {best['episodes']} episodes {_fall_conditions(record)}"
        print(f"Best:    return {best['return_mean']:.1f}, {falls}, after {best['timesteps']:,} steps")
        if not best["timesteps"]:
            print("         It is the policy that training began with: train longer, or try last.safetensors.")
    print(f"Results: {folder} (best.safetensors, last.safetensors, run.json, TensorBoard)")
    print("\n".join(next_lines(record, folder)))
    return stopped_by(record) if record["status"] == "interrupted" else 0


def next_lines(record: dict[str, Any], folder: Path) -> list[str]:
    """Return the lines with the next commands after a training into `folder`; `record` is its run.json."""
    from springfoot.agents.training.run_record import evaluations_of_one_task

    environment = record["config"]["environment"]
    standard = settings_to_json(BipedSettings())
    evaluate = f"springfoot evaluate {_quoted_path(folder)}"
    resume = f"springfoot train --resume {_quoted_path(folder)}"
    interrupted = record["status"] == "interrupted"
    first, *later = evaluations_of_one_task(record) or [{}]
    if later and later[-1]["return_mean"] <= first["return_mean"]:
        more = "" if interrupted else f" --timesteps {record['config']['timesteps']}"
        returns = f"the last return, {later[-1]['return_mean']:.1f}, is not above the first, {first['return_mean']:.1f}"
        lines = [f"Learned: nothing yet, {returns}", f"Next:    {resume}{more}", f"Or:      {evaluate}"]
    else:
        lines = [f"Next:    {evaluate}", *[f"Or:      {resume}"] * interrupted]
    if any(environment[name] != standard[name] for name in CONDITION_SETTINGS):
        lines.append("Note:    evaluate has no pushes, draws nothing unless flags ask: returns differ")
    return lines


def _train(flags: TrainFlags, config: TrainingConfig) -> dict[str, Any]:
    """Train a new run of `config` with the engine of the flags; return the content of its run.json."""
    assert flags.out is not None
    if flags.engine == "rllib":
        require_of_rllib(config)
        return _engine(rllib=True).train(config, flags.out, flags.num_env_runners)
    return _engine(rllib=False).train(config, flags.out, begin_from=flags.begin_from)


def _resume(flags: TrainFlags, settings: dict[str, Any]) -> dict[str, Any]:
    """Continue the run of the flag --resume with the engine that began it; return the content of its run.json.

    `settings` are those given on the command line, of `RESUMED` alone.
    """
    from springfoot.agents.policies.policy import RUN
    from springfoot.agents.training.run_record import is_of_rllib, read_record

    assert flags.resume is not None
    if (flags.resume / RUN).is_file() and is_of_rllib(read_record(flags.resume)):
        if "reward_weights" in settings:
            raise SpringfootError("--resume of a run of RLlib goes on with its reward; drop --reward-weights")
        if "device" in settings:
            raise SpringfootError("--resume of a run of RLlib learns on the CPU; drop --device")
        return _engine(rllib=True).resume(flags.resume, num_env_runners=flags.num_env_runners, **settings)
    if flags.num_env_runners is not None or flags.engine != "sb3":
        raise SpringfootError(f"{flags.resume} is no run of RLlib; drop --engine and --num-env-runners")
    return _engine(rllib=False).resume(flags.resume, **settings)


def _engine(rllib: bool) -> Any:
    """Import and return the module that trains, with RLlib or stable-baselines3; from here on signals end the command
    in good order, and a compilation of kernels is told.

    Not imported above: torch takes seconds, and bad flags need not wait for it.
    """
    if rllib:
        with naming_extras():
            from springfoot.agents.training.cluster import rllib_training as module
    else:
        from springfoot.agents.training import training as module
    from springfoot.compiling import tell_of_compiling

    end_in_order()
    tell_of_compiling()
    return module


def run_seeds(config: TrainingConfig, out: Path, count: int) -> int:
    """Train from `count` seeds, beginning at `config.seed`, each into a folder in `out`; return the exit code.

    Prints a table of the seeds with their spread, the folders, and the next commands.
    """
    from springfoot.agents.policies.policy import RUN
    from springfoot.agents.training import multi_seed

    end_in_order()
    record = multi_seed.train_seeds(config, out, count)
    print(f"\n{multi_seed.training_table(record)}\n")
    print(f"Falls:   episodes that {_fall_conditions(record)}")
    files = "best.safetensors, last.safetensors, run.json, TensorBoard"
    print(f"Results: {out} ({multi_seed.SEEDS}, and in each seed-N: {files})")
    print(f"Next:    springfoot study compare {_quoted_path(out)}/seed-* --no-springs")
    folders = [out / row["folder"] for row in record["seeds"] if row["status"] != "finished"]
    if begun := [folder for folder in folders if (folder / RUN).is_file()]:
        print(f"Or:      {_for_folders('springfoot train --resume', begun)}")
    match record["status"]:
        case "finished":
            return 0
        case "interrupted":
            return stopped_by(record)
        case _:  # one failed
            return 1


def _fall_conditions(record: dict[str, Any]) -> str:
    """Return words on the falls of a training: the pushes of its episodes and their length.

    `record` is its run.json or seeds.json.
    """
    environment = record["config"]["environment"]
    pushes = f" under pushes of ±{environment['push_newton']:g} N" if environment["push_newton"] else ""
    return f"fell{pushes} within {environment['episode_seconds']:g} s"


def _for_folders(command: str, folders: Sequence[Path]) -> str:
    """Return the advice to give `command` to the first of several folders, and then to the others, which it names."""
    first, *others = folders
    then = f", then so with {', '.join(folder.name for folder in others)}" if others else ""
    return f"{command} {_quoted_path(first)}{then}"


def _quoted_path(folder: Path) -> str:
    """Return the path of a folder, quoted for a shell."""
    return shlex.quote(str(folder))


def configured(preset: TrainingConfig, training: dict[str, Any], environment: dict[str, Any]) -> TrainingConfig:
    """Return the configuration of a preset, with values of the command line in place of the preset's.

    `training` holds settings of the training, `environment` those of the environment, both by name.
    """
    if "reward_weights" in environment:  # the others stay the preset's
        environment = environment | {
            "reward_weights": preset.environment.reward_weights | environment["reward_weights"]
        }
    settings = settings_from(**settings_to_json(preset.environment) | environment)
    return dataclasses.replace(preset, **training, environment=settings)
