"""What rays see: sides, held-out objects, what is hidden from the camera, levels of detail in transition."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka

HEAD = 'Format 32 32 1\nPixelFilter "box" 1 1\nProjection "perspective" "fov" 40\n'
SHAPES = {
    "sphere": "Sphere 1 -1 1 360",
    "part": "Sphere 1 -0.5 0.8 270",
    "cone": "Cone 1 0.8 360",
    "cylinder": "Cylinder 0.8 -1 1 360",
    "paraboloid": "Paraboloid 1 -0.5 0.5 360",
    "torus": "Torus 0.8 0.3 0 360 360",
    "hyperboloid": "Hyperboloid 0.8 0 -1 0.8 0 1 360",
    "cage": 'SubdivisionMesh "catmull-clark" [4 4 4 4 4 4] [2 3 1 0  3 7 5 1  7 6 4 5  6 2 0 4  6 7 3 2  0 1 5 4]'
    ' [] [] [] [] "P" [-1 -1 -1 1 -1 -1 -1 1 -1 1 1 -1 -1 -1 1 1 -1 1 -1 1 1 1 1 1]',
    "polygon": 'Polygon "P" [-1 -1 0 1 -1 0 1 1 0 -1 1 0]',
    "patch": 'Patch "bilinear" "P" [-1 -1 0 1 -1 0 -1 1 0 1 1 0.3]',
    "nurbs": 'NuPatch 2 2 [0 0 1 1] 0 1 2 2 [0 0 1 1] 0 1 "P" [-1 -1 0 1 -1 0 -1 1 0 1 1 0]',
    "blobby": 'Blobby 1 [1001 0 0 1 0] [1.5 0 0 0 0 1.5 0 0 0 0 1.5 0 0 0 0 1] [""]',
}
CLOSED = {"sphere", "torus", "cage", "blobby"}
FAR = 1e9  # where nothing is seen: a number, whose differences are numbers, too
TURN = "Rotate 35 1 0.3 0.1"
PLACES = {
    "plain": (TURN, ""),
    "mirrored": (f"{TURN} Scale -1 1 1", ""),
    "instanced": (TURN, "Rotate 10 0 1 0"),
    "mirrored instance": (TURN, "Scale 1 -1 1"),
}


def render(tmp_path: Path, text: str, progressions: int = 4, **keywords: object) -> kanuka.Picture:
    path = tmp_path / "scene.rib"
    path.write_text(text)
    picture = kanuka.render(kanuka.load(path), progressions=progressions, **keywords)
    # Of one-sided surfaces seen from behind nothing is seen.
    assert not [m.message for m in picture.journal.messages if "the picture is black" not in m.message]
    return picture


def seen(tmp_path: Path, shape: str, place: tuple[str, str], before: str) -> tuple[np.ndarray, np.ndarray]:
    turn, instance = place
    body = f"{turn} {before} {SHAPES[shape]}"
    if instance:
        head = f"{HEAD}WorldBegin ObjectBegin 1 AttributeBegin {body} AttributeEnd ObjectEnd\n"
        text = f"{head}Translate 0 0 5 {instance} ObjectInstance 1 WorldEnd\n"
    else:
        text = f"{HEAD}WorldBegin Translate 0 0 5 {body} WorldEnd\n"
    picture = render(tmp_path, text, 1, integrator="facing")
    return picture["alpha"], picture["Z"]


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("shape", SHAPES)
def test_one_sided_surfaces_are_seen_from_outside(tmp_path: Path, shape: str, place: str) -> None:
    """Outside and inside together see what both sides show, and nothing twice."""
    both = seen(tmp_path, shape, PLACES[place], "Sides 2")
    out = seen(tmp_path, shape, PLACES[place], "Sides 1")
    turned = seen(tmp_path, shape, PLACES[place], "ReverseOrientation Sides 1")
    assert both[0].sum() > 50
    first = np.stack([np.where(a > 0, z, FAR) for a, z in (out, turned)])
    expected = np.where(both[0] > 0, both[1], FAR)
    same = np.abs(first.min(0) - expected) < 1e-3
    assert np.count_nonzero(~same) <= 2
    if shape in CLOSED:  # from outside only the outside is seen first
        assert np.count_nonzero(out[0] != both[0]) <= 2
        met = (out[0] > 0) & (turned[0] > 0)
        assert np.count_nonzero(first[0][met] < first[1][met]) >= met.sum() - 2
        assert met.sum() > 0.9 * out[0].sum()
    elif shape in ("polygon", "patch", "nurbs"):
        assert {out[0].sum() > 0, turned[0].sum() > 0} == {False, True}


def test_light_comes_through_the_back(tmp_path: Path) -> None:
    """Shadow rays and paths agree: a one-sided sheet lets light through from its inside."""
    scene = (
        HEAD + 'Option "kanuka" "transport" "full" WorldBegin %s Translate 0 0 4\n'
        'LightSource "pointlight" 1 "from" [0 3 -1] "intensity" 20\n'
        'Attribute "visibility" "integer camera" 0 %s\n'
        "AttributeBegin Translate 0 1 0 Rotate 90 1 0 0 Scale 2 2 2 %s AttributeEnd\n"
        "Sides 2 Translate 0 -1 0 Rotate 90 1 0 0 Scale 2 2 2 %s WorldEnd\n"
    )
    sheet, floor = SHAPES["polygon"], 'Attribute "visibility" "integer camera" 1 ' + SHAPES["polygon"]
    open_sky = render(tmp_path, scene % ("", "", "", floor))["rgb"].mean()
    results = []
    for side in ("", "ReverseOrientation"):
        results.append(render(tmp_path, scene % ("", f"{side} Sides 1", sheet, floor))["rgb"].mean())
    results.sort()
    assert open_sky > 0.1
    assert results[0] < 0.2 * open_sky
    assert results[1] == pytest.approx(open_sky, rel=0.02)


SHADOW = (
    HEAD + 'Option "kanuka" "transport" "full" WorldBegin LightSource "pointlight" 1 "from" [-3 3 0] "intensity" 40\n'
    'Surface "matte" AttributeBegin %s Translate 0.3 0 5 Sphere 0.6 -0.6 0.6 360 AttributeEnd\n'
    'Translate 0 0 6 Scale 1.6 1.6 1 Polygon "P" [-1 -1 0 1 -1 0 1 1 0 -1 1 0] WorldEnd\n'
)


@pytest.mark.parametrize("lanes", [1, 8, 16])
def test_held_out_objects_are_holes_that_cast_shadows(tmp_path: Path, lanes: int) -> None:
    plain = render(tmp_path, SHADOW % "", lanes=lanes)
    held = render(tmp_path, SHADOW % "Matte 1", lanes=lanes)
    assert not held["rgb"][16, 18].any()
    assert held["alpha"][16, 18] == 0
    hole = (held["alpha"] == 0) & (plain["alpha"] == 1)
    assert 0.02 < hole.mean() < 0.5
    rest = held["alpha"] == 1
    assert np.array_equal(held["rgb"][rest], plain["rgb"][rest])
    without = render(tmp_path, SHADOW % "Translate 100 0 0", lanes=lanes)
    assert np.abs(plain["rgb"] - without["rgb"])[rest].max() > 0.1, "its shadow is seen"


def test_a_held_out_object_hides_the_sky(tmp_path: Path) -> None:
    scene = HEAD + 'WorldBegin LightSource "environmentlight" 1 %s Translate 0 0 5 Sphere 1 -1 1 360 WorldEnd\n'
    picture = render(tmp_path, scene % "Matte 1")
    assert picture["alpha"][16, 16] == 0
    assert not picture["rgb"][16, 16].any()


def test_half_transparent_objects_half_cover_the_hole(tmp_path: Path) -> None:
    front = 'AttributeBegin Opacity [0.5 0.5 0.5] Surface "constant" Translate 0 0 3 Disk 0 2 360 AttributeEnd\n'
    scene = HEAD + f'WorldBegin {front} Matte 1 Surface "constant" Translate 0 0 5 Disk 0 4 360 WorldEnd\n'
    assert render(tmp_path, scene, 64)["alpha"].mean() == pytest.approx(0.5, abs=0.01)


def test_hidden_from_the_camera(tmp_path: Path) -> None:
    hidden = render(tmp_path, SHADOW % 'Attribute "visibility" "integer camera" 0')
    held = render(tmp_path, SHADOW % "Matte 1")
    assert hidden["alpha"][16, 18] == 1, "what is behind it"
    rest = held["alpha"] == 1
    assert np.allclose(hidden["rgb"][rest], held["rgb"][rest], rtol=1e-5), "its shadow stays"


LEVELS = (
    HEAD + 'WorldBegin LightSource "distantlight" 1 "to" [1 -1 1] Translate 0 0 5 Detail [-1 1 -1 1 -1 1]\n'
    "AttributeBegin %s Color [1 0 0] Sphere 1 -1 1 360 AttributeEnd\n"
    "AttributeBegin %s Color [0 1 0] Sphere %s AttributeEnd WorldEnd\n"
)


def levels(tmp_path: Path, low: str, high: str, ball: str = "1 -1 1 360", n: int = 256, **more: object) -> np.ndarray:
    picture = render(tmp_path, LEVELS % (low, high, ball), n, **more)
    return np.dstack([picture["rgb"], picture["alpha"]]).astype(np.float64)


def test_levels_in_transition_mix_their_pictures(tmp_path: Path) -> None:
    """The bound covers about 480 pixels: in the middle of both transitions."""
    low, high = "DetailRange 0 0 280 680", "DetailRange 280 680 1e38 1e38"
    only_low = levels(tmp_path, "", "DetailRange 1e6 1e6 1e38 1e38")
    only_high = levels(tmp_path, "DetailRange 1e6 1e6 1e38 1e38", "", "1.1 -1.1 1.1 360")
    mixed = levels(tmp_path, low, high, "1.1 -1.1 1.1 360")
    share = mixed[..., 1].mean() / only_high[..., 1].mean()
    assert 0.3 < share < 0.7
    assert mixed[..., 0].mean() == pytest.approx((1 - share) * only_low[..., 0].mean(), rel=0.02)
    both = only_low[..., 3] == 1
    assert (mixed[..., 3][both] == 1).all(), "no holes"
    expected = (1 - share) * only_low + share * only_high
    assert np.abs(mixed - expected)[both].mean() < 0.01, "neither shades the other"


def test_levels_are_the_same_for_any_lanes(tmp_path: Path) -> None:
    low, high = "DetailRange 0 0 280 680", "DetailRange 280 680 1e38 1e38"
    reference = levels(tmp_path, low, high, n=2, lanes=8, threads=1)
    for lanes in (1, 16):
        assert np.array_equal(levels(tmp_path, low, high, n=2, lanes=lanes, threads=2), reference)
