// Functions whose arguments are converted by name: what does not fit is told with the argument's name, what
// it takes and what was given, where nanobind by itself would list the whole signature.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <type_traits>
#include <vector>

#include <nanobind/stl/array.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "python/bindings.h"

namespace kanuka::python {

// ---- types as Python's annotations write them -------------------------------------------------------------

template <class T>
struct TypeText { // of classes that are bound
    static std::string text() {
        const nb::handle type = nb::type<T>();
        return type.is_valid() ? nb::cast<std::string>(type.attr("__name__")) : "object";
    }
};
template <class T>
std::string type_text() {
    using V = std::remove_cvref_t<std::remove_pointer_t<std::remove_cvref_t<T>>>;
    if constexpr (std::is_void_v<V>)
        return "None";
    else if constexpr (std::is_same_v<V, bool>)
        return "bool";
    else if constexpr (std::is_integral_v<V>)
        return "int";
    else if constexpr (std::is_floating_point_v<V>)
        return "float";
    else if constexpr (std::is_same_v<V, std::string>)
        return "str";
    else if constexpr (std::is_same_v<V, std::filesystem::path>)
        return "str | os.PathLike";
    else if constexpr (std::is_same_v<V, nb::dict>)
        return "dict";
    else if constexpr (std::is_same_v<V, nb::list>)
        return "list";
    else if constexpr (std::is_same_v<V, nb::bytes>)
        return "bytes";
    else if constexpr (std::is_base_of_v<nb::handle, V>)
        return "object";
    else
        return TypeText<V>::text();
}
template <class T>
struct TypeText<std::optional<T>> {
    static std::string text() { return type_text<T>() + " | None"; }
};
template <class T>
struct TypeText<std::shared_ptr<T>> {
    static std::string text() { return type_text<T>(); }
};
template <class T>
struct TypeText<std::vector<T>> {
    static std::string text() { return "Sequence[" + type_text<T>() + "]"; }
};
template <class... T>
std::string tuple_text() {
    std::string all;
    ((all += (all.empty() ? "" : ", ") + type_text<T>()), ...);
    return "tuple[" + all + "]";
}
template <class A, class B>
struct TypeText<std::pair<A, B>> {
    static std::string text() { return tuple_text<A, B>(); }
};
template <class... T>
struct TypeText<std::tuple<T...>> {
    static std::string text() { return tuple_text<T...>(); }
};
template <class T, size_t N>
struct TypeText<std::array<T, N>> {
    static std::string text() {
        std::string all = type_text<T>();
        for (size_t i = 1; i < N; i++)
            all += ", " + type_text<T>();
        return "tuple[" + all + "]";
    }
};
template <class K, class V>
struct TypeText<std::map<K, V>> {
    static std::string text() { return "dict[" + type_text<K>() + ", " + type_text<V>() + "]"; }
};

// ---- one argument -----------------------------------------------------------------------------------------

// TypeError, or ValueError for an int that is too large for where it goes: "name: expected float, got str
// 'x'".
[[noreturn]] void wrong_argument(const std::string& name, const std::string& expected, nb::handle given);

template <class T>
constexpr bool IsShared = false;
template <class T>
constexpr bool IsShared<std::shared_ptr<T>> = true;

// `value` as a T. Classes that are bound come as references to what Python holds; shared ones may be None
// where that is the default.
template <class T>
decltype(auto) argument(nb::handle value, const char* name, bool none = false) {
    using V = std::remove_cvref_t<T>;
    if constexpr (std::is_same_v<V, nb::handle>) {
        return V(value);
    } else if constexpr (std::is_base_of_v<nb::handle, V>) {
        if (!nb::isinstance<V>(value))
            wrong_argument(name, type_text<V>(), value);
        return nb::borrow<V>(value);
    } else if constexpr (std::is_pointer_v<V> || nb::detail::is_base_caster_v<nb::detail::make_caster<V>>) {
        using Bound = std::remove_cv_t<std::remove_pointer_t<V>>;
        const bool none = value.is_none();
        if (none ? !std::is_pointer_v<V> : !nb::isinstance<Bound>(value))
            wrong_argument(name, type_text<V>(), value);
        if constexpr (std::is_pointer_v<V>)
            return none ? V(nullptr) : static_cast<V>(&nb::cast<Bound&>(value));
        else
            return nb::cast<Bound&>(value);
    } else {
        if (IsShared<V> && value.is_none() && !none)
            wrong_argument(name, type_text<V>(), value);
        try {
            return nb::cast<V>(value);
        } catch (const nb::cast_error&) {
        } catch (nb::python_error&) { // an __index__ or __fspath__ that raises
        }
        wrong_argument(name, type_text<V>(), value);
    }
}

// What a call was given for a parameter of type T, not looked at yet.
template <class T>
struct Given {
    nb::handle value;
};

} // namespace kanuka::python

template <class T>
struct nanobind::detail::type_caster<kanuka::python::Given<T>> {
    NB_TYPE_CASTER(kanuka::python::Given<T>, const_name("object"))
    bool from_python(handle source, uint32_t, cleanup_list*) noexcept {
        value.value = source;
        return true;
    }
};

namespace kanuka::python {

// ---- functions --------------------------------------------------------------------------------------------

namespace arguments {

template <class T>
constexpr bool IsVariadic = std::is_same_v<T, nb::kwargs> || std::is_same_v<T, const nb::kwargs&>;
template <bool AsItIs, class T>
using Taken = std::conditional_t<AsItIs || IsVariadic<T>, T, Given<T>>;

struct Name {
    const char* name = nullptr;
    bool none = false;
};

template <bool AsItIs, class T>
decltype(auto) pass(Taken<AsItIs, T>& given, const Name& name) {
    if constexpr (std::is_same_v<Taken<AsItIs, T>, T>)
        return static_cast<T&&>(given);
    else
        return argument<T>(given.value, name.name, name.none);
}

template <size_t Self, class F, class R, class... A, size_t... I>
auto by_name(F f, const std::array<Name, sizeof...(A) + 1>& names, std::function<R(A...)>*,
             std::index_sequence<I...>) {
    return
        [f, names](Taken<(I < Self), A>... given) -> R { return f(pass<(I < Self), A>(given, names[I])...); };
}

// None reaches the conversion, too, and is told by name where it does not fit.
template <class E>
decltype(auto) with_none(const E& extra) {
    if constexpr (nb::detail::arg_traits<E>::is_arg) {
        constexpr uint32_t flags = nb::detail::arg_traits<E>::flags | nb::detail::cast_flags::accepts_none;
        if constexpr (nb::detail::arg_traits<E>::has_default)
            return nb::arg_v_t<flags, false>(nb::arg(extra.name_), nb::object(extra.value));
        else
            return nb::arg_t<flags, false>(nb::arg(extra.name_));
    } else {
        return extra;
    }
}

struct Parameter {
    std::string name, type;
    nb::handle fallback; // null = it has to be given
};
// "def name(self, a: int, *, b: str = '') -> None"
std::string signature(const char* name, bool method, const std::vector<Parameter>& parameters,
                      size_t before_keywords, const std::string& result);

template <class Owner, class F, class R, class... A, class... Extra>
void define(Owner& owner, const char* name, F f, std::function<R(A...)>* call, const Extra&... extra) {
    constexpr size_t named = (size_t(nb::detail::arg_traits<Extra>::is_arg) + ... + 0);
    constexpr size_t self = sizeof...(A) - named;
    static_assert(self <= 1, "every parameter needs its nb::arg");
    constexpr bool has_signature = (std::is_same_v<Extra, nb::sig> || ... || false);
    const std::string types[] = {type_text<A>()..., ""};
    std::array<Name, sizeof...(A) + 1> names{};
    std::vector<Parameter> parameters;
    size_t at = self, before_keywords = named;
    const auto look = [&]<class E>(const E& e) {
        if constexpr (std::is_same_v<E, nb::kw_only>) {
            before_keywords = parameters.size();
        } else if constexpr (nb::detail::arg_traits<E>::is_arg) {
            names[at].name = e.name_;
            parameters.push_back({e.name_, types[at], {}});
            if constexpr (nb::detail::arg_traits<E>::has_default)
                parameters.back().fallback = e.value, names[at].none = e.value.is_none();
            at++;
        }
    };
    (look(extra), ...);
    const auto call_by_name = by_name<self>(f, names, call, std::index_sequence_for<A...>{});
    if constexpr (has_signature) {
        owner.def(name, call_by_name, with_none(extra)...);
    } else {
        const std::string text = signature(name, self == 1, parameters, before_keywords, type_text<R>());
        owner.def(name, call_by_name, with_none(extra)..., nb::sig(text.c_str()));
    }
}

} // namespace arguments

// owner.def(name, f, extra...), with arguments converted by name: every parameter but `self` has its nb::arg.
// Without an nb::sig the signature is made of the types.
template <class Owner, class F, class... Extra>
void define(Owner& owner, const char* name, F f, const Extra&... extra) {
    arguments::define(owner, name, f, static_cast<decltype(std::function(f))*>(nullptr), extra...);
}

// Of a class, for define().
template <class Class>
struct Static {
    Class& owner;
    template <class... A>
    void def(A&&... a) {
        owner.def_static(std::forward<A>(a)...);
    }
};
template <class Class, class F, class... Extra>
void define(Static<Class> owner, const char* name, F f, const Extra&... extra) {
    arguments::define(owner, name, f, static_cast<decltype(std::function(f))*>(nullptr), extra...);
}

// A property; what is set to it is converted by its name.
template <class C, class Get, class R, class Self, class A, class Set, class... Extra>
void property_as(nb::class_<C>& owner, const char* name, Get get, Set set, std::function<R(Self, A)>*,
                 const Extra&... extra) {
    owner.def_prop_rw(
        name, get, [set, name](C& self, Given<A> value) { set(self, argument<A>(value.value, name)); },
        nb::for_getter(nb::sig(
            ("def " + std::string(name) + "(self) -> " + type_text<decltype(get(std::declval<C&>()))>())
                .c_str())),
        nb::for_setter(nb::arg("value").none()),
        nb::for_setter(nb::sig(
            ("def " + std::string(name) + "(self, value: " + type_text<A>() + ", /) -> None").c_str())),
        extra...);
}
template <class C, class Get, class Set, class... Extra>
void property(nb::class_<C>& owner, const char* name, Get get, Set set, const Extra&... extra) {
    property_as(owner, name, get, set, static_cast<decltype(std::function(set))*>(nullptr), extra...);
}
// A member as a property.
template <class C, class T, class... Extra>
void field(nb::class_<C>& owner, const char* name, T C::* member, const Extra&... extra) {
    property(
        owner, name, [member](const C& c) -> T { return c.*member; },
        [member](C& c, T value) { c.*member = std::move(value); }, extra...);
}

} // namespace kanuka::python
