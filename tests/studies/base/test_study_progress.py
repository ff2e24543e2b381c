"""A study knows how long it takes: what its walks tell of their time adds up to the total that its bar has."""

import pytest

from springfoot.studies.base.flags import RecordedFlags
from springfoot.studies.springs.any_stiffness import AnyStiffness
from springfoot.studies.springs.influence import Influence
from springfoot.studies.walks.comparison import Compare

SHORT = {"episodes": 2, "seconds": 0.4}
USUAL = RecordedFlags()
STUDIES = [
    Compare(policies=("schedule", "constant"), springs=False, world=True, environment=USUAL, **SHORT),
    Compare(
        pushes=(50.0, 60.0), factor=1.1, constant=(300.0, 40.0), policies=("schedule",), environment=USUAL, **SHORT
    ),
]


@pytest.mark.slow
@pytest.mark.parametrize("study", STUDIES, ids=lambda study: type(study).__name__)
def test_what_is_walked_is_the_total(study):
    walked = []
    study.ask(walked.append)
    assert sum(walked) == pytest.approx(study.total, rel=1e-6)


@pytest.mark.slow
def test_what_is_walked_at_least_to_the_first_falls():
    """Rebuilding a gait needs strides of it, and copies of a policy walks of their own."""
    study = AnyStiffness(stiffness=("recorded", "people"), episodes=1, seconds=6.0)
    walked = []
    study.ask(walked.append)
    assert 0.5 * study.total < sum(walked) <= 1.000001 * study.total
    study = Influence(seeds=2, strides=4, conditions=("level ground",))
    walked = []
    study.ask(walked.append)
    assert sum(walked) == pytest.approx(study.total, rel=0.2)
