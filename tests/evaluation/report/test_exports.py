"""What an evaluation writes for other tools: OpenSim's files, and the body as a MuJoCo model."""

import mujoco
import numpy as np
import pytest

from springfoot.envs.physics.model import JOINTS, SIDES, build_model, build_spec
from springfoot.envs.physics.model_file import model_text
from springfoot.envs.physics.simulation import Simulation
from springfoot.envs.settings.settings import body_of, settings_from
from springfoot.evaluation.numbers.metrics import measure
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import TICK, record
from springfoot.evaluation.report.exports import opensim_coordinates, opensim_forces, write_model, write_opensim
from springfoot.gait import GRAVITY, Body
from springfoot.gait.people.own_data import read_gait

SLOPE = 3.0


def walked(name="schedule", **given):
    policy, settings = policy_and_settings(name, {"episode_seconds": 8.0} | given)
    return record(policy, settings, name=name, episodes=1)


@pytest.fixture(scope="module")
def uphill():
    return walked(slope_deg=SLOPE)


def read_independently(path):
    """Column -> values, by NumPy: the header ends with `endheader`, then names, then numbers, with tabs between."""
    head, body = path.read_text(encoding="utf-8").split("endheader\n")
    names = body.splitlines()[0].split("\t")
    rows = np.loadtxt(body.splitlines()[1:], delimiter="\t")
    said = dict(line.split("=") for line in head.splitlines() if "=" in line)
    assert (int(said["nRows"]), int(said["nColumns"])) == rows.shape
    return said, dict(zip(names, rows.T, strict=True))


def test_opensim_files_are_read_back_by_another_reader(uphill, tmp_path):
    write_opensim(tmp_path, uphill)
    said, motion = read_independently(tmp_path / "walk.mot")
    assert said["inDegrees"] == "yes" and list(motion)[:4] == ["time", "pelvis_tilt", "pelvis_tx", "pelvis_ty"]
    series = {name: values[0].astype(float) for name, values in uphill.series.items()}
    assert motion["time"] == pytest.approx(TICK * np.arange(1, 801), abs=1e-9)
    assert np.radians(motion["pelvis_tilt"]) == pytest.approx(-series["base"][:, 2], abs=1e-6)
    assert np.radians(motion["knee_angle_r"]) == pytest.approx(series["angle"][:, 1, JOINTS.index("knee")], abs=1e-6)
    assert np.radians(motion["mtp_angle_l"]) == pytest.approx(series["angle"][:, 0, JOINTS.index("toe")], abs=1e-6)
    risen = motion["pelvis_ty"] - np.tan(np.radians(SLOPE)) * motion["pelvis_tx"]
    assert risen == pytest.approx(series["base"][:, 1], abs=1e-6)
    said, storage = read_independently(tmp_path / "walk.sto")
    assert said["inDegrees"] == "no"
    assert storage["ground_force_l_vy"] == pytest.approx(series["force"][:, 0, :, 1].sum(axis=1), abs=1e-6, rel=1e-6)
    torque = series["joint_torque"][:, 1, JOINTS.index("hip")]
    assert storage["hip_flexion_r_moment"] == pytest.approx(torque, abs=1e-6, rel=1e-6)


def test_our_own_reader_finds_the_gait_that_was_measured(tmp_path):
    recording = walked()
    write_opensim(tmp_path, recording)
    own = read_gait(tmp_path / "walk.mot", tmp_path / "walk.sto")
    gait = measure(recording)
    assert own.stride_time == pytest.approx(120 / gait.metrics["cadence_steps_min"], rel=0.01)
    curves = own.gait(1.2, 1.70)
    phase = np.linspace(0, 1, 101)
    for curve, column in (
        ("knee", "knee_flexion_deg"),
        ("ankle", "ankle_dorsiflexion_deg"),
        ("toe", "mtp_dorsiflexion_deg"),
    ):
        off = np.degrees(curves.mean(curve, phase)) - gait.both.mean(column)
        assert np.sqrt((off**2).mean()) < 1.0  # the reader has no warm-up to leave out
    assert curves.mean("ankle_moment", phase) == pytest.approx(gait.both.mean("ankle_moment_Nm_per_kg"), abs=0.1)


def test_the_force_about_its_place_has_the_moment_of_all_contacts(uphill):
    """On a slope too: about the origin, of the contacts' forces on the mean ground."""
    storage, slope = opensim_forces(uphill), np.tan(np.radians(SLOPE))
    for side, name in enumerate(SIDES):
        force = uphill.series["force"][0, :, side].astype(float)
        x = uphill.series["contact"][0, :, side, :, 0].astype(float)
        x = np.concatenate([x[:1], 0.5 * (x[1:] + x[:-1])])
        moment = (x * force[..., 1] - slope * x * force[..., 0]).sum(axis=1)
        start = f"ground_force_{name[0]}"
        px, py, vx, vy = (storage[f"{start}_{part}"] for part in ("px", "py", "vx", "vy"))
        assert px * vy - py * vx == pytest.approx(moment, abs=1e-6)
        assert py == pytest.approx(slope * px, abs=1e-12)
        standing = vy > 0.3 * 63.0 * GRAVITY
        ankle = uphill.series["ankle"][0, :, side, 0]
        assert (px - ankle)[standing].min() > -0.15 and (px - ankle)[standing].max() < 0.25  # within the foot


def test_a_walk_that_ends_at_once_is_written_too(tmp_path):
    short = walked(episode_seconds=0.02)
    write_opensim(tmp_path, short)
    write_model(tmp_path / "model.xml", short)
    assert len(opensim_coordinates(short)["time"]) == 2
    assert read_independently(tmp_path / "walk.mot")[1]["time"] == pytest.approx([0.01, 0.02])


BODIES = [
    Body(),
    Body(height=1.63, mass=58.3, carried_ratio=0.2),
    Body(height=1.91, mass=97.7, leg_ratio=1.02, foot_ratio=0.95),
]


BRACED = {"kind": "weak", "orthosis": {"ankle_stiffness": 100 / 3, "ankle_deg": 1.7, "toe_stiffness": 9.1}}
STOPPED = {"kind": "intact", "orthosis": {**BRACED["orthosis"], "engages": "dorsiflexion"}}


@pytest.mark.parametrize("feet", [("intact", "intact"), ("no_toe", "rigid"), (BRACED, STOPPED)])
@pytest.mark.parametrize("body", BODIES)
def test_a_model_file_has_every_number_that_moves_the_body_to_the_last_bit(body, feet):
    left, right = feet
    how = body, 0.87, settings_from(left_foot=left, right_foot=right).feet
    ours, loaded = build_model(*how), mujoco.MjModel.from_xml_string(model_text(build_spec(*how)))
    seen = [name for name in dir(ours) if isinstance(getattr(ours, name, None), np.ndarray)]
    off = [name for name in seen if not np.array_equal(getattr(ours, name), getattr(loaded, name))]
    assert len(seen) > 300 and all(name.startswith(("cam_", "light_")) for name in off), off
    options = [name for name in dir(ours.opt) if not name.startswith("_")]
    assert all(np.array_equal(getattr(ours.opt, name), getattr(loaded.opt, name)) for name in options)


@pytest.mark.parametrize("given", [{}, {"slope_deg": SLOPE, "height": 1.8, "mass": 81.0, "friction": 0.7}])
def test_the_model_file_steps_the_same_bits_as_the_environment(given, tmp_path):
    recording = walked(**given, episode_seconds=1.0)
    write_model(tmp_path / "model.xml", recording)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "model.xml"))
    data, body, slope = mujoco.MjData(model), body_of(recording.settings), np.radians(recording.settings.slope_deg)
    mujoco.mj_resetDataKeyframe(model, data, model.key("walk").id)
    assert data.qpos[3:] == pytest.approx(recording.series["angle"][0, 0].ravel(), abs=0.0)

    simulation, one = Simulation(body, 1, friction=recording.settings.friction), np.arange(1)
    simulation.lay(one, np.array([slope]), np.zeros((1, 2)))
    base = data.qpos[:3] - [0.0, np.tan(slope) * data.qpos[0], 0.0]
    simulation.reset(one, base[None], np.zeros((1, 3)), data.qpos[3:].reshape(1, 2, 4), np.zeros((1, 2, 4)))
    data.qpos[:] = simulation.data(0).qpos  # the base's height above the slope, added up in another order
    random = np.random.default_rng(0)
    for _ in range(60):
        stiffness = random.uniform(50, 400, (2, 4))
        control = np.stack([stiffness, stiffness * random.uniform(-0.2, 0.3, (2, 4))], -1)
        data.ctrl[:] = control.ravel()
        simulation.advance(control[None])
        mujoco.mj_step(model, data, nstep=round(TICK / model.opt.timestep))
    after = simulation.data(0)
    assert np.array_equal(data.qpos, after.qpos) and np.array_equal(data.qvel, after.qvel)
    assert data.ncon > 0 or data.qpos[1] < 0.8  # it met the ground
