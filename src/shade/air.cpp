#include "shade/air.h"

#include <algorithm>
#include <cmath>

#include "base/sampling.h"

namespace kanuka::shade {

namespace {

// As for a material; light is what gets there.
class AirServices final : public MaterialServices {
  public:
    AirServices(const Spaces& spaces, const Facts& facts, Textures& textures, Journal& journal,
                const Location& where, AirLights* lights)
        : MaterialServices(spaces, facts, textures, journal, where), m_lights(lights) {}
    int lights() override { return MaterialServices::lights() + (m_lights ? m_lights->wide() : 0); }
    void light(const sl::LightRequest& request) override {
        const int narrow = MaterialServices::lights();
        if (request.light < narrow) {
            const bool far = ask(request);
            if (m_lights)
                m_lights->dim(request, far);
            return;
        }
        sl::LightRequest wide = request;
        wide.light -= narrow;
        m_lights->ask(wide);
    }

  private:
    AirLights* m_lights;
};

grid::Channel channel(const char* name, const grid::Grid& g) {
    return {name, 3, g.stride, std::vector<float>(3 * size_t(g.stride) + 32, 0.0f)};
}

} // namespace

AirOfShader::AirOfShader(std::shared_ptr<const sl::Shader> shader, std::span<const sl::Argument> arguments,
                         const Spaces& spaces, const Facts& facts, Textures& textures, Journal& journal,
                         const Location& where, std::shared_ptr<const scene::Attributes> attributes)
    : m_spaces(spaces), m_facts(facts), m_attributes(std::move(attributes)), m_textures(textures),
      m_journal(journal), m_where(where), m_shader(std::move(shader)) {
    MaterialServices services(m_spaces, m_facts, m_textures, m_journal, m_where);
    m_instance = m_shader->instantiate(arguments, services);
}

// All ways for the first colour, then all for the next.
sl::Filtered AirOfShader::run(const grid::Ways& ways, std::span<const Rgb> shown, AirLights* lights) const {
    const size_t n = size_t(ways.count);
    grid::Grid g;
    g.allocate(std::max(int(n * shown.size()) - 1, 0), 0);
    grid::Channel eye = channel("E", g), color = channel("Cs", g);
    for (size_t k = 0; k < shown.size(); k++)
        for (int c = 0; c < 3; c++) {
            const size_t at = size_t(c) * size_t(g.stride) + k * n;
            std::copy_n(ways.to[c], n, g.P.begin() + ptrdiff_t(at));
            std::copy_n(ways.from[c], n, eye.data.begin() + ptrdiff_t(at));
            std::fill_n(color.data.begin() + ptrdiff_t(at), n, shown[k][c]);
        }
    // random() goes by the surface's parameters: each way has its own.
    for (size_t i = 0; i < n * shown.size(); i++)
        g.u[i] = to_unit(hash_bits(Int<1>(ways.seed[i % n])))[0];
    g.primvars = {std::move(eye), std::move(color)};
    AirServices services(m_spaces, m_facts, m_textures, m_journal, m_where, lights);
    sl::Filtered f = m_instance->filter(g, {}, services);
    // Components one after another, without what arrays are padded with.
    const size_t all = n * shown.size();
    for (size_t c = 1; c < 3; c++)
        std::copy_n(f.Ci.begin() + ptrdiff_t(c * size_t(g.stride)), all, f.Ci.begin() + ptrdiff_t(c * all));
    return f;
}

void AirOfShader::look(grid::Ways& ways, AirLights* lights) const {
    const size_t n = size_t(ways.count);
    const Rgb shown[] = {Rgb(0), Rgb(1)};
    const sl::Filtered f = run(ways, shown, lights);
    for (size_t c = 0; c < 3; c++)
        for (size_t i = 0; i < n; i++) {
            const float black = f.Ci[2 * c * n + i], filter = f.Ci[(2 * c + 1) * n + i] - black;
            ways.glow[c][i] = std::isfinite(black) ? std::max(black, 0.0f) : 0;
            ways.filter[c][i] = std::isfinite(filter) ? std::clamp(filter, 0.0f, 1.0f) : 0;
        }
}

void AirOfShader::check(grid::Ways& ways) const {
    const size_t n = size_t(ways.count);
    const Rgb between(0.2f, 0.5f, 0.7f), shown[] = {Rgb(0), Rgb(1), between};
    const sl::Filtered f = run(ways, shown, nullptr);
    for (size_t c = 0; c < 3; c++)
        for (size_t i = 0; i < n; i++) {
            const float* Ci = f.Ci.data() + 3 * c * n + i;
            const float a = Ci[0], b = Ci[n], expected = a + (b - a) * between[int(c)];
            if (std::abs(Ci[2 * n] - expected) <= 2e-3f * (std::abs(a) + std::abs(b)) + 1e-5f)
                continue;
            m_journal.warning(m_where, "volume shader \"" + m_shader->name() +
                                           "\" does more to Ci than scale its components and add to them; "
                                           "what it does to black and to white is taken for all colours");
            return;
        }
}

} // namespace kanuka::shade
