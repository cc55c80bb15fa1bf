// A block of tissue and its scene, written as files for the program.
#pragma once

#include <filesystem>
#include <string>

#include "tests/support/block_mesh.hpp"
#include "tests/support/run_program.hpp"
#include "tests/support/temp_dir.hpp"

namespace palpate::test {

// The top of the block of two cells has nodes 19 to 27, with 23 in the middle; the edge is 0.125.
inline const std::string kContact =
    "[contact]\nsites = [22, 23]\nmax_displacement = 0.03\ntip_radius = 0.13\nmax_contacts = 2\n";

struct SceneFiles {
  explicit SceneFiles(const std::string& contact = kContact, const std::string& model = block_inp(2))
      : inp(dir.write("block.inp", model)),
        scene(dir.write("block.toml", "model = \"block.inp\"\n" + contact)),
        pack(dir.path() / "block.pack") {}

  ProgramRun build() const {
    return run_program({"build", scene.string(), "-o", pack.string(), "--jobs", "1"});
  }

  TempDir dir;
  std::filesystem::path inp;
  std::filesystem::path scene;
  std::filesystem::path pack;
};

}  // namespace palpate::test
