// The values of an instance's parameters.
#include <algorithm>

#include "sl/shader.h"

namespace kanuka::sl {

// Default values, before anything is bound.
void InstanceImpl::set_defaults() {
    const ir::Program& p = m_shader->program();
    m_params.assign(size_t(p.floats) + 16, 0.0f);
    m_param_texts.assign(size_t(p.strings) + 1, "");
    m_variant.params.assign(p.parameters.size(), false);
    m_primvars.resize(p.parameters.size());
    for (size_t i = 0; i < p.parameters.size(); i++)
        m_primvars[i] = p.parameters[i].name;
    for (size_t i = 0; i < p.parameters.size(); i++) {
        const ir::Place& place = p.places[i];
        if (place.text)
            set_texts(place, p.parameters[i].strings);
        else
            set_floats(place, p.parameters[i].floats);
        if (place.length >= 0)
            m_params[size_t(place.length)] =
                p.parameters[i].resizable ? float(p.parameters[i].array_size) : 0;
    }
}

void InstanceImpl::set_texts(const ir::Place& place, const std::vector<std::string>& values) {
    for (size_t k = 0; k < values.size(); k++)
        m_param_texts[size_t(place.offset) + k] = m_texts.emplace_back(values[k]).c_str();
}

void InstanceImpl::set_floats(const ir::Place& place, const std::vector<float>& values) {
    std::copy(values.begin(), values.end(), m_params.begin() + place.offset);
}

// What is wrong with an argument for the parameter of this index; empty = it is bound.
std::string InstanceImpl::bind_parameter(const Argument& a, size_t index) {
    const Parameter& parameter = m_shader->program().parameters[index];
    const ir::Place& place = m_shader->program().places[index];
    if (a.varying) { // a uniform parameter too: it has a value a face
        m_variant.params[index] = true;
        m_primvars[index] = a.name.substr(a.name.rfind('.') + 1); // of a co-shader: without its handle
        if (place.length >= 0)
            m_params[size_t(place.length)] = 1;
    } else if (parameter.resizable) {
        const size_t given = place.text ? a.strings.size() : a.floats.size();
        const int per = place.count / std::max(ir::ResizableRoom, parameter.array_size);
        if (given > size_t(place.count) || given % size_t(per) != 0)
            return "array \"" + a.name + "\" takes up to " + std::to_string(place.count / per) +
                   " elements of " + std::to_string(per) + " values, found " + std::to_string(given) +
                   " values";
        set_texts(place, a.strings);
        set_floats(place, a.floats);
        const size_t elements = given / size_t(per);
        m_params[size_t(place.length)] = float(elements);
    } else if (place.text) {
        if (int(a.strings.size()) != place.count)
            return "parameter \"" + a.name + "\" takes " + std::to_string(place.count) + " strings, found " +
                   std::to_string(a.strings.size());
        set_texts(place, a.strings);
    } else if (int(a.floats.size()) == place.count) {
        if (place.length >= 0)
            m_params[size_t(place.length)] = 1;
        set_floats(place, a.floats);
    } else if (a.floats.size() == 1 && place.count == 3) {
        std::fill_n(m_params.begin() + place.offset, 3, a.floats[0]);
    } else {
        return "parameter \"" + a.name + "\" takes " + std::to_string(place.count) + " floats, found " +
               std::to_string(a.floats.size());
    }
    return {};
}

void InstanceImpl::bind(std::span<const Argument> arguments, Services& services) {
    const ir::Program& p = m_shader->program();
    const bool first = m_params.empty();
    if (first)
        set_defaults();
    for (const Argument& a : arguments) {
        if (a.name == "Cs" || a.name == "Os") {
            if (a.varying)
                (a.name == "Cs" ? m_variant.Cs : m_variant.Os) = true;
            else if (a.name == "Os" && a.floats.size() >= 3)
                m_opacity = Vec3f(a.floats[0], a.floats[1], a.floats[2]);
            continue;
        }
        const auto end = p.parameters.end() - p.carried;
        const auto it =
            std::find_if(p.parameters.begin(), end, [&](const Parameter& q) { return q.name == a.name; });
        std::string wrong;
        if (it == end) {
            std::string have;
            for (auto q = p.parameters.begin(); q != end; ++q)
                have += (have.empty() ? "" : ", ") + q->name;
            wrong = "shader \"" + p.name + "\" has no parameter \"" + a.name + "\"; it has " +
                    (have.empty() ? "none" : have);
        } else {
            wrong = bind_parameter(a, size_t(it - p.parameters.begin()));
        }
        if (first && !wrong.empty())
            services.report(Severity::Warning, {p.name}, wrong);
    }
}

} // namespace kanuka::sl
