"""Surface shaders that trace rays of their own directions: lenses before the camera, periscopes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka

# As published lens shaders do it: the picture's place says where to look, and the camera's own view is not used.
FISHEYE = """surface fisheye(float angle = 180;) {
    float x = 2 * s - 1, y = 1 - 2 * t, r = sqrt(x * x + y * y), a = r * radians(angle) / 2;
    vector to = vector "camera" (sin(a) * x / max(r, 1e-6), sin(a) * y / max(r, 1e-6), cos(a));
    Oi = 1;
    Ci = r <= 1 ? trace(P, to) : color(0);
}"""

# Every direction has a colour of its own.
SKY = """surface sky() {
    vector d = normalize(vtransform("world", P - point "world" (0, 0, 0)));
    Oi = 1; Ci = 0.5 + 0.5 * color(xcomp(d), ycomp(d), zcomp(d));
}"""

SIZE = 48


def render(tmp_path: Path, body: str, projection: str = '"orthographic"', head: str = "") -> kanuka.Picture:
    (tmp_path / "fisheye.sl").write_text(FISHEYE)
    (tmp_path / "sky.sl").write_text(SKY)
    (tmp_path / "scene.rib").write_text(
        f'Format {SIZE} {SIZE} 1\nPixelFilter "box" 1 1\nProjection {projection}\n{head}WorldBegin\n{body}\nWorldEnd\n'
    )
    picture = kanuka.render(kanuka.load(tmp_path / "scene.rib"), progressions=64)
    assert not picture.journal.error_count, list(picture.journal)
    return picture


LENS = """AttributeBegin
Surface "fisheye" "angle" 170
Polygon "P" [-1 1 1  1 1 1  1 -1 1  -1 -1 1] "st" [0 0 1 0 1 1 0 1]
AttributeEnd
"""
DOME = 'Surface "sky" Sphere 2000 -2000 2000 360\n'


def directions() -> tuple[np.ndarray, np.ndarray]:
    c = 2 * (np.arange(SIZE) + 0.5) / SIZE - 1
    x, y = np.meshgrid(c, -c)
    r = np.hypot(x, y)
    a = r * np.radians(170) / 2
    return np.stack([np.sin(a) * x / r, np.sin(a) * y / r, np.cos(a)], -1), r


def test_a_lens_shader_is_its_projection(tmp_path: Path) -> None:
    picture = render(tmp_path, LENS + DOME)
    to, r = directions()
    expected = 0.5 + 0.5 * to
    inside, outside = r < 0.94, r > 1.06
    error = (picture["rgb"] - expected)[inside]
    assert np.abs(error).mean() < 0.01  # the noise of wavelengths
    assert np.abs(error.mean(0)).max() < 0.002
    assert (picture["rgb"][outside] == 0).all()
    assert not any("diffuse" in m.message for m in picture.journal.messages)


def test_a_lens_shader_sees_what_a_fisheye_camera_sees(tmp_path: Path) -> None:
    things = DOME + (
        'Surface "constant" Color 1 0.2 0.1 AttributeBegin Translate 300 100 500 Sphere 160 -160 160 360 AttributeEnd\n'
        "Color 0.1 0.9 0.3 AttributeBegin Translate -500 -200 200 Sphere 200 -200 200 360 AttributeEnd\n"
    )
    lens = render(tmp_path, LENS + things)["rgb"]
    camera = render(tmp_path, things, '"fisheye" "fov" 170')["rgb"]
    _, r = directions()
    assert np.abs(lens - camera)[r < 0.95].mean() < 0.004


def test_a_mirror_of_its_own_direction_turns_with_its_instance(tmp_path: Path) -> None:
    """The object's space turns with it, and so does what it shows."""
    (tmp_path / "periscope.sl").write_text(
        'surface periscope() { Oi = 1; Ci = 0.5 * trace(P, vtransform("object", "current", vector (0, 0, 1))); }'
    )
    plain = (
        'AttributeBegin Surface "periscope" Translate 0 0 2 Rotate 40 0 1 0\n'
        'Polygon "P" [-9 -9 0  -9 9 0  9 9 0  9 -9 0]\nAttributeEnd\n'
    )
    seen = render(tmp_path, plain + DOME)["rgb"].mean((0, 1))
    a = np.radians(40)
    assert seen == pytest.approx(0.5 * (0.5 + 0.5 * np.array([np.sin(a), 0, np.cos(a)])), rel=0.01)


def test_a_loop_of_directions_is_diffuse_still(tmp_path: Path) -> None:
    (tmp_path / "many.sl").write_text(
        "surface many() { float i; color c = 0; for (i = 0; i < 8; i += 1)\n"
        "    c += trace(P, vector(random(), random(), 1)); Oi = 1; Ci = c / 8; }"
    )
    picture = render(tmp_path, 'Surface "many" Polygon "P" [-9 -9 1  -9 9 1  9 9 1  9 -9 1]')
    assert any("Taken as diffuse()" in m.message for m in picture.journal.messages)
