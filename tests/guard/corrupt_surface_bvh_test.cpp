// Opening refuses a surface tree that violates the format, because a search follows the tree's indices
// unchecked. Each test makes one contradiction and repairs the checksum.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "runtime/src/pack/surface_bvh.hpp"
#include "schemas/pack_generated.h"
#include "tests/support/changed_pack.hpp"
#include "tests/support/runtime_session.hpp"
#include "tests/support/small_pack.hpp"

namespace palpate::test {
namespace corrupt_surface_bvh_test {

using Tree = pack::SurfaceBvh;

const pack::Pack& tables() {
  return *pack::GetPack(small_pack_bytes().bytes().data() + sizeof(pack::PackHeader));
}

const Tree& tree() {
  return *tables().surface_bvh();
}

const pack::BvhNode* nodes() {
  return reinterpret_cast<const pack::BvhNode*>(small_pack_bytes().bytes().data() + tree().nodes()->offset());
}

uint32_t first_node(bool leaf) {
  uint32_t node = 0;
  while ((nodes()[node].count > 0) != leaf) ++node;
  return node;
}

// Status after `change` to the array in `segment`.
template <typename T, typename Change>
pal_status status_with(const pack::Segment* segment, Change&& change) {
  AlignedBytes copy = copy_of(small_pack_bytes().bytes());
  change(reinterpret_cast<T*>(copy.bytes().data() + segment->offset()));
  repair_checksum(copy.bytes());
  return open_status(copy.bytes());
}

template <typename Change>
pal_status status_with_nodes(Change&& change) {
  return status_with<pack::BvhNode>(tree().nodes(), change);
}

// Status with `value` in a field of the tree's table.
template <typename T>
pal_status status_with_field(flatbuffers::voffset_t field, const T& value) {
  const auto bytes = small_pack_bytes().bytes();
  const uint8_t* place = reinterpret_cast<const flatbuffers::Table*>(&tree())->GetAddressOf(field);
  AlignedBytes copy = copy_of(bytes);
  memcpy(copy.bytes().data() + (place - bytes.data()), &value, sizeof value);
  repair_checksum(copy.bytes());
  return open_status(copy.bytes());
}

// A copy in which a table lacks a field, as from an older builder.
AlignedBytes without_field(const void* table, flatbuffers::voffset_t field) {
  const auto bytes = small_pack_bytes().bytes();
  const auto* start = static_cast<const unsigned char*>(table);
  flatbuffers::soffset_t to_vtable;
  memcpy(&to_vtable, start, sizeof to_vtable);
  AlignedBytes copy = copy_of(bytes);
  memset(copy.bytes().data() + (start - to_vtable - bytes.data()) + field, 0, sizeof field);
  repair_checksum(copy.bytes());
  return copy;
}

TEST(CorruptSurfaceBvh, WholeOneOpens) {
  EXPECT_EQ(status_with_nodes([](pack::BvhNode*) {}), PAL_STATUS_OK);
  EXPECT_EQ(status_with_field(Tree::VT_NUM_NODES, tree().num_nodes()), PAL_STATUS_OK);
  EXPECT_GT(tree().num_nodes(), 4U);  // else there is no tree to break
}

// A pack from a builder without this table: valid, and a search finds no point.
TEST(CorruptSurfaceBvh, PacksWithoutItStayValid) {
  const AlignedBytes old = without_field(&tables(), pack::Pack::VT_SURFACE_BVH);
  const OpenPack pack(old);
  const double position[3] = {0, 0, 0};
  SurfaceHit hit;
  EXPECT_FALSE(find_nearest_surface_point(*pack.get(), position, 0, hit));
  EXPECT_TRUE(find_nearest_surface_point(*OpenPack(small_pack_bytes()).get(), position, 0, hit));
}

TEST(CorruptSurfaceBvh, SegmentsThatAreMissingMisplacedOrOfAnotherSize) {
  for (const flatbuffers::voffset_t field :
       {Tree::VT_PRIMITIVES, Tree::VT_NODES, Tree::VT_PRIMITIVE_NORMALS, Tree::VT_SITE_NORMALS}) {
    EXPECT_EQ(open_status(without_field(&tree(), field).bytes()), PAL_STATUS_CORRUPT_CONTENT);
    const auto& whole =
        *reinterpret_cast<const flatbuffers::Table*>(&tree())->GetStruct<const pack::Segment*>(field);
    const auto with = [&](uint64_t offset, uint64_t bytes) {
      return status_with_field(field, pack::Segment(offset, bytes));
    };
    EXPECT_EQ(with(whole.offset(), whole.bytes()), PAL_STATUS_OK);
    EXPECT_EQ(with(whole.offset() + 4, whole.bytes()), PAL_STATUS_CORRUPT_CONTENT);
    EXPECT_EQ(with(0, whole.bytes()), PAL_STATUS_CORRUPT_CONTENT);
    EXPECT_EQ(with(uint64_t{1} << 40, whole.bytes()), PAL_STATUS_CORRUPT_CONTENT);
    EXPECT_EQ(with(whole.offset(), whole.bytes() - 4), PAL_STATUS_CORRUPT_CONTENT);
    EXPECT_EQ(with(whole.offset(), whole.bytes() - 32), PAL_STATUS_CORRUPT_CONTENT);
    EXPECT_EQ(with(whole.offset(), 0), PAL_STATUS_CORRUPT_CONTENT);
  }
  for (const flatbuffers::voffset_t field : {Tree::VT_NUM_PRIMITIVES, Tree::VT_NUM_NODES}) {
    for (const uint32_t count : {0U, 1U, tree().num_nodes() + 1, 0xffffffffU})
      EXPECT_EQ(status_with_field(field, count), PAL_STATUS_CORRUPT_CONTENT) << field << ' ' << count;
  }
}

TEST(CorruptSurfaceBvh, CornersThatAreNoSites) {
  for (const uint32_t site : {tables().sites()->num_sites(), 0xffffffffU}) {
    EXPECT_EQ(status_with<uint32_t>(tree().primitives(), [&](uint32_t* corners) { corners[4] = site; }),
              PAL_STATUS_CORRUPT_CONTENT);
  }
}

TEST(CorruptSurfaceBvh, BoxesThatDoNotHoldTheirChildren) {
  const uint32_t leaf = first_node(true);
  const float nan = std::nanf("");
  const float infinity = std::numeric_limits<float>::infinity();
  for (const uint32_t node : {0U, leaf}) {
    for (const float bound : {nan, infinity, 1e20f, 0.6f}) {  // 0.6 is above the whole block
      EXPECT_EQ(status_with_nodes([&](pack::BvhNode* n) { n[node].min[0] = bound; }),
                PAL_STATUS_CORRUPT_CONTENT)
          << node << ' ' << bound;
    }
    for (const float bound : {nan, -infinity, -1e20f, -0.1f}) {
      EXPECT_EQ(status_with_nodes([&](pack::BvhNode* n) { n[node].max[0] = bound; }),
                PAL_STATUS_CORRUPT_CONTENT)
          << node << ' ' << bound;
    }
  }
  // An infinite box holds every point, but distances to the box overflow. A leaf must stay in the root's box.
  EXPECT_EQ(status_with_nodes([&](pack::BvhNode* n) { n[0].max[1] = infinity; }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(status_with_nodes([&](pack::BvhNode* n) { n[0].min[1] = -3e15f; }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(status_with_nodes([&](pack::BvhNode* n) { n[leaf].max[1] = 10; }), PAL_STATUS_CORRUPT_CONTENT);
  // A box that is too large costs time, and the result stays right.
  EXPECT_EQ(status_with_nodes([&](pack::BvhNode* n) { n[0].max[1] = 10; }), PAL_STATUS_OK);
}

TEST(CorruptSurfaceBvh, ChildrenThatAreNoTree) {
  const uint32_t interior = first_node(false);
  const uint32_t count = tree().num_nodes();
  const uint32_t right = nodes()[interior].first;
  // The node itself, its left child, a node before it, an index past the end, the middle of a subtree.
  for (const uint32_t child :
       {interior, interior + 1, 0U, count, count + 7, 0xffffffffU, right - 1, right + 1}) {
    EXPECT_EQ(status_with_nodes([&](pack::BvhNode* n) { n[interior].first = child; }),
              PAL_STATUS_CORRUPT_CONTENT)
        << child;
  }
}

TEST(CorruptSurfaceBvh, LeavesThatSkipOrRepeatPrimitives) {
  const uint32_t leaf = first_node(true);
  const pack::BvhNode whole = nodes()[leaf];
  for (const uint32_t first : {whole.first + 1, whole.first - 1, tree().num_primitives(), 0xffffffffU}) {
    EXPECT_EQ(status_with_nodes([&](pack::BvhNode* n) { n[leaf].first = first; }), PAL_STATUS_CORRUPT_CONTENT)
        << first;
  }
  for (const uint32_t count : {0U, whole.count - 1, whole.count + 1, 5U, 0xffffffffU}) {
    if (count == whole.count) continue;
    EXPECT_EQ(status_with_nodes([&](pack::BvhNode* n) { n[leaf].count = count; }), PAL_STATUS_CORRUPT_CONTENT)
        << count;
  }
  const uint32_t last = tree().num_nodes() - 1;
  EXPECT_EQ(status_with_nodes([&](pack::BvhNode* n) { ++n[last].count; }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(status_with_nodes([&](pack::BvhNode* n) { n[last].count = 0; }), PAL_STATUS_CORRUPT_CONTENT);
}

TEST(CorruptSurfaceBvh, NormalsThatAreNotUnit) {
  for (const pack::Segment* segment : {tree().primitive_normals(), tree().site_normals()}) {
    const size_t last = segment->bytes() / sizeof(float) - 3;
    for (const size_t at : {size_t{0}, last}) {
      const auto scaled = [&](float factor) {
        return status_with<float>(segment, [&](float* normals) {
          for (size_t i = 0; i < 3; ++i) normals[at + i] *= factor;
        });
      };
      EXPECT_EQ(scaled(-1), PAL_STATUS_OK);
      for (const float factor : {0.0f, 0.999f, 1.001f, 1e20f, std::nanf("")})
        EXPECT_EQ(scaled(factor), PAL_STATUS_CORRUPT_CONTENT) << factor;
    }
  }
}

// A degenerate tree: sites on a line, one a leaf, in a chain of `depth` edges that always goes right or
// always left.
struct Chain {
  Chain(uint32_t depth, bool to_the_right) {
    const uint32_t count = depth + 1;
    for (uint32_t i = 0; i < count; ++i) {
      positions.insert(positions.end(), {static_cast<double>(i), 0, 0});
      sites.push_back(i);
      primitives.insert(primitives.end(), 3, i);
    }
    const auto box = [](uint32_t from, uint32_t to) {
      return pack::BvhNode{{static_cast<float>(from), 0, 0}, 0, {static_cast<float>(to), 0, 0}, 0};
    };
    const auto leaf = [&](uint32_t i) {
      pack::BvhNode node = box(i, i);
      node.first = i;
      node.count = 1;
      return node;
    };
    for (uint32_t i = 0; i < depth; ++i) {
      nodes.push_back(to_the_right ? box(i, depth) : box(0, depth - i));
      nodes.back().first = to_the_right ? 2 * i + 2 : 2 * depth - i;
      if (to_the_right) nodes.push_back(leaf(i));
    }
    nodes.push_back(leaf(to_the_right ? depth : 0));
    for (uint32_t i = 1; i <= depth && !to_the_right; ++i) nodes.push_back(leaf(i));
    normals.assign(size_t{12} * count, 0);
    for (size_t i = 2; i < normals.size(); i += 3) normals[i] = 1;
    pack.positions = pack.rest_positions = positions.data();
    pack.num_sites = pack.num_primitives = count;
    pack.site_nodes = sites.data();
    pack.primitives = primitives.data();
    pack.num_bvh_nodes = static_cast<uint32_t>(nodes.size());
    pack.bvh_nodes = nodes.data();
    pack.primitive_normals = pack.site_normals = normals.data();
  }

  std::vector<double> positions;
  std::vector<uint32_t> sites;
  std::vector<uint32_t> primitives;
  std::vector<pack::BvhNode> nodes;
  std::vector<float> normals;
  pal_pack pack = {};
};

TEST(CorruptSurfaceBvh, TreesThatLeaveSomethingOut) {
  EXPECT_TRUE(is_surface_tree(Chain(5, true).pack));
  Chain primitives(5, true);  // more primitives than the leaves hold
  primitives.primitives.insert(primitives.primitives.end(), 3, 0);
  primitives.pack.primitives = primitives.primitives.data();
  ++primitives.pack.num_primitives;
  EXPECT_FALSE(is_surface_tree(primitives.pack));
  Chain fewer(5, true);  // AddressSanitizer sees a check that reads on
  const std::vector<uint32_t> exactly(fewer.primitives.begin(), fewer.primitives.end() - 3);
  fewer.pack.primitives = exactly.data();
  --fewer.pack.num_primitives;
  EXPECT_FALSE(is_surface_tree(fewer.pack));
  Chain node(5, true);  // a node without a parent
  node.nodes.push_back(node.nodes.back());
  node.pack.bvh_nodes = node.nodes.data();
  ++node.pack.num_bvh_nodes;
  EXPECT_FALSE(is_surface_tree(node.pack));
  node.pack.num_bvh_nodes = 0;
  EXPECT_FALSE(is_surface_tree(node.pack));
}

TEST(CorruptSurfaceBvh, LeavesThatAreTooLargeOrTooSmallForTheirPrimitives) {
  for (const uint32_t count : {1U, 4U, 5U, 100U}) {
    Chain chain(count - 1, true);
    chain.nodes = {chain.nodes[0]};
    chain.nodes[0].first = 0;
    chain.nodes[0].count = count;
    chain.pack.bvh_nodes = chain.nodes.data();
    chain.pack.num_bvh_nodes = 1;
    EXPECT_EQ(is_surface_tree(chain.pack), count <= pack::kMostLeafPrimitives) << count;
    chain.nodes[0].max[0] -= 0.5f;
    EXPECT_FALSE(is_surface_tree(chain.pack)) << count;
  }
}

// A search of the deepest valid tree stays within its stack, from any side, under AddressSanitizer.
TEST(CorruptSurfaceBvh, DepthIsBounded) {
  for (const bool to_the_right : {false, true}) {
    for (const uint32_t depth : {1U, 7U, pack::kMostBvhDepth}) {
      const Chain chain(depth, to_the_right);
      ASSERT_TRUE(is_surface_tree(chain.pack)) << depth;
      for (uint32_t site = 0; site <= depth; ++site) {
        // From afar rounding makes all distances equal, so every node stays on the stack.
        for (const double away : {0.25, 1e15}) {
          const double position[3] = {site + 0.25, 0, away};
          SurfaceHit hit;
          ASSERT_TRUE(find_nearest_surface_point(chain.pack, position, depth - site, hit));
          EXPECT_TRUE(away > 1 || hit.primitive == site);
        }
      }
    }
    EXPECT_FALSE(is_surface_tree(Chain(pack::kMostBvhDepth + 1, to_the_right).pack));
    EXPECT_FALSE(is_surface_tree(Chain(1000, to_the_right).pack));
  }
}

}  // namespace corrupt_surface_bvh_test
}  // namespace palpate::test
