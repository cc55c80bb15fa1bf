// A file that appears under its name only when it is whole: written beside its place, then renamed onto it.
// A reader that watches the path, or a run that is killed half way, never meets half a file.
#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

namespace palpate {

// Calls `write` with the path of a temporary file in the folder of `path`, then renames that file onto
// `path`. If `write` throws or the rename fails, the temporary file is removed and what stood at `path`
// before is kept. A link is followed. A device or a pipe (/dev/stdout) is written into as it is. Throws
// std::runtime_error "PATH: REASON" where the rename fails.
void write_finished_file(const std::filesystem::path& path,
                         const std::function<void(const std::filesystem::path&)>& write);

// The same for bytes that are at hand. Throws std::runtime_error "PATH: cannot be written" on a full disk
// too.
void write_finished_bytes(const std::filesystem::path& path, std::span<const unsigned char> bytes);
void write_finished_text(const std::filesystem::path& path, std::string_view text);

// For before long work: throws std::runtime_error "PATH: REASON; REMEDY" if write_finished_file would find no
// folder there, or none that it may write to. Leaves what stands at `path` alone; removes the
// temporary files beside it of processes that were killed.
void check_can_finish(const std::filesystem::path& path);

// Throws std::runtime_error "PATH: REASON; REMEDY" if a result at `path` would replace one of the files it is
// made from.
void check_keeps_inputs(const std::filesystem::path& path, const std::vector<std::filesystem::path>& inputs);

}  // namespace palpate
