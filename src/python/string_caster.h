// Texts between Python and C++. Names in scenes are bytes, of whatever encoding their author's machine had:
// what is no UTF-8 is shown as \xNN, and never an exception in place of the message that names it. Files that
// Python names keep their bytes.
#pragma once

#include <string>

#include <nanobind/nanobind.h>

NAMESPACE_BEGIN(NB_NAMESPACE)
NAMESPACE_BEGIN(detail)

template <>
struct type_caster<std::string> {
    NB_TYPE_CASTER(std::string, const_name("str"))

    bool from_python(handle source, uint32_t, cleanup_list*) noexcept {
        if (!PyUnicode_Check(source.ptr()))
            return false;
        PyObject* bytes = PyUnicode_AsEncodedString(source.ptr(), "utf-8", "surrogateescape");
        if (!bytes) {
            PyErr_Clear();
            return false;
        }
        value.assign(PyBytes_AS_STRING(bytes), size_t(PyBytes_GET_SIZE(bytes)));
        Py_DECREF(bytes);
        return true;
    }
    static handle from_cpp(const std::string& text, rv_policy, cleanup_list*) noexcept {
        return PyUnicode_DecodeUTF8(text.data(), Py_ssize_t(text.size()), "backslashreplace");
    }
};

NAMESPACE_END(detail)
NAMESPACE_END(NB_NAMESPACE)
