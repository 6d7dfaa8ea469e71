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

std::string lobes_manual() {
    static constexpr const char* Kinds[] = {"reflection", "transmission", "reflection and transmission",
                                            "emission", "phase function"};
    std::string text;
    for (const grid::LobeDecl& lobe : grid::lobe_table()) {
        text += "**" + std::string(lobe.name) + "** (" + Kinds[int(lobe.kind)] +
                "): " + std::string(lobe.doc) + "\n\n";
        text += "| input | default | range | unit | is |\n|---|---|---|---|---|\n";
        for (const grid::LobeInput& in : lobe.inputs) {
            const bool color = in.type == grid::InputType::Color;
            std::string fallback = number(in.fallback.x);
            if (color && !(in.fallback.x == in.fallback.y && in.fallback.y == in.fallback.z))
                fallback += " " + number(in.fallback.y) + " " + number(in.fallback.z);
            text += "| `" + std::string(color ? "color " : "float ") + std::string(in.name) + "` | " +
                    fallback + " | " + number(in.low) + " to " + number(in.high) + " | " +
                    std::string(in.unit) + " | " + std::string(in.doc) + " |\n";
        }
        text += "\n";
    }
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
