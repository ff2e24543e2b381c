"""Feet of every kind: what is in place of muscles, what is locked, slack, weak, and what stays as it is."""

from typing import Any

import mujoco
import numpy as np
import pytest
from walked_ticks import walked_ticks

from springfoot.arrays import NDArray
from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.batch.step_result import Tick
from springfoot.envs.control.stiffness_control import FEET
from springfoot.envs.physics.energy import LEDGER
from springfoot.envs.physics.foot import SOUND, WAYS, total_mass
from springfoot.envs.physics.measurement import segments_of
from springfoot.envs.physics.model import (
    ANKLE,
    JOINTS,
    KNEE,
    TOE,
    TORQUE_LIMIT,
    build_model,
    damping_times,
    passive_damping,
)
from springfoot.envs.settings.feet import KINDS, ORTHOSIS_NUMBERS, SEGMENT_RATIOS, foot_setting
from springfoot.envs.settings.settings import settings_from
from springfoot.envs.vector_env import SegmentedFootBipedVector
from springfoot.gait.body.body import Body
from springfoot.gait.body.tissue import ankle_tissue_stiffness, passive_moments
from springfoot.gait.springs.stiffness import thesis_schedule

LEFT, RIGHT = 0, 1
SPRING = {"kind": "passive", "ankle_stiffness": 400.0, "ankle_deg": 4.0, "toe_stiffness": 30.0, "toe_deg": 5.0}
PROSTHESIS = SPRING | dict.fromkeys(("shank_mass_ratio", "shank_com_ratio", "foot_mass_ratio"), 0.6)
PROSTHESIS |= {"shank_inertia_ratio": 0.4, "foot_inertia_ratio": 0.5}
BRACED = {"kind": "weak", "strength": 0.2, "orthosis": {"ankle_stiffness": 200.0, "ankle_deg": 3.0}}
ONE_WAY = {"ankle_stiffness": 200.0, "ankle_deg": -5.0, "toe_stiffness": 10.0, "engages": "dorsiflexion"}
STOPPED = {"kind": "drop", "orthosis": {"ankle_stiffness": 100.0, "engages": "plantarflexion"}}
FEET_SEEN: list[Any] = [*KINDS, PROSTHESIS, BRACED, {"kind": "drop", "orthosis": {"ankle_stiffness": 20.0}}]
FEET_SEEN += [{"kind": "intact", "orthosis": ONE_WAY}, STOPPED]
MIXED = [("intact", foot) for foot in FEET_SEEN] + [("passive", "rigid"), ("weak", "no_toe")]


def named(foot: Any) -> str:
    return foot if isinstance(foot, str) else " ".join([foot["kind"], *(key for key in foot if key != "kind")])


def of_right(ticks: list[Tick], what: str) -> np.ndarray:
    """(T, N, (ankle, toe)) of the right foot, NaN for those that did not run."""
    values = np.stack([getattr(tick.measurement, what)[:, RIGHT, FEET] for tick in ticks])
    return np.where(np.stack([tick.active for tick in ticks])[..., None], values, np.nan)


@pytest.fixture(scope="module")
def together() -> tuple[Biped, list[Tick]]:
    """One body with each of the feet, side by side, and its walk."""
    biped = Biped(
        settings_from(), len(MIXED), feet=[settings_from(left_foot=pair[0], right_foot=pair[1]).feet for pair in MIXED]
    )
    return biped, walked_ticks(biped)


@pytest.mark.parametrize("index", range(len(MIXED)), ids=lambda index: "-".join(map(named, MIXED[index])))
def test_in_a_batch_of_mixed_feet_each_walks_as_alone_bit_for_bit(together, index):
    left, right = MIXED[index]
    alone = Biped(settings_from(left_foot=left, right_foot=right), 1)
    ticks: list[Tick] = []
    alone.on_tick = ticks.append
    alone.reset(np.arange(1), [index])
    for other in together[1]:
        if len(ticks) == len(together[1]) or not other.active[index]:
            break
        alone.step(np.full((1, 4), 0.3))
    ran = [tick for tick in together[1] if tick.active[index]]
    assert len(ran) > 30
    for mine, other in zip(ticks, ran, strict=False):
        for name in ("angle", "velocity", "torque", "force", "com", "com_velocity"):
            own, its = getattr(mine.measurement, name)[0], getattr(other.measurement, name)[index]
            assert own.tobytes() == its.tobytes(), name
        assert mine.stiffness[0].tobytes() == other.stiffness[index].tobytes()
        assert mine.work.energy[0].tobytes() == other.work.energy[index].tobytes()


@pytest.mark.parametrize("foot", FEET_SEEN, ids=named)
def test_right_is_the_mirror_image_of_left(foot):
    biped = Biped(settings_from(), 2, feet=[settings_from(left_foot=foot).feet, settings_from(right_foot=foot).feet])
    biped.reset(np.array([0]), [0], start=0.2)
    biped.reset(np.array([1]), [0], start=0.7)
    for _ in range(25):
        result = biped.step(np.array([[0.3, -0.2, 0.1, 0.4], [0.1, 0.4, 0.3, -0.2]]))
    m = biped.measurement
    np.testing.assert_allclose(m.angle[0], m.angle[1][::-1], atol=1e-6)
    np.testing.assert_allclose(m.com_velocity[0], m.com_velocity[1], atol=1e-6)
    assert result.reward[0] == pytest.approx(result.reward[1], abs=1e-6)


def test_masses_of_the_model_are_those_asked_for_and_the_com_is_that_of_mujoco():
    body = Body(1.8, 80.0)
    feet = settings_from(right_foot=PROSTHESIS).feet
    model, sound = build_model(body, feet=feet), build_model(body)
    for segment, mass, inertia in (("shank", 0.6, 0.4), ("foot", 0.6, 0.5), ("toe", 0.6, 0.5), ("thigh", 1.0, 1.0)):
        own, intact = model.body(f"{segment}_right").id, sound.body(f"{segment}_right").id
        assert model.body_mass[own] == pytest.approx(mass * sound.body_mass[intact])
        assert model.body_inertia[own, 1] == pytest.approx(inertia * sound.body_inertia[intact, 1])
        assert model.body_mass[model.body(f"{segment}_left").id] == sound.body_mass[intact]
    assert model.body_mass.sum() == pytest.approx(total_mass(body, feet)) and total_mass(body, SOUND) == body.total_mass
    lighter = 0.4 * (body.shank_mass + body.foot_mass + body.toe_mass)
    assert body.total_mass - total_mass(body, feet) == pytest.approx(lighter)
    biped = Biped(settings_from(height=1.8, mass=80, right_foot=PROSTHESIS), 1)
    biped.reset(np.arange(1), [0])
    biped.step(np.zeros((1, 4)))
    com = biped.data(0).subtree_com[0]
    np.testing.assert_allclose(biped.measurement.com[0], com[[0, 2]], atol=1e-9)


@pytest.mark.parametrize(("foot", "joint"), [("rigid", ANKLE), ("rigid_toe", TOE), ("no_toe", TOE)])
def test_a_locked_joint_does_not_move(foot, joint):
    biped = Biped(settings_from(right_foot=foot), 4)
    angle = of_right(walked_ticks(biped), "angle")[..., joint - ANKLE]
    assert np.nanmax(np.abs(np.degrees(angle))) < 0.3
    other = of_right(walked_ticks(biped), "angle")[..., TOE - joint]
    assert np.degrees(np.nanmax(other) - np.nanmin(other)) > 5.0


def test_a_foot_in_one_piece_touches_with_heel_and_tip_alone():
    model = build_model(Body(), feet=settings_from(left_foot="no_toe", right_foot="rigid_toe").feet)
    pairs = {model.geom(geom).name for geom in (*model.pair_geom1, *model.pair_geom2)}
    assert "ball_left" not in pairs and {"heel_left", "toe_left", "ball_right"} <= pairs
    spheres = [model.geom(name) for name in ("toe_left", "toe_right")]
    assert spheres[0].pos.tolist() == spheres[1].pos.tolist()  # of the same length


@pytest.mark.parametrize("mass", [63.0, 90.0])
def test_a_passive_foot_is_the_same_spring_on_everybody_whatever_is_asked(mass):
    settings = settings_from(mass=mass, right_foot=SPRING | {"damping_time": 0.01})
    for actions in (-1.0, 1.0):
        biped = Biped(settings, 3)
        ticks = walked_ticks(biped, 30, actions)
        angle, rate, torque = (of_right(ticks, what) for what in ("angle", "velocity", "torque"))
        rest = np.radians([4.0, 5.0])
        np.testing.assert_allclose(torque, [400.0, 30.0] * (rest - angle - 0.01 * rate), atol=1e-9)
        for tick in ticks:
            assert (tick.stiffness[:, RIGHT, FEET] == [400.0, 30.0]).all()
            np.testing.assert_allclose(tick.equilibrium[:, RIGHT, FEET], np.tile(rest, (3, 1)), atol=1e-12)


def test_an_adaptive_foot_has_the_stiffness_of_the_action_and_a_fixed_rest_angle():
    foot = {"kind": "adaptive", "ankle_deg": 3.0, "toe_deg": -2.0}
    biped, sound = Biped(settings_from(right_foot=foot), 2), Biped(settings_from(), 2)
    for mine, intact in zip(walked_ticks(biped, 20), walked_ticks(sound, 20), strict=True):
        assert (mine.stiffness[:, :, FEET] == intact.stiffness[:, :, FEET]).all()
        np.testing.assert_allclose(np.degrees(mine.equilibrium[:, RIGHT, FEET]), [[3.0, -2.0]] * 2, atol=1e-9)


@pytest.mark.parametrize("strength", [0.1, 0.3, 0.6])
def test_a_weak_calf_holds_its_moment_limit_and_reaches_it(strength):
    biped = Biped(settings_from(height=1.8, mass=80.0, right_foot={"kind": "weak", "strength": strength}), 6)
    limit = strength * TORQUE_LIMIT[ANKLE] * biped.body.strength_scale
    ticks = walked_ticks(biped, 60, 0.9)
    ankle = np.stack([tick.measurement.torque[:, :, ANKLE] for tick in ticks])
    assert ankle[..., RIGHT].min() >= -limit * (1.0 + 1e-12)
    assert ankle[..., LEFT].min() < -0.35 * TORQUE_LIMIT[ANKLE]
    if strength < 0.5:
        assert ankle[..., RIGHT].min() == pytest.approx(-limit)
    force = biped.data(0).qfrc_actuator[3:].reshape(2, len(JOINTS))
    np.testing.assert_allclose(force, biped.measurement.torque[0], atol=1e-9)


def test_an_ankle_of_slack_muscles_has_the_torque_of_its_tissue_in_swing_and_all_of_it_in_stance():
    biped = Biped(settings_from(right_foot="drop"), 6)
    ticks = walked_ticks(biped, 45)
    load = np.stack([tick.measurement.force[:, RIGHT, :, 1].sum(-1) for tick in ticks])[:-1]
    phase = np.stack([tick.phase[:, RIGHT] for tick in ticks])[1:]
    torque, active = of_right(ticks, "torque")[1:, :, 0], np.stack([tick.active for tick in ticks])[1:]
    begin, end = (np.stack([tick.measurement.angle[:, RIGHT] for tick in part]) for part in (ticks[:-1], ticks[1:]))
    rate = np.stack([tick.measurement.velocity[:, RIGHT, ANKLE] for tick in ticks[1:]])
    tangent = biped.body.strength_scale * ankle_tissue_stiffness(begin[..., KNEE], begin[..., ANKLE])
    turned = end[..., ANKLE] - begin[..., ANKLE] + damping_times(biped.body)[ANKLE] * rate
    tissue = -passive_moments(biped.body, begin)[..., ANKLE] - tangent * turned
    k = np.stack([tick.stiffness[:, RIGHT, ANKLE] for tick in ticks])[1:]
    swing = active & (phase > 0.5) & (load < 29.9)
    stance = active & ((phase < 0.5) | (load > 30.1))
    assert swing.sum() > 50 and (k[swing] == 0.0).all() and tissue[swing].max() > 1.0
    np.testing.assert_allclose(torque[swing], tissue[swing], atol=1e-9)
    assert (k[stance] > 0.0).all() and np.abs(torque[stance]).max() > 20.0


def test_an_orthosis_is_a_spring_beside_the_joint_and_outside_the_moment_limit():
    orthosis = {"ankle_stiffness": 200.0, "ankle_deg": 3.0, "toe_stiffness": 10.0, "toe_deg": 0.0, "damping_time": 0.01}
    foot = {"kind": "weak", "strength": 0.1, "orthosis": orthosis}
    biped = Biped(settings_from(right_foot=foot), 1)
    biped.reset(np.arange(1), [0])
    for _ in range(20):
        biped.step(np.full((1, 4), 0.9))
    data, body = biped.data(0), biped.body
    angle, rate = biped.measurement.angle[0, RIGHT, FEET], biped.measurement.velocity[0, RIGHT, FEET]
    beside = [200.0, 10.0] * (np.radians([3.0, 0.0]) - angle - 0.01 * rate) - passive_damping(body)[FEET] * rate
    np.testing.assert_allclose(data.qfrc_passive[3:].reshape(2, 4)[RIGHT, FEET], beside, atol=1e-9)
    assert np.abs(beside[0]) > 5.0


def in_orthosis(**changed: Any) -> dict[str, Any]:
    return {"kind": "intact", "orthosis": ONE_WAY | changed}


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("joint", ["ankle", "toe"])
def test_a_spring_that_acts_one_way_is_taut_beyond_its_angle_and_slack_below(joint, way):
    numbers = {"ankle_stiffness": 0.0, f"{joint}_stiffness": 70.0, f"{joint}_deg": -6.0}
    model = build_model(Body(), feet=settings_from(right_foot=in_orthosis(**numbers, engages=way)).feet)
    data = mujoco.MjData(model)
    dof = model.joint(f"{joint}_right").dofadr[0]
    for beyond in (-0.3, -0.1, -1e-6, 0.0, 1e-6, 0.1, 0.3):
        data.qpos[dof] = np.radians(-6.0) + beyond
        mujoco.mj_forward(model, data)
        taut = beyond > 0.0 if way == "dorsiflexion" else beyond < 0.0
        assert data.qfrc_passive[dof] == pytest.approx(-70.0 * beyond if taut else 0.0, abs=1e-12)
        assert not np.delete(data.qfrc_passive, dof).any()


def walked_bits(**feet: Any) -> tuple[list[bytes], NDArray]:
    """Bits of a walk of two bodies, and its (T, N, side, (ankle, toe)) angles."""
    ticks = walked_ticks(Biped(settings_from(**feet), 2), 40)
    seen = [getattr(tick.measurement, name) for tick in ticks for name in ("angle", "torque", "force")]
    seen += [value for tick in ticks for value in (tick.stiffness, tick.work.torque, tick.work.energy)]
    return [each.tobytes() for each in seen], np.stack([tick.measurement.angle[..., FEET] for tick in ticks])


@pytest.mark.parametrize("sides", [["left"], ["right"], ["left", "right"]], ids="-".join)
def test_a_slack_spring_is_none_to_the_last_bit(sides):
    def walk(**changed):
        return walked_bits(**{f"{side}_foot": in_orthosis(**changed) for side in sides})

    none, angle = walked_bits()
    beyond = {"ankle_deg": 30.0, "toe_deg": 45.0}
    assert np.degrees(angle.max((0, 1, 2)) - np.radians([30.0, 45.0])).max() < 0.0
    assert walk(**beyond)[0] == none
    assert walk(ankle_stiffness=0.0, toe_stiffness=0.0)[0] == none
    assert walk(**beyond | {"ankle_deg": np.degrees(angle[..., 0].max()) - 1.0})[0] != none


def test_a_spring_that_is_always_taut_is_one_that_acts_both_ways_without_damping():
    low = {"ankle_deg": -30.0, "toe_deg": -30.0}
    one_way = walked_bits(right_foot=in_orthosis(**low))[1]
    both = {name: number for name, number in ONE_WAY.items() if name != "engages"}
    both_ways = walked_bits(right_foot={"kind": "intact", "orthosis": both | low | {"damping_time": 0.0}})[1]
    assert np.degrees(one_way.min()) > -30.0
    np.testing.assert_allclose(one_way, both_ways, atol=1e-8)


@pytest.mark.parametrize("foot", FEET_SEEN, ids=named)
def test_the_energy_ledger_is_closed(foot):
    biped = Biped(settings_from(right_foot=foot), 3)
    ticks = walked_ticks(biped, 40)
    kept = [tick for tick in ticks if tick.active.all()]
    energy = {name: np.stack([tick.work.energy[name] for tick in kept]) for name in LEDGER.names or ()}
    change = energy["mechanical"][-1] - energy["mechanical"][0]
    put_in = np.sum([energy[name][1:] for name in ("actuators", "passive_damping", "contact", "pushes")], 0)
    turned_over = np.sum([np.abs(energy[name][1:]).sum(0) for name in ("actuators", "contact")], 0)
    assert len(kept) > 40
    np.testing.assert_allclose(change - put_in.sum(0), 0.0, atol=0.02 * turned_over.max())


@pytest.mark.parametrize("foot", FEET_SEEN, ids=named)
def test_the_controller_of_the_sound_side_and_of_hips_and_knees_is_unchanged(foot):
    begun = []
    for right in (foot, "intact"):
        biped = Biped(settings_from(right_foot=right), 1)
        ticks = walked_ticks(biped, 40, 0.4)
        begun.append((ticks[0], biped.subjects.rows["legs"]["gains"]))
        for tick in ticks:  # at whatever phase it comes to
            rest = biped._springs.rest.at(tick.phase[:, LEFT])
            np.testing.assert_allclose(tick.equilibrium[:, LEFT, FEET], rest, atol=1e-12)
    (mine, gains), (sound, its) = begun
    assert gains == its and (mine.stiffness[:, :, :ANKLE] == sound.stiffness[:, :, :ANKLE]).all()
    assert (mine.stiffness[:, LEFT] == sound.stiffness[:, LEFT]).all()
    assert (mine.equilibrium[:, :, KNEE] == sound.equilibrium[:, :, KNEE]).all()


def test_actions_of_a_device_are_read_as_0_and_named_in_info():
    env = SegmentedFootBipedVector(3, right_foot=["intact", "rigid_toe", "passive"])
    observation, info = env.reset(seed=0)
    assert env.settings.right_foot.plain == "intact"
    last = list(env.biped.observation_names).index("last_action_ankle_left")
    wanted = np.array([[1, 1, 1, 1], [1, 1, 1, 0], [1, 1, 0, 0]])
    for _ in range(2):
        controlled = np.stack([info[f"controlled/{name}"] for name in env.biped.action_names], -1)
        np.testing.assert_array_equal(controlled, wanted)
        observation, _, _, _, info = env.step(np.full((3, 4), 0.5, np.float32))
    np.testing.assert_allclose(observation[:, last : last + 4], 0.5 * wanted)
    assert info["stiffness/ankle_right"][2] == 600.0 and info["stiffness/toe_right"][2] == 60.0
    assert observation.shape == (3, 43) and env.single_action_space.shape == (4,)


def test_another_body_keeps_its_feet():
    biped = Biped(settings_from(right_foot=SPRING, mass_range=(50, 100)), 2)
    biped.reset(np.arange(2), [1, 2])
    for index, body in enumerate(biped.subjects.bodies):
        expected = segments_of(body, settings_from(right_foot=SPRING).feet)
        np.testing.assert_array_equal(biped._simulation.arrays.bodies["segments"][index], expected[0])
        beta = biped.model_of(index).actuator_gainprm[0, 2]
        assert beta == pytest.approx(-damping_times(body)[0])
    assert len({body.mass for body in biped.subjects.bodies}) == 2


def test_every_number_of_a_foot_changes_the_foot():
    def physical(foot):
        return foot_setting("right_foot", foot).foot

    scheduled = {"kind": "adaptive", "schedule": thesis_schedule(Body()).to_json()}
    for kind, numbers in KINDS.items():
        for name, number in (numbers | SEGMENT_RATIOS).items():
            foot = scheduled if (kind, name) == ("adaptive", "damping_time") else {"kind": kind}
            other = foot | {name: 0.5 * (number.low + number.high)}
            assert physical(other) != physical(foot), (kind, name)
    for name, number in ORTHOSIS_NUMBERS.items():
        orthosis = {"ankle_stiffness": 50.0, "toe_stiffness": 5.0}
        other = {"kind": "intact", "orthosis": orthosis | {name: 0.45 * number.high}}
        assert physical(other) != physical({"kind": "intact", "orthosis": orthosis}), name
    assert len({physical(in_orthosis(engages=way)) for way in (None, *WAYS)}) == 3


def test_a_neighbours_reset_and_a_pause_leave_a_drop_foot_as_it_is():
    """Its muscles go slack by the load of the window before, which is its own."""
    settings = settings_from(right_foot="drop")

    def walked(disturb):
        biped = Biped(settings, 2)
        biped.reset(np.arange(2), [0, 1])
        seen = []
        for step in range(45):
            disturb(biped, step)
            seen.append(biped.step(np.zeros((2, 4))).observation[0])
        return np.array(seen)

    alone = walked(lambda biped, step: None)
    np.testing.assert_array_equal(walked(lambda biped, step: biped.reset(np.array([1]), [step])), alone)
    pause = np.array([False, True])
    np.testing.assert_array_equal(walked(lambda biped, step: biped.step(np.zeros((2, 4)), active=pause)), alone)
