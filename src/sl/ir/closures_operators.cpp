// Operators on bundles of light: the last part of extraction.h.
#include "sl/ir/extraction.h"

namespace kanuka::sl::ir {

// Three components, each a bundle.
Bundle Extraction::make(const Instr& i) {
    if (i.ty != Ty::Triple)
        return chord(i);
    Bundle out, parts[3], keys;
    for (size_t c = 0; c < 3; c++) {
        parts[c] = bundle(i.args[c]);
        keys.insert(parts[c].begin(), parts[c].end());
    }
    for (const auto& [k, unused] : keys) {
        std::vector<Ref> w;
        for (const Bundle& p : parts)
            w.push_back(p.count(k) ? p.at(k) : m_b.constant(0.0f));
        out[k] = m_b.emit(Op::Make, i.ty, std::move(w), i.loc);
    }
    return out;
}

Bundle Extraction::sum(const Instr& i) {
    Bundle out = bundle(i.args[0]);
    for (const auto& [k, w] : bundle(i.args[1]))
        if (const auto it = out.find(k); it != out.end())
            it->second = m_b.emit(i.op, i.ty, {it->second, w}, i.loc);
        else
            out[k] = i.op == Op::Add ? w : m_b.emit(Op::Neg, i.ty, {w}, i.loc);
    return out;
}

Bundle Extraction::multiply(const Instr& i) {
    const Contents x = contents(i.args[0]), y = contents(i.args[1]);
    const bool left = !x.sites.empty(), right = !y.sites.empty();
    if (i.ty == Ty::Matrix || (right && i.op == Op::Div) || (left && right && i.op == Op::Dot))
        return chord(i);
    Bundle out;
    if (!left || !right) {
        for (const auto& [k, w] : bundle(i.args[left ? 0 : 1]))
            out[k] = left ? m_b.emit(i.op, i.ty, {w, value(i.args[1], true)}, i.loc)
                          : m_b.emit(i.op, i.ty, {value(i.args[0], true), w}, i.loc);
        return out;
    }
    // Factor by factor; a plain part of one side leaves the other's factors as they are.
    const auto add = [&](int site, Ref p) {
        const auto it = out.find(site);
        out[site] = it == out.end() ? p : m_b.emit(Op::Add, i.ty, {it->second, p}, i.loc);
    };
    const auto times = [&](Ref p, int site) {
        return m_sites[size_t(site)].reference < 0
                   ? p
                   : m_b.emit(Op::Mul, i.ty, {p, reference(site, i.ty, i.loc)}, i.loc);
    };
    for (const auto& [k, w] : bundle(i.args[0]))
        for (const auto& [l, u] : bundle(i.args[1])) {
            const Ref p = m_b.emit(Op::Mul, i.ty, {w, u}, i.loc);
            const int site = k == Plain ? l : l == Plain ? k : product(k, l);
            if (site >= 0 || k == Plain || l == Plain) {
                add(site, p);
                continue;
            }
            // No lobe: fresnel() as the dicing camera sees it; of two terms half of each, at full light.
            const bool first = is_fresnel(m_sites[size_t(k)].kind),
                       second = is_fresnel(m_sites[size_t(l)].kind);
            if (first && second) {
                add(Plain, times(times(p, k), l));
            } else if (first || second) {
                add(first ? l : k, times(p, first ? k : l));
            } else {
                const Ref half = m_b.emit(Op::Mul, i.ty, {p, zero_of(i.ty, 0.5f)}, i.loc);
                add(k, times(half, l));
                add(l, times(half, k));
            }
        }
    return out;
}

Bundle Extraction::select(const Instr& i) {
    if (i.ty == Ty::Bool || !contents(i.args[0]).sites.empty())
        return chord(i);
    const Bundle a = bundle(i.args[1]), b = bundle(i.args[2]);
    const auto get = [&](const Bundle& x, int k) {
        const auto it = x.find(k);
        return it == x.end() ? zero_of(i.ty) : it->second;
    };
    Bundle keys = a, out;
    keys.insert(b.begin(), b.end());
    for (const auto& [k, unused] : keys)
        out[k] = m_b.emit(Op::Select, i.ty, {value(i.args[0], true), get(a, k), get(b, k)}, i.loc);
    return out;
}

// The function's chord: as it is without light, and what full light adds.
Bundle Extraction::chord(const Instr& i) {
    std::vector<Ref> dark, bright;
    for (Ref a : i.args) {
        dark.push_back(value(a, false));
        bright.push_back(value(a, true));
    }
    Ref from = m_b.emit(i.op, i.ty, std::move(dark), i.loc, i.imm);
    Ref to = m_b.emit(i.op, i.ty, std::move(bright), i.loc, i.imm);
    if (i.ty == Ty::Bool)
        return {{Plain, from}, {AtFullLight, to}};
    if (i.op == Op::Div || i.op == Op::Math1 || i.op == Op::Math2) {
        from = finite(from, i.loc);
        to = finite(to, i.loc);
    }
    Bundle out{{Plain, from}};
    spread(out, i, from, to);
    return out;
}

// What light adds, spread over the terms by what they are in the arguments.
void Extraction::spread(Bundle& out, const Instr& i, Ref dark, Ref bright) {
    const Loc at = i.loc;
    const auto op = [&](Op o, Ref a, Ref b) { return m_b.emit(o, m_b.at(a).ty, {a, b}, at); };
    const Ref gain = op(Op::Sub, bright, dark);
    std::vector<int> sites;
    for (int s : arguments(i).sites)
        if (is_light(m_sites[size_t(s)].kind))
            sites.push_back(s);
    std::vector<Ref> amounts; // floats
    Ref total = m_b.constant(0.0f);
    for (int s : sites) {
        Ref amount = m_b.constant(0.0f);
        for (Ref a : i.args) {
            const Bundle b = bundle(a);
            const auto it = b.find(s);
            if (it == b.end())
                continue;
            Ref w = it->second;
            if (m_b.at(w).ty == Ty::Triple)
                w = op(Op::Add, m_b.emit(Op::Extract, Ty::Float, {w}, at, 0),
                       op(Op::Add, m_b.emit(Op::Extract, Ty::Float, {w}, at, 1),
                          m_b.emit(Op::Extract, Ty::Float, {w}, at, 2)));
            w = op(Op::Mul, w, reference(s, Ty::Float, at));
            amount = op(Op::Add, amount, m_b.emit(Op::Abs, Ty::Float, {w}, at));
        }
        amounts.push_back(amount);
        total = op(Op::Add, total, amount);
    }
    for (size_t k = 0; k < sites.size(); k++) {
        Ref w = gain;
        if (sites.size() > 1) {
            const Ref some = m_b.emit(Op::Gt, Ty::Bool, {total, m_b.constant(0.0f)}, at);
            const Ref equal = m_b.constant(1.0f / float(sites.size()));
            const Ref share =
                m_b.emit(Op::Select, Ty::Float, {some, op(Op::Div, amounts[k], total), equal}, at);
            w = op(Op::Mul, w, i.ty == Ty::Float ? share : m_b.splat(share, at));
        }
        if (m_sites[size_t(sites[k])].reference >= 0)
            w = finite(op(Op::Div, w, reference(sites[k], i.ty, at)), at);
        out[sites[k]] = w;
    }
}

} // namespace kanuka::sl::ir
