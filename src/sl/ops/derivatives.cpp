// Differences to the neighbours, on grids and on meshes, and the normals that follow from them.
#include <algorithm>

#include "sl/ops/host_calls.h"

namespace kanuka::sl::ops {

// n values, `step` apart: (x[k+1] - x[k-1]) / 2, at the ends (-3 x[0] + 4 x[1] - x[2]) / 2.
static float edge(float a, float b, float c) {
    return 2.0f * (b - a) - 0.5f * (c - a);
}

static void by_stencils(const grid::Stencils& s, const std::vector<float>& along, const float* x, float* out,
                        int count) {
    for (int i = 0; i < count; i++) {
        float sum = 0;
        for (uint32_t k = s.first[size_t(i)]; k < s.first[size_t(i) + 1]; k++)
            sum += along[k] * (x[s.vertex[k]] - x[i]);
        out[i] = sum;
    }
}

void difference_u(const Runner& r, const float* x, float* out) {
    const int columns = r.columns;
    if (r.rows == 1) {
        if (r.stencils)
            by_stencils(*r.stencils, r.stencils->along_u, x, out, columns);
        else
            std::fill_n(out, columns, 0.0f);
        return;
    }
    for (int j = 0; j < r.rows; j++, x += columns, out += columns) {
        if (columns < 2) {
            std::fill_n(out, columns, 0.0f);
        } else if (columns == 2) {
            out[0] = out[1] = x[1] - x[0];
        } else {
            for (int i = 1; i + 1 < columns; i++)
                out[i] = 0.5f * (x[i + 1] - x[i - 1]);
            out[0] = edge(x[0], x[1], x[2]);
            out[columns - 1] = -edge(x[columns - 1], x[columns - 2], x[columns - 3]);
        }
    }
}

void difference_v(const Runner& r, const float* x, float* out) {
    const int n = r.columns, rows = r.rows;
    if (rows == 1) {
        if (r.stencils)
            by_stencils(*r.stencils, r.stencils->along_v, x, out, n);
        else
            std::fill_n(out, n, 0.0f);
    } else if (rows == 2) {
        for (int i = 0; i < n; i++)
            out[i] = out[n + i] = x[n + i] - x[i];
    } else {
        for (int j = 1; j + 1 < rows; j++)
            for (int i = 0; i < n; i++)
                out[j * n + i] = 0.5f * (x[(j + 1) * n + i] - x[(j - 1) * n + i]);
        const float* last = x + (rows - 1) * n;
        for (int i = 0; i < n; i++) {
            out[i] = edge(x[i], x[n + i], x[2 * n + i]);
            out[(rows - 1) * n + i] = -edge(last[i], last[i - n], last[i - 2 * n]);
        }
    }
}

// Vertices that faces share have the u and v of one of them: how much those change is known apart.
void differences(Runner& r, const Arguments& a) {
    const bool along_u = a.site.kind == ir::CallKind::Dx;
    if (r.stencils && (a.site.imm == 1 + int(ir::Input::u) || a.site.imm == 1 + int(ir::Input::v))) {
        const bool same = along_u == (a.site.imm == 1 + int(ir::Input::u));
        const std::vector<float>& steps = along_u ? r.stencils->step_u : r.stencils->step_v;
        for (int i = 0; i < r.columns; i++)
            a.result()[0][i] = same ? steps[size_t(i)] : 0;
        return;
    }
    const int n = ir::comps(r.stage.instrs[size_t(a.site.result)].ty);
    for (int c = 0; c < n; c++)
        (along_u ? difference_u : difference_v)(r, a.at(0)[c], a.result()[c]);
}

// Cross product of the two derivatives, of the length of the area element, turned to the side of the original
// normal (RISpec: calculatenormal follows the orientation of the surface). Where it vanishes (poles,
// collapsed edges) that of the next vertex inwards serves, and if there is none, the original normal.
void calculate_normal(Runner& r, const Arguments& a) {
    const int n = r.columns * r.rows;
    const float* const* P = a.at(0);
    const float* const* N = a.at(1);
    float* const* out = a.result();
    if (r.rows == 1 && !r.stencils) {
        for (int c = 0; c < 3; c++)
            std::copy_n(N[c], n, out[c]);
        return;
    }
    std::vector<float> d(size_t(n) * 6);
    float* du[3];
    float* dv[3];
    for (int c = 0; c < 3; c++) {
        du[c] = d.data() + size_t(c) * n;
        dv[c] = d.data() + size_t(c + 3) * n;
        difference_u(r, P[c], du[c]);
        difference_v(r, P[c], dv[c]);
    }
    float *x = out[0], *y = out[1], *z = out[2];
    double side = 0;
    for (int i = 0; i < n; i++) {
        x[i] = du[1][i] * dv[2][i] - du[2][i] * dv[1][i];
        y[i] = du[2][i] * dv[0][i] - du[0][i] * dv[2][i];
        z[i] = du[0][i] * dv[1][i] - du[1][i] * dv[0][i];
        side += double(x[i]) * N[0][i] + double(y[i]) * N[1][i] + double(z[i]) * N[2][i];
    }
    if (side < 0)
        for (int c = 0; c < 3; c++)
            for (int i = 0; i < n; i++)
                out[c][i] = -out[c][i];
    const auto size2 = [&](int i) { return x[i] * x[i] + y[i] * y[i] + z[i] * z[i]; };
    double mean = 0;
    for (int i = 0; i < n; i++)
        mean += double(size2(i));
    const float tiny = float(mean / n * 1e-8);
    for (int i = 0; i < n; i++) {
        const int column = i % r.columns, row = i / r.columns;
        // Where a side meets a neighbour's fewer vertices its own have moved along it, and a cell in the
        // corner may lie folded over: its normal is the wrong way round.
        const auto folded = [&] {
            if (r.stencils)
                return false;
            if (column != 0 && row != 0 && column != r.columns - 1 && row != r.rows - 1)
                return false;
            const int k = std::clamp(row, 1, r.rows - 2) * r.columns + std::clamp(column, 1, r.columns - 2);
            return r.columns > 2 && r.rows > 2 && x[i] * x[k] + y[i] * y[k] + z[i] * z[k] < 0;
        };
        if (size2(i) > tiny && !folded())
            continue;
        const int inward_u = column * 2 < r.columns ? 1 : -1, inward_v = row * 2 < r.rows ? 1 : -1;
        int from = -1;
        if (!r.stencils)
            for (int k : {i + inward_v * r.columns, i + inward_u, i + inward_v * r.columns + inward_u})
                if (from < 0 && k >= 0 && k < n && size2(k) > tiny &&
                    (size2(i) <= tiny || x[k] * x[i] + y[k] * y[i] + z[k] * z[i] < 0))
                    from = k;
        for (int c = 0; c < 3; c++)
            out[c][i] = from >= 0 ? out[c][from] : N[c][i];
    }
}

} // namespace kanuka::sl::ops
