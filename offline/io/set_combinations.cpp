#include "offline/io/set_combinations.hpp"

namespace palpate {

SetCombinations combine_sets(const std::map<std::string, std::vector<int>>& sets, std::size_t num_items) {
  SetCombinations found;
  found.of_item.assign(num_items, 0);
  found.names.emplace_back();
  for (const auto& [name, items] : sets) {
    std::map<int, int> with_name;  // combination before this set -> combination with it
    for (const int item : items) {
      int& combination = found.of_item[static_cast<std::size_t>(item)];
      const auto [at, is_new] = with_name.try_emplace(combination, static_cast<int>(found.names.size()));
      if (is_new) {
        std::vector<std::string> names = found.names[static_cast<std::size_t>(combination)];
        names.push_back(name);
        found.names.push_back(std::move(names));
      }
      combination = at->second;
    }
  }
  return found;
}

}  // namespace palpate
