// Which session calls go to: the interface itself is global, RISpec's calls name no context.
#pragma once

#include <memory>
#include <string>

#include "ri/session.h"

namespace kanuka::ri {

// The session of RiBegin or RiContext; null = none. Who calls back into the program holds it.
std::shared_ptr<Session> current();

// While it lives calls go to another session.
class Redirect {
  public:
    explicit Redirect(std::shared_ptr<Session> session);
    ~Redirect();
    Redirect(const Redirect&) = delete;

  private:
    std::shared_ptr<Session> m_before;
};

// To the handler that was set outside of contexts.
void report_outside(RtInt code, RtInt severity, const std::string& message);

// RiOption before RiBegin: "rib" and "RI2RIB_Output" say what the next file looks like. False = it is none of
// those.
bool option_outside(const char* name, RtInt n, const RtToken tokens[], RtPointer parms[]);

// RiDeclare before RiBegin: for all contexts to come.
void declare_outside(const char* name, const char* declaration);

// A copy that stays: what C holds pointers to beyond RiEnd.
const char* keep_token(const char* text);

} // namespace kanuka::ri
