// Writes a temporary file beside the file's place, then renames the file. A reader never sees a partial file
// at `path`; a killed run may leave a temporary file.
#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

namespace palpate {

// Calls `write` with the path of a temporary file in the folder of `path`, then renames the file to `path`. A
// failure removes the temporary file and keeps the old file. Follows links, such as /dev/stdout redirected to
// a file. Writes a device or a pipe without a rename. Throws the exceptions of `write`, and
// std::runtime_error "PATH: REASON" where the rename fails.
void write_finished_file(const std::filesystem::path& path,
                         const std::function<void(const std::filesystem::path&)>& write);

// Writes bytes in the same way. A full disk also throws std::runtime_error "PATH: cannot be written".
void write_finished_bytes(const std::filesystem::path& path, std::span<const unsigned char> bytes);
void write_finished_text(const std::filesystem::path& path, std::string_view text);

// Tests a path before long work. Throws std::runtime_error "PATH: REASON; REMEDY" where `path` is a folder,
// or its folder is absent or not writable. Keeps an existing file; removes the temporary files of killed
// processes.
void check_can_finish(const std::filesystem::path& path);

// Throws std::runtime_error "PATH: REASON; REMEDY" where `path` is one of the `inputs` of its result.
void check_keeps_inputs(const std::filesystem::path& path, const std::vector<std::filesystem::path>& inputs);

// Throws std::runtime_error "PATH: REASON; REMEDY" where `path` is a file that does not begin with
// `beginning`: commands replace no file of another kind. `kind`: "a pack". An empty file may be replaced.
void check_replaces(const std::filesystem::path& path, std::string_view beginning, const char* kind);

}  // namespace palpate
