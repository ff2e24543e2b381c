"""springfoot export: what it writes and says, needs and refuses."""

import subprocess
import sys
from pathlib import Path

import pytest

from springfoot.cli.main import main

WITHOUT = """
import sys

class NotInstalled:
    def find_spec(name, path=None, target=None):
        if name.partition(".")[0] in ("torch", "stable_baselines3", "onnx", "onnxruntime"):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, NotInstalled)
from springfoot.cli.main import main
for to, out in (("numpy", "a.npz"), ("onnx", "a.onnx"), ("torch", "a.pt2")):
    print(main(["export", "pretrained", "--to", to, "--out", out]))
"""


def test_numpy_needs_no_torch_and_what_is_missing_is_said(tmp_path):
    done = subprocess.run([sys.executable, "-c", WITHOUT], cwd=tmp_path, capture_output=True, text=True)
    assert done.stdout.splitlines()[1:] == ["0", "2", "2"], done.stderr
    assert done.stderr.splitlines() == [
        "springfoot export: error: to onnx needs the package onnx: pip install 'springfoot[onnx]'",
        "springfoot export: error: to torch needs the package torch: pip install 'springfoot[train]'",
    ]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.npz", "a.npz.json", "play_a.py"]


@pytest.mark.parametrize(
    ("policy", "to", "out", "said"),
    [
        ("pretrained", "onnx", "old.onnx", "old.onnx already exists; out must be a new file"),
        ("pretrained", "torch", "new.pt2", "new.pt2.json already exists; out must be a new file"),
        ("pretrained", "numpy", "old.npz", "play_old.py already exists; out must be a new file"),
        ("pretrained", "onnx", "new.npz", "out must end in .onnx for onnx, got new.npz"),
        ("pretrained", "onnx", "old.onnx/new.onnx", "cannot make the folder old.onnx: File exists"),
        ("schedule", "onnx", "new.onnx", "schedule has no weights to export: "),
        ("frozen:pretrained", "onnx", "new.onnx", "frozen:pretrained has no weights to export: "),
        ("old.onnx", "numpy", "new.npz", "old.onnx has no weights to export: "),
        ("mine:act", "numpy", "new.npz", "mine:act has no weights to export: "),
        ("nobody", "onnx", "new.onnx", "no policy nobody: give "),
    ],
)
def test_what_cannot_be_exported_is_one_line_and_nothing_is_written(
    policy, to, out, said, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    for name in ("old.onnx", "new.pt2.json", "play_old.py"):
        (tmp_path / name).write_text("kept")
    assert main(["export", policy, "--to", to, "--out", out]) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"springfoot export: error: {said}") and error.count("\n") == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["new.pt2.json", "old.onnx", "play_old.py"]
    assert (tmp_path / "old.onnx").read_text() == "kept"


def test_the_command_says_what_it_wrote_and_how_to_go_on(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["export", "pretrained", "--to", "onnx", "--out", "so deep/walk.onnx"]) == 0
    results, following = capsys.readouterr().out.splitlines()
    assert results == f"Results: {Path('so deep/walk.onnx')}, {Path('so deep/walk.onnx.json')}"
    assert following == f"Next:    springfoot evaluate '{Path('so deep/walk.onnx')}'"
