// What the functions of ri.h do: fill in Calls, and hand them to the session that is current.
#pragma once

#include <cstdarg>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <vector>

#include "ingest/rib/call.h"
#include "ingest/rib/declarations.h"
#include "ri.h"

namespace kanuka::ri {

class Session;

// One call being filled in, argument by argument in the table's order.
class Caller {
  public:
    Caller(Session& session, const char* request);
    void number(double value);
    void text(const char* text);
    void handle(RtPointer handle);               // one that a call returned
    void new_handle(const char* name = nullptr); // null: the next number
    void filter(RtFilterFunc function);          // by its name
    // After all arguments: a filter of the program's own becomes a table of its values, where there can be
    // one.
    void settle_filter();
    void floats(const RtFloat* values, long count);
    void floats(std::initializer_list<RtFloat> values) { floats(values.begin(), long(values.size())); }
    void ints(const RtInt* values, long count);
    void strings(const RtToken* values, long count);
    // `vertices`: of a primitive whose arguments do not tell how many there are.
    void parameters(RtInt n, const RtToken tokens[], RtPointer parms[], long vertices);

    ingest::Call& call() { return m_call; }
    RtPointer result = nullptr;
    bool left_out = false; // an argument cannot be, and was reported

  private:
    ingest::Argument& next();
    // Of a name that stands alone: by the program's own declaration, the request's, or everybody's.
    std::optional<ingest::Declaration> declaration(const std::string& name) const;
    Session& m_session;
    ingest::Call m_call;
    size_t m_argument = 0;
    RtFilterFunc m_own_filter = nullptr;
};

// Fills in a call and makes it. Errors go to the error handler; none leaves through C.
RtPointer make_call(const char* request, const std::function<void(Caller&)>& fill);

// The tokens and values of a variable argument list, up to RI_NULL.
class Listed {
  public:
    explicit Listed(std::va_list list);
    RtInt count() const { return RtInt(m_tokens.size()); }
    RtToken* tokens() { return m_tokens.data(); }
    RtPointer* values() { return m_values.data(); }

  private:
    std::vector<RtToken> m_tokens;
    std::vector<RtPointer> m_values;
};

long samples(); // numbers of a colour: RiColorSamples
long sum(const RtInt* values, long count);
// Of records of `stride` numbers each: the sum of the k-th ones.
long sum_of_each(const RtInt* values, long records, int stride, int k);

} // namespace kanuka::ri
