#include "ingest/rib/expansions.h"

#include <algorithm>

#include "ingest/rib/rib.h"
#include "scene/digest.h"

namespace kanuka::ingest {

// ---- of all frames

void Expansions::keep(const Key& key, Kept kept) {
    const uint64_t bytes = kept.text->size();
    if (const auto before = m_kept.find(key); before != m_kept.end()) {
        m_bytes -= before->second.text->size();
        m_kept.erase(before);
    }
    if (m_bytes + bytes > m_budget) // what neither this frame nor the one before has asked for goes
        std::erase_if(m_kept, [&](const auto& each) {
            const bool is_old = each.second.used + 1 < kept.used;
            m_bytes -= is_old ? each.second.text->size() : 0;
            return is_old;
        });
    if (m_bytes + bytes > m_budget)
        return;
    m_bytes += bytes;
    m_kept.emplace(key, std::move(kept));
}

// ---- of one

Expansions::Frame::Frame(std::shared_ptr<Expansions> all) : m_all(std::move(all)) {
    const std::lock_guard lock(m_all->m_mutex);
    m_number = ++m_all->m_frames;
}

Expansions::Frame::Answer Expansions::Frame::answer(const ProceduralRequest& r,
                                                    const std::function<Answer()>& ask) {
    const std::string name = r.type + (r.arguments.empty() ? "" : " " + r.arguments[0]);
    const Asked asked = {digest_of(r.type, r.arguments, r.in_object, r.may_run), digest_of(r.parameters),
                         digest_of(r.bound), digest_of(r.folders), digest_of(r.declared)};
    const Digest digest = digest_of(asked);
    std::unique_lock lock(m_all->m_mutex);
    const Key key{digest, m_alike[digest]++};
    const std::pair<std::string, uint32_t> by_name{name, m_by_name[name]++};
    const auto kept = m_all->m_kept.find(key);
    if (kept != m_all->m_kept.end() && (!kept->second.detail || *kept->second.detail == r.detail)) {
        kept->second.used = m_number;
        m_all->m_asked.insert_or_assign(by_name, asked);
        m_counts.kept++;
        const Text text = kept->second.text;
        lock.unlock();
        return *text;
    }
    lock.unlock();
    Answer answer = ask();
    lock.lock();
    if (!answer) {
        m_alike[digest]--, m_by_name[name]--;
        return answer;
    }
    const auto before = m_all->m_asked.find(by_name);
    const auto had = m_all->m_kept.find(key); // others may have asked meanwhile
    m_counts.asked++;
    explain(r, name, asked, before == m_all->m_asked.end() ? nullptr : &before->second,
            had == m_all->m_kept.end() ? nullptr : &had->second);
    m_all->m_asked.insert_or_assign(by_name, asked);
    const std::optional<double> detail = r.uses_detail->load() ? std::optional(r.detail) : std::nullopt;
    m_all->keep(key, {std::make_shared<const std::string>(*answer), detail, m_number});
    return answer;
}

void Expansions::Frame::explain(const ProceduralRequest& request, const std::string& name, const Asked& asked,
                                const Asked* before, const Kept* kept) {
    if (m_number == 1)
        return;
    if (!before)
        return note("new", name);
    bool says = false;
    for (size_t i = 0; i < Parts.size(); i++)
        if (asked[i] != (*before)[i])
            note(Parts[i], name), says = true;
    if (kept && kept->detail && *kept->detail != request.detail)
        note("detail", name), says = true;
    if (!says)
        note("no room", name);
}

void Expansions::Frame::note(const std::string& why, const std::string& name) {
    const auto known =
        std::ranges::find_if(m_reasons, [&](const Reason& reason) { return reason.why == why; });
    if (known == m_reasons.end())
        m_reasons.push_back({why, 1, name});
    else
        known->procedurals++;
}

Expansions::Frame::Counts Expansions::Frame::counts() const {
    const std::lock_guard lock(m_all->m_mutex);
    return m_counts;
}

std::vector<Expansions::Frame::Reason> Expansions::Frame::reasons() const {
    const std::lock_guard lock(m_all->m_mutex);
    return m_reasons;
}

} // namespace kanuka::ingest
