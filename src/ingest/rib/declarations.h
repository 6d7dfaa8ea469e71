// What a parameter's token means: the standard declarations of RISpec 3.2, Declare, and inline declarations.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "scene/values.h"

namespace kanuka::ingest {

struct Declaration {
    scene::Detail detail = scene::Detail::Uniform;
    scene::Type type = scene::Type::Float;
    int array_size = 1;
    bool declared_detail = false; // the class was written, not defaulted
    bool open_array = false;      // "type[]": of any length
};

struct InlineDeclaration {
    std::string_view name; // a view into the token
    Declaration declaration;
};

// "[class] type [ '[' n ']' ] name"; with `need_name` false the name may be missing (as in Declare). nullopt
// = not one; `problem` then says what is wrong with it.
std::optional<InlineDeclaration> parse_declaration(std::string_view text, bool need_name,
                                                   std::string& problem);

class Declarations {
  public:
    Declarations(); // the standard ones
    // `text`: as a scene wrote it; those are kept, for whoever makes RIB to be read here.
    void declare(std::string_view name, const Declaration& declaration, std::string_view text = {});
    const std::vector<std::string>& own() const { return m_own; } // name, text, name, text, …
    const Declaration* find(std::string_view name) const;
    // The declared name nearest to a misspelled one; empty = none is near.
    std::string_view nearest(std::string_view name) const;

  private:
    std::map<std::string, Declaration, std::less<>> m_map;                     // nothing is ever taken out
    mutable const std::pair<const std::string, Declaration>* m_last = nullptr; // found: it is asked for again
    std::vector<std::string> m_own;
};

} // namespace kanuka::ingest
