#include "render/pixel_filter.h"

#include <string>

namespace kanuka::render {

std::unique_ptr<film::Filter> make_filter(const scene::Options& options, const Location& where,
                                          Journal& journal) {
    const float* width = options.filter_width;
    const scene::Value* values = options.user.find("pixelfilter:values");
    const scene::Value* cells = options.user.find("pixelfilter:cells");
    const bool has_table = values && cells && cells->ints.size() == 2;
    try {
        if (options.filter != "table")
            return std::make_unique<film::Filter>(options.filter, width[0], width[1]);
        if (!has_table)
            throw Error("the pixel filter \"table\" needs Option \"pixelfilter\" \"float[n] values\" and "
                        "\"integer[2] cells\"");
        return std::make_unique<film::Filter>(std::span(values->floats.data(), values->floats.size()),
                                              cells->ints[0], cells->ints[1], width[0], width[1]);
    } catch (const Error& e) {
        const scene::Value* asked = options.user.find("pixelfilter:name");
        journal.error(options.filter == "table" && values ? values->where
                      : asked                             ? asked->where
                                                          : where,
                      std::string(e.what()) + "; gaussian 2 2 is used");
        return std::make_unique<film::Filter>("gaussian", 2.0f, 2.0f);
    }
}

} // namespace kanuka::render
