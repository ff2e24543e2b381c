"""Clone the expert of a Minari set by least squares of its actions, without an environment, and write a policy file.

springfoot datasets expert
python examples/clone_from_minari.py --out clone.safetensors
springfoot evaluate clone.safetensors
"""

import argparse
from pathlib import Path

import numpy as np

from springfoot.extras import exiting_if_missing

with exiting_if_missing():
    import minari
    import torch
    from torch import nn

    from springfoot.agents import policy_from_mlp, save_policy


def main() -> None:
    """Fit a network of the size of our own, and save it with the statistics of the observations."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--dataset", default="springfoot/walk/expert-v0")
    parser.add_argument("--epochs", type=int, default=40)
    parser.add_argument("--out", type=Path, default=Path("clone.safetensors"))
    given = parser.parse_args()
    if given.out.exists():
        parser.error(f"{given.out} exists already; give --out a new file")

    torch.manual_seed(0)
    torch.set_num_threads(1)
    dataset = minari.load_dataset(given.dataset)
    episodes = list(dataset.iterate_episodes())
    observations = np.concatenate([episode.observations[:-1] for episode in episodes]).astype(np.float32)
    actions = np.concatenate([episode.actions for episode in episodes]).astype(np.float32)
    mean, variance = observations.mean(axis=0), observations.var(axis=0)
    variance[variance < 1e-6] = 1e12  # a constant tells nothing
    inputs = torch.from_numpy(((observations - mean) / np.sqrt(variance)).clip(-10, 10).astype(np.float32))
    targets = torch.from_numpy(actions)
    network = nn.Sequential(nn.Linear(inputs.shape[1], 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, 4))
    optimizer = torch.optim.Adam(network.parameters(), lr=1e-3)
    for _ in range(given.epochs):
        for batch in torch.randperm(len(inputs)).split(256):
            loss = nn.functional.mse_loss(network(inputs[batch]), targets[batch])
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
    error = nn.functional.mse_loss(network(inputs), targets).item()
    print(f"{len(inputs):,} steps, mean squared error of the action {error:.5f}")
    assert dataset.spec.env_spec is not None
    layers = [(layer.weight, layer.bias) for layer in network if isinstance(layer, nn.Linear)]
    seen = {"observation_mean": mean, "observation_variance": variance, "observation_clip": 10.0, "variance_floor": 0.0}
    save_policy(given.out, policy_from_mlp(layers, dataset.spec.env_spec.kwargs, activation="tanh", **seen))


if __name__ == "__main__":
    main()
