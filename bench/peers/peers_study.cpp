// palpate_study_peers DIR PICTURES [--patient]: time and error of a frame of a linear organ, for linear_dd
// (EPFE) and its peers. Writes Markdown for PEERS.md and CSV into DIR. `./dev peers` runs this study.
#include <stdlib.h>  // getloadavg

#include <cstdio>
#include <cstring>
#include <exception>
#include <thread>

#include "bench/peers/peers.hpp"
#include "offline/fem/blas_kernels.hpp"

namespace {

void write_study(const std::filesystem::path& directory, const std::filesystem::path& pictures,
                 const palpate::peers::Study& study) {
  using namespace palpate;
  std::filesystem::create_directories(directory);
  std::filesystem::create_directories(pictures);
  double load = 0;  // mean number of running or waiting processes in a minute
  if (getloadavg(&load, 1) != 1) load = 0;
  const double start = peers::now();
  const peers::LinearOrgan brain(read_scene(PALPATE_SOURCE_DIR "/bench/peers/brain_surface.toml"));
  const std::string text = fmt::format(
      "Measured on {}, {} cores with a load of {:.1f} before the study began; one thread, {} build. The "
      "brain: {} nodes, {} of them free; {} contact nodes, {} "
      "nodes "
      "shown; its pack took {:.1f} s and has {:.0f} MB.\n",
      peers::processor_name(), std::thread::hardware_concurrency(), load, PALPATE_BUILD_TYPE,
      brain.model.num_nodes(), brain.assembly.num_equations() / 3, brain.num_sites(), brain.num_shown(),
      brain.pack_seconds, 1e-6 * static_cast<double>(brain.pack.bytes().size()));
  study::write_text(directory / "machine.md", text);
  study::write_page(directory, "brain", peers::brain_frames_page(brain, study));
  study::write_page(directory, "elsewhere", peers::touched_elsewhere_page(brain, pictures));
  study::write_page(directory, "counts", peers::operation_counts_page(brain, study));
  study::write_page(directory, "sizes", peers::linear_frames_page(study));
  std::fprintf(stderr, "all measured in %.0f s\n", peers::now() - start);
}

}  // namespace

int main(int argc, char** argv) {
  palpate::choose_blas_kernels();
  const bool patient = argc == 4 && std::strcmp(argv[3], "--patient") == 0;
  if (argc != 3 && !patient) {
    std::fputs("usage: palpate_study_peers DIR PICTURES [--patient]\n", stderr);
    return 2;
  }
  try {
    write_study(argv[1], argv[2], {patient});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "palpate_study_peers: %s\n", error.what());
    return 1;
  }
  return 0;
}
