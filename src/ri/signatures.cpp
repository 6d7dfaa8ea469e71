#include "ri/signatures.h"

#include <algorithm>
#include <map>

namespace kanuka::ri {

namespace {

using ingest::ArgSpec;
using ingest::ArgType;
using ingest::RequestSpec;

// Not in C, or written by hand: they take functions, lists of numbers, or return what the table has not.
constexpr std::string_view ByHand[] = {"version",      "Declare",      "MotionBegin", "ReadArchive",
                                       "ArchiveBegin", "ErrorHandler", "Procedural",  "ArchiveRecord",
                                       "Procedural2",  "Option"};

// What the table does not tell: how long arrays are. `sum` and `sum_of_each` are in binding.h.
struct Exception {
    std::string_view request, parameters, vertices = "0";
};
constexpr Exception Exceptions[] = {
    {"Color", "RtColor color[samples()]"},
    {"Opacity", "RtColor color[samples()]"},
    {"ColorSamples", "RtInt n, RtFloat nRGB[3 * n], RtFloat RGBn[3 * n]"},
    {"PixelFilter", "RtFilterFunc filter, RtFloat xwidth, RtFloat ywidth"},
    {"MakeTexture",
     "RtString picture, RtString texture, RtToken swrap, RtToken twrap, RtFilterFunc filter, RtFloat swidth, "
     "RtFloat twidth"},
    {"MakeBump",
     "RtString picture, RtString texture, RtToken swrap, RtToken twrap, RtFilterFunc filter, RtFloat swidth, "
     "RtFloat twidth"},
    {"MakeLatLongEnvironment",
     "RtString picture, RtString texture, RtFilterFunc filter, RtFloat swidth, RtFloat twidth"},
    {"MakeCubeFaceEnvironment", "RtString px, RtString nx, RtString py, RtString ny, RtString pz, RtString "
                                "nz, RtString texture, RtFloat fov, RtFilterFunc "
                                "filter, RtFloat swidth, RtFloat twidth"},
    {"MakeOcclusion", "RtInt npictures, RtString* pictures[npictures], RtString texture"},
    {"MakeBrickMap", "RtInt nclouds, RtString* pointclouds[nclouds], RtString brickmap"},
    {"TrimCurve",
     "RtInt nloops, RtInt* ncurves[nloops], RtInt* order[sum(ncurves, nloops)], RtFloat* knot[sum(n, "
     "sum(ncurves, nloops)) + sum(order, sum(ncurves, nloops))], RtFloat* min[sum(ncurves, nloops)], "
     "RtFloat* "
     "max[sum(ncurves, nloops)], RtInt* n[sum(ncurves, nloops)], RtFloat* u[sum(n, sum(ncurves, nloops))], "
     "RtFloat* v[sum(n, sum(ncurves, nloops))], RtFloat* w[sum(n, sum(ncurves, nloops))]"},
    {"Hyperboloid", "RtPoint point1[3], RtPoint point2[3], RtFloat thetamax"},
    {"Quantize", "RtToken type, RtInt one, RtInt min, RtInt max, RtFloat dither"},
    {"Polygon", "RtInt nvertices", "nvertices"},
    {"GeneralPolygon", "RtInt nloops, RtInt* nverts[nloops]"},
    {"PointsPolygons", "RtInt npolys, RtInt* nverts[npolys], RtInt* verts[sum(nverts, npolys)]"},
    {"PointsGeneralPolygons",
     "RtInt npolys, RtInt* nloops[npolys], RtInt* nverts[sum(nloops, npolys)], RtInt* verts[sum(nverts, "
     "sum(nloops, npolys))]"},
    {"NuPatch",
     "RtInt nu, RtInt uorder, RtFloat* uknot[nu + uorder], RtFloat umin, RtFloat umax, RtInt nv, RtInt "
     "vorder, RtFloat* vknot[nv + vorder], RtFloat vmin, RtFloat vmax"},
    {"SubdivisionMesh",
     "RtToken scheme, RtInt nfaces, RtInt* nverts[nfaces], RtInt* verts[sum(nverts, nfaces)], RtInt ntags, "
     "RtToken* tags[ntags], RtInt* nargs[2 * ntags], RtInt* intargs[sum_of_each(nargs, ntags, 2, 0)], "
     "RtFloat* floatargs[sum_of_each(nargs, ntags, 2, 1)]"},
    {"HierarchicalSubdivisionMesh",
     "RtToken scheme, RtInt nfaces, RtInt* nverts[nfaces], RtInt* verts[sum(nverts, nfaces)], RtInt ntags, "
     "RtToken* tags[ntags], RtInt* nargs[3 * ntags], RtInt* intargs[sum_of_each(nargs, ntags, 3, 0)], "
     "RtFloat* floatargs[sum_of_each(nargs, ntags, 3, 1)], RtToken* stringargs[sum_of_each(nargs, ntags, 3, "
     "2)]"},
    {"Curves", "RtToken type, RtInt ncurves, RtInt* nvertices[ncurves], RtToken wrap"},
    {"Points", "RtInt npoints", "npoints"},
    {"Blobby",
     "RtInt nleaf, RtInt ncode, RtInt* code[ncode], RtInt nfloats, RtFloat* floats[nfloats], RtInt nstrings, "
     "RtString* strings[nstrings]",
     "nleaf"},
    {"Volume", "RtToken type, RtBound bound[6], RtInt* nvertices[3]"},
};

std::string_view trimmed(std::string_view s) {
    while (!s.empty() && s.front() == ' ')
        s.remove_prefix(1);
    while (!s.empty() && s.back() == ' ')
        s.remove_suffix(1);
    return s;
}

Parameter parse_parameter(std::string_view text) {
    Parameter p;
    text = trimmed(text);
    const size_t space = text.find(' '), bracket = text.find('[');
    p.type = text.substr(0, space);
    p.name = trimmed(text.substr(space, bracket == std::string_view::npos ? bracket : bracket - space));
    if (bracket != std::string_view::npos)
        p.length = text.substr(bracket + 1, text.size() - bracket - 2);
    return p;
}

std::vector<Parameter> parse_parameters(std::string_view text) {
    std::vector<Parameter> all;
    int depth = 0;
    size_t start = 0;
    for (size_t i = 0; i <= text.size(); i++) {
        if (i < text.size()) {
            depth += text[i] == '(' || text[i] == '[';
            depth -= text[i] == ')' || text[i] == ']';
        }
        if (i == text.size() || (text[i] == ',' && depth == 0)) {
            all.push_back(parse_parameter(text.substr(start, i - start)));
            start = i + 1;
        }
    }
    return all;
}

void derive(const ArgSpec& a, Signature& s) {
    const std::string name(a.name);
    const auto add = [&](const char* type, const std::string& n, const std::string& length = "") {
        s.parameters.push_back({type, n, length});
    };
    switch (a.type) {
    case ArgType::Float:
        return add("RtFloat", name);
    case ArgType::Integer:
        return add(name == "on" ? "RtBoolean" : "RtInt", name);
    case ArgType::String:
        return add("RtToken", name);
    case ArgType::Handle:
        return add(name == "light"    ? "RtLightHandle"
                   : name == "filter" ? "RtLightHandle"
                                      : "RtObjectHandle",
                   name);
    case ArgType::NewHandle:
        s.result = s.spec->params == ingest::Params::Shader ? "RtLightHandle" : "RtObjectHandle";
        return;
    case ArgType::BasisMatrix:
        return add("RtBasis", name, "16");
    case ArgType::Floats:
        if (a.count == 16)
            return add("RtMatrix", name, "16");
        if (name == "xmin xmax ymin ymax zmin zmax")
            return add("RtBound", "bound", "6");
        for (size_t at = 0; at < name.size();) {
            const size_t stop = std::min(name.find(' ', at), name.size());
            add("RtFloat", name.substr(at, stop - at));
            at = stop + 1;
        }
        return;
    default:
        // An array that no exception names: the test of ri.h finds it.
        add("RtArrayWithoutLength", name);
    }
}

} // namespace

std::vector<Signature> signatures() {
    std::vector<Signature> all;
    for (const RequestSpec& spec : ingest::requests()) {
        if (std::ranges::find(ByHand, spec.name) != std::end(ByHand))
            continue;
        Signature s{&spec, "RtVoid", {}};
        const auto* exception = std::ranges::find(Exceptions, spec.name, &Exception::request);
        if (exception != std::end(Exceptions)) {
            s.parameters = parse_parameters(exception->parameters);
            s.vertices = exception->vertices;
        } else {
            for (size_t i = 0; i < spec.arg_count(); i++)
                derive(spec.args[i], s);
        }
        all.push_back(std::move(s));
    }
    return all;
}

} // namespace kanuka::ri
