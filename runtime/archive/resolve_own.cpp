// Does for an object what its linker leaves to the next one, though all is known: calls within its code, and where that
// reads constants behind it. `ld -r` keeps a relocation of 24 bytes for each, a sixth of the archive. Of names that others
// see they stay, as a program may have its own.
//
//   resolve_own palpate.o
//
// What is done is S + A - P of R_X86_64_PC32 and _PLT32 (System V ABI, AMD64 supplement, table 4.9); objects of other
// machines stay as they are.
#include <elf.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <span>
#include <vector>

namespace {

template <typename T>
std::span<T> table_at(std::vector<char>& file, const Elf64_Shdr& section) {
  return {reinterpret_cast<T*>(file.data() + section.sh_offset), section.sh_size / sizeof(T)};
}

void resolve(std::vector<char>& file, std::span<Elf64_Shdr> sections, Elf64_Shdr& relocations) {
  const std::uint32_t code = relocations.sh_info;
  const std::span<Elf64_Sym> symbols = table_at<Elf64_Sym>(file, sections[relocations.sh_link]);
  const std::span<Elf64_Rela> all = table_at<Elf64_Rela>(file, relocations);
  const auto rest = std::remove_if(all.begin(), all.end(), [&](const Elf64_Rela& one) {
    const std::uint64_t type = ELF64_R_TYPE(one.r_info);
    const Elf64_Sym& symbol = symbols[ELF64_R_SYM(one.r_info)];
    if ((type != R_X86_64_PC32 && type != R_X86_64_PLT32) || symbol.st_shndx != code ||
        ELF64_ST_BIND(symbol.st_info) != STB_LOCAL)
      return false;
    const auto distance = static_cast<std::int32_t>(static_cast<std::int64_t>(symbol.st_value) +
                                                    one.r_addend - static_cast<std::int64_t>(one.r_offset));
    std::memcpy(file.data() + sections[code].sh_offset + one.r_offset, &distance, sizeof distance);
    return true;
  });
  relocations.sh_size = static_cast<std::uint64_t>(rest - all.begin()) * sizeof(Elf64_Rela);
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 2) return 2;
  std::ifstream in(arguments[1], std::ios::binary);
  std::vector<char> file{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  auto* header = reinterpret_cast<Elf64_Ehdr*>(file.data());
  if (file.size() < sizeof *header || std::memcmp(header->e_ident, ELFMAG, SELFMAG) != 0) {
    std::fprintf(stderr, "%s: not an object file\n", arguments[1]);
    return 1;
  }
  if (header->e_ident[EI_CLASS] != ELFCLASS64 || header->e_machine != EM_X86_64) return 0;
  const std::span sections(reinterpret_cast<Elf64_Shdr*>(file.data() + header->e_shoff), header->e_shnum);
  for (Elf64_Shdr& section : sections) {
    if (section.sh_type == SHT_RELA && (sections[section.sh_info].sh_flags & SHF_EXECINSTR) != 0)
      resolve(file, sections, section);
  }
  std::ofstream out(arguments[1], std::ios::binary);
  if (out.write(file.data(), static_cast<std::streamsize>(file.size())).flush()) return 0;
  std::fprintf(stderr, "%s: could not be written\n", arguments[1]);
  return 1;
}
