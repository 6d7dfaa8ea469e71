#include "render/instance_values.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "scene/text_column.h"

namespace kanuka::render {

InstanceValues::InstanceValues(std::span<const scene::Group::Instances* const> lists,
                               std::vector<InstanceVariable> variables)
    : m_variables(std::move(variables)), m_texts(m_variables.size()) {
    for (size_t k = 0; k < m_variables.size(); k++) {
        for (size_t c = 0; c < m_variables[k].width() && m_variables[k].is_exact(); c++)
            m_exact.push_back(m_rows.width + c);
        m_rows.width += m_variables[k].width();
        if (m_variables[k].is_text())
            number_texts(lists, k);
    }
    for (size_t k = 0; k < m_variables.size() && !m_exact.empty(); k++)
        m_exact.push_back(m_rows.width + k);
    m_rows.width += m_variables.size();
    for (const scene::Group::Instances* list : lists)
        add_rows(*list);
}

void InstanceValues::number_texts(std::span<const scene::Group::Instances* const> lists, size_t variable) {
    const auto less = [](Value a, Value b) { return std::ranges::lexicographical_compare(a, b); };
    Texts& texts = m_texts[variable];
    for (const scene::Group::Instances* list : lists)
        if (const scene::Value* said = list->variation.primvars.find(m_variables[variable].name))
            for (size_t at = 0, width = scene::width_of(*said); at < said->strings.size(); at += width)
                texts.values.emplace_back(said->strings.data() + at, width);
    std::ranges::sort(texts.values, less);
    const auto more =
        std::ranges::unique(texts.values, [](Value a, Value b) { return std::ranges::equal(a, b); });
    texts.values.erase(more.begin(), more.end());
    if (texts.values.size() > size_t(1) << 24) // what floats count to
        throw Error("instances say more than 16 million different texts of the variable \"" +
                    m_variables[variable].name + "\"");
    for (const scene::Group::Instances* list : lists)
        if (const scene::Value* said = list->variation.primvars.find(m_variables[variable].name)) {
            std::vector<float>& numbers = texts.numbers[said];
            for (size_t at = 0, width = scene::width_of(*said); at < said->strings.size(); at += width) {
                const Value own(said->strings.data() + at, width);
                numbers.push_back(
                    float(std::ranges::lower_bound(texts.values, own, less) - texts.values.begin()));
            }
        }
}

InstanceValues::Source InstanceValues::source_of(const scene::Variation& variation, size_t variable) const {
    const InstanceVariable& of = m_variables[variable];
    if (of.name == VariantVariable) {
        const auto& v = variation.variant;
        return {v.empty() ? nullptr : v.data(), nullptr, v.size() == 1 ? 0u : 1u};
    }
    const scene::Value* value = variation.primvars.find(of.name);
    if (!value)
        return {};
    if (of.is_text())
        return {m_texts[variable].numbers.at(value).data(),
                value->ints.empty() ? nullptr : value->ints.data(), 0};
    return {value->floats.data(), nullptr, value->floats.size() == of.width() ? 0 : of.width()};
}

void InstanceValues::add_rows(const scene::Group::Instances& list) {
    std::vector<Source> sources;
    for (size_t k = 0; k < m_variables.size(); k++)
        sources.push_back(source_of(list.variation, k));
    const bool any = std::ranges::any_of(sources, [](const Source& s) { return s.numbers; });
    std::vector<float> row(m_rows.width);
    for (size_t i = 0; i < list.count(); i++) {
        size_t at = 0, flag = row.size() - m_variables.size();
        for (size_t k = 0; k < sources.size(); at += m_variables[k].width(), k++) {
            const Source& source = sources[k];
            if (!source.numbers)
                continue;
            const float* first =
                source.numbers + (source.index ? size_t(source.index[i]) : source.stride * i);
            for (size_t c = 0; c < m_variables[k].width(); c++)
                row[at + c] = first[c] + 0.0f; // one zero
            row[flag + k] = 1;
        }
        m_row_of.push_back(any ? int32_t(m_rows.count()) : -1);
        if (any)
            m_rows.values.insert(m_rows.values.end(), row.begin(), row.end());
    }
}

scene::ValueList InstanceValues::values_of(std::span<const float> row) const {
    scene::ValueList list;
    size_t at = 0, flag = row.size() - m_variables.size();
    for (size_t k = 0; k < m_variables.size(); at += m_variables[k].width(), k++) {
        const InstanceVariable& variable = m_variables[k];
        if (row[flag + k] < 0.5f)
            continue;
        scene::Value value{.name = variable.name,
                           .type = variable.type,
                           .detail = scene::Detail::Constant,
                           .array_size = variable.array_size,
                           .where = variable.where};
        const auto numbers = row.subspan(at, variable.width());
        if (variable.is_text()) {
            const Value texts = m_texts[k].values[size_t(numbers[0])];
            value.strings = std::vector<std::string>(texts.begin(), texts.end());
        } else {
            value.floats = std::vector<float>(numbers.begin(), numbers.end());
        }
        list.set(std::move(value));
    }
    return list;
}

std::vector<float> InstanceValues::scales_of(const Rows& rows) const {
    std::vector<float> scales;
    for (const InstanceVariable& variable : m_variables) {
        const size_t first = scales.size();
        float range = 0;
        for (size_t c = first; c < first + variable.width(); c++) {
            float lo = INFINITY, hi = -INFINITY;
            for (size_t i = 0; i < rows.count(); i++)
                lo = std::min(lo, rows[i][c]), hi = std::max(hi, rows[i][c]);
            range = std::max(range, hi - lo);
        }
        const float scale = range > 0 ? range : 1;
        scales.insert(scales.end(), variable.width(), variable.is_exact() ? INFINITY : scale);
    }
    scales.resize(rows.width, 1e-3f);
    return scales;
}

std::vector<uint32_t> InstanceValues::kinds_of(const Rows& rows) const {
    if (m_exact.empty())
        return {};
    Rows exact{m_exact.size(), {}};
    for (size_t i = 0; i < rows.count(); i++)
        for (const size_t c : m_exact)
            exact.values.push_back(rows[i][c]);
    std::vector<uint32_t> kinds, counts;
    distinct_rows(exact, kinds, counts);
    return kinds;
}

bool InstanceValues::is_same_kind(std::span<const float> a, std::span<const float> b) const {
    return std::ranges::all_of(m_exact, [&](size_t c) { return a[c] == b[c]; });
}

int InstanceValues::blended_column() const {
    int found = -1;
    size_t at = 0;
    for (const InstanceVariable& variable : m_variables) {
        if (!variable.is_exact()) {
            if (found >= 0 || variable.width() != 1 || variable.name == VariantVariable)
                return -1;
            found = int(at);
        }
        at += variable.width();
    }
    return found;
}

namespace {

// As many values of the number as there is room for, evenly from the least to the greatest: of each kind, so
// that nothing is blended with what is of another.
Approximation blend(const Rows& rows, size_t column, std::span<const uint32_t> kinds, size_t kinds_count,
                    size_t room) {
    Approximation made{.rows = {rows.width, {}}, .blended = true};
    made.number.resize(rows.count());
    for (size_t kind = 0; kind < kinds_count; kind++) {
        const auto is_of_kind = [&](size_t i) { return kinds.empty() || kinds[i] == kind; };
        float lo = INFINITY, hi = -INFINITY;
        size_t any = 0;
        for (size_t i = 0; i < rows.count(); i++)
            if (is_of_kind(i))
                lo = std::min(lo, rows[i][column]), hi = std::max(hi, rows[i][column]), any = i;
        const float first = float(made.rows.count());
        const size_t steps = hi > lo ? room / kinds_count : 1;
        const float last = float(steps - 1);
        for (size_t i = 0; i < rows.count(); i++)
            if (is_of_kind(i))
                made.number[i] = first + (hi > lo ? (rows[i][column] - lo) / (hi - lo) * last : 0);
        for (size_t k = 0; k < steps; k++) {
            std::vector<float> row(rows[any].begin(), rows[any].end());
            const float x = steps > 1 ? float(k) / last : 0;
            row[column] = (1 - x) * lo + x * hi;
            made.rows.values.insert(made.rows.values.end(), row.begin(), row.end());
        }
    }
    return made;
}

} // namespace

Approximation approximated(const InstanceValues& values, const Rows& rows, std::span<const uint32_t> weights,
                           size_t room) {
    Approximation made;
    if (rows.count() <= room) {
        made.number.resize(rows.count());
        std::iota(made.number.begin(), made.number.end(), 0.0f);
        made.rows = rows;
        return made;
    }
    const std::vector<uint32_t> kinds = values.kinds_of(rows);
    const size_t kinds_count = kinds.empty() ? 1 : 1 + std::ranges::max(kinds);
    if (const int column = values.blended_column(); column >= 0 && room / kinds_count > 1)
        return blend(rows, size_t(column), kinds, kinds_count, room);
    std::vector<uint32_t> nearest;
    made.rows = cluster(rows, weights, values.scales_of(rows), kinds, room, nearest);
    made.number.assign(nearest.begin(), nearest.end());
    for (size_t i = 0; i < rows.count(); i++)
        if (!values.is_same_kind(rows[i], made.rows[nearest[i]]))
            made.replaced += weights[i];
    return made;
}

} // namespace kanuka::render
