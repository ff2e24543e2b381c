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
print(main(["export", "pretrained", "--out", "a.onnx"]))
"""


def test_the_missing_package_is_named(tmp_path):
    done = subprocess.run([sys.executable, "-c", WITHOUT], cwd=tmp_path, capture_output=True, text=True)
    assert done.stdout.splitlines() == ["2"], done.stderr
    assert done.stderr.splitlines() == [
        "springfoot export: error: an export needs the package onnx: pip install 'springfoot[onnx]'"
    ]
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("policy", "out", "said"),
    [
        ("pretrained", "old.onnx", "old.onnx already exists; out must be a new file"),
        ("pretrained", "new.onnx", "new.onnx.json already exists; out must be a new file"),
        ("pretrained", "new.npz", "out must end in .onnx, got new.npz"),
        ("pretrained", "old.onnx/new.onnx", "cannot make the folder old.onnx: File exists"),
        ("schedule", "a.onnx", "schedule has no weights to export: "),
        ("frozen:pretrained", "a.onnx", "frozen:pretrained has no weights to export: "),
        ("old.onnx", "a.onnx", "old.onnx has no weights to export: "),
        ("mine:act", "a.onnx", "mine:act has no weights to export: "),
        ("nobody", "a.onnx", "no policy nobody: give "),
    ],
)
def test_what_cannot_be_exported_is_one_line_and_nothing_is_written(policy, out, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for name in ("old.onnx", "new.onnx.json"):
        (tmp_path / name).write_text("kept")
    assert main(["export", policy, "--out", out]) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"springfoot export: error: {said}") and error.count("\n") == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["new.onnx.json", "old.onnx"]
    assert (tmp_path / "old.onnx").read_text() == "kept"


def test_the_command_says_what_it_wrote_and_how_to_go_on(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["export", "pretrained", "--out", "so deep/walk.onnx"]) == 0
    results, following = capsys.readouterr().out.splitlines()
    assert results == f"Results: {Path('so deep/walk.onnx')}, {Path('so deep/walk.onnx.json')}"
    assert following == f"Next:    springfoot evaluate '{Path('so deep/walk.onnx')}'"
