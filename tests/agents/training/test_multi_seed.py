"""Several seeds at once: the same bits as one by one, one report, and an end in good order."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import train
from springfoot.agents.policies.policy import BEST, read_policy
from springfoot.agents.training import multi_seed as seeds
from springfoot.cli import train as train_command

SCRIPT, RUN = Path(train.__file__), "run.json"
SHORT = [
    *("--num-envs", "8", "--update-steps", "1024", "--eval-interval", "1024"),
    *("--eval-episodes", "2", "--episode-seconds", "1"),
]


def main(monkeypatch, *words):
    monkeypatch.setattr(sys, "argv", ["train.py", *map(str, words)])
    return train_command.train_main()


@pytest.mark.slow
def test_each_seed_is_the_training_it_would_be_alone_and_the_report_has_their_spread(monkeypatch, capfd, tmp_path):
    short = ["--timesteps", 1024, *SHORT]
    assert main(monkeypatch, "--out", tmp_path / "several", "--seeds", 2, "--seed", 3, *short) == 0
    out, progress = capfd.readouterr()
    assert "seed 3: 1,024 of 1,024 steps · return " in progress and "seed 4: 1,024 of 1,024" in progress
    assert main(monkeypatch, "--out", tmp_path / "alone", "--seed", 4, "--threads", 2, *short) == 0
    alone, several = (tmp_path / folder / BEST for folder in ("alone", "several/seed-4"))
    assert several.read_bytes() == alone.read_bytes()
    assert several.read_bytes() != (tmp_path / "several/seed-3" / BEST).read_bytes()

    record = json.loads((tmp_path / "several" / seeds.SEEDS).read_text())
    assert record["status"] == "finished" and [row["seed"] for row in record["seeds"]] == [3, 4]
    returns = []
    for row in record["seeds"]:
        run = json.loads((tmp_path / "several" / row["folder"] / RUN).read_text())
        assert run["config"]["seed"] == row["seed"] and row["timesteps"] == run["timesteps"] == 1024
        assert row["return_mean"] == run["best"]["return_mean"]
        returns.append(row["return_mean"])
    assert record["spread"]["return_mean"]["mean"] == pytest.approx(sum(returns) / 2)
    assert record["spread"]["return_mean"]["sd"] == pytest.approx(abs(returns[0] - returns[1]) / 2**0.5)
    assert f"| 4 | finished | 1,024 | {record['seeds'][1]['seconds']:.0f} | {returns[1]:.1f} |" in out
    assert f"springfoot study compare {tmp_path / 'several'}/seed-* --no-springs" in out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--out", "new", "--seeds", "0"], "seeds must be"),
        (["--out", "new", "--seeds", "2", "--seed", "2147483647"], "seed must be"),
        (["--out", "new", "--seeds", "2", "--threads", "2"], "drop --threads"),
        (["--out", "new", "--seeds", "2", "--mass", "-1"], "mass must be"),
        (["--out", "new", "--seeds", "2", "--equilibrium", "neutral", "--cadence", "thesis"], "constants"),
        (["--out", "file", "--seeds", "2"], "already exists"),
        (["--out", "file/new", "--seeds", "2"], "cannot make the folder"),
        (["--resume", "old", "--seeds", "2"], "begins anew"),
    ],
)
def test_bad_input_is_one_line_exit_code_2_and_nothing_on_disk(monkeypatch, capsys, tmp_path, words, message):
    (tmp_path / "file").write_text("kept")
    monkeypatch.chdir(tmp_path)
    assert main(monkeypatch, *words) == 2
    out, error = capsys.readouterr()
    assert out == "" and error.count("\n") == 1 and message in error
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.slow
def test_a_signal_ends_all_in_good_order(tmp_path):
    number = signal.SIGTERM  # Ctrl-C reaches the processes of a terminal by itself
    folder = tmp_path / "several"
    command = [sys.executable, SCRIPT, "--out", folder, "--seeds", "2", "--timesteps", "10_000_000", *SHORT]
    runs = [folder / "seed-0" / RUN, folder / "seed-1" / RUN]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            deadline = time.monotonic() + 120
            while not runs[0].exists() or json.loads(runs[0].read_text())["timesteps"] < 1024:
                assert process.poll() is None, process.stderr and process.stderr.read()
                assert time.monotonic() < deadline
                time.sleep(0.05)
            process.send_signal(number)
            out, error = process.communicate(timeout=60)
        finally:
            process.kill()
    assert process.returncode == 128 + number, error
    assert "Traceback" not in error and f"Or:      springfoot train --resume {folder}/seed-0" in out
    record = json.loads((folder / seeds.SEEDS).read_text())
    assert record["status"] == "interrupted"
    assert record["seeds"][0]["status"] == "interrupted" and record["seeds"][0]["timesteps"] >= 1024
    assert record["seeds"][1]["status"] in ("interrupted", "not begun")
    run = json.loads(runs[0].read_text())
    assert (run["status"], run["signal"]) == ("interrupted", number.name)  # the process's own words
    assert read_policy(folder / "seed-0").observation_mean.shape


@pytest.mark.slow
def test_a_process_that_is_killed_is_told_and_the_others_go_on(tmp_path):
    folder = tmp_path / "several"
    words = ["--out", str(folder), "--seeds", "2", "--timesteps", "4096", "--num-envs", "4", "--update-steps", "512"]
    words += ["--eval-episodes", "2", "--episode-seconds", "1"]
    command, pipe = [sys.executable, str(SCRIPT), *words], subprocess.PIPE
    process = subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True)
    while not (folder / "seed-0" / RUN).exists():
        assert process.poll() is None
        time.sleep(0.05)
    children = [path.read_text() for path in Path(f"/proc/{process.pid}/task").glob("*/children")]
    for child in map(int, " ".join(children).split()):
        if str(folder / "seed-0") in Path(f"/proc/{child}/cmdline").read_text():
            os.kill(child, signal.SIGKILL)
    out, error = process.communicate()
    assert process.returncode == 1 and "Traceback" not in error
    on = f"springfoot train --resume {folder / 'seed-0'}"
    assert f"seed 0: its process was ended by SIGKILL; {on} goes on from what it has saved" in error
    assert f"\nOr:      {on}\n" in out
    rows = json.loads((folder / seeds.SEEDS).read_text())["seeds"]
    assert [row["status"] for row in rows] == ["failed", "finished"]


def test_what_goes_on_where_all_were_killed_is_named(monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)
    for name in ("seed-10", "seed-9", "seed-11"):
        (tmp_path / "many" / name).mkdir(parents=True)
    assert main(monkeypatch, "--out", "many", "--seeds", 3) == 2
    new = "train.py: error: many already exists; out must be a new or an empty folder"
    assert capsys.readouterr().err == f"{new}\n"
    for name in ("seed-10", "seed-9"):
        (tmp_path / "many" / name / RUN).touch()
    assert main(monkeypatch, "--out", "many", "--seeds", 3) == 2
    assert capsys.readouterr().err == f"{new}; to continue a run, give --resume many/seed-9, then so with seed-10\n"
    assert main(monkeypatch, "--resume", "many") == 2
    error = "many holds no run to continue: no run.json in it; its runs are many/seed-9, many/seed-10"
    assert capsys.readouterr().err == f"train.py: error: {error}\n"


@pytest.mark.slow
def test_sigterm_before_anything_runs_is_no_failure(tmp_path):
    command = [sys.executable, SCRIPT, "--out", tmp_path / "several", "--seeds", "3", *SHORT]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        assert "3 seeds" in process.stderr.readline()
        process.send_signal(signal.SIGTERM)
        _, error = process.communicate(timeout=60)
    assert process.returncode == 128 + signal.SIGTERM and "Traceback" not in error
    rows = json.loads((tmp_path / "several" / seeds.SEEDS).read_text())["seeds"]
    assert {row["status"] for row in rows} <= {"interrupted", "not begun"}


def test_a_seed_without_a_result_is_in_the_table_and_not_in_the_spread():
    done = {"folder": "seed-0", "status": "finished", "timesteps": 2048, "seconds": 30.0, "episodes": 16}
    done |= {"return_mean": 10.0, "falls": 1, "best_timesteps": 1024}
    other = done | {"return_mean": 14.0, "falls": 3}
    failed = dict.fromkeys(done) | {"status": "failed"}
    rows = [{**row, "seed": seed} for seed, row in enumerate((done, failed, other))]
    found = seeds.spread(rows)
    assert found["return_mean"] == {"mean": 12.0, "sd": pytest.approx(8**0.5)}
    *_, middle, last, summary = seeds.training_table({"seeds": rows, "spread": found}).splitlines()
    assert middle == "| 1 | failed | – | – | – | – | – |"
    assert last == "| 2 | finished | 2,048 | 30 | 14.0 | 3 of 16 | 1,024 |"
    assert "| 12.0 ± 2.8 | 2.0 ± 1.4 |" in summary
    assert "– ± –" in seeds.training_table({"seeds": rows[1:2], "spread": seeds.spread(rows[1:2])})
