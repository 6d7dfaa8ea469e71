#include "ri/plug_in.h"

#include <cstdlib>
#include <cstring>
#include <dlfcn.h>

#include "ingest/rib/search_path.h"
#include "ri/contexts.h"

namespace kanuka::ri {

namespace {

template <class Function>
Function symbol(void* library, const char* name) {
    void* found = dlsym(library, name);
    if (!found)
        throw Error(std::string("it has no function ") + name +
                    "; a procedural's library exports ConvertParameters, Subdivide and Free, with C names");
    Function function;
    std::memcpy(static_cast<void*>(&function), static_cast<const void*>(&found), sizeof function);
    return function;
}

} // namespace

std::string run_library(const std::string& path, const std::string& data, float detail,
                        const std::vector<std::string>& declarations, std::string& problems) {
    // Libraries stay loaded: the next procedural wants them again, and their data may point into them.
    void* library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (!library)
        throw Error(dlerror());
    const auto convert = symbol<RtPointer (*)(RtString)>(library, "ConvertParameters");
    const auto subdivide = symbol<void (*)(RtPointer, RtFloat)>(library, "Subdivide");
    const auto release = symbol<void (*)(RtPointer)>(library, "Free");
    Session::Recording recording;
    const auto session = std::make_shared<Session>(recording);
    {
        const Redirect redirect(session);
        for (size_t i = 0; i + 1 < declarations.size(); i += 2)
            RiDeclare(const_cast<char*>(declarations[i].c_str()),
                      const_cast<char*>(declarations[i + 1].c_str()));
        std::string text = data; // it may write into it
        const RtPointer own = convert(text.data());
        subdivide(own, detail);
        release(own);
    }
    session->finish();
    problems = std::move(recording.problems);
    return std::move(recording.text);
}

std::optional<std::string> expand_by_library(const ingest::ProceduralRequest& request) {
    if (request.type != "DynamicLoad" || request.arguments.empty())
        return std::nullopt;
    const std::string& name = request.arguments[0];
    auto path = ingest::find_file(name, request.folders);
    if (!path && !name.ends_with(".so"))
        path = ingest::find_file(name + ".so", request.folders);
    if (!path) {
        std::string looked;
        for (const std::string& folder : request.folders) {
            const std::string quoted = "\"" + (folder.empty() ? "." : folder) + "\"";
            if (looked.find(quoted) == std::string::npos)
                looked += (looked.empty() ? "" : ", ") + quoted;
        }
        throw Error("there is no such library in " + looked + "; set Option \"searchpath\" \"procedural\"");
    }
    if (!request.may_run)
        throw Error("running code that is no part of the renderer is forbidden");
    if (path->find('/') == std::string::npos) // dlopen looks elsewhere for bare names
        path = "./" + *path;
    std::string problems;
    const std::string data = request.arguments.size() > 1 ? request.arguments[1] : "";
    std::string rib = run_library(*path, data, float(request.detail), request.declared, problems);
    if (!problems.empty())
        throw Error("its calls were wrong: " + problems);
    return rib;
}

} // namespace kanuka::ri

// For renderers of which this library is not the one that runs: the RIB of a procedural, to be given to
// RiFreeLibraryRib; null, and *problem set likewise, where it failed.
extern "C" __attribute__((visibility("default"))) char* RiLibraryRib(const char* path, const char* data,
                                                                     float detail,
                                                                     const char* const* declarations,
                                                                     int count, char** problem) {
    *problem = nullptr;
    try {
        std::string problems;
        const std::vector<std::string> declared(declarations, declarations + count);
        const std::string rib = kanuka::ri::run_library(path, data, detail, declared, problems);
        if (!problems.empty())
            *problem = strdup(problems.c_str());
        return strdup(rib.c_str());
    } catch (const std::exception& e) {
        *problem = strdup(e.what());
        return nullptr;
    }
}
extern "C" __attribute__((visibility("default"))) void RiFreeLibraryRib(char* text) {
    std::free(text);
}
