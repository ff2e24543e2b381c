"""Add the visible parts of the model that have neither mass nor contact: sky, light, bones, a load."""

from collections.abc import Sequence

import mujoco

from springfoot.arrays import NDArray

FLESH, DEVICE = (0.25, 0.45, 0.70), (0.42, 0.40, 0.30)
"""Colours of bones, and of those of a foot that is not intact."""


def add_scene(spec: mujoco.MjSpec) -> None:
    """Add sky, light and the material of the ground, `tiles`."""
    spec.visual.global_.offwidth = 960
    spec.visual.global_.offheight = 720
    spec.add_texture(
        name="tiles",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        rgb1=(0.86, 0.88, 0.90),
        rgb2=(0.78, 0.81, 0.84),
        width=256,
        height=256,
    )
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=(0.95, 0.97, 1.0),
        rgb2=(0.75, 0.83, 0.92),
        width=64,
        height=384,
    )
    tiles = spec.add_material(name="tiles", texrepeat=(1.0, 1.0), texuniform=True)
    tiles.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "tiles"
    spec.worldbody.add_light(pos=(0, -2, 4), dir=(0, 0.4, -1), type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL)


def bone(
    segment: "mujoco.MjsBody",
    start: Sequence[float],
    end: Sequence[float],
    radius: float,
    shade: float,
    colour: tuple[float, float, float] = FLESH,
) -> None:
    """Add a capsule to a segment, from `start` to `end` (forward, up) in its frame [m]; `radius` [m].

    Its colour is lighter than `colour` by `shade` [0..1].
    """
    segment.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CAPSULE,
        fromto=(start[0], 0, start[1], end[0], 0, end[1]),
        size=(radius, 0, 0),
        contype=0,
        conaffinity=0,
        rgba=(*(part + shade for part in colour), 1.0),
    )


def box(segment: "mujoco.MjsBody", size: NDArray, visible: bool = True) -> None:
    """Add a box of half-lengths `size` (3,) [m], forward, sideways and up, to a segment; unseen unless `visible`."""
    segment.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=size,
        contype=0,
        conaffinity=0,
        rgba=(0.45, 0.50, 0.35, 1.0 if visible else 0.0),
    )
