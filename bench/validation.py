"""Scenes that show one thing each, for agreement: all of greys, whose spectrum is the same in every renderer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from scenes import UNBOUNDED, Camera, Finish, Medium, Mesh, Panel, Scene, kept, quad
from still_life import environment, fine_ball, write_exr

GREY = (0.5, 0.5, 0.5)


def grey_stage(name: str, finish: Finish | None) -> Scene:
    """One ball on a floor under a sky with a sun."""
    meshes = [
        Mesh("floor", GREY, *quad((0, 0, 0), (8, 0, 0), (0, 0, -8))),
        Mesh("ball", GREY, *fine_ball(0, 1, 0), finish=finish),
    ]
    inside = finish is not None and finish.medium is not None
    sky = environment("grey-sky", colored=False, height=1024)
    made = Scene(name, (160, 160), 64, Camera((0, 1.8, 5), (0, 0.8, 0), 42), meshes, environment=sky)
    return replace(made, depth=UNBOUNDED) if inside else made


FINISHES: dict[str, Finish | None] = {
    "environment": None,
    "conductor": Finish("metal"),
    "rough-conductor": Finish("metal", alpha=0.1),
    "rougher-conductor": Finish("metal", alpha=0.5),
    "gloss": Finish("gloss", alpha=0.1),
    "rough-gloss": Finish("gloss", alpha=0.5),
    "beckmann-gloss": Finish("gloss", alpha=0.3, slopes="beckmann"),
    "dielectric": Finish("glass"),
    "rough-dielectric": Finish("glass", alpha=0.1),
    "rougher-dielectric": Finish("glass", alpha=0.4),
    "thin-wall": Finish("thin"),
    "plastic": Finish("coated"),
    "rough-plastic": Finish("coated", alpha=0.1),
    "fog": Finish("none", medium=Medium(absorption=0.2, scattering=1.5, mean_cosine=0.6)),
    "milk": Finish("glass", ior=1.33, medium=Medium(absorption=0.1, scattering=4, mean_cosine=-0.3)),
    "tinted-glass": Finish("glass", medium=Medium(absorption=0.8, scattering=0)),
}

BANDS = 24
SPAN = (360.0, 830.0)
DISPERSIVE = Finish("glass", ior=1.6, abbe=8)


def index_at(finish: Finish, nm: float) -> float:
    """Cauchy's n = A + B / wavelength², of the index at 587.6 nm and Abbe's number."""
    if not finish.abbe:
        return finish.ior
    b = (finish.ior - 1) / (finish.abbe * (486.1327**-2 - 656.2725**-2))
    return finish.ior + b * (nm**-2 - 587.5618**-2)


def dispersion(n: int) -> Scene:
    """Glass that disperses under a lamp; n > 0: its n-th band of wavelengths, at the index of the band's middle."""
    low = SPAN[0] + (SPAN[1] - SPAN[0]) / BANDS * (n - 1)
    band = (low, low + (SPAN[1] - SPAN[0]) / BANDS) if n else None
    finish = DISPERSIVE
    if band:
        finish = replace(finish, ior=index_at(DISPERSIVE, sum(band) / 2), abbe=0)
    meshes = [
        Mesh("floor", GREY, *quad((0, 0, 0), (4, 0, 0), (0, 0, -4))),
        Mesh("back", GREY, *quad((0, 2, -2), (4, 0, 0), (0, 2, 0))),
        Mesh("lamp", (0, 0, 0), *quad((0.6, 4, 0.5), (0.5, 0, 0), (0, 0, 0.5)), radiance=(12, 12, 12)),
        Mesh("ball", GREY, *fine_ball(0, 0.8, 0, y=0.3), finish=finish),
    ]
    return Scene("dispersion", (96, 96), 64, Camera((0, 1.6, 5), (0, 1, 0), 36), meshes, band=band)


def slide(side: int = 256) -> np.ndarray:
    """A picture that no turning or mirroring leaves as it is: a bright corner, bars, a slope."""
    y, x = (np.mgrid[:side, :side] + 0.5) / side
    light = 0.2 + 3 * x * (1 - y) + 2 * (np.cos(2 * np.pi * 3 * x) > 0) * (y > 0.5)
    light = light + 12 * ((x - 0.2) ** 2 + (y - 0.25) ** 2 < 0.01)
    light /= light.max()  # Mitsuba cuts pictures of light off at 1
    return np.repeat(light[..., None], 3, axis=-1).astype(np.float32)


def textured_light(_n: int) -> Scene:
    """A ball and a floor close to a panel that shines as a picture has it; the camera sees the panel."""
    meshes = [
        Mesh("floor", GREY, *quad((0, 0, 0), (4, 0, 0), (0, 0, -4))),
        Mesh("ball", GREY, *fine_ball(0.9, 0.4, 0.4)),
    ]
    picture = kept("slide", ".exr", slide, write_exr)
    panel = Panel((-0.3, 0.9, -0.9), (0.3, -0.25, 1), (1.6, 1.2), picture)
    return Scene("textured-light", (160, 160), 64, Camera((0.2, 1.8, 5), (0, 0.6, 0), 36), meshes, panel=panel)


def _of(name: str) -> Callable[[int], Scene]:
    return lambda _n: grey_stage(name, FINISHES[name])


MAKERS: dict[str, tuple[Callable[[int], Scene], int]] = {
    **{name: (_of(name), 0) for name in FINISHES},
    "dispersion": (dispersion, 0),
    "textured-light": (textured_light, 0),
}
