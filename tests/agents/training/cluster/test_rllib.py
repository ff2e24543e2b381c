"""RLlib trains on several Ray nodes as our own trainer does here, and goes on after runners, nodes or all are killed.

RLlib pins another Gymnasium: `make test-rllib` runs these in an environment of their own.
"""

import dataclasses
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from springfoot.agents import load_policy, train
from springfoot.agents.policies.policy import Policy
from springfoot.agents.training.config import PRESETS, TrainingConfig, task_training
from springfoot.agents.training.returns import evaluate_returns
from springfoot.agents.training.run_record import is_of_rllib, read_record
from springfoot.cli.train import train_main
from springfoot.envs import Biped
from springfoot.envs.settings.settings import BipedSettings
from springfoot.envs.task.mirror import mirror_of
from springfoot.envs.vector_env import SegmentedFootBipedVector
from springfoot.errors import SpringfootError

ray = pytest.importorskip("ray", reason="RLlib has an environment of its own: make test-rllib")

from springfoot.agents.training.cluster import rllib_training  # noqa: E402

pytestmark = pytest.mark.filterwarnings("ignore")  # Ray's own
SMALL = TrainingConfig(timesteps=8192, num_envs=8, update_steps=1024, eval_interval=4096, eval_episodes=2)
TRAIN = [sys.executable, "-c", "import sys; from springfoot.cli.main import main; sys.exit(main())", "train"]


@pytest.fixture
def cluster():
    """A Ray cluster of three nodes on this machine: one without a processor for the learner, two with one each."""
    from ray.cluster_utils import Cluster  # pyright: ignore[reportMissingImports]

    made = Cluster(initialize_head=True, head_node_args={"num_cpus": 0})
    made.nodes = [made.add_node(num_cpus=1), made.add_node(num_cpus=1)]
    ray.init(address=made.address, log_to_driver=False, logging_level="ERROR")
    yield made
    ray.shutdown()
    made.shutdown()


def test_a_run_has_the_folder_of_any_other_and_its_policy_walks(tmp_path, capsys):
    out = tmp_path / "run"
    words = ["--out", str(out), "--engine", "rllib", "--num-env-runners", "2", "--timesteps", "8192"]
    words += ["--num-envs", "8", "--update-steps", "1024", "--eval-interval", "4096", "--eval-episodes", "2"]
    assert train_main(words) == 0
    assert "8" in capsys.readouterr().out
    record = read_record(out)
    assert record["status"] == "finished" and is_of_rllib(record) and record["engine"]["num_env_runners"] == 2
    assert {path.name.split("-")[0] for path in out.iterdir()} >= {"best.safetensors", "last.safetensors", "ray"}
    assert load_policy(out / "best.safetensors").settings == PRESETS["walk"].environment
    with pytest.raises(SpringfootError, match="has done its"):
        rllib_training.resume(out)


def test_the_first_policy_is_the_mean_action_of_the_untrained_network(tmp_path):
    """The file's network is the one that RLlib runs: the same actions for the same observations, before the clip."""
    import torch
    from ray.rllib.core.columns import Columns  # pyright: ignore[reportMissingImports]

    from springfoot.agents.training.cluster.rllib_network import ActorCritic, actor_layers

    mean, variance = rllib_training.observation_moments(SMALL)
    environments = SegmentedFootBipedVector(4)
    given = {"hidden": [8, 8], "log_std": -0.9, "mean": mean.tolist(), "variance": variance.tolist()}
    module = ActorCritic(
        observation_space=environments.single_observation_space,
        action_space=environments.single_action_space,
        model_config=given,
    )
    rows = environments.reset(seed=3)[0]
    with torch.no_grad():
        theirs = module.forward_inference({Columns.OBS: torch.from_numpy(rows)})[Columns.ACTION_DIST_INPUTS]
    layers = actor_layers({name: value.numpy() for name, value in module.state_dict().items()})
    hidden = np.clip((rows - mean) / np.sqrt(variance + 1e-8), -10, 10)
    for index, (weight, bias) in enumerate(layers):
        hidden = hidden @ weight.T + bias
        hidden = hidden if index == len(layers) - 1 else np.tanh(hidden)
    assert theirs[:, :4].numpy() == pytest.approx(hidden, abs=1e-5)
    assert theirs[:, 4:].numpy() == pytest.approx(-0.9)


def test_a_mirrored_network_acts_and_values_alike_on_both_sides(tmp_path):
    """The image of an observation has the image of the actions and the same value; the policy's file mirrors, too."""
    import torch
    from ray.rllib.core.columns import Columns  # pyright: ignore[reportMissingImports]

    from springfoot.agents.training.cluster.rllib_network import ActorCritic

    config = dataclasses.replace(SMALL, mirrored=True, timesteps=1024, eval_interval=1024)
    record = rllib_training.train(config, tmp_path / "run", num_env_runners=0)
    assert record["status"] == "finished"
    policy = load_policy(tmp_path / "run" / "last.safetensors")
    environments = SegmentedFootBipedVector(4)
    mirror = mirror_of(environments.biped.observation_names, environments.biped.action_names)
    assert isinstance(policy, Policy) and policy.mirror is not None
    assert policy.weights[-1].shape[0] == 2  # actions of the left leg
    rows = environments.reset(seed=3)[0]
    np.testing.assert_array_equal(policy(mirror.of(rows)), policy(rows)[:, mirror.action_index])
    mean, variance = rllib_training.observation_moments(config, mirror)
    np.testing.assert_array_equal(mirror.of(mean), mean)
    module = ActorCritic(
        observation_space=environments.single_observation_space,
        action_space=environments.single_action_space,
        model_config={
            "hidden": [8, 8],
            "log_std": -0.9,
            "mean": mean.tolist(),
            "variance": variance.tolist(),
            "mirror": {name: getattr(mirror, name).tolist() for name in ("index", "sign", "legs_order")},
        },
    )
    with torch.no_grad():
        rows, images = ({Columns.OBS: torch.from_numpy(values)} for values in (rows, mirror.of(rows)))
        given, mirrored = (module.forward_inference(batch)[Columns.ACTION_DIST_INPUTS] for batch in (rows, images))
        torch.testing.assert_close(mirrored[:, mirror.action_index], given[:, :4])
        torch.testing.assert_close(module.compute_values(images), module.compute_values(rows))


def test_two_nodes_learn_as_much_as_our_own_trainer_of_as_many_samples(cluster, tmp_path):
    """Of 500,000 steps of the task Walk-v0: at least .95 of its return, mean of 20 other episodes, and no fall."""
    config = dataclasses.replace(task_training("Walk-v0"), timesteps=500_000)
    train(config, tmp_path / "ours")
    rllib_training.train(config, tmp_path / "rllib", num_env_runners=2)
    biped = Biped(config.environment, 20, 2)
    ours, _, _ = evaluate_returns(biped, load_policy(tmp_path / "ours"), 0)
    theirs, _, fell = evaluate_returns(biped, load_policy(tmp_path / "rllib"), 0)
    print(f"our own {ours.mean():.1f}, RLlib {theirs.mean():.1f} with {fell.sum()} of 20 falls")
    assert theirs.mean() >= 0.95 * ours.mean()
    assert not fell.any()


def test_a_killed_node_and_its_runner_are_replaced(cluster, tmp_path):
    out = tmp_path / "run"
    words = ["--engine", "rllib", "--num-env-runners", "2", "--timesteps", "1000000", "--num-envs", "8"]
    words += ["--update-steps", "1024", "--eval-interval", "4096", "--eval-episodes", "2", "--out", str(out)]
    process = subprocess.Popen([*TRAIN, *words], env=os.environ | {"RAY_ADDRESS": cluster.address})

    def wait_for_runners(restarted):
        session = {}
        while (session.get("healthy_runners"), session.get("restarted_runners")) != (2, restarted):
            assert process.poll() is None
            time.sleep(0.2)
            if (out / "run.json").is_file():
                (session,) = read_record(out)["sessions"]

    wait_for_runners(0)
    cluster.remove_node(cluster.nodes[0], allow_graceful=False)
    cluster.add_node(num_cpus=1)
    wait_for_runners(1)
    process.send_signal(signal.SIGINT)
    assert process.wait() == 130
    assert load_policy(out).settings == PRESETS["walk"].environment


def test_a_run_that_is_killed_altogether_goes_on(tmp_path):
    out = tmp_path / "run"
    words = ["--engine", "rllib", "--num-env-runners", "1", "--timesteps", "400000", "--num-envs", "8"]
    words += ["--update-steps", "1024", "--eval-interval", "4096", "--eval-episodes", "2"]
    process = subprocess.Popen([*TRAIN, "--out", str(out), *words], start_new_session=True)
    while not list(out.glob("ray-[1-9]*")):
        assert process.poll() is None
        time.sleep(0.2)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    done = max(int(path.name.removeprefix("ray-")) for path in out.glob("ray-*"))
    record = rllib_training.resume(out, timesteps=4096)
    assert record["status"] == "finished" and record["timesteps"] >= done + 4096
    assert [entry["timesteps"] for entry in record["evaluations"]] == sorted(
        {entry["timesteps"] for entry in record["evaluations"]}
    )


def test_the_first_ctrl_c_leaves_a_run_that_goes_on(tmp_path):
    out = tmp_path / "run"
    words = ["--engine", "rllib", "--num-env-runners", "1", "--timesteps", "4000000", "--out", str(out)]
    process = subprocess.Popen([*TRAIN, *words], start_new_session=True)
    while not list(out.glob("ray-*")):
        assert process.poll() is None
        time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    assert process.wait(120) == 130
    assert read_record(out)["status"] == "interrupted" and load_policy(out).settings == BipedSettings(
        episode_seconds=10.0, push_newton=150.0
    )


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--engine", "rllib", "--num-env-runners", "3"], "num_envs must be a multiple of the 3 runners, got 64"),
        (["--num-env-runners", "2"], "--num-env-runners is of --engine rllib; give that, or drop it"),
        (["--engine", "rllib", "--seeds", "2"], "--seeds trains with stable-baselines3; drop --engine"),
    ],
)
def test_flags_that_do_not_fit_are_one_line(tmp_path, capsys, words, said):
    assert train_main([*words, "--out", str(tmp_path / "run")]) == 2
    assert capsys.readouterr().err.splitlines()[-1] == f"train.py: error: {said}"
    assert not (tmp_path / "run").exists()


def test_more_runners_than_the_cluster_has_processors_are_refused(cluster, tmp_path, capsys):
    words = ["--engine", "rllib", "--num-env-runners", "4", "--out", str(tmp_path / "run")]
    assert train_main(words) == 2
    assert capsys.readouterr().err.splitlines() == [
        "train.py: error: the Ray cluster has 2 processors, and each runner needs one; "
        "num_env_runners must be <= 2, got 4"
    ]
    assert not list(tmp_path.iterdir())


@pytest.fixture
def others(cluster):
    """Programs that use both processors of the cluster."""

    class Other:
        def begin(self): ...

    others = [ray.remote(num_cpus=1)(Other).remote() for _ in range(2)]
    ray.get([other.begin.remote() for other in others])
    return others


def test_a_wait_for_processors_that_others_use_is_told_and_sigterm_ends_it(cluster, others, tmp_path):
    words = ["--engine", "rllib", "--num-env-runners", "1", "--out", str(tmp_path / "run")]
    environment = os.environ | {"RAY_ADDRESS": cluster.address}
    process = subprocess.Popen([*TRAIN, *words], env=environment, stderr=subprocess.PIPE, text=True)
    while not any(actor["State"] == "PENDING_CREATION" for actor in ray._private.state.actors().values()):
        assert process.poll() is None
        time.sleep(0.2)
    process.send_signal(signal.SIGTERM)
    _, told = process.communicate(timeout=120)
    assert process.returncode == 143
    assert told.count("waiting for 1 processor of the Ray cluster, for RLlib's runners: 0 of its 2 are free\n") == 1
    assert not list(tmp_path.iterdir())


def test_commands_tell_of_a_wait_and_run_when_a_processor_is_free(cluster, others, capsys):
    from springfoot.agents.training.cluster.nodes import run_on_ray

    said = "waiting for 1 processor of the Ray cluster, for first, the first of 2: 0 of its 2 are free\n"
    commands = [(name, ["sh", "-c", "echo done >&2"]) for name in ("first", "second")]
    with ThreadPoolExecutor() as pool:
        running = pool.submit(run_on_ray, commands)
        told = ""
        while said not in told:
            assert not running.done()
            time.sleep(0.1)
            told += capsys.readouterr().err
        ray.kill(others[0])
        running.result()
    assert sorted(capsys.readouterr().err.splitlines()) == ["first: done", "second: done"]
    run_on_ray(commands[:1])
    assert capsys.readouterr().err == "first: done\n"  # no word where a processor is free


def test_trainings_of_a_study_run_on_the_nodes_and_again_where_one_dies(cluster, tmp_path, capsys):
    from springfoot.agents.training import train_missing

    jobs = [(dataclasses.replace(SMALL, seed=k, timesteps=20_480), tmp_path / f"seed-{k}", f"seed {k}") for k in (0, 1)]

    with ThreadPoolExecutor() as pool:  # nodes are added in the main thread, as Ray asks for it
        trained = pool.submit(train_missing, jobs, "ray")
        while not all(list(folder.glob("state-*")) for _, folder, _ in jobs):
            assert not trained.done()
            time.sleep(0.1)
        cluster.remove_node(cluster.nodes[0], allow_graceful=False)
        cluster.add_node(num_cpus=1)
        assert trained.result() == "finished"
    assert all(read_record(folder)["timesteps"] >= 20_480 for _, folder, _ in jobs)
    assert capsys.readouterr().err.count("taken over from") == 1  # the one that had begun on the killed node
