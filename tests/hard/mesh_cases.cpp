// Meshes: slivers, degenerate tetrahedra, nodes without elements, several parts, organs from elsewhere.
#include <fmt/core.h>

#include <cstdlib>
#include <filesystem>

#include "offline/mesh/inp_reader.hpp"
#include "tests/hard/hard_bodies.hpp"
#include "tests/hard/hard_cases.hpp"
#include "tests/support/block_mesh.hpp"
#include "tests/support/inp_text.hpp"
#include "tests/support/temp_dir.hpp"

namespace palpate::hard {
namespace {

Model read_text(const std::string& text, const std::filesystem::path& include_root = {}) {
  const test::TempDir dir;
  return read_inp(dir.write("organ.inp", text), include_root);
}

// Four sites about the middle of a unit block's top.
OrganSpec four_sites(Model model, double max_displacement, double tip_radius) {
  OrganSpec spec = touched(std::move(model), max_displacement, tip_radius);
  const auto from_middle = [&](int node) {
    return (spec.model.positions[static_cast<size_t>(node)] - Eigen::Vector3d(0.5, 0.5, 1)).norm();
  };
  std::sort(spec.sites.begin(), spec.sites.end(),
            [&](int a, int b) { return from_middle(a) < from_middle(b); });
  spec.sites.resize(std::min<size_t>(spec.sites.size(), 4));
  std::sort(spec.sites.begin(), spec.sites.end());
  return spec;
}

std::vector<Answer> slivers_solved(double flatness) {
  const test::SolverScene scene = test::moved_top(test::block_with_slivers(flatness), {0.15, 0.05, -0.2});
  return {solved_on_two_paths(scene, test::nodes_on_plane(scene.model, 2, 1.0), 0.25)};
}

std::vector<Answer> slivers_packed(double flatness, const Bar& bar) {
  const Organ& organ = shared_organ(fmt::format("slivers {}", flatness), [&] {
    return four_sites(test::with_fixed_base(test::block_with_slivers(flatness)), 0.12, 0.2);
  });
  return pushed_four_ways(organ, organ.site_near({0.5, 0.5, 1}), 0.12, bar);
}

// Reads a model that the reader must refuse; the message is the answer.
std::vector<Answer> read_only(const std::string& text) {
  Answer answer;
  answer.by = "read";
  try {
    read_text(text);
    answer.happened = "accepted";
  } catch (const std::exception& error) {
    const std::string message = error.what();
    answer = refused("read", message.substr(message.rfind('/') + 1));
  }
  return {answer};
}

std::vector<Answer> with_orphans(const Bar& bar) {
  const std::string orphans = "*NODE\n900, 5, 5, 5\n901, -1e6, 0, 1e6\n";
  const auto spec_of = [](const std::string& text) {
    OrganSpec spec;
    spec.model = read_text(text);
    for (const int label : {54, 55, 58, 59}) spec.sites.push_back(spec.model.find_node(label));
    spec.max_displacement = 0.05;
    spec.tip_radius = 0.13;
    return spec;
  };
  const Organ& without = shared_organ("no orphans", [&] { return spec_of(test::block_inp(3)); });
  const Organ& organ = shared_organ("orphans", [&] { return spec_of(test::block_inp(3) + orphans); });
  const std::vector<pal_contact> contacts = {push(0, {0.01, 0.02, -0.04})};
  std::vector<Answer> answers = worst_of({ask_all(organ, contacts)}, bar);
  // The pack equals the pack of the mesh without these nodes; the reader warns of them.
  answers.push_back(organ.ask(PAL_MODEL_AUTO, contacts, without.solve(contacts)));
  answers.back().by = "beside the mesh without";
  answers.back().finite = answers.back().finite && !organ.model().warnings.empty();
  return answers;
}

// Two blocks side by side, 1 apart. `both_held` holds the second block, too.
Model two_blocks(bool both_held) {
  Model model = unit_block(3);
  const Model other = unit_block(3);
  const int first = model.num_nodes();
  for (int node = 0; node < first; ++node) {
    model.positions.push_back(other.positions[static_cast<size_t>(node)] + Eigen::Vector3d(2, 0, 0));
    model.labels.push_back(model.labels[static_cast<size_t>(node)] + 1000);
    model.label_index.emplace_back(model.labels.back(), first + node);
  }
  for (Tetrahedron element : other.elements) {
    element.label += 1000;
    for (int& node : element.nodes()) node += first;
    model.elements.push_back(element);
  }
  if (both_held) {
    for (PrescribedDisplacement held : other.fixed) {
      held.node += first;
      model.fixed.push_back(held);
    }
  }
  return model;
}

std::vector<Answer> two_parts(const Bar& bar) {
  const Organ& organ = shared_organ("two parts", [] {
    OrganSpec spec;
    spec.model = two_blocks(true);
    spec.max_displacement = 0.15;
    spec.tip_radius = 0.34;
    for (const int node : test::nodes_on_plane(spec.model, 2, 1.0)) {
      Eigen::Vector3d at = spec.model.positions[static_cast<size_t>(node)];
      if (at.x() > 1.5) at.x() -= 2;
      if (at.x() > 0.1 && at.x() < 0.9 && at.y() > 0.1 && at.y() < 0.5) spec.sites.push_back(node);
    }
    return spec;
  });
  const std::uint32_t left = organ.site_near({0.3, 0.3, 1});
  const std::uint32_t right = organ.site_near({2.3, 0.3, 1});
  return worst_of({ask_all(organ, {push(left, {0.05, 0, -0.1}), push(right, {0, -0.1, -0.05})}),
                   ask_all(organ, {push(left, {0, 0, -0.14}), push(right, {0, 0, 0})})},
                  bar);
}

// An organ in the folder that PALPATE_HARD_MESHES names: mesh, FIXED and CONTACT.
std::vector<Answer> organ_of(const std::string& file, double edges, const Bar& bar) {
  const char* folder = std::getenv("PALPATE_HARD_MESHES");
  const std::filesystem::path mesh = std::filesystem::path(folder == nullptr ? "" : folder) / file;
  if (folder == nullptr || !std::filesystem::exists(mesh)) {
    Answer absent;
    absent.by = "read";
    absent.present = false;
    absent.happened = "PALPATE_HARD_MESHES names no folder with " + file;
    return {absent};
  }
  const Organ& organ = shared_organ(fmt::format("{} {}", file, edges), [&] {
    OrganSpec spec;
    spec.model = read_text(
        "*INCLUDE, INPUT=" + std::filesystem::absolute(mesh).string() +
            "\n*MATERIAL, NAME=TISSUE\n*HYPERELASTIC, COMPRESSIBLE NEO HOOKE\n1, 4\n*SOLID SECTION, "
            "ELSET=ORGAN, MATERIAL=TISSUE\n*BOUNDARY\nFIXED, 1, 3\n",
        std::filesystem::absolute(mesh).parent_path());
    spec.sites = spec.model.node_sets.at("CONTACT");
    const double edge = extract_surface(spec.model).mean_edge;
    spec.max_displacement = edges * edge;
    spec.tip_radius = edge;
    return spec;
  });
  std::vector<std::vector<Answer>> sets;
  for (std::uint32_t site = 0; site < organ.num_sites(); ++site)
    sets.push_back(pushed_four_ways(organ, site, organ.scene().max_displacement, bar));
  return worst_of(sets, bar);
}

}  // namespace

Group mesh_cases() {
  Group group{"mesh",
              "Meshes",
              "Slivers that are solved and packed; what is no mesh of tetrahedra, refused by name; nodes of "
              "no element, two parts, and "
              "two organs as they come out of segmentation, with dihedral angles from 0.2 degrees, pushed by "
              "half an edge and by one.",
              {}};
  const auto add = [&](const std::string& name, const std::string& hard, const Bar& bar, auto run) {
    group.cases.push_back({"mesh", name, hard, bar, Expected::answer, "", run});
  };
  const Bar other_path = {1e-6, 1e-6};
  const Bar pack = {0.02, 0.02};
  for (const auto& [flatness, shown] : {std::pair{1e-2, "1e2"}, {1e-3, "1e3"}, {1e-6, "1e6"}}) {
    add(fmt::format("slivers_{}_solved", shown),
        fmt::format("27 slivers {} times flatter than the cells, block compressed and sheared", shown),
        other_path, [flatness = flatness] { return slivers_solved(flatness); });
  }
  for (const auto& [flatness, shown] : {std::pair{1e-2, "1e2"}, {1e-3, "1e3"}, {1e-6, "1e6"}}) {
    add(fmt::format("slivers_{}_pack", shown),
        fmt::format("27 slivers {} times flatter than the cells, packed", shown), pack,
        [flatness = flatness, pack] { return slivers_packed(flatness, pack); });
  }
  const auto refuse = [&](const std::string& name, const std::string& hard, const std::string& text) {
    group.cases.push_back(
        {"mesh", name, hard, {}, Expected::nothing, "", [text] { return read_only(text); }});
  };
  using test::kBody;
  using test::with_line;
  refuse("inverted", "an inverted element", with_line(8, "1, 2, 1, 3, 4"));
  refuse("mixed_orientation", "elements of both orientations", with_line(9, "2, 5, 2, 3, 4"));
  refuse("flat", "a flat element", with_line(6, "5, 0.5, 0.5, 0"));
  refuse("twice", "the same element twice", with_line(9, "2, 2, 5, 3, 4\n3, 2, 5, 3, 4"));
  refuse("three_on_a_face", "three elements on one face",
         with_line(6, "5, 1, 1, 1\n6, 2, 1, 1", with_line(9, "2, 2, 5, 3, 4\n3, 2, 6, 3, 4")));
  refuse("overlapping", "two elements on the same side of a face",
         with_line(6, "5, 1, 1, 1\n6, 2, 1, 1", with_line(8, "1, 2, 6, 3, 4")));
  refuse("unheld", "nothing held", with_line(16, "", with_line(17, "")));
  refuse("hinge", "held along a line alone, so that it can turn", with_line(11, "1, 2"));
  refuse("loose_part", "a second part that nothing holds",
         with_line(6, "5, 1, 1, 1\n11, 5, 0, 0\n12, 6, 0, 0\n13, 5, 1, 0\n14, 5, 0, 1",
                   with_line(9, "2, 2, 5, 3, 4\n3, 11, 12, 13, 14")));
  refuse("not_a_number", "a coordinate that is not a number", with_line(6, "5, nan, 1, 1"));
  refuse("overflow", "coordinates whose volume overflows", with_line(6, "5, 1e150, 1e150, 1e150"));
  add("ten_nodes", "ten-node elements with curved edges", pack, [pack] {
    const Organ& organ = shared_organ(
        "ten nodes", [] { return four_sites(test::with_middle_nodes(unit_block(2), 0.03), 0.15, 0.3); });
    return pushed_four_ways(organ, 0, 0.15, pack);
  });
  add("layer", "a layer ten times as wide as thick on a fixed base, pushed by a third of its thickness", pack,
      [pack] {
        const Organ& organ = shared_organ("layer", [] {
          Model model = unit_block(6);
          for (Eigen::Vector3d& position : model.positions) position.z() *= 0.1;
          OrganSpec spec;
          for (const int node : test::nodes_on_plane(model, 2, 0.1)) {
            const Eigen::Vector3d& at = model.positions[static_cast<size_t>(node)];
            if (std::abs(at.x() - 0.5) < 0.2 && std::abs(at.y() - 0.5) < 0.2) spec.sites.push_back(node);
          }
          spec.model = std::move(model);
          spec.max_displacement = 0.033;
          spec.tip_radius = 0.17;
          return spec;
        });
        return pushed_four_ways(organ, 0, 0.033, pack);
      });
  add("orphans", "nodes of no element, one of them a million away", pack,
      [pack] { return with_orphans(pack); });
  add("two_parts", "two parts, contacts on both", pack, [pack] { return two_parts(pack); });
  for (const auto& [edges, shown] : {std::pair{0.5, "half"}, {1.0, "one"}}) {
    add(fmt::format("heart_{}", shown),
        fmt::format("rabbit heart of 172 nodes, pushed by {} edge", edges < 1 ? "half an" : "one"), pack,
        [edges = edges, pack] { return organ_of("heart_rabbit_ucsd_172.inp", edges, pack); });
  }
  for (const auto& [edges, shown] : {std::pair{0.5, "half_an_edge"}, {1.0, "one_edge"}}) {
    add(fmt::format("gallbladder_{}", shown),
        fmt::format("gallbladder of 366 nodes, all of them surface, pushed by {:g} edges", edges), pack,
        [edges = edges, pack] { return organ_of("gallbladder_sofaenv_366.inp", edges, pack); });
  }
  return group;
}

}  // namespace palpate::hard
