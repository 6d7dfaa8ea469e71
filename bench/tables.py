"""Tables of the pages, by measure; docs/ has some of them between markers."""

from __future__ import annotations

import statistics
from collections.abc import Callable

import intervals
from cells import NOT_MEASURED, TITLES, show, table
from goals import all_goals, times
from results import Results
from reuse_tables import budgets, edits, kills, levels, nesting, oracle, shots, store


def goals(results: Results) -> str:
    words = {"met": "met", "missed": "**not met**", "undecided": "undecided"}
    rows = [[g.name, g.goal, g.measured, words[g.verdict]] for g in all_goals(results)]
    return table(["", "goal", "measured", ""], rows)


def side_by_side(results: Results) -> str:
    parts = []
    for scene, found in results.of("side-by-side"):
        ours, rows, stated = found["renderers"][0], [], []
        for each in found["renderers"]:
            cells = [f"{each['name']} {each.get('version', '')}"]
            for figure in TITLES:
                values = each["rounds"].get(figure)
                shown = show(figure, statistics.median(values)) if values else "–"
                if values and each is not ours:
                    shown += f"; {times(intervals.of_ratio(ours['rounds'][figure], values))}"
                cells.append(shown)
            rows.append(cells)
            settings = ", ".join(f"{name} {value}" for name, value in each.get("settings", {}).items())
            stated.append(f"- {each['name']}: {settings or '–'}")
        parts += [f"### {scene}\n", table(["", *TITLES.values()], rows) + "\n", "\n".join(stated) + "\n"]
        for name, cost in found.get("samplers", {}).items():
            costs = ", ".join(f"{sampler} {value:.2f}" for sampler, value in cost.items())
            parts.append(
                f"Samplers of {name}, noise² × time over that of independent ones: {costs}; the best is taken.\n"
            )
        if found.get("missing"):
            parts.append(f"Not installed: {', '.join(found['missing'])}.\n")
    return "\n".join(parts).rstrip("\n") or NOT_MEASURED


def agreement(results: Results) -> str:
    rows = []
    for scene, a in results.of("agreement"):
        means = ", ".join(
            f"{100 * (r - 1):+.2f} ± {100 * s:.2f}" for r, s in zip(a["mean_ratio"], a["mean_sigma"], strict=True)
        )
        blocks = f"{a['rms_z']:.2f} ({a['rms_limit']:.2f})", f"{a['worst_z']:.1f} ({a['worst_limit']:.1f})"
        samples = f"{a['our_samples']}, {a['their_samples']}"
        rows.append([scene, samples, f"{means} %", *blocks, f"{100 * a['residual']:.2f} %"])
    head = ["", "samples", "means of R, G, B", "z of blocks, r.m.s. (limit)", "worst z (limit)", "beyond noise"]
    return table(head, rows)


def micropolygons(results: Results) -> str:
    rows = []
    for _, m in results.of("micropolygons"):
        seconds = [show(name, m[name]) for name in ("dice_s", "shade_s", "bvh_s", "build_s")]
        each = [f"{m[name] / m['micropolygons']:.1f}" for name in ("grids_bytes", "bvh_bytes", "lobe_inputs_bytes")]
        rows.append([f"{m['micropolygons'] / 1e6:.2f} M", *seconds, *each, show("peak_bytes", m["peak_bytes"])])
    head = [
        "micropolygons",
        "dice",
        "shade",
        "BVH",
        "together",
        "geometry, bytes each",
        "BVH, each",
        "lobe inputs, each",
    ]
    return table([*head, "peak memory"], rows)


def dice(results: Results) -> str:
    rows = [
        [
            run["case"],
            f"{run['vertices'] / 1e6:.2f} M",
            f"{run['cells'] / 1e6:.2f} M",
            f"{run['traced'] / 1e6:.2f} M",
            f"{run['cpu_s']:.2f} s",
            f"{run['vertices_per_cpu_s'] / 1e6:.1f} M",
        ]
        for _, found in results.of("dice")
        for run in found["runs"]
    ]
    return table(["one thread", "vertices", "micropolygons", "traced", "CPU", "vertices a second"], rows)


def hierarchy(results: Results) -> str:
    rows = []
    for scene, found in results.of("hierarchy"):
        for rays in found["rays"]:
            robust = [intervals.Interval(**r) for name, r in rays["against"].items() if name.endswith("robust")]
            best = min((intervals.Interval(**r) for r in rays["against"].values()), key=lambda r: -r.value)
            rows.append([scene, rays["name"], f"{rays['ns']:.0f} ns", times(robust[0]), times(robust[-1]), times(best)])
    of_grid = "of Embree GRID (meshes: TRIANGLE, hair: ROUND_LINEAR_CURVE), robust"
    return table(["", "rays", "pages", of_grid, "of QUAD, robust", "of the fastest"], rows)


def hierarchy_bytes(results: Results) -> str:
    rows = [
        [
            scene,
            each["tracer"],
            f"{each['primitives'] / 1e6:.2f} M",
            f"{each['bytes_each']:.1f}",
            f"{each['positions_each']:.1f}" if each["positions_each"] else "included",
            f"{each['build_ms']:.0f} ms",
        ]
        for scene, found in results.of("hierarchy")
        for each in found["tracers"]
        if "robust" in each["tracer"] or not each["tracer"].startswith("Embree")
    ]
    return table(["", "", "cells, triangles or segments", "bytes each", "positions", "built in"], rows)


def instances(results: Results) -> str:
    rows = []
    for _, found in results.of("instances"):
        level = found["level"]
        theirs = level["embree_place_s"] + level["embree_build_s"]
        ratio = f"{level['build_s'] / theirs:.2f}×"
        rows.append(["bytes an instance", f"{level['bytes_each']:.1f}", f"{level['embree_bytes_each']:.1f}", ""])
        rows.append(["built in", f"{level['build_s']:.2f} s", f"{theirs:.2f} s", ratio])
        for rays in found["rays"]:
            ours, others = (statistics.median(rays[f"{tracer}_ns"]) for tracer in ("pages", "embree"))
            rows.append(
                [rays["rays"], f"{ours:.0f} ns", f"{others:.0f} ns", times(intervals.Interval(**rays["ratio"]))]
            )
    return table(["", "pages", "Embree, robust", ""], rows)


def moving(results: Results) -> str:
    rows = []
    for scene, found in results.of("moving"):
        bytes_each = {t["tracer"]: f"{t['bytes_each']:.1f}" for t in found["tracers"]}
        takes = [f"{bytes_each[f'{of}, still']}, {bytes_each[f'{of}, moving']}" for of in ("pages", "Embree")]
        for rays in found["rays"]:
            over = [times(intervals.Interval(**ratio)) for ratio in rays["over"].values()]
            rows.append([scene, rays["name"], f"{rays['ns']['pages, moving']:.0f} ns", *over, *takes])
            scene, takes = "", ["", ""]
    heads = ["", "rays", "pages", "over still ones", "Embree over still ones", "pages over Embree"]
    return table([*heads, "bytes in pages: still, moving", "in Embree"], rows)


def rays(results: Results) -> str:
    rows = []
    for kind, f in results.of("rays"):
        number, leaks, of_any, theirs = (
            f"{sum(f[key].values()):,}" for key in ("rays", "leaks", "leaks_of_any", "embree_leaks")
        )
        judged = [f"{f[key]:,}" for key in ("differ", "ours_right", "embree_right", "tie", "neither")]
        rows.append(
            [kind, f"{f['surfaces']}, {f['triangles'] / 1e6:.1f} M", number, f"{leaks}, {of_any}", theirs, *judged]
        )
    heads = ["", "surfaces, triangles", "rays", "leaks: closest, any", "Embree's leaks", "differ"]
    return table([*heads, "pages right", "Embree right", "both", "neither"], rows)


def rib(results: Results) -> str:
    rows = [
        [
            run["what"],
            show("_bytes", run["bytes"]),
            f"{run['primitives']}",
            f"{run['seconds']:.2f} s",
            f"{run['bytes_per_s'] / 1e6:.0f} MB/s",
            show("_bytes", run["peak_bytes"]),
        ]
        for _, found in results.of("rib")
        for run in found["runs"]
    ]
    return table(["one thread", "file", "primitives", "CPU", "", "resident at most"], rows)


def hair(results: Results) -> str:
    seconds = ("load_s", "dice_s", "shade_s", "bvh_s", "transport_s", "all_s")
    memory = ("loaded_bytes", "grids_bytes", "lobe_inputs_bytes", "bvh_bytes", "peak_bytes")
    rows = [
        [
            f"{run['hairs'] / 1e6:g} M {kind}",
            f"{run['segments'] / 1e6:g} M",
            *(show(n, run[n]) for n in (*seconds, *memory)),
        ]
        for kind, run in results.of("hair")
    ]
    head = ["hairs", "segments", "load", "dice", "shade", "BVH", "transport", "all"]
    return table([*head, "loaded, peak", "grids", "lobe inputs", "BVH", "peak memory"], rows)


def delayed(results: Results) -> str:
    rows = []
    for _, f in results.of("delayed"):
        size = show("_bytes", f["rib_bytes"])
        rows.append(
            [f"load {f['archives']:,} of them, {size} of RIB", *_timed(f, "load"), show("_bytes", f["load_peak_bytes"])]
        )
        rows.append([f"render; {f['read']} are read", *_timed(f, "render"), show("_bytes", f["peak_bytes"])])
    return table(["delayed archives", "time", "CPU", "peak memory"], rows)


def _timed(f: dict, what: str) -> list[str]:
    return [f"{f[f'{what}_s']:.1f} s", f"{f[f'{what}_cpu_s']:.1f} s"]


def networks(results: Results) -> str:
    rows, likeness = [], []
    for _, w in sorted(results.of("networks"), key=lambda entry: entry[1]["links"]):
        r, few = w["rounds"], w["peer_samples"]
        if "theirs_s" not in r:
            continue
        direct, faster = (
            intervals.of_ratio(r["theirs_few_s"], r["ours_few_s"]),
            intervals.of_ratio(r["theirs_s"], r["ours_s"]),
        )
        cells = [f"{statistics.median(r[name]):.1f} s" for name in ("ours_few_s", "theirs_few_s")]
        long = [f"{statistics.median(r['ours_s']):.1f} s", f"{statistics.median(r['theirs_s']):.1f} s"]
        rows.append([str(w["links"]), str(few), *cells, times(direct), *long, times(faster)])
        for name, look in w["looks"].items():
            means = ", ".join(f"{c:.3f}" for c in look["means"])
            likeness.append([f"{w['links']} links, {name}", means, f"{look['contrast']:.3f}", f"{look['grain']:.3f}"])
    if not rows:
        return NOT_MEASURED
    head = ["links", "samples", "ours", "Cycles", "faster", "ours, 64 samples", "Cycles, 64 by its rate", "faster"]
    return table(head, rows) + "\n\n" + table(["the plane", "mean R, G, B", "contrast", "grain"], likeness)


def shaders(results: Results) -> str:
    parts = []
    for _, s in results.of("shaders"):
        rows = [
            [
                f"{c['nodes']:,}",
                f"{c['lines']:,}",
                f"{c['compile_s']:.2f} s",
                f"{c['peak_bytes'] / 1e6:.0f} MB",
                f"{1000 * c['cached_s']:.0f} ms",
                f"{c['vertex_ns'] / 1000:.1f} µs",
            ]
            for c in s["compile"]
        ]
        parts.append(table(["nodes", "lines", "cold compile", "peak memory", "from the cache", "a vertex"], rows))
        names = {"lanes1_ns": "one lane", "lanes8_ns": "8 lanes", "lanes16_ns": "16 lanes", "by_hand_ns": "C++ by hand"}
        there = [name for name in names if name in s["arithmetic"]]
        cells = [f"{s['arithmetic'][name]:.1f} ns" for name in there]
        parts.append(table(["480 operations, a vertex", *(names[name] for name in there)], [["", *cells]]))
    return "\n\n".join(parts) or NOT_MEASURED


def lights(results: Results) -> str:
    rows = []
    for _, found in results.of("lights"):
        for run in found["runs"]:
            uniform = f"{run['uniform_noise']:.2f}" if run["uniform_noise"] else "–"
            cells = [f"{run['ns_a_sample']:.0f} ns", f"{run['slower']:.2f}×", f"{run['noise']:.2f}", uniform]
            rows.append([f"{run['count']} {run['lights']}", *cells, f"{run['tree_bytes'] / run['count']:.0f}"])
    return table(
        ["lights", "time a sample", "against 10", "noise of a sample", "of uniform choice", "bytes a light"], rows
    )


def lanes(results: Results) -> str:
    rows = []
    for _, found in results.of("lanes"):
        for run in found["runs"]:
            one = run["rounds"]["1"]
            faster = [times(intervals.of_ratio(one, run["rounds"][n])) for n in ("8", "16")]
            rows.append([run["material"], *(f"{run[f'ns_{n}']:.0f} ns" for n in (1, 8, 16)), *faster])
    return table(["surface stage, a hit", "one lane", "8 lanes", "16 lanes", "8 over one", "16 over one"], rows)


def _pairs(results: Results, measure: str, a: str, b: str, head: list[str]) -> str:
    """Two ways of ours on some scenes."""
    rows = []
    for scene, found in results.of(measure):
        r = found["rounds"]
        rows.append(
            [scene, *(f"{statistics.median(r[side]):.2f} s" for side in (a, b)), times(intervals.of_ratio(r[a], r[b]))]
        )
    return table(head, rows)


def widths(results: Results) -> str:
    return _pairs(results, "widths", "16", "8", ["transport", "16 lanes", "8 lanes", "16 over 8"])


def watertight(results: Results) -> str:
    return _pairs(results, "watertight", "on", "off", ["transport", "without gaps", "with", "over"])


def wavelengths(results: Results) -> str:
    rows = []
    for scene, w in results.of("wavelengths"):
        cost = intervals.of_ratio(w["rounds"]["four_s"], w["rounds"]["three_s"])
        rows.append([scene, times(cost), f"{w['noise']:.2f}×", f"{w['at_equal_noise']:.2f}×"])
    return table(["four wavelengths over three colours", "time", "noise²", "at equal noise"], rows)


def tolerance(results: Results) -> str:
    rows = []
    for kind, t in results.of("tolerance"):
        for side in ("on", "off"):
            f = t[side]
            polygons = f"{f['traced_polygons']:.0f} of {f['micropolygons']:.0f}"
            built = show("_s", f["dice_s"] + f["shade_s"] + f["bvh_s"])
            memory = f"{(f['grids_bytes'] + f['bvh_bytes']) / 1e6:.2f} MB"
            same = f"{100 * t['mean_error']:.2f} %, {t['rms_z']:.2f}" if side == "on" else ""
            rows.append([kind, side, polygons, built, show("_s", f["render_s"]), memory, same])
    head = ["", "tolerance", "traced polygons", "dice, shade, build", "transport", "geometry and BVH"]
    return table([*head, "means apart, z r.m.s."], rows)


def stages(results: Results) -> str:
    names = ("dice_s", "shade_s", "bvh_s", "transport_s", "first_pixel_s", "total_s")
    rows = []
    for scene, f in results.of("stages"):
        cells = [show(name, f[name]) for name in names]
        rows.append([scene, *cells, f"{f['rays_per_s'] / 1e6:.2f} M", show("_bytes", f["peak_bytes"])])
    return table(["", "dice", "shade", "BVH", "transport", "first pixel", "all", "rays a second", "peak memory"], rows)


def flight(results: Results) -> str:
    rows = []
    for way, found in results.of("flight"):
        for name in ("alone", "shot"):
            f = found[name]
            again = sum(sum(frame.values()) for frame in f["again"][1:])
            ratio = f"{f['ratio']:.4f}× ± {f['ratio_error']:.4f}"
            jump = f"{100 * f['jump']:.2f} % ({100 * f['jump_noise']:.2f} %)"
            cells = [ratio, f"{f['ratio_99']:.3f}×", f"{100 * f['difference']:.3f} %", jump, f"{again}"]
            rows.append([f"{way}, {found['frames']} frames", name, *cells])
    heads = ["", "diced", "variance, over the reference's", "99 % of blocks", "of the difference", "jump (noise's)"]
    return table([*heads, "primitives diced again"], rows)


def isles(results: Results) -> str:
    rows = []
    for name, f in results.of("isles"):
        what = f"{name}, scale {f['scale']:g}" if "scale" in f else name
        counted = () if "kept_each" not in f and "scale" not in f else ("bytes_each", "kept_each")
        each, kept = (f"{f[of]:.0f}" if of in f and of in counted else "" for of in ("bytes_each", "kept_each"))
        seconds = [show("_s", f[key]) for key in ("read_s", "first_picture_s", "sample_s")]
        rows.append([what, f"{f['rows']:,}", *seconds, show("_bytes", f["peak_bytes"]), each, kept])
    heads = ["", "instances stored", "read", "first picture", "a sample", "peak memory"]
    heads += ["bytes an instance, of the peak", "as it is kept"]
    return table(heads, rows)


def ingest(results: Results) -> str:
    rows = []
    for name, f in results.of("ingest"):
        ratio = times(intervals.Interval(**f["ratio"]))
        rows.append([f"{f['number']:,} {name}", show("_s", f["ours_s"]), show("_s", f["usd_s"]), ratio])
    return table(["", "read", "by USD's own Python", "processor time, over"], rows)


def taken(results: Results) -> str:
    """Where each part comes from."""
    rows = []
    for name, part in results.parts.items():
        t = part["taken"]
        m = t["machine"]
        load = " to ".join(map(str, t["load"])) if t.get("load") else "–"
        machine = f"{m['cpu']} {m['family_model_stepping']}, {m['cores']} cores, {m['isa']}"
        rows.append([name, t["commit"], t["date"], machine, load, str(t["rounds"])])
    return table(["part", "commit", "date", "machine", "load", "rounds"], rows)


TABLES: dict[str, Callable[[Results], str]] = {
    each.__name__.replace("_", "-"): each
    for each in (
        goals,
        side_by_side,
        agreement,
        micropolygons,
        dice,
        hierarchy,
        hierarchy_bytes,
        instances,
        moving,
        rays,
        rib,
        hair,
        delayed,
        networks,
        shaders,
        lights,
        lanes,
        widths,
        watertight,
        wavelengths,
        tolerance,
        stages,
        edits,
        shots,
        store,
        flight,
        oracle,
        budgets,
        kills,
        levels,
        nesting,
        isles,
        ingest,
        taken,
    )
}
