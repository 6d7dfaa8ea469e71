"""Lights that shine by angle (shaping.py), as Kanuka has them.

Where one lobe of emission says it all (a hard cone, or a focus), a flat light is a surface with that lobe, which light
passes through as it passes through Kanuka's other lights. Anything else is a cluster of points with a table of
intensities: what the body sends to a direction, times the shaping. That is exact from far away; from near it is as fine
as the cluster.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import kanuka
from kanuka.looks.files import Files
from kanuka.looks.rsl import Stage, Value, Writer, shader_text

from .shaping import ALL_ROUND, Shaping, tabulated

MEMBERS = 36  # of a cluster, at most: shadows of larger ones are no softer to the eye
NARROWEST = 1.0  # degrees, of a lobe's cone
STEEPEST = 1000.0  # exponent of a lobe and of a spot


@dataclass(frozen=True)
class Body:
    """How much of its radiance a shape sends to a direction, by the angles of shaping.py, as if it were far away."""

    sends: Callable[[np.ndarray, np.ndarray], np.ndarray]
    reach: float = ALL_ROUND  # degrees from the axis to where it sends nothing any more
    exponent: int | None = None  # where that is a power of the cosine


BALL = Body(lambda theta, phi: np.ones(1), exponent=0)
FLAT = Body(lambda theta, phi: np.maximum(np.cos(np.radians(theta)), 0), reach=90, exponent=1)


def _across(theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
    along = np.sin(np.radians(theta)) * np.cos(np.radians(phi))
    return np.sqrt(np.maximum(1 - along * along, 0))


TUBE = Body(_across)  # along x


def is_lobe(shaping: Shaping) -> bool:
    """Whether an emission lobe of a flat light does the same."""
    cone = NARROWEST <= shaping.cone < 90
    focus = 0 < shaping.focus <= STEEPEST and not shaping.tint.any()
    return shaping.profile is None and shaping.softness == 0 and cone != focus and (cone or shaping.cone >= 90)


def leaves_flat(shaping: Shaping) -> bool:
    """Whether a flat light shines as without: what is cut off is behind it."""
    return shaping.profile is None and shaping.focus <= 0 and shaping.cone >= 90 and shaping.softness == 0


def lobe_material(shaping: Shaping, folder: Files, radiance: np.ndarray, texture: str = "") -> kanuka.Material:
    """Shines on one side; light passes through it both ways. Pictures are as Kanuka's quads have them."""
    writer, shading = Writer(), Stage()
    color = writer.constant("color", tuple(float(x) for x in radiance)).text
    if texture:
        color += " * " + writer.texture(shading, texture, Value("float2", "s", "t"), "clamp,clamp", "auto", None).text
    if shaping.cone < 90:
        kind, shape = "ConeEmission", f'"angle", {writer.constant("float", shaping.cone).text}, "softness", 0'
    else:
        kind, shape = "ProfileEmission", f'"exponent", {writer.constant("float", shaping.focus).text}'
    methods = {
        "mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)": [
            "MnkMaterialBoundary boundary = CreateBoundary(material);",
            'AddLobe(boundary, "nothing", ThinWalledDielectricBsdf());',
            f'AddLobe(boundary, "light", {kind}());',
            'AddLayer(boundary, "all", "add", "light", "nothing");',
        ],
        "mnk_prelighting(output MnkMaterialBoundary boundary)": [
            *shading.lines,
            'SetLobe(boundary, "nothing", 1.0, ThinWalledDielectricBsdf("ior", 1, "roughness", 0));',
            f'SetLobe(boundary, "light", 1.0, {kind}("radiance", {color}, {shape}));',
            'SetLayer(boundary, "all", 1.0);',
        ],
    }
    name = folder.shader(shader_text(writer, methods))
    return kanuka.Material(name, parameters=writer.values)


# ---- clusters of points: where they are in the light's space, (N, 3), and how far apart


def over_rectangle(width: float, height: float, members: int) -> tuple[np.ndarray, float]:
    across = int(np.clip(round(math.sqrt(members * width / height)), 1, members))
    up = max(1, round(members / across))
    x = ((np.arange(across) + 0.5) / across - 0.5) * width
    y = ((np.arange(up) + 0.5) / up - 0.5) * height
    grid = np.stack([*np.meshgrid(x, y), np.zeros((up, across))], -1).reshape(-1, 3)
    return grid, min(width / across, height / up)


def over_disk(radius: float, members: int) -> tuple[np.ndarray, float]:
    """A sunflower's florets, each with as much of the disk (Vogel 1979)."""
    n = np.arange(members)
    r, turn = radius * np.sqrt((n + 0.5) / members) * (members > 1), n * math.pi * (3 - math.sqrt(5))
    return np.stack([r * np.cos(turn), r * np.sin(turn), np.zeros(members)], -1), radius / math.sqrt(members)


def over_line(length: float, radius: float, members: int) -> tuple[np.ndarray, float]:
    """As many as lie beside each other."""
    number = int(np.clip(round(length / max(2 * radius, length / members)), 1, members))
    x = ((np.arange(number) + 0.5) / number - 0.5) * length
    return np.stack([x, np.zeros(number), np.zeros(number)], -1), 2 * radius


def add_cluster(
    add_light: Callable[..., None],
    shaping: Shaping,
    folder: Files,
    body: Body,
    places: np.ndarray,
    turned: np.ndarray,
    intensity: np.ndarray,
    radius: float,
) -> None:
    """Points at `places` in the world, (N, 3), turned as a matrix says, which have an intensity together: that of the
    body straight to where it sends most, without shaping."""
    edge = min(shaping.cone, body.reach)
    plain = shaping.profile is None and shaping.softness == 0
    for color, focus in shaping.parts():
        settings: dict[str, object] = {"radius": radius}
        amount = intensity * color / len(places)
        exponent = math.nan if body.exponent is None else body.exponent + focus
        # A spot's own power of the cosine is a whole one, and looks forwards alone.
        if not plain or not (exponent == 0 or (edge <= 90 and exponent <= STEEPEST and exponent == int(exponent))):
            settings["profile"], most = tabulated(shaping, focus, body.sends, folder.folder)
            amount, exponent = amount * most, 0
        kind = "point"
        if edge < ALL_ROUND:
            kind = "spot"
            settings |= {"cone_angle": edge, "cone_delta_angle": 0, "beam_distribution": exponent}
        for place in places:
            matrix = turned.copy()
            matrix[:3, 3] = place
            add_light(kind, amount=amount, transform=matrix, **settings)
