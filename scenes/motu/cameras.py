"""Views of the island."""

from __future__ import annotations

from dataclasses import dataclass

import kanuka


@dataclass(frozen=True)
class View:
    origin: tuple[float, float, float]
    target: tuple[float, float, float]
    fov: float  # across the picture's width
    liked: tuple[float, float, float]  # x, z and radius of what is to be well filled

    def camera(self) -> kanuka.Camera:
        return kanuka.Camera(self.origin, self.target, fov=self.fov, fov_axis="x")


CAMERAS = {
    "shore": View((30, 2.6, 396), (-24, 10.0, 300), 60, (-4, 318, 46)),
    "beach": View((-62, 3.6, 347), (60, 5.5, 300), 62, (-20, 330, 30)),
    "dunes": View((163, 5.1, 384), (112, 7.0, 322), 62, (149, 364, 17)),
}


def eyes() -> list[tuple[float, float, float]]:
    return [view.liked for view in CAMERAS.values()]
