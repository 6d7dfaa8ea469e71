// An image reader that hands out sRGB-encoded pictures as linear light, so that texture filters work on
// light.
#pragma once

#include <OpenImageIO/imageio.h>

#include "shade/picture_space.h"

namespace kanuka::shade {

// Stands between OpenImageIO's cache and the file's own reader. Pictures of 8 or 16 bits with three or more
// channels whose colour space is sRGB leave as linear half floats (alpha untouched); all others pass as they
// are. Pictures of one or two channels are heights, masks and the like: data, not colours.
class LinearInput final : public OIIO::ImageInput {
  public:
    // An OIIO::ImageInput::Creator. One file in two spaces is two to a cache: it knows each by name_of().
    template <PictureSpace space>
    static OIIO::ImageInput* create() {
        return new LinearInput(space);
    }
    static std::string name_of(const std::string& path, PictureSpace space);

    explicit LinearInput(PictureSpace space = PictureSpace::Auto) : m_space(space) {}

    const char* format_name() const override { return "linear"; }
    int supports(OIIO::string_view feature) const override { return m_file ? m_file->supports(feature) : 0; }
    bool open(const std::string& name, OIIO::ImageSpec& spec) override;
    bool open(const std::string& name, OIIO::ImageSpec& spec, const OIIO::ImageSpec& config) override;
    bool close() override;
    int current_subimage() const override { return m_file ? m_file->current_subimage() : 0; }
    int current_miplevel() const override { return m_file ? m_file->current_miplevel() : 0; }
    bool seek_subimage(int subimage, int miplevel) override;
    bool read_native_scanline(int subimage, int miplevel, int y, int z, void* data) override;
    bool read_native_tile(int subimage, int miplevel, int x, int y, int z, void* data) override;

  private:
    bool pass(bool success);            // hands on the file reader's error message
    bool fits(const std::string& name); // false: what its header claims cannot be so
    void take_spec();
    void decode(const unsigned char* from, size_t pixels, void* to) const;

    PictureSpace m_space;
    std::unique_ptr<OIIO::ImageInput> m_file;
    std::string m_name;
    bool m_decodes = false;
    std::vector<unsigned char> m_buffer;
};

bool is_srgb(const OIIO::ImageSpec& spec);

} // namespace kanuka::shade
