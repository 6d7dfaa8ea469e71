#include "grid/lobe_schema.h"

#include "grid/lobe_table.h"

namespace kanuka::grid {

std::span<const LobeDecl> lobe_table() {
    return schema::table;
}

const LobeDecl& lobe(LobeId id) {
    return schema::table[int(id)];
}

const LobeDecl* find_lobe(std::string_view name) {
    for (const LobeDecl& d : schema::table)
        if (d.name == name)
            return &d;
    return nullptr;
}

int find_input(const LobeDecl& lobe, std::string_view name) {
    for (size_t i = 0; i < lobe.inputs.size(); i++)
        if (lobe.inputs[i].name == name)
            return int(i);
    return -1;
}

} // namespace kanuka::grid
