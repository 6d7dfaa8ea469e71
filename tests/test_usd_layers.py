"""Primvars as layers of the picture, on what is instanced and on solids that are meshes."""

from __future__ import annotations

from pathlib import Path

import pytest

import kanuka
import kanuka.usd
from test_usd_products import PRODUCTS
from usd_shapes import from_above, mesh
from usd_stages import CAMERA, MATTE, SUN, stage

AT = 'double3 xformOp:translate = ({}, 0, 0)\nuniform token[] xformOpOrder = ["xformOp:translate"]\n'
HEATED = "float primvars:heat = {}\n"
TWO = f'class "square" {{\n{mesh()}}}\n' + "".join(
    f'def Xform "{name}" (instanceable = true\ninherits = </square>) {{\n{AT.format(x)}{HEATED.format(heat)}}}\n'
    for name, x, heat in (("a", 0, 3), ("b", 1, 5))
)
# Seen from above: the face of +y alone, whose number is 2 in USD's order.
CUBE = 'def Cube "c" {\nfloat[] primvars:heat = [1, 2, 3, 5, 8, 13] (interpolation = "uniform")\n}\n'


def heat_of(tmp_path: Path, *text: str):
    path = stage(tmp_path, CAMERA, MATTE, SUN, PRODUCTS, *text)
    journal = kanuka.Journal()
    scene = from_above(kanuka.usd.load(path, product="data", journal=journal))
    assert not len(journal)
    scene.resolution = (16, 16)
    scene.options.filter, scene.options.filter_width = "box", (1, 1)
    return kanuka.render(scene, progressions=4, threads=1, aovs=["heat"])["heat"]


def test_instances_show_what_each_inherits(tmp_path: Path) -> None:
    """Their material reads nothing of it, so layers alone tell the groups apart."""
    heat = heat_of(tmp_path, TWO)
    assert (heat[8, 4], heat[8, 12]) == (pytest.approx(3), pytest.approx(5))


def test_cubes_show_values_of_their_faces(tmp_path: Path) -> None:
    assert heat_of(tmp_path, CUBE)[8, 8] == pytest.approx(3)
