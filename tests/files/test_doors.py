"""Every reader of a file refuses pipes, endless devices, gigabytes, deep JSON and absurd numbers, in one line."""

import json
import os

import cma
import numpy as np
import pytest

from springfoot.agents.policies.policy import read_policy
from springfoot.agents.training.checkpoint import read_checkpoint
from springfoot.errors import SpringfootError
from springfoot.evaluation.recording.recording import load_recording
from springfoot.files.json_file import read_object
from springfoot.files.text_table import read_bytes, read_csv
from springfoot.gait.people.human import harmonics
from springfoot.gait.plan.walk_style import styles_of
from springfoot.studies.base.kept import Kept
from springfoot.studies.searches.cma_search import generations
from springfoot.studies.searches.constants_file import read_constants


def search(path):
    strategy = cma.CMAEvolutionStrategy(np.zeros(3), 0.5, {"popsize": 4, "seed": 1, "verbose": -9})
    return list(generations(strategy, 2, lambda _, vectors: np.arange(len(vectors), dtype=float), path, "x"))


READERS = {
    "walk.safetensors": read_policy,
    "state-64.safetensors": read_checkpoint,
    "strides.npz": load_recording,
    "table.csv": read_csv,
    "record.json": lambda path: read_object(path, "record"),
    "people.json": harmonics,
    "styles.json": styles_of,
    "kept.json": Kept,
    "legs.json": read_constants,
    "log.json": search,
}
TEXTS = [name for name in READERS if name.endswith((".json", ".csv"))]


def refused(path):
    with pytest.raises(SpringfootError) as caught:
        READERS[path.name](path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", READERS)
def test_a_pipe_is_refused_at_once(tmp_path, name):
    os.mkfifo(tmp_path / name)
    refused(tmp_path / name)


@pytest.mark.parametrize("name", READERS)
def test_an_endless_device_is_refused_unread(tmp_path, name):
    (tmp_path / name).symlink_to("/dev/zero")
    refused(tmp_path / name)


@pytest.mark.parametrize("name", [name for name in READERS if name != "strides.npz"])
def test_ten_gigabytes_are_refused_unread(tmp_path, name):
    with (tmp_path / name).open("wb") as file:
        file.truncate(10 * 2**30)  # a hole on the disk
    refused(tmp_path / name)


@pytest.mark.parametrize("name", [name for name in TEXTS if name.endswith(".json")])
@pytest.mark.parametrize("text", [100_000 * "[", '{"a": ' * 50_000, "1" * 5000, "\xff", "[1]", "null"])
def test_json_that_is_no_object_is_one_line(tmp_path, name, text):
    (tmp_path / name).write_text(text, encoding="latin-1")
    refused(tmp_path / name)


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), "x", "1_0", True, None, [1.0]])
def test_a_search_takes_no_cost_that_is_no_number(tmp_path, bad):
    path = tmp_path / "log.json"
    first = search(path)
    table = json.loads(path.read_text(encoding="utf-8"))
    assert [vectors for _, vectors, _ in search(path)][1][0] == pytest.approx(first[1][1][0])
    table["costs"][0][2] = bad
    path.write_text(json.dumps(table), encoding="utf-8")
    refused(path)


def test_a_pipe_that_takes_a_files_place_while_it_is_opened_is_refused_at_once(tmp_path):
    class Swapped(type(tmp_path)):
        """A path at which a pipe appears as soon as somebody has seen a file."""

        def is_file(self):
            self.unlink()
            os.mkfifo(self)
            return True

    path = Swapped(tmp_path / "table.csv")
    path.write_text("a\n1\n")
    with pytest.raises(SpringfootError, match=r"table\.csv is not a regular file$"):
        read_bytes(path)


@pytest.mark.parametrize("answer", ['"word"', "[]", "1", '{"v": NaN}', '{"v": 1e999}', "null"])
def test_a_study_takes_no_kept_answer_that_it_did_not_write(tmp_path, answer):
    path = tmp_path / "kept.json"
    path.write_text(f'{{"question": {answer}}}')
    refused(path)


def test_a_search_of_other_settings_is_told_from_this_one_by_their_types_too(tmp_path):
    path = tmp_path / "log.json"
    path.write_text('{"asked": true, "costs": []}')
    strategy = cma.CMAEvolutionStrategy(np.zeros(3), 0.5, {"popsize": 4, "seed": 1, "verbose": -9})
    with pytest.raises(SpringfootError, match="is of a search with other settings"):
        list(generations(strategy, 0, lambda _, vectors: np.zeros(len(vectors)), path, 1))
