// How much the force on a tool jumps as its contact slides over an organ's surface: a pack's own answers, between sites
// and across them.
//
//   palpate_study_slides PACK DIR     writes DIR/slides.md and DIR/slides.csv
//
// Paths are straight lines in space between random sites, brought onto the surface point by point, so that they cross
// fissures and edges, sites and what lies under them. Where the surface itself jumps along a path, as over a fissure, no
// frame follows the other. The push is the same all along a path.
#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <palpate/palpate.hpp>
#include <random>
#include <stdexcept>
#include <vector>

#include "bench/solver/study_table.hpp"
#include "offline/fem/blas_kernels.hpp"

namespace palpate {
namespace {

constexpr double kStep = 0.01;      // of the mean edge of the surface
constexpr double kLongest = 0.015;  // a longer step is one of the surface
constexpr int kPaths = 200;
constexpr double kPush = 0.6;  // of the scene's largest displacement

void require(pal_status status) {
  if (status != PAL_STATUS_OK) throw std::runtime_error(pal_status_text(status));
}

struct Slides {
  std::vector<double> jumps;  // the largest of each path, as part of its peak force
  long frames = 0;
  long triangles = 0;  // entered on the way
};

Eigen::Vector3d place_of_site(const Pack& pack, std::uint32_t site) {
  std::uint32_t node = 0;
  require(pal_pack_get_site_node(pack.get(), site, &node));
  return pack.info().metres_per_length_unit *
         Eigen::Vector3d(pack.geometry().rest_positions + size_t{3} * node);
}

class Slider {
 public:
  Slider(const Pack& pack, pal_model model) : pack_(pack) {
    pal_session_config config = pal_default_session_config(pack.get());
    config.max_contacts = 1;
    config.model = model;
    size_t bytes = 0;
    require(Session::required_bytes(pack, config, bytes));
    arena_.reset(static_cast<unsigned char*>(std::aligned_alloc(64, (bytes + 63) / 64 * 64)));
    require(session_.init(pack, config, {arena_.get(), bytes}));
  }

  void slide(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const Eigen::Vector3d& d,
             Slides& slides) {
    const double step = kStep * pack_.info().mean_surface_edge;
    const int steps = static_cast<int>((to - from).norm() / step);
    double peak = 0;
    double largest = 0;
    pal_surface_point before = {};
    Eigen::Vector3d force_before = Eigen::Vector3d::Zero();
    for (int i = 0; i <= steps; ++i) {
      const Eigen::Vector3d place = from + (to - from) * i / std::max(steps, 1);
      pal_surface_point point;
      require(pal_pack_find_surface_point(pack_.get(), place.data(), &point));
      const pal_contact contact = pal_contact_at(&point, d.data());
      pal_contact_result result;
      require(session_.contact_frame({&contact, 1}, {&result, 1}));
      const Eigen::Vector3d force(result.force);
      peak = std::max(peak, force.norm());
      const double moved =
          (Eigen::Vector3d(point.position) - Eigen::Vector3d(before.position)).norm() / (step / kStep);
      if (i > 0 && moved <= kLongest) {
        largest = std::max(largest, (force - force_before).norm() * kStep / std::max(moved, kStep));
        slides.triangles += !std::equal(point.sites, point.sites + 3, before.sites);
        ++slides.frames;
      }
      before = point;
      force_before = force;
    }
    if (peak > 0) slides.jumps.push_back(largest / peak);
  }

 private:
  struct Free {
    void operator()(unsigned char* memory) const { std::free(memory); }
  };
  const Pack& pack_;
  std::unique_ptr<unsigned char, Free> arena_;
  Session session_;
};

Slides slide_all_over(const Pack& pack, pal_model model) {
  Slider slider(pack, model);
  std::mt19937 random(1);
  const auto site = [&] {
    return static_cast<std::uint32_t>(random() % std::max(1U, pack.info().num_sites));
  };
  const auto unit = [&] { return 2.0 * (static_cast<double>(random()) + 0.5) / 4294967296.0 - 1.0; };
  Slides slides;
  for (int path = 0; path < kPaths; ++path) {
    Eigen::Vector3d direction;
    do {
      direction = {unit(), unit(), unit()};
    } while (direction.norm() > 1);
    const Eigen::Vector3d d = kPush * pack.info().max_displacement * direction.normalized();
    const Eigen::Vector3d from = place_of_site(pack, site());
    slider.slide(from, place_of_site(pack, site()), d, slides);
  }
  std::sort(slides.jumps.begin(), slides.jumps.end());
  return slides;
}

void run_study(const std::filesystem::path& file, const std::filesystem::path& folder) {
  Pack pack;
  require(pack.open(file.c_str()));
  study::StudyTable table(
      "slides", "Largest jump of the force between frames 0.01 h apart, in percent of the path's peak force.",
      {"model", "paths", "frames", "triangles entered", "median", "p95", "max"});
  for (const auto& [name, model] :
       {std::pair{"linear_dd", PAL_MODEL_LINEAR}, {"polynomial_dd, affine_site", PAL_MODEL_POLYNOMIAL}}) {
    const Slides slides = slide_all_over(pack, model);
    const auto at = [&](double q) {
      return fmt::format(
          "{:.2f}",
          100 * slides.jumps[static_cast<size_t>(q * static_cast<double>(slides.jumps.size() - 1))]);
    };
    table.add({name, fmt::format("{}", slides.jumps.size()), fmt::format("{}", slides.frames),
               fmt::format("{}", slides.triangles), at(0.5), at(0.95), at(1)});
  }
  study::write_text(folder / (table.name() + ".md"), table.markdown());
  study::write_text(folder / (table.name() + ".csv"), table.csv());
  fmt::print("{}", table.markdown());
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  palpate::begin_again_with_fast_blas(argv);
  try {
    if (argc != 3) throw std::invalid_argument("usage: palpate_study_slides PACK DIR");
    std::filesystem::create_directories(argv[2]);
    palpate::run_study(argv[1], argv[2]);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
}
