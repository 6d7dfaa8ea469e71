// Build step: reads the tables of data/, and writes tables.inc, data_text.inc (C++) and uplift*.bin (floats).
// make_tables DATA_DIR RESOLUTION WIDE_RESOLUTION OUT_DIR
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <sstream>
#include <stdexcept>

#include "color/daylight.h"
#include "color/matrix3.h"
#include "color/uplift_fit.h"

using namespace kanuka::color;

namespace {

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

void write_table(std::ostream& out, const char* name, const Table& table) {
    out << "constinit const Table " << name << "{{";
    for (int i = 0; i < LambdaCount; i++)
        out << (i % 10 ? " " : "\n    ") << table[i] << "f,";
    out << "\n}};\n";
}

void write_matrix(std::ostream& out, const char* name, const Matrix3& m) {
    out << "constexpr std::array<std::array<float, 3>, 3> " << name << "{{";
    for (const auto& row : m)
        out << "{{" << float(row[0]) << "f, " << float(row[1]) << "f, " << float(row[2]) << "f}}, ";
    out << "}};\n";
}

// A table with any spacing, at 1 nm: linear between entries.
std::vector<double> at_1nm(const std::vector<std::vector<double>>& rows, size_t column,
                           const std::string& path) {
    if (rows.front()[0] > LambdaMin || rows.back()[0] < LambdaMax)
        throw std::runtime_error(path + ": must cover 360 to 830 nm");
    std::vector<double> fine(LambdaCount);
    size_t k = 0;
    for (int i = 0; i < LambdaCount; i++) {
        const double lambda = LambdaMin + i;
        while (k + 2 < rows.size() && rows[k + 1][0] <= lambda)
            k++;
        const double t = (lambda - rows[k][0]) / (rows[k + 1][0] - rows[k][0]);
        fine[i] = (1 - t) * rows[k][column] + t * rows[k + 1][column];
    }
    return fine;
}

struct Observer {
    std::array<Table, 3> curves;
    double y_integral = 0;
};

Observer read_observer(const std::string& path) {
    const auto cmf = read_csv(path);
    if (cmf.size() != LambdaCount || cmf.front()[0] != LambdaMin || cmf.back()[0] != LambdaMax)
        throw std::runtime_error(path + ": expected rows for 360, 361, ... 830 nm");
    Observer o;
    for (int i = 0; i < LambdaCount; i++) {
        for (int c = 0; c < 3; c++)
            o.curves[c][i] = float(cmf[i][c + 1]);
        o.y_integral += o.curves[1][i];
    }
    return o;
}

// Scaled to Y = 1; `white` is its XYZ.
Table scaled(const std::vector<double>& power, const Observer& observer, Vector3& white) {
    double y = 0;
    for (int i = 0; i < LambdaCount; i++)
        y += observer.curves[1][i] * power[i];
    Table table;
    white = {};
    for (int i = 0; i < LambdaCount; i++) {
        table[i] = float(power[i] * observer.y_integral / y);
        for (int c = 0; c < 3; c++)
            white[c] += double(observer.curves[c][i]) * table[i] / observer.y_integral;
    }
    return table;
}

void write_uplift(const std::string& path, const Observer& observer, const Table& light,
                  const Matrix3& rgb_from_xyz, int resolution, bool wide) {
    Response response;
    for (int c = 0; c < 3; c++) {
        response[c].resize(LambdaCount);
        for (int i = 0; i < LambdaCount; i++) {
            double w = 0;
            for (int k = 0; k < 3; k++)
                w += rgb_from_xyz[c][k] * observer.curves[k][i];
            response[c][i] = w * light[i] / observer.y_integral;
        }
    }
    double residual = 0;
    const std::vector<float> table = fit_uplift_table(response, resolution, wide, residual);
    if (!(residual < 1e-6))
        throw std::runtime_error(path + ": the optimiser left a residual of " + std::to_string(residual));
    std::ofstream bin(path, std::ios::binary);
    bin.write(reinterpret_cast<const char*>(table.data()), std::streamsize(table.size() * sizeof(float)));
    if (!bin.flush())
        throw std::runtime_error(path + ": cannot be written");
}

// Files that are read at run time, as the user's own are: their text becomes a string.
void write_text(std::ostream& out, const std::string& data_dir, const char* file, const char* name) {
    std::ifstream in(data_dir + "/" + file);
    std::ostringstream text;
    text << in.rdbuf();
    if (!in)
        throw std::runtime_error(data_dir + "/" + file + ": cannot be read");
    out << "constexpr const char* " << name << " = R\"csv(" << text.str() << ")csv\";\n";
}

int run(const std::string& data_dir, int resolution, int wide_resolution, const std::string& out_dir) {
    const Observer observer = read_observer(data_dir + "/cie_1931_2deg.csv"),
                   wide = read_observer(data_dir + "/cie_1964_10deg.csv");
    const std::string d65_path = data_dir + "/cie_d65.csv", daylight_path = data_dir + "/cie_daylight.csv";
    Vector3 white, white_d60;
    const Table d65 = scaled(at_1nm(read_csv(d65_path), 1, d65_path), observer, white);
    const auto daylight = read_csv(daylight_path);
    std::array<std::vector<double>, 3> component;
    for (size_t k = 0; k < 3; k++)
        component[k] = at_1nm(daylight, k + 1, daylight_path);
    const DaylightMix mix = daylight_mix(6000 * DaylightFromNominal);
    std::vector<double> d60(LambdaCount);
    for (int i = 0; i < LambdaCount; i++)
        d60[i] = component[0][i] + mix.m1 * component[1][i] + mix.m2 * component[2][i];
    const Table d60_table = scaled(d60, observer, white_d60);

    // Rec.709 and Rec.2020 with the white of our own D65 table, so that white is exactly (1, 1, 1).
    const Matrix3 xyz_from_rgb = xyz_from_primaries(Rec709Primaries, white),
                  rgb_from_xyz = inverse(xyz_from_rgb);
    write_uplift(out_dir + "/uplift.bin", observer, d65, rgb_from_xyz, resolution, false);
    write_uplift(out_dir + "/uplift_rec2020.bin", observer, d65,
                 inverse(xyz_from_primaries(Rec2020Primaries, white)), wide_resolution, true);
    write_uplift(out_dir + "/uplift_acescg.bin", observer, d60_table,
                 aces_rgb_from_xyz(AcesAp1Primaries, white_d60), wide_resolution, true);

    std::ofstream cpp(out_dir + "/tables.inc");
    cpp << "// Made by make_tables from src/color/data.\n" << std::showpoint << std::setprecision(9);
    write_table(cpp, "X", observer.curves[0]);
    write_table(cpp, "Y", observer.curves[1]);
    write_table(cpp, "Z", observer.curves[2]);
    write_table(cpp, "X10", wide.curves[0]);
    write_table(cpp, "Y10", wide.curves[1]);
    write_table(cpp, "Z10", wide.curves[2]);
    write_table(cpp, "D65", d65);
    write_table(cpp, "D60", d60_table);
    for (size_t k = 0; k < 3; k++) {
        Table table;
        for (int i = 0; i < LambdaCount; i++)
            table[i] = float(component[k][i]);
        write_table(cpp, ("Daylight" + std::to_string(k)).c_str(), table);
    }
    write_matrix(cpp, "RgbFromXyz", rgb_from_xyz);
    write_matrix(cpp, "XyzFromRgb", xyz_from_rgb);
    cpp << "constexpr float YIntegral = " << float(observer.y_integral) << "f;\n";
    std::ofstream text(out_dir + "/data_text.inc");
    text << "// Made by make_tables from src/color/data.\n";
    write_text(text, data_dir, "cie_f.csv", "FluorescentCsv");
    write_text(text, data_dir, "cie_led.csv", "LedCsv");
    write_text(text, data_dir, "metals.csv", "MetalsCsv");
    write_text(text, data_dir, "glasses.csv", "GlassesCsv");
    if (!cpp.flush() || !text.flush())
        throw std::runtime_error(out_dir + ": cannot be written");
    return 0;
}

} // namespace

int main(int argc, char** argv) {
    if (argc != 5) {
        std::fprintf(stderr, "usage: make_tables DATA_DIR RESOLUTION WIDE_RESOLUTION OUT_DIR\n");
        return 2;
    }
    try {
        return run(argv[1], std::atoi(argv[2]), std::atoi(argv[3]), argv[4]);
    } catch (const std::exception& e) {
        std::fprintf(stderr, "make_tables: %s\n", e.what());
        return 1;
    }
}
