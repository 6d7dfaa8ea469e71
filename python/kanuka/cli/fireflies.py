"""What --fireflies prints: single samples that make a picture noisy, and where they come from."""

from __future__ import annotations


def describe(stats: dict) -> str:
    """Lines of text from Picture.stats."""
    count, worst = stats["count"]["fireflies"], stats["fireflies"]
    if not count:
        return "no sample is 16 times as bright as its pixel's mean before it"
    lines = [f"{count} samples are 16 times as bright as their pixels' means before them; the worst:"]
    for each in worst:
        x, y = each["pixel"]
        times = each["luminance"] / max(each["mean"], 1e-6)
        lines.append(
            f"pixel {x},{y} sample {each['progression']}: luminance {each['luminance']:.3g}, "
            f"{times:.0f} times the mean of {each['mean']:.3g}"
        )
        lines += [f"  {place}" for place in _places(each["path"])]
    return "\n".join(lines)


def _places(path: list[dict]) -> list[str]:
    found = []
    for number, vertex in enumerate(path, 1):
        if not vertex["object"]:
            found.append(f"{number}. leaves the scene{_light('lights hit', vertex['lights_hit'])}")
            continue
        words = [f"{number}. {vertex['object']}, {vertex['distance']:.4g} away"]
        if vertex["lobe"]:
            way = "smooth, " if vertex["smooth"] else ""
            words.append(f"{vertex['lobe']} ({way}{'through' if vertex['through'] else 'reflected'})")
        else:
            words.append("ends")
        found.append(
            ": ".join(words)
            + _light("lights hit", vertex["lights_hit"])
            + _light("emission", vertex["emitted"])
            + _light("light samples", vertex["light_samples"])
        )
    return found


def _light(what: str, radiance: float) -> str:
    return f"; {what} {radiance:.3g}" if radiance else ""
