#include "offline/mesh/inp_ties.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numeric>

#include "offline/mesh/element_faces.hpp"
#include "offline/mesh/inp_fields.hpp"
#include "offline/mesh/input_error.hpp"
#include "offline/mesh/merge_nodes.hpp"
#include "offline/mesh/nearest_name.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

// Nodes count as coincident within this part of the largest coordinate: programs write seven digits.
constexpr double kSamePlace = 2e-6;

int known_surface(const InpLexer& lexer, const DataLine& line, std::string_view field, const Draft& draft) {
  const std::string name = normalised_name(field);
  std::vector<std::string> names;
  for (const DraftSurface& surface : draft.surfaces) {
    if (surface.name == name) return static_cast<int>(names.size());
    names.push_back(surface.name);
  }
  lexer.fail_unknown(line.place, name,
                     "surface " + printable(name) + " is not defined above this line" +
                         did_you_mean(name, names, "; define it with *SURFACE"));
}

class TieResolver {
 public:
  TieResolver(const Draft& draft, const SourceFiles& files,
              const std::vector<std::pair<int, int>>& element_index, Model& model)
      : draft_(draft), files_(files), element_index_(element_index), model_(model) {
    joined_.resize(model.positions.size());
    std::iota(joined_.begin(), joined_.end(), 0);
    is_outer_.assign(4 * model.elements.size(), 1);
    const std::vector<ElementFace> sorted = sorted_faces(model);
    for (std::size_t i = 1; i < sorted.size(); ++i) {
      if (sorted[i].sorted != sorted[i - 1].sorted) continue;
      for (const ElementFace& face : {sorted[i - 1], sorted[i]})
        is_outer_[static_cast<std::size_t>(4 * face.element + face.face)] = 0;
    }
  }

  void run() {
    for (const DraftTie& tie : draft_.ties) join(tie);
    for (int node = 0; node < model_.num_nodes(); ++node)
      joined_[static_cast<std::size_t>(node)] = representative(node);
    replace_nodes(model_, joined_);
  }

 private:
  [[noreturn]] void fail(Place place, const std::string& message) const {
    throw InputError(files_.at(place), message);
  }
  const Eigen::Vector3d& position(int node) const { return model_.positions[static_cast<std::size_t>(node)]; }

  // Returns the node that stands for `node`, and shortens the way to it.
  int representative(int node) {
    while (joined_[static_cast<std::size_t>(node)] != node) {
      int& next = joined_[static_cast<std::size_t>(node)];
      next = joined_[static_cast<std::size_t>(next)];
      node = next;
    }
    return node;
  }

  std::vector<int> elements(const DraftFaces& faces) const {
    const DraftTarget& target = faces.elements;
    if (target.set >= 0)
      return model_.element_sets.at(draft_.element_sets.all()[static_cast<std::size_t>(target.set)].name);
    const auto found =
        std::lower_bound(element_index_.begin(), element_index_.end(), std::pair(target.label, 0));
    if (found == element_index_.end() || found->first != target.label)
      fail(faces.place,
           fmt::format("*SURFACE names element {}, which is not defined; define it with *ELEMENT",
                       target.label));
    return {found->second};
  }

  std::vector<int> surface_nodes(int number) const {
    const DraftSurface& surface = draft_.surfaces[static_cast<std::size_t>(number)];
    std::vector<int> nodes;
    for (const DraftSurfaceNodes& named : surface.nodes) {
      if (named.nodes.set >= 0) {
        const auto set = static_cast<std::size_t>(named.nodes.set);
        const std::vector<int>& members = model_.node_sets.at(draft_.node_sets.all()[set].name);
        nodes.insert(nodes.end(), members.begin(), members.end());
        continue;
      }
      nodes.push_back(model_.find_node(named.nodes.label));
      if (nodes.back() < 0)
        fail(named.place, fmt::format("*SURFACE names node {}, which is not defined; define it with *NODE",
                                      named.nodes.label));
    }
    for (const DraftFaces& faces : surface.faces) {
      for (const int element : elements(faces)) {
        for (int face = 0; face < 4; ++face) {
          const bool outer = is_outer_[static_cast<std::size_t>(4 * element + face)] != 0;
          if (faces.face == kOuterFaces ? !outer : faces.face != face) continue;
          for (const int node : outward_face(model_.elements[static_cast<std::size_t>(element)], face)) {
            if (node >= 0) nodes.push_back(node);
          }
        }
      }
    }
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    return nodes;
  }

  void join(const DraftTie& tie) {
    const std::string& slave_name = draft_.surfaces[static_cast<std::size_t>(tie.slave)].name;
    const std::string& master_name = draft_.surfaces[static_cast<std::size_t>(tie.master)].name;
    // Along a line in general direction, nodes of a grid have different places.
    const Eigen::Vector3d direction = Eigen::Vector3d(0.5377, 0.7309, 0.4201).normalized();
    std::vector<std::pair<double, int>> masters;
    double scale = 0;
    for (const int node : surface_nodes(tie.master)) {
      masters.emplace_back(direction.dot(position(node)), node);
      scale = std::max(scale, position(node).lpNorm<Eigen::Infinity>());
    }
    std::sort(masters.begin(), masters.end());
    const double tolerance = kSamePlace * scale;
    int num_joined = 0;
    for (const int slave : surface_nodes(tie.slave)) {
      const double along = direction.dot(position(slave));
      int partner = -1;
      for (auto near = std::lower_bound(masters.begin(), masters.end(), std::pair(along - tolerance, 0));
           near != masters.end() && near->first <= along + tolerance; ++near) {
        if ((position(near->second) - position(slave)).norm() > tolerance) continue;
        if (partner >= 0) refuse(tie, slave, "several nodes", slave_name, master_name);
        partner = near->second;
      }
      if (partner < 0) refuse(tie, slave, "no node", slave_name, master_name);
      const int from = representative(slave);
      const int to = representative(partner);
      if (from != to) ++num_joined;
      joined_[static_cast<std::size_t>(from)] = to;
    }
    model_.warnings.emplace_back(
        InputError(files_.at(tie.place),
                   fmt::format("*TIE: {} nodes of surface {} become the nodes of {} at their places",
                               num_joined, printable(slave_name), printable(master_name)))
            .what());
  }

  [[noreturn]] void refuse(const DraftTie& tie, int slave, const char* partners,
                           const std::string& slave_name, const std::string& master_name) const {
    fail(tie.place,
         fmt::format("*TIE: surface {} has {} at the place of node {} of surface {}; only surfaces with "
                     "nodes at the same places, one to one, are joined: mesh both bodies together",
                     printable(master_name), partners, model_.labels[static_cast<std::size_t>(slave)],
                     printable(slave_name)));
  }

  const Draft& draft_;
  const SourceFiles& files_;
  const std::vector<std::pair<int, int>>& element_index_;
  Model& model_;
  std::vector<int> joined_;     // for each node: a node that stands for it, or itself
  std::vector<char> is_outer_;  // for each face of each element
};

}  // namespace

void read_tie(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  lexer.allow_parameters(keyword, {"NAME", "POSITIONTOLERANCE", "ADJUST", "TYPE", "NOROTATION"});
  bool empty = true;
  while (const DataLine* line = lexer.next_data()) {
    empty = false;
    const FieldReader fields(lexer, *line, 2, 2, "slave surface, master surface");
    DraftTie tie;
    tie.slave = known_surface(lexer, *line, fields.text(0), draft);
    tie.master = known_surface(lexer, *line, fields.text(1), draft);
    tie.place = line->place;
    if (tie.slave == tie.master)
      lexer.fail(line->place, "*TIE joins a surface to itself; name the surfaces of the two bodies");
    draft.ties.push_back(tie);
  }
  if (empty) lexer.fail(keyword.place, "*TIE names no surfaces; add a line with the slave and the master");
}

void join_ties(const Draft& draft, const SourceFiles& files,
               const std::vector<std::pair<int, int>>& element_index, Model& model) {
  if (!draft.ties.empty()) TieResolver(draft, files, element_index, model).run();
}

}  // namespace palpate
