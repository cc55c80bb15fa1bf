// Page of every method on blocks of 512 to 19,683 nodes, with single-node contacts spread over the top.
#include <cmath>

#include "bench/peers/method_frames.hpp"
#include "bench/peers/peers.hpp"
#include "tests/support/tetrahedral_block.hpp"

namespace palpate::peers {
namespace {

constexpr double kAmplitude = 0.01;  // over the block's edge

// Returns a block held at its base, with contacts evenly over its top.
LoadedScene block_scene(int cells, int num_contacts) {
  test::BlockShape shape;
  shape.cells = {cells, cells, cells};
  LoadedScene loaded;
  loaded.model = test::with_fixed_base(test::tetrahedral_block(shape));
  Scene& scene = loaded.scene;
  scene.file = scene.model_file = "block";
  const std::vector<int> top = test::nodes_on_plane(loaded.model, 2, 1.0);
  for (int i = 0; i < num_contacts; ++i)
    scene.sites.push_back(
        top[(static_cast<size_t>(i) * 2 + 1) * top.size() / (2 * static_cast<size_t>(num_contacts))]);
  std::sort(scene.sites.begin(), scene.sites.end());
  scene.max_displacement = kAmplitude * std::sqrt(2.0);
  scene.max_contacts = num_contacts;
  scene.polynomial = false;
  for (int node = 0; node < loaded.model.num_nodes(); ++node) scene.output_nodes.push_back(node);
  return loaded;
}

}  // namespace

std::vector<study::StudyTable> linear_frames_page(const Study& study) {
  study::StudyTable table(
      "linear_frames",
      "A frame that gives every node's displacement and the contacts' forces, us. Contacts of one node each, "
      "which move by 2 % of their amplitude a frame.",
      {"nodes", "contacts", "method", "made ready (s)", "frames", "median", "p99.9", "max",
       "displacement error", "force error", "iterations"});
  const std::vector<int> all_cells = {7, 12, 19, 26};
  const std::vector<int> all_contacts =
      study.patient ? std::vector<int>{1, 2, 4, 8, 16, 32, 64} : std::vector<int>{1, 8, 64};
  for (const int cells : all_cells) {
    for (const int num_contacts : all_contacts) {
      const LinearOrgan organ(block_scene(cells, num_contacts));
      std::fprintf(stderr, "block of %d nodes, %d contacts\n", organ.model.num_nodes(), num_contacts);
      std::vector<std::uint32_t> sites;
      for (std::uint32_t site = 0; site < organ.num_sites(); ++site) sites.push_back(site);
      for (const MethodFrames& frames : measure_methods(organ, sites, Motion::each_its_own, kAmplitude,
                                                        {.seconds = study.patient ? 1.0 : 0.15})) {
        table.add({std::to_string(organ.model.num_nodes()), std::to_string(num_contacts), frames.method,
                   fmt::format("{:.2f}", frames.preparation_seconds), std::to_string(frames.times.count()),
                   in_us(frames.times.median()), in_us(frames.times.at(0.999)), in_us(frames.times.at(1)),
                   error_cell(frames.errors.displacement), error_cell(frames.errors.force),
                   frames.iterations > 0 ? std::to_string(frames.iterations) : ""});
      }
    }
  }
  return {table};
}

}  // namespace palpate::peers
