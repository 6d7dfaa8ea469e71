#include "render/pixel_filter.h"

#include <string>

namespace kanuka::render {

std::unique_ptr<film::Filter> make_filter(const scene::Options& options, const Location& where,
                                          Journal& journal) {
    const float* width = options.filter_width;
    try {
        if (options.filter != "table")
            return std::make_unique<film::Filter>(options.filter, width[0], width[1]);
        if (options.filter_values.empty() || options.filter_cells[0] < 1 || options.filter_cells[1] < 1)
            throw Error("the pixel filter \"table\" needs Option \"pixelfilter\" \"float[n] values\" and "
                        "\"integer[2] cells\"");
        return std::make_unique<film::Filter>(options.filter_values, options.filter_cells[0],
                                              options.filter_cells[1], width[0], width[1]);
    } catch (const Error& e) {
        journal.error(options.filter_where.line > 0 ? options.filter_where : where,
                      std::string(e.what()) + "; gaussian 2 2 is used");
        return std::make_unique<film::Filter>("gaussian", 2.0f, 2.0f);
    }
}

} // namespace kanuka::render
