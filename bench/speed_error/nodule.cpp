// Can a tool feel a nodule? A tool swipes over the brain's stiff inclusion at constant depth. The study
// compares the forces of the full model and of each response model, with and without the inclusion.
//
//   palpate_study_nodule SCENE.toml DIR     writes DIR/nodule.md, nodule.csv, nodule_path.csv and nodule.svg
//
// Between sites the reference is the blend of the full solves at the triangle's corners. Contrast is
// the largest relative excess of a model's force with the inclusion over the force without, along the path.
#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <palpate/palpate.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/solver/study_table.hpp"
#include "offline/fem/blas_kernels.hpp"
#include "offline/pack/pack_writer.hpp"
#include "offline/precompute/contact_truth.hpp"
#include "offline/report/gnuplot.hpp"
#include "offline/report/plot_style.hpp"

namespace palpate {
namespace {

constexpr double kStep = 0.1;    // mm
constexpr double kReach = 20;    // mm to each side of the middle
constexpr double kBeside = 1.6;  // h; sites within this distance of the path are packed
constexpr double kDepth = 0.6;   // h
constexpr int kRings = 2;

void require(pal_status status) {
  if (status != PAL_STATUS_OK) throw std::runtime_error(pal_status_text(status));
}

struct Swipe {
  Eigen::Vector3d middle;  // mm
  Eigen::Vector3d along = Eigen::Vector3d::UnitY();
  Eigen::Vector3d push;  // mm
};

// Returns the swipe over the site nearest to the inclusion.
Swipe swipe_over(const Model& model, const ContactSites& sites) {
  Eigen::Vector3d inclusion = Eigen::Vector3d::Zero();
  const std::vector<int>& stiff = model.element_sets.at("INCLUSION");
  for (const int element : stiff) {
    for (const int node : model.elements[static_cast<size_t>(element)].corners())
      inclusion += model.positions[static_cast<size_t>(node)] / (4.0 * static_cast<double>(stiff.size()));
  }
  const auto place = [&](const ContactSite& site) { return model.positions[static_cast<size_t>(site.node)]; };
  const ContactSite& nearest = *std::min_element(
      sites.sites.begin(), sites.sites.end(), [&](const ContactSite& a, const ContactSite& b) {
        return (place(a) - inclusion).norm() < (place(b) - inclusion).norm();
      });
  Swipe swipe;
  swipe.middle = place(nearest);
  swipe.push = kDepth * sites.mean_surface_edge * nearest.inward;
  return swipe;
}

// The organ with a pack of the sites along the path.
class Body {
 public:
  Body(LoadedScene loaded, const Swipe& swipe, bool with_inclusion)
      : scene_(std::move(loaded.scene)), model_(std::move(loaded.model)) {
    if (!with_inclusion) {
      const int tissue =
          model_.elements[static_cast<size_t>(model_.element_sets.at("TISSUE").front())].material;
      for (Tetrahedron& element : model_.elements) element.material = tissue;
    }
    const double beside = kBeside * find_contact_sites(scene_, model_).mean_surface_edge;
    std::erase_if(scene_.sites, [&](int node) {
      const Eigen::Vector3d from = model_.positions[static_cast<size_t>(node)] - swipe.middle;
      const double on_path = std::clamp(from.dot(swipe.along), -kReach, kReach);
      return Eigen::Vector2d(from.x(), from.y() - on_path).norm() > beside;
    });
    sites_ = find_contact_sites(scene_, model_);
    assembly_ = std::make_unique<Assembly>(model_, model_.fixed_dofs());
  }

  const ContactSites& sites() const { return sites_; }

  // Returns two packs: with all models, and without polynomials.
  std::array<AlignedBytes, 2> packs() const {
    const LinearDd linear = compute_linear_dd(*assembly_, sites_);
    SamplingPlan plan;
    plan.target = scene_.accuracy_target;
    plan.survey_samples = 0;
    plan.jobs = 2;
    const std::vector<SiteResult> results = sample_sites(*assembly_, scene_, sites_, linear, plan);
    ZoneTables zone = find_zones(model_, sites_, kRings);
    PackContent content{model_, scene_, sites_, &linear, &results, false, {}, {}};
    content.zone = &zone;
    PackContent without = content;
    without.polynomials = nullptr;
    return {write_pack(content), write_pack(without)};
  }

  // Returns for each site the force of the full model along the push: force unit.
  std::vector<double> true_forces(const Eigen::Vector3d& push) const {
    std::vector<std::vector<LinearContact>> sets;
    for (size_t site = 0; site < sites_.sites.size(); ++site) sets.push_back({{site, push}});
    std::vector<double> forces;
    for (const ContactTruth& truth : solve_contact_sets(*assembly_, sites_, sets, 2, {})) {
      if (!truth.solved) throw std::runtime_error("a push of the swipe has no equilibrium");
      forces.push_back(truth.forces.front().dot(push.normalized()));
    }
    return forces;
  }

 private:
  Scene scene_;
  Model model_;
  ContactSites sites_;
  std::unique_ptr<Assembly> assembly_;
};

struct Curve {
  std::string name;
  std::vector<double> forces;  // mN, along the push, at each step of the path
};

// Returns the curves of the full model and of each response model. `places` gets the steps of the path, mm.
std::vector<Curve> swipe_body(const Body& body, const Swipe& swipe, std::vector<double>& places) {
  const std::array<AlignedBytes, 2> bytes = body.packs();
  std::array<Pack, 2> packs;
  for (size_t i = 0; i < packs.size(); ++i)
    require(packs[i].open_memory(bytes[i].bytes().data(), bytes[i].bytes().size()));
  const pal_pack_info info = packs[0].info();
  const double metres = info.metres_per_length_unit;
  std::vector<pal_surface_point> points;
  places.clear();
  for (int i = 0; i <= static_cast<int>(2 * kReach / kStep); ++i) {
    places.push_back(i * kStep - kReach);
    const Eigen::Vector3d place = metres * (swipe.middle + places.back() * swipe.along);
    require(pal_pack_find_surface_point(packs[0].get(), place.data(), &points.emplace_back()));
  }
  const std::vector<double> truth = body.true_forces(swipe.push);
  std::vector<Curve> curves(1, {"full model", {}});
  for (const pal_surface_point& point : points) {
    double force = 0;
    for (size_t corner = 0; corner < 3; ++corner) force += point.weights[corner] * truth[point.sites[corner]];
    curves.front().forces.push_back(force);
  }
  struct ModelCase {
    const char* name;
    const Pack& pack;
    pal_model model;
  };
  for (const auto& [name, pack, model] : {ModelCase{"linear_dd", packs[0], PAL_MODEL_LINEAR},
                                          {"polynomial_dd", packs[0], PAL_MODEL_POLYNOMIAL},
                                          {"nonlinear_zone", packs[0], PAL_MODEL_ZONE},
                                          {"nonlinear_zone without polynomials", packs[1], PAL_MODEL_ZONE}}) {
    pal_session_config config = pal_default_session_config(pack.get());
    config.max_contacts = 1;
    config.model = model;
    size_t size = 0;
    require(Session::required_bytes(pack, config, size));
    AlignedBytes arena(size);
    Session session;
    require(session.init(pack, config, arena.bytes()));
    Curve& curve = curves.emplace_back(Curve{name, {}});
    const Eigen::Vector3d d = metres * swipe.push;
    for (const pal_surface_point& point : points) {
      constexpr int kFramesToRest = 8;  // for a new zone to converge
      pal_contact_result result = {};
      const pal_contact contact = pal_contact_at(&point, d.data());
      for (int frame = 0; frame < kFramesToRest; ++frame)
        require(session.contact_frame({&contact, 1}, {&result, 1}));
      curve.forces.push_back(Eigen::Vector3d(result.force).dot(d.normalized()) / info.newtons_per_force_unit);
    }
  }
  return curves;
}

// Returns the largest relative excess of a curve over another, and its index along the path.
std::pair<double, size_t> contrast(const Curve& with, const Curve& without) {
  std::pair<double, size_t> most = {-1, 0};
  for (size_t i = 0; i < with.forces.size(); ++i)
    most = std::max(most, {with.forces[i] / without.forces[i] - 1, i});
  return most;
}

// Returns the largest change of the force from step to step, over the peak force.
double largest_jump(const Curve& curve) {
  double largest = 0;
  for (size_t i = 1; i < curve.forces.size(); ++i)
    largest = std::max(largest, std::abs(curve.forces[i] - curve.forces[i - 1]));
  return largest / *std::max_element(curve.forces.begin(), curve.forces.end());
}

std::string plot(const std::vector<double>& places, const std::vector<Curve>& with,
                 const std::vector<Curve>& without) {
  struct Line {
    const char* colour;
    const char* dash;
    double width;
  };
  constexpr Line kLines[] = {{"#bbbbbb", "1", 6},
                             {"#e69f00", "2", 2},
                             {"#0072b2", "1", 1.6},
                             {"#009e73", "4", 1.6},
                             {"#cc79a7", "3", 1.6}};
  std::string blocks;
  std::string forces;
  std::string contrasts;
  for (size_t c = 0; c < with.size(); ++c) {
    std::vector<std::string> lines;
    for (size_t i = 0; i < places.size(); ++i) {
      lines.push_back(fmt::format("{:.1f} {:g} {:g} {:g}", places[i], with[c].forces[i], without[c].forces[i],
                                  100 * (with[c].forces[i] / without[c].forces[i] - 1)));
    }
    blocks += data_block(fmt::format("Curve{}", c), lines);
    const std::string look =
        fmt::format("lc rgb '{}' dt {} lw {}", kLines[c].colour, kLines[c].dash, kLines[c].width);
    forces += fmt::format("{}$Curve{} using 1:2 with lines {} title {}", c == 0 ? "plot " : ", ", c, look,
                          quoted(with[c].name));
    contrasts += fmt::format("{}$Curve{} using 1:4 with lines {}", c == 0 ? "plot " : ", ", c, look);
  }
  return plot_frame() + blocks +
         "set xlabel 'along the swipe, mm'\nset key at screen 0.5, screen 0.98 center top samplen 3\n"
         "set multiplot layout 1,2 margins 0.09,0.985,0.14,0.68 spacing 0.1,0.1\n"
         "set title 'force, mN' offset 0,-0.5\n" +
         forces + "\nunset key\nset title 'beyond the force without the inclusion, %' offset 0,-0.5\n" +
         contrasts + "\nunset multiplot\n";
}

void study_swipe(const std::filesystem::path& scene, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  const LoadedScene loaded = read_scene(scene);
  const Swipe swipe = swipe_over(loaded.model, find_contact_sites(loaded.scene, loaded.model));
  std::vector<double> places;
  const std::vector<Curve> with = swipe_body(Body(loaded, swipe, true), swipe, places);
  const std::vector<Curve> without = swipe_body(Body(loaded, swipe, false), swipe, places);
  const auto [true_contrast, where] = contrast(with.front(), without.front());
  study::StudyTable table("nodule",
                          fmt::format("A swipe of {:g} mm over the inclusion, {:.2f} mm deep ({:g} h), in "
                                      "steps of {:g} mm. The full model feels it "
                                      "most {:.1f} mm from the middle.",
                                      2 * kReach, swipe.push.norm(), kDepth, kStep, std::abs(places[where])),
                          {"model", "contrast %", "of it kept %", "largest error of the force %",
                           "largest jump in 0.1 mm % of the peak"});
  study::StudyTable path("nodule_path", "", {"mm", "model", "force with mN", "force without mN"});
  for (size_t c = 0; c < with.size(); ++c) {
    const double model_contrast = contrast(with[c], without[c]).first;
    double worst = 0;
    for (size_t i = 0; i < places.size(); ++i) {
      worst = std::max(worst, std::abs(with[c].forces[i] / with.front().forces[i] - 1));
      path.add({fmt::format("{:.1f}", places[i]), with[c].name, fmt::format("{:.9g}", with[c].forces[i]),
                fmt::format("{:.9g}", without[c].forces[i])});
    }
    table.add({with[c].name, fmt::format("{:.3g}", 100 * model_contrast),
               fmt::format("{:.4g}", 100 * model_contrast / true_contrast),
               c == 0 ? "the truth" : fmt::format("{:.3g}", 100 * worst),
               fmt::format("{:.3g}", 100 * largest_jump(with[c]))});
  }
  study::write_page(folder, "nodule", {table});
  study::write_text(folder / "nodule_path.csv", path.csv());
  draw_plot(plot(places, with, without), 1000, 440, folder / "nodule");
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  palpate::choose_blas_kernels();
  try {
    if (argc != 3) throw std::invalid_argument("usage: palpate_study_nodule SCENE.toml DIR");
    palpate::study_swipe(argv[1], argv[2]);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
}
