// Which sets each point or cell is in, as one number. Formats that give an item one number express sets by
// it.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace palpate {

struct SetCombinations {
  std::vector<int> of_item;                     // index in `names` for each point or cell
  std::vector<std::vector<std::string>> names;  // of the sets of a combination, sorted; the first has no sets
};

// `sets`: as in MeshData, with indices below `num_items`.
SetCombinations combine_sets(const std::map<std::string, std::vector<int>>& sets, std::size_t num_items);

}  // namespace palpate
