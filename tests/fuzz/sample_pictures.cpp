#include "sample_pictures.h"

#include <cstdint>

namespace kanuka::fuzz {

film::Picture sample_picture() {
    film::Picture p;
    p.width = 16, p.height = 8;
    for (const char* name : {"B", "G", "R"}) {
        film::Picture::Channel c{name, true, {}};
        for (int i = 0; i < p.width * p.height; i++)
            c.data.push_back(float((i * 7 + name[0]) % 11) / 10);
        p.channels.push_back(std::move(c));
    }
    return p;
}

static std::string little(uint32_t value, int bytes) {
    std::string out;
    for (int i = 0; i < bytes; i++)
        out += char(value >> (8 * i));
    return out;
}

std::string sample_bmp() {
    std::string out = "BM" + little(54 + 16 * 8 * 3, 4) + little(0, 4) + little(54, 4) + little(40, 4) +
                      little(16, 4) + little(8, 4) + little(1, 2) + little(24, 2) + std::string(24, '\0');
    for (int i = 0; i < 16 * 8 * 3; i++)
        out += char(i * 5);
    return out;
}

std::string sample_tiff() {
    std::string out = "II*" + std::string(1, '\0') + little(8, 4) + little(9, 2);
    const auto tag = [&](uint32_t id, uint32_t type, uint32_t count, uint32_t value) {
        out += little(id, 2) + little(type, 2) + little(count, 4) + little(value, 4);
    };
    tag(256, 3, 1, 16), tag(257, 3, 1, 8), tag(258, 3, 1, 8), tag(259, 3, 1, 1), tag(262, 3, 1, 1);
    tag(273, 4, 1, 122), tag(277, 3, 1, 1), tag(278, 3, 1, 8), tag(279, 4, 1, 128);
    out += little(0, 4);
    for (int i = 0; i < 128; i++)
        out += char(i * 2);
    return out;
}

} // namespace kanuka::fuzz
