// Ten thousand random shapes of every kind, diced and compared with what stands there, sample by sample. Not
// run by the tests, which do the same with fewer.
//   kanuka_shape_bench [--cases N] [--seed N] [--kind N] [--list 1] [--fine 1]
// --fine: small shapes are diced as large ones are, and all are held to half a per cent.
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "base/tasks.h"
#include "dice/test_shape_cases.h"

using namespace kanuka::dice::test;

int main(int argc, char** argv) {
    size_t cases = 10'000, seed = 0, list = 0;
    Rates rates = Rates::Random;
    int kind = -1;
    for (int i = 1; i + 1 < argc; i += 2) {
        const int n = int(std::atof(argv[i + 1]));
        if (std::strcmp(argv[i], "--cases") == 0)
            cases = size_t(n);
        else if (std::strcmp(argv[i], "--seed") == 0)
            seed = size_t(n);
        else if (std::strcmp(argv[i], "--kind") == 0)
            kind = n;
        else if (std::strcmp(argv[i], "--list") == 0)
            list = size_t(n);
        else if (std::strcmp(argv[i], "--fine") == 0 && n != 0)
            rates = Rates::Fine;
    }
    const auto start = std::chrono::steady_clock::now();
    std::vector<ShapeCase> all(cases);
    kanuka::tasks::parallel_for(cases,
                                [&](size_t i) { all[i] = run_shape(uint32_t(seed + i), kind, rates); });
    struct Sum {
        size_t counted = 0, wrong = 0, over = 0;
        double worst = 0, twice = 0, outline = 0, bias = 0;
        size_t open = 0;
    };
    Sum sums[Kinds + 1];
    for (const ShapeCase& c : all) {
        for (Sum* s : {&sums[int(c.kind)], &sums[Kinds]}) {
            s->counted += c.counted;
            s->wrong += c.wrong();
            s->over += c.counted && c.error > 0.005;
            s->worst = std::max(s->worst, c.counted ? c.error : 0);
            s->twice = std::max(s->twice, c.twice);
            s->outline = std::max(s->outline, c.outline);
            s->bias += c.counted ? c.bias : 0;
            s->open += c.open_edges > 0;
        }
        if ((list == 1 && c.wrong()) || (list == 2 && c.counted && (c.wrong() || c.error > 0.005)))
            std::printf("%s: off by %.4f (tolerance %.4f), twice %.4f, outline %.4f, open %zu, too large by "
                        "%.4f, %.2f pixels\n",
                        c.text.c_str(), c.error, c.tolerance, c.twice, c.outline, c.open_edges, c.bias,
                        c.pixels);
    }
    std::printf("%-22s %7s %7s %9s %9s %9s %9s %9s %6s\n", "kind", "cases", "wrong", "over .5%", "worst",
                "too large", "twice", "outline", "open");
    for (int k = 0; k <= Kinds; k++)
        if (sums[k].counted > 0)
            std::printf("%-22s %7zu %7zu %9zu %9.4f %9.4f %9.4f %9.4f %6zu\n",
                        k < Kinds ? KindNames[k] : "all", sums[k].counted, sums[k].wrong, sums[k].over,
                        sums[k].worst, sums[k].bias / double(sums[k].counted), sums[k].twice, sums[k].outline,
                        sums[k].open);
    std::printf("%.1f s\n", std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    return sums[Kinds].wrong > 0;
}
