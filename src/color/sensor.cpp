#include "color/sensor.h"

#include <cmath>

namespace kanuka::color {

namespace {

Table times(const Table& a, const Table& b) {
    Table r;
    for (int i = 0; i < LambdaCount; i++)
        r[i] = a[i] * b[i];
    return r;
}

std::array<std::array<float, 3>, 3> to_float(const Matrix3& m) {
    std::array<std::array<float, 3>, 3> r;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            r[i][k] = float(m[i][k]);
    return r;
}

} // namespace

Rgb Sensor::see(const Table& power) const {
    double s[3];
    for (int c = 0; c < 3; c++)
        s[c] = integrate(power, curves[c]);
    Rgb out;
    for (int r = 0; r < 3; r++)
        out[r] = float(output_from_sensor[r][0] * s[0] + output_from_sensor[r][1] * s[1] +
                       output_from_sensor[r][2] * s[2]);
    return out;
}

std::optional<Observer> find_observer(std::string_view name) {
    if (name == "1931" || name == "cie1931" || name == "2")
        return Observer::Cie1931;
    if (name == "1964" || name == "cie1964" || name == "10")
        return Observer::Cie1964;
    return std::nullopt;
}

Sensor make_sensor(Observer observer, const Table& white, Space output) {
    Sensor s;
    s.output = output;
    const bool narrow = observer == Observer::Cie1931;
    s.importance =
        narrow ? std::array{cie_x(), cie_y(), cie_z()} : std::array{cie_x10(), cie_y10(), cie_z10()};
    // The luminance of a light is the 1931 observer's; another one's scale is such that white is as bright.
    double scale = 1 / double(cie_y_integral());
    if (!narrow)
        scale = 1 / integrate(white, cie_y10()) * (integrate(white, cie_y()) / cie_y_integral());
    const float norm = narrow ? 1 / cie_y_integral() : float(scale);
    Vector3 seen_white;
    for (int c = 0; c < 3; c++) {
        for (int i = 0; i < LambdaCount; i++)
            s.curves[c][i] = s.importance[c][i] * norm;
        seen_white[c] = integrate(white, s.curves[c]);
    }
    if (output == Space::Xyz)
        s.output_from_sensor = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    else if (narrow && output == Space::Rec709 && white == illuminant_d65())
        s.output_from_sensor = color::rgb_from_xyz;
    else {
        if (seen_white[1] > 0)
            for (double& v : seen_white)
                v /= seen_white[1];
        else
            seen_white = white_xyz(output);
        s.output_from_sensor = to_float(space_from_xyz(output) * adaptation(seen_white, white_xyz(output)));
    }
    return s;
}

const std::vector<Table>& default_training() {
    static const std::vector<Table> all = [] {
        std::vector<Table> tables;
        for (int k = 0; k < 125; k++) {
            const auto level = [](int i) { return 0.05f + 0.2f * float(i); };
            const auto c = uplift({level(k % 5), level(k / 5 % 5), level(k / 25)});
            Table& t = tables.emplace_back();
            for (int i = 0; i < LambdaCount; i++)
                t[i] = uplift_eval(c, LambdaMin + float(i));
        }
        return tables;
    }();
    return all;
}

Sensor make_camera(const SpectrumColumns& sensitivities, const std::string& name, const Table& white,
                   Space output, std::span<const Table> training) {
    if (sensitivities.columns.size() != 3)
        throw Error({name},
                    "a camera's sensitivities have four columns: wavelength, red, green and blue; found " +
                        std::to_string(sensitivities.columns.size() + 1));
    if (training.empty())
        training = default_training();
    Sensor s;
    s.output = output;

    // 1. White balance: gains.
    for (int c = 0; c < 3; c++) {
        const Table curve = sensitivities.column(size_t(c)).table(Spectrum::Ends::Zero);
        const double seen = integrate(white, curve);
        if (!(seen > 0))
            throw Error({name}, "column " + std::to_string(c + 2) + " sees nothing of the white light");
        const double y = integrate(white, cie_y()) / cie_y_integral();
        for (int i = 0; i < LambdaCount; i++)
            s.curves[c][i] = float(curve[i] / seen * y);
        s.importance[c] = s.curves[c];
    }

    // 2. The matrix M with the least sum of |M rgb - xyz|^2, where xyz is what the observer sees, adapted;
    // and M (1, 1, 1) = white: Lagrange's multiplier adds to each row a multiple of G^-1 (1, 1, 1).
    const Vector3 goal_white = white_xyz(output);
    Vector3 seen_white = observe(white);
    const double white_y = seen_white[1] > 0 ? seen_white[1] : 1;
    for (double& v : seen_white)
        v /= white_y;
    const bool adapts = output != Space::Xyz;
    const Matrix3 adapted =
        adapts ? adaptation(seen_white, goal_white) : Matrix3{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    Matrix3 g{}, cross{};
    for (const Table& reflectance : training) {
        const Table light = times(reflectance, white);
        Vector3 rgb;
        for (int c = 0; c < 3; c++)
            rgb[c] = integrate(light, s.curves[c]);
        const Vector3 xyz = adapted * observe(light);
        for (int i = 0; i < 3; i++)
            for (int k = 0; k < 3; k++) {
                g[i][k] += rgb[i] * rgb[k];
                cross[i][k] += xyz[i] * rgb[k];
            }
    }
    const Matrix3 g_inverse = inverse(g);
    Matrix3 m = cross * g_inverse;
    const Vector3 ones = g_inverse * Vector3{1, 1, 1};
    const double sum = ones[0] + ones[1] + ones[2];
    const Vector3 wanted = adapts ? goal_white : seen_white, got = m * Vector3{1, 1, 1};
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            m[i][k] += (wanted[i] - got[i]) * ones[k] / sum;
    for (const auto& row : m)
        for (const double v : row)
            if (!std::isfinite(v))
                throw Error({name}, "the three sensitivities do not tell colours apart; they need to differ");
    s.output_from_sensor = to_float(space_from_xyz(output) * m);
    return s;
}

} // namespace kanuka::color
