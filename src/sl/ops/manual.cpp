#include "sl/ops/manual.h"

#include <cmath>
#include <cstdio>

#include "grid/lobe_schema.h"
#include "sl/ops/shadeops.h"

namespace kanuka::sl::ops {

static std::string number(float x) {
    if (std::isinf(x))
        return "∞";
    char text[32];
    std::snprintf(text, sizeof text, "%g", double(x));
    return text;
}

static constexpr const char* Kinds[] = {"reflection", "transmission", "reflection and transmission",
                                        "emission", "phase function"};

// The inputs of a lobe as a table.
static std::string lobe_inputs(const grid::LobeDecl& lobe) {
    std::string text;
    text += "| input | default | range | unit | is |\n|---|---|---|---|---|\n";
    for (const grid::LobeInput& in : lobe.inputs) {
        const bool color = in.type == grid::InputType::Color;
        std::string fallback = number(in.fallback.x);
        if (color && !(in.fallback.x == in.fallback.y && in.fallback.y == in.fallback.z))
            fallback += " " + number(in.fallback.y) + " " + number(in.fallback.z);
        text += "| `" + std::string(color ? "color " : "float ") + std::string(in.name) + "` | " + fallback +
                " | " + number(in.low) + " to " + number(in.high) + " | " + std::string(in.unit) + " | " +
                std::string(in.doc) + " |\n";
    }
    text += "\n";
    return text;
}

std::string lobes_manual() {
    std::string text;
    for (const grid::LobeDecl& lobe : grid::lobe_table())
        text += "**" + std::string(lobe.name) + "** (" + Kinds[int(lobe.kind)] +
                "): " + std::string(lobe.doc) + "\n\n" + lobe_inputs(lobe);
    return text;
}

std::string lobes_page() {
    std::string text =
        "# Lobes\n\n"
        "Every lobe of the shading language, made from `src/grid/lobe_schema.cpp`: run `kanuka_sl_test` "
        "with\n"
        "`KANUKA_WRITE_DOCS=1` after a change, and `tools/make_lobe_pictures.py` for the pictures. A shader "
        "adds a lobe\n"
        "to its boundary in `mnk_init` and gives its inputs at every vertex in `mnk_prelighting`\n"
        "([language.md](language.md)):\n\n"
        "    AddLobe(boundary, \"metal\", MetalBrdf(\"metal\", \"Cu\"));\n"
        "    SetLobe(boundary, \"metal\", 1, MetalBrdf(\"metal\", \"Cu\", \"roughness\", 0.2 + 0.3 * noise(8 "
        "* P)));\n\n"
        "Values out of range are clamped, and reported once. *Lossless*: with white colours all light comes "
        "back, at any\n"
        "roughness ([transport.md](transport.md) has figures). *Reciprocal*: the same with light and eye "
        "exchanged. Every\n"
        "lobe's sampling, density, energy and reciprocity are tested over the range of each of its inputs\n"
        "(`src/bsdf/lobes_test.cpp`). How a lobe works, and after whom, stands at its head in "
        "`src/bsdf/`.\n\n"
        "Smooth interfaces (roughness 0) are exact mirrors and lenses. Directions (`rotation`) count from "
        "dPdu, the way u\n"
        "grows. Phase functions say where light goes inside of a scattering interior (`AddPhaseFunction`, "
        "`SetPhaseFunction`;\n"
        "[transport.md](transport.md), \"Interiors\").\n\n"
        "**Coat or thick.** Both layers put a clear lobe over others and lose no light. Under `coat` a "
        "colour is "
        "what is seen\n"
        "of it: what the upper lobe reflects is taken from it, and that is all. It is for colours that were "
        "painted or\n"
        "measured on the finished surface (pictures of polished stone, networks of other renderers), and for "
        "any "
        "upper lobe:\n"
        "sheen over yarn, a gloss over hair. Under `thick` a colour is that of the bare thing below: light "
        "is bent, "
        "crosses the\n"
        "layer twice and is thrown back from its underside, so that colours are darker and deeper, as of wet "
        "things. "
        "It is for\n"
        "lacquer, glaze and varnish. Below an index of 1.5 white stays white, a grey of 0.5 reflects 0.26 by "
        "`thick` "
        "and 0.45 by\n"
        "`coat`, beside what the layer itself reflects. `thick` costs more, and bends light where the upper "
        "is a\n"
        "`MicrofacetDielectricBrdf`; over others it is a `coat`.\n\n";
    for (const grid::LobeDecl& lobe : grid::lobe_table()) {
        const std::string name(lobe.name);
        text += "## " + name + "\n\n" + std::string(lobe.doc) + ". " + Kinds[int(lobe.kind)];
        const bool scatters = lobe.kind != grid::LobeKind::Emission && lobe.kind != grid::LobeKind::Phase;
        if (scatters)
            text += std::string(lobe.lossless ? ", lossless" : "") + (lobe.reciprocal ? ", reciprocal" : "");
        text += ".\n\n";
        if (scatters || lobe.kind == grid::LobeKind::Emission)
            text += "![](images/lobes/" + name + ".png)\n\n";
        text += lobe_inputs(lobe);
    }
    text +=
        "## Oracles\n\n"
        "Every lobe is held against a transcription of its publication in double precision, written apart\n"
        "(`src/bsdf/oracles/`): over all directions, both sides, roughness from smooth to 1, indices from "
        "1.01 to 4,\n"
        "exponents to 100 000. *Off by*: the most, of the value or a thousandth of the lobe's largest; it is "
        "found where\n"
        "lobes are narrowest and single precision ends. Light that meets more than one facet is measured "
        "apart.\n\n"
        "<!-- oracles -->\n<!-- end -->\n";
    return text;
}

std::string globals_manual() {
    std::string text = "| variable | is | written |\n|---|---|---|\n";
    for (const Global& g : globals()) {
        ast::Type type;
        type.base = g.type;
        text += "| `" + type.str() + " " + std::string(g.name) + "` | " + std::string(g.doc) + " | " +
                (g.written ? "yes" : "") + " |\n";
    }
    return text + "\n";
}

std::string shadeops_index() {
    std::string text, category;
    for (const Shadeop& op : shadeops()) {
        if (op.name.starts_with("__"))
            continue;
        if (op.category != category) {
            text += (text.empty() ? "" : "\n") + std::string("| ") + op.category + " | |\n|---|---|\n";
            category = op.category;
        }
        text += "| `" + op.name + "` | " + op.doc + " |\n";
    }
    return text + "\n";
}

} // namespace kanuka::sl::ops
