#include "shade/coshaders.h"

#include <algorithm>
#include <map>

#include "scene/layers.h"

namespace kanuka::shade {

namespace {

using scene::ShaderRef;

// The values of a text parameter: those given, or its default.
std::vector<std::string> texts(const sl::Parameter& parameter, const ShaderRef& ref) {
    const scene::Value* v = ref.parameters.find(parameter.name);
    if (v && v->type == scene::Type::String)
        return {v->strings.begin(), v->strings.end()};
    return parameter.strings;
}

class Connect {
  public:
    Connect(const LoadCoShader& load, Journal& journal) : m_load(load), m_journal(journal) {}

    // Where handles are looked up: lists with what their handles begin with.
    struct Scope {
        const std::vector<ShaderRef>* list;
        std::string prefix;
    };
    using Scopes = std::vector<Scope>;

    Network run(const sl::Shader& shader, const ShaderRef& ref, const Scopes& scopes) {
        Network network;
        // All layers run, in their order, connected or not: each may set Ci or move P.
        for (const std::string& handle : scene::layers(ref))
            if (const int target = resolve(handle, scopes); target >= 0 && m_nodes[size_t(target)].found)
                m_nodes[size_t(target)].found->layer = true;
        network.connections = connections(shader, ref, scopes, "shader \"" + ref.name + "\"");
        // Declaration order, outermost list first: what getshaders() gives.
        std::vector<int> order(m_nodes.size());
        for (size_t i = 0; i < order.size(); i++)
            order[i] = int(i);
        std::stable_sort(order.begin(), order.end(),
                         [&](int a, int b) { return m_nodes[size_t(a)].rank < m_nodes[size_t(b)].rank; });
        for (const int i : order)
            if (m_nodes[size_t(i)].found)
                network.coshaders.push_back(std::move(*m_nodes[size_t(i)].found));
        return network;
    }

  private:
    struct Node {
        std::optional<CoShader> found; // none: reported
        bool open = false;             // its own connections are being followed
        std::pair<size_t, size_t> rank;
    };

    // The co-shader of a handle; -1 = there is none.
    int resolve(const std::string& handle, const Scopes& scopes) {
        for (size_t s = 0; s < scopes.size(); s++)
            for (size_t i = 0; i < scopes[s].list->size(); i++)
                if ((*scopes[s].list)[i].handle == handle)
                    return node((*scopes[s].list)[i], scopes, s, i);
        return -1;
    }

    int node(const ShaderRef& ref, const Scopes& scopes, size_t level, size_t place) {
        const auto [it, fresh] = m_index.try_emplace(&ref, int(m_nodes.size()));
        const int index = it->second;
        if (!fresh)
            return index;
        m_nodes.emplace_back();
        m_nodes.back().rank = {scopes.size() - level, place};
        std::optional<CoShader> found = m_load(ref);
        if (!found)
            return index;
        found->handle = scopes[level].prefix + ref.handle;
        for (const sl::Parameter& p : found->shader->parameters())
            if (p.name == "__category")
                for (const std::string& c : texts(p, ref))
                    found->category += (found->category.empty() ? "" : ",") + c;
        const std::string name = found->handle;
        const std::shared_ptr<const sl::Shader> shader = found->shader;
        m_nodes[size_t(index)].found = std::move(found);
        m_nodes[size_t(index)].open = true;
        m_path.push_back(index);
        Scopes inner(scopes.begin() + std::ptrdiff_t(level), scopes.end());
        inner.insert(inner.begin(), {&ref.coshaders, name + "/"});
        std::vector<sl::Connection> own = connections(*shader, ref, inner, "co-shader \"" + name + "\"");
        m_path.pop_back();
        m_nodes[size_t(index)].open = false;
        m_nodes[size_t(index)].found->connections = std::move(own);
        return index;
    }

    std::vector<sl::Connection> connections(const sl::Shader& shader, const ShaderRef& ref,
                                            const Scopes& scopes, const std::string& who) {
        std::vector<sl::Connection> all;
        if (shader.coshaders() == sl::CoShaderUse::Any)
            for (size_t s = scopes.size(); s-- > 0;)
                for (size_t i = 0; i < scopes[s].list->size(); i++)
                    node((*scopes[s].list)[i], scopes, s, i);
        for (const sl::Parameter& p : shader.parameters()) {
            if (p.type == sl::Type::Shader)
                all.push_back(connect(p, ref, scopes, who));
            // A text is connected if it is a handle: getshader (name).
            if (p.type != sl::Type::String || shader.coshaders() != sl::CoShaderUse::Any)
                continue;
            sl::Connection c{p.name, texts(p, ref)};
            bool any = false;
            for (std::string& handle : c.handles) {
                const int target = resolve(handle, scopes);
                any = any || target >= 0;
                handle = target >= 0 ? handle_of(target) : std::string();
            }
            if (any)
                all.push_back(std::move(c));
        }
        for (const scene::Value& v : ref.parameters.values)
            if (scene::is_connection(v))
                connect_output(shader, ref, v, scopes, who, all);
        return all;
    }

    // A parameter that has its value from a layer's output.
    void connect_output(const sl::Shader& shader, const ShaderRef& ref, const scene::Value& v,
                        const Scopes& scopes, const std::string& who, std::vector<sl::Connection>& all) {
        const Location& where = v.where.line > 0 ? v.where : ref.where;
        const std::string name = v.name.substr(1), &handle = v.strings[0], &output = v.strings[1];
        const auto left_out = [&](const std::string& why) {
            m_journal.warning(where, "parameter \"" + name + "\" of " + who + " is not connected to \"" +
                                         output + "\" of layer \"" + handle + "\": " + why +
                                         ". It keeps its own value");
        };
        const auto find = [](const sl::Shader& s, const std::string& wanted) -> const sl::Parameter* {
            for (const sl::Parameter& p : s.parameters())
                if (p.name == wanted)
                    return &p;
            return nullptr;
        };
        const auto names = [](const sl::Shader& s, bool outputs) {
            std::string list;
            for (const sl::Parameter& p : s.parameters())
                if (!outputs || p.output)
                    list += (list.empty() ? "" : ", ") + p.name;
            return list.empty() ? std::string("there are none") : "there are " + list;
        };
        const sl::Parameter* to = find(shader, name);
        if (!to)
            return left_out("there is no such parameter; " + names(shader, false));
        const int target = resolve(handle, scopes);
        if (target < 0)
            return left_out("there is no such layer before it");
        if (!m_nodes[size_t(target)].found) // reported
            return;
        if (m_nodes[size_t(target)].open)
            return left_out("the layers are connected in a circle");
        const sl::Shader& layer = *m_nodes[size_t(target)].found->shader;
        const sl::Parameter* from = find(layer, output);
        if (!from || !from->output)
            return left_out((from ? "that is no output parameter; " : "it has no such parameter; ") +
                            names(layer, true));
        const auto array = [](const sl::Parameter& p) { return p.array_size > 0 || p.resizable; };
        const auto triple = [](sl::Type t) { return sl::components(t) == 3 && t < sl::Type::Matrix; };
        // Arrays go element by element; one of fixed length needs as many.
        const bool lists = array(*to) && array(*from);
        const bool lengths =
            !lists || to->resizable || (!from->resizable && from->array_size == to->array_size);
        const bool fits = to->type == from->type || (triple(to->type) && triple(from->type)) ||
                          (triple(to->type) && from->type == sl::Type::Float && !lists);
        const auto type = [&](const sl::Parameter& p) {
            return std::string(sl::type_name(p.type)) + (!array(p) ? ""
                                                         : p.resizable
                                                             ? "[]"
                                                             : "[" + std::to_string(p.array_size) + "]");
        };
        if (!fits || array(*to) != array(*from) || !lengths || to->type > sl::Type::String)
            return left_out("a " + type(*from) + " cannot become a " + type(*to));
        m_nodes[size_t(target)].found->layer = true;
        all.push_back({name, {handle_of(target)}, output});
    }

    std::string handle_of(int target) const {
        const Node& n = m_nodes[size_t(target)];
        return n.found ? n.found->handle : std::string();
    }

    sl::Connection connect(const sl::Parameter& p, const ShaderRef& ref, const Scopes& scopes,
                           const std::string& who) {
        const scene::Value* given = ref.parameters.find(p.name);
        const Location& where = given && given->where.line > 0 ? given->where : ref.where;
        sl::Connection c{p.name, texts(p, ref)};
        for (std::string& handle : c.handles) {
            if (handle.empty() || handle == "null") {
                handle.clear();
                continue;
            }
            const int target = resolve(handle, scopes);
            if (target < 0) {
                std::string have;
                for (const Scope& s : scopes)
                    for (const ShaderRef& known : *s.list)
                        have += (have.empty() ? "" : ", ") + known.handle;
                m_journal.warning(where, "parameter \"" + p.name + "\" of " + who + " names co-shader \"" +
                                             handle + "\", which is not declared here; there " +
                                             (have.empty() ? "are none" : "is " + have) + ". It is null");
                handle.clear();
            } else if (m_nodes[size_t(target)].open) {
                std::string path;
                for (auto i = std::find(m_path.begin(), m_path.end(), target); i != m_path.end(); ++i)
                    path += handle_of(*i) + " -> ";
                m_journal.error(where, "co-shaders are connected in a circle: " + path + handle_of(target) +
                                           "; parameter \"" + p.name + "\" of " + who +
                                           ", which closes it, is null");
                handle.clear();
            } else {
                handle = handle_of(target);
            }
        }
        return c;
    }

    const LoadCoShader& m_load;
    Journal& m_journal;
    std::vector<Node> m_nodes;
    std::map<const ShaderRef*, int> m_index;
    std::vector<int> m_path; // of what is being followed
};

} // namespace

Network connect_coshaders(const sl::Shader& shader, const ShaderRef& ref,
                          const std::vector<const std::vector<ShaderRef>*>& scope, const LoadCoShader& load,
                          Journal& journal) {
    Connect::Scopes scopes;
    for (const std::vector<ShaderRef>* list : scope)
        scopes.push_back({list, ""});
    return Connect(load, journal).run(shader, ref, scopes);
}

std::string describe(const Network& network, sl::CompileOptions& options) {
    std::string key;
    const auto add = [&](const std::vector<sl::Connection>& connections) {
        for (const sl::Connection& c : connections) {
            key += '\n' + c.parameter;
            for (const std::string& handle : c.handles)
                key += '\0' + handle;
            key += '\0' + c.output;
        }
    };
    options.connections = network.connections;
    add(network.connections);
    for (const CoShader& c : network.coshaders) {
        key += (c.layer ? "\n\n:" : "\n\n") + c.handle + '\n' + c.path + '\n' + c.category;
        add(c.connections);
        options.coshaders.push_back({c.handle, c.path, {}, c.category, c.connections, c.layer});
    }
    return key;
}

} // namespace kanuka::shade
