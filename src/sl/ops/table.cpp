#include "sl/ops/table.h"

namespace kanuka::sl::ops {

namespace {

using ir::CallKind;
using ir::Closure;
using ir::Fn;
using ir::Op;

constexpr Row prim(std::string_view category, std::string_view header, Op op, std::string_view doc = {},
                   int imm = 0) {
    return {category, header, Impl::Primitive, op, imm, {}, doc};
}
constexpr Row math(std::string_view header, Fn fn, std::string_view doc = {}) {
    return {"Mathematics", header, Impl::Primitive, fn >= Fn::Pow ? Op::Math2 : Op::Math1, int(fn), {}, doc};
}
constexpr Row rsl(std::string_view category, std::string_view header, std::string_view source,
                  std::string_view doc = {}) {
    return {category, header, Impl::Source, Op::Const, 0, source, doc};
}
constexpr Row special(std::string_view category, std::string_view header, Special what,
                      std::string_view doc = {}, int imm = 0) {
    return {category, header, Impl::Special, Op::Const, imm, {}, doc, what};
}
constexpr Row special(std::string_view category, std::string_view header, Special what, CallKind kind,
                      std::string_view doc = {}) {
    return special(category, header, what, doc, int(kind));
}
constexpr Row query(std::string_view header, Query::Kind kind, std::string_view doc = {}) {
    return special("Information", header, Special::Query, doc, int(kind));
}
// Asks for what is not there: its arguments are evaluated, and it gives 0.
constexpr Row absent(std::string_view category, std::string_view header, std::string_view doc = {}) {
    return special(category, header, Special::Absent, doc);
}
// In surfaces it does something else to directions of light and view than to other values.
constexpr Row optical(Optics rule, Row row) {
    row.optics = rule;
    return row;
}
constexpr Row closure(std::string_view header, Closure kind, std::string_view doc = {}) {
    return {"Light", header, Impl::Closure, Op::Closure, int(kind), {}, doc};
}
constexpr Row noise(std::string_view header, NoiseKind kind, std::string_view doc = {}) {
    return {"Noise", header, Impl::Noise, Op::Noise, int(kind), {}, doc};
}

constexpr std::string_view M = "Mathematics", G = "Geometry", C = "Colour", X = "Matrices", S = "Strings",
                           D = "Derivatives", K = "Material", T = "Textures", I = "Information", A = "Arrays",
                           O = "Co-shaders", L = "Light";

const Row table[] = {
    // ---- mathematics
    // --------------------------------------------------------------------------------------------------
    rsl(M, "float radians(float degrees)", "return degrees * (PI / 180);", "degrees to radians"),
    rsl(M, "float degrees(float radians)", "return radians * (180 / PI);", "radians to degrees"),
    math("float sin(float x)", Fn::Sin, "sine of an angle in radians"),
    math("float cos(float x)", Fn::Cos, "cosine of an angle in radians"),
    math("float tan(float x)", Fn::Tan, "tangent of an angle in radians"),
    rsl(M, "float asin(float x)", "return __asin(clamp(x, -1, 1));",
        "arc sine; the argument is clamped to [-1, 1]"),
    rsl(M, "float acos(float x)", "return __acos(clamp(x, -1, 1));",
        "arc cosine; the argument is clamped to [-1, 1]"),
    math("float __asin(float x)", Fn::Asin),
    math("float __acos(float x)", Fn::Acos),
    math("float atan(float yoverx)", Fn::Atan,
         "arc tangent; with two arguments, of y/x over the whole circle"),
    math("float atan(float y, float x)", Fn::Atan2),
    optical(Optics::Exponential, math("float exp(float x)", Fn::Exp, "e to the power of x")),
    math("float log(float x)", Fn::Log, "natural logarithm, or that to a base; 0 where x is not positive"),
    rsl(M, "float log(float x, float base)", "return log(x) / log(base);"),
    optical(Optics::Power,
            math("T pow(T x, T y)", Fn::Pow,
                 "x to the power of y, component by component; 0 where x is negative and y not whole")),
    prim(M, "T sqrt(T x)", Op::Sqrt, "square root; 0 for negative arguments"),
    rsl(M, "float inversesqrt(float x)", "return x > 0 ? 1 / sqrt(x) : 0;",
        "1 / sqrt(x); 0 where x is not positive"),
    rsl(M, "float mod(float a, float b)", "return b == 0 ? 0 : a - b * floor(a / b);",
        "a modulo b, of the sign of b"),
    rsl(M, "T mod(T a, T b)",
        "return T(mod(comp(a, 0), comp(b, 0)), mod(comp(a, 1), comp(b, 1)), mod(comp(a, 2), comp(b, 2)));"),
    optical(Optics::Limit, prim(M, "T abs(T x)", Op::Abs, "absolute value, of each component")),
    rsl(M, "float sign(float x)", "return x < 0 ? -1 : (x > 0 ? 1 : 0);", "-1, 0 or 1"),
    rsl(M, "T sign(T x)", "return T(sign(comp(x, 0)), sign(comp(x, 1)), sign(comp(x, 2)));"),
    prim(M, "T floor(T x)", Op::Floor, "largest whole number that is not above x"),
    prim(M, "T ceil(T x)", Op::Ceil, "smallest whole number that is not below x"),
    rsl(M, "T round(T x)", "return floor(x + 0.5);", "nearest whole number"),
    prim(M, "T min(T a, T b, ...)", Op::Min, "smallest of the arguments, component by component"),
    optical(Optics::Limit,
            prim(M, "T max(T a, T b, ...)", Op::Max, "largest of the arguments, component by component")),
    optical(Optics::Limit, rsl(M, "T clamp(T x, T low, T high)", "return max(min(x, high), low);",
                               "x limited to [low, high]; low, if that is above high")),
    rsl(M, "T mix(T a, T b, float t)", "return a * (1 - t) + b * t;", "linear interpolation from a to b"),
    rsl(M, "color mix(color a, color b, color t)", "return a * (color(1) - t) + b * t;"),
    rsl(M, "V mix(V a, V b, V t)", "return a * (V(1) - t) + b * t;"),
    rsl(M, "float step(float edge, float x)", "return x < edge ? 0 : 1;",
        "0 below the edge, 1 from there on"),
    rsl(M, "T step(T edge, T x)",
        "return T(step(comp(edge, 0), comp(x, 0)), step(comp(edge, 1), comp(x, 1)), step(comp(edge, 2), "
        "comp(x, "
        "2)));"),
    optical(Optics::SmoothStep, rsl(M, "float smoothstep(float low, float high, float x)",
                                    "if (low == high) return x < low ? 0 : 1; float t = clamp((x - low) / "
                                    "(high - low), 0, 1); return t "
                                    "* t * (3 - 2 * t);",
                                    "0 up to low, 1 from high on, a smooth cubic between them")),
    rsl(M, "T smoothstep(T low, T high, T x)",
        "return T(smoothstep(comp(low, 0), comp(high, 0), comp(x, 0)), smoothstep(comp(low, 1), comp(high, "
        "1), "
        "comp(x, 1)), smoothstep(comp(low, 2), comp(high, 2), comp(x, 2)));"),
    rsl(M, "float linearstep(float low, float high, float x)",
        "if (low == high) return x < low ? 0 : 1; return clamp((x - low) / (high - low), 0, 1);",
        "0 up to low, 1 from high on, linear between them"),
    rsl(M, "float filterstep(float edge, float x, ...)",
        "float w = max(filterwidth(x), 1e-6); return clamp((x + w * 0.5 - edge) / w, 0, 1);",
        "step(), averaged over the width of a micropolygon"),
    rsl(M, "float filterstep(float edge, float x0, float x1, ...)",
        "float w = max(abs(x1 - x0), 1e-6); return clamp((max(x0, x1) - edge) / w, 0, 1);"),
    special(
        M, "T spline(float x, T first, ...)", Special::Spline,
        "spline through the values, x from 0 to 1: Catmull-Rom, or the basis named first (bezier, bspline, "
        "catmull-rom, hermite, linear); values may be an array. With \"solve\" before the basis' name: where "
        "the spline has the value x"),
    special(M, "T spline(string basis, float x, T first, ...)", Special::Spline),
    special(M, "T spline(float x, T values[])", Special::Spline),
    special(M, "T spline(string basis, float x, T values[])", Special::Spline),
    // ---- noise
    // --------------------------------------------------------------------------------------------------------
    noise("float noise(float x)", NoiseKind::Noise,
          "gradient noise in [0, 1] of one to four dimensions; float, color, "
          "point, vector by cast or context"),
    noise("float noise(float x, float y)", NoiseKind::Noise),
    noise("float noise(point p)", NoiseKind::Noise),
    noise("float noise(point p, float t)", NoiseKind::Noise),
    noise("T noise(float x)", NoiseKind::Noise),
    noise("T noise(float x, float y)", NoiseKind::Noise),
    noise("T noise(point p)", NoiseKind::Noise),
    noise("T noise(point p, float t)", NoiseKind::Noise),
    noise("T noise(float x, float y, float z)", NoiseKind::Noise),
    noise("T noise(float x, float y, float z, float t)", NoiseKind::Noise),
    noise("T snoise(float x)", NoiseKind::SignedNoise, "noise() in [-1, 1]"),
    noise("T snoise(float x, float y)", NoiseKind::SignedNoise),
    noise("T snoise(point p)", NoiseKind::SignedNoise),
    noise("T snoise(point p, float t)", NoiseKind::SignedNoise),
    noise("T snoise(float x, float y, float z)", NoiseKind::SignedNoise),
    noise("T snoise(float x, float y, float z, float t)", NoiseKind::SignedNoise),
    noise("T cellnoise(float x)", NoiseKind::CellNoise, "a random value in [0, 1] for each unit cell"),
    noise("T cellnoise(float x, float y)", NoiseKind::CellNoise),
    noise("T cellnoise(point p)", NoiseKind::CellNoise),
    noise("T cellnoise(point p, float t)", NoiseKind::CellNoise),
    noise("T cellnoise(float x, float y, float z)", NoiseKind::CellNoise),
    noise("T cellnoise(float x, float y, float z, float t)", NoiseKind::CellNoise),
    noise("T pnoise(float x, float period)", NoiseKind::PeriodicNoise, "noise() that repeats"),
    noise("T pnoise(float x, float y, float xperiod, float yperiod)", NoiseKind::PeriodicNoise),
    noise("T pnoise(point p, point period)", NoiseKind::PeriodicNoise),
    noise("T pnoise(point p, float t, point period, float tperiod)", NoiseKind::PeriodicNoise),
    special("Noise", "T random()", Special::Random,
            "a random value in [0, 1), another one at each call and vertex"),
    rsl("Noise", "T __random(float call)",
        "return T cellnoise(point(u * 16777.0, v * 16777.0, call), s * 9973.0 + t * 313.0);"),
    // ---- geometry
    // -----------------------------------------------------------------------------------------------------
    prim(G, "float xcomp(V p)", Op::Extract, "first component", 0),
    prim(G, "float ycomp(V p)", Op::Extract, "second component", 1),
    prim(G, "float zcomp(V p)", Op::Extract, "third component", 2),
    rsl(G, "void setxcomp(output V p, float x)", "p = V(x, ycomp(p), zcomp(p));", "set the first component"),
    rsl(G, "void setycomp(output V p, float y)", "p = V(xcomp(p), y, zcomp(p));", "set the second component"),
    rsl(G, "void setzcomp(output V p, float z)", "p = V(xcomp(p), ycomp(p), z);", "set the third component"),
    optical(Optics::Length, rsl(G, "float length(vector v)", "return sqrt(v . v);", "length of a vector")),
    rsl(G, "float distance(point a, point b)", "return length(a - b);", "distance of two points"),
    optical(Optics::Normalize, rsl(G, "V normalize(V v)", "return v * inversesqrt(v . v);",
                                   "unit vector of the same direction; 0 stays 0")),
    optical(Optics::FaceForward,
            rsl(G, "vector faceforward(vector n, vector i, ...)", "return i . n > 0 ? -n : n;",
                "n turned against i. Of the view direction, n as it is: lobes have two sides")),
    rsl(G, "normal faceforward(normal n, vector i, ...)", "return i . n > 0 ? -n : n;"),
    rsl(G, "normal shadingnormal(normal n)", "return normalize(n);",
        "the unit normal: lobes have two sides, so it need not be turned"),
    optical(Optics::Reflect, rsl(G, "vector reflect(vector i, vector n)", "return i - n * (2 * (i . n));",
                                 "direction of mirror reflection of i at a surface of unit normal n")),
    optical(Optics::Refract, rsl(G, "vector refract(vector i, vector n, float eta)",
                                 "float c = i . n; float k = 1 - eta * eta * (1 - c * c);"
                                 "return k < 0 ? vector(0) : i * eta - n * (eta * c + sqrt(max(k, 0)));",
                                 "direction of refraction of unit i, eta = index outside / inside; 0 at "
                                 "total internal reflection")),
    optical(
        Optics::Fresnel,
        rsl(G, "void fresnel(vector i, vector n, float eta, output float kr, output float kt)",
            "float c = clamp(-(i . n), 0, 1); float g2 = 1 / (eta * eta) - 1 + c * c;"
            "if (g2 <= 0) { kr = 1; } else { float g = sqrt(g2); float a = (g - c) / (g + c);"
            "float b = (c * (g + c) - 1) / (c * (g - c) + 1); kr = 0.5 * a * a * (1 + b * b); } kt = 1 - kr;",
            "reflected and refracted parts of light at a dielectric surface, and their directions")),
    rsl(G,
        "void fresnel(vector i, vector n, float eta, output float kr, output float kt, output vector r, "
        "output vector t)",
        "fresnel(i, n, eta, kr, kt); r = reflect(i, n); t = refract(i, n, eta);"),
    rsl(G, "float ptlined(point q, point a, point b)",
        "vector d = b - a; float l = d . d; float t = l > 0 ? clamp(((q - a) . d) / l, 0, 1) : 0;"
        "return length(q - (a + d * t));",
        "distance of a point from a line segment"),
    rsl(G, "normal bump(string file, normal n, vector dpds, vector dpdt, ...)",
        "float h = texture(file); return n + ((n ^ dpdt) * Du(h) - (n ^ dpds) * Dv(h)) * inversesqrt(n . n);",
        "the normal of a surface that a texture raises (Blinn 1978)"),
    rsl(G, "V rotate(V q, float angle, point a, point b)",
        "vector k = normalize(b - a); vector d = vector(q) - vector(a); float c = cos(angle);"
        "return V(vector(a) + d * c + (k ^ d) * sin(angle) + k * ((k . d) * (1 - c)));",
        "q turned about the line from a to b, by an angle in radians (Rodrigues)"),
    rsl(G, "float depth(point p)",
        "uniform float planes[2] = {0, 1}; option(\"Clipping\", planes);"
        "return (zcomp(transform(\"camera\", p)) - planes[0]) / (planes[1] - planes[0]);",
        "distance from the camera's plane: 0 on the near clipping plane, 1 on the far one"),
    rsl(G, "point transform(string to, point p)", "return transform(\"current\", to, p);",
        "a point's coordinates in another space"),
    rsl(G, "point transform(string from, string to, point p)", "return transform(__space(from, to), p);"),
    rsl(G, "point transform(matrix m, point p)",
        "float x = xcomp(p), y = ycomp(p), z = zcomp(p);"
        "float w = x * comp(m, 0, 3) + y * comp(m, 1, 3) + z * comp(m, 2, 3) + comp(m, 3, 3);"
        "point q = point(x * comp(m, 0, 0) + y * comp(m, 1, 0) + z * comp(m, 2, 0) + comp(m, 3, 0),"
        "x * comp(m, 0, 1) + y * comp(m, 1, 1) + z * comp(m, 2, 1) + comp(m, 3, 1),"
        "x * comp(m, 0, 2) + y * comp(m, 1, 2) + z * comp(m, 2, 2) + comp(m, 3, 2));"
        "return w == 1 || w == 0 ? q : q / w;"),
    rsl(G, "point transform(string from, matrix m, point p)",
        "return transform(m, transform(from, \"current\", p));"),
    optical(Optics::TransformVector,
            rsl(G, "vector vtransform(string to, vector v)", "return vtransform(\"current\", to, v);",
                "a direction's components in another space")),
    rsl(G, "vector vtransform(string from, string to, vector v)", "return vtransform(__space(from, to), v);"),
    rsl(G, "vector vtransform(matrix m, vector v)",
        "float x = xcomp(v), y = ycomp(v), z = zcomp(v);"
        "return vector(x * comp(m, 0, 0) + y * comp(m, 1, 0) + z * comp(m, 2, 0),"
        "x * comp(m, 0, 1) + y * comp(m, 1, 1) + z * comp(m, 2, 1),"
        "x * comp(m, 0, 2) + y * comp(m, 1, 2) + z * comp(m, 2, 2));"),
    rsl(G, "vector vtransform(string from, matrix m, vector v)",
        "return vtransform(m, vtransform(from, \"current\", v));"),
    rsl(G, "normal ntransform(string to, normal n)", "return ntransform(\"current\", to, n);",
        "a normal's components in another space"),
    // Normals go with the transposed inverse: the columns of the matrix the other way.
    rsl(G, "normal ntransform(string from, string to, normal n)",
        "return __ntransform(__space(to, from), n);"),
    rsl(G, "normal ntransform(matrix m, normal n)", "return __ntransform(1 / m, n);"),
    rsl(G, "normal ntransform(string from, matrix m, normal n)",
        "return ntransform(m, ntransform(from, \"current\", n));"),
    rsl(G, "normal __ntransform(matrix inverse, normal n)",
        "float x = xcomp(n), y = ycomp(n), z = zcomp(n);"
        "return normal(x * comp(inverse, 0, 0) + y * comp(inverse, 0, 1) + z * comp(inverse, 0, 2),"
        "x * comp(inverse, 1, 0) + y * comp(inverse, 1, 1) + z * comp(inverse, 1, 2),"
        "x * comp(inverse, 2, 0) + y * comp(inverse, 2, 1) + z * comp(inverse, 2, 2));"),
    special(G, "matrix __space(string from, string to)", Special::Space),
    // ---- derivatives
    // --------------------------------------------------------------------------------------------------
    special(D, "T __dx(T x)", Special::Difference, CallKind::Dx),
    special(D, "T __dy(T x)", Special::Difference, CallKind::Dy),
    rsl(D, "float Du(float x)", "return __dx(x) / __safe(__dx(u));", "derivative by u"),
    rsl(D, "color Du(color x)", "return __dx(x) / __safe(__dx(u));"),
    rsl(D, "vector Du(point x)", "return vector(__dx(x)) / __safe(__dx(u));"),
    rsl(D, "vector Du(vector x)", "return __dx(x) / __safe(__dx(u));"),
    rsl(D, "float Dv(float x)", "return __dy(x) / __safe(__dy(v));", "derivative by v"),
    rsl(D, "color Dv(color x)", "return __dy(x) / __safe(__dy(v));"),
    rsl(D, "vector Dv(point x)", "return vector(__dy(x)) / __safe(__dy(v));"),
    rsl(D, "vector Dv(vector x)", "return __dy(x) / __safe(__dy(v));"),
    rsl(D, "float Deriv(float y, float x)",
        "return __quotient(__dx(y), __dx(x)) + __quotient(__dy(y), __dy(x));",
        "derivative of the first argument by the second (RISpec: by the chain rule, along u and along v)"),
    rsl(D, "color Deriv(color y, float x)",
        "float a = __dx(x), b = __dy(x); return (a == 0 ? color(0) : __dx(y) / a) + (b == 0 ? color(0) : "
        "__dy(y) / b);"),
    rsl(D, "vector Deriv(point y, float x)",
        "float a = __dx(x), b = __dy(x);"
        "return (a == 0 ? vector(0) : vector(__dx(y)) / a) + (b == 0 ? vector(0) : vector(__dy(y)) / b);"),
    rsl(D, "float __safe(float x)", "return x == 0 ? 1 : x;"),
    rsl(D, "float __quotient(float a, float b)", "return b == 0 ? 0 : a / b;"),
    rsl(D, "float area(point p, ...)", "return length(vector(__dx(p)) ^ vector(__dy(p)));",
        "area of a micropolygon of the surface p"),
    rsl(D, "float filterwidth(float x)", "return max(abs(__dx(x)), abs(__dy(x)));",
        "how much x changes from one vertex to the next"),
    rsl(D, "float filterwidthp(point p)", "return sqrt(area(p));", "filterwidth() of a point"),
    special(D, "normal calculatenormal(point p)", Special::CalculateNormal,
            "normal of the surface whose points are p; not unit length"),
    // ---- colour
    // -------------------------------------------------------------------------------------------------------
    special(C, "float comp(color c, float index)", Special::Component, "a component of a colour or matrix"),
    special(C, "float comp(V c, float index)", Special::Component),
    special(C, "float comp(matrix m, float row, float column)", Special::Component),
    special(C, "void setcomp(output color c, float index, float value)", Special::SetComponent,
            "set a component of a colour or matrix"),
    special(C, "void setcomp(output V c, float index, float value)", Special::SetComponent),
    special(C, "void setcomp(output matrix m, float row, float column, float value)", Special::SetComponent),
    rsl(C, "float luminance(color c)",
        "return 0.2126 * comp(c, 0) + 0.7152 * comp(c, 1) + 0.0722 * comp(c, 2);",
        "luminance of a colour of Rec. 709 primaries"),
    rsl(C, "color ctransform(string to, color c)", "return ctransform(\"rgb\", to, c);",
        "a colour's components in another space: rgb, hsv, hsl, xyz, xyY, yiq"),
    rsl(C, "color ctransform(string from, string to, color c)",
        "color r = c;"
        "if (from == \"hsv\") r = __hsv_to_rgb(c); else if (from == \"hsl\") r = __hsl_to_rgb(c);"
        "else if (from == \"xyz\" || from == \"XYZ\") r = __xyz_to_rgb(c);"
        "else if (from == \"xyY\") { float k = comp(c, 1) > 0 ? comp(c, 2) / comp(c, 1) : 0;"
        "r = __xyz_to_rgb(color(comp(c, 0) * k, comp(c, 2), (1 - comp(c, 0) - comp(c, 1)) * k)); }"
        "else if (from == \"yiq\" || from == \"YIQ\") r = __yiq_to_rgb(c);"
        "else if (from != \"rgb\" && from != \"RGB\" && from != \"current\") __report(\"unknown colour "
        "space\", from);"
        "if (to == \"hsv\") r = __rgb_to_hsv(r); else if (to == \"hsl\") r = __rgb_to_hsl(r);"
        "else if (to == \"xyz\" || to == \"XYZ\") r = __rgb_to_xyz(r);"
        "else if (to == \"xyY\") { color x = __rgb_to_xyz(r); float k = comp(x, 0) + comp(x, 1) + comp(x, 2);"
        "r = k > 0 ? color(comp(x, 0) / k, comp(x, 1) / k, comp(x, 1)) : color(0); }"
        "else if (to == \"yiq\" || to == \"YIQ\") r = __rgb_to_yiq(r);"
        "else if (to != \"rgb\" && to != \"RGB\" && to != \"current\") __report(\"unknown colour space\", "
        "to);"
        "return r;"),
    special(C, "void __report(string message, string value)", Special::Host, CallKind::Report),
    rsl(C, "float __hue(float h, float low, float high)",
        "float k = mod(h, 1) * 6; return k < 1 ? low + (high - low) * k : k < 3 ? high : k < 4 ? low + (high "
        "- low) * (4 - k) : low;"),
    rsl(C, "color __hsv_to_rgb(color c)",
        "float h = comp(c, 0), high = comp(c, 2), low = high * (1 - comp(c, 1));"
        "return color(__hue(h + 1 / 3, low, high), __hue(h, low, high), __hue(h - 1 / 3, low, high));"),
    rsl(C, "color __hsl_to_rgb(color c)",
        "float h = comp(c, 0), l = comp(c, 2); float d = comp(c, 1) * (l < 0.5 ? l : 1 - l);"
        "return color(__hue(h + 1 / 3, l - d, l + d), __hue(h, l - d, l + d), __hue(h - 1 / 3, l - d, l + "
        "d));"),
    rsl(C, "float __hue_of(color c, float high, float d)",
        "float r = comp(c, 0), g = comp(c, 1), b = comp(c, 2);"
        "if (d <= 0) return 0; float h = high == r ? (g - b) / d : high == g ? 2 + (b - r) / d : 4 + (r - g) "
        "/ d;"
        "return mod(h / 6, 1);"),
    rsl(C, "color __rgb_to_hsv(color c)",
        "float high = max(comp(c, 0), comp(c, 1), comp(c, 2)), d = high - min(comp(c, 0), comp(c, 1), "
        "comp(c, 2));"
        "return color(__hue_of(c, high, d), high > 0 ? d / high : 0, high);"),
    rsl(C, "color __rgb_to_hsl(color c)",
        "float high = max(comp(c, 0), comp(c, 1), comp(c, 2)), low = min(comp(c, 0), comp(c, 1), comp(c, 2));"
        "float d = high - low, l = 0.5 * (high + low), q = l < 0.5 ? high + low : 2 - high - low;"
        "return color(__hue_of(c, high, d), q > 0 ? d / q : 0, l);"),
    // Rec. 709 primaries, D65 white (ITU-R BT.709).
    rsl(C, "color __rgb_to_xyz(color c)",
        "float r = comp(c, 0), g = comp(c, 1), b = comp(c, 2); return color(0.4123908 * r + 0.3575843 * g + "
        "0.1804808 * b,"
        "0.2126390 * r + 0.7151687 * g + 0.0721923 * b, 0.0193308 * r + 0.1191948 * g + 0.9505322 * b);"),
    rsl(C, "color __xyz_to_rgb(color c)",
        "float x = comp(c, 0), y = comp(c, 1), z = comp(c, 2); return color(3.2409699 * x - 1.5373832 * y - "
        "0.4986108 * z,"
        "-0.9692436 * x + 1.8759675 * y + 0.0415551 * z, 0.0556301 * x - 0.2039770 * y + 1.0569715 * z);"),
    rsl(C, "color __rgb_to_yiq(color c)",
        "float r = comp(c, 0), g = comp(c, 1), b = comp(c, 2); return color(0.299 * r + 0.587 * g + 0.114 * "
        "b,"
        "0.5959 * r - 0.2746 * g - 0.3213 * b, 0.2115 * r - 0.5227 * g + 0.3112 * b);"),
    rsl(C, "color __yiq_to_rgb(color c)",
        "float y = comp(c, 0), i = comp(c, 1), q = comp(c, 2); return color(1.0000000 * y + 0.9560502 * i + "
        "0.6207549 * q,"
        "1.0000000 * y - 0.2720523 * i - 0.6472057 * q, 1.0000000 * y - 1.1067043 * i + 1.7044213 * q);"),
    // ---- matrices
    // -----------------------------------------------------------------------------------------------------
    special(X, "float determinant(matrix m)", Special::Determinant, "determinant"),
    rsl(X, "matrix translate(matrix m, vector t)",
        "return matrix(1,0,0,0, 0,1,0,0, 0,0,1,0, xcomp(t), ycomp(t), zcomp(t), 1) * m;",
        "m with a translation before it (row vectors)"),
    rsl(X, "matrix scale(matrix m, point s)",
        "return matrix(xcomp(s),0,0,0, 0,ycomp(s),0,0, 0,0,zcomp(s),0, 0,0,0,1) * m;",
        "m with a scaling before it"),
    rsl(X, "matrix rotate(matrix m, float angle, vector axis)",
        "vector k = normalize(axis); float x = xcomp(k), y = ycomp(k), z = zcomp(k), c = cos(angle), s = "
        "sin(angle), d = 1 - c;"
        "return matrix(c + x * x * d, x * y * d + z * s, x * z * d - y * s, 0,"
        "x * y * d - z * s, c + y * y * d, y * z * d + x * s, 0,"
        "x * z * d + y * s, y * z * d - x * s, c + z * z * d, 0, 0, 0, 0, 1) * m;",
        "m with a rotation before it, by an angle in radians"),
    rsl(X, "matrix mtransform(string to, matrix m)", "return __space(to, \"current\") * m;",
        "the matrix as seen from another space"),
    rsl(X, "matrix mtransform(string from, string to, matrix m)", "return __space(to, from) * m;"),
    // ---- strings
    // ------------------------------------------------------------------------------------------------------
    special(S, "string format(string pattern, ...)", Special::Host, CallKind::Format,
            "text with %f %c %p %m %s %d replaced by the arguments"),
    special(S, "string concat(string a, string b, ...)", Special::Host, CallKind::Concat,
            "the strings joined"),
    special(S, "float match(string pattern, string subject)", Special::Host, CallKind::Match,
            "1 if the regular expression is found in the subject"),
    special(S, "void printf(string pattern, ...)", Special::Host, CallKind::Printf,
            "a message to the journal, as format() makes it"),
    // ---- textures
    // -----------------------------------------------------------------------------------------------------
    special(T, "float texture(string name, ...)", Special::Texture,
            "a texture at (s, t), filtered over the distance to the next vertices. Forms: texture(name), "
            "(name, s, t), "
            "(name, s1, t1, … s4, t4); name[channel] picks the first channel. Named: blur, sblur, tblur, "
            "width, swidth, "
            "twidth, fill, wrap, filter, colorspace (\"raw\": data; \"srgb\"; else as the picture says)"),
    special(T, "color texture(string name, ...)", Special::Texture),
    special(
        T, "float environment(string name, vector direction, ...)", Special::Environment,
        "an environment map in a direction. Of a mirrored view direction: the picture as the dicing camera "
        "sees it, where there is one, else a mirror lobe"),
    special(T, "color environment(string name, vector direction, ...)", Special::Environment),
    special(T, "float environment(string name, void region, ...)", Special::Environment),
    special(T, "color environment(string name, void region, ...)", Special::Environment),
    absent(T, "float shadow(string name, point p, ...)", "0: shadows are traced"),
    absent(T, "color shadow(string name, point p, ...)"),
    // ---- light: what becomes of it in a surface's material
    // ----------------------------------------------------------------------------------------------
    closure("color ambient(...)", Closure::Ambient,
            "light of ambient sources, without shadows; seen by the camera and in mirrors"),
    closure("color diffuse(normal n, ...)", Closure::Diffuse, "a Lambert lobe"),
    closure("color specular(normal n, vector v, float roughness, ...)", Closure::Specular,
            "a highlight; Blinn's exponent is 8 / roughness, as PRMan has it, or, where it is asked for, "
            "RISpec's 1 / roughness"),
    closure("color phong(normal n, vector v, float size, ...)", Closure::Phong,
            "a highlight of Phong's exponent"),
    closure("color subsurface(...)", Closure::Diffuse, "a Lambert lobe: light leaves where it enters"),
    closure(
        "color trace(vector r, ...)", Closure::Mirror,
        "light along a mirrored or refracted view direction: a smooth lobe; along a direction that does "
        "not depend on the view: AimedBsdf, from the surface. As a float the distance to what is seen: 1e10"),
    closure("color trace(point p, vector r, ...)", Closure::Mirror),
    rsl(L, "float trace(point p, vector r, ...)", "return 1e10;"),
    optical(Optics::SpecularBrdf, rsl(L, "color specularbrdf(vector l, normal n, vector v, float roughness)",
                                      "vector h = normalize(normalize(l) + normalize(v));"
                                      "return color(pow(max(0, n . h), 8 / max(roughness, 0.0001)));",
                                      "the kernel of specular(), within illuminance: a highlight")),
    rsl(L, "color __blinn(vector l, normal n, vector v, float exponent)",
        "return color(pow(max(0, n . normalize(normalize(l) + normalize(v))), exponent));"),
    rsl(L, "color bsdf(vector l, normal n, ...)", "return color(max(0, normalize(l) . n) / PI);",
        "within illuminance, of any model: a Lambert lobe"),
    rsl(L, "vector __light_direction(vector axis, float low, float i, float rings)",
        "vector a = normalize(axis);"
        "vector t = normalize((abs(xcomp(a)) > 0.5 ? vector(0, 1, 0) : vector(1, 0, 0)) ^ a);"
        "float ring = floor(i / 2); float z = low + (1 - low) * (ring + 0.5) / rings;"
        "float phi = 2.39996323 * ring + PI * (i - 2 * ring); float r = sqrt(max(1 - z * z, 0));"
        "return a * z + (t * cos(phi) + (a ^ t) * sin(phi)) * r;"),
    // Light that transport finds; a surface adds none to it.
    optical(Optics::Occlusion,
            rsl(L, "float occlusion(point p, normal n, ...)", "return 0;", "0: transport occludes")),
    rsl(L, "float occlusion(string file, point p, normal n, ...)", "return 0;"),
    closure("color indirectdiffuse(...)", Closure::Indirect,
            "nothing: transport finds indirect light by the Lambert lobe of diffuse(), or else by one of its "
            "own"),
    closure("color indirect(...)", Closure::Indirect, "as indirectdiffuse()"),
    closure("color irradiance(...)", Closure::Indirect, "as indirectdiffuse()"),
    closure("color photonmap(string file, ...)", Closure::Indirect,
            "as indirectdiffuse(): transport finds caustics"),
    closure("color caustic(...)", Closure::Indirect, "as indirectdiffuse(): transport finds caustics"),
    rsl(L, "color transmission(point from, point to, ...)", "return color(1);",
        "1: transport traces what lies between"),
    rsl(L, "color visibility(point from, point to, ...)", "return color(1);", "1, as transmission()"),
    rsl(L, "float rayhittest(point p, vector r, ...)", "return 1e10;", "1e10: nothing is known to be hit"),
    rsl(L, "float fulltrace(point p, vector r, output color hit, ...)", "hit = trace(p, r); return 1e10;",
        "hit as trace() sees it; the other outputs stay as they are"),
    rsl(L, "float rayserver(point p, vector r, output color hit, ...)", "hit = trace(p, r); return 1e10;",
        "as fulltrace()"),
    // What is asked of lights and rays: a surface is shaded for all of them at once.
    rsl(L, "float lightsource(string name, ...)", "return 0;",
        "0: lights have no messages for materials; the variable stays as it is"),
    special(L, "float rayinfo(string name, output void value, ...)", Special::RayInfo,
            "as of a ray from the camera: \"type\" is \"camera\", \"depth\" 0, \"direction\" I; 0 for "
            "what is not known"),
    rsl(L, "float raylevel()", "return 0;", "0: as seen from the camera"),
    rsl(L, "float raydepth()", "return 0;", "0: as seen from the camera"),
    rsl(L, "float isshadowray()", "return 0;", "0: opacity is Oi's alone"),
    rsl(L, "float isindirectray()", "return 0;", "0: as seen from the camera"),
    // ---- material
    // -----------------------------------------------------------------------------------------------------
    special(K, "MnkMaterialBoundary CreateBoundary(MnkMaterial material)", Special::Create,
            CallKind::CreateBoundary, "begin the material's surface (mnk_init)"),
    special(K, "MnkMaterialInterior CreateInterior(MnkMaterial material, string kind, ...)", Special::Create,
            CallKind::CreateInterior,
            "begin the material's interior, \"homogeneous\", with its index of refraction (mnk_init)"),
    special(K, "void AddLobe(MnkMaterialBoundary boundary, string name, lobe value)", Special::AddNode,
            CallKind::AddLobe, "add a lobe under a name, with its first inputs (mnk_init)"),
    special(K,
            "void AddLayer(MnkMaterialBoundary boundary, string name, string op, string upper, string lower)",
            Special::AddLayer, "join two nodes: op is mix, over, coat or add (mnk_init)"),
    special(K, "void SetLobe(MnkMaterialBoundary boundary, string name, float weight, lobe value)",
            Special::SetLobe, "a lobe's weight and inputs at this vertex (mnk_prelighting)"),
    special(K, "void SetLayer(MnkMaterialBoundary boundary, string name, float weight)", Special::SetLayer,
            "a layer's weight at this vertex (mnk_prelighting)"),
    special(K, "void SetPresence(MnkMaterialBoundary boundary, float presence)", Special::SetPresence,
            "how much of the surface is there: 0 is a hole (mnk_prelighting)"),
    special(K, "void AddPhaseFunction(MnkMaterialInterior interior, string name, lobe value)",
            Special::AddNode, CallKind::AddPhaseFunction, "the interior's phase function (mnk_init)"),
    special(K, "void SetPhaseFunction(MnkMaterialInterior interior, string name, lobe value)",
            Special::AddNode, CallKind::SetPhaseFunction, "its inputs (mnk_interior)"),
    special(K, "void SetAbsorption(MnkMaterialInterior interior, color value)", Special::SetInterior,
            CallKind::SetAbsorption, "absorption in 1/m (mnk_interior)"),
    special(K, "void SetScattering(MnkMaterialInterior interior, color value)", Special::SetInterior,
            CallKind::SetScattering, "scattering in 1/m (mnk_interior)"),
    special(
        K, "void SetPriority(MnkMaterialInterior interior, float value)", Special::SetInterior,
        CallKind::SetPriority,
        "where interiors overlap, the one of the highest priority is there, 0 if it is not set; of equals, "
        "the one that a ray entered last (mnk_interior)"),
    // ---- information
    // --------------------------------------------------------------------------------------------------
    query("float attribute(string name)", Query::Attribute,
          "an attribute of the primitive; 1 and its value if it is known, else 0: ShadingRate, Sides, matte, "
          "Ri:…, user:…"),
    query("float attribute(string name, output void value, ...)", Query::Attribute),
    query("float option(string name)", Query::Option,
          "an option of the picture, as attribute(): Format, FrameAspectRatio, CropWindow, DepthOfField, "
          "Shutter, "
          "Clipping, user:…"),
    query("float option(string name, output void value, ...)", Query::Option),
    query("float rendererinfo(string name)", Query::Renderer,
          "renderer, version, versionstring, as attribute()"),
    query("float rendererinfo(string name, output void value, ...)", Query::Renderer),
    query(
        "float textureinfo(string file, string name)", Query::Texture,
        "of a texture, as attribute(): resolution, channels, type, exists, viewingmatrix, projectionmatrix"),
    query("float textureinfo(string file, string name, output void value, ...)", Query::Texture),
    absent(I, "float surface(string parameter, output void value)",
           "0: while one shader of a primitive runs, the others' parameters are not known"),
    absent(I, "float displacement(string parameter, output void value)", "as surface()"),
    absent(I, "float atmosphere(string parameter, output void value)", "as surface()"),
    absent(I, "float incident(string parameter, output void value)", "as surface()"),
    absent(I, "float opposite(string parameter, output void value)", "as surface()"),
    absent(I, "float lightsource(string parameter, output void value)",
           "0: lights are not known before light is"),
    rsl(I, "float isoutput(...)", "return 1;", "1"),
    special(I, "float bake(string file, float s, float t, ...)", Special::PointCloud, "0: it bakes nothing"),
    special(I, "float bake3d(string file, string channels, point p, normal n, ...)", Special::PointCloud,
            "0: it bakes nothing"),
    special(I, "float texture3d(string file, point p, normal n, ...)", Special::PointCloud,
            "0: there are no point clouds"),
    // ---- arrays
    // --------------------------------------------------------------------------------------------------
    special(A, "float arraylength(void array)", Special::ArrayLength, "number of elements of an array"),
    special(A, "void push(output void array, void value)", Special::Push,
            "put a value at the end of a resizable array"),
    special(A, "float pop(output void array)", Special::Pop, "take the last value from a resizable array"),
    special(A, "void resize(output void array, float length)", Special::Resize,
            "change the length of a resizable array"),
    special(A, "void reserve(output void array, float length)", Special::Reserve,
            "make room for that many elements"),
    special(A, "float capacity(void array)", Special::ArrayCapacity,
            "number of elements that there is room for"),
    // ---- co-shaders
    // --------------------------------------------------------------------------------------------------
    special(O, "shader getshader(string handle)", Special::GetShader,
            "a co-shader by its handle; null if there is none"),
    special(O, "shader[] getshaders(...)", Special::GetShaders,
            "co-shaders: all, or getshaders(\"category\", name) those of a category"),
    special(O, "shader[] getlights(...)", Special::GetLights, "no lights: light is not known while shading"),
    absent(O, "shader caller()", "null"),
    special(O, "float getvar(shader s, string name, output void value)", Special::GetVariable,
            "1 and the value of a co-shader's parameter or member; 0 where there is none, and the variable "
            "stays as it is"),
    special(O, "float getvar(shader s, string name)", Special::GetVariable),
    special(O, "float hasmethod(shader s, string name)", Special::HasMethod,
            "1 if the co-shader has a public method of that name"),
    absent(O, "void writeaov(string name, ...)", "nothing: declare an output parameter"),
    absent(O, "float outputchannel(string name, ...)", "0, as writeaov()"),
    absent(O, "float evalparam(string name, output void value)",
           "0: parameters have their values already; the variable stays as it is"),
    special(O, "void emit(color c, ...)", Special::Emit,
            "nothing: give the surface an emission, or an area light"),
    special(I, "string shadername(...)", Special::ShaderName, "this shader's name"),
};

} // namespace

std::span<const Row> rows() {
    return table;
}

} // namespace kanuka::sl::ops
