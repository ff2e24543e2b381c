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
