// What Python users are told: kanuka/messages.py has the words for it, warnings and the logger.
#pragma once

#include "python/bindings.h"

namespace kanuka::python {

// A kanuka.Warning at the line that called.
void warn(const std::string& text);
// To the logger, for who wants to know.
void log(const std::string& text);
// What a journal holds: warnings and errors as warnings, the rest to the logger. `raised` is what an
// exception says already.
void tell(const Journal& journal, const std::string& raised = "");

// The messages of one call: the caller's journal has them, or else they are told.
struct Messages {
    explicit Messages(std::shared_ptr<Journal> given)
        : tells(!given), journal(given ? std::move(given) : std::make_shared<Journal>()) {}
    void tell(const std::string& raised = "") const {
        if (tells)
            python::tell(*journal, raised);
    }
    bool tells;
    std::shared_ptr<Journal> journal;
};

} // namespace kanuka::python
