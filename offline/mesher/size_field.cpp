#include "offline/mesher/size_field.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string_view>

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

// Adds points of a triangle, not further apart than `spacing`.
void add_triangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                  double spacing, std::vector<Eigen::Vector3d>& points) {
  constexpr double kMostParts = 1000;
  const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
  const int parts = static_cast<int>(std::clamp(std::ceil(longest / spacing), 1.0, kMostParts));
  for (int i = 0; i <= parts; ++i) {
    for (int j = 0; j <= parts - i; ++j)
      points.emplace_back(a + (b - a) * (double(i) / parts) + (c - a) * (double(j) / parts));
  }
}

// Keeps a point in each cell of a grid, so that a set costs as many points as it needs.
std::vector<Eigen::Vector3d> thinned(const std::vector<Eigen::Vector3d>& points, double spacing) {
  std::map<std::array<double, 3>, Eigen::Vector3d> cells;
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3d cell = (point / spacing).array().floor();
    cells.try_emplace({cell[0], cell[1], cell[2]}, point);
  }
  std::vector<Eigen::Vector3d> kept;
  kept.reserve(cells.size());
  for (const auto& [cell, point] : cells) kept.push_back(point);
  return kept;
}

RefinedPlace place_of_set(const MeshData& mesh, const std::string& name, double size,
                          const std::string& text) {
  const auto position = [&](int node) { return mesh.positions[static_cast<std::size_t>(node)]; };
  std::vector<Eigen::Vector3d> points;
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
    for (const int node : *nodes) points.push_back(position(node));
  }
  if (cells != nullptr) {
    for (const int index : *cells) {
      const MeshCell& cell = mesh.cells[static_cast<std::size_t>(index)];
      for (int i = 0; i < cell.num_nodes; ++i)
        points.push_back(position(cell.nodes[static_cast<std::size_t>(i)]));
      if (cell.kind == CellKind::triangle)
        add_triangle(position(cell.nodes[0]), position(cell.nodes[1]), position(cell.nodes[2]), size, points);
    }
  }
  if (points.empty()) refuse(text, "the set is empty; name another");
  return {thinned(points, size), size, size};
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
  return {{Eigen::Vector3d((*numbers)[0], (*numbers)[1], (*numbers)[2])}, (*numbers)[3], *size};
}

}  // namespace

SizeField::SizeField(double size, const std::vector<std::string>& refinements, const MeshData& mesh)
    : size_(size) {
  for (const std::string& text : refinements) places_.push_back(parse_place(text, size, mesh));
}

double SizeField::at_surface(const Eigen::Vector3d& point) const {
  double edge = size_;
  for (const RefinedPlace& place : places_) {
    double square = INFINITY;
    for (const Eigen::Vector3d& other : place.points)
      square = std::min(square, (point - other).squaredNorm());
    edge = std::min(edge, place.size + kGrowth * std::max(0.0, std::sqrt(square) - place.radius));
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
  // A ball is half below the surface; a point of a set stands for a column of some elements.
  constexpr double kColumn = 3;
  for (const RefinedPlace& place : places_) {
    const double part = place.points.size() == 1
                            ? 2 * std::numbers::pi / 3 * std::pow(place.radius + place.size, 3)
                            : kColumn * std::pow(place.size, 3) * static_cast<double>(place.points.size());
    num += count(std::min(volume, part), place.size);
  }
  return num;
}

}  // namespace palpate
