"""What a run folder shows of a training: its learning curve, and a gallery of how the policy walked on the way.

`learning_curve.png` is of the periodic evaluations in run.json. The policies after 0, 25, 50 and 100 % of the timesteps
stand in `gallery/`, named by theirs; `gallery.png` has the first seconds of the same episode walked by each.
"""

import sys
from collections.abc import Callable, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from springfoot.arrays import NDArray
from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.physics.contact import CONTACTS
from springfoot.envs.physics.measurement import Measurement
from springfoot.envs.physics.model import HIP, KNEE
from springfoot.errors import SpringfootError
from springfoot.files.writing import write_atomically
from springfoot.gait import Body

from ..policies.policy import Policy, read_policy, save_policy

GALLERY_SHARES = (0.0, 0.25, 0.5, 1.0)
"""Of the timesteps, after which a policy is kept; chosen."""
SECONDS_SHOWN, SECONDS_BETWEEN = 6.0, 0.3
"""How long each of the gallery walks at most, and the time between two of its figures [s]; chosen."""
CURVE, GALLERY_PICTURE, GALLERY = "learning_curve.png", "gallery.png", "gallery"
LEFT_COLOUR, RIGHT_COLOUR, TRUNK_COLOUR = "#0b6e8f", "#9ec4d1", "#404e5c"


class Gallery:
    """The policies of a run folder that are kept on the way, from `done` to `total` timesteps."""

    def __init__(self, out: Path, done: int, total: int) -> None:
        self._folder = out / GALLERY
        self._due = [share * total for share in GALLERY_SHARES if share * total >= done]

    def keep(self, timesteps: int, policy: Callable[[], Policy]) -> None:
        """Keep the policy after so many timesteps, if it is time; costs nothing otherwise."""
        if self._due and timesteps >= self._due[0]:
            self._due = [share for share in self._due if share > timesteps]
            self._folder.mkdir(exist_ok=True)
            save_policy(self._folder / f"{timesteps}.safetensors", policy())

    def forget(self, done: int) -> None:
        """Remove policies of after `done` timesteps, which a session that was killed kept."""
        for path in self._folder.glob("*.safetensors"):
            if path.stem.isdecimal() and int(path.stem) > done:
                path.unlink()


def draw_run(out: Path, record: dict[str, Any], biped: Biped, seed: int) -> None:
    """Write `learning_curve.png` and `gallery.png` of the run in `out`.

    Args:
        out: the run's folder.
        record: what its run.json holds.
        biped: in which the kept policies walk, side by side.
        seed: of the episode they walk.
    """
    figures = {}
    if record["evaluations"]:
        figures[CURVE] = curve_figure(record)
    policies = {}
    for steps, path in sorted(_kept(out).items()):
        try:
            policies[steps] = read_policy(path)
        except SpringfootError as error:
            print(f"{GALLERY_PICTURE} is without {path.name}: {error}", file=sys.stderr)
    if policies:
        figures[GALLERY_PICTURE] = gallery_figure(policies, record["config"]["timesteps"], biped, seed)
    for name, figure in figures.items():
        picture = BytesIO()
        figure.savefig(picture, format="png", dpi=100, facecolor="white", metadata={"Software": "springfoot"})
        write_atomically(out / name, picture.getvalue())


def pictures_of(out: Path) -> tuple[str, ...]:
    """Names of the pictures that a finished run in `out` has."""
    return (CURVE, GALLERY_PICTURE) if _kept(out) else (CURVE,)


def _kept(out: Path) -> dict[int, Path]:
    """The policies of the gallery, by their timesteps."""
    return {int(path.stem): path for path in (out / GALLERY).glob("*.safetensors") if path.stem.isdecimal()}


def curve_figure(record: dict[str, Any]) -> Any:
    """A Matplotlib figure of the periodic evaluations of a run: return with its SD, and share of falls, over steps."""
    from matplotlib.figure import Figure  # not above: it takes a while, and a training need not wait for it

    steps, mean, sd, falls = (
        np.array([entry[name] for entry in record["evaluations"]], float)
        for name in ("timesteps", "return_mean", "return_sd", "falls")
    )
    share = 100 * falls / [entry["episodes"] for entry in record["evaluations"]]
    best = record["best"]
    figure = Figure(figsize=(7.0, 4.6), layout="constrained")
    returns, fallen = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    returns.fill_between(steps, mean - sd, mean + sd, color=LEFT_COLOUR, alpha=0.2, linewidth=0)
    returns.plot(steps, mean, color=LEFT_COLOUR, marker="o", markersize=3)
    returns.plot(best["timesteps"], best["return_mean"], "o", color=TRUNK_COLOUR, markersize=7, fillstyle="none")
    returns.set(ylabel="return of an episode", title="Periodic evaluations: mean ± SD over episodes, ring: the best")
    fallen.plot(steps, share, color="#d55e00", marker="o", markersize=3)
    fallen.set(ylabel="episodes that fell (%)", xlabel="environment steps", ylim=(-5, 105))
    fallen.xaxis.set_major_formatter(lambda value, _: f"{value:,.0f}")
    return figure


def gallery_figure(policies: dict[int, Policy], total: int, biped: Biped, seed: int) -> Any:
    """A Matplotlib figure of the same episode walked by each of the `policies`, by timesteps; `total` are all."""
    from matplotlib.figure import Figure

    walks, total = _walked(biped, [*policies.values()], seed), max(total, *policies)
    reach, top = np.max([figures.max(axis=(0, 1)) for figures, _ in walks], axis=0)
    figure = Figure(figsize=(10.0, 2.2 * len(policies)), layout="constrained")
    axes = np.atleast_1d(figure.subplots(len(policies), 1))
    for ax, steps, (figures, said) in zip(axes, policies, walks, strict=True):
        ax.set_title(f"after {steps:,} steps ({100 * steps / total:.0f} %): {said}", loc="left", fontsize=9)
        ax.axhline(0.0, color="#888888", linewidth=0.8)
        legs = figures[:, 2:].reshape(len(figures), 2, -1, 2)
        for points, colour, width in (
            (legs[:, 1], RIGHT_COLOUR, 1.2),
            (legs[:, 0], LEFT_COLOUR, 1.2),
            (figures[:, :2], TRUNK_COLOUR, 2.4),
        ):
            gaps = np.full((len(points), 1, 2), np.nan)  # from one figure to the next no line
            ax.plot(*np.concatenate([points, gaps], 1).reshape(-1, 2).T, color=colour, linewidth=width)
        ax.set(xlim=(-0.6, reach + 0.3), ylim=(-0.1, top + 0.1), aspect="equal", ylabel="m")
        ax.tick_params(labelsize=8)
    return figure


def _walked(biped: Biped, policies: Sequence[Policy], seed: int) -> list[tuple[NDArray, str]]:
    """Of each policy, points (figures, 18, 2) [m] of the body as it walks, and in words how far it came.

    Side by side, in environments that all begin with the `seed`; more policies than environments take turns.
    """
    if len(policies) > biped.num_envs:
        return [
            *_walked(biped, policies[: biped.num_envs], seed),
            *_walked(biped, policies[biped.num_envs :], seed),
        ]
    every, figures = max(1, round(SECONDS_BETWEEN / biped.dt)), [[] for _ in policies]
    active = np.arange(biped.num_envs) < len(policies)
    biped.reset(np.flatnonzero(active), [seed] * len(policies))
    steps, why = np.zeros(biped.num_envs, int), [""] * len(policies)
    observation = biped.observe()
    while active.any() and steps.max() * biped.dt < SECONDS_SHOWN:
        action = np.zeros((biped.num_envs, len(biped.action_names)), np.float32)
        for index, policy in enumerate(policies):
            action[index] = policy(observation[[index]])[0]
            if active[index] and steps[index] % every == 0:
                figures[index].append(_points(biped.measurement, index, biped.subjects.bodies[index]))
        result = biped.step(action, active=active)
        observation = result.observation
        steps += active
        for index in np.flatnonzero(active & result.terminated):
            why[index] = str(result.reasons[index])
        active &= ~(result.terminated | result.truncated)
    seconds = (steps * biped.dt)[: len(policies)]
    said = [f"{end} after {far:.1f} s" if end else f"walks {far:.1f} s" for end, far in zip(why, seconds, strict=True)]
    return [(np.stack(each), words) for each, words in zip(figures, said, strict=True)]


def _points(m: Measurement, index: int, body: Body) -> NDArray:
    """Hip and shoulder; then of either leg hip, knee, ankle, heel, ball, ankle, ball, toe tip."""
    x, z, pitch = m.base[index]
    hip = np.array([x, z])
    points = [hip, hip + body.trunk_length * np.array([np.sin(pitch), np.cos(pitch)])]
    for side in range(2):
        thigh = m.angle[index, side, HIP] - pitch
        knee = hip + body.thigh_length * np.array([np.sin(thigh), -np.cos(thigh)])
        ankle = knee + body.shank_length * np.array(
            [np.sin(thigh - m.angle[index, side, KNEE]), -np.cos(thigh - m.angle[index, side, KNEE])]
        )
        heel, ball, toe = m.contact[index, side, : len(CONTACTS)]
        points += [hip, knee, ankle, heel, ball, ankle, ball, toe]
    return np.stack(points).copy()
