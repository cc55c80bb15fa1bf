#include "offline/mesher/size_field.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "offline/mesh/nearest_name.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

// Volume of a mean tetrahedron of the mesher, in cubes of the wanted edge length. A regular one has 0.118.
constexpr double kElementVolume = 0.13;

[[noreturn]] void refuse(const std::string& text, const std::string& why) {
  throw std::runtime_error("--refine '" + printable(text) + "': " + why);
}

// The four numbers "x,y,z,r", or nothing where the words are no list of numbers.
std::optional<std::vector<double>> numbers_of(std::string_view list) {
  std::vector<double> numbers;
  while (!list.empty()) {
    const std::size_t comma = std::min(list.find(','), list.size());
    const std::optional<double> number = parse_number(trimmed(list.substr(0, comma)));
    if (!number) return std::nullopt;
    numbers.push_back(*number);
    list.remove_prefix(std::min(comma + 1, list.size()));
  }
  return numbers;
}

using Sets = std::map<std::string, std::vector<int>>;

// The set with this name; letters may be small where the set's are capital.
const std::vector<int>* find_set(const Sets& sets, const std::string& name) {
  for (const auto& [known, members] : sets) {
    if (known == name || normalised_name(known) == normalised_name(name)) return &members;
  }
  return nullptr;
}

// Keeps a point in each cell of a grid, so that a set costs as many points as it needs.
class PointGrid {
 public:
  // `text`: of --refine, for the message where the set takes too many points.
  PointGrid(double spacing, const std::string& text) : spacing_(spacing), text_(text) {}

  void add(const Eigen::Vector3d& point) {
    const Eigen::Vector3d cell = (point / spacing_).array().floor();
    cells_.try_emplace({cell[0], cell[1], cell[2]}, point);
    if (cells_.size() > kMostPoints) refuse_points();
  }

  // Adds points of a triangle, not further apart than the spacing.
  void add_triangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
    const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
    if (longest > kMostParts * spacing_) refuse_points();
    const int parts = static_cast<int>(std::max(std::ceil(longest / spacing_), 1.0));
    for (int i = 0; i <= parts; ++i) {
      for (int j = 0; j <= parts - i; ++j)
        add(a + (b - a) * (double(i) / parts) + (c - a) * (double(j) / parts));
    }
  }

  std::vector<Eigen::Vector3d> points() const {
    std::vector<Eigen::Vector3d> kept;
    kept.reserve(cells_.size());
    for (const auto& [cell, point] : cells_) kept.push_back(point);
    return kept;
  }

 private:
  static constexpr std::size_t kMostPoints = 500'000;  // some millions of elements
  static constexpr double kMostParts = 2000;           // of a triangle's longest edge

  [[noreturn]] void refuse_points() const {
    refuse(text_, "takes more elements than the mesher makes; give the set a larger size");
  }

  double spacing_;
  std::string text_;
  std::map<std::array<double, 3>, Eigen::Vector3d> cells_;
};

// The square of the distance from `point` to the nearest of a place's points, or `limit` where none is nearer.
double nearest_square(const RefinedPlace& place, const Eigen::Vector3d& point, double limit) {
  const auto at = [](const auto& list, int index) { return list[static_cast<std::size_t>(index)]; };
  const auto& branches = place.tree.branches();
  std::array<int, 64> open{};  // halving keeps the depth below 32
  std::size_t num_open = 1;
  while (num_open > 0) {
    const BoxTree::Branch& branch = branches[static_cast<std::size_t>(open[--num_open])];
    if (branch.box.squaredExteriorDistance(point) >= limit) continue;
    if (branch.left < 0) {
      for (int i = branch.begin; i < branch.end; ++i)
        limit = std::min(limit, (point - at(place.points, at(place.tree.items(), i))).squaredNorm());
      continue;
    }
    int nearer = branch.left, other = branch.right;
    const auto distance = [&](int child) {
      return branches[static_cast<std::size_t>(child)].box.squaredExteriorDistance(point);
    };
    if (distance(other) < distance(nearer)) std::swap(nearer, other);
    open[num_open++] = other;
    open[num_open++] = nearer;
  }
  return limit;
}

RefinedPlace place_about(std::vector<Eigen::Vector3d> points, double radius, double size) {
  std::vector<Box> boxes;
  boxes.reserve(points.size());
  for (const Eigen::Vector3d& point : points) boxes.emplace_back(point);
  return {std::move(points), radius, size, BoxTree(boxes)};
}

RefinedPlace place_of_set(const MeshData& mesh, const std::string& name, double size,
                          const std::string& text) {
  const auto position = [&](int node) { return mesh.positions[static_cast<std::size_t>(node)]; };
  PointGrid grid(size, text);
  const std::vector<int>* nodes = find_set(mesh.node_sets, name);
  const std::vector<int>* cells = find_set(mesh.element_sets, name);
  if (nodes == nullptr && cells == nullptr) {
    std::vector<std::string> names;
    for (const auto& [known, members] : mesh.node_sets) names.push_back(known);
    for (const auto& [known, members] : mesh.element_sets) names.push_back(known);
    refuse(text,
           "is no set of the mesh" +
               did_you_mean(name, names, "; give \"x,y,z,r: size\", or \"SET: size\" with one of its sets"));
  }
  if (nodes != nullptr) {
    for (const int node : *nodes) grid.add(position(node));
  }
  if (cells != nullptr) {
    for (const int index : *cells) {
      const MeshCell& cell = mesh.cells[static_cast<std::size_t>(index)];
      for (int i = 0; i < cell.num_nodes; ++i) grid.add(position(cell.nodes[static_cast<std::size_t>(i)]));
      if (cell.kind == CellKind::triangle)
        grid.add_triangle(position(cell.nodes[0]), position(cell.nodes[1]), position(cell.nodes[2]));
    }
  }
  std::vector<Eigen::Vector3d> points = grid.points();
  if (points.empty()) refuse(text, "the set is empty; name another");
  return place_about(std::move(points), size, size);
}

RefinedPlace parse_place(const std::string& text, double largest, const MeshData& mesh) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos) refuse(text, "has no ':'; give \"x,y,z,r: size\" or \"SET: size\"");
  const std::optional<double> size = parse_number(trimmed(std::string_view(text).substr(colon + 1)));
  if (!size || *size <= 0) refuse(text, "gives no size above 0 behind the ':'; correct it");
  if (*size > largest)
    refuse(text, fmt::format("is coarser than --size {:g}; places can only be finer", largest));
  const std::string name(trimmed(std::string_view(text).substr(0, colon)));
  const std::optional<std::vector<double>> numbers = numbers_of(name);
  if (!numbers || name.empty()) return place_of_set(mesh, name, *size, text);
  if (numbers->size() != 4 || (*numbers)[3] < 0)
    refuse(text, "takes four numbers before the ':', x,y,z and a radius; correct it");
  return place_about({Eigen::Vector3d((*numbers)[0], (*numbers)[1], (*numbers)[2])}, (*numbers)[3], *size);
}

}  // namespace

SizeField::SizeField(double size, const std::vector<std::string>& refinements, const MeshData& mesh)
    : size_(size) {
  for (const std::string& text : refinements) places_.push_back(parse_place(text, size, mesh));
}

double SizeField::at_surface(const Eigen::Vector3d& point) const {
  double edge = size_;
  for (const RefinedPlace& place : places_) {
    if (place.size >= edge) continue;
    const double reach =
        place.radius + (edge - place.size) / kGrowth;  // a place further away changes nothing
    const double distance = std::sqrt(nearest_square(place, point, reach * reach));
    edge = std::min(edge, place.size + kGrowth * std::max(0.0, distance - place.radius));
  }
  return edge;
}

double SizeField::inside(const Eigen::Vector3d& point, double depth) const {
  return std::min(kCoreFactor * size_, at_surface(point) + kGrowth * depth);
}

double SizeField::num_elements(double area, double volume) const {
  const auto count = [](double part, double edge) { return part / (kElementVolume * std::pow(edge, 3)); };
  constexpr int kLayers = 50;
  const double thickness = (kCoreFactor - 1) * size_ / kGrowth / kLayers;
  double num = 0, left = volume;
  for (int layer = 0; layer < kLayers && left > 0; ++layer) {
    const double part = std::min(left, area * thickness);
    num += count(part, size_ + kGrowth * (layer + 0.5) * thickness);
    left -= part;
  }
  num += count(left, kCoreFactor * size_);
  // A ball is half below the surface. A point of a set stands for a column of elements, in cubes of the size;
  // measured on caps of a sphere. Points far apart have more each.
  constexpr double kColumn = 0.85;
  for (const RefinedPlace& place : places_) {
    const double part = place.points.size() == 1
                            ? 2 * std::numbers::pi / 3 * std::pow(place.radius + place.size, 3)
                            : kColumn * std::pow(place.size, 3) * static_cast<double>(place.points.size());
    num += count(std::min(volume, part), place.size);
  }
  return num;
}

}  // namespace palpate
