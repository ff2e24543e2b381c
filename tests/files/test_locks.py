"""One owner a folder: two at once, dead owners, free names, and commands that signals end."""

import errno
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import evaluate
import train
from springfoot.command_line import exit_code
from springfoot.errors import SpringfootError
from springfoot.files import locks as ownership
from springfoot.files.locks import OWNER, TakenError, owned
from springfoot.files.writing import require_new, whole_folder, write_new

HOLD = """
import sys, time
from pathlib import Path
from springfoot.files.locks import owned
with owned(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60)
"""


@pytest.fixture
def holder(tmp_path):
    """A process that owns tmp_path / "run"."""
    with subprocess.Popen([sys.executable, "-c", HOLD, tmp_path / "run"], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None and process.stdout.readline() == "held\n"
        yield process
        process.kill()


def test_a_folder_that_another_process_writes_is_refused_until_it_is_dead(holder, tmp_path, capsys):
    folder = tmp_path / "run"
    with (
        pytest.raises(TakenError, match=rf"being written by process {holder.pid} on .*, begun \d+ s ago"),
        owned(folder),
    ):
        raise AssertionError
    assert json.loads((folder / OWNER).read_text())["pid"] == holder.pid
    holder.kill()
    holder.wait()
    with owned(folder):
        assert json.loads((folder / OWNER).read_text())["pid"] == os.getpid()
    assert f"taken over from process {holder.pid} on" in capsys.readouterr().err
    assert list(folder.iterdir()) == []


def test_a_folder_that_was_made_and_left_empty_vanishes(tmp_path):
    with owned(tmp_path / "runs" / "walk"):
        pass
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("silent", [ownership.DEAD - 60, ownership.DEAD + 60])
def test_an_owner_on_another_host_is_dead_after_a_while_without_a_sign_of_life(tmp_path, capsys, silent):
    there = {"pid": 1, "host": "elsewhere.invalid", "began": "2026-01-01T00:00:00+00:00"}
    (tmp_path / OWNER).write_text(json.dumps(there))
    os.utime(tmp_path / OWNER, (time.time() - silent,) * 2)
    if silent < ownership.DEAD:
        with (
            pytest.raises(
                TakenError, match=r"process 1 on elsewhere.invalid, begun \d+ d ago, last heard of 9 min ago"
            ),
            owned(tmp_path),
        ):
            raise AssertionError
        assert json.loads((tmp_path / OWNER).read_text()) == there
    else:
        with owned(tmp_path):
            assert "taken over from process 1 on elsewhere.invalid" in capsys.readouterr().err


def test_an_owner_by_a_clock_far_ahead_is_told_with_what_to_remove(tmp_path):
    (tmp_path / OWNER).write_text(json.dumps({"pid": 1, "host": "elsewhere.invalid", "began": "x"}))
    ahead = time.time() + 3 * 86400
    os.utime(tmp_path / OWNER, (ahead, ahead))
    said = rf"by another process, by a clock 3 d ahead; remove {tmp_path / OWNER} if not; wait for it, or choose"
    with pytest.raises(TakenError, match=said), owned(tmp_path):
        raise AssertionError


def test_without_locks_an_owner_is_dead_whose_process_has_ended(holder, tmp_path, monkeypatch, capsys):
    def no_locks(*_):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(ownership.fcntl, "flock", no_locks)
    with (
        pytest.raises(TakenError, match=rf"by process {holder.pid} on .*, last heard of \d+ s ago"),
        owned(tmp_path / "run"),
    ):
        raise AssertionError
    holder.kill()
    holder.wait()
    with owned(tmp_path / "run"):
        assert f"taken over from process {holder.pid} on" in capsys.readouterr().err


def test_free_names_are_taken_before_anything_is_written(tmp_path):
    free = tmp_path / "eval"
    with whole_folder(None, free) as (one, first), whole_folder(None, free) as (other, second):
        assert (first.name, second.name) == ("eval-1", "eval-2")
        (one / "mine").touch()
        (other / "yours").touch()
        with pytest.raises(TakenError, match="is being written by process"), whole_folder(first, free):
            raise AssertionError
    assert (tmp_path / "eval-1" / "mine").exists() and (tmp_path / "eval-2" / "yours").exists()
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["eval-1", "eval-2", "mine", "yours"]


def test_results_are_kept_where_somebody_else_took_their_name_meanwhile(tmp_path, capsys):
    out = tmp_path / "new"
    with whole_folder(out, out) as (folder, _):
        (folder / "mine").touch()
        (out / "theirs").mkdir(parents=True)
    assert f"{out} exists by now: the results are in {out}-2" in capsys.readouterr().err
    assert (tmp_path / "new-2" / "mine").exists() and not list(tmp_path.glob(".*"))


def test_what_a_killed_process_wrote_for_a_folder_is_removed(tmp_path, capsys):
    part = tmp_path / ".new.part"
    (part / "old").mkdir(parents=True)
    (part / OWNER).write_text(json.dumps({"pid": 1, "host": ownership.socket.gethostname(), "began": "x"}))
    with whole_folder(tmp_path / "new", tmp_path / "free") as (folder, _):
        (folder / "mine").touch()
    assert "taken over from another process, which has ended" in capsys.readouterr().err
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["mine"] and not part.exists()


def test_a_folder_that_is_not_ours_is_left_alone(tmp_path):
    """`.NAME.part` may be anybody's: a folder, a link to one, a file."""
    (tmp_path / "home").mkdir()
    (tmp_path / "home" / "theirs").write_text("x")
    (tmp_path / ".eval-1.part").symlink_to(tmp_path / "home")
    (tmp_path / ".eval-2.part").mkdir()
    (tmp_path / ".eval-2.part" / "theirs").write_text("x")
    (tmp_path / ".eval-3.part").write_text("x")
    (tmp_path / ".eval-4.part").mkdir()
    (tmp_path / ".eval-4.part" / OWNER).write_text("theirs")
    (tmp_path / ".eval-4.part" / "theirs").write_text("x")
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    with whole_folder(None, tmp_path / "eval") as (folder, name):
        (folder / "mine").touch()
    assert name == tmp_path / "eval-5" and (name / "mine").exists()
    for number in range(1, 5):
        out = tmp_path / f"eval-{number}"
        said = (
            rf"\.{out.name}\.part is not of springfoot's making: remove it, or choose another folder than .*{out.name}"
        )
        with pytest.raises(TakenError, match=said), whole_folder(out, out):
            raise AssertionError
    assert {path: path.read_bytes() for path in before} == before


@pytest.mark.parametrize("target", ["victim", "nowhere"])
def test_no_owner_is_written_through_a_link(tmp_path, target):
    (tmp_path / "victim").write_text("precious")
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / OWNER).symlink_to(tmp_path / target)
    said = r"run/\.owner is not a file of springfoot's: remove it"
    with pytest.raises(SpringfootError, match=said), owned(tmp_path / "run"):
        raise AssertionError
    assert (tmp_path / "victim").read_text() == "precious" and not (tmp_path / "nowhere").exists()


def test_no_owner_is_written_over_another_file(tmp_path):
    (tmp_path / "victim").write_text("precious")
    for folder in ("hard", "own"):
        (tmp_path / folder).mkdir()
    os.link(tmp_path / "victim", tmp_path / "hard" / OWNER)
    (tmp_path / "own" / OWNER).write_text("precious")
    for folder in ("hard", "own"):
        with (
            pytest.raises(SpringfootError, match=r"is not a file of springfoot's: remove it"),
            owned(tmp_path / folder),
        ):
            raise AssertionError
        assert (tmp_path / folder / OWNER).read_text() == "precious"


def test_a_pipe_in_the_place_of_an_owner_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / OWNER)
    with pytest.raises(SpringfootError, match=r"\.owner is not a file of springfoot's: remove it"), owned(tmp_path):
        raise AssertionError


def test_a_folder_that_is_a_link_is_not_owned_one_above_it_may_be(tmp_path):
    (tmp_path / "disk").mkdir()
    (tmp_path / "runs").symlink_to(tmp_path / "disk")
    with pytest.raises(SpringfootError, match="runs is a link: name the folder itself"), owned(tmp_path / "runs"):
        raise AssertionError
    with owned(tmp_path / "runs" / "walk"):
        assert (tmp_path / "disk" / "walk" / OWNER).is_file()


@pytest.mark.slow
def test_two_trainings_into_one_folder_are_one_training(tmp_path):
    words = ["--out", "run", "--timesteps", "512", "--num-envs", "4", "--update-steps", "256", "--threads", "1"]
    command = [sys.executable, train.__file__, *words, "--eval-episodes", "1", "--episode-seconds", "1"]
    both = [subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True) for _ in range(2)]
    errors = [process.communicate()[1] for process in both]
    told = dict(zip((process.returncode for process in both), errors, strict=True))
    assert sorted(told) == [0, 2]
    assert told[2].count("\n") == 1 and ("being written by process" in told[2] or "already exists" in told[2])
    assert json.loads((tmp_path / "run" / "run.json").read_text())["status"] == "finished"


STARTS = {
    "train": [train.__file__, "--out", "new"],
    "evaluate": [evaluate.__file__, "pretrained", "--out", "new"],
    "study": ["-c", "from springfoot.cli.main import main; exit(main())", "study", "compare", "--out", "new"],
}


@pytest.mark.parametrize(("number", "said"), [(signal.SIGINT, "interrupted"), (signal.SIGTERM, "ended by SIGTERM")])
@pytest.mark.parametrize("imported", ["tyro", "springfoot.gait.body.leg_dynamics"])
@pytest.mark.parametrize("words", STARTS.values(), ids=STARTS)
def test_a_signal_at_the_start_is_one_line_and_leaves_nothing(tmp_path, words, imported, number, said):
    environment = os.environ | {"PYTHONPROFILEIMPORTTIME": "1"}  # a line on standard error after each import
    command = [sys.executable, *words]
    with subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True, env=environment) as process:
        assert process.stderr is not None
        assert any(line.split("|")[-1].strip() == imported for line in process.stderr)
        process.send_signal(number)
        told = [line for line in process.stderr if not line.startswith("import time:")]
    assert process.returncode == 128 + number, told
    assert told == [f"springfoot: {said}\n"]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_leaves_nothing_of_an_evaluation(tmp_path, number):
    command = [sys.executable, evaluate.__file__, "constant", "--episodes", "500"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        owner = tmp_path / "runs" / ".eval-constant-1.part" / OWNER
        while not (owner.exists() and owner.read_text()):
            assert process.poll() is None
            time.sleep(0.02)
        process.send_signal(number)
        _, error = process.communicate()
    assert process.returncode == 128 + number
    assert b"Traceback" not in error
    assert list(tmp_path.iterdir()) == []


def test_a_name_that_is_no_text_is_one_line(tmp_path, capsys):
    said = r"cannot make the folder .*\\udcff: its name must be UTF-8 text"
    with pytest.raises(SpringfootError, match=said), owned(tmp_path / "bad\udcff"):
        raise AssertionError
    assert exit_code("name", lambda: (tmp_path / "text").write_text("bad\udcff", encoding="utf-8")) == 2
    assert capsys.readouterr().err == "name: error: a name must be UTF-8 text, got 'bad\\udcff'\n"


def test_a_read_only_parent_is_one_line(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(ValueError, match="cannot make the folder"), owned(Path(tmp_path, "file", "run")):
        raise AssertionError


def test_a_link_to_nothing_is_a_name_in_use(tmp_path):
    free = tmp_path / "eval"
    (tmp_path / "eval-1").symlink_to(tmp_path / "nowhere")
    with whole_folder(None, free) as (_, name):
        assert name.name == "eval-2"
    with pytest.raises(TakenError, match="eval-1 exists already"), whole_folder(tmp_path / "eval-1", free):
        raise AssertionError
    with pytest.raises(SpringfootError, match="eval-1 already exists; out must be a new file"):
        write_new({tmp_path / "eval-1": b""})
    with pytest.raises(SpringfootError, match="eval-1 already exists; out must be a new or an empty folder"):
        require_new(tmp_path / "eval-1")
    assert (tmp_path / "eval-1").is_symlink() and not (tmp_path / "nowhere").exists()
