"""Let a learned person walk: a network in the step moves the rest angles of hips, knees and ankles every 20 ms.

The network is a mirrored policy (`springfoot.agents.policies.policy`) of a training with `acts` "both" or "person". It
acts by its mean action, on the observation without noise, with the entries for a stiffness that others set.
"""

from itertools import pairwise
from math import radians
from pathlib import Path
from typing import Any

import numpy as np

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError
from springfoot.files.tensor_file import digest_of_file, read_tensors

from ..physics.model import ACTIONS, MOVED, actions_of
from ..settings.settings import FARTHEST_OFFSET_DEG, FASTEST_AIM, TUNED
from ..task.mirror import mirror_of
from ..task.observation_entries import PERSON_OBSERVATION
from .leg_network import LegNetwork

PERSONS_FOLDER = Path(__file__).parent / "persons"
"""Folder of the persons that come with the package."""
PERSON_SEEDS = (1, 2, 3, 4, 5)
"""Seeds of the trainings of the persons that come with the package, `springfoot train --preset person --seed SEED`."""
LEARNED = {
    "learned": "learned-1",
    **{name: name for name in (f"learned-{seed}" for seed in PERSON_SEEDS)},
    "predicted": "predicted",
}
"""Name of a person of this package -> its file in `PERSONS_FOLDER`, without suffix: the training's last policy."""
POLICY_ENTRIES = frozenset({"format_version", "network", "settings", "fingerprint"})
"""Entries of a policy's header."""
PERSON_NAMES = tuple(entry.name for entry in PERSON_OBSERVATION)
LARGEST_OF_PERSON = 1e6
"""Largest magnitude of a person's numbers [-], but for variances: those of entries that never varied are larger;
chosen: sums of products stay finite."""
_OF_STIFFNESS = np.array(
    [PERSON_NAMES.index(name) for name in ("own_stiffness", *(f"last_action_{a}" for a in ACTIONS))]
)
"""Entries that are 0 where others set the stiffness."""


def person_file(name: str) -> Path:
    """Return the file of a person, one of `LEARNED` or a path; raise `SpringfootError` if there is none."""
    path = PERSONS_FOLDER / f"{LEARNED[name]}.safetensors" if name in LEARNED else Path(name)
    if not path.is_file():
        known = ", ".join(repr(one) for one in (TUNED, *LEARNED) if one != name)
        raise SpringfootError(f"person must be one of {known}, or the file of a policy that is one, got {name!r}")
    return path


class LearnedPerson:
    """The network of a person, read from its file.

    Args:
        name: one of `LEARNED`, or a policy's file.
        guide: the setting of the environment; a person of another guide is refused.

    Raises `SpringfootError` for a file that is no person.
    """

    def __init__(self, name: str, guide: str) -> None:
        network, settings, tensors = _read_person(person_file(name))
        if settings.get("guide", "people") != guide:
            raise SpringfootError(f"person {name!r} was trained with guide {settings.get('guide')!r}, not {guide!r}")
        self._scale = radians(settings["person_range_deg"])
        self.aim_rate: float = settings.get("aim_rate", 0.0)
        """Its setting `aim_rate` [1/s]."""
        mirror = mirror_of(PERSON_NAMES, actions_of(settings["acts"]))
        layers = range(len(network["layer_sizes"]) - 1)
        self._network = LegNetwork(
            tensors["observation.mean"],
            np.sqrt(tensors["observation.variance"].astype(float) + network["variance_floor"]),
            network["observation_clip"],
            mirror,
            [tensors[f"layer.{layer}.weight"] for layer in layers],
            [tensors[f"layer.{layer}.bias"] for layer in layers],
        )

    def offsets(self, observation: NDArray, acting: NDArray) -> NDArray:
        """Return the offsets (N, side, 3) of the rest angles of hips, knees and ankles [rad]; 0 for bodies that are not
        `acting` (N,).

        `observation` is (N, D) as `PERSON_OBSERVATION`, without noise; its entries on the stiffness of actions are
        changed to 0.
        """
        observation[:, _OF_STIFFNESS] = 0.0
        # a leg's last actions; those on the stiffness, if any, come first
        return self._scale * self._network(observation, acting)[..., -len(MOVED) :].astype(float)


def digest_of_person(name: str) -> str:
    """Return the SHA-256 digest, as text, of the file of the person `name` (`person_file`)."""
    return digest_of_file(person_file(name))


def _read_person(path: Path) -> tuple[dict[str, Any], dict[str, Any], dict[str, NDArray]]:
    """Return network and settings of a person's header, and its tensors; raise `SpringfootError` for another file."""
    header, tensors = read_tensors(path, "springfoot", "policy", POLICY_ENTRIES)
    observed = len(PERSON_NAMES)
    try:
        network = header["network"]
        settings = header["settings"]
        if settings["acts"] in ("both", "person"):
            observed = int(network["layer_sizes"][0])
        fits = _is_person(network, settings, tensors)
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError):
        fits = False
    if observed != len(PERSON_NAMES):
        raise SpringfootError(
            f"{path} observes {observed} numbers, a person of this version {len(PERSON_NAMES)}: train it again"
        )
    if not fits:
        raise SpringfootError(
            f"{path} is no person: it must be a mirrored policy of tanh layers, trained with acts 'both' or 'person'"
        )
    return network, settings, tensors


def _is_person(network: dict[str, Any], settings: dict[str, Any], tensors: dict[str, NDArray]) -> bool:
    """Return True if network, settings and tensors are those of a person, with numbers within bounds.

    Raises an exception of Python's for entries that are missing or of another type.
    """
    sizes = network["layer_sizes"]
    ends = [len(PERSON_NAMES), len(actions_of(settings["acts"])) // 2]
    shapes = {"observation.mean": (sizes[0],), "observation.variance": (sizes[0],)}
    for layer, (inputs, outputs) in enumerate(pairwise(sizes)):
        shapes |= {f"layer.{layer}.weight": (outputs, inputs), f"layer.{layer}.bias": (outputs,)}
    clip = network["observation_clip"]
    return (
        settings["acts"] in ("both", "person")
        and network["mirrored"] is True
        and network["activation"] == "tanh"
        and network.get("output", "clip") == "clip"
        and [sizes[0], sizes[-1]] == ends
        and {name: tensor.shape for name, tensor in tensors.items()} == shapes
        and all(np.abs(tensors[name]).max() <= LARGEST_OF_PERSON for name in shapes if name != "observation.variance")
        and tensors["observation.variance"].min() >= 0.0
        and 0.0 < float(network["variance_floor"]) <= LARGEST_OF_PERSON
        and (clip is None or 0.0 < float(clip) <= LARGEST_OF_PERSON)
        and 0.0 <= float(settings["person_range_deg"]) <= FARTHEST_OFFSET_DEG
        and 0.0 <= float(settings.get("aim_rate", 0.0)) <= FASTEST_AIM
    )
