#include "offline/cli/organ_file.hpp"

#include <fmt/core.h>

#include "offline/io/mesh_formats.hpp"
#include "offline/io/model_from_mesh.hpp"

namespace palpate {

Model read_organ(const std::filesystem::path& file, double scale) {
  Model model = model_from_mesh(read_mesh(file));
  for (const std::string& warning : model.warnings) fmt::print(stderr, "{}\n", warning);
  for (Eigen::Vector3d& position : model.positions) position *= scale;
  return model;
}

}  // namespace palpate
