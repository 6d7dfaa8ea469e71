#include "python/parameters.h"

namespace kanuka::python {

using scene::Kind;
using scene::ParameterInfo;

std::string annotation(const scene::ParameterInfo& p, bool read_back) {
    std::string one = p.kind == Kind::Flag       ? "bool"
                      : p.kind == Kind::Whole    ? "int"
                      : p.kind == Kind::Number   ? "float"
                      : p.spectrum && !read_back ? "Spectrum | str"
                      : p.file && !read_back     ? "str | os.PathLike"
                                                 : "str";
    if (p.optional) {
        ParameterInfo plain = p;
        plain.optional = false;
        return annotation(plain, read_back) + " | None";
    }
    if (p.count == 1)
        return one;
    if (p.count == 3 && p.kind == Kind::Number && !read_back) // a vector, a colour
        return "Sequence[float]" + std::string(p.spreads ? " | float" : "");
    if (p.count == 0)
        return (read_back ? "list[" : "Sequence[") + one + "]";
    std::string all = one;
    for (int i = 1; i < p.count; i++)
        all += ", " + one;
    return "tuple[" + all + "]";
}

scene::Setting setting(const scene::ParameterInfo& p, nb::handle value, const char* name) {
    scene::Setting s;
    if (p.optional && value.is_none())
        return s;
    const auto put = [&](nb::handle one) {
        if (p.kind == Kind::Flag)
            s.numbers.push_back(nb::cast<bool>(one));
        else if (p.kind == Kind::Whole)
            s.numbers.push_back(double(nb::cast<int64_t>(one)));
        else if (p.kind == Kind::Number)
            s.numbers.push_back(nb::cast<double>(one));
        else if (p.file)
            s.texts.push_back(nb::cast<std::filesystem::path>(one).string());
        else
            s.texts.push_back(p.spectrum ? spectrum_text(one, name) : nb::cast<std::string>(one));
    };
    const bool many = nb::isinstance<nb::sequence>(value) && !nb::isinstance<nb::str>(value);
    const bool alone = p.count == 1 || (p.spreads && !many);
    bool fits = alone || many;
    try {
        if (fits && alone)
            put(value);
        else if (fits)
            for (const nb::handle one : value)
                put(one);
    } catch (const nb::cast_error&) {
        fits = false;
    } catch (nb::python_error& error) { // an __index__ that raises; spectrum_text() names what is wrong
        if (p.spectrum)
            throw;
        fits = false;
    }
    if (!fits || (p.count > 0 && !alone && size_t(p.count) != s.numbers.size() + s.texts.size()))
        wrong_argument(name, annotation(p, false), value);
    if (const auto fault = p.refused(s)) {
        const std::string after = fault->substr(std::string_view(p.name).size());
        throw nb::value_error((name + after).c_str());
    }
    return s;
}

nb::object object_of(const scene::ParameterInfo& p, const scene::Setting& s) {
    if (p.optional && s.numbers.empty() && s.texts.empty())
        return nb::none();
    nb::list all;
    for (const double x : s.numbers)
        if (p.kind == Kind::Flag)
            all.append(x != 0);
        else if (p.kind == Kind::Whole)
            all.append(int64_t(x));
        else
            all.append(x);
    for (const std::string& text : s.texts)
        all.append(text);
    if (p.count == 1)
        return all[0];
    return p.count == 0 ? nb::object(all) : nb::object(nb::tuple(all));
}

nb::dict description(const scene::ParameterInfo& p, const scene::Setting& fallback) {
    nb::dict d;
    d["type"] = annotation(p, false);
    d["default"] = object_of(p, fallback);
    d["help"] = p.about;
    d["unit"] = p.unit;
    d["expected"] = p.expected();
    nb::list choices;
    for (const nb::handle choice : nb::str(p.choices).attr("split")())
        choices.append(choice);
    d["choices"] = choices;
    d["rib"] = nb::str(p.rib).attr("split")();
    d["flag"] = p.flag;
    d["since"] = p.since;
    return d;
}

} // namespace kanuka::python
