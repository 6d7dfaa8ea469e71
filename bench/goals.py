"""What was aimed at, and what became of it: met, missed, or undecided where the 95 % interval holds the limit."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import intervals
from intervals import Interval
from results import Results

PLACEMENT = 48  # bytes of an instance as it comes: twelve floats


@dataclass(frozen=True)
class Goal:
    name: str
    goal: str
    measured: str
    verdict: str


def times(of: Interval, unit: str = "×") -> str:
    """1.23× (1.20 to 1.26)."""
    digits = 2 if of.value < 10 else 0
    value = f"{of.value:.{digits}f}{unit}"
    return value if of.low is None else f"{value} ({of.low:.{digits}f} to {of.high:.{digits}f})"


def yes(met: bool) -> str:
    return "met" if met else "missed"


def all_goals(results: Results) -> list[Goal]:
    found: list[Goal] = []
    for each in (
        side_by_side,
        forests,
        agreement,
        micropolygons,
        dice,
        fibres,
        rays,
        hair,
        networks,
        shaders,
        lights,
        lanes,
        tolerance,
        wavelengths,
        store,
        flight,
        oracle,
        budgets,
        kills,
        edits,
        isles,
        instances,
        moving,
        levels,
        nesting,
        ingest,
    ):
        found += each(results)
    return found


def side_by_side(results: Results) -> Iterator[Goal]:
    for scene, found in results.of("side-by-side"):
        ours, *others = found["renderers"]
        for theirs in others if scene in ("cornell", "terrain", "still-life") else ():
            for figure, title in (("render_s", "transport"), ("error_x_time", "error × time")):
                if figure in ours["rounds"] and figure in theirs["rounds"]:
                    ratio = intervals.of_ratio(ours["rounds"][figure], theirs["rounds"][figure])
                    yield Goal(f"{scene}: {title}, against {theirs['name']}", "< 1×", times(ratio), ratio.below(1))


def forests(results: Results) -> Iterator[Goal]:
    for scene, found in results.of("side-by-side"):
        ours, *others = found["renderers"]
        for theirs in others if scene.startswith("forest") else ():
            for figure, title in (
                ("first_picture_s", "first picture"),
                ("error_x_time", "error × time"),
                ("peak_bytes", "memory"),
            ):
                most = 0.8 if figure == "error_x_time" and theirs["name"] == "cycles" else 1
                ratio = intervals.of_ratio(ours["rounds"][figure], theirs["rounds"][figure])
                goal = f"{scene}: {title}, against {theirs['name']}"
                yield Goal(goal, f"< {most}×", times(ratio), ratio.below(most))


def agreement(results: Results) -> Iterator[Goal]:
    for scene, a in results.of("agreement"):
        where = f"{scene}: picture, against {a['peer']}"
        yield Goal(where, "means within 0.5 %", f"{100 * a['mean_error']:.2f} %", yes(a["mean_error"] <= 0.005))
        beyond = f"z {a['rms_z']:.2f} r.m.s., {100 * a['residual']:.2f} % beyond noise"
        yield Goal(where, "no structure", beyond, yes(not a["structure"]))


def micropolygons(results: Results) -> Iterator[Goal]:
    for _, m in results.of("micropolygons"):
        many = f"{m['micropolygons'] / 1e6:.1f} M micropolygons"
        built = intervals.of(m["rounds"]["build_s"]) if "rounds" in m else Interval(m["build_s"])
        yield Goal(f"{many}: dice, shade, build", "≤ 2 s", times(built, " s"), built.below(2))
        yield Goal(f"{many}: geometry and BVH", "≤ 30 bytes each", f"{m['bytes_each']:.1f}", yes(m["bytes_each"] <= 30))


def store(results: Results) -> Iterator[Goal]:
    for scene, f in results.of("store"):
        writing, first = Interval(**f["writing"]), Interval(**f["first_picture"])
        yield Goal(
            f"{scene}: until rays can be traced, while a store is filled", "≤ 1.10×", times(writing), writing.below(1.1)
        )
        if "hierarchy" in f:
            hierarchy = Interval(**f["hierarchy"])
            yield Goal(f"{scene}: building, with a filled store", "≤ 0.25×", times(hierarchy), hierarchy.below(0.25))
        if scene.startswith("shading"):
            yield Goal(f"{scene}: first picture, with a filled store", "≤ 0.1×", times(first), first.below(0.1))
        if "opened_s" not in f:
            continue
        if scene == "hierarchy":
            per_10_gb = intervals.of([1e10 / f["bytes"] * seconds for seconds in f["opened_s"]])
            yield Goal("opening a store, for 10 GB of it", "≤ 1 s", times(per_10_gb, " s"), per_10_gb.below(1))
        if scene == "two-lobes":
            each, part = f["lobe_bytes_each"], f["compressed_bytes"] / f["packs_bytes"]
            yield Goal("inputs of two lobes, a vertex", "≤ 12 bytes", f"{each:.1f}", yes(round(each, 1) <= 12))
            yield Goal("pages of two lobes, compressed", "≤ half", f"{part:.2f}×", yes(part <= 0.5))


def dice(results: Results) -> Iterator[Goal]:
    for _, found in results.of("dice"):
        for run in found["runs"]:
            if run["case"].startswith("subdivision"):
                rates = [rate / 1e6 for rate in run.get("rounds", {}).get("vertices_per_cpu_s", [])]
                rate = intervals.of(rates) if rates else Interval(run["vertices_per_cpu_s"] / 1e6)
                yield Goal(f"{run['case']}: dicing, a thread", "≥ 4 M vertices/s", times(rate, " M/s"), rate.above(4))


def fibres(results: Results) -> Iterator[Goal]:
    """Of pages beside Embree."""
    for scene, found in results.of("hierarchy"):
        if scene != "hair":
            continue
        for line in found["rays"]:
            fastest = max((Interval(**ratio) for ratio in line["against"].values()), key=lambda ratio: ratio.value)
            yield Goal(
                f"hair, {line['name']}: rays through pages, against Embree",
                "≤ 0.8×",
                times(fastest),
                fastest.below(0.8),
            )
        each = found["tracers"][0]["bytes_each"]
        yield Goal("hair: pages, positions included", "≤ 24 bytes a segment", f"{each:.1f}", yes(each <= 24))


def rays(results: Results) -> Iterator[Goal]:
    for kind, f in results.of("rays"):
        number = sum(f["rays"].values())
        leaks = sum(f["leaks"].values()) + sum(f["leaks_of_any"].values())
        yield Goal(f"{kind}: {number:,} rays from inside", "no leak", f"{leaks} leaks", yes(leaks == 0))
        wrong = f["embree_right"] + f["neither"]
        measured = f"{f['differ']:,} differ, wrong in {wrong}"
        yield Goal(f"{kind}: the same hits as Embree, or the right ones", "all", measured, yes(wrong == 0))


def hair(results: Results) -> Iterator[Goal]:
    for kind, run in results.of("hair"):
        name = f"{run['hairs'] / 1e6:g} M {kind} hairs: load, dice, trace"
        yield Goal(name, "≤ 6 GB", f"{run['peak_bytes'] / 1e9:.2f} GB", yes(run["peak_bytes"] <= 6e9))


NETWORK_GOALS = {16: 5, 100: 25, 1000: 100}


def networks(results: Results) -> Iterator[Goal]:
    for _, w in results.of("networks"):
        rounds, least = w["rounds"], NETWORK_GOALS[w["links"]]
        if "theirs_s" in rounds:
            faster = intervals.of_ratio(rounds["theirs_s"], rounds["ours_s"])
            name = f"chain of {w['links']}, all counted, against {w['peer']}"
            yield Goal(name, f"≥ {least}× faster", times(faster), faster.above(least))


def shaders(results: Results) -> Iterator[Goal]:
    """Sorted by what is compiled and what runs."""
    for _, s in results.of("shaders"):
        speed, arithmetic = s["network_evaluations_per_s"], s["arithmetic"]
        yield Goal("network of 1 000 nodes, a thread", "≥ 50 000 evaluations/s", f"{speed:,.0f}", yes(speed >= 50_000))
        for lanes_of, least in ((8, 4), (16, 6)):
            if wide := arithmetic.get(f"lanes{lanes_of}_ns"):
                gain = arithmetic["lanes1_ns"] / wide
                yield Goal(f"arithmetic, {lanes_of} lanes over one", f"≥ {least}×", f"{gain:.1f}×", yes(gain >= least))
        cost = (arithmetic.get("lanes16_ns") or arithmetic["lanes8_ns"]) / arithmetic["by_hand_ns"]
        yield Goal("arithmetic, time over C++ by hand", "≤ 1.3×", f"{cost:.2f}×", yes(cost <= 1.3))
        for c in (c for c in s["compile"] if c["nodes"] == 10_000):
            seconds, gib, ms = c["compile_s"], c["peak_bytes"] / 2**30, 1000 * c["cached_s"]
            yield Goal("10 000 nodes, cold compile", "≤ 60 s", f"{seconds:.1f} s", yes(seconds <= 60))
            yield Goal("10 000 nodes, peak memory", "≤ 4 GiB", f"{gib:.2f} GiB", yes(gib <= 4))
            yield Goal("10 000 nodes, from the cache", "≤ 20 ms", f"{ms:.0f} ms", yes(ms <= 20))
        if growth := s.get("growth"):
            yield Goal(
                "compile time, 1 000 to 10 000 nodes", "≤ n log n (13.3×)", f"{growth:.1f}×", yes(growth <= 13.34)
            )
        plain = 1000 * s["plain_compile_s"]
        yield Goal("a plain shader, cold compile", "≤ 50 ms", f"{plain:.0f} ms", yes(plain <= 50))


def lights(results: Results) -> Iterator[Goal]:
    for _, found in results.of("lights"):
        for run in (run for run in found["runs"] if run["count"] == 100_000):
            name, rounds = f"100 000 {run['lights']}", run.get("rounds", {}).get("slower")
            slower = intervals.of(rounds) if rounds else Interval(run["slower"])
            yield Goal(f"{name}: time a sample, against 10", "≤ 1.5×", times(slower), slower.below(1.5))
            quieter = f"{run['quieter']:.1f}×"
            yield Goal(f"{name}: noise, against uniform choice", "≥ 5× less", quieter, yes(run["quieter"] >= 5))


def lanes(results: Results) -> Iterator[Goal]:
    for _, found in results.of("lanes"):
        for run in found["runs"]:
            for lanes_of, least in ((8, 3.5), (16, 5)):
                fast = intervals.of_ratio(run["rounds"]["1"], run["rounds"][str(lanes_of)])
                name = f"surface stage, {run['material']}: {lanes_of} lanes"
                yield Goal(name, f"≥ {least}× one", times(fast), fast.above(least))


def tolerance(results: Results) -> Iterator[Goal]:
    for kind, t in results.of("tolerance"):
        measured = f"means {100 * t['mean_error']:.2f} % apart, z {t['rms_z']:.2f} r.m.s."
        yield Goal(f"{kind}: tolerance on and off", "same within noise", measured, yes(not t["structure"]))


def wavelengths(results: Results) -> Iterator[Goal]:
    for scene, w in results.of("wavelengths"):
        cost = intervals.of_ratio(w["rounds"]["four_s"], w["rounds"]["three_s"])
        yield Goal(f"{scene}: four wavelengths over three colours", "≤ 1.35×", times(cost), cost.below(1.35))


def flight(results: Results) -> Iterator[Goal]:
    for way, found in results.of("flight"):
        for name in ("alone", "shot"):
            f = found[name]
            ratio, error = f["ratio"], 2 * f["ratio_error"]
            variance = Interval(ratio, ratio - error, ratio + error)
            where = f"a flight, {way}, {name}: variance in time, over a fine reference's"
            yield Goal(where, "≤ 1.2×", times(variance), variance.below(1.2))


def oracle(results: Results) -> Iterator[Goal]:
    for _, f in results.of("oracle"):
        yield Goal(
            "a street, by an oracle: micropolygons, shaded at their vertices",
            "≤ 0.5×",
            f"{f['ratio']:.2f}×",
            yes(f["ratio"] <= 0.5),
        )
        same = f["agreement"]
        measured = f"z {same['rms_z']:.2f} r.m.s., means {same['mean_error']:.2%} apart"
        yield Goal("a street, by an oracle: picture", "no structure", measured, yes(not same["structure"]))


def budgets(results: Results) -> Iterator[Goal]:
    for _, f in results.of("budgets"):
        yield Goal(
            "budgets of memory: pictures", "the same bits", "the same" if f["same"] else "others", yes(f["same"])
        )


def kills(results: Results) -> Iterator[Goal]:
    for _, f in results.of("kills"):
        measured = f"{f['kills']} kills, {f['pictures']} pictures, {f['wrong']} with other bits"
        yield Goal(
            "killed at random moments", "100 kills, no other bits", measured, yes(f["kills"] >= 100 and not f["wrong"])
        )


def edits(results: Results) -> Iterator[Goal]:
    for which, f in results.of("edits"):
        if which == "places":
            moved = Interval(**f["edits"]["one of a million places"]["interval"])
            yield Goal("one of a million places moves: until rays", "≤ 0.3 s", times(moved, " s"), moved.below(0.3))


def isles(results: Results) -> Iterator[Goal]:
    for _, f in results.of("isles"):
        if f.get("scale") == 1:
            peak, each = f["peak_bytes"], f["bytes_each"]
            yield Goal("the island at scale 1: memory", "≤ 20 GB", f"{peak / 1e9:.1f} GB", yes(peak <= 20e9))
            yield Goal("the island at scale 1: an instance", "≤ 100 bytes", f"{each:.1f} bytes", yes(each <= 100))
    for name, f in results.of("isles"):
        if "kept_each" not in f or "scale" in f:
            continue
        of = name.split("-")[0]
        where = f"{f['rows']:,} instances ({of})"
        kept = f["kept_each"]
        yield Goal(f"{where}: a placement and its hierarchy", "≤ 100 bytes", f"{kept:.1f} bytes", yes(kept <= 100))
        if of == "pebbles":
            each = f["bytes_each"]
            yield Goal(f"{where}: at the peak", "≤ 100 bytes each", f"{each:.1f} bytes", yes(each <= 100))
            made = f["hierarchy_s"]
            yield Goal(f"{where}: the hierarchy is made", "≤ 0.3 s", f"{made:.2f} s", yes(made <= 0.3))


def instances(results: Results) -> Iterator[Goal]:
    for _, f in results.of("instances"):
        level = f["level"]
        where = f"{level['instances']:,} places of a page"
        built, kept = level["build_s"], PLACEMENT + level["bytes_each"]
        yield Goal(f"{where}: the level is made", "≤ 0.3 s", f"{built:.2f} s", yes(built <= 0.3))
        yield Goal(f"{where}: a placement and its hierarchy", "≤ 100 bytes", f"{kept:.1f} bytes", yes(kept <= 100))


def moving(results: Results) -> Iterator[Goal]:
    for scene, f in results.of("moving"):
        for rays in f["rays"]:
            over = Interval(**rays["over"]["pages"])
            what = f"{scene}: {rays['name']}, in pages, over what stands still"
            yield Goal(what, "≤ 1.50×", times(over), over.below(1.5))


def levels(results: Results) -> Iterator[Goal]:
    for view, f in results.of("levels"):
        where = f"levels of detail, {view}"
        geometry, tracing = Interval(**f["geometry_mb"]), Interval(**f["trace_cpu_s"])
        yield Goal(f"{where}: geometry, over none", "≤ 1.07×", times(geometry), geometry.below(1.07))
        yield Goal(f"{where}: tracing, over none", "< 1×", times(tracing), tracing.below(1))
        apart = f["means_apart"]
        yield Goal(f"{where}: picture", "means within 0.5 %", f"{100 * apart:.2f} %", yes(apart <= 0.005))


def nesting(results: Results) -> Iterator[Goal]:
    for tracer, f in results.of("nesting"):
        for depth, over in f["over"].items():
            each = Interval(**over).root(int(depth) - 1)
            what = f"{tracer}: samples of {f['places']:,} things {depth} groups deep, a group over one less"
            yield Goal(what, "≤ 1.10×", times(each), each.below(1.1))


def ingest(results: Results) -> Iterator[Goal]:
    for name, f in results.of("ingest"):
        seconds = Interval(**f["seconds"])
        yield Goal(f"{f['number']:,} {name} of USD are read", "≤ 1 s", times(seconds, " s"), seconds.below(1))
