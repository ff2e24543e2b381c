"""Write a model as MJCF text with all digits of every number, so that the loaded model steps with the same bits.

`model` builds it.
"""

from collections.abc import Mapping, Sequence
from typing import Any
from xml.etree import ElementTree

import mujoco

from .simulation import MjModel

ARRAY_OF: Mapping[str, Mapping[str, str]] = {
    "body": {"pos": "body_pos", "quat": "body_quat"},
    "inertial": {"pos": "body_ipos", "mass": "body_mass", "diaginertia": "body_inertia"},
    "joint": {
        "armature": "dof_armature",
        "damping": "dof_damping",
        "stiffness": "jnt_stiffness",
        "springref": "qpos_spring",
        "axis": "jnt_axis",
    },
    "fixed": {"stiffness": "tendon_stiffness", "springlength": "tendon_lengthspring"},
    "geom": {"size": "geom_size", "pos": "geom_pos", "quat": "geom_quat"},
    "pair": {
        "friction": "pair_friction",
        "solref": "pair_solref",
        "solreffriction": "pair_solreffriction",
        "solimp": "pair_solimp",
    },
    "general": {"gainprm": "actuator_gainprm"},
    "key": {"qpos": "key_qpos"},
}
"""Element -> attribute -> array of the compiled model that holds its value."""
LIMITS = {"range": "jnt_range", "actuatorfrcrange": "jnt_actfrcrange"}
"""Attribute -> array, as in `ARRAY_OF`, for joints with limits; a limit that is written also acts."""


def model_text(spec: mujoco.MjSpec) -> str:
    """Return the MJCF text of a specification with all digits; MuJoCo itself would keep six."""
    model = spec.compile()
    root = ElementTree.fromstring(spec.to_xml())
    world = _first_element(root, "worldbody")
    bodies = list(world.iter("body"))  # in the order of the compiled model: its first body is the world
    for index, body in enumerate(bodies, start=1):
        _write(body, model, index)
        inertial = body.find("inertial")
        if inertial is not None:
            _write(inertial, model, index)
    for joint in world.iter("joint"):
        index = model.joint(joint.get("name", "")).id  # every joint has one coordinate
        _write(joint, model, index, LIMITS if model.jnt_limited[index] else {})
    for index, geom in enumerate(_geoms_in_order(world)):
        _write(geom, model, index)
    for index, pair in enumerate(_first_element(root, "contact").iter("pair")):
        _write(pair, model, index)
    for tendon in root.iter("fixed"):
        _write(tendon, model, model.tendon(tendon.get("name", "")).id)
    for actuator in _first_element(root, "actuator"):
        _write(actuator, model, model.actuator(actuator.get("name", "")).id)
    for index, key in enumerate(root.iter("key")):
        _write(key, model, index)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _geoms_in_order(body: ElementTree.Element) -> list[ElementTree.Element]:
    """Return the geoms of a body element as the compiled model numbers them: its own, then those of its children."""
    return body.findall("geom") + [geom for child in body.findall("body") for geom in _geoms_in_order(child)]


def _first_element(root: ElementTree.Element, tag: str) -> ElementTree.Element:
    """Return the first element `tag` at or below `root`."""
    return next(root.iter(tag))


def _write(element: ElementTree.Element, model: MjModel, index: int, limits: Mapping[str, str] = {}) -> None:
    """Write all digits of the numbers of an element, which is number `index` of its kind in the compiled `model`.

    Its attributes are those of `ARRAY_OF` and of `limits`, `LIMITS` for a joint that has limits.
    """
    for attribute, array in {**ARRAY_OF[element.tag], **limits}.items():
        value: Any = getattr(model, array)[index]
        element.set(attribute, " ".join(repr(float(number)) for number in _numbers(value)))


def _numbers(value: Any) -> Sequence[float]:
    """Return the numbers of one entry of a model's array: a list of one for a scalar entry."""
    return [value] if getattr(value, "ndim", 0) == 0 else list(value)
