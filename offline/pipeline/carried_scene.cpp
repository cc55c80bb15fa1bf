#include "offline/pipeline/carried_scene.hpp"

#include <stdlib.h>

#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include "offline/pack/input_files.hpp"

namespace palpate {
namespace {

// Makes a temporary folder and deletes it at the end.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::error_code error;
    std::string pattern = (std::filesystem::temp_directory_path(error) / "palpate-XXXXXX").string();
    if (error || mkdtemp(pattern.data()) == nullptr)
      throw std::runtime_error("no folder for its files can be made; set TMPDIR to one that can be written");
    path_ = pattern;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

// Removes the sites that the build has left out.
void keep_packed_sites(const OpenedPack& opened, LoadedScene& loaded) {
  std::set<int> packed;
  for (size_t site = 0; site < opened.info().num_sites; ++site)
    packed.insert(loaded.model.find_node(opened.label_of_site(site)));
  std::erase_if(loaded.scene.sites, [&](int node) { return !packed.contains(node); });
}

LoadedScene read_from_folder(const OpenedPack& opened) {
  const ScratchFolder folder;
  std::vector<std::filesystem::path> files = {write_inputs(opened.tables(), opened.bytes(), folder.path())};
  try {
    LoadedScene loaded = read_scene(files.front(), folder.path());
    files.insert(files.end(), loaded.model.files.begin(), loaded.model.files.end());
    const auto& carried = *opened.tables().inputs();
    const std::vector<InputFile> inputs = read_inputs(files);
    for (unsigned i = 0; i < inputs.size(); ++i) {
      if (i >= carried.size() || inputs[i].hash != carried.Get(i)->xxh3_128()->str())
        throw std::runtime_error(files[i].string() + " differs from the input of the pack");
    }
    keep_packed_sites(opened, loaded);
    return loaded;
  } catch (const std::exception& error) {
    throw std::runtime_error(
        error.what() +
        std::string("; build it again from a scene and a model that name files from their own folders"));
  }
}

}  // namespace

LoadedScene read_carried_scene(const OpenedPack& opened, const std::filesystem::path& pack) {
  try {
    return read_from_folder(opened);
  } catch (const std::exception& error) {
    throw std::runtime_error(pack.string() + ": " + error.what());
  }
}

Organ::Organ(LoadedScene loaded)
    : scene(std::move(loaded.scene)),
      model(std::move(loaded.model)),
      sites(find_contact_sites(scene, model)),
      assembly(model, model.fixed_dofs()),
      rest(find_rest(assembly, scene)) {}

void check_same_sites(const OpenedPack& opened, const Organ& organ, const std::filesystem::path& pack) {
  if (organ.sites.sites.size() != opened.info().num_sites ||
      organ.sites.packed_nodes.size() != opened.info().num_nodes)
    throw std::runtime_error(pack.string() +
                             ": its scene now has other sites; build it again with this version");
}

}  // namespace palpate
