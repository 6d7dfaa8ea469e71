"""Instanced geometry is diced as finely as it is seen, wherever the object's own origin is."""

from __future__ import annotations

from pathlib import Path

import pytest

import kanuka

SHAPE = "Translate {away} 0 0\nTorus 0.6 0.3 0 360 360\n"


def micropolygons(path: Path, text: str) -> int:
    path.write_text(text)
    scene = kanuka.load(path)
    picture = kanuka.render(scene, resolution=(96, 96), progressions=1, geometry_tolerance=0)
    assert not scene.journal.error_count
    return picture.stats["count"]["micropolygons"]


def film(camera: float, world: str) -> str:
    pattern = 'Surface "matte"\nDisplacement "dented" "Km" 0.001\n'  # so that shading counts, not flatness alone
    return f'Projection "perspective" "fov" 40\nTranslate 0 0 {camera}\nWorldBegin\n{pattern}{world}WorldEnd\n'


@pytest.mark.parametrize("away", [0, 20, 1000])
@pytest.mark.parametrize("camera", [1.5, 3])
def test_an_instance_is_diced_as_what_stands_there(tmp_path: Path, away: float, camera: float) -> None:
    shape = SHAPE.format(away=away)
    plain = micropolygons(tmp_path / "a.rib", film(camera, f"Translate {-away} 0 0\n" + shape))
    once = film(camera, f"ObjectBegin 1\n{shape}ObjectEnd\nTranslate {-away} 0 0\nObjectInstance 1\n")
    assert micropolygons(tmp_path / "b.rib", once) == pytest.approx(plain, rel=0.3)
    nested = film(
        camera,
        f"ObjectBegin 1\n{shape}ObjectEnd\nObjectBegin 2\nScale 2 2 2\nTranslate 5 0 0\nObjectInstance 1\nObjectEnd\n"
        f"Translate {-away - 5} 0 0\nScale 0.5 0.5 0.5\nObjectInstance 2\n",
    )
    assert micropolygons(tmp_path / "c.rib", nested) == pytest.approx(plain, rel=0.3)


@pytest.mark.parametrize("away", [0, 20, 1000])
def test_of_many_instances_the_closest_counts(tmp_path: Path, away: float) -> None:
    shape = SHAPE.format(away=away)
    plain = micropolygons(tmp_path / "a.rib", film(6, f"Translate {-away} 0 0\n" + shape))
    row = "".join(f"TransformBegin\nTranslate {-away} 0 {4 * k}\nObjectInstance 1\nTransformEnd\n" for k in range(20))
    many = micropolygons(tmp_path / "b.rib", film(6, f"ObjectBegin 1\n{shape}ObjectEnd\n" + row))
    assert plain <= many <= 5 * plain
