// Finds meshes that look like one body but are not, by place and not by label.
//
// Only common nodes join elements. A mesh whose parts have their own nodes at a common place is solved as
// parts that pass through each other. The search works on any mesh that check_model() accepts.
#pragma once

#include <string>
#include <vector>

#include "offline/mesh/model.hpp"

namespace palpate {

// A node that lies where a node with a lower index is. No element has both.
struct CoincidentNode {
  int node = 0;
  int other = 0;
};

// An outer face that covers at least a part of an outer face of another element.
struct FaceOnFace {
  FaceId face;
  FaceId other;
  bool coincident = false;  // the nodes of both coincide too, so that merging joins the faces
};

// A node on an edge or inside an outer face of an element that does not have the node.
struct HangingNode {
  int node = 0;
  FaceId face;
};

// Elements that share volume.
struct OverlappingElement {
  int element = 0;
  int other = 0;
};

struct UnjoinedGeometry {
  std::vector<CoincidentNode> nodes;  // each node, face, or element once, ascending
  std::vector<FaceOnFace> faces;
  std::vector<HangingNode> hanging;
  std::vector<OverlappingElement> overlaps;
  double merge_length = 0;  // a power of ten, length unit; it joins the coincident nodes
  // False where so many elements lie at one place that the search stopped early.
  bool is_complete = true;

  bool empty() const {
    return nodes.empty() && faces.empty() && hanging.empty() && overlaps.empty() && is_complete;
  }
};

// Places count as equal up to a millionth of the edges there, or up to the digits of float32 coordinates.
// Curved faces of ten-node elements count as four flat triangles. Cost: O(n log n).
UnjoinedGeometry find_unjoined(const Model& model);

// Returns a message for each kind: "organ.inp: how many, the first; remedy".
std::vector<std::string> unjoined_messages(const Model& model, const UnjoinedGeometry& found);

// Counts each kind for a line of a plan: "16 nodes at one place, 36 faces on faces"; empty if there is none.
std::string unjoined_counts(const UnjoinedGeometry& found);

// Describes how the part with a node meets another part that it shares no node with: "its nodes 1022, 1038
// lie where nodes 22, 38 are; <remedy>". Empty where it meets none.
std::string part_contact(const Model& model, const UnjoinedGeometry& found, int node);

}  // namespace palpate
