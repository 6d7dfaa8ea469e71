"""Archives of RIB as groups of a scene made in Python: the same picture as a RIB that reads them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka

LEAF = 'Surface "plastic"\nColor 0.2 0.7 0.1\nScale 0.4 0.4 0.4\nSphere 1 -1 1 360\n'
LEAVES = """
ObjectBegin "leaf"
    ReadArchive "leaf.rib"
ObjectEnd
"""
BOUGHS = """
AttributeBegin
    Color 0.5 0.3 0.2
    Rotate -90 1 0 0
    Cylinder 0.15 0 1 360
AttributeEnd
AttributeBegin
    Translate 0 1 0
    ObjectInstance "leaf"
    Translate 0.7 0 0
    ObjectInstance "leaf"
AttributeEnd
SolidBegin "difference"
    SolidBegin "primitive"
        Sphere 0.3 -0.3 0.3 360
    SolidEnd
    SolidBegin "primitive"
        Translate 0.2 0.2 -0.2
        Sphere 0.3 -0.3 0.3 360
    SolidEnd
SolidEnd
"""
HEAD = """Format 48 48 1
PixelFilter "box" 1 1
Projection "perspective" "fov" [45]
Translate 0 -0.5 5
WorldBegin
LightSource "distantlight" 1 "intensity" [2] "from" [0 0 0] "to" [0.4 -1 0.7]
"""
PLACES = np.array([[-1.2, 0, 0], [1, 0.2, 1]])


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "leaf.rib").write_text(LEAF)
    (tmp_path / "tree.rib").write_text(LEAVES + BOUGHS)
    return tmp_path


def placed(places: np.ndarray = PLACES) -> np.ndarray:
    matrices = np.tile(np.eye(4), (len(places), 1, 1))
    matrices[:, :3, 3] = places
    return matrices


def test_an_archive_is_what_a_rib_makes_of_it(folder: Path) -> None:
    tree = f'{LEAVES}ObjectBegin "tree"\n{BOUGHS}ObjectEnd\n'  # objects of RIB hold none
    text = (
        HEAD
        + tree
        + "".join(f'AttributeBegin\nTranslate {x} {y} {z}\nObjectInstance "tree"\nAttributeEnd\n' for x, y, z in PLACES)
    )
    (folder / "all.rib").write_text(text + "WorldEnd\n")
    wanted = kanuka.load(folder / "all.rib")
    (folder / "light.rib").write_text(HEAD + "WorldEnd\n")
    scene = kanuka.load(folder / "light.rib")
    tree = scene.add_archive(folder / "tree.rib")
    assert tree.name == "tree"
    scene.add_instances(tree, placed())
    assert np.array(scene.bounds()) == pytest.approx(np.array(wanted.bounds()), abs=1e-6)
    for layer in ("rgb", "alpha", "P"):
        a, b = (np.asarray(kanuka.render(s, progressions=4)[layer]) for s in (scene, wanted))
        assert a == pytest.approx(b, abs=1e-5), layer
    assert np.asarray(kanuka.render(scene, progressions=4)["alpha"]).mean() > 0.05


def test_what_is_added_before_and_after_stays_itself(folder: Path) -> None:
    """Groups are numbered on; ids of primitives are the scene's, and nodes are found by their names."""
    scene = kanuka.Scene()
    scene.resolution = 32, 32
    scene.camera = kanuka.Camera((0, 0.5, 6), (0, 0.5, 0))
    own = scene.add_group("own")
    own.add_sphere(0.2, name="ball")
    first, second = scene.add_archive(folder / "tree.rib"), scene.add_archive(folder / "tree.rib", name="other")
    assert (first.name, second.name) == ("tree", "other")
    after = scene.add_group("after")
    after.add_sphere(0.2, name="round")
    for x, group in ((-2.5, own), (-1, first), (1, second), (2.5, after)):
        scene.add_instances(group, placed(np.array([[x, 0, 0]])))
    assert scene.node("own", "ball").kind == scene.node("after").node("round").kind == "primitive"
    number = scene.add_sphere(0.3, transform=placed(np.array([[0, 2, 0]]))[0])
    picture = kanuka.render(scene, progressions=4, integrator="facing")
    ids = np.unique(np.asarray(picture["id"])[np.asarray(picture["alpha"]) == 1])
    assert number in ids


def test_an_archive_may_be_read_from_elsewhere_and_by_procedurals(folder: Path, tmp_path: Path) -> None:
    inner = tmp_path / "parts"
    inner.mkdir()
    (inner / "part.rib").write_text("Sphere 2 -2 2 360\n")
    (folder / "whole.rib").write_text('ReadArchive "part.rib"\nProcedural "DynamicLoad" ["two" "3"] [-9 9 -9 9 -9 9]\n')
    scene = kanuka.Scene()
    made = scene.add_archive(
        folder / "whole.rib",
        archive_path=[str(inner)],
        procedurals={"two": lambda size, data: f"Translate 0 {data} 0\nSphere 1 -1 1 360\n"},
    )
    scene.add_instances(made, np.eye(4)[None])
    assert scene.bounds() == ((-2, -2, -2), (2, 4, 2))


def test_what_an_archive_cannot_bring_is_told(folder: Path) -> None:
    (folder / "lamp.rib").write_text('LightSource "pointlight" 1\nSphere 1 -1 1 360\nOddRequest 3\n')
    journal = kanuka.Journal()
    scene = kanuka.Scene()
    scene.add_archive(folder / "lamp.rib", journal=journal)
    told = [(m.severity, m.message) for m in journal]
    assert any("1 lights of an archive are left out" in text for _, text in told)
    assert any("OddRequest" in text for _, text in told)
    assert scene.summary()["lights"] == []
    with pytest.raises(kanuka.Error, match="there is no such archive"):
        scene.add_archive(folder / "nothing.rib")
    with pytest.raises(kanuka.Error, match="there is no such archive"):
        scene.add_archive(folder)
    (folder / "itself.rib").write_text('ReadArchive "itself.rib"\nSphere 1 -1 1 360\n')
    with pytest.warns(kanuka.Warning):
        scene.add_archive(folder / "itself.rib")
