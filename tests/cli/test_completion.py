"""Tab completion: bash, with the printed script, offers commands, studies and flags."""

import shutil
import subprocess

import pytest

from springfoot.cli.main import STUDIES, main

OFFER = """
source "$1"; shift
COMP_WORDS=(springfoot "$@"); COMP_CWORD=$#
complete=$(complete -p springfoot); complete=${complete##*-F }; ${complete%% *}
echo "${COMPREPLY[@]}"
"""


@pytest.mark.slow
def test_bash_offers_commands_studies_and_flags(tmp_path, capsys):
    bash = shutil.which("bash")
    if bash is None:
        pytest.skip("needs bash")
    assert main(["completion", "bash"]) == 0
    script = tmp_path / "springfoot.bash"
    script.write_text(capsys.readouterr().out, encoding="utf-8")

    def offered(*words):
        done = subprocess.run([bash, "-c", OFFER, "bash", str(script), *words], capture_output=True, text=True)
        return set(done.stdout.split())

    assert {"train", "evaluate", "live", "export", "study"} <= offered("")
    assert offered("ev") == {"evaluate"}
    assert {"--speed", "--speed-range"} <= offered("evaluate", "--spe")
    assert set(STUDIES) <= offered("study", "")
    assert {"--quick", "--height"} <= offered("study", "bodies", "--")
    assert offered("evaluate", "runs/wa") == set()  # so that bash offers files
    assert "complete -o default" in script.read_text(encoding="utf-8")


@pytest.mark.parametrize("words", [[], ["fish"], ["bash", "zsh"]])
def test_another_shell_is_refused(words, capsys):
    assert main(["completion", *words]) == 2
    told = f"springfoot completion: error: give one of bash, zsh, tcsh, got {' '.join(words)!r}\n"
    assert capsys.readouterr().err == told


def test_springfoot_alone_tells_what_to_type_first(capsys):
    assert main([]) == 0
    told = capsys.readouterr().out
    for command in ("live pretrained", "evaluate pretrained", "train --out runs/mine"):
        assert f"springfoot {command} " in told
