#include "offline/pack/input_files.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <fstream>
#include <stdexcept>
#include <string_view>

#include "offline/mesh/text_file.hpp"
#include "schemas/pack_checksum.hpp"

namespace palpate {
namespace {

std::string hash_of(std::string_view bytes) {
  const XXH128_hash_t hash = XXH3_128bits(bytes.data(), bytes.size());
  return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

// Returns the deepest folder above all files. Expects absolute paths.
std::filesystem::path nearest_common_folder(const std::vector<std::filesystem::path>& files) {
  std::filesystem::path common = files.front().parent_path();
  for (const std::filesystem::path& file : files) {
    const auto [end, ignored] = std::mismatch(common.begin(), common.end(), file.begin(), file.end());
    std::filesystem::path shared;
    for (auto part = common.begin(); part != end; ++part) shared /= *part;
    common = shared;
  }
  return common;
}

// Whether the path stays below the folder to which it is relative.
bool stays_below(const std::filesystem::path& path) {
  return path.is_relative() && !path.empty() &&
         std::none_of(path.begin(), path.end(), [](const auto& part) { return part == ".."; });
}

}  // namespace

std::vector<InputFile> read_inputs(const std::vector<std::filesystem::path>& files) {
  std::vector<std::filesystem::path> absolute;
  absolute.reserve(files.size());
  for (const std::filesystem::path& file : files)
    absolute.push_back(std::filesystem::absolute(file).lexically_normal());
  const std::filesystem::path folder = nearest_common_folder(absolute);
  std::vector<InputFile> inputs;
  for (size_t i = 0; i < files.size(); ++i) {
    InputFile input;
    const std::string unreadable = read_text_file(files[i], input.contents);
    if (!unreadable.empty()) throw std::runtime_error(files[i].string() + ": " + unreadable);
    input.path = absolute[i].lexically_relative(folder).generic_string();
    input.hash = hash_of(input.contents);
    inputs.push_back(std::move(input));
  }
  return inputs;
}

std::filesystem::path write_inputs(const pack::Pack& tables, std::span<const unsigned char> pack,
                                   const std::filesystem::path& folder) {
  std::filesystem::path scene;
  for (const pack::InputFile* input : *tables.inputs()) {
    const std::filesystem::path path = input->path() == nullptr ? "" : input->path()->str();
    const pack::Segment* contents = input->contents();
    if (!stays_below(path) || contents == nullptr) {
      throw std::runtime_error(
          "the pack does not carry the files it was made from; build it again without embed_inputs = false");
    }
    const std::string_view bytes(reinterpret_cast<const char*>(pack.data()) + contents->offset(),
                                 contents->bytes());
    if (hash_of(bytes) != input->xxh3_128()->str())
      throw std::runtime_error(path.string() + " in the pack is not what it was made from; build it again");
    const std::filesystem::path file = folder / path;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream stream(file, std::ios::binary);
    stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    stream.close();
    if (!stream) throw std::runtime_error(file.string() + ": cannot be written");
    if (scene.empty()) scene = file;
  }
  return scene;
}

}  // namespace palpate
