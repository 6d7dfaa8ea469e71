"""MaterialX's nodes: matrices, flakes, cells, the view, hexagonal tiles, blurs."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("MaterialX")
from pxr import Gf, Usd, UsdGeom, UsdShade

import kanuka
from kanuka.looks.files import Files
from kanuka.usd import library
from kanuka.usd.materials import NODES, Materials
from kanuka.usd.network import family
from test_materialx_more import STANDARD, normals, surface
from test_texture_spaces import xyz_from
from usd_graphs import SHIFT, TYPES, Graph, N, coordinates, plain
from usd_stages import CAMERA, FLOOR, SUN, picture, read, stage

SURFACES = ("pbr", "light", "shader", "material", "translation", "")  # groups that are read elsewhere, or not at all


def test_every_pattern_node_of_the_library_is_known():
    """Built by hand, or expanded into what is; those that are neither are none. Evaluated, many in one shader: nothing
    is told, and all values are finite. Matrices are read by a vector that they transform."""
    definitions = [
        d
        for d in library.document().getNodeDefs()
        if d.getNodeGroup() not in SURFACES and all(o.getType() in TYPES for o in d.getActiveOutputs())
    ]
    known = {"built": [], "expanded": [], "told": []}
    for each in definitions:
        name = each.getName()
        built = name in NODES or family(name) in NODES
        known["built" if built else "expanded" if library.graph_of(name) else "told"].append(name)
    assert len(known["built"]) > 500 and len(known["expanded"]) > 100
    assert known["told"] == []
    tested, texts = 0, ("string", "filename")
    for begin in range(0, len(definitions), 70):
        graph, last = Graph(), None
        for i, each in enumerate(definitions[begin : begin + 70]):
            for output in each.getActiveOutputs():
                kind = output.getType()
                if kind in texts:
                    continue
                node = graph.node(f"n{i}", each.getName())
                found = as_color(graph, f"{i}_{output.getName()}", node, output.getName(), kind)
                last = graph.node(f"a{i}_{output.getName()}", "ND_add_color3", in1=found, in2=last or Gf.Vec3f(0))
                last = (last, "out")
                tested += 1
        graph.emit(*last)
        assert np.isfinite(graph.run()).all()
        assert graph.told == []
    assert tested > 600


def as_color(graph: Graph, name: str, node: UsdShade.Shader, output: str, kind: str) -> tuple[UsdShade.Shader, str]:
    if kind.startswith("matrix"):
        own = "vector3" if kind == "matrix33" else "vector3M4"
        node, output, kind = graph.node(f"m{name}", f"ND_transformmatrix_{own}", mat=(node, output)), "out", "vector3"
    if kind == "color3":
        return node, output
    wide = graph.node(f"c{name}", "ND_convert_float_color3")
    wide.CreateInput("in", TYPES[kind]).ConnectToSource(node.GetOutput(output))
    return wide, "out"


def shown(graph: Graph, node: UsdShade.Shader, output: str = "out", kind: str = "vector3", **primvars) -> np.ndarray:
    """What a node gives, (N, N, 3)."""
    if kind == "float":
        node = graph.node("wide", "ND_convert_float_color3", in_=(node, output))
    elif kind != "color3":
        parts = [graph.node(f"part{i}", f"ND_extract_{kind}", in_=(node, output), index=i) for i in range(3)]
        node = graph.node("all", "ND_combine3_color3", **{f"in{i + 1}": (p, "out") for i, p in enumerate(parts)})
    graph.emit(graph.node("shifted", "ND_add_color3FA", in1=(node, output if kind == "color3" else "out"), in2=SHIFT))
    found = graph.run(**primvars) - SHIFT
    return found


def st_of(graph: Graph) -> tuple[UsdShade.Shader, str]:
    return graph.node("st", "ND_texcoord_vector2"), "out"


A33 = np.array([[1, 2, 0], [0.5, -1, 1], [0.25, 0, 3]])
B33 = np.array([[2, 0, 1], [1, 1, 0], [0, 0.5, -1]])
A44 = np.array([[1, 2, 0, 0], [0.5, -1, 1, 0], [0.25, 0, 3, 1], [0.5, 1, 2, 1]])
B44 = np.array([[2, 0, 1, 0], [1, 1, 0, 0.5], [0, 0.5, -1, 0], [1, 0, 0, 2]])


@pytest.mark.parametrize("size", [3, 4])
@pytest.mark.parametrize(
    "what", ["constant", "add", "subtract", "multiply", "divide", "invertmatrix", "transpose", "rows"]
)
def test_matrices_act_on_row_vectors(what: str, size: int):
    """Seen by what they do to a vector that varies."""
    kind, of = f"matrix{size}{size}", Gf.Matrix3d if size == 3 else Gf.Matrix4d
    a, b = (A33, B33) if size == 3 else (A44, B44)
    graph = Graph()
    both = {"in1": of(a.tolist()), "in2": of(b.tolist())}
    if what == "constant":
        node, expected = graph.node("m", f"ND_constant_{kind}", value=of(a.tolist())), a
    elif what == "rows":
        vector = Gf.Vec3f if size == 3 else Gf.Vec4f
        rows = {f"in{i + 1}": vector(*row) for i, row in enumerate(a.tolist())}
        node, expected = graph.node("m", f"ND_creatematrix_vector{size}_{kind}", **rows), a
    elif what in ("invertmatrix", "transpose"):
        node = graph.node("m", f"ND_{what}_{kind}", in_=of(a.tolist()))
        expected = np.linalg.inv(a) if what == "invertmatrix" else a.T
    else:
        node = graph.node("m", f"ND_{what}_{kind}", **both)
        by = {"add": a + b, "subtract": a - b, "multiply": a @ b, "divide": a @ np.linalg.inv(b)}
        expected = by[what]
    s, t = coordinates()
    parts = {
        f"in{i + 1}": (graph.node(f"e{i}", "ND_extract_vector2", in_=st_of(graph), index=i), "out") for i in (0, 1)
    }
    if size == 3:
        v = graph.node("v", "ND_combine3_vector3", **parts, in3=0.5)
        out = graph.node("out", "ND_transformmatrix_vector3", in_=(v, "out"), mat=(node, "out"))
        vectors = np.stack([s, t, np.full_like(s, 0.5)], -1)
    else:
        v = graph.node("v", "ND_combine4_vector4", **parts, in3=0.5, in4=0.25)
        out = graph.node("out", "ND_transformmatrix_vector4", in_=(v, "out"), mat=(node, "out"))
        vectors = np.stack([s, t, np.full_like(s, 0.5), np.full_like(s, 0.25)], -1)
    found = shown(graph, out, kind=f"vector{size}")
    assert found == pytest.approx((vectors @ expected)[..., :3], abs=3e-5)
    assert graph.told == []


def test_matrices_move_points_and_texture_coordinates():
    graph, (s, t) = Graph(), coordinates()
    mat = Gf.Matrix3d(0, 2, 0, -2, 0, 0, 0.25, 0.5, 1)
    out = graph.node("out", "ND_transformmatrix_vector2M3", in_=st_of(graph), mat=mat)
    wide = graph.node("w", "ND_convert_vector2_vector3", in_=(out, "out"))
    found = shown(graph, wide)
    assert found[..., 0] == pytest.approx(-2 * t + 0.25, abs=1e-5)
    assert found[..., 1] == pytest.approx(2 * s + 0.5, abs=1e-5)
    graph = Graph()
    out = graph.node("out", "ND_transformmatrix_vector3M4", in_=Gf.Vec3f(1, 2, 3), mat=Gf.Matrix4d(A44.tolist()))
    assert shown(graph, out)[0, 0] == pytest.approx((np.array([1, 2, 3, 1]) @ A44)[:3], abs=1e-5)


@pytest.mark.parametrize(("size", "matrix"), [(3, A33), (4, A44), (3, np.ones((3, 3)))])
def test_determinants_and_matrices_without_an_inverse(size: int, matrix: np.ndarray):
    of = Gf.Matrix3d if size == 3 else Gf.Matrix4d
    graph = Graph()
    node = graph.node("d", f"ND_determinant_matrix{size}{size}", in_=of(matrix.tolist()))
    assert shown(graph, node, kind="float")[0, 0, 0] == pytest.approx(np.linalg.det(matrix), abs=1e-5)
    graph = Graph()
    inverse = graph.node("i", "ND_invertmatrix_matrix33", in_=Gf.Matrix3d(np.ones((3, 3)).tolist()))
    out = graph.node("out", "ND_transformmatrix_vector3", in_=Gf.Vec3f(1, 2, 3), mat=(inverse, "out"))
    assert np.isfinite(shown(graph, out)).all()


def test_a_row_of_a_matrix_is_extracted():
    graph = Graph()
    node = graph.node("e", "ND_extract_matrix33", in_=Gf.Matrix3d(A33.tolist()), index=1)
    assert shown(graph, node)[0, 0] == pytest.approx(A33[1], abs=1e-6)


def wide_run(graph: Graph, node: UsdShade.Shader, output: str, kind: str, extent: float, size: int = 384) -> np.ndarray:
    """A node over many cells of its lattice, (size, size, 3)."""
    if kind == "float":
        node = graph.node("wide", "ND_convert_float_color3", in_=(node, output))
    else:
        node = graph.node("wide", f"ND_convert_{kind}_color3", in_=(node, output))
    graph.emit(graph.node("shifted", "ND_add_color3FA", in1=(node, "out"), in2=SHIFT))
    made, shader = graph.made()
    s, t = np.meshgrid(*[np.linspace(0.0123, extent, size, dtype=np.float32)] * 2)
    known = {p["name"] for p in shader.parameters}
    given = {k: x for k, x in {"usd_st_0": s, "usd_st_1": t}.items() if k in known}
    return shader.run(size, size, plain(made) | given)["slots"]["light.radiance"] - SHIFT


@pytest.mark.parametrize("coverage", [0.0, 0.2, 0.5, 0.8, 1.0])
def test_flakes_cover_what_they_say(coverage: float):
    """Within 3 percent: the law that makes shares of coverages is a fit, and cells are 40 000."""
    graph = Graph()
    node = graph.node("f", "ND_flake2d", coverage=coverage, size=0.5)
    presence = wide_run(graph, node, "presence", "float", 100.0)[..., 0]
    assert (presence > 0).mean() == pytest.approx(coverage, abs=0.03)
    assert presence.max() <= 1


def test_flakes_have_normals_as_wide_as_their_roughness_and_numbers_of_their_own():
    """GGX of width 0.25: the tangent of a slope's angle has the median 0.25 (Walter et al. 2007)."""
    graph = Graph()
    node = graph.node("f", "ND_flake2d", coverage=1.0, size=0.5, roughness=0.5)
    n = wide_run(graph, node, "flakenormal", "vector3", 100.0)
    tangent = np.hypot(n[..., 0], n[..., 1]) / n[..., 2]
    assert np.linalg.norm(n, axis=-1) == pytest.approx(np.ones(n.shape[:2]), abs=1e-4)
    assert np.median(tangent) == pytest.approx(0.25, rel=0.05)
    graph = Graph()
    rand = wide_run(graph, graph.node("f", "ND_flake2d", coverage=1.0, size=0.5), "rand", "float", 100.0)[..., 0]
    assert (rand.mean(), rand.std()) == (pytest.approx(0.5, abs=0.02), pytest.approx(12**-0.5, abs=0.02))
    # A flake is some pixels wide: neighbours often have the same number, others never.
    assert 0.4 < (rand[:, 1:] == rand[:, :-1]).mean() < 0.95


def test_no_flake_has_the_normal_of_the_surface():
    graph = Graph()
    node = graph.node("f", "ND_flake2d", coverage=0.0, normal=Gf.Vec3f(0, 0.6, 0.8))
    assert shown(graph, node, "flakenormal") == pytest.approx(np.broadcast_to([0, 0.6, 0.8], (N, N, 3)), abs=1e-5)
    for output in ("id", "rand", "presence"):
        graph = Graph()
        node = graph.node("f", "ND_flake3d", coverage=0.0)
        assert shown(graph, node, output, "float") == pytest.approx(np.zeros((N, N, 3)), abs=1e-6)


def test_worley_cells_have_one_number_each():
    """Without jitter the nearest point is the middle of a cell of the lattice."""
    graph = Graph()
    found = wide_run(graph, graph.node("w", "ND_worleynoise2d_float", style=1, jitter=0.0), "out", "float", 20.0, 200)
    x = np.floor(np.linspace(0.0123, 20.0, 200)).astype(int)
    cells = x[None, :] + 1000 * x[:, None]
    values = [np.unique(found[..., 0][cells == cell]) for cell in np.unique(cells)]
    assert all(np.ptp(v) < 1e-6 for v in values)
    means = np.array([v[0] for v in values])
    assert (means.mean(), means.std()) == (pytest.approx(0.5, abs=0.05), pytest.approx(12**-0.5, abs=0.04))
    assert graph.told == []


def test_the_view_is_that_of_the_camera(tmp_path: Path):
    """facingratio of a floor seen straight from 4 above: the cosine at a place is 4 over its distance."""
    graph = Graph()
    ratio = graph.node("f", "ND_facingratio_float", faceforward=True)
    graph.emit(graph.node("w", "ND_convert_float_color3", in_=(ratio, "out")))
    graph.surface.CreateInput("base", TYPES["float"]).Set(0.0)
    graph.surface.CreateInput("specular", TYPES["float"]).Set(0.0)
    floor = FLOOR.replace("</matte>", "</m>").replace("EXTRA", "")
    parts = graph.stage.GetRootLayer().ExportToString().partition("\n\n")[2]
    scene, told = read(stage(tmp_path, CAMERA, parts, floor))
    assert told == [] or all("light" in text for text in told)
    rgb = picture(scene, 8, 64)
    x = (np.arange(8) + 0.5) / 4 - 1
    expected = 4 / np.sqrt(16 + x[None, :] ** 2 + x[:, None] ** 2)
    assert rgb[..., 1] == pytest.approx(expected, abs=0.01)


@pytest.mark.parametrize(("up", "expected"), [("Y", [0, 1, 0]), ("Z", [0, 0, 1])])
def test_the_world_is_that_of_the_stage(tmp_path: Path, up: str, expected: list[float]):
    """A floor whose normal is the stage's up axis, from where the axis is told: as a colour, which the camera sees."""
    graph = Graph()
    node = graph.node("n", "ND_normal_vector3", space="world")
    graph.emit(graph.node("c", "ND_convert_vector3_color3", in_=(node, "out")))
    for name in ("base", "specular"):
        graph.surface.CreateInput(name, TYPES["float"]).Set(0.0)
    parts = graph.stage.GetRootLayer().ExportToString().partition("\n\n")[2]
    floor = FLOOR.replace("</matte>", "</m>").replace("EXTRA", "")
    if up == "Z":
        floor = floor.replace(
            "(-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1)", "(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)"
        )
    head = f'#usda 1.0\n(\n    upAxis = "{up}"\n)\n'
    scene, _ = read(stage(tmp_path, parts, floor, SUN, head=head))
    scene.camera = kanuka.Camera((0, 4, 0), (0, 0, 0), up=(0, 0, -1), fov=20)
    rgb = picture(scene, 4, 64).mean((0, 1))
    assert rgb == pytest.approx(np.array(expected), abs=0.02)


def of_z_up(graph: Graph) -> Graph:
    UsdGeom.SetStageUpAxis(graph.stage, UsdGeom.Tokens.z)
    return graph


def test_vectors_of_a_world_that_is_turned_come_back_as_they_went():
    """The stage's z is our y: grid and normal of the test are (x, y, 0) and (0, 0, 1) in ours."""
    graph = of_z_up(Graph())
    found = shown(graph, graph.node("n", "ND_normal_vector3", space="world"))
    assert found[0, 0] == pytest.approx([0, -1, 0], abs=1e-5)
    for space in ("world", "object"):
        graph = of_z_up(Graph())
        there = graph.node("a", "ND_transformvector_vector3", in_=Gf.Vec3f(1, 2, 3), fromspace="object", tospace=space)
        assert shown(graph, there)[0, 0] == pytest.approx([1, -3, 2] if space == "world" else [1, 2, 3], abs=1e-5)
        graph = of_z_up(Graph())
        there = graph.node("a", "ND_transformvector_vector3", in_=Gf.Vec3f(1, 2, 3), fromspace="object", tospace=space)
        back = graph.node("b", "ND_transformvector_vector3", in_=(there, "out"), fromspace=space, tospace="object")
        assert shown(graph, back)[0, 0] == pytest.approx([1, 2, 3], abs=1e-5)
    graph = of_z_up(Graph())
    world = graph.node("n", "ND_constant_vector3", value=Gf.Vec3f(0.6, -0.8, 0))
    found = normals(surface(STANDARD, graph, normal=(world, "out")))
    assert found == pytest.approx(np.broadcast_to([0.6, 0, 0.8], found.shape), abs=1e-5)


@pytest.mark.parametrize("kelvin", [1800.0, 3000.0, 5000.0, 6500.0, 12000.0])
def test_a_blackbody_has_the_colour_of_plancks_law(kelvin: float):
    """Summed up by the observer of 1931, in Rec. 709 (the published cubics are within 0.002 in x and y)."""
    table = np.loadtxt(Path(__file__).parents[1] / "src/color/data/cie_1931_2deg.csv", delimiter=",", comments="#")
    metres = table[:, 0] * 1e-9
    power = metres**-5 / (np.exp(0.01438777 / (metres * kelvin)) - 1)
    x, y, z = (power[:, None] * table[:, 1:4]).sum(0)
    expected = np.linalg.inv(xyz_from("rec709")) @ np.array([x / y, 1, z / y])
    graph = Graph()
    graph.emit(graph.node("b", "ND_blackbody", temperature=kelvin))
    assert graph.run()[0, 0] == pytest.approx(np.maximum(expected, 0), abs=0.02)


def test_time_goes_by_the_stage(tmp_path: Path):
    """Frame 12 of 48 a second is a quarter of one."""
    graph = Graph()
    graph.stage.SetTimeCodesPerSecond(48)
    frame, time = graph.node("f", "ND_frame_float"), graph.node("t", "ND_time_float")
    graph.emit(graph.node("c", "ND_combine3_color3", in1=(frame, "out"), in2=(time, "out"), in3=0.0))
    made = Materials(lambda _, text: None, files := Files(), Usd.TimeCode(12)).of(graph.material)
    shader = kanuka.compile_shader(files.folder / f"{made.shader}.sl")
    assert shader.run(1, 1, plain(made))["slots"]["light.radiance"][0, 0] == pytest.approx([12, 0.25, 0])


# ---- hexagonal tiles


@pytest.fixture
def wavy(tmp_path: Path) -> str:
    """Smooth, and another everywhere."""
    y, x = np.mgrid[0:256, 0:256] / 256 * 2 * math.pi
    rgb = 0.5 + 0.25 * np.stack([np.sin(x), np.cos(y), np.sin(x + y)], -1)
    path = tmp_path / "waves.exr"
    kanuka.Picture({"rgb": rgb.astype(np.float32)}).write(path)
    return str(path)


def waves(s: np.ndarray, t: np.ndarray) -> np.ndarray:
    x, y = 2 * math.pi * s, 2 * math.pi * (1 - t)
    return 0.5 + 0.25 * np.stack([np.sin(x), np.cos(y), np.sin(x + y)], -1)


def hexagons(s: np.ndarray, t: np.ndarray) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """The three nearest corners of a lattice of triangles of side 1 / (2 sqrt(3)), with barycentric shares."""
    side = 1 / (2 * math.sqrt(3))
    basis = side * np.array([[1, 0.5], [0, math.sqrt(3) / 2]])
    place = np.stack([s, t], -1) @ np.linalg.inv(basis).T
    whole, part = np.floor(place), place - np.floor(place)
    upper = part.sum(-1) >= 1
    corners = [np.where(upper[..., None], (1, 1), (0, 0)), *[np.broadcast_to(c, part.shape) for c in ((1, 0), (0, 1))]]
    first = np.abs(part.sum(-1) - 1)
    shares = [first, np.where(upper, 1 - part[..., 1], part[..., 0]), np.where(upper, 1 - part[..., 0], part[..., 1])]
    return [(*np.moveaxis((whole + c) @ basis.T, -1, 0), w) for c, w in zip(corners, shares, strict=True)]


def hexagonal(file: str, **inputs) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    graph = Graph()
    given = dict(rotation=0.0, scale=0.0, offset=0.0, falloffcontrast=0.0) | inputs
    graph.emit(graph.node("h", "ND_hextiledimage_color3", file=file, **given))
    made, shader = graph.made()
    size = 64
    s, t = np.meshgrid(*[np.linspace(0.1, 1.3, size, dtype=np.float32)] * 2)
    known = {p["name"] for p in shader.parameters}
    values = {k: x for k, x in {"usd_st_0": s, "usd_st_1": t}.items() if k in known}
    assert graph.told == []
    return shader.run(size, size, plain(made) | values)["slots"]["light.radiance"], s.astype(float), t.astype(float)


def test_hexagonal_tiles_that_are_all_alike_are_the_picture(wavy: str):
    found, s, t = hexagonal(wavy)
    assert found == pytest.approx(waves(s, t), abs=0.01)
    found, s, t = hexagonal(wavy, offset=1.0, offsetrange=Gf.Vec2f(0.25, 0.25), tiling=Gf.Vec2f(2, 1))
    assert found == pytest.approx(waves(2 * s + 0.25, t + 0.25), abs=0.01)


@pytest.mark.parametrize(
    ("degrees", "scale", "falloff"), [(90, 1.0, 0.5), (35, 2.0, 0.5), (0, 0.5, 0.5), (60, 1.5, 0.75)]
)
def test_hexagonal_tiles_turn_and_grow_about_their_middles(wavy: str, degrees: float, scale: float, falloff: float):
    """Where nothing is left to chance, by the same three lookups in NumPy (Mikkelsen 2022)."""
    found, s, t = hexagonal(
        wavy,
        rotation=1.0,
        rotationrange=Gf.Vec2f(degrees, degrees),
        scale=1.0,
        scalerange=Gf.Vec2f(scale, scale),
        falloff=falloff,
    )
    c, d = math.cos(math.radians(degrees)) / scale, math.sin(math.radians(degrees)) / scale
    tiles = hexagons(s, t)
    weights = np.array([w**7 for _, _, w in tiles])
    weights /= weights.sum(0)
    bend = (1 / falloff - 2) * (1 - 2 * weights)  # Schlick's gain
    weights = np.where(weights < 0.5, weights / (bend + 1), (bend - weights) / (bend - 1))
    weights /= weights.sum(0)
    looks = [waves((s - x) * c - (t - y) * d + x, (s - x) * d + (t - y) * c + y) for x, y, _ in tiles]
    expected = sum(w[..., None] * look for w, look in zip(weights, looks, strict=True))
    assert found == pytest.approx(expected, abs=0.015)


def test_hexagonal_tiles_at_random_keep_the_mean_and_hide_the_period(wavy: str):
    found, _, _ = hexagonal(wavy, rotation=1.0, offset=1.0, tiling=Gf.Vec2f(10, 10))
    assert found.mean((0, 1)) == pytest.approx([0.5] * 3, abs=0.03)
    assert 0.1 < found.std() < 0.2


def test_hexagonal_normals_turn_back_with_their_tiles(tmp_path: Path):
    """A map that leans the same everywhere leans the other way where its tiles are turned, by the angle of all."""
    code = np.broadcast_to(np.array([0.8, 0.5, 0.9], np.float32), (16, 16, 3)).copy()
    kanuka.Picture({"rgb": code}).write(tmp_path / "n.exr")
    for degrees, expected in ((0, [0.6, 0, 0.8]), (90, [0, -0.6, 0.8]), (180, [-0.6, 0, 0.8])):
        graph = Graph()
        node = graph.node(
            "n",
            "ND_hextilednormalmap_vector3",
            file=str(tmp_path / "n.exr"),
            rotationrange=Gf.Vec2f(degrees, degrees),
        )
        found = normals(surface(STANDARD, graph, normal=(node, "out")))
        assert found == pytest.approx(np.broadcast_to(expected, found.shape), abs=2e-3)


def test_pictures_are_blurred_and_other_patterns_are_not(tmp_path: Path):
    """A step, seen through a box of half the picture; a blur that varies is told."""
    rgb = np.zeros((64, 64, 3), np.float32)
    rgb[:, 32:] = 1
    kanuka.Picture({"rgb": rgb}).write(tmp_path / "step.exr")

    def seen(size: object) -> tuple[np.ndarray, list[str]]:
        graph = Graph()
        image = graph.node("i", "ND_image_color3", file=str(tmp_path / "step.exr"), uaddressmode="clamp")
        if size == "s":
            size = (graph.node("s", "ND_extract_vector2", in_=st_of(graph), index=0), "out")
        graph.emit(graph.node("b", "ND_blur_color3", in_=(image, "out"), size=size))
        return graph.run()[3, :, 0], graph.told

    sharp, told = seen(0.0)
    assert told == [] and sharp[2] < 0.01 < 0.99 < sharp[5]
    soft, told = seen(0.5)
    assert told == [] and 0.15 < soft[2] < soft[3] < 0.5 < soft[4] < soft[5] < 0.85
    unknown, told = seen("s")
    assert unknown == pytest.approx(sharp) and len(told) == 1 and "blur" in told[0]
