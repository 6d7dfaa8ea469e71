// Build step: reads the CIE tables of data/, and writes tables.inc (C++) and uplift.bin (floats).
// make_tables CMF.csv D65.csv RESOLUTION OUT_DIR
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <sstream>
#include <stdexcept>

#include "color/uplift_fit.h"

using namespace kanuka::color;

namespace {

using M3 = std::array<std::array<double, 3>, 3>;

std::vector<std::vector<double>> read_csv(const std::string& path) {
    std::ifstream in(path);
    if (!in)
        throw std::runtime_error(path + ": cannot be read");
    std::vector<std::vector<double>> rows;
    for (std::string line; std::getline(in, line);) {
        if (line.empty() || line[0] == '#')
            continue;
        std::istringstream fields(line);
        std::vector<double> row;
        for (std::string field; std::getline(fields, field, ',');)
            row.push_back(std::stod(field));
        rows.push_back(row);
    }
    return rows;
}

M3 inverse(const M3& a) {
    M3 r;
    double det = 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const int i1 = (j + 1) % 3, i2 = (j + 2) % 3, j1 = (i + 1) % 3, j2 = (i + 2) % 3;
            r[i][j] = a[i1][j1] * a[i2][j2] - a[i1][j2] * a[i2][j1];
        }
    for (int i = 0; i < 3; i++)
        det += a[0][i] * r[i][0];
    for (auto& row : r)
        for (double& v : row)
            v /= det;
    return r;
}

// Rec.709 primaries (ITU-R BT.709-6, table 1) with the white of our own D65 table, so that white is exactly
// (1, 1, 1).
M3 xyz_from_rec709(const std::array<double, 3>& white) {
    constexpr double xy[3][2] = {{0.64, 0.33}, {0.30, 0.60}, {0.15, 0.06}};
    M3 p;
    for (int c = 0; c < 3; c++) {
        p[0][c] = xy[c][0] / xy[c][1];
        p[1][c] = 1;
        p[2][c] = (1 - xy[c][0] - xy[c][1]) / xy[c][1];
    }
    const M3 q = inverse(p);
    for (int c = 0; c < 3; c++) {
        double s = 0;
        for (int k = 0; k < 3; k++)
            s += q[c][k] * white[k];
        for (int k = 0; k < 3; k++)
            p[k][c] *= s;
    }
    return p;
}

void write_table(std::ostream& out, const char* name, const Table& table) {
    out << "constinit const Table " << name << "{{";
    for (int i = 0; i < LambdaCount; i++)
        out << (i % 10 ? " " : "\n    ") << table[i] << "f,";
    out << "\n}};\n";
}

void write_matrix(std::ostream& out, const char* name, const M3& m) {
    out << "constinit const std::array<std::array<float, 3>, 3> " << name << "{{";
    for (const auto& row : m)
        out << "{{" << float(row[0]) << "f, " << float(row[1]) << "f, " << float(row[2]) << "f}}, ";
    out << "}};\n";
}

int run(const std::string& cmf_path, const std::string& d65_path, int resolution,
        const std::string& out_dir) {
    const auto cmf = read_csv(cmf_path), power = read_csv(d65_path);
    if (cmf.size() != LambdaCount || cmf.front()[0] != LambdaMin || cmf.back()[0] != LambdaMax)
        throw std::runtime_error(cmf_path + ": expected rows for 360, 361, ... 830 nm");
    if (power.front()[0] > LambdaMin || power.back()[0] < LambdaMax)
        throw std::runtime_error(d65_path + ": must cover 360 to 830 nm");

    // Observer, and the illuminant at 1 nm, scaled to Y = 1.
    std::array<Table, 3> observer;
    Table d65;
    double y_integral = 0, y = 0;
    std::vector<double> fine(LambdaCount);
    for (int i = 0; i < LambdaCount; i++) {
        for (int c = 0; c < 3; c++)
            observer[c][i] = float(cmf[i][c + 1]);
        const double lambda = LambdaMin + i;
        size_t k = 0;
        while (k + 2 < power.size() && power[k + 1][0] <= lambda)
            k++;
        const double t = (lambda - power[k][0]) / (power[k + 1][0] - power[k][0]);
        fine[i] = (1 - t) * power[k][1] + t * power[k + 1][1];
        y_integral += observer[1][i];
        y += observer[1][i] * fine[i];
    }
    std::array<double, 3> white{};
    for (int i = 0; i < LambdaCount; i++) {
        d65[i] = float(fine[i] * y_integral / y);
        for (int c = 0; c < 3; c++)
            white[c] += double(observer[c][i]) * d65[i] / y_integral;
    }
    const M3 xyz_from_rgb = xyz_from_rec709(white), rgb_from_xyz = inverse(xyz_from_rgb);

    Response response;
    for (int c = 0; c < 3; c++) {
        response[c].resize(LambdaCount);
        for (int i = 0; i < LambdaCount; i++) {
            double w = 0;
            for (int k = 0; k < 3; k++)
                w += rgb_from_xyz[c][k] * observer[k][i];
            response[c][i] = w * d65[i] / y_integral;
        }
    }
    double residual = 0;
    const std::vector<float> table = fit_uplift_table(response, resolution, residual);
    if (!(residual < 1e-6))
        throw std::runtime_error("uplift: the optimiser left a residual of " + std::to_string(residual));

    std::ofstream cpp(out_dir + "/tables.inc");
    cpp << "// Made by make_tables from src/color/data.\n" << std::showpoint << std::setprecision(9);
    write_table(cpp, "X", observer[0]);
    write_table(cpp, "Y", observer[1]);
    write_table(cpp, "Z", observer[2]);
    write_table(cpp, "D65", d65);
    write_matrix(cpp, "RgbFromXyz", rgb_from_xyz);
    write_matrix(cpp, "XyzFromRgb", xyz_from_rgb);
    cpp << "constexpr float YIntegral = " << float(y_integral) << "f;\n";
    std::ofstream bin(out_dir + "/uplift.bin", std::ios::binary);
    bin.write(reinterpret_cast<const char*>(table.data()), std::streamsize(table.size() * sizeof(float)));
    if (!cpp.flush() || !bin.flush())
        throw std::runtime_error(out_dir + ": cannot be written");
    return 0;
}

} // namespace

int main(int argc, char** argv) {
    if (argc != 5) {
        std::fprintf(stderr, "usage: make_tables CMF.csv D65.csv RESOLUTION OUT_DIR\n");
        return 2;
    }
    try {
        return run(argv[1], argv[2], std::atoi(argv[3]), argv[4]);
    } catch (const std::exception& e) {
        std::fprintf(stderr, "make_tables: %s\n", e.what());
        return 1;
    }
}
