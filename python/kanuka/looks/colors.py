"""Colour spaces by the names that MaterialX, USD and OpenColorIO's configurations of ACES have for them, and how values
and textures become colours of the space that is rendered in."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache

import numpy as np

D65, D60 = (0.3127, 0.3290), (0.32168, 0.33767)  # the latter is ACES's white
# Chromaticities of red, green, blue and white: ITU-R BT.709 and BT.2020, SMPTE RP 431-2 with D65, Adobe RGB (1998),
# SMPTE ST 2065-1 (AP0), S-2014-004 (AP1); XYZ are the axes of CIE 1931.
PRIMARIES = {
    "rec709": ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06), D65),
    "rec2020": ((0.708, 0.292), (0.170, 0.797), (0.131, 0.046), D65),
    "p3d65": ((0.680, 0.320), (0.265, 0.690), (0.150, 0.060), D65),
    "adobergb": ((0.64, 0.33), (0.21, 0.71), (0.15, 0.06), D65),
    "ap0": ((0.7347, 0.2653), (0.0, 1.0), (0.0001, -0.0770), D60),
    "ap1": ((0.713, 0.293), (0.165, 0.830), (0.128, 0.044), D60),
    "xyz": ((1.0, 0.0), (0.0, 1.0), (0.0, 0.0), D65),
}
RENDERED = {"rec709": "rec709", "rec2020": "rec2020", "acescg": "ap1"}  # Kanuka's names of spaces
# Lam 1985: cones' responses in which one white is scaled to another.
BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])


@dataclass(frozen=True)
class Curve:
    """From code to light: v / slope up to `knee`, ((v + bias) / (1 + bias)) ^ gamma beyond."""

    gamma: float = 1.0
    bias: float = 0.0
    knee: float = 0.0
    slope: float = 1.0

    def decoded(self, v: np.ndarray) -> np.ndarray:
        if self == LINEAR:
            return v
        above = (np.maximum(v, max(self.knee, 0)) + self.bias) / (1 + self.bias)
        return np.where(v <= self.knee, v / self.slope if self.bias else 0.0, above**self.gamma)


LINEAR = Curve()
SRGB = Curve(2.4, 0.055, 0.04045, 12.92)  # IEC 61966-2-1
CURVES = {
    "lin": LINEAR,
    "srgb": SRGB,
    "g18": Curve(1.8),
    "g22": Curve(2.2),
    "g24": Curve(2.4),
    "a98": Curve(563 / 256),  # Adobe RGB (1998)
}


def biased(gamma: float, bias: float) -> Curve:
    """A curve that USD defines: its line meets the power where both have one slope (Gf.ColorSpace's documentation)."""
    if bias <= 0 or gamma <= 1:
        return Curve(gamma)
    knee = bias / (gamma - 1)
    return Curve(gamma, bias, knee, knee / ((knee + bias) / (1 + bias)) ** gamma)


@dataclass(frozen=True)
class Space:
    name: str
    curve: Curve = LINEAR
    primaries: tuple[tuple[float, float], ...] = ()  # none: data

    @property
    def is_data(self) -> bool:
        return not self.primaries

    def matrix(self) -> np.ndarray:
        """To XYZ under D65: (3, 3), on columns."""
        return xyz_from(self.primaries)

    def rendered(self, space: str) -> np.ndarray:
        """To linear colours of a space that Kanuka renders in."""
        return np.linalg.solve(xyz_from(PRIMARIES[RENDERED[space]]), self.matrix())

    def converted(self, values: np.ndarray, space: str) -> np.ndarray:
        """Colours (…, 3) or (…, 4), whose alpha stays."""
        if self.is_data:
            return values
        rgb = self.curve.decoded(np.asarray(values, dtype=float)[..., :3]) @ self.rendered(space).T
        return np.concatenate([rgb, np.asarray(values)[..., 3:]], axis=-1)


@cache
def xyz_from(primaries: tuple[tuple[float, float], ...]) -> np.ndarray:
    """Columns are the primaries, which add up to white (SMPTE RP 177); a white that is not D65 is adapted to it."""
    x, y = np.array(primaries).T
    corners = np.array([x, y, 1 - x - y])
    white = corners[:, 3] / y[3]
    found = corners[:, :3] * np.linalg.solve(corners[:, :3], white)
    daylight = np.array([D65[0] / D65[1], 1, (1 - D65[0] - D65[1]) / D65[1]])
    gain = (BRADFORD @ daylight) / (BRADFORD @ white)
    return np.linalg.solve(BRADFORD, gain[:, None] * BRADFORD) @ found


# ---- names

_CURVES = {"lin": "lin", "linear": "lin", "srgb": "srgb", "srgb_encoded": "srgb", "rec_1886": "g24"} | {
    word: f"g{a}{b}" for a, b in ("18", "22", "24") for word in (f"g{a}{b}", f"gamma_{a}_{b}", f"gamma{a}{b}")
}
_PRIMARIES = {
    "rec709": ("rec709", "rec_709", "rec709_srgb", "rec_709_srgb", "srgb", "bt709", "bt_709"),
    "rec2020": ("rec2020", "rec_2020", "bt2020", "bt_2020"),
    "p3d65": ("p3d65", "p3_d65", "displayp3", "display_p3", "p3"),
    "adobergb": ("adobergb", "adobe_rgb", "adobergb_1998"),
    "ap0": ("ap0", "aces2065_1", "aces_2065_1", "aces2065"),
    "ap1": ("ap1", "acescg"),
    "xyz": ("xyz", "ciexyz", "cie_xyz", "ciexyzd65", "cie_xyz_d65"),
}
_RAW = ("raw", "data", "identity", "non_color", "none", "unknown")
_ALONE = {
    "srgb": ("srgb", "rec709"),
    "srgb_texture": ("srgb", "rec709"),
    "srgb_tx": ("srgb", "rec709"),
    "linear": ("lin", "rec709"),
    "rec709_display": ("g24", "rec709"),
    "adobergb": ("a98", "adobergb"),
    "acescg": ("lin", "ap1"),
    "aces_acescg": ("lin", "ap1"),
    "aces": ("lin", "ap0"),
    "aces2065": ("lin", "ap0"),
    "aces2065_1": ("lin", "ap0"),
    "aces_aces2065_1": ("lin", "ap0"),
    "displayp3": ("srgb", "p3d65"),
    "display_p3": ("srgb", "p3d65"),
    "ciexyz": ("lin", "xyz"),
    "cie_xyz_d65": ("lin", "xyz"),
}


@cache
def named(name: str) -> Space | None:
    """None: there is none of that name."""
    word = re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")
    word = word.removeprefix("utility_")
    if word in _RAW:
        return Space("raw")
    for ending in ("_scene_referred", "_scene", "_texture", "_tx", "_display"):
        if word not in _ALONE:
            word = word.removesuffix(ending)
    if word in _ALONE:
        curve, primaries = _ALONE[word]
        return Space(f"{curve}_{primaries}", CURVES[curve], PRIMARIES[primaries])
    for primaries, words in _PRIMARIES.items():
        for each in words:
            curve = _CURVES.get(word.removesuffix(f"_{each}"))
            if curve and word.endswith(f"_{each}"):
                return Space(f"{curve}_{primaries}", CURVES[curve], PRIMARIES[primaries])
    return None


# ---- textures

CODES = (".png", ".jpg", ".jpeg", ".tga", ".bmp", ".gif", ".webp")  # files whose values are codes, never light


@dataclass(frozen=True)
class Lookup:
    """How a texture is read: what texture() is told, the function that the colour then goes through, and the file that
    stands for it, where that is another."""

    space: str
    function: str = ""
    text: str = ""
    file: str = ""


RAW, AUTO = Lookup("raw"), Lookup("auto")


def lookup(space: Space, rendered: str, file: str) -> Lookup:
    """texture() decodes sRGB, texel by texel, and filters then. Other curves come after the filter: where the file has
    codes they are decoded as if they were sRGB's, filtered, and put right, so that the filter has next to light: what
    is left of the error is a tenth for powers of 2.2 and 2.4, and half for 1.8."""
    if space.is_data:
        return RAW
    matrix, curve, lines = space.rendered(rendered), space.curve, []
    decoded = Space("lin_rec709", LINEAR, PRIMARIES["rec709"]).rendered(rendered)  # what texture() makes of sRGB
    if curve == SRGB and np.allclose(matrix, decoded, atol=1e-5):
        return Lookup("srgb")
    near = curve != LINEAR and file.lower().endswith(CODES)
    if near and rendered != "rec709":  # what texture() decodes it converts
        lines.append(f"c = {times(np.linalg.inv(decoded))};")
    if near and curve != SRGB:
        lines.append(f"c = color({', '.join(SRGB_CODE.format(v=f'comp(c, {i})') for i in range(3))});")
    if curve != LINEAR and not (near and curve == SRGB):
        lines.append(f"c = color({', '.join(code(curve, f'comp(c, {i})') for i in range(3))});")
    if not np.allclose(matrix, np.eye(3), atol=1e-9):
        lines.append(f"c = {times(matrix)};")
    if not lines:
        return RAW
    name = f"usd_from_{re.sub(r'[^A-Za-z0-9]', '_', space.name)}" + ("_codes" if near else "")
    text = "\n".join([f"color {name}(color given) {{", "    color c = given;", *("    " + x for x in lines)])
    return Lookup("srgb" if near else "raw", name, text + "\n    return c;\n}")


SRGB_CODE = "({v} <= 0.0031308 ? 12.92 * {v} : 1.055 * pow({v}, 1 / 2.4) - 0.055)"


def times(matrix: np.ndarray) -> str:
    columns = [f"comp(c, {i}) * color({', '.join(f'{x:.9g}' for x in matrix[:, i])})" for i in range(3)]
    return " + ".join(columns)


def code(curve: Curve, v: str) -> str:
    power = f"pow((max({v}, 0) + {curve.bias:.9g}) / {1 + curve.bias:.9g}, {curve.gamma:.9g})"
    return f"({v} <= {curve.knee:.9g} ? {v} / {curve.slope:.9g} : {power})" if curve.bias else power
