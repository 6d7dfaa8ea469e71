#include "base/build_id.h"

#include <bit>
#include <cstring>
#include <elf.h>
#include <link.h>

namespace kanuka {

namespace {

struct Search {
    uintptr_t of; // an address in it
    std::string found;
};

bool holds(const dl_phdr_info& object, uintptr_t address) {
    for (int i = 0; i < object.dlpi_phnum; i++) {
        const ElfW(Phdr)& p = object.dlpi_phdr[i];
        if (p.p_type == PT_LOAD && address - (object.dlpi_addr + p.p_vaddr) < p.p_memsz)
            return true;
    }
    return false;
}

std::string digits_of(const unsigned char* bytes, size_t count) {
    std::string digits;
    for (size_t i = 0; i < count; i++)
        for (const int shift : {4, 0})
            digits += "0123456789abcdef"[bytes[i] >> shift & 15];
    return digits;
}

std::string id_among(const char* notes, size_t size) {
    const auto padded = [](size_t n) { return (n + 3) / 4 * 4; };
    for (size_t at = 0; at + sizeof(ElfW(Nhdr)) <= size;) {
        ElfW(Nhdr) note;
        std::memcpy(&note, notes + at, sizeof note);
        const size_t name = at + sizeof note, content = name + padded(note.n_namesz);
        if (content + note.n_descsz > size)
            break;
        if (note.n_type == NT_GNU_BUILD_ID && note.n_namesz == 4 && std::memcmp(notes + name, "GNU", 4) == 0)
            return digits_of(reinterpret_cast<const unsigned char*>(notes + content), note.n_descsz);
        at = content + padded(note.n_descsz);
    }
    return {};
}

int look(dl_phdr_info* object, size_t, void* data) {
    Search& search = *static_cast<Search*>(data);
    if (!holds(*object, search.of))
        return 0;
    for (int i = 0; i < object->dlpi_phnum && search.found.empty(); i++) {
        const ElfW(Phdr)& p = object->dlpi_phdr[i];
        if (p.p_type == PT_NOTE)
            search.found = id_among(std::bit_cast<const char*>(object->dlpi_addr + p.p_vaddr), p.p_memsz);
    }
    return 1;
}

} // namespace

const std::string& build_id() {
    static const std::string id = [] {
        Search search{reinterpret_cast<uintptr_t>(&look), {}};
        dl_iterate_phdr(look, &search);
        return search.found.empty() ? "none" : search.found;
    }();
    return id;
}

} // namespace kanuka
