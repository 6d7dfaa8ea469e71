#include "python/bindings.h"
#include "python/surfaces.h"

namespace kanuka::python {

// kanuka.Error: message as "file:line:column: what", and its parts as attributes.
static void translate(const std::exception_ptr& pointer, void* payload) {
    auto* error_class = static_cast<PyObject*>(payload); // owned by the module
    try {
        std::rethrow_exception(pointer);
    } catch (const Error& error) {
        nb::object instance = nb::borrow(error_class)(std::string(error.what()));
        instance.attr("file") = error.where().file.str();
        instance.attr("line") = error.where().line;
        instance.attr("column") = error.where().column;
        instance.attr("exit_code") = int(error.code());
        PyErr_SetObject(error_class, instance.ptr());
    }
}

} // namespace kanuka::python

NB_MODULE(_native, m) {
    using namespace kanuka::python;
    m.doc() = "Kanuka's library. Import kanuka instead.";
    m.attr("__version__") = KANUKA_VERSION;
    nb::object error = nb::steal(PyErr_NewExceptionWithDoc(
        "kanuka.Error",
        "What stops a render: `file`, `line` and `column` say where, `exit_code` what a farm is told.",
        nullptr, nullptr));
    m.attr("Error") = error;
    nb::register_exception_translator(translate, error.ptr());

    bind_journal(m);
    bind_spectrum(m);
    bind_material(m);
    bind_camera(m);
    bind_node(m);
    bind_scene(m);
    bind_picture(m);
    bind_procedurals(m);
    bind_load(m);
    bind_session(m);
    bind_checkpoint(m);
    bind_shader(m);
    bind_lobe(m);
    bind_store(m);
    bind_surfaces(m);
    bind_texture(m);
}
