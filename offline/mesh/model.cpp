#include "offline/mesh/model.hpp"

#include <algorithm>

namespace palpate {

int Model::find_node(int label) const {
  const auto found = std::lower_bound(label_index.begin(), label_index.end(), std::pair(label, 0));
  return found != label_index.end() && found->first == label ? found->second : -1;
}

}  // namespace palpate
