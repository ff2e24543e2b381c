"""Tab completion: shells, with the printed script, offer commands, studies, policies and flags."""

import re
import shutil
import subprocess
import sys

import pytest

from springfoot.agents.policies.baselines import BASELINES
from springfoot.agents.policies.policy import SHIPPED
from springfoot.cli.main import COMMANDS, STUDIES, main

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
    assert offered("comp") == {"completion"}
    assert {"--speed", "--speed-range"} <= offered("evaluate", "--spe")
    assert offered("live", "pre") == {"pretrained", "predicted"}
    assert set(STUDIES) <= offered("study", "")
    assert {"--quick", "--height"} <= offered("study", "bodies", "--")
    assert offered("evaluate", "runs/wa") == set()  # so that bash offers files
    assert "complete -o default" in script.read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.parametrize("shell", ["bash", "zsh"])
def test_the_scripts_offer_policies_and_flags_and_no_word_of_a_description(shell, capsys):
    assert main(["completion", shell]) == 0
    (program,) = re.findall(r"<< 'PYTHON_EOF'.*?\n(.*?)\nPYTHON_EOF", capsys.readouterr().out, re.DOTALL)

    def offered(*words):
        command = [sys.executable, "-", "springfoot", *words, str(len(words))]
        done = subprocess.run(command, input=program, capture_output=True, text=True, check=True)
        return [line.partition("\t")[0] for line in done.stdout.splitlines()]

    for command in ("evaluate", "live", "export"):
        words = offered(command, "")
        names = {word for word in words if not word.startswith("-")}
        assert names == {*SHIPPED, *(() if command == "export" else BASELINES)}
        assert all(re.fullmatch(r"--?[\w-]+", word) for word in {*words} - names)
        assert offered(command, "pretr") == ["pretrained"]
    assert {word for word in offered("") if not word.startswith("-")} == {*COMMANDS}
    assert {word for word in offered("completion", "") if not word.startswith("-")} == {"bash", "zsh"}
    assert offered("completion", "b") == ["bash"]
    assert all(word.startswith("-") for word in offered("train", ""))
    assert offered("train", "--preset", "") == ["walk", "any-body", "predict", "person"]


@pytest.mark.parametrize("words", [[], ["fish"], ["tcsh"], ["bash", "zsh"]])
def test_another_shell_is_refused(words, capsys):
    assert main(["completion", *words]) == 2
    told = f"springfoot completion: error: give one of bash, zsh, got {' '.join(words)!r}\n"
    assert capsys.readouterr().err == told


def test_springfoot_alone_tells_what_to_type_first(capsys):
    assert main([]) == 0
    told = capsys.readouterr().out
    for command in ("live pretrained", "evaluate pretrained", "train --out runs/mine"):
        assert f"springfoot {command} " in told
