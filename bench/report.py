"""From figures to pages: goals and what became of them, results.json, RESULTS.md, and the lines on the console."""

from __future__ import annotations

UNITS = {"_s": ("{:.3g} s", 1), "_bytes": ("{:.0f} MB", 1e-6)}
TITLES = {
    "load_s": "load",
    "build_s": "build",
    "first_picture_s": "first picture",
    "render_s": "render",
    "noise": "noise²",
    "noise_x_time": "noise² × render",
    "peak_bytes": "peak memory",
}


NETWORK_GOALS = {16: 5, 100: 25, 1000: 100}


def _ratio(results: dict, scene: str, peer: str, figure: str) -> float | None:
    for r in results.get("ratios", ()):
        if (r["scene"], r["peer"], r["figure"]) == (scene, peer, figure):
            return r["ratio"]
    return None


def goals(results: dict) -> list[dict[str, object]]:
    """What was aimed at, for what was measured."""
    found: list[dict[str, object]] = []

    def add(name: str, goal: str, measured: str, met: bool) -> None:
        found.append({"name": name, "goal": goal, "measured": measured, "met": bool(met)})

    for r in results.get("ratios", ()):
        what = {"render_s": "transport", "noise_x_time": "noise² × time"}.get(r["figure"])
        if what and r["scene"] in ("cornell", "terrain", "still-life"):
            add(f"{r['scene']}: {what}, against {r['peer']}", "< 1×", f"{r['ratio']:.2f}×", r["ratio"] < 1)
    for a in results.get("agreement", ()):
        where = f"{a['scene']}: picture, against {a['peer']}"
        add(where, "means within 0.5 %", f"{100 * a['mean_error']:.2f} %", a["mean_error"] <= 0.005)
        beyond = f"z {a['rms_z']:.2f} r.m.s., {100 * a['residual']:.2f} % beyond noise"
        add(where, "no structure", beyond, not a["structure"])
    for m in results.get("micropolygons", ()):
        many = f"{m['micropolygons'] / 1e6:.1f} M micropolygons"
        add(f"{many}: dice, shade, build", "≤ 2 s", f"{m['build_s']:.2f} s", m["build_s"] <= 2)
        add(f"{many}: geometry and BVH", "≤ 30 bytes each", f"{m['bytes_each']:.1f}", m["bytes_each"] <= 30)
    for run in (run for found_dice in results.get("dice", ()) for run in found_dice["runs"]):
        if run["case"].startswith("subdivision") and not results.get("quick"):  # whose grids are small
            rate = run["vertices_per_cpu_s"] / 1e6
            add(f"{run['case']}: dicing, a thread", "≥ 4 M vertices/s", f"{rate:.1f} M/s", rate >= 4)
    for run in (run for found_hair in results.get("hair", ()) for run in found_hair["runs"]):
        if run["hairs"] >= 5_000_000:
            gb = run["peak_bytes"] / 1e9
            name = f"{run['hairs'] / 1e6:g} M {run['kind']} hairs: load, dice, trace"
            add(name, "≤ 6 GB", f"{gb:.2f} GB", gb <= 6)
    for w in results.get("networks", ()):
        least = NETWORK_GOALS.get(w["links"])
        if least:
            name = f"chain of {w['links']}, all counted, against {w['peer']}"
            add(name, f"≥ {least}× faster", f"{w['faster']:.0f}×", w["faster"] >= least)
    for s in results.get("shaders", ()):
        for name, goal, measured, met in shader_goals(s):
            add(name, goal, measured, met)
    for run in (run for found_lights in results.get("lights", ()) for run in found_lights["runs"]):
        if run["count"] == 100_000:
            name = f"100 000 {run['lights']}"
            add(f"{name}: time a sample, against 10", "≤ 1.5×", f"{run['slower']:.2f}×", run["slower"] <= 1.5)
            add(f"{name}: noise, against uniform choice", "≥ 5× less", f"{run['quieter']:.1f}×", run["quieter"] >= 5)
    for run in (run for found_lanes in results.get("lanes", ()) for run in found_lanes["runs"]):
        for lanes_of, least in ((8, 3.5), (16, 5)):
            fast = run[f"of_{lanes_of}"]
            add(f"surface stage, {run['material']}: {lanes_of} lanes", f"≥ {least}× one", f"{fast:.1f}×", fast >= least)
    for t in results.get("tolerance", ()):
        measured = f"means {100 * t['mean_error']:.2f} % apart, z {t['rms_z']:.2f} r.m.s."
        add(f"{t['kind']}: tolerance on and off", "same within noise", measured, not t["structure"])
    return found


def shader_goals(s: dict) -> list[tuple[str, str, str, bool]]:
    """Goal by goal: what, how much, what it is, whether that will do."""
    found = []
    if speed := s.get("network_evaluations_per_s"):
        found.append(("network of 1 000 nodes, a thread", "≥ 50 000 evaluations/s", f"{speed:,.0f}", speed >= 50_000))
    arithmetic = s.get("arithmetic", {})
    for lanes, least in ((8, 4), (16, 6)):
        if wide := arithmetic.get(f"lanes{lanes}_ns"):
            gain = arithmetic["lanes1_ns"] / wide
            found.append((f"arithmetic, {lanes} lanes over one", f"≥ {least}×", f"{gain:.1f}×", gain >= least))
    if arithmetic:
        widest = arithmetic.get("lanes16_ns") or arithmetic["lanes8_ns"]
        cost = widest / arithmetic["by_hand_ns"]
        found.append(("arithmetic, time over C++ by hand", "≤ 1.3×", f"{cost:.2f}×", cost <= 1.3))
    for c in s.get("compile", ()):
        if c["nodes"] == 10_000:
            found.append(("10 000 nodes, cold compile", "≤ 60 s", f"{c['compile_s']:.1f} s", c["compile_s"] <= 60))
            gib = c["peak_bytes"] / 2**30
            found.append(("10 000 nodes, peak memory", "≤ 4 GiB", f"{gib:.2f} GiB", gib <= 4))
            ms = 1000 * c["cached_s"]
            found.append(("10 000 nodes, from the cache", "≤ 20 ms", f"{ms:.0f} ms", ms <= 20))
    if growth := s.get("growth"):
        found.append(("compile time, 1 000 to 10 000 nodes", "≤ n log n (13.3×)", f"{growth:.1f}×", growth <= 13.34))
    if plain := s.get("plain_compile_s"):
        found.append(("a plain shader, cold compile", "≤ 50 ms", f"{1000 * plain:.0f} ms", plain <= 0.05))
    return found


def show(name: str, value: object) -> str:
    if not isinstance(value, int | float):
        return "–"
    for ending, (text, factor) in UNITS.items():
        if name.endswith(ending):
            return text.format(value * factor)
    return f"{value:.3g}"


def table(head: list[str], rows: list[list[str]]) -> str:
    lines = ["| " + " | ".join(cells) + " |" for cells in (head, *rows)]
    return "\n".join([lines[0], "|" + "---|" * len(head), *lines[1:]]) + "\n"


def page(results: dict) -> str:
    machine = results["machine"]
    parts = [
        "# Results\n",
        f"{machine['cpu']} (family-model-stepping {machine['family_model_stepping']}), {machine['cores']} cores, "
        f"{machine['isa']}, {machine['memory_gib']} GiB; {machine['system']}; load before the run "
        f"{machine['load_before']}. {results['threads']} threads each. Commit {results['commit']}, {results['date']}, "
        f"{', '.join(f'`{command}`' for command in results['commands'])}.\n",
        f"Medians of {results['repeats']} runs, a process each, taken in turn (ours, theirs, ours, theirs). Ratios are "
        "ours over theirs: below 1, Kanuka takes less. They hold within this page alone; figures of two machines or "
        "of two runs do not compare. `docs/bench.md` says what is measured and how.\n",
    ]
    if results["quick"]:
        parts.append("**A quick run: small pictures and scenes. It shows that all works, not how fast it is.**\n")
    if results["goals"]:
        rows = [[g["name"], g["goal"], g["measured"], "met" if g["met"] else "**not met**"] for g in results["goals"]]
        parts += ["## Goals\n", table(["", "goal", "measured", ""], rows)]
    parts += side_by_side(results)
    parts += agreement(results)
    parts += micropolygons(results)
    parts += dice(results)
    parts += hair(results)
    parts += networks(results)
    parts += shaders(results)
    parts += lights(results)
    parts += lanes(results)
    parts += tolerance(results)
    if results["failures"]:
        parts += [
            "## What did not run\n",
            "\n".join(f"- {line.splitlines()[0]}" for line in results["failures"]) + "\n",
        ]
    return "\n".join(parts)


def side_by_side(results: dict) -> list[str]:
    parts = []
    for scene in dict.fromkeys(m["scene"] for m in results.get("medians", ())):
        rows = []
        for m in (m for m in results["medians"] if m["scene"] == scene):
            cells = [f"{m['renderer']} {m['figures'].get('version', '')}"]
            for figure in TITLES:
                ratio = _ratio(results, scene, m["renderer"], figure)
                cells.append(show(figure, m["figures"].get(figure)) + (f" ({ratio:.2f}×)" if ratio is not None else ""))
            rows.append(cells)
        parts += [f"## {scene}\n", table(["", *TITLES.values()], rows)]
    if parts:
        parts.append(
            "In brackets: our figure over this one. *Render*: sampling alone, kernels compiled and the scene built. "
            "*First picture*: reading, building and one sample a pixel. *Noise²*: relative variance of a pixel.\n"
        )
    return parts


def agreement(results: dict) -> list[str]:
    if not results.get("agreement"):
        return []
    rows = []
    for a in results["agreement"]:
        means = ", ".join(
            f"{100 * (r - 1):+.2f} ± {100 * s:.2f} %" for r, s in zip(a["mean_ratio"], a["mean_sigma"], strict=True)
        )
        samples = f"{a['our_samples']}, {a['their_samples']}"
        blocks = (
            f"{a['rms_z']:.2f} r.m.s. (limit {a['rms_limit']:.2f}), worst {a['worst_z']:.1f} ({a['worst_limit']:.1f})"
        )
        rows.append([a["scene"], a["peer"], samples, means, blocks, f"{100 * a['residual']:.2f} %"])
    head = ["", "against", "samples", "means of R, G, B", "z of 16² blocks", "beyond noise"]
    return ["## The same picture?\n", table(head, rows)]


def micropolygons(results: dict) -> list[str]:
    rows = []
    for m in results.get("micropolygons", ()):
        times = [show(name, m[name]) for name in ("dice_s", "shade_s", "bvh_s", "build_s")]
        each = [f"{m[name] / m['micropolygons']:.1f}" for name in ("grids_bytes", "bvh_bytes", "lobe_inputs_bytes")]
        rows.append([f"{m['micropolygons'] / 1e6:.2f} M", *times, *each, show("peak_bytes", m["peak_bytes"])])
    if not rows:
        return []
    head = ["micropolygons", "dice", "shade", "BVH", "together", "geometry B", "BVH B", "lobe inputs B", "peak memory"]
    return ["## Micropolygons\n", table(head, rows), "Bytes are for each micropolygon.\n"]


def dice(results: dict) -> list[str]:
    rows = [
        [
            run["case"],
            f"{run['vertices'] / 1e6:.2f} M",
            f"{run['cells'] / 1e6:.2f} M",
            f"{run['traced'] / 1e6:.2f} M",
            f"{run['cpu_s']:.2f} s",
            f"{run['vertices_per_cpu_s'] / 1e6:.1f} M/s",
        ]
        for found in results.get("dice", ())
        for run in found["runs"]
    ]
    if not rows:
        return []
    head = ["one thread", "vertices", "micropolygons", "traced", "time", "vertices a second"]
    return ["## Dicing\n", table(head, rows), "Evaluated, joined, simplified; no displacement, no shading.\n"]


def hair(results: dict) -> list[str]:
    times = ("load_s", "dice_s", "shade_s", "bvh_s", "transport_s")
    memory = ("loaded_bytes", "grids_bytes", "lobe_inputs_bytes", "bvh_bytes", "peak_bytes")
    rows = [
        [
            f"{run['hairs'] / 1e6:g} M {run['kind']}",
            f"{run['segments'] / 1e6:g} M",
            *(f"{run[name]:.1f} s" for name in times),
            *(f"{run[name] / 1e9:.2f} GB" for name in memory),
        ]
        for found in results.get("hair", ())
        for run in found["runs"]
    ]
    if not rows:
        return []
    head = ["hairs", "segments", "load", "dice", "shade", "BVH", "transport"]
    head += ["loaded, peak", "grids", "lobe inputs", "BVH", "peak memory"]
    return ["## Hair\n", table(head, rows)]


def networks(results: dict) -> list[str]:
    rows = []
    for w in results.get("networks", ()):
        rows.append(
            [
                str(w["links"]),
                f"{w['ours_s']:.2f} s",
                f"{w['theirs_s']:.1f} s",
                str(w["peer_samples"]),
                f"{w['faster']:.0f}×",
            ]
        )
    if not rows:
        return []
    peer, samples = results["networks"][0]["peer"], results["networks"][0]["samples"]
    head = ["links", "ours", peer, "of its samples", "faster"]
    text = (
        f"A chain of noises on a ball and a plane, 512², {samples} samples: reading, compiling without a cache, "
        f"dicing, shading, tracing. {peer} renders fewer samples; its time is that of reading and building, and "
        f"{samples} times what a sample took it.\n"
    )
    return ["## Shader networks\n", table(head, rows), text]


def shaders(results: dict) -> list[str]:
    if not results.get("shaders"):
        return []
    s = results["shaders"][0]
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
    head = ["nodes", "lines", "cold compile", "peak memory", "from the cache", "a vertex"]
    arithmetic = s["arithmetic"]
    names = {"lanes1_ns": "one lane", "lanes8_ns": "8 lanes", "lanes16_ns": "16 lanes", "by_hand_ns": "C++ by hand"}
    columns = [name for name in names if name in arithmetic]
    return [
        "## The shader compiler\n",
        table(head, rows),
        "Procedural networks of `bench/shader_graphs.py`; one thread.\n",
        table([names[c] for c in columns], [[f"{arithmetic[c]:.1f} ns" for c in columns]]),
        "About 480 arithmetic operations (`bench/arithmetic.cpp`), a vertex, one thread. Without AVX-512, 16 "
        "lanes lie in two registers.\n",
    ]


def lights(results: dict) -> list[str]:
    rows = []
    for run in (run for found in results.get("lights", ()) for run in found["runs"]):
        uniform = f"{run['uniform_noise']:.2f}" if run["uniform_noise"] else "–"
        rows.append(
            [
                f"{run['count']} {run['lights']}",
                f"{run['ns_a_sample']:.0f} ns",
                f"{run['slower']:.2f}×",
                f"{run['noise']:.2f}",
                uniform,
                f"{run['tree_bytes'] / run['count']:.0f}",
            ]
        )
    if not rows:
        return []
    head = ["lights", "time a sample", "against 10", "noise of a sample", "of uniform choice", "bytes a light"]
    return ["## Lights\n", table(head, rows)]


def lanes(results: dict) -> list[str]:
    rows = [
        [
            run["material"],
            *(f"{run[f'ns_{n}']:.0f} ns" for n in (1, 8, 16)),
            *(f"{run[f'of_{n}']:.1f}×" for n in (8, 16)),
        ]
        for found in results.get("lanes", ())
        for run in found["runs"]
    ]
    if not rows:
        return []
    head = ["surface stage, a hit", "one lane", "8 lanes", "16 lanes", "8 against one", "16 against one"]
    return ["## Lanes\n", table(head, rows)]


def tolerance(results: dict) -> list[str]:
    rows = []
    for t in results.get("tolerance", ()):
        for side in ("on", "off"):
            f = t[side]
            polygons = f"{f['traced_polygons']:.0f} of {f['micropolygons']:.0f}"
            built = show("_s", f["dice_s"] + f["shade_s"] + f["bvh_s"])
            memory = f"{(f['grids_bytes'] + f['bvh_bytes']) / 1e6:.2f} MB"
            same = f"{100 * t['mean_error']:.2f} %, {t['rms_z']:.2f}" if side == "on" else ""
            rows.append([t["kind"], side, polygons, built, show("_s", f["render_s"]), memory, same])
    if not rows:
        return []
    head = [
        "",
        "tolerance",
        "traced polygons",
        "dice, shade, build",
        "transport",
        "geometry and BVH",
        "means apart, z r.m.s.",
    ]
    return ["## Geometry tolerance\n", table(head, rows)]


def console(results: dict) -> str:
    lines = []
    for r in results.get("ratios", ()):
        ours, theirs = show(r["figure"], r["ours"]), show(r["figure"], r["theirs"])
        title = TITLES[r["figure"]]
        lines.append(f"{r['scene']:<9} {r['peer']:<24} {title:<16} {ours:>10} / {theirs:>10} = {r['ratio']:.2f}")
    for g in results["goals"]:
        lines.append(f"{'met    ' if g['met'] else 'NOT MET'} {g['name']}: {g['measured']} (goal {g['goal']})")
    return "\n".join(lines)
