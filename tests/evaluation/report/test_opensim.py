"""walk.mot and walk.sto read by OpenSim itself, where its wheel is installed."""

import numpy as np
import pytest

from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import record
from springfoot.evaluation.report.exports import opensim_coordinates, opensim_forces, write_opensim


@pytest.mark.parametrize("given", [{}, {"slope_deg": 3.0, "right_foot": "passive"}])
def test_opensim_reads_every_number_that_was_written(given, tmp_path):
    opensim = pytest.importorskip("opensim", reason="needs OpenSim's own reader: pip install opensim")
    policy, settings = policy_and_settings("schedule", {"episode_seconds": 2.0} | given)
    recording = record(policy, settings, name="schedule", episodes=1)
    write_opensim(tmp_path, recording)
    for file, columns, degrees in (
        ("walk.mot", opensim_coordinates(recording), "yes"),
        ("walk.sto", opensim_forces(recording), "no"),
    ):
        table = opensim.TimeSeriesTable(str(tmp_path / file))
        assert table.getTableMetaDataString("inDegrees") == degrees
        assert ["time", *table.getColumnLabels()] == list(columns)
        assert np.array(table.getIndependentColumn()) == pytest.approx(columns.pop("time"), abs=1e-9)
        read = table.getMatrix().to_numpy()
        assert read == pytest.approx(np.stack([*columns.values()], -1), rel=1e-9, abs=1e-9)


@pytest.mark.slow
def test_opensim_puts_the_forces_on_the_feet_as_external_loads_say(tmp_path, monkeypatch):
    opensim = pytest.importorskip("opensim", reason="needs OpenSim itself: pip install opensim")
    policy, settings = policy_and_settings("schedule", {"episode_seconds": 2.0})
    recording = record(policy, settings, name="schedule", episodes=1)
    monkeypatch.chdir(tmp_path)  # OpenSim writes its log there
    write_opensim(tmp_path, recording)
    model = opensim.Model()
    for name in ("calcn_r", "calcn_l"):
        body = opensim.Body(name, 1.0, opensim.Vec3(0), opensim.Inertia(1, 1, 1))
        model.addBody(body)
        model.addJoint(opensim.FreeJoint(f"{name}_free", model.getGround(), body))
    loads = opensim.ExternalLoads(str(tmp_path / "external_loads.xml"), True)
    assert loads.getSize() == 2 and loads.getDataFileName() == "walk.sto"
    model.addModelComponent(loads)
    model.initSystem()
    columns = opensim_forces(recording)
    for index, side in enumerate("lr"):
        force = loads.get(index)
        assert force.get_applied_to_body() == f"calcn_{side}"
        for tick in (30, 77, 150):
            time = float(columns["time"][tick])
            for read, start in (
                (force.getForceAtTime(time), f"ground_force_{side}_v"),
                (force.getPointAtTime(time), f"ground_force_{side}_p"),
                (force.getTorqueAtTime(time), f"ground_torque_{side}_"),
            ):
                expected = [columns[start + axis][tick] for axis in "xyz"]
                assert [read.get(k) for k in range(3)] == pytest.approx(expected, rel=1e-6, abs=1e-6)
