"""Disks that are full or read-only and folders that vanish: one line, exit code 2, and nothing half-written."""

import shutil
import subprocess
import sys
import time

import pytest

SPRINGFOOT = [sys.executable, "-c", "import sys; from springfoot.cli.main import main; sys.exit(main())"]
EVALUATE = [*SPRINGFOOT, "evaluate", "schedule", "--episodes", "1", "--seconds", "2", "--no-report"]
ON_TMPFS = """
mount -t tmpfs -o "$2" tmpfs "$1" || exit 99
cd "$1" && shift 2
"$@"
code=$?
ls -AR . | tr '\n' ' '
exit $code
"""
"""A shell that runs a command in a small file system of its own, and tells what is left in it."""


def on_tmpfs(folder, options, *command):
    if shutil.which("unshare") is None:
        pytest.skip("no unshare")
    words = ["unshare", "--map-root-user", "--mount", "sh", "-c", ON_TMPFS, "sh", str(folder), options, *command]
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode in (1, 99) and "ermi" in done.stderr:
        pytest.skip(f"no file system of one's own: {done.stderr}")
    return done


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "words", "said"),
    [
        ("size=64k", [*EVALUATE, "--out", "new"], "No space left on device"),
        (
            "size=8k",
            [*SPRINGFOOT, "export", "pretrained", "--out", "walk.onnx"],
            "No space left on device",
        ),
        ("ro", [*EVALUATE, "--out", "new"], "Read-only file system"),
        ("ro", [*SPRINGFOOT, "train", "--timesteps", "64", "--out", "new"], "Read-only file system"),
        ("ro", [*SPRINGFOOT, "study", "compare", "schedule", "--quick", "--out", "new"], "Read-only file system"),
    ],
    ids=["evaluate full", "export full", "evaluate read-only", "train read-only", "study read-only"],
)
def test_a_full_or_read_only_disk_is_one_line_and_leaves_nothing(tmp_path, options, words, said):
    done = on_tmpfs(tmp_path, options, *words)
    (line,) = done.stderr.strip().splitlines()
    assert done.returncode == 2 and line.startswith(f"springfoot {words[3]}") and said in line
    assert done.stdout.strip().endswith(".:")  # nothing, hidden or not


FILLED = """
"$0" "$@"
echo code $? >&2
mount -o remount,size=300k . && "$0" "$1" "$2" train --resume new
echo code $? >&2
mount -o remount,size=64m . && "$0" "$1" "$2" train --resume new
"""
"""A shell that trains until the disk is full, before and after the first checkpoint, and goes on with more room."""


@pytest.mark.slow
def test_a_disk_that_a_training_fills_is_one_line_and_it_goes_on_with_more_room(tmp_path):
    words = ["train", "--out", "new", "--timesteps", "1024", "--num-envs", "4", "--update-steps", "256"]
    words += ["--threads", "1", "--eval-interval", "256", "--eval-episodes", "1", "--episode-seconds", "1"]
    done = on_tmpfs(tmp_path, "size=8k", "sh", "-c", FILLED, *SPRINGFOOT, *words)
    lines = [line for line in done.stderr.strip().splitlines() if " of 1,024 steps" not in line]
    assert lines[1::2] == ["code 2"] * 2
    for line, said in zip(
        lines[::2], ("results are written whole or not at all", "goes on from state-0.safetensors"), strict=True
    ):
        assert line.startswith("springfoot train: error: ") and line.endswith(said)
        assert "No space left on device" in line
    assert done.returncode == 0 and "1,024 steps in" in done.stdout and "finished." in done.stdout


@pytest.mark.slow
def test_a_folder_that_vanishes_meanwhile_is_one_line(tmp_path):
    parent = tmp_path / "runs"
    parent.mkdir()
    process = subprocess.Popen([*EVALUATE, "--out", str(parent / "new")], stderr=subprocess.PIPE, text=True)
    until = time.monotonic() + 300
    while not any(parent.rglob(".owner")) and process.poll() is None and time.monotonic() < until:
        time.sleep(0.01)
    shutil.rmtree(parent)
    _, error = process.communicate()
    (line,) = error.strip().splitlines()
    assert process.returncode == 2
    assert line.startswith("springfoot evaluate: error: No such file or directory: ")
    assert line.endswith("; results are written whole or not at all")
