"""Tables of what is not made twice, and what is not held in memory: edits, shots, the store, oracles, budgets."""

from __future__ import annotations

import intervals
from cells import show, table
from goals import times
from results import Results


def edits(results: Results) -> str:
    rows = []
    for which, f in results.of("edits"):
        whole = f"{f['primitives']} of {f['primitives']}"
        of = {"places": " of a million places", "shapes": " of 50 shapes, 16 M cells"}.get(which, "")
        rows.append([f"the first making{of}", whole, "", "yes", show("_s", f["first"]), ""])
        for name, each in f["edits"].items():
            again = f"{each['again']} of {f['primitives']}"
            ratio = times(intervals.Interval(**each["ratio"]))
            why = ", ".join(each.get("why", ()))
            built = "yes" if each["hierarchy"] else "no"
            rows.append([name, again, why, built, show("_s", each["seconds"]), ratio])
    return table(["edit", "primitives made again", "why", "hierarchy built", "time", "of the first"], rows)


def shots(results: Results) -> str:
    rows = []
    for scene, f in results.of("shots"):
        ratio = times(intervals.Interval(**f["ratio"]))
        rows.append([scene, str(f["frames"]), show("_s", f["alone"]), show("_s", f["together"]), ratio])
    return table(["", "frames", "one by one", "together", ""], rows)


def oracle(results: Results) -> str:
    rows = []
    for _, f in results.of("oracle"):
        same = f["agreement"]
        rows.append(
            [
                f"{f['seen']} of {f['primitives']}",
                show("_s", f["record_s"]),
                f"{f['micropolygons']['without']:,}",
                f"{f['micropolygons']['with']:,}",
                f"{f['ratio']:.2f}×",
                times(intervals.Interval(**f["time"])),
                f"{same['rms_z']:.2f} ({same['rms_limit']:.2f})",
                f"{same['mean_error']:.2%}",
            ]
        )
    head = [
        "primitives seen",
        "record",
        "micropolygons",
        "by the oracle",
        "",
        "time",
        "z r.m.s. (limit)",
        "means apart",
    ]
    return table(head, rows)


def budgets(results: Results) -> str:
    rows = []
    for _, f in results.of("budgets"):
        for name, b in f["budgets"].items():
            rows.append(
                [
                    name,
                    show("_bytes", b["budget_bytes"]),
                    show("_s", b["build_s"]),
                    times(intervals.Interval(**b["build_s_ratio"])),
                    show("_s", b["render_s"]),
                    times(intervals.Interval(**b["render_s_ratio"])),
                    show("_bytes", b["peak_bytes"]),
                ]
            )
    head = ["of the geometry", "budget", "build", "over none", "4 samples", "over none", "peak"]
    return table(head, rows)


def levels(results: Results) -> str:
    rows = []
    for view, f in results.of("levels"):
        ratios = [
            times(intervals.Interval(**f[name])) if name in f else "–"
            for name in ("vertices_m", "geometry_mb", "build_cpu_s", "trace_cpu_s", "given_back_mb")
        ]
        budget = f["memory"] or "none"
        rows.append([view, budget, f"{f['coarser']:,} of {f['count']:,}", *ratios, f"{f['means_apart']:.2%}"])
    head = ["", "budget", "that show one", "vertices", "geometry", "making", "tracing", "given back", "means apart"]
    return table(head, rows)


def nesting(results: Results) -> str:
    rows, depths = [], []
    for tracer, f in results.of("nesting"):
        depths = list(f["over"])
        over = {depth: intervals.Interval(**ratio) for depth, ratio in f["over"].items()}
        rows.append([tracer, f"{f['places']:,}", *map(times, over.values()), f"{f['means_apart']:.3%}"])
        rows.append(["", "a group over one less", *(times(ratio.root(int(d) - 1)) for d, ratio in over.items()), ""])
    return table(["", "places", *(f"{depth} deep over one" for depth in depths), "means apart"], rows)


def store(results: Results) -> str:
    rows = []
    for scene, f in results.of("store"):
        first = times(intervals.Interval(**f["first_picture"]))
        cells = [show("_s", f[kind]["build_s"]) for kind in ("without", "new", "filled")]
        ratios = [times(intervals.Interval(**f[name])) for name in ("writing", "reading")]
        disk = show("_bytes", f["bytes"])
        hierarchy = "–"
        if "hierarchy" in f:
            hierarchy = times(intervals.Interval(**f["hierarchy"]))
            disk += f", of it the hierarchy {show('_bytes', f['hierarchy_bytes'])}"
        rows.append([scene, cells[0], cells[1], ratios[0], cells[2], ratios[1], hierarchy, first, disk])
    heads = [
        *("", "without", "with a new one", "over", "with a filled one", "over"),
        *("its hierarchy, over", "first picture, over", "on disk"),
    ]
    return table(heads, rows)


def kills(results: Results) -> str:
    rows = [
        [str(f["kills"]), str(f["pictures"]), str(f["wrong"]), show("_s", f["seconds"])] for _, f in results.of("kills")
    ]
    return table(["kills", "pictures that came of it", "with other bits", "a whole render takes"], rows)
