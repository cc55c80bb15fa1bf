// Zhong et al. 2005 figure 6: a probe prepared for S touches at T.
// - (a) PFE has only the tensor of S, and moves S;
// - (b) EPFE takes the blocks of T from the inverse stiffness;
// - (c) eq. (25) moves the tensor of S to T, as SiteMap::inverse.
#include "bench/peers/elsewhere_picture.hpp"
#include "bench/peers/fixed_tensor.hpp"
#include "bench/peers/peers.hpp"
#include "bench/peers/site_sets.hpp"
#include "offline/precompute/affine_site.hpp"

namespace palpate::peers {
namespace {

constexpr std::array kDistances = {0, 1, 2, 3, 4, 6};  // edges from S to T
constexpr int kPicturedDistance = 4;
constexpr double kPicturedPush = 2;  // over the table's push: makes the dent visible; the model is linear
constexpr size_t kNumPrepared = 8;   // number of sites S; the figure shows the first

// The precomputed data for a contact at S.
struct PreparedSite {
  Eigen::MatrixXd field;  // 3 nodes of the model x 3: displacement by unit displacements of S
  Eigen::Matrix3d force;  // force at S by unit displacements of S

  PreparedSite(const LinearOrgan& organ, std::uint32_t site)
      : field(Eigen::MatrixXd::Zero(organ.assembly.num_dofs(), 3)) {
    const int node = organ.site_node(site);
    const HeldContacts held(organ.assembly, {node});
    BackSolve solve(held);
    FixedTensor tensor(held, solve);
    for (int axis = 0; axis < 3; ++axis) {
      tensor.frame(Eigen::Vector3d::Unit(axis));
      field(held.free_dofs, axis) = tensor.displacement().cast<double>();
      field(3 * node + axis, axis) = 1;
      force.col(axis) = tensor.force();
    }
  }
};

Eigen::VectorXd shown(const LinearOrgan& organ, const Eigen::VectorXd& displacement) {
  Eigen::VectorXd values(3 * organ.num_shown());
  for (Eigen::Index i = 0; i < organ.num_shown(); ++i)
    values.segment<3>(3 * i) =
        displacement.segment<3>(Eigen::Index{3} * organ.sites.packed_nodes[static_cast<size_t>(i)]);
  return values;
}

// Returns the field of S, 3 packed nodes x 3, moved to T by eq. (25). A singular map leaves the field at S.
Eigen::MatrixXd moved_field(const LinearOrgan& organ, const PreparedSite& prepared, std::uint32_t from,
                            std::uint32_t to) {
  SitePolynomial at_site;
  at_site.to_unit.setIdentity();
  at_site.degree = 1;
  at_site.linear.resize(3 * organ.num_shown(), 3);
  for (int axis = 0; axis < 3; ++axis) at_site.linear.col(axis) = shown(organ, prepared.field.col(axis));
  at_site.basis.resize(at_site.linear.rows(), 0);
  const auto placement = place_contact(organ.model, organ.sites, SiteMap::inverse, organ.sites.sites[from],
                                       organ.sites.sites[to]);
  if (!placement) return at_site.linear;
  return moved(at_site, *placement, local_table(organ.model, organ.sites, *placement)).linear;
}

// Returns the packed node with the largest displacement.
Eigen::Index centre_of(const Eigen::VectorXd& field) {
  Eigen::Index node = 0;
  field.reshaped(3, field.size() / 3).colwise().squaredNorm().maxCoeff(&node);
  return node;
}

struct Mean {
  double sum = 0, largest = 0;
  int count = 0;
  void add(double value) {
    sum += value;
    largest = std::max(largest, value);
    ++count;
  }
  std::string mean() const {
    return sum / count < 1e-3 ? fmt::format("{:.1e}", sum / count) : fmt::format("{:.3f}", sum / count);
  }
  std::string most() const {
    return largest < 1e-3 ? fmt::format("{:.1e}", largest) : fmt::format("{:.3f}", largest);
  }
};

// Errors of a method at one distance from S to T, over all S.
struct Outcome {
  Mean displacement, force;  // relative errors
  Mean off_centre;           // distance from T to the node with the largest displacement, length unit

  void add(const LinearOrgan& organ, int touched, const Eigen::VectorXd& field, const Eigen::Vector3d& f,
           const Eigen::VectorXd& exact, const Eigen::Vector3d& exact_force, double d) {
    displacement.add(longest(field - exact) / d);
    force.add((f - exact_force).norm() / exact_force.norm());
    const int centre = organ.sites.packed_nodes[static_cast<size_t>(centre_of(field))];
    off_centre.add((organ.model.positions[static_cast<size_t>(centre)] -
                    organ.model.positions[static_cast<size_t>(touched)])
                       .norm());
  }
};

// Returns the site `edges` away with the normal nearest to the centre's, not on a fissure's opposite wall.
std::uint32_t most_parallel(const LinearOrgan& organ, const SiteRings& rings, int edges) {
  std::uint32_t best = rings.sites.front();
  double largest = -2;
  for (size_t i = 0; i < rings.sites.size(); ++i) {
    if (rings.edges[i] != edges) continue;
    const double cosine =
        organ.sites.sites[rings.sites[i]].inward.dot(organ.sites.sites[rings.sites.front()].inward);
    if (cosine <= largest) continue;
    largest = cosine;
    best = rings.sites[i];
  }
  if (largest < -1) throw std::runtime_error(fmt::format("no site is {} edges away", edges));
  return best;
}

std::vector<Eigen::Vector3d> as_vectors(const Eigen::VectorXd& field) {
  std::vector<Eigen::Vector3d> vectors;
  for (Eigen::Index i = 0; i < field.size() / 3; ++i) vectors.emplace_back(field.segment<3>(3 * i));
  return vectors;
}

void draw(const LinearOrgan& organ, std::uint32_t prepared, std::uint32_t touched, const Eigen::Vector3d& d,
          const Eigen::VectorXd& by_pfe, const Eigen::VectorXd& by_epfe, const Eigen::VectorXd& by_map,
          const Eigen::VectorXd& exact, const std::filesystem::path& png) {
  ElsewherePicture picture;
  for (const int node : organ.sites.packed_nodes)
    picture.rest.push_back(organ.model.positions[static_cast<size_t>(node)]);
  picture.triangles = organ.sites.triangles;
  picture.prepared = organ.sites.sites[prepared].packed_node;
  picture.touched = organ.sites.sites[touched].packed_node;
  picture.probe = kPicturedPush * d;
  picture.length_unit = "mm";
  picture.panels[0] = {as_vectors(kPicturedPush * by_pfe),
                       fmt::format("(a) PFE, the tensor of S: error {:.0f} % of the push",
                                   100 * longest(by_pfe - exact) / d.norm())};
  picture.panels[1] = {
      as_vectors(kPicturedPush * by_epfe),
      fmt::format("(b) EPFE, linear_dd: error {:.0e} of the push", longest(by_epfe - exact) / d.norm())};
  picture.panels[2] = {as_vectors(kPicturedPush * by_map),
                       fmt::format("(c) PFE moved by eq. (25): error {:.0f} % of the push",
                                   100 * longest(by_map - exact) / d.norm())};
  picture.title = fmt::format("Prepared at S (node {}), probed at T (node {}), {} edges away, by {:.1f} mm",
                              organ.model.labels[static_cast<size_t>(organ.site_node(prepared))],
                              organ.model.labels[static_cast<size_t>(organ.site_node(touched))],
                              kPicturedDistance, picture.probe.norm());
  write_elsewhere_picture(picture, png);
}

}  // namespace

std::vector<study::StudyTable> touched_elsewhere_page(const LinearOrgan& brain,
                                                      const std::filesystem::path& pictures) {
  std::vector<std::uint32_t> prepared_sites = random_sites(brain.num_sites(), kNumPrepared - 1, 6);
  prepared_sites.insert(prepared_sites.begin(), site_at(brain, kPushedLabel));
  LinearSession session(brain, 1);
  std::array<Outcome, kDistances.size()> pfe, epfe, by_maps;
  std::array<Mean, kDistances.size()> apart;  // distance between S and T, length unit
  for (size_t s = 0; s < prepared_sites.size(); ++s) {
    std::fprintf(stderr, "figure 6, site %zu of %zu\n", s + 1, prepared_sites.size());
    const std::uint32_t site = prepared_sites[s];
    const PreparedSite prepared(brain, site);
    const SiteRings rings(brain, site);
    for (size_t i = 0; i < kDistances.size(); ++i) {
      const std::uint32_t touched = most_parallel(brain, rings, kDistances[i]);
      const int node = brain.site_node(touched);
      const Eigen::Vector3d d = brain.scene.max_displacement * brain.sites.sites[touched].inward;
      const ExactAnswer exact(brain.assembly, {node}, d);
      const Eigen::VectorXd exact_field = shown(brain, exact.displacement);

      const Eigen::VectorXd by_pfe = shown(brain, prepared.field * d);
      std::vector<pal_contact> contacts = contacts_at({touched});
      displace(d, contacts);
      session.contact_frame(contacts);
      session.visual_frame();
      const Eigen::VectorXd by_epfe = session.field().cast<double>();

      const Eigen::VectorXd by_map = moved_field(brain, prepared, site, touched) * d;
      pfe[i].add(brain, node, by_pfe, prepared.force * d, exact_field, exact.force, d.norm());
      epfe[i].add(brain, node, by_epfe, session.force(1), exact_field, exact.force, d.norm());
      by_maps[i].add(brain, node, by_map, prepared.force * d, exact_field, exact.force, d.norm());
      apart[i].add((brain.model.positions[static_cast<size_t>(node)] -
                    brain.model.positions[static_cast<size_t>(brain.site_node(site))])
                       .norm());
      if (s == 0 && kDistances[i] == kPicturedDistance)
        draw(brain, site, touched, d, by_pfe, by_epfe, by_map, exact_field, pictures / "figure6.png");
    }
  }
  study::StudyTable table(
      "figure6",
      fmt::format(
          "Prepared at S, touched at T with a push of {:.2f} mm along the normal: mean (largest) over "
          "{} S. Errors against the solve with the contact at T; off centre: from T to the node that "
          "moves most.",
          brain.scene.max_displacement, kNumPrepared),
      {"edges from S to T", "mm", "method", "displacement error", "force error", "off centre (mm)"});
  for (size_t i = 0; i < kDistances.size(); ++i) {
    const auto row = [&](const char* method, const Outcome& outcome) {
      const auto cell = [](const Mean& mean) { return fmt::format("{} ({})", mean.mean(), mean.most()); };
      table.add({std::to_string(kDistances[i]), fmt::format("{:.1f}", apart[i].sum / apart[i].count), method,
                 cell(outcome.displacement), cell(outcome.force),
                 fmt::format("{:.1f} ({:.1f})", outcome.off_centre.sum / outcome.off_centre.count,
                             outcome.off_centre.largest)});
    };
    row("PFE", pfe[i]);
    row("EPFE (linear_dd)", epfe[i]);
    row("PFE moved by eq. (25)", by_maps[i]);
  }
  return {table};
}

}  // namespace palpate::peers
