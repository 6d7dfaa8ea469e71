// Calls from programs, by the C binding: no file is being read, so what changes the flow of requests is kept
// here from call to call.

#include "ingest/rib/handlers.h"
#include "ingest/rib/reader.h"

namespace kanuka::ingest {

void Reader::call(Call& call) {
    if (records(call) || passes_over(call))
        return;
    if (!m_context.options.rgb_from_samples.empty())
        std::erase_if(call.params.values, [&](scene::Value& v) {
            if (v.type != scene::Type::Color)
                return false;
            std::vector<float> numbers(v.floats.begin(), v.floats.end());
            const bool colors = colors_of_samples(call, v, numbers);
            v.floats = std::move(numbers);
            return !colors;
        });
    m_context.execute(call);
}

bool Reader::passes_over(const Call& call) {
    if (!m_passing)
        return false;
    const std::string_view name = call.spec->name;
    if (name == m_passing->begin) {
        m_passing->depth++;
    } else if (m_passing->depth > 0) {
        m_passing->depth -= name == m_passing->stops.back();
    } else if (std::ranges::find(m_passing->stops, name) != m_passing->stops.end()) {
        m_passing.reset();
        return false;
    }
    return true;
}

bool Reader::record_line(const std::string& text) {
    if (m_recording)
        m_recording->writer->comment(text);
    return m_recording != nullptr;
}

bool Reader::record_text(const std::string& text) {
    if (m_recording)
        m_recording->writer->verbatim(text);
    return m_recording != nullptr;
}

bool Reader::records(const Call& call) {
    if (!m_recording)
        return false;
    const std::string_view name = call.spec->name;
    m_recording->depth += name == "ArchiveBegin";
    if (name != "ArchiveEnd" || m_recording->depth > 0) {
        m_recording->depth -= name == "ArchiveEnd";
        m_recording->writer->call(call);
        return true;
    }
    m_recording->writer->flush();
    const std::string archive = m_recording->name;
    const auto source = Source::from_text(std::move(m_recording->text), archive);
    m_inline_archives[archive] = {source, 0, source->text().size(), std::make_shared<BinaryDefinitions>()};
    m_recording.reset();
    return true;
}

} // namespace kanuka::ingest
