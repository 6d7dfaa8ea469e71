#include "python/messages.h"

namespace kanuka::python {

static nb::object messages() {
    return nb::module_::import_("kanuka.messages");
}

void warn(const std::string& text) {
    messages().attr("warn")(text);
}

void log(const std::string& text) {
    messages().attr("log")(text);
}

void tell(const Journal& journal, const std::string& raised) {
    nb::list list;
    for (const Journal::Entry& e : journal.entries())
        if (e.message != raised)
            list.append(nb::cast(e));
    if (nb::len(list) > 0)
        messages().attr("tell")(list);
}

} // namespace kanuka::python
