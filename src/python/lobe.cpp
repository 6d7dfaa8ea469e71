// Lobes by themselves: evaluated and sampled from scripts.
#include "bsdf/one_lobe.h"
#include "python/arguments.h"
#include "python/arrays.h"
#include "python/values.h"

namespace kanuka::python {

namespace {

using bsdf::OneLobe;

const grid::LobeDecl& lobe_named(const std::string& name) {
    const grid::LobeDecl* decl = grid::find_lobe(name);
    if (decl && OneLobe::is_of_surfaces(*decl))
        return *decl;
    std::string known;
    for (const grid::LobeDecl& d : grid::lobe_table())
        if (OneLobe::is_of_surfaces(d))
            known += (known.empty() ? "" : ", ") + std::string(d.name);
    throw nb::value_error(
        ("name: \"" + name + "\" is no lobe that scatters light at surfaces; those are " + known).c_str());
}

std::optional<Vec3f> input_value(const grid::LobeInput& input, nb::handle value) {
    const std::string name(input.name);
    if (nb::isinstance<nb::str>(value) && !input.names.empty()) {
        const auto text = nb::cast<std::string>(value);
        const auto found = std::ranges::find(input.names, text);
        if (found == input.names.end())
            throw nb::value_error((name + ": there is no \"" + text + "\"").c_str());
        return Vec3f(float(found - input.names.begin()), 0, 0);
    }
    if (input.type == grid::InputType::Color)
        return rgb(value, name.c_str());
    return Vec3f(argument<float>(value, name.c_str()), 0, 0);
}

OneLobe make(const std::string& name, const nb::kwargs& given) {
    const grid::LobeDecl& decl = lobe_named(name);
    std::vector<std::optional<Vec3f>> inputs(decl.inputs.size());
    for (auto [key, value] : given) {
        const auto input = nb::cast<std::string>(key);
        const int at = grid::find_input(decl, input);
        if (at < 0 || decl.inputs[size_t(at)].type == grid::InputType::Normal) { // a lobe stands on +z here
            std::string known;
            for (const grid::LobeInput& i : decl.inputs)
                if (i.type != grid::InputType::Normal)
                    known += (known.empty() ? "" : ", ") + std::string(i.name);
            throw nb::type_error((name + " has no input " + input + "; it has " + known).c_str());
        }
        inputs[size_t(at)] = input_value(decl.inputs[size_t(at)], value);
    }
    return {decl.id, std::move(inputs)};
}

// (N, 3), one direction for all where there is one.
std::vector<Vec3f> rows(nb::handle value, const char* name) {
    const FloatArray array = float_array(value, name);
    const size_t d = array.shape.size();
    if (d < 1 || d > 2 || array.shape[d - 1] != 3 || array.buffer.empty())
        throw nb::value_error(
            (std::string(name) + ": expected shape (3,) or (N, 3); got " + shape_text(array.shape)).c_str());
    std::vector<Vec3f> all(array.buffer.size() / 3);
    for (size_t i = 0; i < all.size(); i++)
        all[i] = {array.buffer[3 * i], array.buffer[3 * i + 1], array.buffer[3 * i + 2]};
    return all;
}
std::vector<Vec3f> directions(nb::handle value, const char* name) {
    std::vector<Vec3f> all = rows(value, name);
    for (Vec3f& w : all) {
        const float size = length(w);
        if (!(size > 0) || !(size < std::numeric_limits<float>::infinity()))
            throw nb::value_error((std::string(name) + ": a direction has a length").c_str());
        w = w / size;
    }
    return all;
}
void spread(std::vector<Vec3f>& a, std::vector<Vec3f>& b, const char* names) {
    if (a.size() == 1)
        a.resize(b.size(), a[0]);
    if (b.size() == 1)
        b.resize(a.size(), b[0]);
    if (a.size() != b.size())
        throw nb::value_error(
            (std::string(names) + ": expected as many rows of both, or one of either").c_str());
}
nb::object array_of(const std::vector<Vec3f>& v) {
    return python::array_of(&v[0].x, {v.size(), 3});
}
nb::object flags_of(const std::vector<uint8_t>& v) {
    return python::array_of(v.data(), {v.size()}).attr("astype")("bool");
}

} // namespace

void bind_lobe(nb::module_& m) {
    nb::class_<OneLobe> lobe(
        m, "Lobe",
        "A lobe of the shading language by itself: Lobe('MicrofacetConductorBrdf', roughness=0.3).\n\n"
        "Inputs are those of docs/lobes.md, colours as three numbers. Directions are (3,) or (N, 3), in the "
        "frame "
        "of\nthe surface: its normal is +z, and they point away from it. Colours are taken as they are; "
        "films and\n"
        "dispersion are seen at 610, 550 and 465 nm.");
    define(
        lobe, "__init__",
        [](OneLobe* self, const std::string& name, const nb::kwargs& inputs) {
            new (self) OneLobe(make(name, inputs));
        },
        nb::arg("name"), nb::arg("inputs"),
        nb::sig("def __init__(self, name: str, **inputs: object) -> None"));
    lobe.def_prop_ro("name", [](const OneLobe& l) { return std::string(grid::lobe(l.id()).name); });
    lobe.def("__repr__",
             [](const OneLobe& l) { return "kanuka.Lobe('" + std::string(grid::lobe(l.id()).name) + "')"; });
    define(
        lobe, "evaluate",
        [](const OneLobe& l, nb::handle wo, nb::handle wi) {
            std::vector<Vec3f> out = directions(wo, "wo"), in = directions(wi, "wi");
            spread(out, in, "wo, wi");
            std::vector<Vec3f> value(out.size());
            std::vector<float> pdf(out.size());
            l.evaluate(out, in, {value, pdf});
            return nb::make_tuple(array_of(value), python::array_of(pdf.data(), {pdf.size()}));
        },
        nb::arg("wo"), nb::arg("wi"),
        nb::sig(
            "def evaluate(self, wo: ArrayLike, wi: ArrayLike) -> tuple[numpy.typing.NDArray[numpy.float32], "
            "numpy.typing.NDArray[numpy.float32]]"),
        "(N, 3) of f |cos wi|, and (N,) of the density of sample(), in 1/sr. Single directions have none.");
    define(
        lobe, "sample",
        [](const OneLobe& l, nb::handle wo, nb::handle u) {
            std::vector<Vec3f> out = directions(wo, "wo"), random = rows(u, "u");
            spread(out, random, "wo, u");
            for (const Vec3f& r : random)
                if (!(min(min(r.x, r.y), r.z) >= 0 && max(max(r.x, r.y), r.z) < 1))
                    throw nb::value_error("u: expected numbers from 0 to below 1");
            const size_t n = out.size();
            std::vector<Vec3f> value(n), wi(n);
            std::vector<float> pdf(n);
            std::vector<uint8_t> valid(n), delta(n);
            l.sample(out, random, {{value, pdf}, wi, valid, delta});
            nb::dict result;
            result["wi"] = array_of(wi);
            result["value"] = array_of(value);
            result["pdf"] = python::array_of(pdf.data(), {n});
            result["valid"] = flags_of(valid);
            result["delta"] = flags_of(delta);
            return result;
        },
        nb::arg("wo"), nb::arg("u"),
        nb::sig("def sample(self, wo: ArrayLike, u: ArrayLike) -> dict[str, numpy.typing.NDArray]"),
        "Directions drawn by the numbers `u`, (N, 3) from 0 to 1: 'wi' (N, 3), 'value' (f |cos wi|), 'pdf', "
        "'valid' "
        "(or\nabsorbed) and 'delta' (a single direction: value / pdf alone has a meaning).");
    define(
        lobe, "albedo",
        [](const OneLobe& l, nb::handle wo) {
            const std::vector<Vec3f> out = directions(wo, "wo");
            std::vector<Vec3f> albedo(out.size());
            l.albedo(out, albedo);
            return array_of(albedo);
        },
        nb::arg("wo"), nb::sig("def albedo(self, wo: ArrayLike) -> numpy.typing.NDArray[numpy.float32]"),
        "(N, 3): the fraction of light from there that is scattered, as layers and sampling estimate it.");
    m.def(
        "lobe_names",
        [] {
            nb::list names;
            for (const grid::LobeDecl& d : grid::lobe_table())
                if (OneLobe::is_of_surfaces(d))
                    names.append(nb::str(d.name.data(), d.name.size()));
            return names;
        },
        nb::sig("def lobe_names() -> list[str]"), "What Lobe() takes.");
}

} // namespace kanuka::python
