#include "offline/precompute/scene.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "offline/mesh/geometry_check.hpp"
#include "offline/mesh/inp_reader.hpp"
#include "offline/mesh/input_error.hpp"
#include "offline/mesh/model_check.hpp"
#include "offline/mesh/nearest_name.hpp"
#include "offline/mesh/surface.hpp"
#include "offline/mesh/text_number.hpp"
#include "offline/mesh/volume_patches.hpp"
#include "offline/precompute/scene_table.hpp"
#include "schemas/pack_layout.hpp"

namespace palpate {
namespace {

constexpr const char* kSites = "a node set, an array of node labels, or \"surface\"";

void read_units(const SceneTable& units, Scene& scene) {
  units.allow({"length", "force"});
  const std::vector<std::string> lengths = {"m", "km", "cm", "mm", "um"};
  const std::vector<double> metres = {1, 1e3, 1e-2, 1e-3, 1e-6};
  const std::vector<std::string> forces = {"N", "kN", "mN", "uN"};
  const std::vector<double> newtons = {1, 1e3, 1e-3, 1e-6};
  const std::optional<std::size_t> length = units.choice("length", lengths);
  const std::optional<std::size_t> force = units.choice("force", forces);
  if (length.has_value() != force.has_value()) {
    const char* given = length ? "length" : "force";
    const char* missing = length ? "force" : "length";
    units.fail(given,
               units.path(given) + " is given without " + units.path(missing) + "; give both or neither");
  }
  if (!length) return;
  scene.length_unit = lengths[*length];
  scene.metres_per_length_unit = metres[*length];
  scene.force_unit = forces[*force];
  scene.newtons_per_force_unit = newtons[*force];
}

void read_contact(const SceneTable& contact, Scene& scene) {
  contact.allow({"sites", "sampled", "max_displacement", "directions", "tip_radius", "max_contacts"});
  const std::optional<double> displacement = contact.number_above_zero("max_displacement");
  if (!displacement) {
    contact.fail("max_displacement",
                 "contact.max_displacement is missing; add how far a tool may push, such as "
                 "max_displacement = 6.0");
  }
  scene.max_displacement = *displacement;
  if (scene.max_displacement < 1e-15 || scene.max_displacement > 1e15) {
    contact.fail("max_displacement",
                 "contact.max_displacement lies outside 1e-15 to 1e15; state the model in other units");
  }
  if (contact.choice("directions", {"all", "inward"}) == 1) scene.directions = Directions::inward;
  constexpr SampledSites kSampled[] = {SampledSites::automatic, SampledSites::all, SampledSites::fewest};
  scene.sampled_sites = kSampled[contact.choice("sampled", {"auto", "all", "fewest"}).value_or(0)];
  scene.tip_radius = contact.number_from_zero("tip_radius").value_or(scene.tip_radius);
  if (scene.tip_radius > 1e15) {
    contact.fail("tip_radius",
                 "contact.tip_radius is above 1e15; correct it, or state the model in other units");
  }
  scene.max_contacts = contact.integer("max_contacts", 1, pack::kMostContacts).value_or(scene.max_contacts);
}

void read_gravity(const SceneTable& gravity, Scene& scene) {
  gravity.allow({"acceleration", "may_turn"});
  const std::optional<std::array<double, 3>> acceleration = gravity.vector("acceleration");
  if (!acceleration) {
    gravity.fail("acceleration",
                 "gravity.acceleration is missing; add acceleration = [gx, gy, gz] in the model's units");
  }
  scene.gravity = Eigen::Vector3d(acceleration->data());
  const double size = scene.gravity->norm();
  if (!(size >= 1e-15 && size <= 1e15)) {
    gravity.fail("acceleration", "gravity.acceleration is zero, or outside 1e-15 to 1e15; correct it");
  }
  scene.gravity_may_turn = gravity.boolean("may_turn").value_or(false);
}

void check_densities(const SceneTable& gravity, const Model& model) {
  for (const Tetrahedron& element : model.elements) {
    const Material& material = model.materials[static_cast<std::size_t>(element.material)];
    if (material.density > 0) continue;
    gravity.fail("acceleration", "gravity pulls at mass, and material " + printable(material.name) + " of " +
                                     model.file + " has none; add *DENSITY to it");
  }
}

void read_models(const SceneTable& models, Scene& scene) {
  models.allow({"linear", "polynomial", "polynomial_method", "zone", "zone_rings", "compliance"});
  scene.linear = models.boolean_or_auto("linear").value_or(true);
  scene.polynomial = models.boolean_or_auto("polynomial").value_or(true);
  constexpr PolynomialMethod kMethods[] = {PolynomialMethod::hermite, PolynomialMethod::paper_grid,
                                           PolynomialMethod::paper_ray};
  scene.polynomial_method =
      kMethods[models.choice("polynomial_method", {"hermite", "paper_grid", "paper_ray"}).value_or(0)];
  constexpr ComplianceForm kForms[] = {ComplianceForm::automatic, ComplianceForm::dense,
                                       ComplianceForm::compressed};
  scene.compliance = kForms[models.choice("compliance", {"auto", "dense", "compressed"}).value_or(0)];
  scene.zone = models.boolean_or_auto("zone");
  scene.zone_rings = models.integer("zone_rings", 1, static_cast<int>(pack::kMostZoneRings)).value_or(0);
  const bool is_zone_required = scene.zone.value_or(false);
  if (models.has("zone_rings") && !is_zone_required)
    models.fail("zone_rings", "models.zone_rings is for models.zone = true; add it");
  if (!scene.linear && !scene.polynomial && !is_zone_required) {
    models.fail("linear",
                "models.linear and models.polynomial are both false: nothing is left to answer with; "
                "carry one of them, or write models.zone = true");
  }
  if (scene.gravity_may_turn && !scene.linear) {
    models.fail("linear", "gravity.may_turn needs the linear model; remove models.linear = false");
  }
}

void read_precision(const SceneTable& output, Scene& scene) {
  constexpr FieldPrecision kPrecisions[] = {FieldPrecision::automatic, FieldPrecision::real,
                                            FieldPrecision::rounded};
  constexpr const char* kReal = sizeof(pack::Real) == sizeof(float) ? "f32" : "f64";
  scene.precision = kPrecisions[output.choice("precision", {"auto", kReal, "i16"}).value_or(0)];
}

// Finds a node set of the model by its exact name, else by its normalised name.
const std::vector<int>& node_set(const SceneTable& table, std::string_view key, const std::string& name,
                                 const Model& model) {
  if (name.empty()) table.fail(key, table.path(key) + " is empty; name a node set of " + model.file);
  auto found = model.node_sets.find(name);
  if (found == model.node_sets.end()) found = model.node_sets.find(normalised_name(name));
  if (found == model.node_sets.end()) {
    std::vector<std::string> names = {"surface"};
    for (const auto& [known, nodes] : model.node_sets) names.push_back(known);
    std::string remedy = did_you_mean(name, names);
    if (remedy.empty()) remedy = "; name one of its node sets, or \"surface\"";
    table.fail(key, table.path(key) + ": node set " + printable(name) + " is not in " + model.file + remedy);
  }
  if (found->second.empty()) {
    table.fail(key, table.path(key) + ": node set " + printable(name) + " is empty; add nodes to it");
  }
  return found->second;
}

// A model, with its surface and its fixed nodes marked.
struct Body {
  const Model& model;
  Surface surface;
  std::vector<char> on_surface;
  std::vector<char> fixed;  // nodes with any fixed dof; a tool cannot move them

  explicit Body(const Model& checked)
      : model(checked),
        surface(extract_surface(checked)),
        on_surface(checked.positions.size(), 0),
        fixed(checked.fixed_nodes()) {
    for (const int node : surface.nodes) on_surface[static_cast<std::size_t>(node)] = 1;
  }

  bool is_on_surface(int node) const { return on_surface[static_cast<std::size_t>(node)] != 0; }
  bool is_fixed(int node) const { return fixed[static_cast<std::size_t>(node)] != 0; }
};

std::vector<int> labelled_nodes(const SceneTable& contact, const Model& model) {
  std::vector<int> nodes;
  for (const int label : contact.integers("sites", kSites).value_or(std::vector<int>())) {
    const int node = model.find_node(label);
    if (node < 0) {
      contact.fail("sites", "contact.sites: node " + std::to_string(label) + " is not in " + model.file +
                                "; correct it");
    }
    nodes.push_back(node);
  }
  if (nodes.empty()) contact.fail("sites", "contact.sites is empty; name a node");
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  return nodes;
}

std::vector<int> read_sites(const SceneTable& contact, const Body& body) {
  if (!contact.has("sites")) {
    contact.fail("sites", std::string("contact.sites is missing; add ") + kSites);
  }
  std::vector<int> sites;
  if (contact.is_string("sites") && contact.string("sites") == "surface") {
    for (const int node : body.surface.nodes) {
      if (!body.is_fixed(node)) sites.push_back(node);
    }
    if (sites.empty()) contact.fail("sites", "contact.sites: every surface node is fixed; release some");
    return sites;
  }
  sites = contact.is_string("sites")
              ? node_set(contact, "sites", contact.string("sites").value_or(""), body.model)
              : labelled_nodes(contact, body.model);
  for (const int node : sites) {
    const std::string subject =
        "contact.sites: node " + std::to_string(body.model.labels[static_cast<std::size_t>(node)]);
    if (!body.is_on_surface(node)) {
      contact.fail("sites", subject + " is not on the surface, where no tool reaches it; take it out");
    }
    if (body.is_fixed(node)) {
      contact.fail(
          "sites",
          subject + " is fixed by *BOUNDARY along an axis at least, so no tool can move it; take it out");
    }
  }
  return sites;
}

std::vector<int> read_output_nodes(const SceneTable& output, const Scene& scene, const Body& body) {
  std::set<int> nodes;
  const std::string shown = output.string("nodes").value_or("surface");
  if (shown == "surface") {
    nodes.insert(body.surface.nodes.begin(), body.surface.nodes.end());
  } else if (shown == "all") {
    for (const Tetrahedron& element : body.model.elements)
      nodes.insert(element.nodes().begin(), element.nodes().end());
  } else {
    const std::vector<int>& set = node_set(output, "nodes", shown, body.model);
    nodes.insert(set.begin(), set.end());
  }
  for (const int site : scene.sites) {
    for (const int node : nodes_within(body.surface, site, scene.tip_radius)) {
      if (!body.is_fixed(node)) nodes.insert(node);
    }
  }
  return {nodes.begin(), nodes.end()};
}

// Refuses a model that is not one body, unless the scene says that its bodies are separate.
void check_joined(const SceneTable& top, const Model& model, Scene& scene) {
  const bool is_meant = top.boolean("separate_bodies").value_or(false);
  const UnjoinedGeometry found = find_unjoined(model);
  if (found.empty()) return;
  if (is_meant) {
    scene.kept_apart = unjoined_counts(found);
    return;
  }
  std::string list;
  for (const std::string& message : unjoined_messages(model, found)) list += "\n  " + message;
  top.fail("model",
           "the model has elements that meet without common nodes, so that nothing passes from one to the "
           "other; join them, or write separate_bodies = true if they are bodies of their own:" +
               list);
}

Model read_model(const SceneTable& top, const std::filesystem::path& include_root, Scene& scene) {
  const std::optional<std::string> name = top.string("model");
  if (!name || name->empty()) top.fail("model", "model is missing; add model = \"organ.inp\"");
  scene.model_file = *name;
  if (scene.model_file.is_relative()) scene.model_file = scene.file.parent_path() / scene.model_file;
  std::error_code error;
  if (!std::filesystem::is_regular_file(scene.model_file, error)) {
    top.fail("model", "model " + printable(scene.model_file.string()) + " is not a file; correct its name");
  }
  if (normalised_name(scene.model_file.extension().string()) != ".INP") {
    top.fail("model", "model " + printable(*name) +
                          " is not an .inp file and has no law and no supports; run `palpate new " +
                          printable(*name) + "`, and name the .inp file that it writes");
  }
  const double merge_length = top.number_above_zero("merge").value_or(0);
  Model model = read_inp(scene.model_file, include_root, merge_length);
  check_joined(top, model, scene);
  if (!model.steps.empty()) {
    const SourceLine& step = model.steps.front().source;
    check_held(model, model.fixed, {model.file, 0});
    model.warnings.push_back(
        step.file + ":" + std::to_string(step.line) +
        ": a build takes NLGEOM from *STEP and ignores the rest: only what is held before it counts");
  }
  if (const std::string message = hinged_message(model, model.fixed); !message.empty())
    throw InputError(message);
  for (const Material& material : model.materials) {
    if (!std::holds_alternative<LinearElastic>(material.law)) continue;
    model.warnings.push_back(
        model.file + ": material " + printable(material.name) +
        " is *ELASTIC at small strain, so that the organ answers linearly; for large pushes add "
        "a *STEP, NLGEOM, or a *HYPERELASTIC law");
  }
  return model;
}

}  // namespace

bool rounds_fields(const Scene& scene) {
  constexpr double kLeastTarget = 5e-4;
  return scene.precision == FieldPrecision::rounded ||
         (scene.precision == FieldPrecision::automatic && sizeof(pack::Real) == sizeof(float) &&
          scene.accuracy_target >= kLeastTarget);
}

LoadedScene read_scene(const std::filesystem::path& file, const std::filesystem::path& include_root) {
  const toml::table parsed = parse_toml(file.string());
  const SceneTable top(parsed, "", file.string());
  LoadedScene loaded;
  Scene& scene = loaded.scene;
  scene.file = file;
  top.allow({"model", "merge", "separate_bodies", "units", "contact", "output", "accuracy", "budget",
             "gravity", "models"});

  // Check the scene itself before the model, which may take longer to read.
  read_units(top.table("units"), scene);
  if (!top.has("contact"))
    top.fail("contact", "[contact] is missing; add it with sites and max_displacement");
  const SceneTable contact = top.table("contact");
  read_contact(contact, scene);
  const SceneTable output = top.table("output");
  output.allow({"nodes", "precision", "embed_inputs"});
  scene.embed_inputs = output.boolean("embed_inputs").value_or(true);
  read_precision(output, scene);
  const SceneTable accuracy = top.table("accuracy");
  accuracy.allow({"target"});
  scene.accuracy_target = accuracy.number_above_zero("target").value_or(scene.accuracy_target);
  const SceneTable budget = top.table("budget");
  budget.allow({"frame_us"});
  scene.frame_budget_us = budget.number_above_zero("frame_us").value_or(scene.frame_budget_us);
  const SceneTable gravity = top.table("gravity");
  if (top.has("gravity")) read_gravity(gravity, scene);
  read_models(top.table("models"), scene);

  loaded.model = read_model(top, include_root, scene);
  if (scene.zone.value_or(false) && shares_linear_volumes(loaded.model)) {
    top.table("models").fail(
        "zone",
        "a nonlinear zone cannot hold elements that share their volume (MEAN DILATATION, C3D10H) "
        "where the material is *ELASTIC at small strain; remove models.zone = true, or add a "
        "*STEP, NLGEOM");
  }
  if (scene.gravity) check_densities(gravity, loaded.model);
  const Body body(loaded.model);
  scene.sites = read_sites(contact, body);
  scene.output_nodes = read_output_nodes(output, scene, body);
  return loaded;
}

}  // namespace palpate
