// Relocatable ELF objects to running code. Ours by hand rather than by LLVM's linker: what a compiled shader
// needs of one is little (one object, a hundred host functions, six kinds of relocation), and objects from
// the cache must be ready within milliseconds, however large they are.
//
//   one mapping:  executable sections │ stubs, 16 bytes a host function │ page │ all other sections
//
// Calls go to stubs, since the host's functions may lie further away than 32 bits reach; a stub's address
// field serves as the entry of a global offset table too. System V ABI, AMD64 supplement 1.0, table 4.9.
#include <algorithm>
#include <cstring>
#include <elf.h>
#include <span>
#include <string_view>
#include <sys/mman.h>
#include <unistd.h>
#include <unordered_map>
#include <vector>

#include "sl/codegen/codegen.h"
#include "sl/codegen/host_symbols.h"

namespace kanuka::sl {

namespace {

[[noreturn]] void fail(const std::string& what) {
    throw Error("linking a shader: " + what, ExitCode::Internal);
}

constexpr size_t StubBytes = 16, StubAddress = 6; // jmp *0(%rip); the address; padding

class Loader;

class Mapping final : public NativeCode {
  public:
    explicit Mapping(size_t bytes) : m_bytes(bytes) {
        m_base = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        if (m_base == MAP_FAILED)
            fail("no memory");
    }
    Mapping(const Mapping&) = delete;
    Mapping& operator=(const Mapping&) = delete;
    ~Mapping() override { munmap(m_base, m_bytes); }
    StageFunction find(const std::string& symbol) const override {
        const auto it = m_functions.find(symbol);
        if (it == m_functions.end())
            fail("it has no function " + symbol);
        return reinterpret_cast<StageFunction>(it->second);
    }
    unsigned char* at(size_t offset) const { return static_cast<unsigned char*>(m_base) + offset; }

  private:
    friend class Loader;
    void* m_base;
    size_t m_bytes;
    std::unordered_map<std::string, void*> m_functions;
};

class Loader {
  public:
    explicit Loader(std::string_view object) : m_object(object) {}

    std::unique_ptr<NativeCode> run() {
        read_headers();
        find_stubs();
        lay_out();
        for (const Elf64_Shdr& s : m_sections)
            if (s.sh_type == SHT_RELA && s.sh_info < m_sections.size() && m_place[s.sh_info] != None)
                relocate(s);
        export_functions();
        if (mprotect(m_map->m_base, m_executable, PROT_READ | PROT_EXEC) != 0)
            fail("the system does not let it run");
        return std::move(m_map);
    }

  private:
    static constexpr size_t None = ~size_t(0);

    // ---- reading, with every offset checked

    std::string_view bytes(uint64_t offset, uint64_t size) const {
        if (offset > m_object.size() || size > m_object.size() - offset)
            fail("the object ends early");
        return m_object.substr(offset, size);
    }
    template <class T>
    std::vector<T> list(uint64_t offset, uint64_t size) const {
        const std::string_view b = bytes(offset, size);
        std::vector<T> values(b.size() / sizeof(T));
        std::memcpy(values.data(), b.data(), values.size() * sizeof(T));
        return values;
    }
    std::string_view name(std::string_view table, uint32_t offset) const {
        if (offset >= table.size())
            fail("a name is missing");
        table.remove_prefix(offset);
        return table.substr(0, table.find('\0'));
    }

    void read_headers() {
        const auto h = list<Elf64_Ehdr>(0, sizeof(Elf64_Ehdr))[0];
        if (std::memcmp(h.e_ident, ELFMAG, SELFMAG) != 0 || h.e_ident[EI_CLASS] != ELFCLASS64 ||
            h.e_machine != EM_X86_64 || h.e_type != ET_REL || h.e_shentsize != sizeof(Elf64_Shdr))
            fail("it is no object of this machine");
        m_sections = list<Elf64_Shdr>(h.e_shoff, uint64_t(h.e_shnum) * sizeof(Elf64_Shdr));
        if (m_sections.size() != h.e_shnum || h.e_shstrndx >= m_sections.size())
            fail("it has no sections");
        const std::string_view names = contents(m_sections[h.e_shstrndx]);
        m_place.assign(m_sections.size(), None);
        m_loaded.assign(m_sections.size(), false);
        for (size_t k = 0; k < m_sections.size(); k++) {
            const Elf64_Shdr& s = m_sections[k];
            // Nothing is thrown through a shader, so nobody asks how to unwind it.
            m_loaded[k] = (s.sh_flags & SHF_ALLOC) && s.sh_size > 0 && name(names, s.sh_name) != ".eh_frame";
            if (s.sh_type != SHT_SYMTAB)
                continue;
            m_symbols = list<Elf64_Sym>(s.sh_offset, s.sh_size);
            if (s.sh_link >= m_sections.size())
                fail("its symbols have no names");
            m_names = contents(m_sections[s.sh_link]);
        }
    }

    std::string_view contents(const Elf64_Shdr& s) const { return bytes(s.sh_offset, s.sh_size); }

    // ---- layout

    void find_stubs() {
        m_stub.assign(m_symbols.size(), None);
        for (size_t k = 1; k < m_symbols.size(); k++) {
            const Elf64_Sym& s = m_symbols[k];
            if (s.st_shndx != SHN_UNDEF)
                continue;
            void* const address = host_symbol(name(m_names, s.st_name));
            if (!address)
                fail("it calls " + std::string(name(m_names, s.st_name)) +
                     ", which this program does not have");
            m_stub[k] = m_addresses.size();
            m_addresses.push_back(address);
        }
    }

    void lay_out() {
        size_t size = 0;
        const auto place = [&](bool executable) {
            for (size_t k = 0; k < m_sections.size(); k++) {
                const Elf64_Shdr& s = m_sections[k];
                if (!m_loaded[k] || bool(s.sh_flags & SHF_EXECINSTR) != executable)
                    continue;
                const size_t align = std::max<size_t>(1, s.sh_addralign);
                if (align > 4096 || (align & (align - 1)) || s.sh_size > MaxBytes)
                    fail("a section makes no sense");
                size = (size + align - 1) & ~(align - 1);
                m_place[k] = size;
                size += s.sh_size;
                if (size > MaxBytes) // calls and data must be within the reach of 32 bits
                    fail("it is larger than 1 GiB");
            }
        };
        place(true);
        m_stubs = (size + 15) & ~size_t(15);
        const size_t page = size_t(sysconf(_SC_PAGESIZE));
        m_executable = (m_stubs + m_addresses.size() * StubBytes + page - 1) / page * page;
        m_executable = std::max(m_executable, page);
        size = m_executable;
        place(false);
        m_map = std::make_unique<Mapping>((size + page - 1) / page * page);
        for (size_t k = 0; k < m_sections.size(); k++)
            if (m_place[k] != None && m_sections[k].sh_type != SHT_NOBITS) {
                const std::string_view from = contents(m_sections[k]);
                std::memcpy(m_map->at(m_place[k]), from.data(), from.size());
            }
        for (size_t k = 0; k < m_addresses.size(); k++) {
            unsigned char* const stub = m_map->at(m_stubs + k * StubBytes);
            constexpr unsigned char Jump[StubAddress] = {0xff, 0x25, 0, 0, 0, 0};
            std::memcpy(stub, Jump, sizeof Jump);
            std::memcpy(stub + StubAddress, static_cast<const void*>(&m_addresses[k]), sizeof(void*));
        }
    }

    // ---- relocations

    size_t stub(size_t symbol) const { return m_stubs + m_stub[symbol] * StubBytes; }

    // Where a symbol lies in the mapping.
    size_t offset(size_t symbol) const {
        const Elf64_Sym& s = m_symbols[symbol];
        if (m_stub[symbol] != None)
            return stub(symbol);
        if (s.st_shndx >= m_sections.size() || m_place[s.st_shndx] == None ||
            s.st_value > m_sections[s.st_shndx].sh_size)
            fail("a symbol lies nowhere");
        return m_place[s.st_shndx] + s.st_value;
    }

    void relocate(const Elf64_Shdr& table) {
        const size_t base = m_place[table.sh_info], size = m_sections[table.sh_info].sh_size;
        const std::string_view all = contents(table);
        for (size_t k = 0; k + sizeof(Elf64_Rela) <= all.size(); k += sizeof(Elf64_Rela)) {
            Elf64_Rela r;
            std::memcpy(&r, all.data() + k, sizeof r);
            const size_t symbol = ELF64_R_SYM(r.r_info), type = ELF64_R_TYPE(r.r_info);
            const size_t width = type == R_X86_64_64 || type == R_X86_64_PC64 ? 8 : 4;
            if (symbol >= m_symbols.size() || r.r_offset > size || width > size - r.r_offset)
                fail("a relocation lies outside");
            const size_t at = base + r.r_offset;
            int64_t value = 0;
            switch (type) {
            case R_X86_64_64:
                value = int64_t(reinterpret_cast<uintptr_t>(m_map->at(offset(symbol)))) + r.r_addend;
                break;
            case R_X86_64_PC32:
            case R_X86_64_PLT32:
            case R_X86_64_PC64:
                value = int64_t(offset(symbol)) + r.r_addend - int64_t(at);
                break;
            case R_X86_64_GOTPCREL:
            case R_X86_64_GOTPCRELX:
            case R_X86_64_REX_GOTPCRELX:
                if (m_stub[symbol] == None)
                    fail("a table is asked for what is its own");
                value = int64_t(stub(symbol) + StubAddress) + r.r_addend - int64_t(at);
                break;
            default:
                fail("a relocation of kind " + std::to_string(type) + " is not known");
            }
            if (width == 4 && value != int64_t(int32_t(value)))
                fail("a relocation does not reach");
            std::memcpy(m_map->at(at), &value, width);
        }
    }

    void export_functions() {
        for (size_t k = 1; k < m_symbols.size(); k++) {
            const Elf64_Sym& s = m_symbols[k];
            if (ELF64_ST_BIND(s.st_info) == STB_GLOBAL && ELF64_ST_TYPE(s.st_info) == STT_FUNC &&
                m_stub[k] == None)
                m_map->m_functions[std::string(name(m_names, s.st_name))] = m_map->at(offset(k));
        }
    }

    static constexpr size_t MaxBytes = size_t(1) << 30;

    std::string_view m_object, m_names;
    std::vector<Elf64_Shdr> m_sections;
    std::vector<Elf64_Sym> m_symbols;
    std::vector<bool> m_loaded;
    std::vector<size_t> m_place;    // of each section in the mapping
    std::vector<size_t> m_stub;     // of each symbol: which stub
    std::vector<void*> m_addresses; // of each stub
    size_t m_stubs = 0, m_executable = 0;
    std::unique_ptr<Mapping> m_map;
};

} // namespace

std::unique_ptr<NativeCode> link_object(std::string_view object) {
    return Loader(object).run();
}

} // namespace kanuka::sl
