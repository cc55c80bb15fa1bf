#include "bench/peers/method_frames.hpp"

#include <cmath>

#include "bench/peers/fixed_tensor.hpp"
#include "bench/peers/localized_cg.hpp"

namespace palpate::peers {
namespace {

class Measurement {
 public:
  Measurement(const LinearOrgan& organ, const std::vector<std::uint32_t>& sites, Motion motion,
              double amplitude, const Effort& effort)
      : organ_(organ),
        sites_(sites),
        motion_(motion),
        amplitude_(amplitude),
        effort_(effort),
        held_(organ.assembly, nodes_of(organ, sites)) {
    const double start = now();
    exact_.emplace(held_);
    factor_seconds_ = now() - start;
  }

  std::vector<MethodFrames> all() {
    linear_dd();
    fixed_tensor();
    back_solve();
    for (const bool precondition : {false, true}) localized_cg(precondition);
    if (effort_.from_rest) cg_from_rest();
    return std::move(results_);
  }

 private:
  static std::vector<int> nodes_of(const LinearOrgan& organ, const std::vector<std::uint32_t>& sites) {
    std::vector<int> nodes;
    nodes.reserve(sites.size());
    for (const std::uint32_t site : sites) nodes.push_back(organ.site_node(site));
    return nodes;
  }
  Eigen::VectorXd displacements_at(int frame) const {
    return circling(frame, sites_.size(), motion_, amplitude_);
  }

  // Times `frame(d)`. After a frame `displacement()` returns u_f, and `force()` the contacts' forces.
  template <typename Frame, typename Displacement, typename Force>
  MethodFrames& measure(const std::string& method, double preparation_seconds, Frame&& frame,
                        Displacement&& displacement, Force&& force) {
    MethodFrames result{method, preparation_seconds, {}, {}, 0};
    int index = 0;
    frame(displacements_at(index++));
    const double start = now();
    while (index <= effort_.most_frames &&
           (index <= effort_.least_frames || now() - start < effort_.seconds)) {
      const Eigen::VectorXd d = displacements_at(index++);
      result.times.time([&] { frame(d); });
    }
    // Checks come after the timing, because solves would leave cold caches.
    for (int checked = 0; checked < 3; ++checked) {
      const Eigen::VectorXd d = displacements_at(index++);
      frame(d);
      const Eigen::VectorXd displacements = displacement().template cast<double>();
      const Eigen::VectorXd forces = force();
      const Eigen::VectorXd& exact = exact_->frame(d);
      const Eigen::VectorXd exact_force = held_.force(exact, d);
      result.errors.add(displacements - exact, d, forces - exact_force, exact_force);
    }
    results_.push_back(std::move(result));
    return results_.back();
  }

  void linear_dd() {
    LinearSession session(organ_, static_cast<std::uint32_t>(sites_.size()));
    std::vector<pal_contact> contacts = contacts_at(sites_);
    std::vector<Eigen::Index> shown;  // row of the packed field of each free dof
    std::vector<int> packed(static_cast<size_t>(organ_.model.num_nodes()), -1);
    for (size_t i = 0; i < organ_.sites.packed_nodes.size(); ++i)
      packed[static_cast<size_t>(organ_.sites.packed_nodes[i])] = static_cast<int>(i);
    shown.reserve(held_.free_dofs.size());
    for (const int dof : held_.free_dofs) shown.push_back(3 * packed[static_cast<size_t>(dof / 3)] + dof % 3);
    const auto force = [&] { return session.force(contacts.size()); };
    measure(
        "linear_dd", organ_.pack_seconds,
        [&](const Eigen::VectorXd& d) {
          displace(d, contacts);
          session.contact_frame(contacts);
          session.visual_frame();
        },
        [&]() -> RealVector { return session.field()(shown); }, force);
    measure(
        "linear_dd forces alone", organ_.pack_seconds,
        [&](const Eigen::VectorXd& d) {
          displace(d, contacts);
          session.contact_frame(contacts);
        },
        [&]() -> RealVector {
          session.visual_frame();
          return session.field()(shown);
        },
        force);
  }

  void fixed_tensor() {
    const double start = now();
    FixedTensor tensor(held_, *exact_);
    measure(
        "PFE", factor_seconds_ + now() - start, [&](const Eigen::VectorXd& d) { tensor.frame(d); },
        [&]() -> const RealVector& { return tensor.displacement(); }, [&] { return tensor.force(); });
  }

  void back_solve() {
    Eigen::VectorXd force;
    measure(
        "back-solve", factor_seconds_,
        [&](const Eigen::VectorXd& d) { force = held_.force(exact_->frame(d), d); },
        [&]() -> const Eigen::VectorXd& { return exact_->displacement(); }, [&] { return force; });
  }

  void localized_cg(bool precondition) {
    const double start = now();
    LocalizedCg lcg(held_, precondition, kLcgTolerance);
    const double preparation_seconds = now() - start;
    std::vector<int> iterations;
    Eigen::VectorXd force;
    MethodFrames& result = measure(
        precondition ? "LCG block-Jacobi" : "LCG", preparation_seconds,
        [&](const Eigen::VectorXd& d) {
          force = held_.force(lcg.frame(d), d);
          iterations.push_back(lcg.iterations());
        },
        [&]() -> const Eigen::VectorXd& { return lcg.displacement(); }, [&] { return force; });
    result.iterations = median(iterations);
  }

  // LCG, but each frame starts from the body at rest.
  void cg_from_rest() {
    std::optional<LocalizedCg> cg;
    std::vector<int> iterations;
    Eigen::VectorXd force;
    MethodFrames& result = measure(
        "CG from rest", 0,
        [&](const Eigen::VectorXd& d) {
          cg.emplace(held_, false, kLcgTolerance);
          force = held_.force(cg->frame(d), d);
          iterations.push_back(cg->iterations());
        },
        [&]() -> const Eigen::VectorXd& { return cg->displacement(); }, [&] { return force; });
    result.iterations = median(iterations);
  }

  static int median(std::vector<int>& values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
  }

  const LinearOrgan& organ_;
  const std::vector<std::uint32_t>& sites_;
  Motion motion_;
  double amplitude_;
  Effort effort_;
  HeldContacts held_;
  std::optional<BackSolve> exact_;
  double factor_seconds_ = 0;
  std::vector<MethodFrames> results_;
};

}  // namespace

std::vector<MethodFrames> measure_methods(const LinearOrgan& organ, const std::vector<std::uint32_t>& sites,
                                          Motion motion, double amplitude, const Effort& effort) {
  return Measurement(organ, sites, motion, amplitude, effort).all();
}

Eigen::VectorXd circling(int frame, size_t num_contacts, Motion motion, double amplitude) {
  Eigen::VectorXd d(static_cast<Eigen::Index>(3 * num_contacts));
  for (size_t c = 0; c < num_contacts; ++c) {
    const double angle = 0.02 * frame + (motion == Motion::as_one ? 0.0 : static_cast<double>(c));
    d.segment<3>(static_cast<Eigen::Index>(3 * c)) =
        amplitude * Eigen::Vector3d(std::cos(angle), std::sin(angle), -1.0);
  }
  return d;
}

}  // namespace palpate::peers
