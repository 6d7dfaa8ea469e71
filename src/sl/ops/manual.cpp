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
        static constexpr const char* Types[] = {"float ", "color ", "normal "};
        const bool color = in.type == grid::InputType::Color;
        std::string fallback = number(in.fallback.x);
        if (color && !(in.fallback.x == in.fallback.y && in.fallback.y == in.fallback.z))
            fallback += " " + number(in.fallback.y) + " " + number(in.fallback.z);
        const bool bounded = in.type != grid::InputType::Normal;
        text += "| `" + std::string(Types[int(in.type)]) + std::string(in.name) + "` | " + fallback + " | " +
                (bounded ? number(in.low) + " to " + number(in.high) : "any") + " | " + std::string(in.unit) +
                " | " + std::string(in.doc) + (in.body ? "; *body*" : "") + " |\n";
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
        "This page is for shader writers. It answers: which lobes are there, what are their inputs and "
        "ranges, and how exact are\n"
        "they? It is made from `src/grid/lobe_table.h`: after a change run `kanuka_sl_test` with "
        "`KANUKA_WRITE_DOCS=1`, and\n"
        "`tools/make_lobe_pictures.py` for the pictures.\n\n"
        "A shader adds a lobe to its boundary in `mnk_init` and sets its inputs at every vertex in "
        "`mnk_prelighting`\n"
        "([language.md](language.md)):\n\n"
        "    AddLobe(boundary, \"metal\", MetalBrdf(\"metal\", \"Cu\"));\n"
        "    SetLobe(boundary, \"metal\", 1, MetalBrdf(\"metal\", \"Cu\", \"roughness\", 0.2 + 0.3 * noise(8 "
        "* P)));\n\n"
        "- Values out of range are clamped, and reported once.\n"
        "- *Lossless*: with white colours all light is reflected or transmitted, at any roughness\n"
        "  ([transport.md](transport.md#what-loses-light) has figures).\n"
        "- *Reciprocal*: the value does not change if the directions of light and view are exchanged.\n"
        "- Smooth interfaces (roughness 0) are exact mirrors and lenses.\n"
        "- *body*: the colour of the thing itself, which the tint of an [instance](instances.md) "
        "multiplies.\n"
        "- Angles of directions (`rotation`) are measured from dPdu, the direction in which u grows.\n"
        "- Phase functions describe scattering inside of an interior (`AddPhaseFunction`, "
        "`SetPhaseFunction`;\n"
        "  [transport.md](transport.md#interiors)).\n\n"
        "`src/bsdf/lobes_test.cpp` tests sampling, density, energy and reciprocity of every lobe over the "
        "range of each of its\n"
        "inputs. A comment at the head of each lobe in `src/bsdf/` says how it works, and cites its "
        "publication.\n\n"
        "**Coat or thick?** Both layers put a clear lobe over others and lose no light.\n\n"
        "- `coat`: a colour is the colour that is seen of the finished surface; only the reflection of the "
        "upper lobe is\n"
        "  subtracted. Use it for colours that were painted or measured on the finished surface (pictures of "
        "polished stone,\n"
        "  networks of other renderers), and for any upper lobe: sheen over yarn, a gloss over hair.\n"
        "- `thick`: a colour is that of the bare material below. Light is refracted, crosses the layer twice "
        "and is reflected by\n"
        "  its underside, so colours are darker and deeper, like those of wet objects. Use it for lacquer, "
        "glaze and varnish.\n"
        "  `thick` costs more. It refracts if the upper lobe is a `MicrofacetDielectricBrdf`; over others it "
        "is a `coat`.\n\n"
        "Below an index of 1.5 white stays white. A grey of 0.5 reflects 0.26 by `thick` and 0.45 by `coat`, "
        "beside the\n"
        "reflection of the layer itself.\n\n";
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
        "Every lobe is compared with a transcription of its publication in double precision, written "
        "separately\n"
        "(`src/bsdf/oracles/`): over all directions, both sides, roughness from smooth to 1, indices from "
        "1.01 to 4, exponents to\n"
        "100 000. *Off by*: the largest difference, relative to the value or to a thousandth of the lobe's "
        "largest value. It is\n"
        "found where lobes are narrowest and single precision ends. Multiple scattering is measured "
        "separately.\n\n"
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
