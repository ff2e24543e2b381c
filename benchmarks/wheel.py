"""Check that the installed package does as README says: run in an empty folder, by the Python that has the wheel.

    make test-wheel

Short: the checkers of Gymnasium and stable-baselines3, every policy of the package, README's Python and commands, and
the copied examples with installed libraries. In programs of our own a warning is an error.
"""

import re
import shlex
import signal
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

STRICT = [sys.executable, "-W", "error"]
SHORTER = {"--episodes": "1", "--timesteps": "20000"}
"""Flag -> its value here."""
EXAMPLES = {
    "one_walk.py": "--seconds 1",
    "many_walks.py": "--num 3 --seconds 2",
    "plot_schedule.py": "schedule --episodes 1 --seconds 7",
    "train_with_sb3.py": "--timesteps 32 --num-envs 4 --steps 8 --seconds 0.4",
    "search_with_optuna.py": "--trials 2 --timesteps 9000 --seconds 0.4",
    "clone_from_minari.py": "--epochs 1 --dataset springfoot/walk/random-v0",
    "cleanrl_ppo.py": "--timesteps 2048",
    "sb3.py": "--timesteps 2048",
}
"""Example -> words that make it short; the others are of libraries that springfoot does not bring."""
CHECKERS = """
import gymnasium as gym
from gymnasium.utils.env_checker import check_env
from stable_baselines3.common.env_checker import check_env as check_env_sb3
import springfoot

env = gym.make("springfoot/SegmentedFootBiped-v0").unwrapped
check_env(env, skip_render_check=True)
check_env_sb3(env)
gym.make_vec("springfoot/SegmentedFootBiped-v0", num_envs=4).reset(seed=0)
"""
POLICIES = """
from importlib import resources
from re import findall
from springfoot.agents import policy_card
from springfoot.agents.policies import SHIPPED
from springfoot.evaluation import policy_and_settings, record

for name in SHIPPED:
    policy, settings = policy_and_settings(name, {"episode_seconds": 2.0})
    walked = record(policy, settings, name=name, episodes=1).ticks.min()
    assert walked == 200, f"{name} falls after {walked} ticks"
    for page in findall(r"docs/\\S+\\.md", policy_card(name)):
        assert (resources.files("springfoot") / page).is_file(), page
print(len(SHIPPED), "policies walk")
"""


def main() -> None:
    """Run all of it; the first failure ends it."""
    readme = Path(sys.argv[1]).read_text(encoding="utf-8")
    run(*STRICT, "-c", CHECKERS)
    run(*STRICT, "-c", POLICIES)
    run(*STRICT, "-c", "\n".join(re.findall(r"```python\n(.*?)```", readme, re.DOTALL)))
    for words in commands_in(readme):
        if words[1] == "live":
            open_live(*words)
        else:
            run(*words)
    run("springfoot", "datasets", "random", "--episodes", "2")
    run("springfoot", "examples", "--copy", "examples")
    for name, words in EXAMPLES.items():
        (path,) = Path("examples").rglob(name)
        missing = [one for one in ("optuna",) if f"import {one}" in path.read_text() and find_spec(one) is None]
        if missing:
            print(f"not run: {path} needs {missing[0]}", flush=True)
        else:
            run(*STRICT, str(path), *words.split())


def commands_in(readme: str) -> list[list[str]]:
    """Return README's commands of the package, as words, shortened; `springfoot train` alone is a name in a
    sentence."""
    blocks = re.findall(r"```sh\n(.*?)```", readme, re.DOTALL)
    lines = [line.partition("#")[0] for block in blocks for line in block.splitlines()]
    lines += re.findall(r"`([^`\n]+)`", readme)
    commands = [words for line in lines if line.startswith("springfoot ") and len(words := shlex.split(line)) > 2]
    for words in commands:
        for flag, value in SHORTER.items():
            if flag in words:
                words[words.index(flag) + 1] = value
            elif (words[1], flag) in (("evaluate", "--episodes"), ("train", "--timesteps")):
                words += [flag, value]
    return commands


def run(*command: str) -> None:
    """Run a command, and end with its exit code where it fails."""
    print("+", shlex.join(command)[:100].partition("\n")[0], flush=True)
    code = subprocess.run(command, check=False).returncode
    if code:
        sys.exit(code)


def open_live(*command: str) -> None:
    """Start the live page, wait for its address, and end it by Ctrl-C."""
    print("+", *command, flush=True)
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as page:
        assert page.stdout is not None
        said = next((line for line in page.stdout if "http://" in line), "")
        page.send_signal(signal.SIGINT)
    assert said, "no address"


if __name__ == "__main__":
    main()
