// Formats the messages for the faults that find_unjoined() found.
#include <fmt/format.h>

#include <cmath>

#include "offline/mesh/geometry_check.hpp"
#include "offline/mesh/rigid_motion.hpp"

namespace palpate {
namespace {

// Returns the advice to merge, with the key of a scene for builds.
std::string merge_remedy(const UnjoinedGeometry& found) {
  const std::string length = fmt::format("1e{:.0f}", std::log10(found.merge_length));
  return fmt::format("--merge {} (in a scene: merge = {})", length, length);
}

class Words {
 public:
  explicit Words(const Model& model) : model_(model) {}

  int node(int index) const { return model_.labels[static_cast<std::size_t>(index)]; }
  int element(int index) const { return model_.elements[static_cast<std::size_t>(index)].label; }
  // Abaqus counts faces from 1.
  std::string face(const FaceId& face) const {
    return fmt::format("face S{} of element {}", face.face + 1, element(face.element));
  }
  int first_element(int node) const {
    for (const Tetrahedron& element : model_.elements) {
      for (const int one : element.nodes()) {
        if (one == node) return element.label;
      }
    }
    return 0;
  }

 private:
  const Model& model_;
};

std::string faces_message(const Words& words, const UnjoinedGeometry& found) {
  std::size_t coincident = 0;
  for (const FaceOnFace& face : found.faces) coincident += face.coincident ? 1 : 0;
  constexpr const char* kRemesh = "mesh both sides again with the same nodes there";
  std::string remedy = kRemesh;
  if (coincident == found.faces.size()) {
    remedy = "join them with " + merge_remedy(found);
  } else if (coincident > 0) {
    remedy = fmt::format("{} of them have nodes at the same places, join these with {}; for the others {}",
                         coincident, merge_remedy(found), kRemesh);
  }
  return fmt::format(
      "{} on outer faces of other elements and {} joined: the first is {}, on {}; {}",
      found.faces.size() == 1 ? "1 outer face lies" : fmt::format("{} outer faces lie", found.faces.size()),
      found.faces.size() == 1 ? "is not" : "are not", words.face(found.faces.front().face),
      words.face(found.faces.front().other), remedy);
}

}  // namespace

std::vector<std::string> unjoined_messages(const Model& model, const UnjoinedGeometry& found) {
  const Words words(model);
  std::vector<std::string> messages;
  const auto say = [&](const std::string& message) { messages.push_back(model.file + ": " + message); };
  if (!found.nodes.empty()) {
    const auto [node, other] = found.nodes.front();
    say(
        fmt::format("{} at the place of another node that no element joins to it: the first is node {} of "
                    "element {}, at node {} of element {}; join them with {}",
                    found.nodes.size() == 1 ? "1 node lies" : fmt::format("{} nodes lie", found.nodes.size()),
                    words.node(node), words.first_element(node), words.node(other),
                    words.first_element(other), merge_remedy(found)));
  }
  if (!found.faces.empty()) say(faces_message(words, found));
  if (!found.hanging.empty()) {
    say(fmt::format(
        "{} on an edge or a face of an element without being its node: the first is node {} of "
        "element {}, on {}; mesh that place again, so that neighbours have all nodes in common",
        found.hanging.size() == 1 ? "1 node hangs" : fmt::format("{} nodes hang", found.hanging.size()),
        words.node(found.hanging.front().node), words.first_element(found.hanging.front().node),
        words.face(found.hanging.front().face)));
  }
  if (!found.overlaps.empty()) {
    say(fmt::format(
        "{} volume with elements that are not joined to it: the first are elements {} and {}; cut "
        "the one body out of the other, or mesh both together and give the inner one a set",
        found.overlaps.size() == 1 ? "1 element shares"
                                   : fmt::format("{} elements share", found.overlaps.size()),
        words.element(found.overlaps.front().element), words.element(found.overlaps.front().other)));
  }
  if (!found.is_complete) {
    say("so many elements lie at one place that the search for unjoined geometry stopped early; look at the "
        "mesh there");
  }
  return messages;
}

std::string unjoined_counts(const UnjoinedGeometry& found) {
  std::string counts;
  const auto add = [&](std::size_t number, const char* what) {
    if (number > 0) counts += fmt::format("{}{} {}", counts.empty() ? "" : ", ", number, what);
  };
  add(found.nodes.size(), "nodes at the place of others");
  add(found.faces.size(), "faces on faces");
  add(found.hanging.size(), "hanging nodes");
  add(found.overlaps.size(), "elements in others");
  return counts;
}

std::string part_contact(const Model& model, const UnjoinedGeometry& found, int node) {
  const Words words(model);
  const std::vector<int> parts = connected_parts(model);
  const int part = parts[static_cast<std::size_t>(node)];
  const auto part_of = [&](int one) { return parts[static_cast<std::size_t>(one)]; };
  const auto part_of_element = [&](int element) {
    return part_of(model.elements[static_cast<std::size_t>(element)].nodes()[0]);
  };
  constexpr std::size_t kShown = 3;
  std::size_t num_met = 0;
  std::string here;
  std::string there;
  for (const CoincidentNode& pair : found.nodes) {
    const auto [one, other] =
        part_of(pair.node) == part ? std::pair(pair.node, pair.other) : std::pair(pair.other, pair.node);
    if (part_of(one) != part || part_of(other) == part || ++num_met > kShown) continue;
    here += fmt::format("{}{}", num_met > 1 ? ", " : "", words.node(one));
    there += fmt::format("{}{}", num_met > 1 ? ", " : "", words.node(other));
  }
  if (num_met > 0) {
    const char* more = num_met > kShown ? ", ..." : "";
    return fmt::format(
        "its node{0} {1}{2} {3} where node{0} {4}{2} {5}; the parts are probably meant to be "
        "joined: {6}",
        num_met > 1 ? "s" : "", here, more, num_met > 1 ? "lie" : "lies", there, num_met > 1 ? "are" : "is",
        merge_remedy(found));
  }
  const auto meets = [&](int element, int other) {
    return (part_of_element(element) == part) != (part_of_element(other) == part);
  };
  constexpr const char* kRemedy = "the parts are probably meant to be joined: mesh them with common nodes";
  for (const OverlappingElement& pair : found.overlaps) {
    if (meets(pair.element, pair.other))
      return fmt::format("elements {} and {} of it and of another part share volume; {}",
                         words.element(pair.element), words.element(pair.other), kRemedy);
  }
  for (const FaceOnFace& pair : found.faces) {
    if (meets(pair.face.element, pair.other.element))
      return fmt::format("{} lies on {} of another part; {}", words.face(pair.face), words.face(pair.other),
                         kRemedy);
  }
  for (const HangingNode& hanging : found.hanging) {
    if ((part_of(hanging.node) == part) != (part_of_element(hanging.face.element) == part))
      return fmt::format("node {} lies on {} of another part; {}", words.node(hanging.node),
                         words.face(hanging.face), kRemedy);
  }
  return {};
}

}  // namespace palpate
