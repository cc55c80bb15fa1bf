#include "offline/mesh/volume_patches.hpp"

#include <algorithm>
#include <map>
#include <queue>
#include <tuple>

#include "offline/mesh/element_faces.hpp"

namespace palpate {
namespace {

// The face neighbours of each element within its group.
class Neighbours {
 public:
  Neighbours(const Model& model, const std::vector<int>& group) : of_(model.elements.size()) {
    const std::vector<ElementFace> faces = sorted_faces(model);
    for (std::size_t i = 1; i < faces.size(); ++i) {
      if (faces[i].sorted != faces[i - 1].sorted) continue;
      const auto a = static_cast<std::size_t>(faces[i - 1].element);
      const auto b = static_cast<std::size_t>(faces[i].element);
      if (group[a] < 0 || group[a] != group[b]) continue;
      of_[a].push_back(static_cast<int>(b));
      of_[b].push_back(static_cast<int>(a));
    }
  }
  const std::vector<int>& of(int element) const { return of_[static_cast<std::size_t>(element)]; }

 private:
  std::vector<std::vector<int>> of_;
};

// Divides the four-node elements of each group into patches of about `target_size` elements.
class PatchGrower {
 public:
  PatchGrower(Model& model, const std::vector<int>& group, int target_size)
      : model_(model), target_size_(static_cast<std::size_t>(target_size)), neighbours_(model, group) {
    for (std::size_t e = 0; e < model.elements.size(); ++e) {
      if (group[e] < 0 || model.elements[e].num_nodes != 4) continue;
      elements_.push_back(static_cast<int>(e));
      for (const int other : neighbours_.of(static_cast<int>(e))) free_neighbours_[other] += 1;
    }
  }

  // Grows patch after patch. Each seed has the fewest free neighbours, so that few single elements remain.
  std::vector<std::vector<int>> grow() {
    std::size_t next = 0;
    while (true) {
      const int seed = next_seed(next);
      if (seed < 0) break;
      grow_from(seed);
    }
    join_small_patches();
    std::vector<std::vector<int>> patches;
    for (std::vector<int>& patch : patches_) {
      if (!patch.empty()) patches.push_back(std::move(patch));
    }
    return patches;
  }

 private:
  const Tetrahedron& element(int e) const { return model_.elements[static_cast<std::size_t>(e)]; }
  bool is_free(int e) const { return patch_of_.find(e) == patch_of_.end(); }

  Eigen::Vector3d centre(int e) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const int node : element(e).corners()) sum += model_.positions[static_cast<std::size_t>(node)];
    return sum / 4;
  }

  // Returns the free element beside a patch with fewest free neighbours, else any free element, else -1.
  int next_seed(std::size_t& next) {
    while (!front_.empty()) {
      const auto [free, e] = front_.top();
      front_.pop();
      if (is_free(e) && free_neighbours_[e] == free) return e;
    }
    while (next < elements_.size() && !is_free(elements_[next])) ++next;
    return next < elements_.size() ? elements_[next] : -1;
  }

  // Grows a patch by the neighbour with the fewest new nodes, at a tie the neighbour nearest to its centre.
  void grow_from(int seed) {
    const auto number = static_cast<int>(patches_.size());
    std::vector<int> patch;
    std::vector<int> nodes;
    std::vector<int> candidates = {seed};
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    while (patch.size() < target_size_ && !candidates.empty()) {
      const Eigen::Vector3d middle =
          patch.empty() ? centre(seed) : Eigen::Vector3d(sum / static_cast<double>(patch.size()));
      const auto rank = [&](int e) {
        const auto is_new = [&](int node) { return std::ranges::find(nodes, node) == nodes.end(); };
        return std::tuple(std::ranges::count_if(element(e).corners(), is_new),
                          (centre(e) - middle).squaredNorm(), e);
      };
      const int chosen = std::ranges::min(candidates, {}, rank);
      std::erase(candidates, chosen);
      patch.push_back(chosen);
      patch_of_[chosen] = number;
      sum += centre(chosen);
      for (const int node : element(chosen).corners()) {
        if (std::ranges::find(nodes, node) == nodes.end()) nodes.push_back(node);
      }
      for (const int other : neighbours_.of(chosen)) {
        if (is_free(other) && std::ranges::find(candidates, other) == candidates.end())
          candidates.push_back(other);
      }
    }
    for (const int e : patch) {
      for (const int other : neighbours_.of(e)) {
        const int free = --free_neighbours_[other];
        if (is_free(other)) front_.emplace(free, other);
      }
    }
    patches_.push_back(std::move(patch));
  }

  // Joins a small patch to its smallest neighbour; a shared face counts as minus half an element.
  void join_small_patches() {
    std::vector<std::size_t> order(patches_.size());
    for (std::size_t p = 0; p < order.size(); ++p) order[p] = p;
    std::ranges::stable_sort(order, {}, [&](std::size_t p) { return patches_[p].size(); });
    for (const std::size_t p : order) {
      if (2 * patches_[p].size() > target_size_) continue;
      std::map<int, int> faces;  // number of shared faces, by neighbour
      for (const int e : patches_[p]) {
        for (const int other : neighbours_.of(e)) {
          const int neighbour = patch_of_[other];
          const std::size_t together =
              patches_[p].size() + patches_[static_cast<std::size_t>(neighbour)].size();
          if (neighbour != static_cast<int>(p) && together < 3 * target_size_) ++faces[neighbour];
        }
      }
      if (faces.empty()) continue;
      const auto rank = [&](const auto& other) {
        const auto size = static_cast<int>(patches_[static_cast<std::size_t>(other.first)].size());
        return std::pair(2 * size - other.second, other.first);
      };
      const int into = std::ranges::min_element(faces, {}, rank)->first;
      std::vector<int>& larger = patches_[static_cast<std::size_t>(into)];
      for (const int e : patches_[p]) {
        patch_of_[e] = into;
        larger.push_back(e);
      }
      patches_[p].clear();
    }
  }

  Model& model_;
  std::size_t target_size_;
  Neighbours neighbours_;
  std::vector<int> elements_;
  std::map<int, int> patch_of_;
  std::map<int, int> free_neighbours_;
  // Free elements beside a patch, fewest free neighbours first; may hold outdated entries.
  std::priority_queue<std::pair<int, int>, std::vector<std::pair<int, int>>, std::greater<>> front_;
  std::vector<std::vector<int>> patches_;
};

}  // namespace

void form_volume_patches(Model& model, const std::vector<int>& group_of_element, int elements_per_patch) {
  int number = 0;
  for (std::size_t e = 0; e < model.elements.size(); ++e) {
    Tetrahedron& element = model.elements[e];
    element.volume_patch = element.num_nodes == 10 && group_of_element[e] >= 0 ? number++ : -1;
  }
  for (const std::vector<int>& patch : PatchGrower(model, group_of_element, elements_per_patch).grow()) {
    for (const int e : patch) model.elements[static_cast<std::size_t>(e)].volume_patch = number;
    ++number;
  }
}

VolumePatchCount count_volume_patches(const Model& model) {
  std::map<int, int> elements;
  for (const Tetrahedron& element : model.elements) {
    if (element.volume_patch >= 0) ++elements[element.volume_patch];
  }
  VolumePatchCount count;
  if (elements.empty()) return count;
  const auto [fewest, most] =
      std::ranges::minmax_element(elements, {}, [](const auto& patch) { return patch.second; });
  count = {static_cast<int>(elements.size()), fewest->second, most->second};
  return count;
}

bool shares_linear_volumes(const Model& model) {
  return std::ranges::any_of(model.elements, [&](const Tetrahedron& element) {
    return element.volume_patch >= 0 && std::holds_alternative<LinearElastic>(
                                            model.materials[static_cast<std::size_t>(element.material)].law);
  });
}

}  // namespace palpate
