#include "offline/precompute/contact_sets.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <optional>
#include <random>
#include <set>
#include <string_view>
#include <utility>

#include "offline/precompute/sample_points.hpp"
#include "offline/precompute/solver_threads.hpp"

namespace palpate {
namespace {

// Chooses sites whose patches share no node.
class SiteChooser {
 public:
  SiteChooser(const Model& model, const ContactSites& sites, std::mt19937_64& random)
      : model_(model), sites_(sites), random_(random), order_(sites.sites.size()) {
    std::iota(order_.begin(), order_.end(), size_t{0});
  }

  // Returns the sites of a set; empty where the patches leave too few sites.
  std::vector<size_t> choose(SetKind kind) {
    const auto count = static_cast<size_t>(num_contacts_of(kind));
    if (kind != SetKind::three_apart) return draw_apart(is_near(kind), count);
    constexpr int kTried = 8;
    std::vector<size_t> widest;
    double largest_gap = -1;
    for (int i = 0; i < kTried; ++i) {
      std::vector<size_t> tried = draw_apart(false, count);
      if (tried.empty() || least_distance(tried) <= largest_gap) continue;
      largest_gap = least_distance(tried);
      widest = std::move(tried);
    }
    return widest;
  }

 private:
  // Draws sites with disjoint patches: a random first site, then its nearest sites (`near`) or random sites.
  std::vector<size_t> draw_apart(bool near, size_t count) {
    for (size_t i = order_.size() - 1; i > 0; --i) std::swap(order_[i], order_[random_() % (i + 1)]);
    if (near) {
      const size_t first = order_.front();
      std::sort(order_.begin(), order_.end(), [&](size_t a, size_t b) {
        return std::pair(distance(first, a), a) < std::pair(distance(first, b), b);
      });
    }
    return first_apart(sites_, order_, count);
  }

  double distance(size_t a, size_t b) const {
    const auto position = [&](size_t site) -> const Eigen::Vector3d& {
      return model_.positions[static_cast<size_t>(sites_.sites[site].node)];
    };
    return (position(a) - position(b)).norm();
  }

  double least_distance(const std::vector<size_t>& chosen) const {
    double least = std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < chosen.size(); ++i) {
      for (size_t j = 0; j < i; ++j) least = std::min(least, distance(chosen[i], chosen[j]));
    }
    return least;
  }

  const Model& model_;
  const ContactSites& sites_;
  std::mt19937_64& random_;
  std::vector<size_t> order_;
};

// Lists all inputs that distinguish a set from other sets of the organ.
std::vector<double> request_of(const Model& model, const ContactSites& sites,
                               const std::vector<LinearContact>& contacts) {
  std::vector<double> request;
  for (const LinearContact& contact : contacts) {
    request.push_back(model.labels[static_cast<size_t>(sites.sites[contact.site].node)]);
    request.insert(request.end(), contact.displacement.begin(), contact.displacement.end());
  }
  return request;
}

// Converts the solution of a set to a record of the store.
SolvedPush stored_push(const ContactTruth& truth) {
  SolvedPush push;
  push.outcome = truth.solved ? PushOutcome::solved : PushOutcome::no_equilibrium;
  for (const Eigen::Vector3d& force : truth.forces)
    push.numbers.insert(push.numbers.end(), force.begin(), force.end());
  for (const double component : truth.field) push.fields.push_back(static_cast<float>(component));
  return push;
}

ContactTruth truth_of(const std::vector<LinearContact>& contacts, const SolvedPush& push) {
  ContactTruth truth;
  truth.contacts = contacts;
  truth.solved = push.outcome == PushOutcome::solved;
  if (!truth.solved) return truth;
  truth.field.resize(static_cast<Eigen::Index>(push.fields.size()));
  std::copy(push.fields.begin(), push.fields.end(), truth.field.begin());
  for (size_t c = 0; c < contacts.size(); ++c) truth.forces.emplace_back(&push.numbers[3 * c]);
  return truth;
}

}  // namespace

const char* words_for(SetKind kind) {
  switch (kind) {
    case SetKind::two_near:
      return "2 near";
    case SetKind::two_anywhere:
      return "2 anywhere";
    case SetKind::three_near:
      return "3 near";
    case SetKind::three_apart:
      return "3 apart";
  }
  return "";
}

std::vector<size_t> first_apart(const ContactSites& sites, const std::vector<size_t>& order, size_t count) {
  std::vector<size_t> chosen;
  std::set<int> held;
  for (const size_t site : order) {
    const std::vector<int>& patch = sites.sites[site].patch;
    if (std::any_of(patch.begin(), patch.end(), [&](int node) { return held.contains(node); })) continue;
    held.insert(patch.begin(), patch.end());
    chosen.push_back(site);
    if (chosen.size() == count) return chosen;
  }
  return {};
}

std::vector<ContactSet> draw_contact_sets(const Model& model, const Scene& scene, const ContactSites& sites,
                                          int count, std::uint64_t seed) {
  std::vector<ContactSet> sets;
  if (count == 0 || scene.max_contacts < 2 || sites.sites.size() < 2) return sets;
  const size_t num_kinds = scene.max_contacts > 2 ? 4 : 2;
  std::mt19937_64 random(seed);
  const bool half = scene.directions == Directions::inward;
  // Draw equally many sizes |d| from each quarter of the range, in random order.
  std::vector<Eigen::Vector3d> points = choose_survey_points(3 * count, half, random());
  for (size_t i = points.size() - 1; i > 0; --i) std::swap(points[i], points[random() % (i + 1)]);
  SiteChooser chooser(model, sites, random);
  auto point = points.begin();
  for (int i = 0; i < count; ++i) {
    ContactSet set;
    set.kind = kSetKinds[static_cast<size_t>(i) % num_kinds];
    for (const size_t site : chooser.choose(set.kind)) {
      set.contacts.push_back({site, scene.max_displacement * (sites.sites[site].frame * *point)});
      ++point;
    }
    if (!set.contacts.empty()) sets.push_back(std::move(set));
  }
  return sets;
}

SolvedSets solve_drawn_sets(const Assembly& assembly, const ContactSites& sites, const RestState& rest,
                            std::vector<ContactSet> sets, int jobs, const SampleStore* store,
                            const std::function<void(int, int)>& progress,
                            const std::function<size_t()>& next) {
  const Model& model = assembly.model();
  SolvedSets solved;
  solved.truths.resize(sets.size());
  std::vector<SolveCounts> counts(sets.size());
  for_each_on_threads(
      assembly, sets.size(), jobs,
      [&](StaticSolver& solver, size_t i) {
        const std::vector<LinearContact>& contacts = sets[i].contacts;
        SolveCounts& count = counts[i];
        const std::vector<double> request = request_of(model, sites, contacts);
        std::optional<SampleFile> kept;
        if (store != nullptr) {
          const SampleStore::Place place = store->place_of(
              {reinterpret_cast<const char*>(request.data()), request.size() * sizeof(double)});
          kept.emplace(place.file, place.binding);
        }
        const PushRequest push_request = {PushRequest::Kind::set, 0, contacts.front().displacement};
        std::optional<SolvedPush> push;
        if (kept) push = kept->find(push_request, 3 * contacts.size(), 3 * sites.packed_nodes.size());
        if (push) {
          count.reused = 1;
        } else {
          const long factors_before = solver.num_factorizations();
          const ContactTruth truth = solve_contact_set(solver, sites, rest, contacts, count.iterations);
          count.factorizations = solver.num_factorizations() - factors_before;
          count.solves = 1;
          push = stored_push(truth);
          if (kept && !kept->keep(push_request, *push)) count.not_kept = 1;
        }
        solved.truths[i] = truth_of(contacts, *push);
      },
      progress, next);
  for (const SolveCounts& count : counts) solved.counts += count;
  solved.sets = std::move(sets);
  return solved;
}

}  // namespace palpate
