#include "offline/io/node_selection.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <stdexcept>

#include "offline/mesh/nearest_name.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

[[noreturn]] void refuse(const std::string& option, const std::string& expression, const std::string& why) {
  throw std::runtime_error(option + " '" + printable(expression) + "': " + why);
}

// Returns the `count` numbers of a list such as "1,2,3".
std::vector<double> numbers_of(std::string_view text, size_t count, const std::string& option,
                               const std::string& expression) {
  std::vector<double> numbers;
  while (!text.empty()) {
    const size_t comma = std::min(text.find(','), text.size());
    const std::optional<double> number = parse_number(trimmed(text.substr(0, comma)));
    if (!number)
      refuse(option, expression, "'" + printable(text.substr(0, comma)) + "' is no number; correct it");
    numbers.push_back(*number);
    text.remove_prefix(std::min(comma + 1, text.size()));
  }
  if (numbers.size() != count)
    refuse(option, expression,
           "has " + std::to_string(numbers.size()) + " numbers; give " + std::to_string(count));
  return numbers;
}

template <typename Condition>
std::vector<int> nodes_where(const Model& model, const Condition& holds) {
  std::vector<int> nodes;
  for (int node = 0; node < model.num_nodes(); ++node) {
    if (holds(model.positions[static_cast<size_t>(node)])) nodes.push_back(node);
  }
  return nodes;
}

// "z<10%", "x>3.5". The part of 100 % is that of the organ's extent along the axis.
std::vector<int> beside_plane(const Model& model, std::string_view text, const std::string& option,
                              const std::string& expression) {
  const Eigen::Index axis = text[0] - 'x';
  const size_t sign = text.find_first_of("<>");
  const bool is_below = text[sign] == '<';
  std::string_view limit = trimmed(text.substr(sign + 1));
  const bool is_part = limit.ends_with('%');
  if (is_part) limit.remove_suffix(1);
  double place = numbers_of(limit, 1, option, expression)[0];
  if (is_part) {
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& position : model.positions) box.extend(position);
    place = box.min()[axis] + 0.01 * place * box.sizes()[axis];
  }
  return nodes_where(model, [&](const Eigen::Vector3d& position) {
    return is_below ? position[axis] <= place : position[axis] >= place;
  });
}

// Whether a text begins as "z<10%" does, with blanks where people write them.
bool is_plane(std::string_view text) {
  const size_t sign = text.find_first_of("<>");
  return sign != text.npos && trimmed(text.substr(0, sign)).size() == 1 && text[0] >= 'x' && text[0] <= 'z';
}

// The nodes within r of a point, and the node nearest to the point.
std::vector<int> about_point(const Model& model, const std::vector<double>& numbers) {
  const Eigen::Vector3d point(numbers[0], numbers[1], numbers[2]);
  double square = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& position : model.positions)
    square = std::min(square, (position - point).squaredNorm());
  square = std::max(square, numbers[3] * numbers[3]);
  return nodes_where(
      model, [&](const Eigen::Vector3d& position) { return (position - point).squaredNorm() <= square; });
}

std::vector<int> of_set(const Model& model, const std::string& option, const std::string& expression) {
  const auto set = model.node_sets.find(normalised_name(expression));
  if (set != model.node_sets.end()) return set->second;
  std::vector<std::string> names;
  for (const auto& [name, nodes] : model.node_sets) names.push_back(name);
  refuse(option, expression,
         "is no node set of the mesh" +
             did_you_mean(normalised_name(expression), names,
                          "; give a set, \"z<10%\", \"box x,y,z,x,y,z\" or \"nearest x,y,z,r\""));
}

}  // namespace

std::vector<int> select_nodes(const Model& model, const std::string& expression, const std::string& option) {
  const std::string small = lower_case(expression);
  const std::string_view text = trimmed(small);
  const auto behind = [&](std::string_view word) { return text.substr(word.size()); };
  std::vector<int> nodes;
  if (is_plane(text)) {
    nodes = beside_plane(model, text, option, expression);
  } else if (text.starts_with("box ")) {
    const std::vector<double> corners = numbers_of(behind("box "), 6, option, expression);
    Eigen::AlignedBox3d box;
    box.extend(Eigen::Vector3d(corners[0], corners[1], corners[2]));
    box.extend(Eigen::Vector3d(corners[3], corners[4], corners[5]));
    nodes = nodes_where(model, [&](const Eigen::Vector3d& position) { return box.contains(position); });
  } else if (text.starts_with("nearest ")) {
    const std::vector<double> numbers = numbers_of(behind("nearest "), 4, option, expression);
    if (numbers[3] < 0) refuse(option, expression, "has a radius below 0; give 0 for the nearest node alone");
    nodes = about_point(model, numbers);
  } else {
    nodes = of_set(model, option, expression);
  }
  if (nodes.empty()) refuse(option, expression, "holds no node; choose a larger place");
  return nodes;
}

}  // namespace palpate
