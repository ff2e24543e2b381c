"""Write the files of a walk for other tools: OpenSim's motion and storage files, and the body as a MuJoCo model.

OpenSim: x forward, y up, z to the right. Coordinates are named as in its full-body models of walking, in which the
knee's flexion is positive (Rajagopal et al. 2016); gait2392 has it negative. The pelvis is the trunk: `pelvis_tx` and
`pelvis_ty` are the hips', `pelvis_tilt` is positive backward. Moments are positive as their coordinates.
"""

from collections.abc import Mapping
from math import cos, radians, sin, tan
from pathlib import Path

import numpy as np
from mujoco import MjSpec

from springfoot.arrays import NDArray
from springfoot.envs.physics.contact import ground_name
from springfoot.envs.physics.model import JOINTS, SIDES, build_spec
from springfoot.envs.physics.model_file import model_text
from springfoot.envs.settings.settings import BipedSettings, body_of

from ..numbers.series import mid_tick
from ..recording.recording import TICK, Recording

COORDINATES = dict(zip(JOINTS, ("hip_flexion", "knee_angle", "ankle_angle", "mtp_angle"), strict=True))
"""Joint -> OpenSim's coordinate, of the same sign."""


def write_opensim(folder: Path, recording: Recording) -> None:
    """Write one episode: `walk.mot`, the coordinates, `walk.sto`, ground reaction forces and joint moments, and
    `external_loads.xml`, which puts the forces on the feet of a model."""
    _write_storage(folder / "walk.mot", "coordinates", opensim_coordinates(recording), in_degrees=True)
    _write_storage(folder / "walk.sto", "forces and moments", opensim_forces(recording), in_degrees=False)
    (folder / "external_loads.xml").write_text(external_loads("walk.sto"), encoding="utf-8", newline="")


def external_loads(forces: str) -> str:
    """Return OpenSim's external loads, which put the forces in the file `forces` on the bodies calcn_l and calcn_r.

    These are the rear feet of its models of walking.
    """
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<OpenSimDocument Version="40000">',
        '<ExternalLoads name="walk">',
    ]
    lines.append("<objects>")
    for name in SIDES:
        side = name[0]
        entries = {
            "applied_to_body": f"calcn_{side}",
            "force_expressed_in_body": "ground",
            "point_expressed_in_body": "ground",
            "force_identifier": f"ground_force_{side}_v",
            "point_identifier": f"ground_force_{side}_p",
            "torque_identifier": f"ground_torque_{side}_",
        }
        lines.append(f'<ExternalForce name="{name}">')
        lines += [f"  <{entry}>{value}</{entry}>" for entry, value in entries.items()]
        lines.append("</ExternalForce>")
    lines += ["</objects>", f"<datafile>{forces}</datafile>", "</ExternalLoads>", "</OpenSimDocument>"]
    return "\n".join(lines) + "\n"


def opensim_coordinates(recording: Recording) -> dict[str, NDArray]:
    """Return column of `walk.mot` -> (T,): time at the end of each tick [s], angles [deg], positions [m].

    The episode is the recording's `example`.
    """
    series = recording.shown()
    x, height, pitch = series["base"].T
    columns = {
        "time": TICK * np.arange(1, len(x) + 1),
        "pelvis_tilt": -np.degrees(pitch),
        "pelvis_tx": x,
        "pelvis_ty": height + _slope(recording.settings) * x,  # recorded heights are above the mean ground
    }
    for side, name in enumerate(SIDES):
        for joint, coordinate in enumerate(COORDINATES.values()):
            # OpenSim's sides are the letters l and r.
            columns[f"{coordinate}_{name[0]}"] = np.degrees(series["angle"][:, side, joint])
    return columns


def opensim_forces(recording: Recording) -> dict[str, NDArray]:
    """Return column of `walk.sto` -> (T,): time in the middle of each tick [s], forces [N], positions [m], moments [N
    m].

    Each foot's force acts at its centre of pressure on the mean ground, about which it has no moment. Without a force
    the point lies below the ankle.
    """
    series = recording.shown()
    slope = _slope(recording.settings)
    columns = {"time": TICK * (np.arange(len(series["base"])) + 0.5)}
    for side, name in enumerate(SIDES):
        force = series["force"][:, side]
        contact_x = mid_tick(series["contact"][:, side, :, 0])
        pressing = force[..., 1] - slope * force[..., 0]  # times the slope's cosine: the normal force
        total = pressing.sum(axis=1)
        loaded = total > 0.0
        centre = (pressing * contact_x).sum(axis=1) / np.where(loaded, total, 1.0)
        centre = np.where(loaded, centre, mid_tick(series["ankle"][:, side, 0]))
        zero = np.zeros(len(centre))
        start = f"ground_force_{name[0]}"  # l or r
        columns |= {f"{start}_vx": force[..., 0].sum(axis=1), f"{start}_vy": force[..., 1].sum(axis=1)}
        columns |= {f"{start}_vz": zero, f"{start}_px": centre, f"{start}_py": slope * centre, f"{start}_pz": zero}
        columns |= {f"ground_torque_{name[0]}_{axis}": zero for axis in "xyz"}
    for side, name in enumerate(SIDES):
        for joint, coordinate in enumerate(COORDINATES.values()):
            columns[f"{coordinate}_{name[0]}_moment"] = series["joint_torque"][:, side, joint]
    return columns


def write_model(path: Path, recording: Recording) -> None:
    """Write the recorded body as a model for MuJoCo, in MJCF.

    Its key `walk` is the first posture recorded, its ground has the walk's slope.
    """
    spec = sloping_spec(recording)
    walk = postures(recording)
    if len(walk):
        spec.add_key(name="walk", qpos=walk[0].tolist())
    path.write_text(model_text(spec), encoding="utf-8")


def sloping_spec(recording: Recording) -> MjSpec:
    """Return MuJoCo's specification of the recorded body and feet, its ground with the walk's slope."""
    settings = recording.settings
    spec = build_spec(body_of(settings), settings.friction, settings.feet)
    half_angle = radians(settings.slope_deg) / 2  # a quaternion holds the half
    for side in SIDES:
        spec.body(ground_name(side)).quat = (cos(half_angle), 0.0, -sin(half_angle), 0.0)
    return spec


def postures(recording: Recording) -> NDArray:
    """Return the positions of the joints of `sloping_spec`'s model at the end of each tick, (T, 11) [m] and [rad].

    They are hip x, hip z and trunk pitch, then four angles of the left and four of the right leg.
    """
    series = recording.shown()
    x, height, pitch = series["base"].T
    base = np.stack([x, height + _slope(recording.settings) * x, pitch], axis=-1)
    return np.concatenate([base, series["angle"].reshape(len(base), -1)], axis=-1)


def _slope(settings: BipedSettings) -> float:
    """Return the rise of the ground per metre forward [-]."""
    return tan(radians(settings.slope_deg))


def _write_storage(path: Path, kind: str, columns: Mapping[str, NDArray], in_degrees: bool) -> None:
    """Write columns, name -> (T,), as a storage file of OpenSim; `kind` is its title, `in_degrees` the unit of
    angles."""
    rows = np.stack(list(columns.values()), axis=-1)
    head = [
        f"springfoot {kind}",
        "version=1",
        f"nRows={len(rows)}",
        f"nColumns={len(columns)}",
        f"inDegrees={'yes' if in_degrees else 'no'}",
        "endheader",
        "\t".join(columns),
    ]
    lines = ("\t".join(f"{value:.10g}" for value in row) for row in rows.tolist())
    path.write_text("\n".join([*head, *lines]) + "\n", encoding="utf-8", newline="")
