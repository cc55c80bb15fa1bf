// Measures jumps of the force on a tool while its contact slides over an organ's surface.
//
//   palpate_study_slides PACK DIR     writes DIR/slides.md and DIR/slides.csv
//
// Paths are straight lines between random sites, projected onto the surface, so they cross fissures, edges
// and sites. A jump of the surface itself, as over a fissure, does not count. The push is constant along a
// path. Several contacts slide at once in two series: at least two edges apart, and without a limit.
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

constexpr double kStep = 0.01;    // over the surface's mean edge
constexpr double kLongest = 1.5;  // steps; a longer step is a jump of the surface
constexpr int kPaths = 200;
constexpr double kPush = 0.6;  // over the scene's largest displacement

void require(pal_status status) {
  if (status != PAL_STATUS_OK) throw std::runtime_error(pal_status_text(status));
}

struct Slides {
  std::vector<double> jumps;  // the largest of each path, over its peak force
  long frames = 0;
  long triangles = 0;  // changes of a contact to another triangle
};

Eigen::Vector3d place_of_site(const Pack& pack, std::uint32_t site) {
  std::uint32_t node = 0;
  require(pal_pack_get_site_node(pack.get(), site, &node));
  return pack.info().metres_per_length_unit *
         Eigen::Vector3d(pack.geometry().rest_positions + size_t{3} * node);
}

struct Path {  // metres
  Eigen::Vector3d from;
  Eigen::Vector3d to;
  Eigen::Vector3d d;  // displacement of the contact
};

class Slider {
 public:
  Slider(const Pack& pack, pal_model model, std::uint32_t num_contacts) : pack_(pack) {
    pal_session_config config = pal_default_session_config(pack.get());
    config.max_contacts = num_contacts;
    config.model = model;
    size_t bytes = 0;
    require(Session::required_bytes(pack, config, bytes));
    arena_.reset(static_cast<unsigned char*>(std::aligned_alloc(64, (bytes + 63) / 64 * 64)));
    require(session_.init(pack, config, {arena_.get(), bytes}));
  }

  // Slides contacts along `paths` in steps of `step` edges, until two are nearer than `least_distance` edges.
  void slide(const std::vector<Path>& paths, double step, double least_distance, Slides& slides) {
    const double edge = pack_.info().mean_surface_edge;
    double longest = 0;
    for (const Path& path : paths) longest = std::max(longest, (path.to - path.from).norm());
    const int steps = static_cast<int>(longest / (step * edge));
    Frame before(paths.size());
    Frame now(paths.size());
    double peak = 0;
    double largest = 0;
    for (int i = 0; i <= steps; ++i) {
      std::vector<pal_contact> contacts;
      for (size_t c = 0; c < paths.size(); ++c) {
        const Eigen::Vector3d place = paths[c].from + (paths[c].to - paths[c].from) * i / std::max(steps, 1);
        require(pal_pack_find_surface_point(pack_.get(), place.data(), &now.points[c]));
        contacts.push_back(pal_contact_at(&now.points[c], paths[c].d.data()));
      }
      if (are_within(least_distance * edge, now)) break;
      require(session_.contact_frame(contacts, now.results));
      double moved = 0;
      double jump = 0;
      for (size_t c = 0; c < paths.size(); ++c) {
        moved = std::max(moved, distance(now.points[c], before.points[c]) / edge);
        jump = std::max(jump, (force_of(now, c) - force_of(before, c)).norm());
        peak = std::max(peak, force_of(now, c).norm());
      }
      if (i > 0 && moved <= kLongest * step) {
        largest = std::max(largest, jump * step / std::max(moved, step));  // scaled to a step of `step`
        for (size_t c = 0; c < paths.size(); ++c)
          slides.triangles +=
              !std::equal(now.points[c].sites, now.points[c].sites + 3, before.points[c].sites);
        ++slides.frames;
      }
      std::swap(before, now);
    }
    if (peak > 0) slides.jumps.push_back(largest / peak);
  }

 private:
  struct Frame {
    explicit Frame(size_t count) : points(count), results(count) {}
    std::vector<pal_surface_point> points;
    std::vector<pal_contact_result> results;
  };
  struct FreeMemory {
    void operator()(unsigned char* memory) const { std::free(memory); }
  };
  static Eigen::Vector3d force_of(const Frame& frame, size_t contact) {
    return Eigen::Vector3d(frame.results[contact].force);
  }
  static double distance(const pal_surface_point& a, const pal_surface_point& b) {
    return (Eigen::Vector3d(a.position) - Eigen::Vector3d(b.position)).norm();
  }
  static bool are_within(double reach, const Frame& frame) {
    for (size_t a = 0; a < frame.points.size(); ++a) {
      for (size_t b = 0; b < a; ++b) {
        if (distance(frame.points[a], frame.points[b]) < reach) return true;
      }
    }
    return false;
  }

  const Pack& pack_;
  std::unique_ptr<unsigned char, FreeMemory> arena_;
  Session session_;
};

Slides slide_all_over(const Pack& pack, pal_model model, std::uint32_t num_contacts, double step,
                      double least_distance) {
  Slider slider(pack, model, num_contacts);
  std::mt19937 random(1);
  const auto site = [&] {
    return static_cast<std::uint32_t>(random() % std::max(1U, pack.info().num_sites));
  };
  const auto unit = [&] { return 2.0 * (static_cast<double>(random()) + 0.5) / 4294967296.0 - 1.0; };
  const auto path = [&] {
    Eigen::Vector3d direction;
    do {
      direction = {unit(), unit(), unit()};
    } while (direction.norm() > 1);
    const Eigen::Vector3d from = place_of_site(pack, site());
    return Path{from, place_of_site(pack, site()),
                kPush * pack.info().max_displacement * direction.normalized()};
  };
  Slides slides;
  for (int i = 0; i < kPaths; ++i) {
    std::vector<Path> paths;
    while (paths.size() < num_contacts) paths.push_back(path());
    slider.slide(paths, step, least_distance, slides);
  }
  std::sort(slides.jumps.begin(), slides.jumps.end());
  return slides;
}

void run_study(const std::filesystem::path& file, const std::filesystem::path& folder) {
  Pack pack;
  require(pack.open(file.c_str()));
  study::StudyTable table(
      "slides",
      "Largest jump of the force between one frame and the next, in percent of the path's peak force.",
      {"model", "contacts", "edges apart", "step, h", "paths", "frames", "triangles entered", "median", "p95",
       "max"});
  struct Row {
    const char* name;
    pal_model model;
    std::uint32_t num_contacts;
    double least_distance;  // edges between contacts
    double step = kStep;
  };
  for (const auto& [name, model, num_contacts, least_distance, step] :
       {Row{"linear_dd", PAL_MODEL_LINEAR, 1, 0},
        Row{"polynomial_dd, affine_site", PAL_MODEL_POLYNOMIAL, 1, 0},
        Row{"linear_dd", PAL_MODEL_LINEAR, 2, 2}, Row{"linear_dd", PAL_MODEL_LINEAR, 3, 2},
        Row{"linear_dd", PAL_MODEL_LINEAR, 2, 0}, Row{"linear_dd", PAL_MODEL_LINEAR, 2, 0, kStep / 4},
        Row{"linear_dd", PAL_MODEL_LINEAR, 3, 0}, Row{"linear_dd", PAL_MODEL_LINEAR, 3, 0, kStep / 4}}) {
    const Slides slides = slide_all_over(pack, model, num_contacts, step, least_distance);
    if (slides.jumps.empty()) continue;
    const auto at = [&](double q) {
      return fmt::format(
          "{:.2f}",
          100 * slides.jumps[static_cast<size_t>(q * static_cast<double>(slides.jumps.size() - 1))]);
    };
    table.add({name, fmt::format("{}", num_contacts),
               num_contacts > 1 ? fmt::format("{:g}", least_distance) : "", fmt::format("{:g}", step),
               fmt::format("{}", slides.jumps.size()), fmt::format("{}", slides.frames),
               fmt::format("{}", slides.triangles), at(0.5), at(0.95), at(1)});
  }
  study::write_text(folder / (table.name() + ".md"), table.markdown());
  study::write_text(folder / (table.name() + ".csv"), table.csv());
  fmt::print("{}", table.markdown());
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  palpate::choose_blas_kernels();
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
