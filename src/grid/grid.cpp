#include "grid/grid.h"

namespace kanuka::grid {

void Grid::allocate(int cells_u, int cells_v) {
    nu = cells_u;
    nv = cells_v;
    stride = (vertices() + LanePadding - 1) / LanePadding * LanePadding;
    for (auto* a : {&P, &N, &Ng, &dPdu, &dPdv})
        a->assign(size_t(stride) * 3, 0.0f);
    for (auto* a : {&u, &v, &s, &t})
        a->assign(size_t(stride), 0.0f);
}

} // namespace kanuka::grid
