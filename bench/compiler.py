"""The shader compiler and what it makes: times, bytes, and the same maths by hand (kanuka_shader_bench)."""

from __future__ import annotations

import json
import math
import statistics
import subprocess
import tempfile
from pathlib import Path

import shader_graphs
from settings import ROOT, Found, Say, Settings, built

NODES = (1_000, 4_000, 10_000)
PLAIN = ROOT / "shaders" / "plastic.sl"


def measure(settings: Settings, say: Say) -> Found:
    program = built("kanuka_shader_bench", "sl")

    def bench(*arguments: object) -> Found:
        done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, check=True)
        return json.loads(done.stdout)

    seconds, repeats = (0.1, 1) if settings.quick else (0.5, min(settings.rounds, 5))
    found: Found = {"arithmetic": bench("--arithmetic"), "compile": []}
    a = found["arithmetic"]
    say(f"  arithmetic: {', '.join(f'{name} {value:.1f}' for name, value in a.items())}")
    with tempfile.TemporaryDirectory() as folder:
        times = [bench(PLAIN, "--cache", f"{folder}/plain{k}", "--seconds", 0) for k in range(repeats)]
        found["plain_compile_s"] = statistics.median(t["compile_s"] for t in times)
        for nodes in NODES[: 1 if settings.quick else None]:
            path = Path(folder) / f"graph{nodes}.sl"
            shader_graphs.random_graph(nodes).save_shader(path)
            cold = [
                bench(path, "--cache", f"{folder}/{nodes}-{k}", "--seconds", 0 if k else seconds)
                for k in range(min(repeats, 3))
            ]
            warm = [bench(path, "--cache", f"{folder}/{nodes}-0", "--seconds", 0) for _ in range(repeats)]
            if not all(run["from_cache"] for run in warm):
                raise RuntimeError(f"the cache did not hold the shader of {nodes} nodes")
            entry = {
                "nodes": nodes,
                "lines": len(path.read_text().splitlines()),
                "compile_s": statistics.median(run["compile_s"] for run in cold),
                "cached_s": statistics.median(run["compile_s"] for run in warm),
                "peak_bytes": max(run["peak_bytes"] for run in cold),
                "vertex_ns": cold[0]["vertex_ns"],
            }
            found["compile"].append(entry)
            say(
                f"  {nodes} nodes: {entry['lines']} lines, {entry['compile_s']:.2f} s cold, "
                f"{1000 * entry['cached_s']:.1f} ms cached, "
                f"{entry['peak_bytes'] / 1e6:.0f} MB, {entry['vertex_ns'] / 1000:.2f} µs a vertex"
            )
    by_nodes = {entry["nodes"]: entry for entry in found["compile"]}
    found["network_evaluations_per_s"] = 1e9 / by_nodes[1_000]["vertex_ns"]
    if 10_000 in by_nodes:
        found["growth"] = by_nodes[10_000]["compile_s"] / by_nodes[1_000]["compile_s"]
        found["n_log_n"] = 10 * math.log(10_000) / math.log(1_000)
    return found
