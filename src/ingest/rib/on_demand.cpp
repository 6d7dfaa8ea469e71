#include "ingest/rib/on_demand.h"

#include "ingest/rib/reader.h"

namespace kanuka::ingest {

OnDemand::OnDemand() = default;
OnDemand::~OnDemand() = default;

void OnDemand::take(std::shared_ptr<Reader> reader, std::shared_ptr<const Source> source) {
    m_reader = std::move(reader);
    m_source = std::move(source);
}

void OnDemand::add(const ProceduralCall& call, const Context& context, const Bounds3f& world) {
    // Blocks restore the state, so neighbours nearly always share one.
    const AttributeState& a = context.attributes;
    const auto same = [&](const State& s) {
        return s.before == a.shared && s.attributes.lights == a.lights && s.attributes.set == a.set &&
               s.attributes.u_basis == a.u_basis && s.attributes.v_basis == a.v_basis &&
               s.attributes.trim == a.trim && s.type == call.type && s.file == call.where.file;
    };
    if (!m_last || !same(*m_last)) {
        auto state = std::make_shared<State>();
        state->before = a.shared;
        state->attributes = a;
        state->type = call.type;
        state->file = call.where.file;
        m_last = std::move(state);
    }
    Item item;
    item.state = m_last;
    for (size_t r = 0; r < 3; r++)
        for (size_t c = 0; c < 4; c++)
            item.ctm[4 * r + c] = context.ctm.m[r][c];
    item.arguments = call.arguments;
    if (!call.parameters.values.empty())
        item.parameters = std::make_unique<scene::ValueList>(call.parameters);
    std::copy_n(call.bound.begin(), 6, item.bound.begin());
    item.line = call.where.line;
    item.column = call.where.column;
    item.depth = m_depth + 1;
    item.node = scene::numbered_node(m_parent, scene::NodeKind::Procedural, m_brought++);
    Delayed::add(world, item.node);
    m_items.push_back(std::move(item));
}

scene::Scene OnDemand::expand(std::span<const uint32_t> which) {
    Context& context = m_reader->context();
    context.reopen_world();
    for (const uint32_t i : which) {
        const Item& item = m_items[i];
        context.begin_delayed(item.node);
        m_parent = item.node;
        m_brought = 0;
        const State& state = *item.state;
        ProceduralCall call{state.type,
                            item.arguments,
                            {item.bound.begin(), item.bound.end()},
                            {state.file, item.line, item.column}};
        if (item.parameters)
            call.parameters = *item.parameters;
        if (item.depth > int(Reader::MaxArchiveDepth)) {
            context.reports.error("archive in itself", call.where,
                                  "Procedural \"" + call.type + "\" was left out: procedurals nest " +
                                      std::to_string(Reader::MaxArchiveDepth) + " deep at most");
            continue;
        }
        context.attributes = state.attributes;
        context.ctm = Transform();
        for (size_t r = 0; r < 3; r++)
            for (size_t c = 0; c < 4; c++)
                context.ctm.m[r][c] = item.ctm[4 * r + c];
        context.ctm_keys.clear();
        m_depth = item.depth;
        m_reader->resume(state.file, [&] { handlers::expand_procedural(context, call); });
        m_depth = 0;
    }
    return context.close_world();
}

} // namespace kanuka::ingest
