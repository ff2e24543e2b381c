"""Every reader of files, and small valid files for each to begin with."""

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from cma import CMAEvolutionStrategy
from safetensors.numpy import save

from springfoot.agents.policies.foreign import contract_path, onnx_policy
from springfoot.agents.policies.policy import RUN, find_policy, read_policy
from springfoot.agents.policies.schedule_files import schedule_file
from springfoot.agents.training.checkpoint import STATE_KEY, read_checkpoint
from springfoot.agents.training.config import TrainingConfig, config_to_json
from springfoot.agents.training.run_record import read_record
from springfoot.arrays import NDArray
from springfoot.envs.batch.learned_person import PERSON_NAMES, POLICY_ENTRIES, LearnedPerson, person_file
from springfoot.envs.control.constants import constants_from
from springfoot.envs.control.reference_walk import reference_walks
from springfoot.envs.settings.settings import BipedSettings, settings_from, settings_to_json
from springfoot.errors import SpringfootError
from springfoot.evaluation.benchmark.leaderboard import leaderboard
from springfoot.evaluation.benchmark.submission import JUDGED, SUBMISSION, read_submission
from springfoot.evaluation.benchmark.task_walks import EPISODES
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import Recording, load_recording, record
from springfoot.evaluation.report.schedule_tables import finite_states, write_schedules
from springfoot.files.json_file import read_object
from springfoot.files.tensor_file import DIGEST, read_tensors, write_tensors
from springfoot.gait.people.fit_human import COP_TABLE, CURVES_TABLE, TOE_TABLE, fit
from springfoot.gait.people.gait_events import PERCENT
from springfoot.gait.people.human import COLUMNS, PEOPLE_FILE, HumanGait, foot_habits, harmonics, human_gait
from springfoot.gait.people.own_data import OwnGait, read_gait
from springfoot.gait.plan.walk_style import STYLES, styles_of
from springfoot.gait.springs.foot_file import read_foot
from springfoot.studies.base.flags import read_json
from springfoot.studies.base.kept import Kept
from springfoot.studies.base.stage_seconds import StageSeconds
from springfoot.studies.searches.cma_search import generations
from springfoot.studies.searches.constants_file import CONSTANTS, read_constants, read_styles
from springfoot.studies.walks.learning_curves import read_finished

TASK = BipedSettings()


@dataclass(frozen=True, kw_only=True)
class Reader:
    """A way to read files."""

    read: Callable[[Path], Any]
    """Reads one and uses its content, or raises `SpringfootError`."""
    suffix: str
    """Ending of its files' names."""
    bases: tuple[bytes, ...]
    """Valid files."""


def readers(folder: Path) -> dict[str, Reader]:
    """Return every reader by name; `folder` holds the parts of their files."""
    walk = record(*policy_and_settings("schedule", {"episode_seconds": 4.0}), name="schedule", episodes=1)
    recording = folder / "strides.npz"
    walk.save(recording)
    own = OwnGait.from_json(read_gait(_write(folder / "own.csv", _percent())).to_json())
    found = {
        "policy": Reader(
            read=_walk_on, suffix=".safetensors", bases=(_policy(), find_policy("pretrained").read_bytes())
        ),
        "person": Reader(read=_person, suffix=".safetensors", bases=(_person_file(),)),
        "training state": Reader(read=_state, suffix=".safetensors", bases=(_state_file(),)),
        "header of a checkpoint": Reader(read=_checkpoint, suffix=".json", bases=(json.dumps(_header()).encode(),)),
        "record of a run": Reader(read=_record, suffix=".json", bases=(json.dumps(_run()).encode(),)),
        "recording": Reader(read=load_recording, suffix=".npz", bases=(recording.read_bytes(),)),
        "schedule": Reader(read=_schedule, suffix=".csv", bases=(_schedule_table(walk, folder),)),
        "finite states": Reader(
            read=_schedule, suffix=".json", bases=(json.dumps(finite_states(walk, [0, 1])).encode(),)
        ),
        "own data, mean curves": Reader(read=_own, suffix=".csv", bases=(_percent(), _percent(("knee", "ankle")))),
        "own data over time": Reader(read=_own, suffix=".csv", bases=(_over_time(),)),
        "own data of OpenSim": Reader(read=_own, suffix=".mot", bases=(_opensim(),)),
        "own data of Visual3D": Reader(read=_own, suffix=".txt", bases=(_visual3d(),)),
        "own data of Nexus": Reader(read=_own, suffix=".csv", bases=(_nexus(),)),
        "own data, C3D": Reader(read=_own, suffix=".c3d", bases=_c3d(folder)),
        "foot, table": Reader(read=_foot, suffix=".csv", bases=(_foot_table(),)),
        "foot, JSON": Reader(read=_foot, suffix=".json", bases=tuple(json.dumps(foot).encode() for foot in _FEET)),
        "settings": Reader(
            read=lambda path: settings_from(**read_object(path, "settings")),
            suffix=".json",
            bases=(json.dumps(settings_to_json(TASK) | {"human": own.to_json()}).encode(),),
        ),
        "people": Reader(read=_people, suffix=".json", bases=(PEOPLE_FILE.read_bytes(),)),
        "people's curves": Reader(read=_curves(folder), suffix=".csv", bases=(_reference_table(folder),)),
        "plan": Reader(read=_plan, suffix=".json", bases=(_plan_file(),)),
        "leg constants": Reader(read=_constants, suffix=".json", bases=(CONSTANTS.read_bytes(),)),
        "styles of a search": Reader(read=_styles, suffix=".json", bases=(STYLES.read_bytes(),)),
        "costs of a search": Reader(read=_search, suffix=".json", bases=(_searched(folder),)),
        "numbers of a study": Reader(read=Kept, suffix=".json", bases=(b'{"[1, \\"a\\"]": {"falls": 0.0}}',)),
        "seconds of stages": Reader(read=StageSeconds, suffix=".json", bases=(b'{"plans": 12.5, "person": 3.0}',)),
        "submission": Reader(read=_submission(folder), suffix=".json", bases=(_submitted(),)),
        "judgement": Reader(read=_judgement(folder), suffix=".json", bases=(_judged(),)),
        "setting in JSON": Reader(
            read=_setting, suffix=".json", bases=tuple(json.dumps(foot).encode() for foot in _FEET)
        ),
        "run with curves of learning": Reader(read=_learning, suffix=".json", bases=(json.dumps(_run()).encode(),)),
        "ONNX": Reader(read=onnx_policy, suffix=".onnx", bases=_onnx(folder)),
        "contract of an ONNX file": Reader(
            read=_contract(folder), suffix=".json", bases=(contract_path(folder / "walk.onnx").read_bytes(),)
        ),
    }
    return {name: reader for name, reader in found.items() if reader.bases}


def _write(path: Path, content: bytes) -> Path:
    path.write_bytes(content)
    return path


# Submissions to the benchmark ---------------------------------------------------------------------------------


def _submitted() -> bytes:
    digest = sha256(b"schedule").hexdigest()
    episodes = {"returns": [1.5] * EPISODES, "return_mean": 1.5, "fell": [0] * EPISODES, "falls": 0}
    return json.dumps(
        {"name": "schedule", "task": "Walk-v0", "policy": "schedule", "policy_digest": digest, **episodes}
    ).encode()


def _judged() -> bytes:
    numbers = {"return_mean": 1.5, "falls": 0, "drawn_return_mean": 1.25, "drawn_falls": 1}
    return json.dumps({"task": "Walk-v0", "policy_digest": sha256(b"schedule").hexdigest(), **numbers}).encode()


def _submission(folder: Path) -> Callable[[Path], Any]:
    (folder / "submitted").mkdir()

    def read(path: Path) -> Any:
        _write(folder / "submitted" / SUBMISSION, path.read_bytes())
        return read_submission(folder / "submitted").walks.summary

    return read


def _judgement(folder: Path) -> Callable[[Path], Any]:
    (folder / "judged").mkdir()
    _write(folder / "judged" / SUBMISSION, _submitted())

    def read(path: Path) -> Any:
        _write(folder / "judged" / JUDGED, path.read_bytes())
        return leaderboard(folder / "judged")

    return read


# Policies, states, records -----------------------------------------------------------------------------------


def _person_file() -> bytes:
    header, tensors = read_tensors(person_file("learned"), "springfoot", "policy", POLICY_ENTRIES)
    return save(tensors, {"springfoot": json.dumps(header)})  # without a digest


def _person(path: Path) -> None:
    """Read a person and let it act."""
    person = LearnedPerson(str(path), "people")
    offsets = person.offsets(np.ones((2, len(PERSON_NAMES)), np.float32), np.ones(2, bool))
    if not np.isfinite(offsets).all():
        raise ValueError("offsets must be finite")


def _policy() -> bytes:
    policy = read_policy("pretrained")
    tensors = {"observation.mean": policy.observation_mean, "observation.variance": policy.observation_variance}
    for layer, (weight, bias) in enumerate(zip(policy.weights, policy.biases, strict=True)):
        tensors |= {f"layer.{layer}.weight": weight, f"layer.{layer}.bias": bias}
    return save(tensors, {"springfoot": json.dumps(policy.header)})  # without a digest, as earlier versions wrote it


def _walk_on(path: Path) -> None:
    policy = read_policy(path)
    policy(np.ones((3, policy.layer_sizes[0])))


def _state_file() -> bytes:
    tensors = {"network.bias": np.zeros(4, np.float32), "adam.0.step": np.float32(3.0), "return.var": np.float64(1.0)}
    header = json.dumps({"timesteps": 64})
    return save({name: np.asarray(value) for name, value in tensors.items()}, {"springfoot-training": header})


def _state(path: Path) -> None:
    read_tensors(path, "springfoot-training", "training state", {"timesteps", DIGEST})


def _header() -> dict[str, Any]:
    generator = np.random.PCG64(0).state
    return {
        "timesteps": 64,
        "config": config_to_json(TrainingConfig()),
        "fingerprint": {"legs": "0"},
        "record": {"sessions": [{"from_timesteps": 0}], "evaluations": _run()["evaluations"]},
        "seconds": 1.5,
        "events": {"events.out.tfevents.1": 64},
        "learning": {
            "generators": [generator],
            "actions": generator,
            "numpy": [1, 0, 0.0],
            "python_gauss": None,
            "updates": 1,
            "episodes": [{"r": 1.5, "l": 10}],
            "logged": {"time/fps": [1.5, []]},
        },
    }


def _checkpoint(path: Path) -> None:
    """Change the header alone: the file is sealed anew."""
    header = read_object(path, "header")
    state = path.with_suffix(".safetensors")
    try:
        write_tensors(state, STATE_KEY, header, {})
    except ValueError as error:  # no JSON
        raise SpringfootError(str(error)) from None
    read_checkpoint(state)


def _run() -> dict[str, Any]:
    evaluation = {"timesteps": 64, "seconds": 1.0, "return_mean": 3.5, "return_sd": 0.5, "falls": 0, "episodes": 16}
    timed = {"seconds": 1.0, "timesteps": 64}
    return {"config": config_to_json(TrainingConfig()), "sessions": [{}], "evaluations": [evaluation]} | timed


def _record(path: Path) -> None:
    read_record(_write(path.with_name(RUN), path.read_bytes()).parent)


# Schedules, own data, feet -----------------------------------------------------------------------------------


def _people(path: Path) -> None:
    harmonics.cache_clear()  # by name
    foot_habits.cache_clear()
    reference_walks(settings_from(people_file=str(path)))


def _curves(folder: Path) -> Callable[[Path], Any]:
    def read(path: Path) -> None:
        (folder / CURVES_TABLE).write_bytes(path.read_bytes())
        fit(folder)

    return read


def _reference_table(folder: Path) -> bytes:
    """Write the other two files of a fit to people, and return the table of their curves at two speeds."""
    phase = PERCENT / 100
    slow, quick = (human_gait(speed) for speed in (0.9, 1.3))
    toe = {COLUMNS["toe"] + end: np.degrees(values) for end, values in _both(slow, "toe", phase)}
    (folder / TOE_TABLE).write_bytes(_table({"percent": PERCENT} | toe))
    forward = [f"{0.002 * percent - 0.05:g}" if percent <= 60 else "" for percent in PERCENT.tolist()]
    rows = [f"{percent},{cop}" for percent, cop in zip(PERCENT.tolist(), forward, strict=True)]
    (folder / COP_TABLE).write_text("\n".join(["percent,cop_forward_from_ankle_m", *rows]), encoding="utf-8")
    lines = []
    for name, people in {"slow": slow, "quick": quick}.items():
        numbers = {"speed_m_s": people.speed, "stride_time_s": people.stride_time}
        numbers |= {"step_length_m": people.step_length, "toe_off_percent": 100 * people.toe_off}
        columns = {"percent": PERCENT} | {key: value + 0 * PERCENT for key, value in numbers.items()}
        for curve, column in COLUMNS.items():
            columns |= {column + end: _shown(curve, values) for end, values in _both(people, curve, phase)}
        head, *rows = _table(columns).decode().splitlines()
        lines += (
            [f"{row},{name}" for row in rows] if lines else [f"{head},condition", *(f"{row},{name}" for row in rows)]
        )
    return ("\n".join(lines) + "\n").encode()


def _both(people: HumanGait, name: str, phase: NDArray) -> Iterator[tuple[str, NDArray]]:
    yield "", people.mean(name, phase)
    yield "_sd", people.sd(name, phase)


def _schedule_table(walk: Recording, folder: Path) -> bytes:
    write_schedules(folder, walk)
    rows = (folder / "stiffness_schedule.csv").read_text(encoding="utf-8").splitlines()
    return "\n".join(row.rpartition(",")[0] for row in rows).encode()  # without its digest


def _schedule(path: Path) -> None:
    given, make = schedule_file(str(path), TASK)
    settings = settings_from(**given)
    make(settings)(np.zeros((2, 43), np.float32))


def _own(path: Path) -> None:
    read_gait(path).gait(1.2, 1.7).mean("ankle", 0.3)


def _table(columns: dict[str, Any], head: str = "", separator: str = ",") -> bytes:
    rows = zip(*columns.values(), strict=True)
    lines = [separator.join(columns), *(separator.join(f"{value:.6g}" for value in row) for row in rows)]
    return (head + "\n".join(lines) + "\n").encode()


def _percent(names: tuple[str, ...] = tuple(COLUMNS)) -> bytes:
    people = human_gait(1.2)
    phase = PERCENT / 100
    return _table({"percent": PERCENT} | {COLUMNS[name]: _shown(name, people.mean(name, phase)) for name in names})


def _shown(name: str, values: Any) -> Any:
    return np.degrees(values) if COLUMNS[name].endswith("_deg") else values


def _time() -> Any:
    return np.arange(400) / 100


def _over_time() -> bytes:
    people = human_gait(1.2)
    columns = {"time_s": _time()}
    for side, offset in (("left", 0.2), ("right", 0.7)):
        phase = _time() / people.stride_time + offset
        for name in ("thigh", "knee", "ankle", "grf_vertical", "grf_forward"):
            columns[f"{COLUMNS[name]}_{side}"] = _shown(name, people.mean(name, phase))
    return _table(columns)


def _opensim() -> bytes:
    people = human_gait(1.2)
    columns = {"time": _time(), "pelvis_tilt": 0 * _time(), "pelvis_tx": 1.2 * _time()}
    for side, offset in (("l", 0.2), ("r", 0.7)):
        phase = _time() / people.stride_time + offset
        for name, column in {"thigh": "hip_flexion", "knee": "knee_angle", "ankle": "ankle_angle"}.items():
            columns[f"{column}_{side}"] = np.degrees(people.mean(name, phase))
    return _table(columns, "walk.mot\nnRows=400\ninDegrees=yes\nendheader\n", "\t")


def _visual3d() -> bytes:
    people = human_gait(1.2)
    columns = {"": np.arange(1, len(PERCENT) + 1)}
    for name, joint in {"thigh": "Hip", "knee": "Knee", "ankle": "Ankle"}.items():
        columns[f"L{joint}Angle"] = np.degrees(people.mean(name, PERCENT / 100))
    names, *rows = _table(columns, separator="\t").decode().splitlines()
    heads = [f"\t{word}" * (len(columns) - 1) for word in ("walk.c3d", "LINK_MODEL_BASED", "ORIGINAL")]
    components = "ITEM" + "\tX" * (len(columns) - 1)
    return "\n".join([heads[0], names, *heads[1:], components, *rows, ""]).encode()


def _nexus() -> bytes:
    people = human_gait(1.2)
    frames = np.arange(1, 401)
    columns = {"Frame": frames, "Sub Frame": 0 * frames}
    for letter, offset in (("L", 0.2), ("R", 0.7)):
        for name, joint in {"hip": "Hip", "knee": "Knee", "ankle": "Ankle"}.items():
            angle = np.degrees(people.mean(name, frames / 100 / people.stride_time + offset))
            columns |= {f"A:{letter}{joint}Angles {axis}": angle for axis in "XYZ"}
    rows = _table(columns).decode().splitlines()[1:]
    names = ",,".join(["", *(f"{column[:-2]}," for column in columns if column.endswith(" X"))])
    components = ",".join(["Frame", "Sub Frame", *"XYZ" * 6])
    strikes = [f"A,{side},Foot Strike,{0.3 * k + 0.2}," for k, side in enumerate(("Left", "Right") * 3)]
    head = ["Events", "100", "Subject,Context,Name,Time (s),Description", *strikes, ""]
    return "\n".join([*head, "Model Outputs", "100", names, components, ",,deg", *rows, ""]).encode()


def _c3d(folder: Path) -> tuple[bytes, ...]:
    try:
        import ezc3d  # an extra
    except ImportError:
        return ()
    people = human_gait(1.2)
    points = {}
    flat = 0 * _time()
    for side, offset in (("L", 0.2), ("R", 0.7)):
        phase = _time() / people.stride_time + offset
        for name, label in {"hip": "HipAngles", "knee": "KneeAngles", "ankle": "AnkleAngles"}.items():
            points[side + label] = np.stack([np.degrees(people.mean(name, phase)), flat, flat])
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [100]
    file["parameters"]["POINT"]["LABELS"]["value"] = list(points)
    data = np.stack([*points.values()], axis=1)
    file["data"]["points"] = np.concatenate([data, np.ones((1, *data.shape[1:]))])
    file.write(str(folder / "walk.c3d"))
    return ((folder / "walk.c3d").read_bytes(),)


_FEET = (
    {"kind": "passive", "ankle_stiffness": 600.0, "toe_stiffness": 50.0, "orthosis": {"ankle_stiffness": 100.0}},
    {"ankle": [[0.0, 300.0, 0.0], [0.6, 50.0, 0.1]], "toe": [[0.0, 28.0, 0.0]]},
)


def _foot_table() -> bytes:
    angle = np.linspace(-20, 20, 9)
    return _table({"ankle_deg": angle, "ankle_torque_Nm": -8.0 * angle, "toe_deg": angle, "toe_torque_Nm": -angle})


def _foot(path: Path) -> None:
    settings_from(right_foot=read_foot(path))


# Plans, constants, searches, studies -------------------------------------------------------------------------


def _plan_file() -> bytes:
    return json.dumps(read_object(STYLES, "styles")).encode()


def _plan(path: Path) -> None:
    reference_walks(settings_from(guide="plan", plan_file=str(path)))


def _constants(path: Path) -> None:
    for values in read_constants(path)["constants"].values():
        constants_from(values)


def _styles(path: Path) -> None:
    read_styles(path)
    styles_of(path)


def _searched(folder: Path) -> bytes:
    _search(folder / "costs.json")
    return (folder / "costs.json").read_bytes()


def _search(path: Path) -> None:
    strategy = CMAEvolutionStrategy(np.zeros(3), 0.5, {"popsize": 4, "seed": 1, "verbose": -9})
    list(generations(strategy, 3, lambda _, vectors: np.array([float(x @ x) for x in vectors]), path, {"seed": 0}))


def _setting(path: Path) -> None:
    read_json([str(path)])


def _learning(path: Path) -> None:
    read_finished(_write(path.with_name(RUN), path.read_bytes()).parent)


# ONNX --------------------------------------------------------------------------------------------------------


def _onnx(folder: Path) -> tuple[bytes, ...]:
    try:
        import onnx  # noqa: F401  # an extra

        from springfoot.agents.policies.export import export_policy
    except ImportError:
        return ()
    export_policy(read_policy("pretrained"), folder / "walk.onnx")
    return ((folder / "walk.onnx").read_bytes(),)


def _contract(folder: Path) -> Callable[[Path], Any]:
    def read(path: Path) -> None:
        contract_path(folder / "walk.onnx").write_bytes(path.read_bytes())
        onnx_policy(folder / "walk.onnx")

    return read
